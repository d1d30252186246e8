"""The options that every command shares, and what they do with its result."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, wraps
from inspect import Parameter, signature
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Annotated

import typer

from cli.errors import one_line
from cli.read.files import named, refuse_inputs
from cli.show.colour import coloured

if TYPE_CHECKING:
    from cli.show.columns import Document, Result, Table
    from cli.show.expect import Comparison


PANELS = {
    "What": "column",
    "Output": "json output units digits plot report expect rtol",
    "Head of the report": "title machine customer date author",
    "Terminal": "text no_color help",
}
"""Heading of the help -> the options below it that every command shares."""


FORMS = (".csv", ".json", ".xlsx", ".parquet", ".md", ".tex", ".html")
"""Suffixes of what every result can be written as."""


def suffix_among(*suffixes: str) -> Callable[[Path | None], Path | None]:
    """Return the check of a file's option: its suffix is one of these."""

    def check(path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in suffixes:
            raise typer.BadParameter(f"'{path}' has no known suffix: expected {', '.join(suffixes)}")
        return path

    return check


def _tolerance(value: float) -> float:
    if not 0 <= value < float("inf"):
        raise typer.BadParameter(f"{value}: expected a number from 0 on, such as 1e-6")
    return value


# each method that dataclass makes costs a tenth of a millisecond at every start
@dataclass(eq=False, repr=False)
class ShowOptions:
    """The options that every command shares, in the order in which its help lists them."""

    json: Annotated[
        bool, typer.Option("--json", help="Print one JSON document, SI units, full precision.")
    ] = False
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the result to FILE (.csv, .json, .xlsx, .parquet, .md, .tex or .html).",
            callback=suffix_among(*FORMS, ".toml"),
        ),
    ] = None
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE",
            help="Write a picture to FILE (.svg, .png or .pdf).",
            callback=suffix_among(".svg", ".png", ".pdf"),
        ),
    ] = None
    expect: Annotated[
        Path | None,
        typer.Option(
            "--expect",
            metavar="FILE.csv",
            help="Check the result against expected values under the same column names.",
        ),
    ] = None
    rtol: Annotated[
        float,
        typer.Option(
            "--rtol",
            metavar="NUMBER",
            help="Relative tolerance of --expect (for angles: radians).",
            callback=_tolerance,
        ),
    ] = 1e-3
    text: Annotated[bool, typer.Option("--text", help="Print the aligned table even into a pipe.")] = False
    digits: Annotated[
        bool,
        typer.Option("--digits", help="In tables and CSV print only the digits that hold against rounding."),
    ] = False
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=HEADER",
            help="Read the column HEADER of a table as NAME, such as mass_kg=Masse; repeatable.",
        ),
    ] = None
    units: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT,...", help="Units of the columns, such as mm,g,deg,N_mm,rpm; JSON stays SI."
        ),
    ] = None
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write a report to hand on to FILE (.html or .md): what was given, found, drawn, and how.",
            callback=suffix_among(".html", ".htm", ".md"),
        ),
    ] = None
    title: Annotated[str | None, typer.Option(metavar="TEXT", help="The report's title.")] = None
    machine: Annotated[str | None, typer.Option(metavar="TEXT", help="The machine it is about.")] = None
    customer: Annotated[str | None, typer.Option(metavar="TEXT", help="Whom it is for.")] = None
    date: Annotated[str | None, typer.Option(metavar="TEXT", help="Its date, if not today's.")] = None
    author: Annotated[str | None, typer.Option(metavar="TEXT", help="Who made it.")] = None
    no_color: Annotated[
        bool,
        typer.Option("--no-color", help="No colours on a terminal; so does NO_COLOR in the environment."),
    ] = False

    @property
    def head(self) -> dict[str, str]:
        """What the options say for the head of the report."""
        names = PANELS["Head of the report"].split()
        return {name: text for name in names if (text := getattr(self, name)) is not None}

    @property
    def form(self) -> str:
        """The suffix of what is written to a file, or to a pipe; empty for the terminal's table and for checks."""
        if self.output is not None:
            return self.output.suffix.lower()
        if self.json:
            return ".json"
        return "" if self.text or self.expect is not None or sys.stdout.isatty() else ".csv"

    @property
    def holds_one(self) -> bool:
        """Whether what is written holds one table."""
        return self.form in (".csv", ".parquet")

    @property
    def streams(self) -> bool:
        """Whether one table, or one JSON document, is all that is asked for, so that it can be written part by part."""
        others = self.text or self.plot or self.expect or self.report or (self.json and self.output)
        # what --digits says of the table stands in the document too
        others = others or (self.digits and self.form == ".json")
        return self.form in (".csv", ".parquet", ".xlsx", ".json") and not others

    @property
    def as_json(self) -> bool:
        """Whether the JSON document is formed."""
        return self.json or (self.output is not None and self.output.suffix.lower() == ".json")


