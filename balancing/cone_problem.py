"""Second-order cone problems with cones of three dimensions (|complex| <= real), to the last digits.

Primal-dual interior-point method with Nesterov-Todd scaling (Math. Oper. Res. 22 (1997) 1-42; the predictor and
corrector as in Andersen, Roos and Terlaky, Math. Program. 95 (2003) 249-277), all cones side by side in numpy, and
finished by Newton's method on the active constraints. The rows are expected to be orthonormal and of unit size.
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


@dataclass
class ConeProblem:
    """min ½|B z + b|² + t  with |E_k z + e_k| <= h_k + f_k t; without t where all f are zero."""

    e: Complex
    offset: Complex
    h: Real
    f: Real
    rows: Complex | None = None
    at: Complex | None = None


def real_rows(e: Complex) -> tuple[Real, Real]:
    """Return the rows of Re(E z) and Im(E z) over (Re z, Im z)."""
    return np.concatenate([e.real, -e.imag], axis=1), np.concatenate([e.imag, e.real], axis=1)


def solve(problem: ConeProblem) -> tuple[Real, Complex]:
    """Return (Re z, Im z[, t]) and the dual forces of the cones, complex (k,).

    In the standard form min ½|Bx + b|² + cᵀx, Gx + s = h, s in the cones, dual z in the cones, with
    s_k = (h_k + f_k t, Re, Im of E_k z + e_k). Each step solves the least-squares form of

        (BᵀB + GᵀW⁻²G) dx = ...      as  QR of the rows [B; W⁻¹G],

    so that the squared matrix is never formed.
    """
    k, p = problem.e.shape
    with_t = bool(problem.f.any())
    n = 2 * p + with_t
    re, im = real_rows(problem.e)
    g = np.zeros((k, 3, n))
    g[:, 1, : 2 * p], g[:, 2, : 2 * p] = -re, -im
    if with_t:
        g[:, 0, -1] = -problem.f
    h = np.stack([problem.h, problem.offset.real, problem.offset.imag], axis=1)
    flat = g.reshape(3 * k, n)
    c = np.zeros(n)
    if with_t:
        c[-1] = 1.0
    if problem.rows is not None:
        assert problem.at is not None
        square: Real | None = np.concatenate(real_rows(problem.rows))
        at = np.concatenate([problem.at.real, problem.at.imag])
        own = 2 * len(problem.at)
    else:
        square, at, own = None, np.zeros(0), 0

    x = np.zeros(n)
    if with_t:
        x[-1] = 1.2 * max(float(np.abs(problem.offset[problem.f > 0]).max()), 1e-300) + 1e-3
    s = h - (flat @ x).reshape(k, 3)
    short = np.hypot(s[:, 1], s[:, 2]) - s[:, 0]
    s[:, 0] += np.where(short > -1e-2, short + 1.0, 0.0)
    z = np.zeros((k, 3))
    z[:, 0] = 1.0 / max(float(problem.f.sum()), 1.0) if with_t else 1.0

    best: tuple[float, Real, Real, Real] | None = None
    stalled, near = 0, NEAR
    for _ in range(60):
        rx = c + flat.T @ z.ravel()
        if square is not None:
            rx = rx + square.T @ (square @ x + at)
        rz = s + (flat @ x).reshape(k, 3) - h
        gap = float(np.vdot(s, z))
        error = max(gap, float(np.abs(rx).max()), float(np.abs(rz).max()))
        if best is None or error < best[0]:
            stalled = 0 if best is None or error < 0.5 * best[0] else stalled + 1
            best = (error, x, s, z)
        else:
            stalled += 1
        if error < 1e-10 or stalled >= 4:
            break
        if error < near:
            quality, point, force = _polish(problem, with_t, x, s, z, square, at)
            if quality < 16 * EPS:
                return point, force
            near = error / 30
        # Nesterov-Todd scaling
        s_size = _size(s)
        z_size = _size(z)
        if not (s_size.min() > 0 and z_size.min() > 0):
            break
        sn, zn = s / s_size[:, None], z / z_size[:, None]
        gamma = np.sqrt((1 + (sn * zn).sum(axis=1)) / 2)
        wn = sn + zn * _MIRROR
        wn /= 2 * gamma[:, None]
        beta = np.sqrt(s_size / z_size)
        # W/β; W⁻¹ = J (W/β) J/β
        scaling = np.empty((k, 3, 3))
        tail = wn[:, 1:]
        scaling[:, 0, 0] = wn[:, 0]
        scaling[:, 0, 1:] = scaling[:, 1:, 0] = tail
        scaling[:, 1:, 1:] = _EYE + tail[:, :, None] * (tail / (1 + wn[:, :1]))[:, None, :]
        inverse = scaling * _SIGNS / beta[:, None, None]
        lam = np.matvec(scaling, z) * beta[:, None]
        matrix = (inverse @ g).reshape(3 * k, n)
        q, r = np.linalg.qr(matrix if square is None else np.concatenate([square, matrix]))
        q = q[own:]
        r_inverse = np.linalg.inv(r)
        normalised = lam / _size(lam)[:, None]
        rz_scaled = np.matvec(inverse, rz)

        def step(
            target: Real,
            share: float,
            rz_scaled: Real = rz_scaled,
            rx: Real = rx,
            q: Real = q,
            r_inverse: Real = r_inverse,
            matrix: Real = matrix,
        ) -> tuple[Real, Real, Real]:
            """Solve for (dx, W⁻¹ds, W dz) with λ∘(W dz + W⁻¹ds) = λ∘target."""
            rhs = (-share * rz_scaled - target).ravel()
            dx = r_inverse @ (r_inverse.T @ (-share * rx) + q.T @ rhs)
            dz = matrix @ dx - rhs
            return dx, target - dz.reshape(k, 3), dz.reshape(k, 3)

        _, ds, dz = step(-lam, 1.0)
        alpha = min(1.0, _room(lam, normalised, ds, dz))
        mu = gap / k
        sigma = (1 - alpha) ** 3
        product = np.empty((k, 3))
        product[:, 0] = (ds * dz).sum(axis=1)
        product[:, 1:] = ds[:, :1] * dz[:, 1:] + dz[:, :1] * ds[:, 1:]
        target = -product
        target[:, 0] += sigma * mu
        dx, ds, dz = step(_divide(lam, target) - lam, 1 - sigma)
        alpha = min(1.0, 0.995 * _room(lam, normalised, ds, dz))
        x = x + alpha * dx
        s = s + alpha * np.matvec(scaling, ds) * beta[:, None]
        z = z + alpha * np.matvec(inverse, dz)
    assert best is not None
    return _polish(problem, with_t, *best[1:], square, at)[1:]


_MIRROR = np.array([1.0, -1.0, -1.0])
_SIGNS = np.outer(_MIRROR, _MIRROR)
_EYE = np.eye(2)


def _size(u: Real) -> Real:
    """√(u₀² - |u₁|²), by the product form."""
    tail = np.hypot(u[:, 1], u[:, 2])
    return np.asarray(np.sqrt(np.maximum((u[:, 0] - tail) * (u[:, 0] + tail), 0.0)))


def _divide(lam: Real, b: Real) -> Real:
    """Solve λ∘u = b in the cones' product."""
    u = np.empty_like(b)
    u[:, 0] = (lam * _MIRROR * b).sum(axis=1) / _size(lam) ** 2
    u[:, 1:] = (b[:, 1:] - u[:, :1] * lam[:, 1:]) / lam[:, :1]
    return u


