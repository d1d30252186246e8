"""The smallest largest residual, exactly, and limits on masses and residuals.

    min t   with |V_s + α_s w| <= t,  |w_p| <= m_p

is a second-order cone problem: |·| of a complex number is a cone in three dimensions (`balancing.cones` solves
it). The dual solution y is the proof: for any y with αᴴy = 0 and Σ|y_s| = 1 no w leaves less than Re(yᴴV), since

    max_s |r_s| >= Re Σ ȳ_s r_s = Re yᴴ(V + α w) = Re yᴴV.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.cones import Cones, solve
from balancing.dependence import EPS, DependentPlanes, columns_scaled, roundings
from balancing.influence import Balance, Infeasible, checked, least_squares

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def minimax(
    influence: ArrayLike,
    initial: ArrayLike,
    max_mass: ArrayLike | None = None,
    *,
    weights: ArrayLike | None = None,
) -> Balance:
    """Find the corrections whose largest residual vibration is the smallest there is.

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
        The sensors do not tell the planes apart, and no limit keeps their masses finite.
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
    w = None if weights is None else np.asarray(weights, dtype=float)
    a, b = (alpha, v) if w is None else (alpha * w[:, None], v * w)
    limit = _limits(max_mass, alpha.shape[1])
    # sensors that no plane moves only set a floor
    moved = np.abs(a).max(axis=1) > 0
    floor = float(np.abs(b[~moved]).max(initial=0.0))
    if not moved.all():
        a, b = a[moved], b[moved]
    if not len(b):
        raise DependentPlanes("the readings show no plane at all", np.eye(alpha.shape[1], dtype=complex)[0])
    corrections, bound = _smallest(a, b, limit)
    return Balance(alpha, v, corrections, w, max(bound, floor, 0.0), max_mass=_given(limit))


def limited_least_squares(
    problem: Balance, root: Real | None, max_mass: ArrayLike | None, max_residual: ArrayLike | None
) -> Balance:
    """Least squares with limits; see `balancing.least_squares`. The corrections of `problem` are not looked at."""
    alpha, v = problem.influence, problem.initial
    if alpha.ndim != 2 or v.ndim != 1:
        raise ValueError("limits are for one rotor at a time: expected influence (s, p), initial (s,)")
    limit = _limits(max_mass, alpha.shape[1])
    ceiling = np.broadcast_to(np.inf if max_residual is None else np.asarray(max_residual, float), v.shape)
    if not (ceiling > 0).all():
        raise ValueError("max_residual must be positive")
    found = _limited(alpha, v, root, limit, ceiling)
    return replace(problem, corrections=found, max_mass=_given(limit), max_residual=_given(ceiling))


def _given(limit: Real) -> Real | None:
    return limit if np.isfinite(limit).any() else None


def _limited(alpha: Complex, v: Complex, root: Real | None, limit: Real, ceiling: Real) -> Complex:
    """Return the corrections of least squares within limits."""
    try:
        free = least_squares(alpha, v, None if root is None else root**2)
        if (np.abs(free.corrections) <= limit).all() and (np.abs(free.residual) <= ceiling).all():
            return free.corrections
    except DependentPlanes:
        if not np.isfinite(limit).all():
            raise
    capped = np.isfinite(ceiling)
    start = None
    if capped.any():
        start, bound = _smallest(alpha[capped] / ceiling[capped, None], v[capped] / ceiling[capped], limit)
        reached = float(np.abs((v[capped] + alpha[capped] @ start) / ceiling[capped]).max())
        if bound > 1:
            raise Infeasible(reached * float(ceiling[capped].min()))
        if reached >= 1 - 1e-9:  # nothing to choose from
            return start
    a, b = (alpha, v) if root is None else (alpha * root[:, None], v * root)
    space = _Space(a, b, limit)
    rows, offset = space.residuals
    cones = [space.limits()]
    if capped.any():
        ratio = alpha[capped] / ceiling[capped, None]
        here = (v[capped] + alpha[capped] @ space.start) / ceiling[capped]
        cones.append((space.within(ratio), here, np.ones(int(capped.sum()))))
    problem = Cones(
        np.concatenate([c[0] for c in cones]),
        np.concatenate([c[1] for c in cones]),
        np.concatenate([c[2] for c in cones]),
        np.zeros(sum(len(c[2]) for c in cones)),
        rows,
        offset,
    )
    x, _ = solve(problem)
    w = space.masses(x)
    if start is None:
        return w

    def beyond(share: float) -> bool:
        mixed = w + share * (start - w)
        return bool((np.abs(v[capped] + alpha[capped] @ mixed) > ceiling[capped]).any())

    # next to infeasible a constraint may be missed by a little: towards the minimax corrections all hold
    low, high = 0.0, 1.0
    if not beyond(0.0):
        return w
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if beyond(middle) else (low, middle)
    return np.asarray(w + high * (start - w), dtype=complex)


def _limits(max_mass: ArrayLike | None, planes: int) -> Real:
    limit = np.broadcast_to(np.inf if max_mass is None else np.asarray(max_mass, dtype=float), (planes,))
    if not (limit > 0).all():
        raise ValueError("max_mass must be positive")
    return limit


