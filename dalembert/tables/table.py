"""Tables in: CSV and workbooks, read into columns, each cell's fault named by row and column.

A command says which quantities it knows; `read` finds their columns by name and unit, in any order and
case, and converts the cells. CSV of some 10 000 rows and more goes through pandas; whatever pandas
stumbles over is read again by the standard `csv` module, which knows the row of every cell.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from dalembert.dataclass import dataclass, field
from dalembert.errors import DataError, quote
from dalembert.quantities import is_number, number_expected, parse_number
from dalembert.tables.headers import Heading, find_columns, offers, spellings, translated
from dalembert.tables.sources import DASHES, Source, open_source, without_dashes
from dalembert.units import LARGEST, UNITS, to_si

if TYPE_CHECKING:
    from fractions import Fraction

    import pandas as pd
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False, repr=False)
class Numbers:
    """A column of numbers in the file's own unit; NaN where an allowed blank or mark stands."""

    header: str
    """The header as the file writes it."""
    unit: str
    values: NDArray[np.float64]
    dimension: str

    @property
    def si(self) -> NDArray[np.float64]:
        """The numbers in SI."""
        return to_si(self.values, self.dimension, self.unit)

    @property
    def decimals(self) -> list[Fraction]:
        """The numbers of the file as they are written, in its unit."""
        from fractions import Fraction

        return [Fraction(repr(x)) for x in self.values.tolist()]

    @property
    def exact(self) -> list[Fraction]:
        """The decimals of the file in SI, not rounded: `unit` of an angle in degrees."""
        from dalembert.quantities import exactly

        factor = (1, 1) if self.unit == "deg" else UNITS[self.dimension][self.unit]
        # the shortest decimal that is read as the number
        return [exactly(repr(x), factor) for x in self.values.tolist()]


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
    hint: str = ""
    """Description of the file where a column is missing: its header, and which columns may be meant."""
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
                if any(map(str.isalpha, cell)) and not is_number(cell.replace(",", ".")):
                    continue  # a word among numbers keeps its commas
                try:
                    column[i] = _pointed(cell)
                except ValueError:
                    raise self.error(i, name, cell, WITH_COMMA) from None

    def error(self, index: int, column: str, value: object, expected: str) -> DataError:
        """Make the one line for a cell of a column, as the header or the command names it."""
        assert self._source is not None
        return self._source.error(index, column, str(value), expected)

    def reject(self, bad: NDArray[np.bool_], quantity: str, expected: str) -> None:
        """Raise the error of the first cell of a number column for which `bad` holds."""
        if bad.any():
            raise self.wrong(int(np.argmax(bad)), quantity, expected)

    @property
    def as_written(self) -> dict[str, list[str]]:
        """Columns of a table of texts alone, by the headers as the file has them: `Group (A)`."""
        assert self._source is not None
        titles = (each.written for each in self._source.headings if each.name)
        return dict(zip(titles, self.texts.values(), strict=True))

    def needed(self, name: str) -> list[str]:
        """Return a column of texts, or say that the table lacks it."""
        if name not in self.texts:
            raise DataError(f"{self.file}: no column {name} {self.hint}")
        return self.texts[name]

    def named(self, name: str, otherwise: str = "1") -> list[str]:
        """Return a column of texts; without it `otherwise` stands in every row."""
        return self.texts.get(name) or [otherwise] * self.rows

    def require(self, quantity: str, dimension: str) -> Numbers:
        """Return a column of numbers, or say that the table lacks it."""
        if quantity not in self.numbers:
            raise DataError(f"{self.file}: no column {spellings(quantity, dimension)} {self.hint}")
        return self.numbers[quantity]


