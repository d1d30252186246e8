"""Measured vibration -> corrections, and the vibration they leave.

The corrections are the w for which r = V + α w is small (`balancing.influence`): by least squares, or by its largest
component, with limits on masses and residuals where requested.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.checked_data import OUT_OF_RANGE, checked, is_in_range, limits_of, require_size
from balancing.dependence import DependentPlanes, condition_number
from balancing.limited import limited_least_squares, smallest_maximum
from balancing.phase import angle_of
from balancing.qr import smallest_squares
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import numbers, record, table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase

    from balancing.rounding import Problem
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import Vectors
    from dalembert.page import Page

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Balance:
    """Corrections from influence coefficients, computed by `least_squares` or `minimax`."""

    influence: Complex
    """α, (..., s, p), amplitude per kg."""
    initial: Complex
    """V, (..., s), amplitude."""
    corrections: Complex
    """The masses to ADD, (..., p), complex kg."""
    weights: Real | None = None
    """The weights that were requested, (..., s); one over the limits of the residual where these leave minimax alone."""
    bound: float | None = None
    """No corrections within the limits leave less than this (from the dual problem): of minimax the largest (weighted)
    residual, of least squares with limits Σ w|r|²; None for least squares without limits."""
    gap: float = 0.0
    """By what share what is left may lie above the least there is, rounding aside: what is left held against `bound`. 1e-9
    at most."""
    of_largest: bool = False
    """Whether the largest (weighted) residual is the least there is, and not the sum of squares: of minimax, and of least
    squares whose limits are within 1e-8 of the smallest that can be met."""
    ridge: float = 0.0
    max_mass: Real | None = None
    """The limits of the corrections that were requested, (p,)."""
    max_residual: Real | None = None
    """The limits of the residual that were requested, (s,)."""

    triangle: Complex | None = field(default=None, repr=False, compare=False)
    """R (..., p, p) of the QR of the scaled coefficients, where the solution has it."""

    def __repr__(self) -> str:
        largest = numbers(self.residual_max)
        return f"<Balance: corrections {numbers(self.corrections)} kg leave at most {largest}>"

    def to_frame(self, of: str = "corrections") -> pd.DataFrame:
        """Return a table with a row per plane (mass_kg, angle_deg), or `of="residual"` per sensor (amplitude, phase_deg)."""
        if of == "corrections":
            names, values, axis = ("mass_kg", "angle_deg"), self.corrections, "plane"
        elif of == "residual":
            names, values, axis = ("amplitude", "phase_deg"), self.residual, "sensor"
        else:
            raise ValueError(f"'{of}': expected corrections or residual")
        return table({names[0]: np.abs(values), names[1]: np.degrees(angle_of(values))}, ("rotor", axis))

    def page(self, sensors: Sequence[str] = (), planes: Sequence[str] = (), amplitude: str = "") -> Page:
        """Return the machine's sheet, a page that computes corrections and trim of readings typed into it; names as in `plot`.

        ValueError of several machines, of minimax or with limits: it computes least squares.
        """
        from balancing.sheet import machine_sheet

        limited = self.of_largest or self.max_mass is not None or self.max_residual is not None
        if self.influence.ndim > 2 or limited:
            raise ValueError("a sheet is of one machine, and computes least squares without limits")
        s, p = self.influence.shape
        names = [list(listed) or [str(i + 1) for i in range(n)] for listed, n in ((sensors, s), (planes, p))]
        more: dict[str, Any] = {"weights": self.weights, "ridge": self.ridge, "amplitude_unit": amplitude}
        return machine_sheet(self.influence, self.initial, *names, **more)

    def plot(
        self,
        sensors: Sequence[str] = (),
        planes: Sequence[str] = (),
        amplitude: str = "",
        figure: FigureBase | None = None,
    ) -> NDArray[np.object_]:
        """Draw the vibration before and after, and the corrections to add.

        Parameters
        ----------
        sensors, planes
            Their names.
        amplitude
            The unit of the vibration.
        figure
            Where to draw; None: a new figure of pyplot's.

        Returns
        -------
        array of matplotlib's polar axes: vibration, corrections; of several rotors a row for each of the first four

        Raises
        ------
        ImportError
            matplotlib (the extra `plot`) is missing.
        """
        from balancing.picture import before_and_after

        return before_and_after(
            self.initial, self.residual, self.corrections, amplitude, sensors, planes, figure=figure
        )

    @cached_property
    def residual(self) -> Complex:
        """The predicted vibration with the corrections on, (..., s)."""
        return np.asarray(self.initial + np.matvec(self.influence, self.corrections))

    @property
    def residual_rms(self) -> Real:
        """√(mean |residual|²) over the sensors, (...)."""
        size = np.abs(self.residual)
        scale = size.max(axis=-1)
        safe = np.where(scale > 0, scale, 1.0)[..., None]
        return np.asarray(scale * np.sqrt(np.square(size / safe).mean(axis=-1)))

    @property
    def residual_max(self) -> Real:
        """The largest |residual|, (...)."""
        return np.asarray(np.abs(self.residual).max(axis=-1))

    @cached_property
    def condition_number(self) -> Real:
        """σ_max/σ_min of the coefficients after scaling the columns (see `condition_number`), (...)."""
        if self.triangle is not None:
            sigma = np.linalg.svd(self.triangle, compute_uv=False)
            return np.asarray(sigma[..., 0] / sigma[..., -1])
        return condition_number(self.influence, self.weights)

    def error_estimate(
        self, quantity: str = "corrections", *, exact: tuple[Vectors, Vectors] | None = None
    ) -> Real:
        """Return the rounding error of a result, in its units and shape.

        Parameters
        ----------
        quantity
            `corrections` (..., p), `residual` (..., s), `residual_max` or `residual_rms` (...): against those of the
            exact solution.
        exact
            Coefficients (..., s, p) and vibration (..., s) in 32 digits; None: they are the floats.

        Notes
        -----
        What the result and the same problem in 32 digits differ by: of least squares `balancing.rounding`, under limits
        and of minimax the optimality conditions at the corrections (`balancing.optimality`); inf where the optimum is not
        unique or not a smooth function of the data, with the reason in `error_reason`. Even then `residual_max` of
        minimax has an estimate, by its distance from `bound`.

        Examples
        --------
        >>> fix = least_squares([[3, -2], [5, -2], [5, -3]], [1, -1, 0])
        >>> bool((abs(fix.corrections - [17 / 21, 31 / 21]) <= fix.error_estimate()).all())
        True
        """
        problem = self._problem(exact)
        true = (self._again if exact is None else self._found(problem))[0]
        if quantity == "corrections":
            return np.full(self.corrections.shape, np.inf) if true is None else true.off(self.corrections)
        if quantity not in ("residual", "residual_max", "residual_rms"):
            raise ValueError(f"'{quantity}': expected corrections, residual, residual_max or residual_rms")
        residual = self.residual
        nothing = np.full(residual.shape, np.inf)
        off = nothing if true is None else problem.residual(true).off(residual)
        if quantity == "residual":
            return off
        if quantity == "residual_rms":
            return np.asarray(np.sqrt(np.square(off).mean(axis=-1)) + 8 * EPS * self.residual_rms)
        if true is None and self.of_largest and self.bound is not None and self.weights is None:
            # the true optimum lies between the dual bound, rounding taken off, and what the corrections truly leave
            gap = max(float(self.residual_max) - self.bound, 0.0)
            return np.asarray(max(gap, float(problem.moved.max())))
        # the size of a complex number rounds once more
        return np.asarray(off.max(axis=-1) + EPS * self.residual_max)

    @property
    def error_reason(self) -> str:
        """The reason why the corrections have no error estimate; empty if they have one."""
        return self._again[1]

    def second_run(
        self, influence: Vectors, initial: Vectors, ridge: Doubled | None = None
    ) -> tuple[Vectors | None, str]:
        """Return the corrections (..., p) of data in 32 digits; None with the reason where they are not determined."""
        return self._found(self._problem((influence, initial)), ridge)

    @cached_property
    def _again(self) -> tuple[Vectors | None, str]:
        return self._found(self._problem(None))

    def _problem(self, exact: tuple[Vectors, Vectors] | None) -> Problem:
        from balancing.rounding import Problem
        from dalembert.arithmetic.doubled_arrays import Vectors

        floats = self.influence, self.initial
        data = exact or (Vectors.of(self.influence), Vectors.of(self.initial))
        return Problem(*data, self.corrections, self.weights, floats)

    def _found(self, problem: Problem, ridge: Doubled | None = None) -> tuple[Vectors | None, str]:
        if not is_in_range(self.influence, self.initial):
            return None, "the numbers are too large or too small for a second run in 32 digits"
        if self._free:
            from balancing.rounding import least_squares_again

            if not (self.ridge or np.isfinite(condition_number(self.influence, self.weights)).all()):
                return (
                    None,
                    "the readings cannot distinguish the planes: other corrections leave the same residual",
                )
            return least_squares_again(problem, self.ridge if ridge is None else ridge), ""
        from balancing.optimality import optimum_again

        return optimum_again(problem, self.of_largest, self.max_mass, self.max_residual)

    @property
    def _free(self) -> bool:
        """Whether the corrections are those of least squares: without limits, or where none holds them."""
        if self.of_largest:
            # a rotor that minimax balances to nothing is balanced by least squares
            noise = np.abs(self.influence) @ np.abs(self.corrections) + np.abs(self.initial)
            if self.bound or float(self.residual_max) > 64 * EPS * float(noise.max()):
                return False
        return _within(self.corrections, self.max_mass) and _within(self.residual, self.max_residual)


def least_squares(
    influence: ArrayLike,
    initial: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    ridge: float = 0.0,
    max_mass: ArrayLike | None = None,
    max_residual: ArrayLike | None = None,
) -> Balance:
    """Find the corrections with the least (weighted) sum of squares of residual vibration.

    Parameters
    ----------
    influence
        α, complex (..., s, p), amplitude per kg; the axis s runs over sensors and speeds.
    initial
        V, complex (..., s), amplitude.
    weights
        w_s >= 0, (..., s): Σ w_s |r_s|² is made least. Default 1 each.
    ridge
        λ >= 0 damps the corrections: Σ w|r|² + λ² Σ_p ‖α_p‖² |w_p|² is made least.
    max_mass
        Limits |w_p| <= max_mass, scalar or (p,), kg; inf for none. One rotor at a time.
    max_residual
        Limits |r_s| <= max_residual, scalar or (s,). One rotor at a time.

    Returns
    -------
    Balance
        `.corrections` (..., p) complex, masses to ADD; `.residual` (..., s); `.condition_number`.

    Raises
    ------
    DependentPlanes
        The sensors cannot distinguish the planes (and `ridge` is 0): the combination they do not see is named.
    Infeasible
        `max_residual` cannot be met: the smallest that can is named.
    NotConverged
        The corrections under limits cannot be proven optimal to nine digits (`Balance.gap`).
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    Goodman, J. Eng. Ind. 86 (1964) 273-277. Solved by QR (`balancing.qr`).

    Examples
    --------
    Goodman's example has the exact answer 17/21 and 31/21.

    >>> fix = least_squares([[3, -2], [5, -2], [5, -3]], [1, -1, 0])
    >>> (fix.corrections.real * 21).round(12)
    array([17., 31.])
    """
    alpha, v, root = checked(influence, initial, weights)
    if np.ndim(ridge) or not 0 <= ridge < np.inf:
        raise ValueError("ridge must be one number, not negative")
    w = None if weights is None else np.asarray(weights, dtype=float)
    if max_mass is not None or max_residual is not None:
        if ridge:
            raise ValueError("ridge does not go with limits: the limits damp already")
        if alpha.ndim != 2 or v.ndim != 1:
            raise ValueError("limits are for one rotor at a time: expected influence (s, p), initial (s,)")
        require_size(alpha, v)
        limit, ceiling = (
            limits_of("max_mass", max_mass, alpha.shape[1]),
            limits_of("max_residual", max_residual, len(v)),
        )
        corrections, bound, gap, of_largest = limited_least_squares(alpha, v, root, limit, ceiling)
        w, limits = 1 / ceiling if of_largest else w, (_given(limit), _given(ceiling))
        return Balance(alpha, v, corrections, w, bound, gap, of_largest, 0.0, *limits)
    a, b = (alpha, v) if root is None else (alpha * root[..., None], v * root)
    with np.errstate(over="ignore", invalid="ignore"):
        solution, r = smallest_squares(a, b, ridge)
    if not np.isfinite(solution).all():
        raise ValueError(OUT_OF_RANGE)
    return Balance(alpha, v, solution, w, ridge=ridge, triangle=None if ridge else r)


def minimax(
    influence: ArrayLike,
    initial: ArrayLike,
    max_mass: ArrayLike | None = None,
    *,
    weights: ArrayLike | None = None,
) -> Balance:
    """Find the corrections with the smallest possible maximum of the residual vibration.

    Parameters
    ----------
    influence
        α, complex (s, p), amplitude per kg.
    initial
        V, complex (s,), amplitude.
    max_mass
        Limits |w_p| <= max_mass, scalar or (p,), kg; inf for none.
    weights
        w_s >= 0, (s,): max w_s |r_s| is made least. Default 1 each.

    Returns
    -------
    Balance
        `.corrections` (p,) complex, masses to ADD; `.residual` (s,); `.residual_max`; `.bound`: no corrections
        (within the limits) leave less, so that the largest (weighted) residual lies between the two.

    Raises
    ------
    DependentPlanes
        The sensors cannot distinguish the planes, and no limit keeps their masses finite.
    NotConverged
        The corrections cannot be proven optimal to nine digits (`Balance.gap`).
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    Foiles, Allaire and Gunter, IMechE C576/097 (2000), pose the problem. A sensor that no plane moves
    sets a floor and is left out of the search: its residual must not excuse the others'.

    Examples
    --------
    Goodman's data: three residuals of 0.4, where least squares leaves 10/21.

    >>> fix = minimax([[3, -2], [5, -2], [5, -3]], [1, -1, 0])
    >>> fix.corrections.real.round(9), fix.residual_max.round(12), round(fix.bound, 12)
    (array([1. , 1.8]), np.float64(0.4), 0.4)
    """
    alpha, v, _ = checked(influence, initial, weights)
    if alpha.ndim != 2 or v.ndim != 1:
        raise ValueError(
            f"one rotor at a time: expected influence (s, p), initial (s,), found {alpha.shape}, {v.shape}"
        )
    require_size(alpha, v)
    w = None if weights is None else np.asarray(weights, dtype=float)
    a, b = (alpha, v) if w is None else (alpha * w[:, None], v * w)
    limit = limits_of("max_mass", max_mass, alpha.shape[1])
    # sensors that no plane moves only set a floor
    moved = np.abs(a).max(axis=1) > 0
    floor = float(np.abs(b[~moved]).max(initial=0.0))
    if not moved.all():
        a, b = a[moved], b[moved]
    if not len(b):
        raise DependentPlanes("the readings show no plane at all", np.eye(alpha.shape[1], dtype=complex)[0])
    corrections, bound, gap, _ = smallest_maximum(a, b, limit)
    if floor > bound:
        # what no plane moves may be all that is left
        reached = float((np.abs(b + a @ corrections)).max())
        bound, gap = floor, gap if reached > floor else 0.0
    return Balance(alpha, v, corrections, w, bound, gap, True, max_mass=_given(limit))


def _within(z: Complex, limit: Real | None) -> bool:
    return limit is None or bool((np.abs(z) < limit * (1 - 1e-9)).all())


def _given(limit: Real) -> Real | None:
    return limit if np.isfinite(limit).any() else None
