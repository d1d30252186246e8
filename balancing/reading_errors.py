"""The errors of readings: their standard deviations, and draws of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.records import record

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Errors:
    """Standard deviations of readings, independent of one another: along the direction `unit` and across it."""

    unit: Complex
    """(..., r, s), size 1."""
    along: Real
    across: Real
    degrees_of_freedom: Real
    """Complex, of the estimate they are; inf where they are known. (...)"""
    phase: Real | None = None
    """Where the error across is one of the phase, which turns the reading: in rad, (..., r, s); 0 elsewhere."""
    stated: NDArray[np.bool_] | None = None
    """Where the error along is known and no estimate, (..., r, s); across that is where it is one of the phase."""

    def machine(self, i: int) -> Errors:
        """Return those of one of many machines, along the leading axis."""
        phase, stated = (None if part is None else part[i] for part in (self.phase, self.stated))
        return Errors(self.unit[i], self.along[i], self.across[i], self.degrees_of_freedom[i], phase, stated)

    def draw(self, readings: Complex, n: int, rng: np.random.Generator, *, student: bool = False) -> Complex:
        """Draw errors of one machine's readings (r, s), (n, s, r); with `student` those of an estimate are the wider."""
        unit, along, across = (np.swapaxes(part, -1, -2) for part in (self.unit, self.along, self.across))
        one, other = rng.standard_normal((2, n, *unit.shape))
        if student:
            wider = wider_draws(rng, float(self.degrees_of_freedom), n)[..., None]
            one = one * (wider if self.stated is None else np.where(self.stated.T, 1.0, wider))
            other = other * (wider if self.phase is None else np.where(self.phase.T > 0, 1.0, wider))
        if self.phase is None:
            return np.asarray(unit * (along * one + 1j * across * other))
        turn, y = self.phase.T, np.nan_to_num(readings.T)
        aside = 1j * unit * np.where(turn > 0, 0.0, across) * other
        return np.asarray((y + unit * along * one) * np.exp(1j * turn * other) + aside - y)


def wider_draws(rng: np.random.Generator, degrees_of_freedom: float, n: int) -> Real:
    """Draw by what factor σ may be larger than its estimate, (n, 1)."""
    if not 0 < degrees_of_freedom < np.inf:
        return np.ones((n, 1))
    return np.asarray(np.sqrt(degrees_of_freedom / rng.gamma(degrees_of_freedom, size=n))[:, None])
