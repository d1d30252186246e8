"""`--digits`: each number cut to the digits that it has in common with the second run, in 32 digits."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from math import floor, inf, log10, ulp
from typing import TYPE_CHECKING

from dalembert.results.columns import Column, Table

if TYPE_CHECKING:
    from dalembert.results.columns import Cell


# what the logarithms round, and more
NEAR = 1e-9


def digits_that_hold(table: Table) -> tuple[Table, int]:
    """Return the table with its numbers cut, and the number of those without a digit: their cells are empty."""
    cut = [_cut_column(column) for column in table.columns]
    return replace(table, columns=[column for column, _ in cut]), sum(unknown for _, unknown in cut)


def _cut_column(column: Column) -> tuple[Column, int]:
    if column.error is None:
        return column, 0
    errors = column.error()
    values = [_cut(value, error) for value, error in zip(column.values, errors, strict=True)]
    if column.unit == "deg":
        # output angles lie in [0, 360); an input of 360 is the user's
        values = [
            0.0 if cut == 360 and value != 360 else cut
            for value, cut in zip(column.values, values, strict=True)
        ]
    return replace(column, values=values), sum(error == inf for error in errors)


def _cut(value: Cell, error: float) -> Cell:
    if error == inf:
        return None
    if isinstance(value, str) or value is None or not value or not error > 0:
        return value
    size = abs(value)
    # half a unit of the last digit is no less than the error
    most = max(0, floor(floor(log10(size)) - log10(2 * error) + NEAR)) if error < size else -1
    for last in range(min(most, 16), -1, -1):
        cut = f"{value:.{last}e}"
        shown = float(cut)
        room = 0.5 * 10.0 ** (int(cut[cut.index("e") + 1 :]) - last) - error
        # exact; the digits themselves are off the double that they stand for by half a unit of its last place at most
        off, half = abs(value - shown), 0.5 * ulp(shown)
        if off - half > room:
            continue
        # all that lies within the error has these digits, and the double that is printed has no others: 15 are its own
        within = off + half <= room or abs(float(Decimal(value) - Decimal(cut))) <= room
        if within and (last < 15 or cut == f"{shown:.{last}e}"):
            return shown
    return 0.0
