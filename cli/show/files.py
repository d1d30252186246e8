"""What is refused before a file is written, and tables that are written in parts."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from dalembert.errors import DataError
from dalembert.results.columns import Table
from dalembert.results.files import Form, parquet, workbook, write, write_all
from dalembert.results.text import json_members
from dalembert.tables.files import is_input

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Part, Result, Written


def refuse_inputs(outputs: Iterable[Path]) -> None:
    """Refuse outputs that are inputs of this call, or one another, before any of them is written."""
    seen: set[str] = set()
    for path in outputs:
        if is_input(path):
            raise typer.BadParameter(f"'{path}' is an input: expected another file; nothing was written")
        name = os.path.realpath(path)
        if name in seen:
            raise typer.BadParameter(f"'{path}' is given twice: expected a file for each output")
        seen.add(name)


def check_folders(paths: Iterable[Path]) -> None:
    """Refuse the first file whose folder is missing, before any is written."""
    for path in paths:
        if not path.parent.is_dir():
            raise DataError(f"{path}: cannot write: no folder {path.parent}")


def stream(result: Result, suffix: str, options: ShowOptions) -> int:
    """Write a table that comes in parts, to standard output without a file; before it the files that go with it.

    Returns
    -------
    int
        Of how many numbers --digits knows no digit.
    """
    assert result.blocks is not None
    output, unknown = options.output, 0
    # a bad unit is an error before anything is worked out
    units = options.chosen_units
    refuse_inputs(path for path in (output, *result.beside) if path is not None)
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
    yield f'{{{json_members(result.documented())},\n "{result.blocks_name}": ['.encode()
    yield from parts
    # all warnings are there by now
    lines = [*result.warnings, *result.late_warnings()]
    yield f"\n ],{json_members({'warnings': lines})}\n}}\n".encode()