def _room(lam: Real, normalised: Real, *directions: Real) -> float:
    """Return the largest step for which λ + step·direction stays in the cones."""
    size = _size(lam)
    worst = 0.0
    for d in directions:
        first = (normalised * _MIRROR * d).sum(axis=1)
        tail = d[:, 1:] - ((first + d[:, 0]) / (normalised[:, 0] + 1))[:, None] * normalised[:, 1:]
        worst = max(worst, float(((np.hypot(tail[:, 0], tail[:, 1]) - first) / size).max()))
    return 1 / worst if worst > 0 else np.inf


def _polish(
    problem: ConeProblem, with_t: bool, x: Real, s: Real, z: Real, square: Real | None, at: Real
) -> tuple[float, Real, Complex]:
    """Finish by Newton's method on the active constraints ½(|E z + e|² - (h + f t)²) = 0 with multipliers ν.

    Returns also how far from optimal the end is: rounding alone where the active constraints were the true ones.
    """
    k, p = problem.e.shape
    nu = z[:, 0] / s[:, 0]

    def values(x: Real) -> tuple[Complex, Real]:
        t = x[-1] if with_t else 0.0
        return problem.e @ (x[:p] + 1j * x[p : 2 * p]) + problem.offset, problem.h + problem.f * t

    def judge(x: Real, nu: Real) -> float:
        """How far from optimal: the conditions of Karush, Kuhn and Tucker, which of a convex problem suffice."""
        r, radius = values(x)
        gradient = np.zeros(len(x))
        pull = problem.e.conj().T @ (nu * r)
        gradient[:p], gradient[p : 2 * p] = pull.real, pull.imag
        if with_t:
            gradient[-1] = 1 - float((nu * problem.f * radius).sum())
        if square is not None:
            gradient[: 2 * p] += square.T @ (square @ x[: 2 * p] + at)
        slack = radius - np.abs(r)
        return max(
            float(np.abs(gradient).max()),
            float(-slack.min()),
            float(-nu.min()),
            float(np.abs(nu * slack * radius).max()),
        )

    slack = s[:, 0] - np.hypot(s[:, 1], s[:, 2])
    active = np.flatnonzero(slack / np.abs(s).max() < z[:, 0] / np.abs(z).max())
    best = (judge(x, nu), x, nu)
    trial_x, trial_nu = x.copy(), np.where(np.isin(np.arange(k), active), nu, 0.0)
    e = problem.e[active]
    re, im = real_rows(e)
    n, m = len(x), len(active)
    if m == 0:
        return best[0], x, nu * values(x)[0]
    for _ in range(5):
        r, radius = values(trial_x)
        ra, va = r[active], radius[active]
        gradient = np.zeros((m, n))
        gradient[:, : 2 * p] = re * ra.real[:, None] + im * ra.imag[:, None]
        weight = np.sqrt(np.maximum(trial_nu[active], 0.0))[:, None]
        rows = np.concatenate([weight * re, weight * im])
        # of orthonormal coordinates: nothing of κ(α) is squared in it
        hessian = np.zeros((n, n))
        hessian[: 2 * p, : 2 * p] = rows.T @ rows
        slope = np.zeros(n)
        if with_t:
            gradient[:, -1] = -problem.f[active] * va
            hessian[-1, -1] = -float((trial_nu[active] * problem.f[active] ** 2).sum())
            slope[-1] = 1.0
        if square is not None:
            hessian[: 2 * p, : 2 * p] += square.T @ square
            slope[: 2 * p] = square.T @ (square @ trial_x[: 2 * p] + at)
        system = np.zeros((n + m, n + m))
        system[:n, :n], system[n:, :n], system[:n, n:] = hessian, gradient, gradient.T
        size = np.abs(ra)
        rhs = -np.concatenate([slope + gradient.T @ trial_nu[active], (size - va) * (size + va) / 2])
        solution = _consistent(system, rhs, 10 * max(float(np.abs(trial_nu).max()), 1.0))
        trial_x = trial_x + solution[:n]
        trial_nu = trial_nu.copy()
        trial_nu[active] += solution[n:]
        if not np.isfinite(solution).all() or trial_nu.min() < -1e-9 * np.abs(trial_nu).max():
            break
        quality = judge(trial_x, trial_nu)
        if quality >= best[0]:
            break
        best = (quality, trial_x, trial_nu)
    quality, x, nu = best
    return quality, x, nu * values(x)[0]


def _consistent(system: Real, rhs: Real, largest: float) -> Real:
    """Solve a symmetric system; of a singular one (the optimum is not unique) the solution of least norm."""
    try:
        u = np.asarray(np.linalg.solve(system, rhs))
        if np.isfinite(u).all() and np.abs(u).max() <= largest:
            return u
    except np.linalg.LinAlgError:
        pass
    return np.asarray(np.linalg.lstsq(system, rhs, rcond=1e-11)[0])
