"""What the options that every command shares do with its result."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING

import typer

from cli.errors import one_line
from cli.read.about import HEAD
from cli.read.files import refuse_inputs
from cli.show.colour import coloured
from cli.show.commands import FORMS, ShowOptions, with_options

if TYPE_CHECKING:
    from cli.show.columns import Result, Table
    from cli.show.expect import Comparison

    Made = Callable[[], bytes | Iterable[bytes]]


def command(
    options: str, asked: Callable[..., object] | None = None
) -> Callable[[Callable[..., Result]], Callable[..., None]]:
    """Make a command of a function that returns its result: it takes the shared options too, and shows the result.

    `options` is what the help says of its own (`told`). Where the function has a parameter `show`, it is given the
    shared ones; `asked` as in `with_options`.
    """
    return lambda find: with_options(find, options, None, show, asked)


def show(result: Result, options: ShowOptions, asked: Mapping[str, str]) -> None:
    """Write the files asked for, print the result; status 1 if an expectation is not met, or nothing was found."""
    from cli.read.headers import check_renamed

    if options.form == ".toml" and result.toml is None:
        raise typer.BadParameter(
            f"'{options.output}' has no known suffix: expected {', '.join(FORMS)}", param_hint="-o"
        )
    if result.blocks is not None:
        check_renamed()
        _stream(result, options)
        return
    result = _in_chosen_units(result, options.units)
    whole = cache(_first(result))
    result = _with_first(result, whole)
    checked = None
    if options.expect is not None:
        from cli.show.expect import compare

        further = [*([] if result.screen is None else [result.screen]), *result.expected]
        checked = compare(whole(), str(options.expect), options.rtol, further)
    check_renamed()
    if options.digits:
        result = _with_digits_that_hold(result)
    # a report cuts the digits of each of its tables
    pages = _report(_with_first(result, whole), options, asked, checked)
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
    from cli.show.files import write_all

    output = options.output
    files: dict[Path, Made] = {}
    if output is not None and options.holds_one:
        for name in result.companions:
            beside = output.with_name(f"{output.stem}-{name}{output.suffix}")
            files[beside] = partial(_one_table, options.form, result.tables[name])
    names = (output, options.plot, *result.beside, *pages, *files)
    refuse_inputs([path for path in names if path is not None])
    files |= {**result.beside, **pages}
    if options.plot is not None and result.figure is not None:
        from cli.show.picture import drawn

        files[options.plot] = partial(drawn, result.figure, options.plot.suffix.lower()[1:])
    if output is not None:
        files[output] = partial(_formed, result, options.form)
    write_all(files)


def _print(result: Result, options: ShowOptions, checked: Comparison | None) -> None:
    """Print what was asked for, in the form that standard output asks for."""
    from cli.show.text import csv_text, paragraphs, table_text

    verdict = "" if checked is None else f"{table_text(checked.columns)}\n{checked.summary}"
    if options.json:
        sys.stdout.writelines(_json_parts(result))
        if checked is not None:
            print(verdict, file=sys.stderr)
    elif checked is not None:
        print(coloured(verdict, sys.stdout, not options.no_color))
    elif options.text or (sys.stdout.isatty() and options.output is None):
        table = (result.screen or _first(result))()
        width = get_terminal_size().columns if sys.stdout.isatty() else None
        text = table_text(table.cells, table.keys, width)
        said = paragraphs(result.notes(), text, result.afterword())
        sys.stdout.write(coloured(said, sys.stdout, not options.no_color))
    elif options.output is None:
        sys.stdout.write(csv_text(_first(result)().cells))
    sys.stdout.flush()


def _first(result: Result) -> Callable[[], Table]:
    return next(iter(result.tables.values()))


def _with_first(result: Result, table: Callable[[], Table]) -> Result:
    """Return the result with another first table."""
    return replace(result, tables={**result.tables, next(iter(result.tables)): table})


def reported(options: str) -> Callable[[Callable[..., Result]], Callable[..., None]]:
    """Make a command of a function that returns the files to be written and what a report says of them.

    `options` is what the help says of its own. The files are `beside` of its result, `notes` is what goes to standard
    output, `warnings` are the remarks.
    """
    return lambda find: with_options(find, options, ("report", *HEAD), _hand_on)


def _hand_on(result: Result, options: ShowOptions, asked: Mapping[str, str]) -> None:
    from cli.show.files import write_all

    files = [*result.beside.items(), *_report(result, options, asked).items()]
    refuse_inputs(path for path, _ in files)
    for note in result.warnings:
        print(f"note: {one_line(note)}", file=sys.stderr)
    write_all(dict(files))
    sys.stdout.write(result.notes())


def _report(
    result: Result, options: ShowOptions, asked: Mapping[str, str], checked: Comparison | None = None
) -> dict[Path, Made]:
    """Return the files of --report."""
    if options.report is None:
        return {}
    from cli.show.report_forms import pages

    files = pages(result, options, asked, checked)
    return {path: partial(bytes, page) for path, page in files.items()}


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
    from cli.show.files import write_all

    if options.units is not None:
        from cli.show.in_units import chosen_units

        # a bad unit is an error before anything is worked out
        chosen_units(options.units)
    refuse_inputs([path for path in (options.output, *result.beside) if path is not None])
    write_all(result.beside)
    unknown = stream(result, options.form, options.output, options.units, options.digits)
    _warn([*result.warnings, *result.late_warnings(), *_unknown(unknown)], options)
    if result.failed():
        raise typer.Exit(1)


def _formed(result: Result, form: str) -> bytes | Iterable[bytes]:
    """Return the file of -o."""
    if form == ".json":
        return (part.encode() for part in _json_parts(result))
    if form == ".toml":
        assert result.toml is not None
        return result.toml()
    if form in (".csv", ".parquet"):
        return _one_table(form, _first(result))
    formed = {name.strip("-"): table() for name, table in result.tables.items()}
    if form == ".xlsx":
        from cli.show.parts import workbook

        return workbook({name: [table] for name, table in formed.items()})
    from cli.show.handed_on import handed_on

    return handed_on(form, formed, result.warnings)


def _one_table(form: str, table: Callable[[], Table]) -> bytes | Iterable[bytes]:
    """Return a file of a single table."""
    if form == ".parquet":
        from cli.show.parts import parquet

        return parquet([table()])
    from cli.show.text import csv_text

    return csv_text(table().cells).encode()


def _warn(warnings: Iterable[str], options: ShowOptions) -> None:
    for warning in warnings:
        line = coloured(f"warning: {one_line(warning)}", sys.stderr, not options.no_color)
        print(line, file=sys.stderr)


def _unknown(count: int) -> list[str]:
    if not count:
        return []
    return [f"--digits: of {count} numbers no digit is known to hold; their cells are empty"]


def _json_parts(result: Result) -> Iterator[str]:
    from cli.show.documents import json_parts

    return json_parts({**result.document(), "warnings": result.warnings})


def _with_digits_that_hold(result: Result) -> Result:
    """Cut the first table and that of the terminal."""
    from cli.show.digits import digits_that_hold

    table, unknown = digits_that_hold(_first(result)())
    screen = result.screen if result.screen is None else cache(result.screen)
    if screen is not None and not any(column.error for column in table.columns):
        unknown = digits_that_hold(screen())[1]
    return replace(
        _with_first(result, lambda: table),
        warnings=[*result.warnings, *_unknown(unknown)],
        screen=None if screen is None else lambda: digits_that_hold(screen())[0],
    )
