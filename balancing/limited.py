"""The smallest largest residual, exactly, and limits on masses and residuals.

    min t   with |V_s + α_s w| <= t,  |w_p| <= m_p

is a second-order cone problem: |·| of a complex number is a cone in three dimensions (`balancing.cone_problem` solves
it). The dual solution y is the proof: for any y with αᴴy = 0 and Σ|y_s| = 1 no w leaves less than Re(yᴴV), since

    max_s |r_s| >= Re Σ ȳ_s r_s = Re yᴴ(V + α w) = Re yᴴV.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from balancing.cone_problem import ConeProblem, solve
from balancing.dependence import DependentPlanes, columns_scaled, roundings
from balancing.qr import smallest_squares
from dalembert.arithmetic.exact import EPS

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Infeasible(ValueError):
    """No corrections meet the residual limit; `smallest` is the smallest limit that can be met."""

    def __init__(self, smallest: float) -> None:
        self.smallest = smallest
        super().__init__(f"the residual limit cannot be met: the smallest that can is {smallest:.6g}")


def limited_least_squares(
    alpha: Complex, v: Complex, root: Real | None, limit: Real, ceiling: Real
) -> Complex:
    """Return the corrections of least squares within limits: of masses (p,) and of residuals (s,), inf for none.

    `root` are the square roots of weights (s,); None: all are one. Raises Infeasible.
    """
    a, b = (alpha, v) if root is None else (alpha * root[:, None], v * root)
    try:
        free, _ = smallest_squares(a, b)
        if (np.abs(free) <= limit).all() and (np.abs(v + np.matvec(alpha, free)) <= ceiling).all():
            return free
    except DependentPlanes:
        if not np.isfinite(limit).all():
            raise
    capped = np.isfinite(ceiling)
    start = None
    if capped.any():
        start, bound = smallest_maximum(
            alpha[capped] / ceiling[capped, None], v[capped] / ceiling[capped], limit
        )
        reached = float(np.abs((v[capped] + alpha[capped] @ start) / ceiling[capped]).max())
        if bound > 1:
            raise Infeasible(reached * float(ceiling[capped].min()))
        # nothing to choose from
        if reached >= 1 - 1e-9:
            return start
    space = _Space(a, b, limit)
    rows, offset = space.residuals
    cones = [space.limits()]
    if capped.any():
        ratio = alpha[capped] / ceiling[capped, None]
        here = (v[capped] + alpha[capped] @ space.start) / ceiling[capped]
        cones.append((space.within(ratio), here, np.ones(int(capped.sum()))))
    problem = ConeProblem(
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


def smallest_maximum(a: Complex, b: Complex, limit: Real) -> tuple[Complex, float]:
    """Return the minimax corrections (p,) within limits (p,) and a lower bound of the largest |b + a w|."""
    if np.isfinite(limit).any():
        try:
            free, bound = smallest_maximum(a, b, np.full(len(limit), np.inf))
            if (np.abs(free) <= limit).all():
                return free, bound
        except DependentPlanes:
            if not np.isfinite(limit).all():
                raise
    else:
        free, _ = smallest_squares(a, b)
        largest = float(np.abs(b + np.matvec(a, free)).max())
        if not largest > 64 * EPS * max(float(np.abs(b).max()), float((np.abs(a) @ np.abs(free)).max())):
            return free, 0.0
    space = _Space(a, b, limit)
    q, c = space.residuals
    caps = space.limits()
    readings = len(c)
    problem = ConeProblem(
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
            free, _ = smallest_squares(a, b)
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
        # a mass at its limit is the limit, and rounding must not carry it over
        if len(self.limited):
            over = np.abs(w) > self.limit * (1 - 4 * EPS)
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
