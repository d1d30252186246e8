"""From a table of readings at several positions of the rotor to the rotor's part and the mandrel's, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from balancing import index_balancing
from balancing.indexing import Indexed
from dalembert.angles import phasor
from dalembert.arithmetic.exact import EPS
from dalembert.errors import DataError, quote
from dalembert.tables.table import Table, read
from dalembert.units import Scaled, from_si, to_si, written

if TYPE_CHECKING:
    from balancing.second_run import ExactParts

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False, repr=False)
class Positions:
    """The readings and their two parts: unbalances in kg·m, amplitudes in the unit of the file."""

    table: Table
    quantity: Literal["unbalance", "amplitude"]
    unit: str
    turned: Real
    """Degrees."""
    readings: Complex
    parts: Indexed
    against: bool
    """Whether the instrument's phase lags."""

    @property
    def noise(self) -> float:
        """Below this a residual is rounding."""
        terms = np.abs(self.readings).sum() + len(self.turned) * abs(self.parts.rotor)
        return float(24 * EPS * self.parts.amplification**2 * terms)

    @cached_property
    def exact(self) -> ExactParts:
        """The parts in 32 digits, of the decimals as they are written."""
        from balancing.second_run import ExactParts
        from cli.read.exact import turns, vectors

        numbers = self.table.numbers
        size, angle = numbers[self.quantity], numbers["angle" if self.quantity == "unbalance" else "phase"]
        sizes = size.exact if self.quantity == "unbalance" else size.decimals
        read = vectors(sizes, angle)
        return ExactParts(read.conj if self.against else read, turns(numbers["turned"]))

    def shown(self, value: Scaled) -> Scaled:
        """A value in the unit of the file."""
        return from_si(value, "unbalance", self.unit) if self.quantity == "unbalance" else value

    @property
    def spoken_unit(self) -> str:
        """The unit as people write it."""
        return written(self.unit)


def read_positions(path: str, phase_lag: bool) -> Positions:
    """Read turned_deg with unbalance_* and angle_*, or amplitude_* and phase_deg, and separate the parts.

    Raises
    ------
    DataError
        Columns that are missing or mixed, a negative size, several planes, fewer than two positions.
    """
    dimensions = {
        "turned": "angle",
        "unbalance": "unbalance",
        "angle": "angle",
        "amplitude": "amplitude",
        "phase": "angle",
    }
    table = read(path, numbers=dimensions, texts=["rotor", "plane", "sensor"])
    turned = table.require("turned", "angle")
    if "unbalance" in table.numbers and "amplitude" in table.numbers:
        both = " and ".join(table.numbers[name].header for name in ("unbalance", "amplitude"))
        raise DataError(f"{table.file}: mixed columns {both}: expected unbalances or amplitudes, one of them")
    quantity: Literal["unbalance", "amplitude"] = "amplitude" if "amplitude" in table.numbers else "unbalance"
    if quantity not in table.numbers:
        raise DataError(
            f"{table.file}: no column unbalance_g_mm (or amplitude_um …): expected unbalance_* with angle_*, or "
            f"amplitude_* with phase_deg {table.told}"
        )
    size, angle = (
        table.numbers[quantity],
        table.require("angle" if quantity == "unbalance" else "phase", "angle"),
    )
    table.reject(
        size.values < 0, quantity, f"a reading that is not negative: its {angle.header} says the direction"
    )
    for name in ("rotor", "plane", "sensor"):
        if len(several := table.numbered(name)[0]) > 1:
            raise DataError(
                f"{table.file}: column {name}: found {quote(several[0])} and {quote(several[1])}, expected the "
                f"readings of one {name}: a table for each"
            )
    sense = -1.0 if phase_lag else 1.0
    values = size.si if quantity == "unbalance" else size.values
    readings = phasor(values, sense * angle.values, angle.unit)
    try:
        parts = index_balancing(readings, to_si(turned.values, "angle", turned.unit))
    except ValueError as error:
        raise DataError(f"{table.file}: column {turned.header}: {error}") from None
    degrees = turned.values if turned.unit == "deg" else np.degrees(turned.si)
    return Positions(table, quantity, size.unit, degrees, readings, parts, phase_lag)
