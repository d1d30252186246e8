"""The exercise check: a result against expected values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from dalembert.errors import DataError
from dalembert.figures import last_place
from dalembert.hints import nearest
from dalembert.quantities import is_number, parse_number
from dalembert.results.columns import Column, Table
from dalembert.results.text import printed
from dalembert.tables.headers import plain
from dalembert.tables.table import read
from dalembert.units import column_dimensions, common_dimension, find_unit, to_si
from dalembert.units import from_si as to_unit

if TYPE_CHECKING:
    from dalembert.results.columns import Cell, Values
    from dalembert.tables.table import Table as ReadTable

COMPARED = ("row", "column", "value", "expected", "error", "verdict")


@dataclass(frozen=True)
class Comparison:
    """A row for each expected cell, and whether all hold."""

    table: Table
    summary: str
    passed: bool
    warnings: Sequence[str] = ()


@dataclass(frozen=True)
class _Expected:
    """A column of the file: the result's column it is compared with, and what turns its unit into that one's."""

    header: str
    column: str
    unit: str
    cells: list[str]
    convert: Callable[[float], float]

    @property
    def turn(self) -> float:
        """A turn in the unit of the result's column; 0 where it is no angle."""
        return {"deg": 360.0, "rad": math.tau}.get(self.unit, 0.0)


def compare(tables: Sequence[Table], file: str, rtol: float) -> Comparison:
    """Compare that table of a result which has most of a file's columns with the expected values in it, cell by cell.

    Rows are matched by the key columns that the file has, else by their order. A number holds where its
    relative error is at most `rtol`, an angle where it is off by at most `rtol` radians, modulo a turn; an
    expected zero is measured against the largest value in its column. Empty cells expect nothing. A key that is a
    number is matched to the digits that the file has. Values in another unit are converted; further columns of texts
    (a student's name) are kept with the verdicts, not compared.
    """
    read_table = read(file, texts=None)
    headers = list(read_table.texts)
    table = max(tables, key=lambda each: sum(_partner(header, each) is not None for header in headers))
    columns = table.cells
    compared, aside = _columns(read_table, table, file)
    kept = {name: read_table.texts[name] for name in aside if name.strip() and name not in COMPARED}
    numbers = [c.header for c in compared if _has_numbers(columns[c.column])]
    read_table.points(numbers)
    keys = [c for c in compared if c.column in table.keys and not (is_input(c.column) and "step" in headers)]
    _refuse_ambiguous(table, keys, file)
    has = [key for key in table.keys if key in columns]
    rows = list(_match(columns, file, keys, read_table.rows, rtol, has))
    labels = [
        key for key in table.keys if key in columns and (key in {c.column for c in keys} or not is_input(key))
    ]
    shown = {key: printed(key, columns[key]) for key in labels}
    lines: list[tuple[Cell, ...]] = []
    blank = 0
    for index, row in enumerate(rows):
        for c in compared:
            if c in keys:
                continue
            wanted = c.cells[index]
            if not wanted:
                blank += 1
                continue
            value = columns[c.column][row]
            number, error = _error(c, value, wanted, columns[c.column])
            label = "/".join(shown[key][row] for key in labels) or str(row + 1)
            names = [cells[index] for cells in kept.values()]
            lines.append((label, c.column, value, number, error, "ok" if error <= rtol else "WRONG", *names))
    if not lines:
        raise DataError(f"{file}: no expected value in it: nothing would be checked")
    cells = dict(zip((*COMPARED, *kept), zip(*lines, strict=True), strict=True))
    right = cells["verdict"].count("ok")
    blanks = f", {blank} blank" if blank else ""
    summary = f"{right} of {len(lines)} values within {rtol:g}{blanks}"
    check = Table(
        [Column(name, "", list(values), place=name) for name, values in cells.items()],
        keys=("row", "column"),
        place="check[]",
        below=summary,
    )
    left_aside = [f"{file}: not compared: {', '.join(aside)}"] if aside else []
    return Comparison(check, summary, right == len(lines), left_aside)


def _partner(header: str, table: Table) -> tuple[str, str] | None:
    """Return the column that a header of the file means, and the header's unit; None if there is none."""
    for column in table.columns:
        if plain(column.header).lower() == header.lower():
            return column.header, column.unit
    for column in table.columns:
        name = f"{plain(column.name)}_"
        base, unit = header[: len(name)], header[len(name) :]
        if base.lower() == name.lower() and common_dimension(unit, column.unit) is not None:
            return column.header, unit
    return None


def _columns(read_table: ReadTable, table: Table, file: str) -> tuple[list[_Expected], list[str]]:
    """Return the file's columns that the result has, and those of texts that are left aside."""
    by_header = {column.header: column for column in table.columns}
    compared: list[_Expected] = []
    aside: list[str] = []
    for header, cells in read_table.texts.items():
        partner = _partner(header, table)
        if partner is None:
            number = next((cell for cell in cells if cell and is_number(cell.replace(",", "."))), None)
            if number is not None or column_dimensions(header):
                raise DataError(
                    f"{file}: the result has no column '{header}': expected some of "
                    f"{', '.join(by_header)}{nearest(header, _alike(header, table), 0.4)}"
                )
            aside.append(header)
            continue
        column, unit = partner
        own = by_header[column].unit
        compared.append(_Expected(header, column, own, cells, _conversion(unit, own)))
    if not compared:
        raise DataError(f"{file}: no column of the result: expected some of {', '.join(by_header)}")
    return compared, aside


def _conversion(unit: str, into: str) -> Callable[[float], float]:
    """What turns a number of a unit into another unit of the same dimension."""
    if unit == into:
        return float
    dimension = common_dimension(unit, into) or ""
    own = find_unit(dimension, unit) or ""
    return lambda x: float(to_unit(to_si(x, dimension, own), dimension, into))


