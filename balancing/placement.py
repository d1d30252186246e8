"""Corrections where masses can go: holes, blades, other radii and planes, drilling. Whole weights: `weights.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.correction import correct
from dalembert.arithmetic.records import record, table
from dalembert.arithmetic.shapes import as_array, in_32_digits, is_doubled

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase
    from matplotlib.projections.polar import PolarAxes

    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Placement:
    """Masses at given positions, computed by `place`, `place_from_stock` or `place_weights`."""

    target: complex
    """The required sum of the masses, complex kg."""
    angles: Real
    """The positions, (n,), rad."""
    masses: Real
    """The mass at each, (n,), kg; 0 for none."""
    bound: float = 0.0
    """No masses at these positions, within the limits, come nearer to the target than this, kg."""
    free: tuple[int, ...] = ()
    """The positions whose masses were computed; the others are full, empty, or weights from stock."""

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row per position: angle_deg, mass_kg."""
        return table({"angle_deg": np.degrees(self.angles), "mass_kg": self.masses}, ("position",))

    def plot(self, figure: FigureBase | None = None) -> PolarAxes:
        """Draw the positions with their masses on the rim, target and total as vectors; return matplotlib's polar axes.

        Without a figure it is a new one of pyplot's; without matplotlib (the extra `plot`) an ImportError.
        """
        from balancing.picture import Places, places

        mine = Places(
            "", self.angles.tolist(), (1e3 * self.masses).tolist(), 1e3 * self.target, 1e3 * self.total
        )
        axes: PolarAxes = places([mine], "g", figure=figure)[0]
        return axes

    @property
    def total(self) -> complex:
        """The sum of the masses, complex kg."""
        return complex((self.masses * np.exp(1j * self.angles)).sum())

    @property
    def error(self) -> complex:
        """total - target, complex kg."""
        return self.total - self.target

    @property
    def condition_number(self) -> float:
        """The factor by which an error of the target can grow in a mass: one over the sine between the two that share it."""
        if len(self.free) < 2:
            return 1.0
        one, other = self.angles[list(self.free)]
        return float(1 / abs(np.sin(other - one)))

    def error_estimate(self, quantity: str = "masses") -> Real:
        """Return the rounding error of `masses` (n,), or of `total` or `error` (scalar), kg.

        By what the same shares in 32 digits differ, target and angles taken as exact. Weights from stock are as they are.
        """
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_functions import DOUBLED
        from dalembert.arithmetic.doubled_operations import off

        if quantity not in ("masses", "total", "error"):
            raise ValueError(f"'{quantity}': expected masses, total or error")
        target, masses = Vectors.of(self.target), Doubled(self.masses)
        sine, cosine = DOUBLED.sincos(Doubled(self.angles))
        arms = Vectors(cosine, sine)
        exact = self.second_run(target, arms, masses)
        if quantity == "masses":
            return off(self.masses, exact)
        total = (arms * exact).sum()
        return total.off(self.total) if quantity == "total" else (total - target).off(self.error)

    def second_run(self, target: Vectors, arms: Vectors, masses: Doubled) -> Doubled:
        """Return the masses (n,) in 32 digits: the free ones share what the others, as given, leave of the target."""
        from dalembert.arithmetic.doubled import Doubled

        free = list(self.free)
        if not free:
            return masses
        others = np.ones(len(self.masses))
        others[free] = 0.0
        rest = target - (arms * (masses * others)).sum()
        one, other = arms[free[0]], arms[free[-1]]
        if len(free) == 2:
            across = (one.conj() * other).y
            shares = [(rest.conj() * other).y / across, (one.conj() * rest).y / across]
        else:
            shares = [(rest * one.conj()).x]
        high, low = masses.high.copy(), np.broadcast_to(masses.low, masses.high.shape).copy()
        for k, share in zip(free, shares, strict=True):
            # one that its limit holds stays there
            if len(free) == 2 or abs(float(share.high) - high[k]) <= 1e-6 * abs(self.target):
                high[k], low[k] = share.high, share.low
        return Doubled(high, low)


