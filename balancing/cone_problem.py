"""Second-order cone problems with cones of three dimensions (|complex| <= real), to the last digits.

Primal-dual interior-point method with Nesterov-Todd scaling (Math. Oper. Res. 22 (1997) 1-42; the predictor and
corrector as in Andersen, Roos and Terlaky, Math. Program. 95 (2003) 249-277), all cones side by side in numpy, and
finished by Newton's method on the active constraints. It works in coordinates z in which the rows are orthonormal;
the values of the rows are taken at the unknowns w themselves, so that a bad condition of w = start + to_w z costs
steps of Newton's method and no digits.

Nothing here says whether the end is the optimum: `balancing.limited` holds it against its dual bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from balancing.triangle import triangle
from dalembert.arithmetic.exact import EPS

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


NEAR = 3e-3
"""From this error on Newton's method on the constraints that look active is tried: it mostly ends at the optimum."""
MOST = 200
"""Rounds of the interior-point method; some ten are the rule."""


@dataclass
class ConeProblem:
    """min ½|B w + b|² + t  with  |E_k w + e_k| <= h_k + f_k t, w = start + to_w z; without t where all f are zero."""

    e: Complex
    offset: Complex
    h: Real
    f: Real
    square: Complex | None
    at: Complex | None
    start: Complex
    to_w: Complex

    def __post_init__(self) -> None:
        self.with_t = bool(self.f.any())
        self.rows = self.e @ self.to_w
        self.adjoint = self.rows.conj().T
        self.squares = None if self.square is None else np.concatenate(real_rows(self.square @ self.to_w))

    def values(self, w: Complex, t: float) -> tuple[Complex, Real]:
        """Return E w + e and h + f t, each (k,)."""
        return self.offset + self.e @ w, self.h + self.f * t

    def left(self, w: Complex) -> Real:
        """Return the real and imaginary parts of B w + b."""
        assert self.square is not None
        assert self.at is not None
        left = self.at + self.square @ w
        return np.concatenate([left.real, left.imag])


def real_rows(e: Complex) -> tuple[Real, Real]:
    """Return the rows of Re(E z) and Im(E z) over (Re z, Im z)."""
    return np.concatenate([e.real, -e.imag], axis=1), np.concatenate([e.imag, e.real], axis=1)


