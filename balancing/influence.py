"""Measured vibration -> influence coefficients -> corrections, and the vibration they leave.

The vibration V_s at sensor s (and speed) answers linearly to the masses w_p in the planes,

    r = V + α w                                   (Goodman 1964, eq. 1; ISO 21940-12, annex on flexible rotors)

with α_sp the influence coefficients: what a unit mass in plane p adds at sensor s. Trial masses tell α,
and the corrections are the w for which r is small: by least squares here, by its largest component in
`balancing.least_maximum`. A vibration, a mass, a coefficient is a complex number: size and phase, and both phases
are counted in one common sense.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import (
    EPS,
    DependentPlanes,
    DependentTrials,
    adjoint,
    columns_scaled,
    condition_number,
    require_independent,
)

if TYPE_CHECKING:
    from balancing.rounding import Bounds

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Infeasible(ValueError):
    """No corrections meet the residual limit; `smallest` is the smallest limit that can be met."""

    def __init__(self, smallest: float) -> None:
        self.smallest = smallest
        super().__init__(f"the residual limit cannot be met: the smallest that can is {smallest:.6g}")


@dataclass(frozen=True)
class Balance:
    """Corrections from influence coefficients; see `least_squares` and `minimax`."""

    influence: Complex
    """α, (..., s, p), amplitude per kg."""
    initial: Complex
    """V, (..., s), amplitude."""
    corrections: Complex
    """The masses to ADD, (..., p), complex kg."""
    weights: Real | None = None
    """The weights that were asked for, (..., s)."""
    bound: float | None = None
    """minimax alone: no corrections whatever leave less than this (from the dual problem)."""
    ridge: float = 0.0
    max_mass: Real | None = None
    """The limits of the corrections that were asked for, (p,)."""
    max_residual: Real | None = None
    """The limits of the residual that were asked for, (s,)."""

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
        return condition_number(self.influence, self.weights)

    def error_estimate(
        self,
        quantity: str = "corrections",
        *,
        influence_error: ArrayLike | None = None,
        initial_error: ArrayLike | None = None,
    ) -> Real:
        """Return a bound of the rounding error of a result, in its units and shape.

        Parameters
        ----------
        quantity
            `corrections` (..., p), `residual` (..., s), `residual_max` or `residual_rms` (...): against those of the
            exact solution.
        influence_error, initial_error
            Bounds of the errors of the coefficients (..., s, p) and of the vibration (..., s), which are carried on;
            None: they are exact.

        Notes
        -----
        Least squares: the componentwise perturbation bound of `balancing.rounding`. Limits and minimax: the optimality
        conditions at the corrections as found (`balancing.optimality`); inf where the optimum is not unique or not
        a smooth function of the data, with the reason in `error_reason`. Even then `residual_max` of minimax is
        bounded, by its distance from `bound`.

        Examples
        --------
        >>> fix = least_squares([[3, -2], [5, -2], [5, -3]], [1, -1, 0])
        >>> bool((abs(fix.corrections - [17 / 21, 31 / 21]) <= fix.error_estimate()).all())
        True
        """
        from balancing.rounding import gap_bound

        of_influence, of_initial = (
            None if error is None else np.asarray(error, dtype=float)
            for error in (influence_error, initial_error)
        )
        exact = of_influence is None and of_initial is None
        bounds = (self._bounds if exact else self._bounds_with(of_influence, of_initial))[0]
        if quantity == "corrections":
            return bounds.solution
        if quantity == "residual":
            return bounds.residual
        if quantity == "residual_max":
            largest = bounds.residual.max(axis=-1)
            if self.bound is not None and self.weights is None:
                largest = np.minimum(largest, gap_bound(self, of_influence, of_initial))
            return np.asarray(largest)
        if quantity == "residual_rms":
            return np.asarray(np.sqrt(np.square(bounds.residual).mean(axis=-1)) + 8 * EPS * self.residual_rms)
        raise ValueError(f"'{quantity}': expected corrections, residual, residual_max or residual_rms")

    @property
    def error_reason(self) -> str:
        """Why `error_estimate` has no bound of the corrections; empty where it has one."""
        return self._bounds[1]

    @cached_property
    def _bounds(self) -> tuple[Bounds, str]:
        return self._bounds_with(None, None)

    def _bounds_with(self, influence_error: Real | None, initial_error: Real | None) -> tuple[Bounds, str]:
        from balancing.rounding import balance_bounds, unlimited

        if unlimited(self):
            return balance_bounds(self, influence_error, initial_error), ""
        from balancing.optimality import optimum_bounds

        return optimum_bounds(self, influence_error, initial_error)


def influence_coefficients(initial: ArrayLike, trials: ArrayLike, trial_masses: ArrayLike) -> Complex:
    """Find the influence coefficients from an initial run and trial runs.

    Parameters
    ----------
    initial
        Vibration without trial masses, complex (..., s).
    trials
        Vibration in the trial runs, complex (..., r, s).
    trial_masses
        The trial masses that were ON the rotor in each run, complex (..., r, p), kg: a mass left on stands in
        every later run's row too. With more runs than planes the coefficients are fitted by least squares.

    Returns
    -------
    ndarray
        α, complex (..., s, p), amplitude per kg.

    Raises
    ------
    DependentTrials
        The runs do not tell the planes apart: fewer runs than planes, a plane never tried, runs alike.
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    Trial run j has V_j = V_0 + α t_j, t_j what was on the rotor: T αᵀ = V_j - V_0, one linear system for any
    pattern of masses put on, left on and taken off. With T diagonal it is α = (V_1 - V_0)/t of Thearle
    (Trans. ASME 56, 1934, 745-753) and of ISO 21940-13.

    Examples
    --------
    A fan (Brüel & Kjær, application note 17-227): 3.4 mm/s at 116°, with 2 g at 0° 1.8 mm/s at 42°.

    >>> import numpy as np
    >>> v0, v1 = np.array([3.4, 1.8]) * np.exp(1j * np.radians([116, 42]))
    >>> alpha = influence_coefficients([v0], [[v1]], [[0.002]])
    >>> fix = least_squares(alpha, [v0])
    >>> abs(fix.corrections).round(6), np.degrees(np.angle(fix.corrections)).round(2)
    (array([0.002012]), array([-30.79]))
    """
    v0 = np.asarray(initial, dtype=complex)
    v = np.asarray(trials, dtype=complex)
    t = np.asarray(trial_masses, dtype=complex)
    for name, array, axes in (("initial", v0, 1), ("trials", v, 2), ("trial_masses", t, 2)):
        if array.ndim < axes:
            raise ValueError(f"{name} must have at least {axes} axes, found shape {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} must be finite")
    if v.shape[-1] != v0.shape[-1] or t.shape[-2] != v.shape[-2]:
        raise ValueError(f"shapes do not fit: initial {v0.shape}, trials {v.shape}, trial_masses {t.shape}")
    runs, planes = t.shape[-2:]
    change = v - v0[..., None, :]
    scaled, scale = columns_scaled(t)
    require_independent(scaled, scale, runs, planes, "trial runs", DependentTrials)
    if runs == planes:
        alpha = np.linalg.solve(scaled, np.broadcast_to(change, _lead(scaled, change) + change.shape[-2:]))
    else:
        q, r = np.linalg.qr(scaled)
        alpha = np.linalg.solve(r, adjoint(q) @ change)
    return np.asarray(np.swapaxes(alpha * scale[..., None], -1, -2))


def least_squares(
    influence: ArrayLike,
    initial: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    ridge: float = 0.0,
    max_mass: ArrayLike | None = None,
    max_residual: ArrayLike | None = None,
) -> Balance:
    """Find the corrections that leave the least (weighted) sum of squares of residual vibration.

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
        The sensors do not tell the planes apart (and `ridge` is 0): the combination they do not see is named.
    Infeasible
        `max_residual` cannot be met.
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    Goodman, J. Eng. Ind. 86 (1964) 273-277. Solved by QR, with columns scaled by powers of two and rows in
    the order of their size (Cox and Higham, BIT 38 (1998) 34-50: then each row's own digits are kept); the
    normal equations, which square the condition number, are never formed.

    Examples
    --------
    Goodman's example has the exact answer 17/21 and 31/21.

    >>> fix = least_squares([[3, -2], [5, -2], [5, -3]], [1, -1, 0])
    >>> (fix.corrections.real * 21).round(12)
    array([17., 31.])
    """
    alpha, v, root = checked(influence, initial, weights)
    if ridge < 0 or not np.isfinite(ridge):
        raise ValueError("ridge must not be negative")
    w = None if weights is None else np.asarray(weights, dtype=float)
    if max_mass is not None or max_residual is not None:
        if ridge:
            raise ValueError("ridge does not go with limits: the limits damp already")
        from balancing.least_maximum import limited_least_squares

        return limited_least_squares(Balance(alpha, v, v, w), root, max_mass, max_residual)
    a, b = (alpha, v) if root is None else (alpha * root[..., None], v * root)
    planes = alpha.shape[-1]
    scaled, scale = columns_scaled(a)
    if ridge:
        norms = np.linalg.norm(scaled, axis=-2)
        largest = norms.max(axis=-1, keepdims=True)
        norms = np.where(norms > 0, norms, np.where(largest > 0, largest, 1.0))
        scaled = np.concatenate([scaled, ridge * norms[..., None] * np.eye(planes)], axis=-2)
        b = np.concatenate([b, np.zeros((*b.shape[:-1], planes))], axis=-1)
    order = np.argsort(-np.abs(scaled).max(axis=-1), axis=-1, kind="stable")
    if scaled.ndim == 2 and b.ndim == 1:
        scaled, b = scaled[order], b[order]
    else:
        lead = _lead(scaled, b[..., None])
        scaled = np.broadcast_to(scaled, lead + scaled.shape[-2:])
        b = np.broadcast_to(b, lead + b.shape[-1:])
        order = np.broadcast_to(order, lead + order.shape[-1:])
        scaled = np.take_along_axis(scaled, order[..., None], axis=-2)
        b = np.take_along_axis(b, order, axis=-1)
    readings = scaled.shape[-2]
    if readings < planes:
        require_independent(scaled, scale, readings, planes, "readings", DependentPlanes)
    q, r = np.linalg.qr(scaled)
    sigma = require_independent(r, scale, readings, planes, "readings", DependentPlanes)
    x = np.linalg.solve(r, -(adjoint(q) @ b[..., None]))[..., 0]
    fix = Balance(alpha, v, np.asarray(x * scale + 0.0, dtype=complex), w, ridge=ridge)
    if not ridge:
        fix.__dict__["condition_number"] = sigma[..., 0] / sigma[..., -1]
    return fix


def initial_unbalance(
    influence: ArrayLike, initial: ArrayLike, weights: ArrayLike | None = None, *, singular: float = 1e12
) -> Complex:
    """Find the unbalance in the correction planes that explains the initial vibration best.

    It is the rotor's: no limit, ridge or rounding of the corrections changes it.

    Parameters
    ----------
    influence, initial, weights
        As for `least_squares`.
    singular
        The condition number from which on planes count as dependent.

    Returns
    -------
    ndarray
        u of V = α u, complex (..., p), kg; NaN in each plane where the readings do not determine it: planes that no
        sensor tells apart, or fewer sensors than planes.

    Raises
    ------
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    The minimum of ‖V - α u‖ is unique in plane p where every null vector of α has a zero there (Golub and Van Loan,
    Matrix Computations, 4th ed., section 5.5: rank-deficient least squares by the SVD).

    Examples
    --------
    Two planes that act alike and a third: 6 is seen of the two together, 5 of the third.

    >>> initial_unbalance([[1, 1, 0], [2, 2, 0], [0, 0, 1]], [6, 12, 5]).real
    array([nan, nan,  5.])
    """
    alpha, v, root = checked(influence, initial, weights)
    if bool((condition_number(alpha, weights) < singular).all()):
        return np.asarray(-least_squares(alpha, v, weights).corrections)
    a, b = (alpha, v) if root is None else (alpha * root[..., None], v * root)
    scaled, scale = columns_scaled(a)
    readings, planes = scaled.shape[-2:]
    left, sigma, right = np.linalg.svd(scaled, full_matrices=readings < planes)
    k = sigma.shape[-1]
    seen = sigma * singular > sigma[..., :1]
    along = np.matvec(adjoint(left), b) / np.where(seen, sigma, 1.0)
    u = np.matvec(adjoint(right[..., :k, :]), np.where(seen, along, 0.0)) * scale
    null = np.concatenate([~seen, np.ones((*seen.shape[:-1], planes - k), dtype=bool)], axis=-1)
    hidden = np.linalg.norm(np.where(null[..., None], right, 0.0), axis=-2)
    # a null vector is known to the rounding of α, not to that of its own components
    return np.where(hidden > 1e-6, complex(np.nan, np.nan), u)


def checked(
    influence: ArrayLike, initial: ArrayLike, weights: ArrayLike | None
) -> tuple[Complex, Complex, Real | None]:
    """Return α, V and the square roots of the weights."""
    alpha = np.asarray(influence, dtype=complex)
    v = np.asarray(initial, dtype=complex)
    if alpha.ndim < 2 or v.ndim < 1 or alpha.shape[-2] != v.shape[-1] or 0 in alpha.shape[-2:]:
        raise ValueError(f"shapes do not fit: influence {alpha.shape}, initial {v.shape}")
    if not (np.isfinite(alpha).all() and np.isfinite(v).all()):
        raise ValueError("influence and initial must be finite")
    if weights is None:
        return alpha, v, None
    w = np.asarray(weights, dtype=float)
    if not ((w >= 0) & (w < np.inf)).all() or not (w > 0).any():
        raise ValueError("weights must not be negative, and not all zero")
    return alpha, v, np.sqrt(w)


def _lead(*arrays: Complex) -> tuple[int, ...]:
    return np.broadcast_shapes(*(a.shape[:-2] for a in arrays))
