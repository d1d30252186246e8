"""A table that comes in parts: what is made of each part where it is worked out, and how they are put together."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cli.show.in_units import finished
from cli.show.result import Written
from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError
from dalembert.results.columns import Table

if TYPE_CHECKING:
    from cli.show.result import Part, Result


@dataclass(frozen=True)
class Form:
    """What is written of a part of a table: a worker is handed it, and does it.

    Attributes
    ----------
    suffix : str
        Of the file; CSV's and JSON's parts are their bytes, others' the tables as they are shown.
    folder : Path, optional
        Where each part of Parquet gets a file of its own.
    """

    suffix: str
    units: str | None = None
    digits: bool = False
    folder: Path | None = None

    def __call__(self, table: Part, number: int) -> Written:
        """Make it of the part of this number, from 0 on."""
        if isinstance(table, list):
            from dalembert.results.json_text import json_elements

            return Written(json_elements(table, first=number == 0).encode(), 0)
        table, unknown = finished(table, self.units, self.digits)
        if self.suffix == ".csv":
            from dalembert.results.text import csv_text

            return Written(csv_text(table.cells, header=number == 0).encode(), unknown)
        if self.folder is not None:
            from cli.show.files import parquet

            (self.folder / f"part-{number:06d}.parquet").write_bytes(b"".join(parquet([table])))
            return Written(b"", unknown)
        # bounds of errors have done their work, and cannot be sent
        return Written(replace(table, columns=[replace(c, error=None) for c in table.columns]), unknown)


def stream(result: Result, suffix: str, output: Path | None, units: str | None, digits: bool) -> int:
    """Write a table that comes in parts, to standard output where no file is given.

    Returns
    -------
    int
        Of how many numbers --digits knows no digit.
    """
    from cli.show.files import parquet, workbook, write

    assert result.blocks is not None
    unknown = 0

    def made(form: Form, blocks: Callable[[Form], Iterator[Written]]) -> Iterator[bytes | Part]:
        nonlocal unknown
        # what is left of the work is called off when the writing ends
        with closing(blocks(form)) as parts:  # type: ignore[type-var]
            for data, without in parts:
                unknown += without
                yield data

    if suffix == ".parquet" and result.shared and output is not None:
        with folder(output) as parts:
            for _ in made(Form(suffix, units, digits, parts), result.blocks):
                pass
        return unknown
    parts_written = made(Form(suffix, units, digits), result.blocks)
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
    from dalembert.results.json_text import json_members

    yield f'{{{json_members(result.documented())},\n "{result.blocks_name}": ['.encode()
    yield from parts
    # what there is to say is known by now
    lines = [*result.warnings, *result.late_warnings()]
    yield f"\n ],{json_members({'warnings': lines})}\n}}\n".encode()


@contextmanager
def folder(path: Path) -> Iterator[Path]:
    """A folder of Parquet files that stands in its place when all are written, and not before."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            if path.is_dir() and any(not each.match("part-*.parquet") for each in path.iterdir()):
                raise DataError(f"{path}: a folder with other files: expected a name that is free")
            partial.mkdir()
            yield partial
            if path.is_dir():
                shutil.rmtree(path)
            path.unlink(missing_ok=True)
            os.replace(partial, path)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
    except OSError as error:
        raise DataError(f"{path}: cannot write: {error.strerror or error}") from None
