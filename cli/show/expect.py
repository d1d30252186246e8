"""The exercise check: a result beside the values that were expected."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from cli.errors import DataError, nearest
from cli.read.tables import read
from cli.read.units import column_dimensions, parse_number

if TYPE_CHECKING:
    from cli.show.columns import Cell, Table, Values

    Columns = Mapping[str, Values]


COMPARED = ("row", "column", "value", "expected", "error", "verdict")


@dataclass(frozen=True)
class Comparison:
    """A row for each expected cell, and whether all hold."""

    columns: Columns
    summary: str
    passed: bool


def compare(table: Table, file: str, rtol: float, others: Sequence[Callable[[], Table]] = ()) -> Comparison:
    """Compare a result with a file of expected values, cell by cell.

    Rows are matched by the key columns that the file has, else by their order. A number holds where its
    relative error is at most `rtol`, an angle where it is off by at most `rtol` radians, modulo a turn; an
    expected zero is measured against the largest value in its column. Empty cells expect nothing. An input is a
    key where no `step` is given: its row is the nearest within `rtol`. `others` are the result's further tables, for
    a file with columns of one of them.
    """
    columns = table.cells
    expected = read(file, texts=None)
    spelled = {name.lower(): name for name in columns}
    expected.texts = {
        name if name in columns else spelled.get(name.lower(), name): cells
        for name, cells in expected.texts.items()
    }
    header = list(expected.texts)
    if not columns.keys() >= set(header):
        table = next((it for other in others if (it := other()).cells.keys() >= set(header)), table)
        columns = table.cells
    keys = table.keys
    for name in header:
        if name not in columns:
            raise DataError(
                f"{file}: the result has no column '{name}': expected some of "
                f"{', '.join(columns)}{nearest(name, _alike(name, columns))}"
            )
    expected.points(name for name in header if _is_number(columns[name]))
    matched = [name for name in header if name in keys and not (is_input(name) and "step" in header)]
    rows = list(_match(columns, file, expected.texts, matched, expected.rows, rtol))
    named = [key for key in keys if key in columns and (key in matched or not is_input(key))]
    lines: list[tuple[Cell, ...]] = []
    for index, row in enumerate(rows):
        for name in header:
            wanted = expected.texts[name][index]
            if name in matched or not wanted:
                continue
            value = columns[name][row]
            number, error = _error(name, value, wanted, columns[name])
            label = "/".join(str(columns[key][row]) for key in named) or str(row + 1)
            lines.append((label, name, value, number, error, "ok" if error <= rtol else "WRONG"))
    if not lines:
        raise DataError(f"{file}: no expected value in it: nothing would be checked")
    compared = dict(zip(COMPARED, zip(*lines, strict=True), strict=True))
    right = compared["verdict"].count("ok")
    return Comparison(compared, f"{right} of {len(lines)} values within {rtol:g}", right == len(lines))


def _alike(name: str, columns: Iterable[str]) -> list[str]:
    """Return the columns of the dimension that a name's unit has; all of them for a name without a unit."""
    asked = column_dimensions(name)
    return [column for column in columns if not asked or asked & column_dimensions(column)]


def _is_number(column: Values) -> bool:
    """Tell whether a column of the result holds numbers: names and verdicts keep their commas."""
    known = next((value for value in column if value is not None), None)
    return isinstance(known, Real)


def is_input(name: str) -> bool:
    """Whether a column holds a pose's input: a key that is a number."""
    return re.search(r"(?:^|_)input_[a-z]+$", name) is not None


def _match(
    columns: Columns, file: str, expected: dict[str, list[str]], keys: list[str], rows: int, rtol: float
) -> Iterator[int]:
    """Yield for each expected row the result's row."""
    length = len(next(iter(columns.values())))
    if not keys:
        if rows > length:
            raise DataError(
                f"{file}: row {length + 1}: expected {length} rows, as many as the result has, found {rows}"
            )
        yield from range(rows)
        return
    names, numbers = [k for k in keys if not is_input(k)], [k for k in keys if is_input(k)]
    places: dict[tuple[str, ...], list[int]] = {}
    for row in range(length):
        places.setdefault(tuple(str(columns[key][row]) for key in names), []).append(row)
    for index in range(rows):
        left = places.get(tuple(expected[name][index] for name in names), [])
        for name in numbers:
            left = _nearest(name, columns[name], left, expected[name][index], rtol)
        if not left:
            named = ", ".join(f"{name} {expected[name][index]}" for name in keys)
            raise DataError(f"{file}: row {index + 1}: the result has no (further) row with {named}")
        yield left[0]
        places[tuple(expected[name][index] for name in names)].remove(left[0])


def _nearest(name: str, column: Values, rows: list[int], wanted: str, rtol: float) -> list[int]:
    """The rows whose number comes nearest to the one wanted, within the tolerance."""
    try:
        number = parse_number(wanted)
    except ValueError:
        return []
    away = np.array([column[row] for row in rows], dtype=float) - number
    if name.endswith("_deg"):  # first the same angle, and of 0° and 360° the one that is meant
        turned = np.abs(np.radians(np.remainder(away + 180.0, 360.0) - 180.0))
        best = turned <= min(rtol, turned.min(initial=np.inf) + 1e-12)
    else:
        best = np.abs(away) <= rtol * max(abs(number), np.abs(away).max(initial=0.0))
    away = np.where(best, np.abs(away), np.inf)
    return [row for row, d in zip(rows, away, strict=True) if d < np.inf and d == away.min()]


def _error(name: str, value: Cell, wanted: str, column: Values) -> tuple[Cell, float]:
    """Return the expected value and the error of the found one."""
    if isinstance(value, str):
        return wanted, 0.0 if value == wanted else math.inf
    if isinstance(value, (bool, np.bool_)):
        return wanted, 0.0 if str(bool(value)).lower() == wanted.lower() else math.inf
    try:
        number = parse_number(wanted)
    except ValueError:
        return wanted, math.inf
    if value is None or value != value:
        return number, math.inf
    if name.endswith("_deg"):
        return number, abs(math.radians(math.remainder(value - number, 360.0)))
    if name.endswith("angle_rad"):
        return number, abs(math.remainder(value - number, math.tau))
    scale = abs(number) or max(
        (abs(other) for other in column if other is not None and not isinstance(other, str)), default=0.0
    )
    return number, abs(value - number) / scale if scale else abs(value - number)
