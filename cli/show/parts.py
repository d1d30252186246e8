"""Workbooks and Parquet, written block by block: a long sweep is never held as a whole."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import count
from typing import IO, TYPE_CHECKING, Any

from dalembert.errors import needs
from dalembert.results.text import plain

if TYPE_CHECKING:
    import pyarrow

    from dalembert.results.columns import Column, Table

CHUNK = 1 << 20  # bytes
MOST = 1_048_575  # rows of a sheet below its header
_CONTROLS = re.compile(r"[\0-\x08\x0b\x0c\x0e-\x1f]")


def workbook(tables: Mapping[str, Iterable[Table]]) -> Iterator[bytes]:
    """Yield a workbook, numbers with every digit: a sheet for each table, a further one where it is full."""
    try:
        from openpyxl import Workbook
        from openpyxl.cell import WriteOnlyCell
        from openpyxl.styles import Font
        from openpyxl.utils import get_column_letter
    except ImportError:
        raise needs("-o .xlsx", "openpyxl", "excel") from None
    book = Workbook(write_only=True)

    def cell(sheet: Any, value: str | float) -> Any:
        # a number as its text: openpyxl keeps 16 digits of a float; a name that begins with = is no formula
        made = WriteOnlyCell(sheet, value if isinstance(value, str) else repr(value))
        made.data_type = "s" if isinstance(value, str) else "n"
        return made

    def begun(title: str, table: Table) -> Any:
        sheet = book.create_sheet(re.sub(r"[\[\]:*?/\\']", " ", title)[:31])
        sheet.freeze_panes = "A2"
        header = []
        for k, column in enumerate(table.columns, 1):
            shown = [f"{v:.6g}" if isinstance(v, float) else str(v) for v in map(plain, column.values[:1000])]
            longest = max(map(len, [column.header, *shown]))
            sheet.column_dimensions[get_column_letter(k)].width = min(longest + 2, 40)
            header.append(cell(sheet, column.header))
            header[-1].font = Font(bold=True)
        sheet.append(header)
        return sheet

    for name, blocks in tables.items():
        sheet: Any = None
        number = count(2)
        left = MOST
        for table in blocks:
            for row in zip(*(map(plain, column.values) for column in table.columns), strict=True):
                if sheet is None or not left:
                    sheet = begun(name if sheet is None else f"{name} {next(number)}", table)
                    left = MOST
                values = [_CONTROLS.sub(" ", v) if isinstance(v, str) else v for v in row]
                sheet.append([None if value == "" else cell(sheet, value) for value in values])
                left -= 1
            if sheet is None:
                sheet = begun(name, table)
    # loaded here: a table alone needs no file
    from tempfile import TemporaryFile

    with TemporaryFile() as stream:
        book.save(stream)
        yield from _chunks(stream)


def parquet(blocks: Iterable[Table]) -> Iterator[bytes]:
    """Yield a table as Parquet: a row group for each block; numbers are float64, empty cells are null."""
    try:
        import pyarrow
        from pyarrow.parquet import ParquetWriter
    except ImportError:
        raise needs("-o .parquet", "pyarrow", "parquet") from None
    # loaded here: a table alone needs no file
    from tempfile import TemporaryFile

    with TemporaryFile() as stream:
        writer = None
        for table in blocks:
            if writer is None:
                kinds = [(column.header, _kind(column)) for column in table.columns]
                writer = ParquetWriter(stream, pyarrow.schema(kinds))
            arrays = [
                _array(column, of) for column, of in zip(table.columns, writer.schema.types, strict=True)
            ]
            writer.write_table(pyarrow.Table.from_arrays(arrays, schema=writer.schema))
        if writer is not None:
            writer.close()
        yield from _chunks(stream)


def _kind(column: Column) -> pyarrow.DataType:
    import pyarrow

    if column.unit:
        return pyarrow.float64()
    known = {type(value) for value in map(plain, column.values) if value != ""}
    if known == {float} or known == {int} or known == {int, float}:
        return pyarrow.int64() if known == {int} else pyarrow.float64()
    return pyarrow.string()


def _array(column: Column, kind: pyarrow.DataType) -> pyarrow.Array:
    import pyarrow

    given = column.values
    if kind == pyarrow.float64() and (
        not isinstance(given, Sequence) or {float, type(None)}.issuperset(map(type, given))
    ):
        # what is not a number is null
        return pyarrow.array(given, type=kind, from_pandas=True)
    if kind == pyarrow.string():
        values: list[str | float | None] = [None if v == "" else str(v) for v in map(plain, column.values)]
    else:
        values = [None if v == "" else v for v in map(plain, column.values)]
    return pyarrow.array(values, type=kind)


def _chunks(stream: IO[bytes]) -> Iterator[bytes]:
    stream.seek(0)
    while part := stream.read(CHUNK):
        yield part
