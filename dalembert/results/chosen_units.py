"""Tables, and what a page shows, in the units that --units names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from dalembert.dataclass import replace
from dalembert.decimals import Scaled
from dalembert.hints import nearest
from dalembert.results.columns import Table
from dalembert.units import UNITS, dimensions, find_unit, from_si, to_si, unit_name

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from dalembert.page import Shown
    from dalembert.results.columns import Column, Values

# amplitudes keep the unit they were measured in, and what is per such a unit with them
_DIMENSIONS = [dimension for dimension in UNITS if dimension not in ("number", "amplitude", "per")]
_MEASURED = ("amplitude", "magnitude")


def chosen_units(text: str) -> dict[str, str]:
    """Read `mm,g,deg,N_mm,rpm`: dimension -> unit.

    Raises
    ------
    ValueError
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
            raise ValueError(
                f"'{part.strip()}' is no unit of a column: expected units such as mm,g,deg,N_mm,rpm{hint}"
            )
        for dimension, unit in fitting.items():
            if chosen.setdefault(dimension, unit) != unit:
                both = f"{chosen[dimension]} and {unit}"
                raise ValueError(f"{both} are both units of {dimension}: expected one of them")
    return chosen


def in_units(table: Table, chosen: Mapping[str, str]) -> Table:
    """Return the table with its columns in the units chosen, as far as they fit."""
    columns = [_in_unit(column, chosen) for column in table.columns]
    renamed = {old.header: new.header for old, new in zip(table.columns, columns, strict=True)}
    return replace(table, columns=columns, keys=[renamed.get(key, key) for key in table.keys])


def finished(table: Table, units: Mapping[str, str] | None, digits: bool) -> tuple[Table, int]:
    """Return the table in the chosen units, with --digits cut to its right digits, and the number of those without a right digit."""
    if units is not None:
        table = in_units(table, units)
    if not digits:
        return table, 0
    # loaded where --digits needs it
    from dalembert.results.digits import digits_that_hold

    return digits_that_hold(table)


def _in_unit(column: Column, chosen: Mapping[str, str]) -> Column:
    fits = [d for d in _DIMENSIONS if d in chosen and find_unit(d, column.unit) == column.unit]
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
        import numpy as np

        assert error is not None
        return convert(np.asarray(error(), dtype=float))

    return replace(column, unit=new, values=cells(column.values), error=None if error is None else errors)


# what a scene is drawn from: of these alone the page must know the unit
DRAWN = ("length", "angle", "velocity", "acceleration", "speed", "force", "time")


def shown(table: Table, units: Mapping[str, str] | None) -> dict[str, Shown]:
    """Return the columns of numbers under their SI headers, in the chosen units."""
    import numpy as np

    # loaded where a page is written
    from dalembert.page import Shown

    pairs = zip(table.columns, in_units(table, units or {}).columns, strict=True)
    return {
        column.header: Shown(np.array(other.values, dtype=float), other.header, _si(other.unit))
        for column, other in pairs
        if column.unit or not any(isinstance(value, str) for value in column.values)
    }


def _si(unit: str) -> float:
    """Return what one of a unit is in SI; 1 where the page need not know."""
    return next((float(to_si(1.0, d, unit)) for d in DRAWN if unit in UNITS[d]), 1.0)
