"""What the options that every command shares do with its result."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from itertools import chain
from pathlib import Path
from shutil import get_terminal_size
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import typer

from cli import function_of
from cli.show.commands import Declared, ShowOptions, with_options
from dalembert.errors import DataError, one_line
from dalembert.results.about import HEAD
from dalembert.terminal import coloured

if TYPE_CHECKING:
    from dalembert.results.columns import Table
    from dalembert.results.expect import Comparison
    from dalembert.results.result import Result

    Made = Callable[[], bytes | Iterable[bytes]]


def command(
    options: str,
    without: Collection[str] = (),
    eager: Mapping[str, Callable[[bool], None]] | None = None,
    forms: Sequence[str] = (),
    example: str = "",
) -> Callable[[Callable[[SimpleNamespace, ShowOptions], Result]], Declared]:
    """Make a command of a function that returns its result: the result is shown as the shared options say.

    `options` declares its own by the text of their help, `without` are the shared ones that mean nothing for it, `eager`
    answers flags that need nothing else, `forms` are suffixes of -o that this command alone writes, `example` is the worked
    example with which its help ends.
    """
    shared = [name for name in ShowOptions.__annotations__ if name not in without]
    return with_options(options, shared, show, eager, forms, example)


def show(result: Result, options: ShowOptions, call: Mapping[str, str]) -> None:
    """Write the requested files, print the result; status 1 if an expectation is not met, or there is no result."""
    from dalembert.tables.headers import check_renamed

    if take(result):
        return
    form = options.form
    if options.plot is not None and result.figure is None:
        result.warnings.append("--plot: there is no picture of this result")
    if result.blocks is not None:
        from cli.show.files import stream

        check_renamed()
        unknown = stream(result, form, options)
        _warn([*result.warnings, *result.late_warnings(), *_unknown(unknown)], options)
        _note(result, options)
        if result.failed():
            raise typer.Exit(1)
        return
    if options.steps:
        result = _with_way(result)
    result = _in_chosen_units(result, options.chosen_units)
    whole = cache(_first(result))
    result = _with_first(result, whole)
    checked = None
    if options.expect is not None:
        from dalembert.results.expect import compare

        _, *others = result.tables.values()
        screen = () if result.screen is None else result.screen()
        tables = [whole(), *screen, *(of() for of in (*result.expected, *others))]
        checked = compare(tables, str(options.expect), options.rtol)
        result.warnings.extend(checked.warnings)
    check_renamed()
    if options.digits:
        result = _with_digits_that_hold(result)
    # a report cuts the digits of each of its tables
    pages = _report(_with_first(result, whole), options, call, checked)
    if checked is not None:
        result = _with_check(result, checked)
    _write(result, options, pages)
    # a long table would carry the warnings out of sight
    at_the_end = options.output is None and not options.json and sys.stdout.isatty()
    if not at_the_end:
        _warn(result.warnings, options)
    _print(result, options, checked)
    if at_the_end:
        _warn(result.warnings, options)
    if result.failed() or (checked is not None and not checked.passed):
        raise typer.Exit(1)


def _write(result: Result, options: ShowOptions, pages: Mapping[Path, Made]) -> None:
    """Write the files; where one of them is an input, none."""
    from cli.show.files import check_folders, refuse_inputs
    from dalembert.results.files import write_all

    output = options.output
    if options.digits and options.form != ".json":
        result = _with_further_cut(result)
    files: dict[Path, Made] = {}
    if output is not None and options.holds_one:
        for name in result.companions:
            beside = output.with_name(f"{output.stem}-{name}{output.suffix}")
            files[beside] = partial(_one_table, options.form, result.tables[name])
    names = [path for path in (output, options.plot, *result.beside, *pages, *files) if path is not None]
    refuse_inputs(names)
    check_folders(names)
    files |= {**result.beside, **pages}
    if options.plot is not None and result.figure is not None:
        from dalembert.drawing.sheet import drawn

        figure = result.plotted or result.figure
        files[options.plot] = partial(drawn, figure, options.plot.suffix.lower()[1:])
    if output is not None:
        files[output] = partial(_formed, result, options.form)
    write_all(files)


def _with_check(result: Result, checked: Comparison) -> Result:
    """Return the result with the check as its first table, and in its document."""
    from dalembert.results.columns import document as result_document

    document = result.documented
    (check,) = result_document([checked.table]).values()
    # dalembert inspect has a check of its own
    name = "expected" if "check" in result.tables else "check"
    return replace(
        result,
        tables={name: lambda: checked.table, **result.tables},
        document=lambda: {**document(), name: check},
    )


def _print(result: Result, options: ShowOptions, checked: Comparison | None) -> None:
    """Print what was requested, in the form that standard output asks for."""
    from dalembert.results.text import csv_text, paragraphs, table_text

    verdict = "" if checked is None else f"{table_text(checked.table.cells)}\n{checked.summary}"
    # JSON keeps every digit
    every_digit, result = result, _with_further_cut(result) if options.digits else result
    if options.json:
        sys.stdout.writelines(_json_parts(every_digit))
        if checked is not None:
            print(verdict, file=sys.stderr)
    elif checked is not None:
        print(coloured(verdict, sys.stdout, not options.no_color))
    elif options.text or ((options.steps or sys.stdout.isatty()) and options.output is None):
        width = get_terminal_size().columns if sys.stdout.isatty() else None
        text = paragraphs(result.notes(), *_tables_text(result, width), result.afterword())
        sys.stdout.write(coloured(text, sys.stdout, not options.no_color))
    elif options.output is None:
        sys.stdout.write(csv_text(_first(result)().cells))
    if options.steps and not options.json and options.form != ".json":
        from dalembert.results.result import way_text

        sys.stdout.write(way_text(result, options.chosen_units, sys.stdout.isatty()))
    sys.stdout.flush()
    if checked is not None or options.output is not None or not sys.stdout.isatty():
        _note(result, options)


def _note(result: Result, options: ShowOptions) -> None:
    """Say what a table alone does not show."""
    if options.json or options.text or options.form == ".json":
        return
    requested = (_in_words(name, result.tables[name]()) for name in result.requested if name in result.tables)
    for line in chain(*requested, result.aside()):
        print(f"note: {one_line(line)}", file=sys.stderr)


def _in_words(name: str, table: Table) -> list[str]:
    """Write the rows of a table as sentences, of many the first ones, and the sentence below it."""
    from dalembert.results.text import heading, printed

    lead = f"{heading(name)}{': ' * bool(table.above)}{table.above}"
    cells = {header: printed(header, values)[:ROWS] for header, values in table.cells.items()}
    rows = zip(*cells.values(), strict=True)
    pairs = ([f"{header} {cell}" for header, cell in zip(cells, row, strict=True) if cell] for row in rows)
    lines = [f"{lead}: {', '.join(row)}" for row in pairs]
    if not table.columns:
        return []
    if table.length > ROWS:
        lines.append(f"{lead}: … and {table.length - ROWS} further rows: --json has all")
    return [*(lines or [lead]), *([f"{lead}: {table.below}"] if table.below else [])]


def _with_way(result: Result) -> Result:
    """Return the result with its worked solution shown."""
    if result.way is None:
        raise typer.BadParameter("expected a command that computes in steps", param_hint="--steps")
    return replace(result, way=cache(result.way), shows_way=True)


ROWS = 24  # rows of a further table that a terminal shows


def _tables_text(result: Result, width: int | None) -> Iterator[str]:
    """Yield the tables as the terminal shows them: the first whole, of the others the first rows."""
    from dalembert.results.result import table_block
    from dalembert.results.text import as_list, heading

    first, *others = result.tables.items()
    for table in (first[1](),) if result.screen is None else result.screen():
        yield table_block(table, width)
    for name, of in others:
        table = of()
        # without columns it is of the document alone; where the document has another form, one without a place is not shown
        if not table.columns or (result.document is not None and table.place is None):
            continue
        if table.length == 1:
            table = as_list(table)
        title = f"{heading(name)}: {table.above}" if table.above else f"{heading(name)}:"
        yield table_block(table, width, ROWS, title)


def _first(result: Result) -> Callable[[], Table]:
    return next(iter(result.tables.values()))


def _with_first(result: Result, table: Callable[[], Table]) -> Result:
    """Return the result with another first table."""
    return replace(result, tables={**result.tables, next(iter(result.tables)): table})


def reported(options: str) -> Callable[[Callable[[SimpleNamespace, ShowOptions], Result]], Declared]:
    """Make a command of a function that returns the files to be written and what a report says of them.

    `options` declares its own. The files are `beside` of its result, `notes` is what goes to standard output, `warnings`
    are the remarks.
    """
    return with_options(options, ("report", "about"), _hand_on)


def _hand_on(result: Result, options: ShowOptions, call: Mapping[str, str]) -> None:
    from cli.show.files import refuse_inputs
    from dalembert.results.files import write_all

    files = [*result.beside.items(), *_report(result, options, call).items()]
    refuse_inputs(path for path, _ in files)
    for note in result.warnings:
        print(f"note: {one_line(note)}", file=sys.stderr)
    write_all(dict(files))
    sys.stdout.write(result.notes())


def _report(
    result: Result, options: ShowOptions, call: Mapping[str, str], checked: Comparison | None = None
) -> dict[Path, Made]:
    """Return the files that --report writes."""
    if options.report is None:
        return {}
    from datetime import date

    from dalembert.results.report import pages, report

    # what the options say of its head goes before what the file itself says
    about = {"date": date.today().isoformat(), **result.about, **options.head}
    made = report(
        result,
        {key: about[key] for key in HEAD if about.get(key)},
        units=options.chosen_units,
        digits=options.digits,
        options=call,
        words=sys.argv[1:],
        checked=checked,
    )
    files = pages(options.report, made)
    return {path: partial(bytes, page) for path, page in files.items()}


def _in_chosen_units(result: Result, units: Mapping[str, str] | None) -> Result:
    """Return the result with its tables in the units that --units names."""
    if units is None:
        return result
    from dalembert.results.chosen_units import in_units

    def of(table: Callable[[], Table]) -> Callable[[], Table]:
        return lambda: in_units(table(), units)

    screen = result.screen
    return replace(
        result,
        tables={name: of(table) for name, table in result.tables.items()},
        screen=None if screen is None else lambda: [in_units(table, units) for table in screen()],
        expected=[of(table) for table in result.expected],
    )


def _formed(result: Result, form: str) -> bytes | Iterable[bytes]:
    """Return the file of -o."""
    if form == ".json":
        return (part.encode() for part in _json_parts(result))
    if form == ".toml":
        assert result.toml is not None
        return result.toml()
    if form in (".csv", ".parquet"):
        return _one_table(form, _first(result))
    # a table without columns is of the JSON document alone
    every = ((name.strip("-"), table()) for name, table in result.tables.items())
    formed = {name: table for name, table in every if table.columns}
    if form == ".xlsx":
        from dalembert.results.files import workbook

        return workbook({name: [table] for name, table in formed.items()})
    from dalembert.results.files import handed_on

    return handed_on(form, formed, result.warnings)


def _one_table(form: str, table: Callable[[], Table]) -> bytes | Iterable[bytes]:
    """Return a file of a single table."""
    if form == ".parquet":
        from dalembert.results.files import parquet

        return parquet([table()])
    from dalembert.results.text import csv_text

    return csv_text(table().cells).encode()


def _warn(warnings: Iterable[str], options: ShowOptions) -> None:
    for warning in warnings:
        line = coloured(f"warning: {one_line(warning)}", sys.stderr, not options.no_color)
        print(line, file=sys.stderr)


def _unknown(count: int) -> list[str]:
    if not count:
        return []
    return [f"--digits: of {count} numbers no digit holds; their cells are empty"]


def _json_parts(result: Result) -> Iterator[str]:
    from dalembert.results.text import json_parts

    return json_parts({**result.documented(), "warnings": result.warnings})


def _with_digits_that_hold(result: Result) -> Result:
    """Cut the first table and that of the terminal."""
    from dalembert.results.digits import digits_that_hold

    table, unknown = digits_that_hold(_first(result)())
    screen = None
    if result.screen is not None:
        cut = cache(lambda of=result.screen: [digits_that_hold(table) for table in of()])

        def screen() -> list[Table]:
            return [table for table, _ in cut()]

        if not any(column.error for column in table.columns):
            unknown = sum(count for _, count in cut())
    return replace(
        _with_first(result, lambda: table),
        warnings=[*result.warnings, *_unknown(unknown)],
        screen=screen,
    )


def _with_further_cut(result: Result) -> Result:
    """Cut the tables below the first, for files that are not JSON, which keeps every digit."""
    from dalembert.results.digits import digits_that_hold

    first, *others = result.tables.items()
    cut = {name: lambda of=of: digits_that_hold(of())[0] for name, of in others}
    return replace(result, tables={**dict([first]), **cut})


_taken: list[list[Result]] = []


def take(result: Result) -> bool:
    """Hand a result to whoever runs the command; False where it is run by a user."""
    if not _taken:
        return False
    _taken[-1].append(result)
    return True


@contextmanager
def _taking() -> Iterator[list[Result]]:
    _taken.append([])
    try:
        yield _taken[-1]
    finally:
        _taken.pop()


@cache
def parser_of(name: str) -> Any:
    """Return the parser of the words behind a command's name, which runs the command."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command(name)(function_of(name))
    return typer.main.get_command(app)


@cache
def options_of(name: str) -> frozenset[str]:
    """Return the options that a command takes."""
    return frozenset(flag for parameter in parser_of(name).params for flag in parameter.opts)


def result_of(words: Sequence[str]) -> Result:
    """Return the result of a command line such as `balance rotor.csv --plane A:20mm`, with its tables and document.

    Raises
    ------
    DataError
        Bad data, or an option that the command does not take.
    """
    name, *rest = words
    with _taking() as taken:
        try:
            parser_of(name).main([*rest, "--text", "--json"], prog_name="dalembert", standalone_mode=False)
        except DataError:
            raise
        except Exception as error:
            # of a usage error the sentence
            message = getattr(error, "format_message", None)
            if message is None:
                raise
            raise DataError(f"{name}: {message()}") from None
    if not taken:
        raise DataError(f"{name}: no result: expected options that compute")
    result = taken[0]
    if "--steps" in rest and result.way is not None:
        return replace(result, way=cache(result.way), shows_way=True)
    return result
