"""A flywheel from a table of torque over whole turns: mean torque, work, fluctuation of energy, moment of inertia.

A shaft takes up the torque T(θ) against a load that is constant, the mean T̄. What T does beyond the mean,
E(θ) = ∫ (T − T̄) dθ, speeds the flywheel up where it rises and slows it down where it falls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, in_32_digits, is_doubled
from dalembert.dataclass import dataclass, field

Real = NDArray[np.float64]


@record
@dataclass(frozen=True, eq=False, repr=False)
class TorqueCycle:
    """The work of a torque over a cycle, and the energy that a flywheel has to store."""

    mean: float
    """N·m."""
    work: float
    """∫ T dθ over the whole cycle, J."""
    fluctuation: float
    """The largest less the smallest energy E, J."""
    fastest: float
    """The angle of the largest energy, where the shaft is fastest, rad; of energies that are equal to rounding the first."""
    slowest: float
    """The angle of the smallest energy, rad."""
    energy: Real
    """E at each row, from zero at the first, J, (n,)."""
    rows: tuple[Real, Real] = field(compare=False)
    """The angles (n,), rad, and torques (n,), N·m, of the table."""

    def inertia(self, speed: float, coefficient: float) -> float:
        """Return the moment of inertia that keeps the speed within a coefficient of fluctuation, kg·m².

        I = ΔE/(C ω²), with C = (ω_max − ω_min)/ω and ω the mean of the two (Norton, Design of Machinery, §11.11): exact,
        for ΔE = I (ω_max² − ω_min²)/2.

        Raises
        ------
        ValueError
            A speed that is zero, or a coefficient outside 0 to 2: at 2 the shaft comes to rest.
        """
        if not (np.isfinite(speed) and speed != 0):
            raise ValueError("a flywheel needs a speed that is not zero")
        if not 0 < coefficient <= 2:
            raise ValueError(
                "the coefficient of fluctuation (ω_max − ω_min)/ω is more than 0 and at most 2, where the shaft comes to rest"
            )
        return self.fluctuation / (coefficient * speed**2)

    def error_estimate(self, exact: TorqueCycle | None = None) -> dict[str, Any]:
        """Return the rounding errors of `mean`, `work`, `fluctuation`, `fastest`, `slowest` and `energy` (n,).

        They are by what the same formulas in numbers of 32 digits differ: `exact`, or None: the rows are exact.

        Examples
        --------
        >>> cycle = torque_cycle([0.0, 0.3, 2 * np.pi], [20.0, 0.1, 0.0])
        >>> bool(cycle.error_estimate()["work"] < 1e-15)
        True
        """
        true: Any = torque_cycle(*map(in_32_digits, self.rows)) if exact is None else exact
        names = ("mean", "work", "fluctuation", "fastest", "slowest", "energy")
        errors = {name: getattr(true, name).off(getattr(self, name))[()] for name in names}
        # what cancels in 32 digits
        hidden = 2.0**-46 * self.negligible
        return errors | {name: errors[name] + hidden for name in ("work", "fluctuation", "energy")}

    @property
    def negligible(self) -> float:
        """An energy below which there is none: the rounding of all the work that a turn does and takes back, J."""
        at, T = self.rows
        return _negligible(at, T)


def _negligible(at: Real, T: Real) -> float:
    size = ((np.abs(T[:-1]) + np.abs(T[1:])) / 2 * np.diff(at)).sum()
    return float((len(at) + 8) * 2 * EPS * size)


def torque_cycle(angle: ArrayLike, torque: ArrayLike) -> TorqueCycle:
    """Return the work and the energy fluctuation of a torque that is linear between rows.

    Parameters
    ----------
    angle
        The angles of the rows, (n,), rad, rising; two rows at one angle are a step of the torque. First and last row
        are the ends of the cycle.
    torque
        The torque at them, (n,), N·m.

    Returns
    -------
    TorqueCycle
        `.mean`, N·m; `.work` and `.fluctuation`, J; `.inertia(speed, coefficient)`, kg·m².

    Raises
    ------
    ValueError
        Fewer than two rows, angles that fall or all at one place, numbers that are not finite.

    Notes
    -----
    Between two rows E is a parabola. Its extreme lies where T − T̄ changes sign, so that the extremes are exact and do
    not depend on the spacing of the rows (the areas of the turning moment diagram; Norton, Design of Machinery, §11.11).

    Examples
    --------
    A torque that falls from 20 to 0 N·m over a turn stores a quarter of its work.

    >>> cycle = torque_cycle([0.0, 2 * np.pi], [20.0, 0.0])
    >>> round(cycle.mean, 12), round(cycle.work / np.pi, 12), round(cycle.fluctuation / np.pi, 12)
    (10.0, 20.0, 5.0)
    >>> round(cycle.inertia(speed=50.0, coefficient=0.02), 6)
    0.314159
    """
    at, T = as_array(angle), as_array(torque)
    if at.ndim != 1 or at.shape != T.shape or len(at) < 2:
        raise ValueError("expected as many torques as angles, and at least two")
    if not (np.isfinite(at).all() and np.isfinite(T).all()):
        raise ValueError("angles and torques must be finite")
    step = np.diff(at)
    if (step < 0).any() or not step.any():
        raise ValueError("expected angles that rise")
    work = ((T[:-1] + T[1:]) / 2 * step).sum()
    mean = work / (at[-1] - at[0])
    over = T - mean
    energy = np.concatenate([[0.0], np.cumsum((over[:-1] + over[1:]) / 2 * step)])
    # the parabola's extreme within a step
    k = np.flatnonzero((over[:-1] * over[1:] < 0) & (step > 0))
    share = over[k] / (over[k] - over[k + 1])
    every = np.concatenate([energy, energy[k] + over[k] * share * step[k] / 2])
    places = np.concatenate([at, at[k] + share * step[k]])
    most, least, equal = every[every.argmax()], every[every.argmin()], _negligible(at, T)
    fastest, slowest = places[every >= most - equal], places[every <= least + equal]
    numbers: Any = mean, work, most - least, fastest[fastest.argmin()], slowest[slowest.argmin()]
    mean, work, stored, fast, slow = numbers if is_doubled(T) else map(float, numbers)
    return TorqueCycle(mean, work, stored, fast, slow, energy, (at, T))