def solve(problem: ConeProblem) -> tuple[Complex, Complex]:
    """Return w (p,) and the dual forces of the cones, complex (k,): the best point that was reached.

    In the standard form min ½|Bx + b|² + cᵀx, Gx + s = h, s in the cones, dual z in the cones, with
    s_k = (h_k + f_k t, Re, Im of E_k z + e_k). Each step solves the least-squares form of

        (BᵀB + GᵀW⁻²G) dx = ...      by  R of the rows [B; W⁻¹G],

    so that the squared matrix is never formed.
    """
    k, p = problem.e.shape
    with_t = problem.with_t
    n = 2 * p + with_t
    offset, _ = problem.values(problem.start, 0.0)
    re, im = real_rows(problem.rows)
    g = np.zeros((k, 3, n))
    g[:, 1, : 2 * p], g[:, 2, : 2 * p] = -re, -im
    if with_t:
        g[:, 0, -1] = -problem.f
    h = np.stack([problem.h, offset.real, offset.imag], axis=1)
    flat = g.reshape(3 * k, n)
    c = np.zeros(n)
    if with_t:
        c[-1] = 1.0
    square = problem.squares
    at = np.zeros(0) if square is None else problem.left(problem.start)

    x = np.zeros(n)
    if with_t:
        x[-1] = 1.2 * max(float(np.abs(offset[problem.f > 0]).max()), 1e-300) + 1e-3
    # s and z side by side
    pair = np.zeros((2, k, 3))
    s, z = pair
    s[:] = h - (flat @ x).reshape(k, 3)
    room = (s[:, 0] - np.hypot(s[:, 1], s[:, 2])) * (s[:, 0] + np.hypot(s[:, 1], s[:, 2]))
    if not with_t and s[:, 0].min() > 0 and room.min() > 0:
        # within all limits: on the central path
        z[:] = s * _MIRROR / room[:, None] * (0.5 * float(at @ at) / k * min(1.0, float(np.sqrt(room.min()))))
    else:
        short = np.hypot(s[:, 1], s[:, 2]) - s[:, 0]
        s[:, 0] += np.where(short > -1e-2, short + 1.0, 0.0)
        z[:, 0] = 1.0 / max(float(problem.f.sum()), 1.0) if with_t else 1.0

    # the rows [B; W⁻¹G], of which those of B stay as they are
    above = 0 if square is None else len(square)
    stack = np.zeros((above + 3 * k, n))
    if square is not None:
        stack[:above, : 2 * p] = square
    matrix = stack[above:]
    cells, both, moved = matrix.reshape(k, 3, n), np.empty((2, k, 3)), np.empty((2, k, 3))
    target = np.empty((k, 3))

    best: tuple[float, Real, Real, Real] | None = None
    stalled, near = 0, NEAR
    for _ in range(MOST):
        s, z = pair
        rx = c + flat.T @ z.ravel()
        if square is not None:
            rx[: 2 * p] += square.T @ (square @ x[: 2 * p] + at)
        rz = s + (flat @ x).reshape(k, 3) - h
        gap = float(np.vdot(s, z))
        error = max(gap, float(np.abs(rx).max()), float(np.abs(rz).max()))
        stalled = 0 if best is None or error < 0.99 * best[0] else stalled + 1
        if best is None or error < best[0]:
            best = (error, x, s, z)
        if error < 1e-13 or stalled >= 8:
            break
        if error < near:
            optimal, w, force = _polish(problem, x, s, z)
            if optimal:
                return w, force
            near = error / 30
        # Nesterov-Todd scaling W = β(u uᵀ - J), by the product form of √(s₀² - |s₁|²)
        tail = np.hypot(pair[..., 1], pair[..., 2])
        size = (pair[..., 0] - tail) * (pair[..., 0] + tail)
        if not size.min() > 0:
            break
        size = np.sqrt(size)
        unit = pair / size[..., None]
        mean = unit[0] + unit[1] * _MIRROR
        mean /= np.sqrt(2 + 2 * np.vecdot(unit[0], unit[1]))[:, None]
        mean[:, 0] += 1
        mean /= np.sqrt(mean[:, :1])
        scaling = mean[:, :, None] * mean[:, None, :] - _J
        beta = np.sqrt(size[0] / size[1])[:, None]
        # W⁻¹ = J (W/β) J/β
        inverse = scaling * (_SIGNS / beta[:, None])
        lam, lam_size = np.matvec(scaling, z) * beta, np.sqrt(size[0] * size[1])
        np.matmul(inverse, g, out=cells)
        try:
            r_inverse = np.linalg.inv(triangle(stack))
        except np.linalg.LinAlgError:
            break
        normalised = lam / lam_size[:, None]
        mirrored, further = normalised * _MIRROR, normalised[:, 0] + 1
        rz_scaled = np.matvec(inverse, rz)
        share, wanted = 1.0, -lam
        # first straight on, then with what that tells: λ∘(W dz + W⁻¹ds) = λ∘wanted
        for corrects in (False, True):
            rhs = (-share * rz_scaled - wanted).ravel()
            dx = r_inverse @ (r_inverse.T @ (matrix.T @ rhs - share * rx))
            ds, dz = both
            dz[:] = (matrix @ dx - rhs).reshape(k, 3)
            np.subtract(wanted, dz, out=ds)
            # the largest step for which λ + step·direction stays in the cones
            first = np.vecdot(both, mirrored)
            part = (first + both[..., 0]) / further
            tail = np.hypot(
                both[..., 1] - part * normalised[:, 1],
                both[..., 2] - part * normalised[:, 2],
            )
            worst = float(((tail - first) / lam_size).max())
            if corrects:
                break
            alpha = min(1.0, 1 / worst) if worst > 0 else 1.0
            sigma = (1 - alpha) ** 3
            # the second-order term counts as far as the first step goes: else a short step is turned about by it
            target[:, 0] = np.vecdot(ds, dz)
            target[:, 1:] = ds[:, :1] * dz[:, 1:] + dz[:, :1] * ds[:, 1:]
            target *= -(alpha**2)
            target[:, 0] += sigma * gap / k
            share, wanted = 1 - sigma, _divide(lam, lam_size, target) - lam
        alpha = min(1.0, 0.995 / worst) if worst > 0 else 1.0
        np.multiply(np.matvec(scaling, ds), beta, out=moved[0])
        moved[1] = np.matvec(inverse, dz)
        x = x + alpha * dx
        pair = pair + alpha * moved
    assert best is not None
    return _polish(problem, *best[1:])[1:]


_MIRROR = np.array([1.0, -1.0, -1.0])
_SIGNS = np.outer(_MIRROR, _MIRROR)
_J = np.diag(_MIRROR)


def _divide(lam: Real, lam_size: Real, b: Real) -> Real:
    """Solve λ∘u = b in the cones' product."""
    u = np.empty_like(b)
    u[:, 0] = np.vecdot(lam * _MIRROR, b) / lam_size**2
    u[:, 1:] = (b[:, 1:] - u[:, :1] * lam[:, 1:]) / lam[:, :1]
    return u


