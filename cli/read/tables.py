"""CSV in: whatever a spreadsheet writes, read into columns, each cell's fault named by row and column.

A command says which quantities it knows; `read` finds their columns by name and unit suffix, in any
order and case, and converts the cells. Tables of some 10 000 rows and more go through pandas; whatever
pandas stumbles over is read again by the standard `csv` module, which knows the row of every cell.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError, cell_error, quote
from cli.read.files import read_bytes
from cli.read.units import LARGEST, UNITS, find_unit, nearest_unit, parse_number

if TYPE_CHECKING:
    from numpy.typing import NDArray

LARGE = 10_000  # rows from which importing pandas pays


@dataclass(frozen=True)
class Numbers:
    """A column of numbers in the file's own unit; NaN where an allowed blank or mark stands."""

    header: str
    unit: str
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Cells:
    """A column with a unit whose cells are left as text."""

    header: str
    unit: str
    values: list[str]
    decimal_comma: bool = False

    def number(self, text: str) -> float:
        """Read a number out of a cell; ValueError where it is none, or has not the decimal mark of the file."""
        return parse_number(_pointed(text) if self.decimal_comma else text)


@dataclass
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
    _source: _Source | None = None

    @cached_property
    def _written(self) -> list[list[str]]:
        assert self._source is not None
        return [cells for _, cells in self._source.records()]

    def written(self, index: int, quantity: str) -> str:
        """Return a cell of a number column as the file wrote it; looked up for messages only."""
        return self._written[index + 1][self.header.index(self.numbers[quantity].header)].strip()

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

    def where(self, index: int) -> tuple[int, int]:
        """Return the number of a data row (from 1) and its line in the file."""
        assert self._source is not None
        line, _ = next(islice(self._source.records(), index + 1, None))
        return index + 1, line

    def error(self, index: int, column: str, found: object, expected: str) -> DataError:
        """Make the one line for a cell: `column` as the header spells it."""
        return cell_error(self.file, *self.where(index), column, str(found), expected)

    def reject(self, bad: NDArray[np.bool_], quantity: str, expected: str) -> None:
        """Raise the error of the first cell of a number column for which `bad` holds."""
        if bad.any():
            raise self.wrong(int(np.argmax(bad)), quantity, expected)

    def require(self, quantity: str, dimension: str) -> Numbers:
        """Return a column of numbers, or say that the table lacks it."""
        if quantity not in self.numbers:
            raise DataError(
                f"{self.file}: no column {spellings(quantity, dimension)} (the header is: {', '.join(self.header)})"
            )
        return self.numbers[quantity]


def spellings(quantity: str, dimension: str) -> str:
    """List the names a quantity's column may have: `mass_kg, mass_g or mass_lb`."""
    names = [f"{quantity}_{unit}" if unit else quantity for unit in UNITS[dimension]][:4]
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


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
    """Read a CSV file, or standard input for `-`.

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
    source = _open(path)
    if headers is not None:
        source.header = headers(source.header)
    known = {**(numbers or {}), **(cells or {})}
    texts = source.header if texts is None else texts
    found = _find_columns(source, known, texts)
    table = Table(source.file, source.header, 0, warnings=source.warnings, _source=source)
    used = {index for index, _ in found.values()}
    extra = [name for index, name in enumerate(source.header) if index not in used]
    if extra:
        table.warnings.append(
            f"{source.file}: ignored the column{'s' * (len(extra) > 1)} {', '.join(quote(name) for name in extra)}"
        )
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
        raise DataError(f"{source.file}: a header and no rows: expected at least one row of data")
    return table


WITH_COMMA = "a number with a decimal comma, as elsewhere in the file"


def _pointed(text: str) -> str:
    """Write a point for the decimal comma; ValueError where there is a point already."""
    if "." in text:
        raise ValueError(text)
    return text.replace(",", ".")


_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


@dataclass
class _Source:
    """The text of a file and how its cells are told apart."""

    file: str
    text: str
    delimiter: str
    header: list[str]
    warnings: list[str]
    large: bool

    def has_commas(self, columns: Iterable[Iterable[str]]) -> bool:
        """Tell whether these cells have decimal commas: where no comma parts cells, and one stands in a cell."""
        return self.delimiter != "," and any("," in cell for column in columns for cell in column)

    def records(self) -> Iterator[tuple[int, list[str]]]:
        """Yield (line, cells) of the header and of every row that is not blank."""
        lines = (match.group() for match in _LINE.finditer(self.text))
        reader = csv.reader(lines, delimiter=self.delimiter, strict=True)
        line = 1
        try:
            for record in reader:
                if any(cell and not cell.isspace() for cell in record):
                    yield line, record
                line = reader.line_num + 1
        except csv.Error as error:
            raise DataError(f"{self.file}: line {line}: {error}: expected CSV with balanced quotes") from None


def _open(path: str) -> _Source:
    file, data = read_bytes(path)
    warnings: list[str] = []
    text = _decode(file, data, warnings)
    source = _Source(file, text, _delimiter(text), [], warnings, text.count("\n") >= LARGE)
    _, first = next(source.records(), (0, []))
    if not first:
        raise DataError(f"{file}: the file is empty: expected a header and rows")
    source.header = [name.strip() for name in first]
    return source


def _decode(file: str, data: bytes, warnings: list[str]) -> str:
    if data[:4] == b"PK\x03\x04":
        raise DataError(
            f"{file}: this is a spreadsheet or zip file: expected CSV text (save the sheet as CSV)"
        )
    codec = "utf-8-sig"
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        codec = "utf-16"
    elif b"\0" in data[:200] and len(data) % 2 == 0:
        # without a byte order mark: ASCII in UTF-16 has its zeros on one side
        codec = "utf-16-le" if not any(data[1:200:2]) else "utf-16-be" if not any(data[:200:2]) else codec
    try:
        text = data.decode(codec)
    except UnicodeDecodeError:
        try:
            text = data.decode("cp1252")
        except UnicodeDecodeError:
            raise DataError(f"{file}: this is not text: expected CSV in UTF-8") from None
        codec = "cp1252"
    if re.search(r"[\0-\x08\x0e-\x1f\x7f]", text):
        raise DataError(f"{file}: this is not text (control characters): expected CSV in UTF-8")
    if codec != "utf-8-sig":
        warnings.append(
            f"{file}: read as {'Windows-1252 (Latin-1)' if codec == 'cp1252' else 'UTF-16'}, for it is not UTF-8"
        )
    return text


def _delimiter(text: str) -> str:
    first = re.search(r"\S.*", text)
    header = first.group() if first else ""
    return max(",;\t", key=lambda mark: (header.count(mark), mark == ","))


def _find_columns(
    source: _Source, known: Mapping[str, str], texts: Sequence[str]
) -> dict[str, tuple[int, str]]:
    """Find each quantity's column: its place in the row and its unit."""
    found: dict[str, tuple[int, str]] = {}
    lower = [name.lower() for name in source.header]
    for name in texts:
        places = [index for index, header in enumerate(lower) if header == name.lower()]
        if len(places) > 1:
            raise DataError(f"{source.file}: the column {name} stands twice: expected it once")
        if places:
            found[name] = (places[0], "")
    for name, dimension in known.items():
        good: list[tuple[int, str]] = []
        bad: list[tuple[int, str]] = []
        for index, header in enumerate(lower):
            if header == name or header.startswith(name + "_"):
                unit = find_unit(dimension, source.header[index][len(name) + 1 :])
                (bad if unit is None else good).append((index, unit or ""))
        if len(good) > 1:
            both = " and ".join(source.header[index] for index, _ in good)
            raise DataError(
                f"{source.file}: {name} is given more than once, by the columns {both}: expected one of them"
            )
        if good:
            found[name] = good[0]
        elif bad:
            # a column that another quantity claims (`z_rotation` beside `z`) is not an unknown unit
            others = [other for other in (*known, *texts) if other.startswith(name + "_")]
            strays = [
                i for i, _ in bad if not any(lower[i] == o or lower[i].startswith(o + "_") for o in others)
            ]
            if strays:
                header = source.header[strays[0]]
                suffix = header[len(name) + 1 :]
                problem = f"the unknown unit '{suffix}'" if suffix else "no unit"
                hint = nearest_unit(suffix, dimension) if suffix else ""
                raise DataError(
                    f"{source.file}: the column {header} has {problem}: expected {spellings(name, dimension)}{hint}"
                )
    return found