def command(find: Callable[..., Result]) -> Callable[..., None]:
    """Make a command of a function that returns its result: it takes the shared options too, and shows the result.

    Where the function has a parameter `show`, it is given them.
    """
    return with_options(find, None, show)


def with_options(
    find: Callable[..., Result],
    chosen: Sequence[str] | None,
    hand_on: Callable[[Result, ShowOptions, Mapping[str, str]], None],
) -> Callable[..., None]:
    """Make a command that takes these of the shared options too, None for all, and hands on what it has found."""
    own, shared = (_parameters(of) for of in (find, ShowOptions))
    shared = {name: p for name, p in shared.items() if chosen is None or name in chosen}

    @wraps(find)
    def run(**given: object) -> None:
        from cli.read.headers import rename

        options = ShowOptions(**{name: given.pop(name) for name in shared})  # type: ignore[arg-type]
        if options.report is None and (unused := next(iter(options.head), None)) is not None:
            raise typer.BadParameter("expected --report FILE too", param_hint=f"--{unused}")
        rename(options.column)
        asked = {
            name.replace("_", " "): _said(value)
            for name, value in given.items()
            if value != own[name].default and value is not None
        }
        if "show" in own:
            given["show"] = options
        result = find(**given)
        with result.within():
            hand_on(result, options, asked)

    parameters = [*(p for name, p in own.items() if name != "show"), *shared.values()]
    run.__signature__ = signature(find).replace(parameters=parameters, return_annotation=None)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