def place(target: complex, angles: ArrayLike, max_mass: ArrayLike | None = None) -> Placement:
    """Split a correction onto given positions: exactly with the least mass, or as near as the limits let.

    Parameters
    ----------
    target
        The correction, complex kg.
    angles
        The positions (holes, blades), (n,), rad, different.
    max_mass
        Limit of each position, scalar or (n,), kg; None or inf for none.

    Returns
    -------
    Placement
        `.masses` (n,), `.error`. Without limits the two positions on either side of the target share it by the
        sine rule; with limits the positions next to the target are filled up first.

    Raises
    ------
    ValueError
        Several corrections, a correction that is not finite, positions that coincide, a negative limit.

    Notes
    -----
    Least Σm with Σ m e^{iθ} = target is a linear program whose dual is a vector y: positions with
    Re(ȳ e^{iθ}) > 1 are full, those below 1 empty. So the full ones are neighbours, with one partly filled
    position on either side of them, and every such arc is tried. A target that is out of reach is nearest to
    an edge of the reachable polygon (a zonotope): those with Re(ȳ e^{iθ}) > 0 full, one across partly filled.

    Examples
    --------
    83.5 g at 308.87° onto blades at 292.5° and 315°:

    >>> place(83.5 * np.exp(1j * np.radians(308.87)), np.radians([292.5, 315])).masses.round(2)
    array([23.3, 61.5])
    """
    theta, cap = checked_positions(angles, max_mass)
    if np.ndim(target):
        raise ValueError(f"one target at a time, found the shape {np.shape(target)}")
    goal = complex(target)
    if not np.isfinite(goal):
        raise ValueError("the target must be finite")
    n, size = len(theta), abs(goal)
    if size == 0:
        return Placement(goal, theta, np.zeros(n))
    order = np.argsort(theta % (2 * np.pi), kind="stable")
    arms, limit = np.exp(1j * theta[order]), cap[order]
    if not np.isfinite(limit).all():
        sines = np.abs(np.imag(np.roll(arms, -1) * arms.conj()))
        slimmest = float(sines[sines > 1e-9].min(initial=1.0))
        # more than any share can be
        limit = np.where(np.isfinite(limit), limit, 4 * size / slimmest)
    masses, free = _exact(goal, arms, limit) or _nearest(goal, arms, limit)
    result = np.zeros(n)
    result[order] = np.where(masses > 4e-15 * size, masses, 0.0)
    miss = abs(goal - complex((masses * arms).sum()))
    bound = miss if miss > 1e-12 * size else 0.0
    return Placement(goal, theta, result, bound, tuple(order[list(free)].tolist()))


def checked_positions(angles: ArrayLike, max_mass: ArrayLike | None) -> tuple[Real, Real]:
    """Return the angles of the positions and the limits of their masses; refuse what is no position."""
    theta = np.atleast_1d(np.asarray(angles, dtype=float))
    if theta.ndim != 1 or not len(theta) or not np.isfinite(theta).all():
        raise ValueError("expected the angles of one or more positions")
    cap = np.broadcast_to(np.inf if max_mass is None else np.asarray(max_mass, dtype=float), theta.shape)
    if not (cap >= 0).all():
        raise ValueError("max_mass must not be negative")
    arms = np.exp(1j * np.sort(theta % (2 * np.pi)))
    if len(arms) > 1 and np.abs(arms - np.roll(arms, 1)).min() < 1e-9:
        raise ValueError("two positions at the same angle")
    return theta, cap


def _exact(goal: complex, arms: Complex, limit: Real) -> tuple[Real, tuple[int, ...]] | None:
    """Masses that add up to the goal, of the least sum, and which of them were solved for; None out of reach."""
    n = len(arms)
    if n == 1:
        along = goal * arms[0].conjugate()
        fits = abs(along.imag) <= 1e-14 * abs(goal) and 0 <= along.real <= limit[0]
        return (np.array([along.real]), (0,)) if fits else None
    full = np.concatenate([[0], np.cumsum(np.tile(limit * arms, 2))])
    amount = np.concatenate([[0], np.cumsum(np.tile(limit, 2))])
    best: tuple[float, int, int, float, float] | None = None
    first = np.arange(n)
    for inside in range(n - 1):
        last = (first + inside + 1) % n
        rest = goal - (full[first + inside + 1] - full[first + 1])
        a, b = arms[first], arms[last]
        across = np.imag(a.conj() * b)
        ok = np.abs(across) > 1e-12
        safe = np.where(ok, across, 1.0)
        x, y = np.imag(rest.conj() * b) / safe, np.imag(a.conj() * rest) / safe
        slip = 1e-12 * abs(goal)
        ok &= (x >= -slip) & (y >= -slip) & (x <= limit[first] + slip) & (y <= limit[last] + slip)
        sums = np.where(ok, amount[first + inside + 1] - amount[first + 1] + x + y, np.inf)
        i = int(np.argmin(sums))
        if ok[i] and (best is None or sums[i] < best[0] * (1 - 1e-12)):
            best = (float(sums[i]), i, inside, float(x[i]), float(y[i]))
    if best is None:
        return None
    _, i, inside, at_first, at_last = best
    masses = np.zeros(n)
    between = (i + 1 + np.arange(inside)) % n
    masses[between] = limit[between]
    masses[i], masses[(i + inside + 1) % n] = at_first, at_last
    return np.clip(masses, 0.0, limit), (i, (i + inside + 1) % n)