def _polish(problem: ConeProblem, x: Real, s: Real, z: Real) -> tuple[bool, Complex, Complex]:
    """Finish by Newton's method on the active constraints ½(|E w + e|² - (h + f t)²) = 0 with multipliers ν.

    Returns whether the conditions of Karush, Kuhn and Tucker, which of a convex problem suffice, hold to rounding:
    so it is where the active constraints were the true ones. Then w and the forces.
    """
    k, p = problem.e.shape
    with_t, square = problem.with_t, problem.squares
    n = 2 * p + with_t
    nu = z[:, 0] / s[:, 0]
    w, t = problem.start + problem.to_w @ (x[:p] + 1j * x[p : 2 * p]), float(x[-1]) if with_t else 0.0

    def judge(w: Complex, t: float, nu: Real) -> tuple[float, Complex, Real, Real]:
        """How far from optimal; and the rows' values, their radii, and the slope of the objective."""
        value, radius = problem.values(w, t)
        slope = np.zeros(n)
        if with_t:
            slope[-1] = 1.0
        if square is not None:
            slope[: 2 * p] = square.T @ problem.left(w)
        gradient = slope.copy()
        pull = problem.adjoint @ (nu * value)
        gradient[:p] += pull.real
        gradient[p : 2 * p] += pull.imag
        if with_t:
            gradient[-1] -= float((nu * problem.f * radius).sum())
        slack = radius - np.abs(value)
        away = max(
            float(np.abs(gradient).max()),
            float(-slack.min()),
            float(-nu.min()),
            float(np.abs(nu * slack * radius).max()),
        )
        return away, value, radius, slope

    # what rounding the masses does to the values of the rows
    rounding = 16 * EPS * max(1.0, float((np.abs(problem.e) @ np.abs(w)).max()))
    active = _active(s, z)
    away, value, radius, slope = judge(w, t, nu)
    best = (away, w, nu * value)
    m = len(active)
    if m == 0:
        return away < rounding, w, nu * value
    kept = np.zeros(k)
    kept[active] = nu[active]
    nu = kept
    re, im = real_rows(problem.rows[active])
    f = problem.f[active]
    own = None if square is None else square.T @ square
    for _ in range(8):
        ra, va = value[active], radius[active]
        gradient = np.zeros((m, n))
        gradient[:, : 2 * p] = re * ra.real[:, None] + im * ra.imag[:, None]
        weight = np.maximum(nu[active], 0.0)[:, None]
        # of orthonormal coordinates: nothing of κ(α) is squared in it
        system = np.zeros((n + m, n + m))
        system[: 2 * p, : 2 * p] = re.T @ (weight * re) + im.T @ (weight * im)
        if with_t:
            gradient[:, -1] = -f * va
            system[n - 1, n - 1] = -float((nu[active] * f**2).sum())
        if own is not None:
            system[: 2 * p, : 2 * p] += own
        system[n:, :n], system[:n, n:] = gradient, gradient.T
        size = np.abs(ra)
        rhs = -np.concatenate([slope + gradient.T @ nu[active], (size - va) * (size + va) / 2])
        step = _consistent(system, rhs, 10 * max(float(np.abs(nu).max()), 1.0))
        if not np.isfinite(step).all():
            break
        w = w + problem.to_w @ (step[:p] + 1j * step[p : 2 * p])
        t = t + (float(step[n - 1]) if with_t else 0.0)
        nu = nu.copy()
        nu[active] += step[n:]
        if nu.min() < -1e-9 * np.abs(nu).max():
            break
        away, value, radius, slope = judge(w, t, nu)
        if away >= best[0]:
            break
        best = (away, w, nu * value)
    away, w, force = best
    return away < rounding, w, force


def _active(s: Real, z: Real) -> NDArray[np.intp]:
    """Return the cones that look active: whose forces are larger than what is left to their edge."""
    slack = s[:, 0] - np.hypot(s[:, 1], s[:, 2])
    return np.flatnonzero(slack / np.abs(s).max() < z[:, 0] / np.abs(z).max())


def _consistent(system: Real, rhs: Real, largest: float) -> Real:
    """Solve a symmetric system; of a singular one (the optimum is not unique) the solution of least norm."""
    try:
        u = np.asarray(np.linalg.solve(system, rhs))
        if np.isfinite(u).all() and np.abs(u).max() <= largest:
            return u
    except np.linalg.LinAlgError:
        pass
    try:
        return np.asarray(np.linalg.lstsq(system, rhs, rcond=1e-11)[0])
    except np.linalg.LinAlgError:
        return np.full(len(rhs), np.nan)