def _smallest(a: Complex, b: Complex, limit: Real) -> tuple[Complex, float]:
    """Return the minimax corrections and a lower bound of the largest residual."""
    if np.isfinite(limit).any():
        try:
            free, bound = _smallest(a, b, np.full(len(limit), np.inf))
            if (np.abs(free) <= limit).all():
                return free, bound
        except DependentPlanes:
            if not np.isfinite(limit).all():
                raise
    else:
        fix = least_squares(a, b)
        largest = float(fix.residual_max)
        if not largest > 64 * EPS * max(
            float(np.abs(b).max()), float((np.abs(a) @ np.abs(fix.corrections)).max())
        ):
            return fix.corrections, 0.0
    space = _Space(a, b, limit)
    q, c = space.residuals
    caps = space.limits()
    readings = len(c)
    problem = Cones(
        np.concatenate([q, caps[0]]),
        np.concatenate([c, caps[1]]),
        np.concatenate([np.zeros(readings), caps[2]]),
        np.concatenate([np.ones(readings), np.zeros(len(caps[2]))]),
    )
    x, force = solve(problem)
    w = space.masses(x)
    # the proof: y along the residuals, made orthogonal to the columns where no limit can take up the rest
    y = force[:readings]
    total = float(np.abs(y).sum())
    bound = 0.0
    if total > 0:
        y = y / total
        if not np.isfinite(limit).any():
            y = y - q @ (q.conj().T @ y)
            y = y - q @ (q.conj().T @ y)
            # less what rounding may have added
            proof = float(np.vdot(y, c).real) / float(np.abs(y).sum())
            bound = (proof - roundings(readings)) * space.size
        else:
            bound = space.bound(y, w)
    return w, max(bound, 0.0)


class _Space:
    """Orthonormal coordinates z of the masses, w = scale R⁻¹ z, in which neither κ(α) nor any unit is left.

    Where masses are limited the limits' own rows |w_p/m_p| stand below the coefficients: with QR of both
    together even dependent planes have coordinates.
    """

    def __init__(self, a: Complex, b: Complex, limit: Real) -> None:
        self.a, self.b, self.limit = a, b, limit
        self.limited = np.flatnonzero(np.isfinite(limit))
        w0 = np.zeros(a.shape[1], dtype=complex)
        try:
            free = least_squares(a, b).corrections
            if not len(self.limited):
                w0 = free
        except DependentPlanes:
            if len(self.limited) < a.shape[1]:
                raise
        left = b + a @ w0
        self.start = w0
        self.size = float(np.abs(left).max()) or 1.0
        stack = a / self.size
        if len(self.limited):
            rows = np.zeros((len(self.limited), a.shape[1]), dtype=complex)
            rows[np.arange(len(self.limited)), self.limited] = 1 / limit[self.limited]
            stack = np.concatenate([stack, rows])
        stack, self.scale = columns_scaled(stack)
        self.q, self.r = np.linalg.qr(stack)
        readings = len(b)
        self.residuals = self.q[:readings], left / self.size

    def limits(self) -> tuple[Complex, Complex, Real]:
        """Return the rows, offsets and right sides of |w_p/m_p| <= 1."""
        n = len(self.limited)
        return self.q[len(self.b) :], np.zeros(n, dtype=complex), np.ones(n)

    def within(self, rows: Complex) -> Complex:
        """Return rows over w as rows over z."""
        return np.asarray(np.linalg.solve(self.r.T, (rows * self.scale).T).T, dtype=complex)

    def masses(self, z: Real) -> Complex:
        """Return w of (Re z, Im z, ...)."""
        p = len(self.scale)
        w = np.asarray(
            self.start + self.scale * np.linalg.solve(self.r, z[:p] + 1j * z[p : 2 * p]), dtype=complex
        )
        if len(self.limited):  # rounding must not carry a mass over its limit
            over = np.abs(w) > self.limit
            w = np.where(over, w * (self.limit / np.where(over, np.abs(w), 1.0)), w)
            tight = over & (np.abs(w) > self.limit)
            w = np.where(tight, w * (1 - EPS), w)
        return np.asarray(w + 0.0, dtype=complex)

    def bound(self, y: Complex, w: Complex) -> float:
        """Re yᴴb - Σ m_p |(αᴴy)_p|: with limits any y with Σ|y| = 1 proves as much (unlimited planes: αᴴy = 0).

        Planes that do not touch their limit pull nothing at the optimum; y is made orthogonal to them.
        """
        best = 0.0
        for loose in (~np.isfinite(self.limit), np.abs(w) < (1 - 1e-9) * self.limit):
            u, sigma, _ = np.linalg.svd(self.a[:, loose], full_matrices=False)
            u = u[:, sigma > 1e-13 * sigma.max(initial=0.0)]
            for _ in range(2):
                y = y - u @ (u.conj().T @ y)
            total = float(np.abs(y).sum())
            if total > 0:
                y = y / total
                pull = float(np.abs(self.a.conj().T @ y)[self.limited] @ self.limit[self.limited])
                proof = float(np.vdot(y, self.b).real) - pull
                # less what rounding may have added
                best = max(best, proof - roundings(len(y)) * (float(np.abs(self.b).max()) + pull))
        return best