def numbered(codes: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Number codes in the order in which they first stand: the number of each code, and where each number first stands.

    >>> numbered(np.array([7, 3, 7, 5]))
    (array([0, 1, 0, 2]), array([0, 1, 3]))
    """
    _, first, inverse = np.unique(codes, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[inverse], first[order]


def read(
    path: str,
    *,
    numbers: Mapping[str, str] | None = None,
    texts: Sequence[str] | None = (),
    cells: Mapping[str, str] | None = None,
    blank: Sequence[str] = (),
    marker: str = "",
    needed: Sequence[Sequence[str]] = (),
    headers: Callable[[list[str]], list[str]] | None = None,
    layout: Callable[[Source], Source] | None = None,
) -> Table:
    """Read a CSV file or a workbook (`FILE.xlsx#Sheet`), or standard input for `-`.

    Parameters
    ----------
    path
        The file.
    numbers
        Quantity -> dimension (a key of `dalembert.units.UNITS`) of the columns of numbers the command knows.
    texts
        The columns of names; a name is text whatever it looks like. None: every column that has a header.
    cells
        As `numbers`, for columns whose cells the command reads itself.
    blank
        The columns whose cells may be empty, or a dash in their place: numbers read as NaN, others as no text.
    marker
        Cells of `numbers` that begin with it are no numbers: NaN, and their text in `Table.marks`.
    needed
        Sets of columns: the table needs one of each. If one set is missing, headers in other languages are read too.
    headers
        What the header as written means: the columns' names by their places.
    layout
        Brings a table of another layout to that of the columns.

    Raises
    ------
    DataError
        No such file, no text, no header, no rows, a doubled column, an unknown unit, a cell that is no number.
    """
    dimensions = {**(numbers or {}), **(cells or {})}
    source = open_source(path, dimensions, texts)
    if layout is not None:
        source = layout(source)
    if headers is not None:
        meant = headers([each.name for each in source.headings])
        source.headings = [
            each if name == each.name else Heading(each.written, name)
            for each, name in zip(source.headings, meant, strict=True)
        ]
    texts = [each.name for each in source.headings if each.name] if texts is None else texts
    found = find_columns(source.file, source.headings, dimensions, texts)
    if not all(any(name in found for name in names) for names in needed):
        source = source.named(translated(source.headings, dimensions, texts))
        found = find_columns(source.file, source.headings, dimensions, texts)
    columns = [
        _Column(
            name,
            index,
            source.header[index],
            unit,
            dimensions.get(name, ""),
            "text" if name in texts else "cell" if name in (cells or {}) else "number",
            name in blank,
        )
        for name, (index, unit) in found.items()
    ]
    used = {column.place for column in columns}
    others = (index for index in range(len(source.headings)) if index not in used)
    extra = [source.headings[index] for index in source.filled(others)]
    missed = {name: dimension for name, dimension in dimensions.items() if name not in found}
    missed_texts = [name for name in texts if name not in found]
    if extra:
        named = [quote(each.written) for each in extra if each.written]
        bare = len(extra) - len(named)
        what = [f"the column{'s' * (len(named) > 1)} {', '.join(named)}"] if named else []
        what += [f"{bare} column{'s' * (bare > 1)} without a header"] if bare else []
        offered = offers(extra, missed, missed_texts)
        source.warnings.append(
            f"{source.file}: ignored {' and '.join(what)}"
            + (f"; to read: {' '.join(offered)}" if offered else "")
        )
    source.check_cells(used)
    hint = source.hint(extra, missed, missed_texts)

    def begun() -> Table:
        return Table(source.file, source.header, 0, warnings=source.warnings, hint=hint, _source=source)

    table = begun()
    if not (source.large and _read_large(source, table, columns, marker)):
        # of what pandas has read nothing is kept
        table = begun()
        _read_small(source, table, columns, marker)
    if table.rows == 0:
        raise DataError(
            f"{source.file}: a header and no rows{source.of_sheet}: expected at least one row of data"
        )
    return table


class _Column(NamedTuple):
    """A column that is read, and what becomes of its cells."""

    name: str
    place: int
    header: str
    unit: str
    dimension: str
    kind: Literal["text", "cell", "number"]
    may_be_blank: bool


WITH_COMMA = "a number with a decimal comma, as elsewhere in the file"


def _pointed(text: str) -> str:
    """Write a point for the decimal comma; ValueError where there is a point already."""
    if "." in text:
        raise ValueError(text)
    return text.replace(",", ".")


def _number_expected(text: str, decimal_comma: bool) -> str:
    """Return the expected value in place of a cell.

    >>> _number_expected("3,4", False)
    'a number: decimal commas need columns separated by ; or tabs'
    """
    if decimal_comma:
        return WITH_COMMA if is_number(text) else number_expected(text)
    if text.count(",") == 1 and "." not in text and is_number(text.replace(",", ".")):
        return "a number: decimal commas need columns separated by ; or tabs"
    return number_expected(text)


def _read_small(source: Source, table: Table, columns: Sequence[_Column], marker: str) -> None:
    width = len(source.header)
    rows = [cells for _, cells in source.full_rows()]
    table.rows = len(rows)
    written = list(zip(*rows, strict=True)) or [()] * width
    decimal_comma = source.has_commas(written[each.place] for each in columns if each.kind != "text")
    for each in columns:
        cells = [cell.strip() for cell in written[each.place]]
        if each.may_be_blank:
            cells = without_dashes(cells)
        if each.kind == "text":
            table.texts[each.name] = cells
        elif each.kind == "cell":
            table.cells[each.name] = Cells(each.header, each.unit, cells, decimal_comma)
        else:
            values = np.full(table.rows, np.nan)
            for i, text in enumerate(cells):
                if marker and text.startswith(marker):
                    table.marks[i, each.name] = text.replace(",", ".") if decimal_comma else text
                elif text or not each.may_be_blank:
                    try:
                        values[i] = parse_number(_pointed(text) if decimal_comma else text)
                    except ValueError:
                        expected = _number_expected(text, decimal_comma)
                        raise table.error(i, each.header, written[each.place][i], expected) from None
            table.numbers[each.name] = Numbers(each.header, each.unit, values, each.dimension)


def _read_large(source: Source, table: Table, columns: Sequence[_Column], marker: str) -> bool:
    """Read with pandas; False where anything is out of order, for the csv module to say what and where."""
    # without a comma between cells it may be the decimal mark
    for decimal in "." if source.delimiter == "," else ".,":
        with suppress(ValueError):
            frame = _frame(source, columns, marker, decimal)
            break
    else:
        return False
    table.rows = len(frame)
    for each in columns:
        column = frame[each.place]
        if each.kind == "text":
            table.texts[each.name], table._numbered[each.name] = _texts(column, each.may_be_blank)
            continue
        if each.kind == "cell":
            cells = [cell.strip() for cell in column.tolist()]
            if each.may_be_blank:
                cells = without_dashes(cells)
            if source.has_commas([cells]) and decimal == ".":
                return False
            table.cells[each.name] = Cells(each.header, each.unit, cells, decimal == ",")
            continue
        values = column.to_numpy()
        if marker:
            text, marked = values, column.str.startswith(marker).to_numpy(dtype=bool)
            table.marks |= {(int(row), each.name): text[row].strip() for row in np.flatnonzero(marked)}
            if source.has_commas([text[marked]]):
                return False
            empty = (text == "") | marked
            try:
                values = np.where(empty, "nan", text).astype(float)
            except ValueError:
                return False
        else:
            empty = np.isnan(values)
        if not ((np.abs(values) <= LARGEST) | (empty & each.may_be_blank)).all():
            return False
        table.numbers[each.name] = Numbers(each.header, each.unit, values, each.dimension)
    return True


def _frame(source: Source, columns: Sequence[_Column], marker: str, decimal: str) -> pd.DataFrame:
    import pandas as pd

    def kind(each: _Column) -> type | str:
        if each.kind == "text":
            return "category"
        return float if each.kind == "number" and not marker else object

    blanks = [each.place for each in columns if kind(each) is float and each.may_be_blank]
    version = tuple(map(int, pd.__version__.split(".")[:2]))
    # from 3.1 numbers are read to the nearest double by default
    exact: dict[str, Literal["round_trip"]] = {} if version >= (3, 1) else {"float_precision": "round_trip"}
    return pd.read_csv(
        io.BytesIO(source.text.encode()),
        sep=source.delimiter,
        header=0,
        names=range(len(source.header)),
        index_col=False,
        dtype={each.place: kind(each) for each in columns},
        usecols=[each.place for each in columns] or None,
        keep_default_na=False,
        na_values={place: ["", *DASHES] for place in blanks},
        decimal=decimal,
        engine="c",
        **exact,
    )


def _texts(column: pd.Series, may_be_blank: bool) -> tuple[list[str], tuple[list[str], NDArray[np.intp]]]:
    """Return a column's texts, and as `Table.numbered` has them; two that differ in blanks are one."""
    stripped = [str(category).strip() for category in column.cat.categories]
    if may_be_blank:
        stripped = without_dashes(stripped)
    codes = column.cat.codes.to_numpy().astype(np.intp)
    first = np.zeros(len(stripped), dtype=np.intp)
    first[codes[::-1]] = np.arange(len(codes))[::-1]
    unique: dict[str, int] = {}
    of_code = np.zeros(len(stripped), dtype=np.intp)
    for k in np.argsort(first, kind="stable").tolist():
        of_code[k] = unique.setdefault(stripped[k], len(unique))
    return np.array(stripped, dtype=object)[codes].tolist(), (list(unique), of_code[codes])