def _nearest(goal: complex, arms: Complex, limit: Real) -> tuple[Real, tuple[int, ...]]:
    """The masses whose sum comes nearest to a goal out of reach: on an edge of the reachable polygon."""
    best, nearest, free = np.inf, np.zeros(len(arms)), 0
    for j, arm in enumerate(arms):
        for side in (1j, -1j):
            masses = np.where(np.real(arms * np.conj(side * arm)) > 1e-12, limit, 0.0)
            masses[j] = 0.0
            base = complex((masses * arms).sum())
            masses[j] = min(max(((goal - base) * arm.conjugate()).real, 0.0), limit[j])
            miss = abs(goal - base - masses[j] * arm)
            if miss < best:
                best, nearest, free = miss, masses, j
    return nearest, (free,)


def drill_depth(
    mass: ArrayLike, diameter: ArrayLike, density: ArrayLike, point_angle: ArrayLike = np.pi
) -> NDArray[np.float64]:
    """Return the depth of a hole that removes a mass, (...), m, measured at the tip of the drill.

    Parameters
    ----------
    mass, diameter, density
        kg, m, kg/m³; they broadcast. In numbers of 32 digits (`doubled_arrays`) the depth is too.
    point_angle
        The drill's point angle, rad; π for a flat bottom.

    Raises
    ------
    ValueError
        A negative mass, a diameter or density that is not positive, an angle outside (0, π].

    Notes
    -----
    m = ρ(π d²/4·h + π d³/(24 tan(φ/2))), h the depth of the full diameter; a hole shallower than the point
    is a cone.

    Examples
    --------
    >>> round(float(drill_depth(0.010, 0.010, 7850.0)) * 1000, 2)
    16.22
    """
    m, d, rho, point = map(as_array, (mass, diameter, density, point_angle))
    if not (
        (m >= 0).all() and (d > 0).all() and (rho > 0).all() and (point > 0).all() and (point <= np.pi).all()
    ):
        raise ValueError(
            "mass must not be negative, diameter and density positive, the point angle in (0, π]"
        )
    volume, area = m / rho, np.pi * d**2 / 4
    if (point == np.pi).all():
        return as_array(volume / area)
    half = point / 2
    slope = np.sin(half) / np.cos(half) if is_doubled(half) else np.tan(half)
    tip = d / 2 / slope
    cone = area * tip / 3
    shallow = _cube_root(3 * volume / (np.pi * slope**2))
    return as_array(np.where(volume >= cone, (volume - cone) / area + tip, shallow))


def _cube_root(x: Any) -> Any:
    if not is_doubled(x):
        return np.cbrt(x)
    # a step of Newton's doubles the digits
    root = in_32_digits(np.cbrt(x.value))
    return root - np.where(x.value > 0, (root * root * root - x) / (3 * root * root), 0.0)


def transfer(unbalance: ArrayLike, z: ArrayLike, planes: ArrayLike) -> Complex:
    """Transfer corrections to other planes with the same force and moment (least norm for three or more).

    Parameters
    ----------
    unbalance
        Corrections, complex (..., k), kg·m.
    z
        Their axial positions, (..., k), m.
    planes
        Axial positions of the new planes, (p,), m; two planes share a correction by its distances (the lever).

    Returns
    -------
    ndarray
        Corrections in the new planes, complex (..., p), kg·m.

    Raises
    ------
    CoincidentPlanes
        All new planes at one place.

    Notes
    -----
    The corrections of `correct` with the opposite sign (J. A. Riul, Dinâmica das Máquinas II, eqs. 12-21).

    Examples
    --------
    >>> transfer([12.0], [0.03], [0.0, 0.09]).real.round(12)
    array([8., 4.])
    """
    return np.asarray(-correct(unbalance, z, planes).unbalance + 0.0)
