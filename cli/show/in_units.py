"""`--units`: a table's columns in units of choice; JSON stays SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cli.read.options import bad
from dalembert.hints import nearest
from dalembert.units import UNITS, Scaled, dimensions, find_unit, from_si, to_si, unit_name

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.results.columns import Column, Table, Values

# amplitudes keep the unit they were measured in, and what is per such a unit with them
_DIMENSIONS = [dimension for dimension in UNITS if dimension not in ("number", "amplitude", "per")]
_MEASURED = ("amplitude", "magnitude")


def chosen_units(text: str) -> dict[str, str]:
    """Read `mm,g,deg,N_mm,rpm`: dimension -> unit.

    Raises
    ------
    typer.BadParameter
        An unknown unit, or two of one dimension.
    """
    chosen: dict[str, str] = {}
    for part in text.split(","):
        word = unit_name(part)
        fitting = {d: unit for d in _DIMENSIONS if (unit := find_unit(d, word))}
        if not any(unit in UNITS[d] for d, unit in fitting.items()) and dimensions(word):
            # a unit of vibration, such as mil
            fitting = {}
        if not word or not fitting:
            units = sorted({unit for d in _DIMENSIONS for unit in UNITS[d]})
            hint = (
                f"; '{word}' is a unit of amplitude, and amplitudes keep the file's"
                if dimensions(word)
                else nearest(word, units)
            )
            raise bad(
                "--units",
                f"'{part.strip()}' is no unit of a column: expected units such as mm,g,deg,N_mm,rpm{hint}",
            )
        for dimension, unit in fitting.items():
            if chosen.setdefault(dimension, unit) != unit:
                both = f"{chosen[dimension]} and {unit}"
                raise bad("--units", f"{both} are both units of {dimension}: expected one of them")
    return chosen


def in_units(table: Table, chosen: Mapping[str, str]) -> Table:
    """Return the table with its columns in the units chosen, as far as they fit."""
    columns = [_in_unit(column, chosen) for column in table.columns]
    renamed = {old.header: new.header for old, new in zip(table.columns, columns, strict=True)}
    return replace(table, columns=columns, keys=[renamed.get(key, key) for key in table.keys])


def finished(table: Table, units: str | None, digits: bool) -> tuple[Table, int]:
    """Return the table in the units of --units and with the digits of --digits, and of how many no digit is known."""
    if units is not None:
        table = in_units(table, chosen_units(units))
    if not digits:
        return table, 0
    # loaded where --digits needs it
    from dalembert.results.digits import digits_that_hold

    return digits_that_hold(table)


def _in_unit(column: Column, chosen: Mapping[str, str]) -> Column:
    fits = [d for d in _DIMENSIONS if d in chosen and column.unit in UNITS[d]]
    if not fits or chosen[fits[0]] == column.unit or column.name.startswith(_MEASURED):
        return column
    dimension = fits[0]
    old, new, error = column.unit, chosen[dimension], column.error

    def convert(value: Scaled) -> Scaled:
        return from_si(to_si(value, dimension, old), dimension, new)

    def cells(values: Values) -> Values:
        if not isinstance(values, Sequence):
            return convert(values)
        return [
            value if value is None or isinstance(value, str) else convert(float(value)) for value in values
        ]

    def errors() -> Sequence[float] | NDArray[np.float64]:
        assert error is not None
        return convert(np.asarray(error(), dtype=float))

    return replace(column, unit=new, values=cells(column.values), error=None if error is None else errors)