def _said(value: object) -> str:
    """Return an option's value as the user gave it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (
        ", ".join(map(str, value))
        if isinstance(value, (list, tuple))
        else str(getattr(value, "value", value))
    )


def _parameters(of: Callable[..., object]) -> dict[str, Parameter]:
    """Return the parameters with their types; what is returned is not looked at, nor loaded for it."""
    names = getattr(of, "__globals__", globals())
    return {
        name: p.replace(
            kind=Parameter.KEYWORD_ONLY, annotation=eval(p.annotation, names) if name != "show" else None
        )
        for name, p in signature(of).parameters.items()
    }


def show(result: Result, options: ShowOptions, asked: Mapping[str, str]) -> None:
    """Write the files asked for, print the result; status 1 if an expectation is not met, or nothing was found."""
    from cli.read.headers import check_renamed
    from cli.show.files import write
    from cli.show.text import csv_text, json_parts, paragraphs, table_text

    if options.form == ".toml" and result.toml is None:
        raise typer.BadParameter(
            f"'{options.output}' has no known suffix: expected {', '.join(FORMS)}", param_hint="-o"
        )
    if result.blocks is not None:
        check_renamed()
        _stream(result, options)
        return
    result = _in_chosen_units(result, options.units)
    first, output = cache(next(iter(result.tables.values()))), options.output
    checked = None
    if options.expect is not None:
        from cli.show.expect import compare

        further = [*([] if result.screen is None else [result.screen]), *result.expected]
        checked = compare(first(), str(options.expect), options.rtol, further)
        verdict = f"{table_text(checked.columns)}\n{checked.summary}"
    check_renamed()
    if options.digits:
        result, cut = _with_digits_that_hold(result, first)
        first = cache(lambda: cut)
    pages = reported(result, options, asked, checked)
    tables = _tables_beside(result, options)
    refuse_inputs(
        [path for path in (output, options.plot, *result.beside, *pages, *tables) if path is not None]
    )
    for path, table_of in tables.items():
        write(path, _one_table(options.form, table_of()))
    for path, data in result.beside.items():
        write(path, data())
    for path, page in pages.items():
        write(path, page)
    if options.plot is not None and result.figure is not None:
        from cli.show.picture import drawn

        write(options.plot, drawn(result.figure, options.plot.suffix.lower()[1:]))
    if output is not None and options.form == ".json":
        write(output, (part.encode() for part in json_parts(_document(result))))
    elif output is not None and options.form == ".toml" and result.toml is not None:
        write(output, result.toml())
    elif output is not None and options.holds_one:
        write(output, _one_table(options.form, first()))
    elif output is not None:
        (name, _), *others = result.tables.items()
        formed = {name.strip("-"): first()} | {name.strip("-"): table() for name, table in others}
        if options.form == ".xlsx":
            from cli.show.parts import workbook

            write(output, workbook({name: [table] for name, table in formed.items()}))
        else:
            from cli.show.handed_on import handed_on

            write(output, handed_on(options.form, formed, result.warnings))
    # a long table would carry the warnings out of sight
    at_the_end = output is None and not options.json and sys.stdout.isatty()
    if not at_the_end:
        _warn(result.warnings, options)
    if options.json:
        sys.stdout.writelines(json_parts(_document(result)))
        if checked is not None:
            print(verdict, file=sys.stderr)
    elif checked is not None:
        print(coloured(verdict, sys.stdout, not options.no_color))
    elif options.text or (sys.stdout.isatty() and output is None):
        table = (result.screen or first)()
        width = get_terminal_size().columns if sys.stdout.isatty() else None
        text = table_text(table.cells, table.keys, width)
        said = paragraphs(result.notes(), text, result.afterword())
        sys.stdout.write(coloured(said, sys.stdout, not options.no_color))
    elif output is None:
        sys.stdout.write(csv_text(first().cells))
    sys.stdout.flush()
    if at_the_end:
        _warn(result.warnings, options)
    if result.failed() or (checked is not None and not checked.passed):
        raise typer.Exit(1)


def reported(
    result: Result, options: ShowOptions, asked: Mapping[str, str], checked: Comparison | None = None
) -> dict[Path, bytes]:
    """Return the files of --report."""
    if options.report is None:
        return {}
    from cli.show.report_forms import pages

    read = named()
    return pages(options.report, result, options.head, asked, read, options.units, options.digits, checked)


def _tables_beside(result: Result, options: ShowOptions) -> dict[Path, Callable[[], Table]]:
    """Return the tables that go beside a file of one table, each in a file of its own."""
    output = options.output
    if output is None or not options.holds_one:
        return {}
    return {
        output.with_name(f"{output.stem}-{name}{output.suffix}"): result.tables[name]
        for name in result.companions
    }


def _in_chosen_units(result: Result, units: str | None) -> Result:
    """Return the result with its tables in the units of --units."""
    if units is None:
        return result
    from cli.show.in_units import chosen_units, in_units

    chosen = chosen_units(units)

    def of(table: Callable[[], Table]) -> Callable[[], Table]:
        return lambda: in_units(table(), chosen)

    return replace(
        result,
        tables={name: of(table) for name, table in result.tables.items()},
        screen=None if result.screen is None else of(result.screen),
        expected=[of(table) for table in result.expected],
    )


def _stream(result: Result, options: ShowOptions) -> None:
    """Write a table that comes in parts."""
    from cli.show.blocks import stream

    if options.units is not None:
        from cli.show.in_units import chosen_units

        # a bad unit is an error before anything is worked out
        chosen_units(options.units)
    refuse_inputs([path for path in (options.output, *result.beside) if path is not None])
    for path, data in result.beside.items():
        from cli.show.files import write

        write(path, data())
    unknown = stream(result, options.form, options.output, options.units, options.digits)
    _warn([*result.warnings, *result.late_warnings(), *_unknown(unknown)], options)
    if result.failed():
        raise typer.Exit(1)


def _one_table(form: str, table: Table) -> bytes | Iterator[bytes]:
    """Return a file of a single table."""
    from cli.show.text import csv_text

    if form == ".parquet":
        from cli.show.parts import parquet

        return parquet([table])
    return csv_text(table.cells).encode()


def _warn(warnings: Iterable[str], options: ShowOptions) -> None:
    for warning in warnings:
        line = coloured(f"warning: {one_line(warning)}", sys.stderr, not options.no_color)
        print(line, file=sys.stderr)


def _unknown(count: int) -> list[str]:
    if not count:
        return []
    return [f"--digits: of {count} numbers no digit is known to hold; their cells are empty"]


def _document(result: Result) -> Document:
    return {**result.document(), "warnings": result.warnings}


def _with_digits_that_hold(result: Result, first: Callable[[], Table]) -> tuple[Result, Table]:
    """Cut the first table and that of the terminal."""
    from cli.show.digits import digits_that_hold

    table, unknown = digits_that_hold(first())
    screen = result.screen if result.screen is None else cache(result.screen)
    if screen is not None and not any(column.error for column in table.columns):
        unknown = digits_that_hold(screen())[1]
    return replace(
        result,
        warnings=[*result.warnings, *_unknown(unknown)],
        screen=None if screen is None else lambda: digits_that_hold(screen())[0],
    ), table
