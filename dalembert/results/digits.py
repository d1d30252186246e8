"""`--digits`: each number cut to the digits that it has in common with the second run, in 32 digits."""

from __future__ import annotations

from dataclasses import replace
from math import floor, inf, log10
from typing import TYPE_CHECKING

from dalembert.results.columns import Column, Table

if TYPE_CHECKING:
    from dalembert.results.columns import Cell


def digits_that_hold(table: Table) -> tuple[Table, int]:
    """Return the table with its numbers cut, and of how many no digit is known: their cells are empty."""
    cut = [_cut_column(column) for column in table.columns]
    return replace(table, columns=[column for column, _ in cut]), sum(unknown for _, unknown in cut)


def _cut_column(column: Column) -> tuple[Column, int]:
    if column.error is None:
        return column, 0
    errors = column.error()
    values = [_cut(value, error) for value, error in zip(column.values, errors, strict=True)]
    if column.unit == "deg":
        # output angles lie in [0, 360); an input of 360 is one that was asked for
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
    digits = min(floor(log10(abs(value) / error)), 17) if error < abs(value) else 0
    for last in range(digits - 1, -1, -1):
        # what the number and the other run agree in, wherever it lies within the error
        cut = f"{value:.{last}e}"
        if cut == f"{value + error:.{last}e}" == f"{value - error:.{last}e}":
            return float(cut)
    return 0.0
