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

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

EPS = float(np.finfo(float).eps)


class DependentPlanes(ValueError):
    """The readings cannot tell the planes apart; `combination` is one that no sensor sees, `case` which rotor."""

    def __init__(self, message: str, combination: Complex, case: tuple[int, ...] = ()) -> None:
        self.combination = combination
        self.case = case
        super().__init__(message)


class DependentTrials(ValueError):
    """The trial runs do not tell the planes' effects apart; `combination` is one no run has tried."""

    def __init__(self, message: str, combination: Complex, case: tuple[int, ...] = ()) -> None:
        self.combination = combination
        self.case = case
        super().__init__(message)


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

    def error_estimate(self) -> Real:
        """Return a bound of the rounding error of `corrections` of a least-squares problem, (..., p), kg.

        The data are taken as exact. Componentwise perturbation bound for least squares (Å. Björck, BIT 31 (1991)
        238-244): |δw| ≤ c·ε·(|A⁺|(|A||w| + |V|) + |(AᴴA)⁻¹||Aᴴ||r|); the product with AᴴA is only a bound, nothing
        is solved with it. Minimax and limited problems are judged by their objective: `residual_max` and `bound`.
        """
        if self.bound is not None:
            raise ValueError("a minimax problem is judged by its objective: residual_max beside bound")
        root = np.ones(self.initial.shape) if self.weights is None else np.sqrt(self.weights)
        a, b, r = self.influence * root[..., None], self.initial * root, self.residual * root
        q, upper = np.linalg.qr(a)
        inverse = np.linalg.inv(upper)
        size = np.abs(a)
        fit = np.abs(inverse @ _adjoint(q)) @ (
            size @ np.abs(self.corrections)[..., None] + np.abs(b)[..., None]
        )
        rest = np.abs(inverse @ _adjoint(inverse)) @ (np.swapaxes(size, -1, -2) @ np.abs(r)[..., None])
        return np.asarray(8 * EPS * (fit + rest)[..., 0])


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
    scaled, scale = _columns_scaled(t)
    _require_independent(scaled, scale, runs, planes, "trial runs", DependentTrials)
    if runs == planes:
        alpha = np.linalg.solve(scaled, np.broadcast_to(change, _lead(scaled, change) + change.shape[-2:]))
    else:
        q, r = np.linalg.qr(scaled)
        alpha = np.linalg.solve(r, _adjoint(q) @ change)
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
    alpha, v, root = _checked(influence, initial, weights)
    if ridge < 0 or not np.isfinite(ridge):
        raise ValueError("ridge must not be negative")
    w = None if weights is None else np.asarray(weights, dtype=float)
    if max_mass is not None or max_residual is not None:
        if ridge:
            raise ValueError("ridge does not go with limits: the limits damp already")
        from balancing.least_maximum import limited_least_squares

        found = limited_least_squares(alpha, v, root, max_mass, max_residual)
        return Balance(alpha, v, found, w)
    a, b = (alpha, v) if root is None else (alpha * root[..., None], v * root)
    planes = alpha.shape[-1]
    scaled, scale = _columns_scaled(a)
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
        _require_independent(scaled, scale, readings, planes, "readings", DependentPlanes)
    q, r = np.linalg.qr(scaled)
    sigma = _require_independent(r, scale, readings, planes, "readings", DependentPlanes)
    x = np.linalg.solve(r, -(_adjoint(q) @ b[..., None]))[..., 0]
    fix = Balance(alpha, v, np.asarray(x * scale + 0.0, dtype=complex), w)
    if not ridge:
        fix.__dict__["condition_number"] = sigma[..., 0] / sigma[..., -1]
    return fix


def condition_number(influence: ArrayLike, weights: ArrayLike | None = None) -> Real:
    """Return σ_max/σ_min of the coefficients: by what factor relative errors of readings can grow.

    The columns are first brought within a factor of two of the largest by powers of two (without rounding),
    so that a plane of small effect does not count as a dependent one. Shape (...); inf for dependent planes.

    >>> float(condition_number([[1, 0], [0, 1000]]).round(3))
    1.953
    """
    alpha = np.asarray(influence, dtype=complex)
    if weights is not None:
        alpha = alpha * np.sqrt(np.asarray(weights, dtype=float))[..., None]
    scaled, _ = _columns_scaled(alpha)
    if alpha.shape[-2] < alpha.shape[-1]:
        return np.full(alpha.shape[:-2], np.inf)
    sigma = np.linalg.svd(scaled, compute_uv=False)
    low = sigma[..., -1]
    dependent = low <= _threshold(*alpha.shape[-2:]) * sigma[..., 0]
    return np.asarray(np.where(dependent, np.inf, sigma[..., 0] / np.where(dependent, 1.0, low)))


