"""Tables in: CSV and workbooks, read into columns, each cell's fault named by row and column.

A command says which quantities it knows; `read` finds their columns by name and unit, in any order and
case, and converts the cells. CSV of some 10 000 rows and more goes through pandas; whatever pandas
stumbles over is read again by the standard `csv` module, which knows the row of every cell.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING, Literal

import numpy as np

from cli.errors import DataError, quote
from cli.read.headers import Heading, find_columns, offers, spellings
from cli.read.sources import Source, open_source
from cli.read.units import LARGEST, parse_number

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False, repr=False)
class Numbers:
    """A column of numbers in the file's own unit; NaN where an allowed blank or mark stands."""

    header: str
    """As the file writes it."""
    unit: str
    values: NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Cells:
    """A column with a unit whose cells are left as text."""

    header: str
    unit: str
    values: list[str]
    decimal_comma: bool = False

    def number(self, text: str) -> float:
        """Read a number out of a cell; ValueError where it is none, or has not the decimal mark of the file."""
        return parse_number(_pointed(text) if self.decimal_comma else text)

    @cached_property
    def parsed(self) -> NDArray[np.float64] | None:
        """The numbers of all cells, NaN where one is blank; None where one is none, or has to be looked at by itself."""
        together = "\0".join(self.values)
        if not together.isascii() or "_" in together:
            return None
        texts = self.values
        if self.decimal_comma:
            if "." in together:
                return None
            texts = together.replace(",", ".").split("\0")
        try:
            return np.array([float(text) if text else math.nan for text in texts], dtype=float)
        except ValueError:
            return None


