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

from dalembert.arithmetic.exact import EPS

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


NEAR = 1e-2
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
    s = h - (flat @ x).reshape(k, 3)
    room = _size(s)
    if not with_t and room.min() > 0:
        # within all limits: on the central path
        z = s * _MIRROR / room[:, None] ** 2 * (0.5 * float(at @ at) / k * min(1.0, float(room.min())))
    else:
        short = np.hypot(s[:, 1], s[:, 2]) - s[:, 0]
        s[:, 0] += np.where(short > -1e-2, short + 1.0, 0.0)
        z = np.zeros((k, 3))
        z[:, 0] = 1.0 / max(float(problem.f.sum()), 1.0) if with_t else 1.0

    best: tuple[float, Real, Real, Real] | None = None
    stalled, near = 0, NEAR
    for _ in range(MOST):
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
        # Nesterov-Todd scaling
        s_size = _size(s)
        z_size = _size(z)
        if not (s_size.min() > 0 and z_size.min() > 0):
            break
        sn, zn = s / s_size[:, None], z / z_size[:, None]
        wn = sn + zn * _MIRROR
        wn /= np.sqrt(2 + 2 * (sn * zn).sum(axis=1))[:, None]
        beta = np.sqrt(s_size / z_size)[:, None]
        # W/β; W⁻¹ = J (W/β) J/β
        scaling = np.empty((k, 3, 3))
        tail = wn[:, 1:]
        scaling[:, 0, :] = wn
        scaling[:, 1:, 0] = tail
        scaling[:, 1:, 1:] = _EYE + tail[:, :, None] * (tail / (1 + wn[:, :1]))[:, None, :]
        inverse = scaling * _SIGNS / beta[:, None]
        lam = np.matvec(scaling, z) * beta
        lam_size = _size(lam)
        if not lam_size.min() > 0:
            break
        matrix = (inverse @ g).reshape(3 * k, n)
        stack = matrix
        if square is not None:
            stack = np.concatenate([np.pad(square, ((0, 0), (0, n - 2 * p))), matrix])
        try:
            r_inverse = np.linalg.inv(np.linalg.qr(stack, mode="r"))
        except np.linalg.LinAlgError:
            break
        normalised = lam / lam_size[:, None]
        rz_scaled = np.matvec(inverse, rz)

        def step(
            target: Real,
            share: float,
            rz_scaled: Real = rz_scaled,
            rx: Real = rx,
            r_inverse: Real = r_inverse,
            matrix: Real = matrix,
        ) -> tuple[Real, Real, Real]:
            """Solve for (dx, W⁻¹ds, W dz) with λ∘(W dz + W⁻¹ds) = λ∘target."""
            rhs = (-share * rz_scaled - target).ravel()
            dx = r_inverse @ (r_inverse.T @ (matrix.T @ rhs - share * rx))
            dz = (matrix @ dx - rhs).reshape(k, 3)
            return dx, target - dz, dz

        _, ds, dz = step(-lam, 1.0)
        alpha = min(1.0, _room(lam_size, normalised, ds, dz))
        sigma = (1 - alpha) ** 3
        # the second-order term counts as far as the first step goes: else a short step is turned about by it
        target = np.empty((k, 3))
        target[:, 0] = (ds * dz).sum(axis=1)
        target[:, 1:] = ds[:, :1] * dz[:, 1:] + dz[:, :1] * ds[:, 1:]
        target *= -(alpha**2)
        target[:, 0] += sigma * gap / k
        dx, ds, dz = step(_divide(lam, lam_size, target) - lam, 1 - sigma)
        alpha = min(1.0, 0.995 * _room(lam_size, normalised, ds, dz))
        x = x + alpha * dx
        s = s + alpha * np.matvec(scaling, ds) * beta
        z = z + alpha * np.matvec(inverse, dz)
    assert best is not None
    return _polish(problem, *best[1:])[1:]


_MIRROR = np.array([1.0, -1.0, -1.0])
_SIGNS = np.outer(_MIRROR, _MIRROR)
_EYE = np.eye(2)


def _size(u: Real) -> Real:
    """√(u₀² - |u₁|²), by the product form."""
    tail = np.hypot(u[:, 1], u[:, 2])
    return np.asarray(np.sqrt(np.maximum((u[:, 0] - tail) * (u[:, 0] + tail), 0.0)))


def _divide(lam: Real, lam_size: Real, b: Real) -> Real:
    """Solve λ∘u = b in the cones' product."""
    u = np.empty_like(b)
    u[:, 0] = (lam * _MIRROR * b).sum(axis=1) / lam_size**2
    u[:, 1:] = (b[:, 1:] - u[:, :1] * lam[:, 1:]) / lam[:, :1]
    return u


def _room(lam_size: Real, normalised: Real, ds: Real, dz: Real) -> float:
    """Return the largest step for which λ + step·direction stays in the cones."""
    both = np.stack([ds, dz])
    first = (both * (normalised * _MIRROR)).sum(axis=-1)
    share = (first + both[..., 0]) / (normalised[:, 0] + 1)
    tail = np.hypot(
        both[..., 1] - share * normalised[:, 1],
        both[..., 2] - share * normalised[:, 2],
    )
    worst = float(((tail - first) / lam_size).max())
    return 1 / worst if worst > 0 else np.inf


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
        pull = (nu * value) @ problem.rows.conj()
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
    slack = s[:, 0] - np.hypot(s[:, 1], s[:, 2])
    active = np.flatnonzero(slack / np.abs(s).max() < z[:, 0] / np.abs(z).max())
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
