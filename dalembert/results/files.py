"""Files of a result: workbooks, Parquet, Markdown, LaTeX, and parts of a table; each is written whole or not at all."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count
from math import isfinite
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError, needs
from dalembert.results.chosen_units import finished
from dalembert.results.columns import Table
from dalembert.results.result import Written
from dalembert.results.text import Grid, csv_text, has_names, json_elements, plain, printed

if TYPE_CHECKING:
    import pyarrow

    from dalembert.results.columns import Column, Values
    from dalembert.results.result import Part


def write_all(files: Mapping[Path, Callable[[], bytes | Iterable[bytes]]]) -> None:
    """Write files one after the other, each formed when its turn comes."""
    for path, data in files.items():
        write(path, data())


def write(path: Path, data: bytes | Iterable[bytes]) -> None:
    """Write a file; `data` may come in parts."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            with partial.open("wb") as stream:
                stream.writelines([data] if isinstance(data, bytes) else data)
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise DataError(f"{path}: cannot write: {error.strerror or error}") from None


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
        # a workbook has no number for an infinite error
        made.data_type = "n" if not isinstance(value, str) and isfinite(value) else "s"
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
        try:
            for table in blocks:
                if writer is None:
                    kinds = [(column.header, _kind(column)) for column in table.columns]
                    writer = ParquetWriter(stream, pyarrow.schema(kinds))
                arrays = [
                    _array(column, of) for column, of in zip(table.columns, writer.schema.types, strict=True)
                ]
                writer.write_table(pyarrow.Table.from_arrays(arrays, schema=writer.schema))
        finally:
            # where it is interrupted too: a writer that outlives its file complains of it on the terminal
            if writer is not None:
                writer.close()
        yield from _chunks(stream)


def _kind(column: Column) -> pyarrow.DataType:
    import pyarrow

    if column.unit:
        return pyarrow.float64()
    types = {type(value) for value in map(plain, column.values) if value != ""}
    if types == {float} or types == {int} or types == {int, float}:
        return pyarrow.int64() if types == {int} else pyarrow.float64()
    return pyarrow.string()


def _array(column: Column, kind: pyarrow.DataType) -> pyarrow.Array:
    import pyarrow

    cells = column.values
    if kind == pyarrow.float64() and (
        not isinstance(cells, Sequence) or {float, type(None)}.issuperset(map(type, cells))
    ):
        # what is not a number is null
        return pyarrow.array(cells, type=kind, from_pandas=True)
    if kind == pyarrow.string():
        values: list[str | float | None] = [None if v == "" else str(v) for v in map(plain, column.values)]
    else:
        values = [None if v == "" else v for v in map(plain, column.values)]
    return pyarrow.array(values, type=kind)


def _chunks(stream: IO[bytes]) -> Iterator[bytes]:
    stream.seek(0)
    while part := stream.read(CHUNK):
        yield part


def handed_on(suffix: str, tables: Mapping[str, Table], warnings: list[str]) -> bytes:
    """Return the file of this suffix: all tables, each with its name where there are several."""
    form: Callable[[Grid], str] = {".md": markdown, ".tex": _latex}[suffix]
    title = {".md": "## {}\n\n", ".tex": "% {}\n"}[suffix]
    several = len(tables) > 1
    parts = [title.format(name) * several + form(_grid(table)) for name, table in tables.items()]
    remarks = {
        ".md": [f"- {text}\n" for text in warnings],
        ".tex": [f"% {text}\n" for text in warnings],
    }[suffix]
    return "\n".join([*parts, *(["".join(remarks)] if remarks else [])]).encode()


def _grid(table: Table) -> Grid:
    texts = (printed(name, values) for name, values in table.cells.items())
    rows = [list(row) for row in zip(*texts, strict=True)]
    return Grid(list(table.cells), rows, [not has_names(values) for values in table.cells.values()])


_MARKDOWN = {**{c: f"\\{c}" for c in "\\|<"}, "\n": " "}
_LATEX = {
    **{c: f"\\{c}" for c in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "\\": r"\textbackslash{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "\n": " ",
}


def _escaped(text: str, signs: Mapping[str, str]) -> str:
    return "".join(signs.get(sign, sign) for sign in text)


def markdown(grid: Grid) -> str:
    """A table in Markdown."""
    header, rows, numbers = grid

    def line(row: list[str]) -> str:
        return "| " + " | ".join(_escaped(cell, _MARKDOWN) for cell in row) + " |\n"

    rule = ["---:" if number else "---" for number in numbers]
    return "".join(map(line, [header, rule, *rows]))


def _latex(grid: Grid) -> str:
    """A tabular, to be put into a document by `\\input`."""
    header, rows, numbers = grid

    def cell(text: str) -> str:
        # behind the end of a line [ and * are no text
        return ("{}" if text.startswith(("[", "*")) else "") + _escaped(text, _LATEX)

    def line(row: list[str]) -> str:
        return " & ".join(map(cell, row)) + r" \\" + "\n"

    form = "".join("r" if number else "l" for number in numbers)
    body = f"\\hline\n{line(header)}\\hline\n{''.join(map(line, rows))}\\hline\n"
    return f"\\begin{{tabular}}{{{form}}}\n{body}\\end{{tabular}}\n"


@dataclass(frozen=True)
class Form:
    """What is written of a part of a table: a worker is handed it, and does it.

    Attributes
    ----------
    suffix : str
        Of the file; CSV's and JSON's parts are their bytes, others' the tables as they are shown.
    """

    suffix: str
    units: Mapping[str, str] | None = None
    digits: bool = False

    def __call__(self, table: Part, number: int) -> Written:
        """Make it of the part of this number, from 0 on."""
        if isinstance(table, list):
            return Written(json_elements(table, first=number == 0).encode(), 0)
        table, unknown = finished(table, self.units, self.digits)
        if self.suffix == ".csv":
            return Written(csv_text(table.cells, header=number == 0).encode(), unknown)
        # bounds of errors have done their work, and cannot be sent; an array of numbers is soon sent
        columns = [replace(c, values=self._sent(c), error=None) for c in table.columns]
        return Written(replace(table, columns=columns), unknown)

    def _sent(self, column: Column) -> Values:
        if self.suffix != ".parquet" or not column.unit:
            return column.values
        import numpy as np

        return np.asarray(column.values, dtype=float)