@dataclass(eq=False, repr=False)
class Table:
    """A table as read: columns by the name of their quantity, without the unit suffix."""

    file: str
    header: list[str]
    rows: int
    numbers: dict[str, Numbers] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)
    cells: dict[str, Cells] = field(default_factory=dict)
    marks: dict[tuple[int, str], str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    told: str = ""
    """What is said of the file where a column is missed: its header, and which columns may be meant."""
    _source: Source | None = None
    _numbered: dict[str, tuple[list[str], NDArray[np.intp]]] = field(default_factory=dict)

    def numbered(self, name: str, otherwise: str = "") -> tuple[list[str], NDArray[np.intp]]:
        """Number the texts of a column in the order in which they first stand; without the column all are `otherwise`."""
        if name not in self.texts:
            return [otherwise], np.zeros(self.rows, dtype=np.intp)
        if name not in self._numbered:
            first: dict[str, int] = {}
            codes = [first.setdefault(text, len(first)) for text in self.texts[name]]
            self._numbered[name] = list(first), np.array(codes, dtype=np.intp)
        return self._numbered[name]

    @cached_property
    def _written(self) -> list[list[str]]:
        assert self._source is not None
        return [cells for _, cells in self._source.rows()]

    def written(self, index: int, quantity: str) -> str:
        """Return a cell of a number column as the file wrote it; looked up for messages only."""
        return self._written[index][self.header.index(self.numbers[quantity].header)].strip()

    def wrong(self, index: int, quantity: str, expected: str) -> DataError:
        """Make the one line for a number: column and value as the file wrote them."""
        column = self.numbers[quantity].header
        return self.error(index, column, self.written(index, quantity), expected)

    def points(self, names: Iterable[str]) -> None:
        """Write a point for the decimal comma in these columns of texts, where a comma cannot part cells."""
        columns = {name: self.texts[name] for name in names}
        if self._source is None or not self._source.has_commas(columns.values()):
            return
        for name, column in columns.items():
            for i, cell in enumerate(column):
                try:
                    column[i] = _pointed(cell)
                except ValueError:
                    raise self.error(i, name, cell, WITH_COMMA) from None

    def error(self, index: int, column: str, found: object, expected: str) -> DataError:
        """Make the one line for a cell: `column` as the header spells it."""
        assert self._source is not None
        return self._source.error(index, column, str(found), expected)

    def reject(self, bad: NDArray[np.bool_], quantity: str, expected: str) -> None:
        """Raise the error of the first cell of a number column for which `bad` holds."""
        if bad.any():
            raise self.wrong(int(np.argmax(bad)), quantity, expected)

    def require(self, quantity: str, dimension: str) -> Numbers:
        """Return a column of numbers, or say that the table lacks it."""
        if quantity not in self.numbers:
            raise DataError(f"{self.file}: no column {spellings(quantity, dimension)} {self.told}")
        return self.numbers[quantity]


def read(
    path: str,
    *,
    numbers: Mapping[str, str] | None = None,
    texts: Sequence[str] | None = (),
    cells: Mapping[str, str] | None = None,
    blank: Sequence[str] = (),
    marker: str = "",
    headers: Callable[[list[str]], list[str]] | None = None,
) -> Table:
    """Read a CSV file or a workbook (`FILE.xlsx#Sheet`), or standard input for `-`.

    Parameters
    ----------
    path
        The file.
    numbers
        Quantity -> dimension (a key of `cli.read.units.UNITS`) of the columns of numbers the command knows.
    texts
        The columns of names; a name is text whatever it looks like. None: every column.
    cells
        As `numbers`, for columns whose cells the command reads itself.
    blank
        The quantities of `numbers` whose cells may be empty: they read as NaN.
    marker
        Cells of `numbers` that begin with it are no numbers: NaN, and their text in `Table.marks`.
    headers
        What the header as written means: the columns' names by their places.

    Raises
    ------
    DataError
        No such file, no text, no header, no rows, a doubled column, an unknown unit, a cell that is no number.
    """
    known = {**(numbers or {}), **(cells or {})}
    source = open_source(path, known, texts)
    if headers is not None:
        meant = headers([each.name for each in source.headings])
        source.headings = [
            each if name == each.name else Heading(each.written, name)
            for each, name in zip(source.headings, meant, strict=True)
        ]
    texts = [each.name for each in source.headings] if texts is None else texts
    found = find_columns(source.file, source.headings, known, texts)
    used = {index for index, _ in found.values()}
    extra = [each for index, each in enumerate(source.headings) if index not in used]
    missed = {name: dimension for name, dimension in known.items() if name not in found}
    missed_texts = [name for name in texts if name not in found]
    table = Table(source.file, source.header, 0, warnings=source.warnings, _source=source)
    table.told = source.told(extra, missed, missed_texts)
    if extra:
        names = ", ".join(quote(each.written) if each.written else "without a header" for each in extra)
        offered = offers(extra, missed, missed_texts)
        table.warnings.append(
            f"{source.file}: ignored the column{'s' * (len(extra) > 1)} {names}"
            + (f"; to read: {' '.join(offered)}" if offered else "")
        )
    source.check_cells(used)
    plan = [
        (
            name,
            index,
            unit,
            "text" if name in texts else "cell" if name in (cells or {}) else "number",
            name in blank,
        )
        for name, (index, unit) in found.items()
    ]
    if not (source.large and _read_large(source, table, plan, marker)):
        _read_small(source, table, plan, marker)
    if table.rows == 0:
        raise DataError(
            f"{source.file}: a header and no rows{source.of_sheet}: expected at least one row of data"
        )
    return table


WITH_COMMA = "a number with a decimal comma, as elsewhere in the file"


def _pointed(text: str) -> str:
    """Write a point for the decimal comma; ValueError where there is a point already."""
    if "." in text:
        raise ValueError(text)
    return text.replace(",", ".")


_Plan = Sequence[tuple[str, int, str, str, bool]]


def _read_small(source: Source, table: Table, plan: _Plan, marker: str) -> None:
    width = len(source.header)
    rows: list[list[str]] = []
    for line, record in source.rows():
        if len(record) != width:
            if len(record) < width or any(cell.strip() for cell in record[width:]):
                raise DataError(
                    f"{source.file}: row {len(rows) + 1} (line {line}): found {len(record)} cells, expected {width}"
                )
            record = record[:width]
        rows.append(record)
    table.rows = len(rows)
    columns = list(zip(*rows, strict=True)) or [()] * width
    decimal_comma = source.has_commas(columns[index] for _, index, _, kind, _ in plan if kind != "text")
    for name, index, unit, kind, may_be_blank in plan:
        column = columns[index]
        if kind == "text":
            table.texts[name] = [cell.strip() for cell in column]
        elif kind == "cell":
            table.cells[name] = Cells(
                source.header[index], unit, [cell.strip() for cell in column], decimal_comma
            )
        else:
            values = np.empty(table.rows)
            for i, cell in enumerate(column):
                text = cell.strip()
                if marker and text.startswith(marker):
                    table.marks[i, name] = text.replace(",", ".") if decimal_comma else text
                    values[i] = np.nan
                elif not text and may_be_blank:
                    values[i] = np.nan
                else:
                    try:
                        values[i] = parse_number(_pointed(text) if decimal_comma else text)
                    except ValueError:
                        expected = WITH_COMMA if decimal_comma else "a number"
                        raise table.error(i, source.header[index], cell, expected) from None
            table.numbers[name] = Numbers(source.header[index], unit, values)


def _version(package: ModuleType) -> tuple[int, int]:
    major, minor = package.__version__.split(".")[:2]
    return int(major), int(minor)


def _read_large(source: Source, table: Table, plan: _Plan, marker: str) -> bool:
    """Read with pandas; False where anything is out of order, for the csv module to say what and where."""
    import pandas as pd

    # from 3.1 numbers are read to the nearest double without being asked to
    exact: dict[str, Literal["round_trip"]] = (
        {} if _version(pd) >= (3, 1) else {"float_precision": "round_trip"}
    )

    def read(decimal: str) -> pd.DataFrame:
        return pd.read_csv(
            io.BytesIO(source.text.encode()),
            sep=source.delimiter,
            header=0,
            names=range(len(source.header)),
            index_col=False,
            dtype={
                index: float if kind == "number" and not marker else "category" if kind == "text" else object
                for _, index, _, kind, _ in plan
            },
            usecols=[index for _, index, *_ in plan] if plan else None,
            keep_default_na=False,
            na_values={
                index: [""]
                for _, index, _, kind, may_be_blank in plan
                if kind == "number" and may_be_blank and not marker
            },
            decimal=decimal,
            engine="c",
            **exact,
        )

    decimal_comma = False
    try:
        frame = read(".")
    except ValueError:
        if source.delimiter == ",":
            return False
        try:
            frame = read(",")
        except ValueError:
            return False
        decimal_comma = True
    rows = len(frame)
    marks: dict[tuple[int, str], str] = {}
    for name, index, unit, kind, may_be_blank in plan:
        if kind == "number" and not marker:
            values = frame[index].to_numpy()
            empty = np.isnan(values)
        elif kind == "number":
            text = frame[index].to_numpy(dtype=object)
            marked = frame[index].str.startswith(marker).to_numpy(dtype=bool)
            marks |= {(int(row), name): text[row].strip() for row in np.flatnonzero(marked)}
            if source.has_commas([text[marked]]):
                return False
            empty = (text == "") | marked
            try:
                values = np.where(empty, "nan", text).astype(float)
            except ValueError:
                return False
        elif kind == "text":
            column = frame[index].cat
            # two that differ in blanks are one
            stripped = [str(category).strip() for category in column.categories]
            codes = column.codes.to_numpy().astype(np.intp)
            first = np.zeros(len(stripped), dtype=np.intp)
            first[codes[::-1]] = np.arange(rows)[::-1]
            unique: dict[str, int] = {}
            of_code = np.zeros(len(stripped), dtype=np.intp)
            for k in np.argsort(first, kind="stable").tolist():
                of_code[k] = unique.setdefault(stripped[k], len(unique))
            table.texts[name] = np.array(stripped, dtype=object)[codes].tolist()
            table._numbered[name] = list(unique), of_code[codes]
            continue
        else:
            cells = [cell.strip() for cell in frame[index].tolist()]
            if source.has_commas([cells]) and not decimal_comma:
                return False
            table.cells[name] = Cells(source.header[index], unit, cells, decimal_comma)
            continue
        if not ((np.abs(values) <= LARGEST) | (empty & may_be_blank)).all():
            return False
        table.numbers[name] = Numbers(source.header[index], unit, values)
    table.rows = rows
    table.marks.update(marks)
    return True
