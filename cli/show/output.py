"""What the options that every command shares do with its result."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
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
from dalembert.results.forms import (
    first_of,
    formed,
    in_chosen_units,
    json_document,
    one_table,
    unknown_digits,
    with_digits_that_hold,
    with_first,
    with_further_cut,
)
from dalembert.tables.files import is_input
from dalembert.terminal import coloured

if TYPE_CHECKING:
    from dalembert.results.columns import Table
    from dalembert.results.expect import Comparison
    from dalembert.results.files import Form
    from dalembert.results.result import Part, Result, Written

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
        check_renamed()
        unknown = _stream(result, form, options)
        _warn([*result.warnings, *result.late_warnings(), *unknown_digits(unknown)], options)
        _note(result, options)
        if result.failed():
            raise typer.Exit(1)
        return
    if options.steps:
        result = _with_way(result)
    result = in_chosen_units(result, options.chosen_units)
    whole = cache(first_of(result))
    result = with_first(result, whole)
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
        result = with_digits_that_hold(result)
    # a report cuts the digits of each of its tables
    pages = _report(with_first(result, whole), options, call, checked)
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
    from dalembert.results.files import write_all

    output = options.output
    if options.digits and options.form != ".json":
        result = with_further_cut(result)
    files: dict[Path, Made] = {}
    if output is not None and options.holds_one:
        for name in result.companions:
            beside = output.with_name(f"{output.stem}-{name}{output.suffix}")
            files[beside] = partial(one_table, options.form, result.tables[name])
    names = [path for path in (output, options.plot, *result.beside, *pages, *files) if path is not None]
    _refuse_inputs(names)
    _check_folders(names)
    files |= {**result.beside, **pages}
    if options.plot is not None and result.figure is not None:
        from dalembert.drawing.sheet import drawn

        figure = result.plotted or result.figure
        files[options.plot] = partial(drawn, figure, options.plot.suffix.lower()[1:])
    if output is not None:
        files[output] = partial(formed, result, options.form)
    write_all(files)


# --- what is refused before a file is written, and tables that are written in parts ---------------------------------
def _refuse_inputs(outputs: Iterable[Path]) -> None:
    """Refuse outputs that are inputs of this call, or one another, before any of them is written."""
    seen: set[str] = set()
    for path in outputs:
        if is_input(path):
            raise typer.BadParameter(f"'{path}' is an input: expected another file; nothing was written")
        name = os.path.realpath(path)
        if name in seen:
            raise typer.BadParameter(f"'{path}' is given twice: expected a file for each output")
        seen.add(name)


def _check_folders(paths: Iterable[Path]) -> None:
    """Refuse the first file whose folder is missing, before any is written."""
    for path in paths:
        if not path.parent.is_dir():
            raise DataError(f"{path}: cannot write: no folder {path.parent}")


def _stream(result: Result, suffix: str, options: ShowOptions) -> int:
    """Write a table that comes in parts, to standard output without a file; before it the files that go with it.

    Returns
    -------
    int
        Of how many numbers --digits knows no digit.
    """
    assert result.blocks is not None
    from dalembert.results.columns import Table
    from dalembert.results.files import Form, parquet, workbook, write, write_all

    output, unknown = options.output, 0
    # a bad unit is an error before anything is worked out
    units = options.chosen_units
    _refuse_inputs(path for path in (output, *result.beside) if path is not None)
    write_all(result.beside)

    def made(form: Form, blocks: Callable[[Form], Iterator[Written]]) -> Iterator[bytes | Part]:
        nonlocal unknown
        # what is left of the work is called off when the writing ends
        with closing(blocks(form)) as parts:  # type: ignore[type-var]
            for data, without in parts:
                unknown += without
                yield data

    parts_written = made(Form(suffix, units, options.digits), result.blocks)
    if suffix in (".csv", ".json"):
        data = (data for data in parts_written if isinstance(data, bytes))
        text = _document(result, data) if suffix == ".json" else data
        if output is not None:
            write(output, text)
        else:
            sys.stdout.writelines(part.decode() for part in text)
            sys.stdout.flush()
    elif output is not None:
        tables = (data for data in parts_written if isinstance(data, Table))
        write(output, parquet(tables) if suffix == ".parquet" else workbook({result.blocks_name: tables}))
    return unknown


def _document(result: Result, parts: Iterator[bytes]) -> Iterator[bytes]:
    """The JSON document around its list."""
    from dalembert.results.text import json_members

    yield f'{{{json_members(result.documented())},\n "{result.blocks_name}": ['.encode()
    yield from parts
    # all warnings are there by now
    lines = [*result.warnings, *result.late_warnings()]
    yield f"\n ],{json_members({'warnings': lines})}\n}}\n".encode()


# --- what is printed ----------------------------------------------------------------------------------------------------
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
    every_digit, result = result, with_further_cut(result) if options.digits else result
    if options.json:
        sys.stdout.writelines(json_document(every_digit))
        if checked is not None:
            print(verdict, file=sys.stderr)
    elif checked is not None:
        print(coloured(verdict, sys.stdout, not options.no_color))
    elif options.text or ((options.steps or sys.stdout.isatty()) and options.output is None):
        width = get_terminal_size().columns if sys.stdout.isatty() else None
        text = paragraphs(result.notes(), *_tables_text(result, width), result.afterword())
        sys.stdout.write(coloured(text, sys.stdout, not options.no_color))
    elif options.output is None:
        sys.stdout.write(csv_text(first_of(result)().cells))
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


def reported(options: str) -> Callable[[Callable[[SimpleNamespace, ShowOptions], Result]], Declared]:
    """Make a command of a function that returns the files to be written and what a report says of them.

    `options` declares its own. The files are `beside` of its result, `notes` is what goes to standard output, `warnings`
    are the remarks.
    """
    return with_options(options, ("report", "about"), _hand_on)


def _hand_on(result: Result, options: ShowOptions, call: Mapping[str, str]) -> None:
    from dalembert.results.files import write_all

    files = [*result.beside.items(), *_report(result, options, call).items()]
    _refuse_inputs(path for path, _ in files)
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


def _warn(warnings: Iterable[str], options: ShowOptions) -> None:
    for warning in warnings:
        line = coloured(f"warning: {one_line(warning)}", sys.stderr, not options.no_color)
        print(line, file=sys.stderr)


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