_Plan = Sequence[tuple[str, int, str, str, bool]]


def _read_small(source: _Source, table: Table, plan: _Plan, marker: str) -> None:
    records = source.records()
    next(records)
    width = len(source.header)
    rows: list[list[str]] = []
    for line, record in records:
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
                    table.marks[i, name] = text
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


def _version(package: Any) -> tuple[int, int]:
    major, minor = package.__version__.split(".")[:2]
    return int(major), int(minor)


def _read_large(source: _Source, table: Table, plan: _Plan, marker: str) -> bool:
    """Read with pandas; False where anything is out of order, for the csv module to say what and where."""
    import pandas as pd

    # from 3.1 numbers are read to the nearest double without being asked to
    exact: dict[str, Any] = {} if _version(pd) >= (3, 1) else {"float_precision": "round_trip"}

    def read(decimal: str) -> pd.DataFrame:
        return pd.read_csv(
            io.BytesIO(source.text.encode()),
            sep=source.delimiter,
            header=0,
            names=range(len(source.header)),
            index_col=False,
            dtype={
                index: float
                if kind == "number" and not may_be_blank
                else "category"
                if kind == "text"
                else str
                for _, index, _, kind, may_be_blank in plan
            },
            usecols=[index for _, index, *_ in plan] if plan else None,
            keep_default_na=False,
            na_filter=False,
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
        if kind == "number" and not may_be_blank:
            values = frame[index].to_numpy()
        elif kind == "number":
            text = frame[index].to_numpy(dtype=object)
            empty = text == ""
            if marker:
                marked = frame[index].str.startswith(marker).to_numpy(dtype=bool)
                marks |= {(int(row), name): text[row].strip() for row in np.flatnonzero(marked)}
                empty |= marked
            try:
                values = np.where(empty, "0", text).astype(float)
            except ValueError:
                return False
        elif kind == "text":
            column = frame[index].cat
            named = np.array([str(category).strip() for category in column.categories], dtype=object)
            table.texts[name] = named[column.codes].tolist()
            continue
        else:
            cells = frame[index].str.strip().tolist()
            if source.has_commas([cells]) and not decimal_comma:
                return False
            table.cells[name] = Cells(source.header[index], unit, cells, decimal_comma)
            continue
        if not (np.abs(values) <= LARGEST).all():
            return False
        if may_be_blank:
            values[empty] = np.nan
        table.numbers[name] = Numbers(source.header[index], unit, values)
    table.rows = rows
    table.marks.update(marks)
    return True


def number_names(names: list[str]) -> tuple[list[str], NDArray[np.intp]]:
    """Number names in the order in which they first stand."""
    if len(names) >= LARGE:
        import pandas as pd

        codes, unique = pd.factorize(np.array(names, dtype=object))
        return unique.tolist(), codes.astype(np.intp)
    first: dict[str, int] = {}
    codes = np.array([first.setdefault(name, len(first)) for name in names], dtype=np.intp)
    return list(first), codes