def _alike(header: str, table: Table) -> list[str]:
    """Return the columns of the dimension that a header's unit has; all of them for a header without a unit."""
    of = column_dimensions(header)
    return [c for c in table.cells if not of or of & column_dimensions(c)]


def _has_numbers(column: Values) -> bool:
    """Tell whether a column of the result holds numbers: names and verdicts keep their commas."""
    first = next((value for value in column if value is not None), None)
    return isinstance(first, Real)


def is_input(name: str) -> bool:
    """Whether a column holds a pose's input: a key that is a number."""
    return re.search(r"(?:^|_)input_[a-z]+$", name) is not None


def _refuse_ambiguous(table: Table, keys: Sequence[_Expected], file: str) -> None:
    """Refuse a file that cannot say which of several variants, rotors or assemblies its rows belong to."""
    cells, there = table.cells, {c.column for c in keys}
    for key in ("variant", "rotor", "branch"):
        if key not in table.keys or key not in cells or key in there:
            continue
        names = dict.fromkeys(map(str, cells[key]))
        if len(names) > 1:
            raise DataError(
                f"{file}: the result has {len(names)} {key}{'es' if key == 'branch' else 's'}: "
                f"expected a column {key} that says which one a row belongs to"
            )


def _match(
    columns: Mapping[str, Values],
    file: str,
    keys: Sequence[_Expected],
    rows: int,
    rtol: float,
    named: Sequence[str],
) -> Iterator[int]:
    """Yield for each expected row the result's row; `named`: the key columns that the result has."""
    length = len(next(iter(columns.values())))
    if not keys:
        if rows > length:
            raise DataError(
                f"{file}: row {length + 1}: expected {length} rows, as many as the result has, found {rows}"
            )
        if rows < length:
            missing = f"a key column ({', '.join(named)})" if named else "a row for each"
            raise DataError(
                f"{file}: found {rows} of the result's {length} rows: expected {missing}; without it the rows cannot be matched"
            )
        yield from range(rows)
        return
    texts = [c for c in keys if not _has_numbers(columns[c.column])]
    numbers = [c for c in keys if _has_numbers(columns[c.column])]
    places: dict[tuple[str, ...], list[int]] = {}
    for row in range(length):
        places.setdefault(tuple(str(columns[c.column][row]) for c in texts), []).append(row)
    # of each key: the first row of the file, how many rows the result has of it, and the file
    groups: dict[tuple[str, ...], list[int]] = {}
    for index in range(rows):
        left = there = places.get(tuple(c.cells[index] for c in texts), [])
        for c in numbers:
            left = _nearest(c, columns[c.column], left, c.cells[index], rtol)
            there = left
        taken = groups.setdefault(tuple(c.cells[index] for c in keys), [index, len(there), 0])
        taken[2] += 1
        if not left:
            wanted = ", ".join(f"{c.header} {c.cells[index]}" for c in keys)
            raise DataError(f"{file}: row {index + 1}: the result has no (further) row with {wanted}")
        yield left[0]
        places[tuple(c.cells[index] for c in texts)].remove(left[0])
    for cells, (index, many, few) in groups.items():
        absent = [name for name in named if name not in {c.column for c in keys}]
        if few < many and absent:
            wanted = ", ".join(f"{c.header} {cell}" for c, cell in zip(keys, cells, strict=True))
            raise DataError(
                f"{file}: row {index + 1}: {many} rows of the result have {wanted}: expected a column {' or '.join(absent)} too"
            )


def _nearest(c: _Expected, column: Values, rows: list[int], wanted: str, rtol: float) -> list[int]:
    """The rows whose number comes nearest to the one wanted, within the tolerance or half a unit of its last digit."""
    try:
        number = c.convert(parse_number(wanted))
    except ValueError:
        return []
    away = np.array([column[row] for row in rows], dtype=float) - number
    if c.turn:  # first the same angle, and of 0° and 360° the one that is meant
        turned = np.abs(np.remainder(away + c.turn / 2, c.turn) - c.turn / 2) * (math.tau / c.turn)
        limit = max(rtol, abs(c.convert(_half_unit(wanted))) * (math.tau / c.turn))
        best = turned <= min(limit, turned.min(initial=np.inf) + 1e-12)
    else:
        most = max(abs(number), np.abs(away).max(initial=0.0))
        best = np.abs(away) <= max(rtol * most, abs(c.convert(_half_unit(wanted))))
    away = np.where(best, np.abs(away), np.inf)
    return [row for row, d in zip(rows, away, strict=True) if d < np.inf and d == away.min()]


def _half_unit(number: str) -> float:
    """Half a unit of the last digit of a decimal number."""
    return 0.5 * 10.0 ** last_place(number)


def _error(c: _Expected, value: Cell, wanted: str, column: Values) -> tuple[Cell, float]:
    """Return the expected value in the result's unit, and the error of the result's."""
    if isinstance(value, str):
        return wanted, 0.0 if value == wanted else math.inf
    if isinstance(value, (bool, np.bool_)):
        return wanted, 0.0 if str(bool(value)).lower() == wanted.lower() else math.inf
    try:
        number = c.convert(parse_number(wanted))
    except ValueError:
        return wanted, math.inf
    if value is None or value != value:
        return number, math.inf
    if c.turn:
        return number, abs(math.remainder(value - number, c.turn)) * (math.tau / c.turn)
    scale = abs(number) or max(
        (abs(other) for other in column if other is not None and not isinstance(other, str)), default=0.0
    )
    return number, abs(value - number) / scale if scale else abs(value - number)