def plane_significance(influence: ArrayLike, weights: ArrayLike | None = None) -> Real:
    """Tell for each plane how much of its effect no other planes can bring about.

    Returns
    -------
    ndarray
        (..., p) in [0, 1]: the sine of the angle between a plane's column and all the others' span. 1: the
        plane is independent of the others; near 0: the others can do what it does, and it should be left out.

    Notes
    -----
    After Darlow, ASME 82-GT (1982), "non-independent balance planes". Every column is held against ALL the
    others (of planes that are dependent only together, no two are alike). With A = QR the sine of column j
    is 1/(‖a_j‖ ‖row j of R⁻¹‖).

    Examples
    --------
    Three planes, of which the third does what the first two do together:

    >>> plane_significance([[1, 0, 1], [0, 1, 1], [0, 0, 0.01]]).round(4)
    array([0.01  , 0.01  , 0.0071])
    """
    alpha = np.asarray(influence, dtype=complex)
    if weights is not None:
        alpha = alpha * np.sqrt(np.asarray(weights, dtype=float))[..., None]
    scaled, _ = _columns_scaled(alpha)
    norms = np.linalg.norm(scaled, axis=-2)
    unit = scaled / np.where(norms > 0, norms, 1.0)[..., None, :]
    out = np.zeros(unit.shape[:-2] + unit.shape[-1:])
    for j in range(unit.shape[-1]):
        others = np.delete(unit, j, axis=-1)
        # orthogonal complement by the SVD, so that others which depend on each other do no harm
        u, sigma, _ = np.linalg.svd(others, full_matrices=False)
        keep = sigma > _threshold(*unit.shape[-2:]) * sigma[..., :1]
        left = unit[..., j]
        for _ in range(2):  # twice is enough (Kahan, Parlett)
            inside = np.where(keep, np.matvec(_adjoint(u), left), 0)
            left = left - np.matvec(u, inside)
        out[..., j] = np.linalg.norm(left, axis=-1)
    return np.where(out > _threshold(*unit.shape[-2:]), np.minimum(out, 1.0), 0.0)


def unseen(influence: ArrayLike, weights: ArrayLike | None = None) -> tuple[Complex, float]:
    """Return the combination of planes that the readings see least, and how well they see it.

    The combination is complex (p,), with its largest component 1; the second value is σ_min/σ_max of the
    scaled coefficients (0 for a combination that cannot be seen).

    >>> np.abs(unseen([[1, 2], [2, 4]])[0]).round(3)
    array([1. , 0.5])
    """
    alpha = np.asarray(influence, dtype=complex)
    if weights is not None:
        alpha = alpha * np.sqrt(np.asarray(weights, dtype=float))[..., None]
    scaled, scale = _columns_scaled(alpha)
    _, sigma, vh = np.linalg.svd(scaled)
    smallest = sigma[-1] / sigma[0] if len(sigma) == scaled.shape[1] and sigma[0] > 0 else 0.0
    return _normed(vh[-1].conj() * scale), float(smallest)


def _normed(direction: Complex) -> Complex:
    return np.asarray(direction / direction[np.argmax(np.abs(direction) >= 0.999 * np.abs(direction).max())])


def _checked(
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


def _columns_scaled(a: Complex) -> tuple[Complex, Real]:
    """Return a·diag(scale) with columns within a factor of two of the largest, and the scale (powers of two)."""
    re, im = a.real, a.imag
    square = np.einsum("...sp,...sp->...p", re, re) + np.einsum("...sp,...sp->...p", im, im)
    if square.min() > 1e-280 and square.max() < 1e280:
        exponent = (
            np.frexp(square.max(axis=-1, keepdims=True) / square)[1] - 1
        ) >> 1  # ⌊log₂ of the norms' ratio⌋
    else:  # the squares leave the range of numbers, or a column is zero
        peak = np.maximum(np.abs(re), np.abs(im)).max(axis=-2)
        highest = peak.max(axis=-1, keepdims=True)
        exponent = np.where(peak > 0, np.frexp(highest)[1] - np.frexp(peak)[1], 0)
    if not exponent.any():
        return a, np.ones(square.shape)
    scale = np.ldexp(1.0, exponent)
    return a * scale[..., None, :], scale


def _threshold(rows: int, columns: int) -> float:
    """Below this ratio of singular values a combination of planes lies in the rounding of the data."""
    return 64 * max(rows, columns) * EPS


def _require_independent(
    a: Complex,
    scale: Real,
    rows: int,
    columns: int,
    what: str,
    error: type[DependentPlanes | DependentTrials],
) -> Real:
    """Return the singular values of scaled columns, or raise with the combination that is not seen."""
    if rows >= columns:
        sigma = np.linalg.svd(a, compute_uv=False)
        bad = ~(sigma[..., -1] > _threshold(rows, columns) * sigma[..., 0])
        if not bad.any():
            return np.asarray(sigma)
        case = tuple(int(i[0]) for i in np.nonzero(bad)) if bad.ndim else ()
    else:
        case = (0,) * (a.ndim - 2)
    vh = np.linalg.svd(a[case])[2]
    combination = _normed(vh[-1].conj() * np.broadcast_to(scale, a.shape[:-2] + scale.shape[-1:])[case])
    planes = np.flatnonzero(np.abs(combination) > 1e-6).tolist()
    if rows < columns:
        message = f"{columns} planes need at least as many {what}, found {rows}"
    elif len(planes) == 1:
        message = f"the {what} do not show plane {planes[0]} at all"
    else:
        message = f"the {what} do not tell the planes {', '.join(map(str, planes))} apart"
    raise error(message, combination, case)


def _adjoint(a: Complex) -> Complex:
    return np.swapaxes(a, -1, -2).conj()


def _lead(*arrays: Complex) -> tuple[int, ...]:
    return np.broadcast_shapes(*(a.shape[:-2] for a in arrays))
