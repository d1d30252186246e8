"""Second-order cone problems with cones of three dimensions (|complex| <= real), to the last digits.

Primal-dual interior-point method with Nesterov-Todd scaling (Math. Oper. Res. 22 (1997) 1-42; the predictor and
corrector as in Andersen, Roos and Terlaky, Math. Program. 95 (2003) 249-277), all cones side by side in numpy, and
finished by Newton's method on the active constraints. It works in coordinates z in which the rows are orthonormal;
the values of the rows are taken at the steps w = to_w z themselves, so that a bad condition of to_w costs steps of
Newton's method and no digits. The steps begin where the values of the rows are given.

Nothing here says whether the end is the optimum: `balancing.limited` holds it against its dual bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.triangle import triangle
from dalembert.arithmetic.exact import EPS

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


NEAR = 1e-2
"""From this error on Newton's method on the constraints that look active is tried: it mostly ends at the optimum."""
AGAIN = 5.0
"""Where it did not, it is tried again when the error is smaller by this factor."""
STEPS, CHANGES = 12, 6
"""Steps of Newton's method, and changes of the active constraints in each of them."""
FAR = 20.0
"""A step that multiplies the error by this was not a step to the optimum."""
EVEN = 8
"""Times that rows and columns of a system are brought to like size (Ruiz, RAL-TR-2001-034)."""
MOST = 200
"""Rounds of the interior-point method; some ten are the rule."""


@dataclass
class ConeProblem:
    """min ½|B w + b|² + t  with  |E_k w + e_k| <= h_k + f_k t, w = to_w z; without t where all f are zero."""

    e: Complex
    offset: Complex
    rounding: float
    """The possible error of the largest e."""
    h: Real
    f: Real
    square: Complex | None
    at: Complex | None
    to_w: Complex
    cut: float
    """The share of the largest singular value of a step's equations below which one is none."""

    def __post_init__(self) -> None:
        self.with_t = bool(self.f.any())
        self.rows = self.e @ self.to_w
        self.adjoint = self.rows.conj().T
        self.squares = None if self.square is None else np.concatenate(real_rows(self.square @ self.to_w))
        self.own = None if self.squares is None else self.squares.T @ self.squares

    def values(self, w: Complex, t: float) -> tuple[Complex, Real]:
        """Return E w + e and h + f t, each (k,)."""
        return self.offset + self.e @ w, self.h + self.f * t

    def left(self, w: Complex) -> Real:
        """Return the real and imaginary parts of B w + b."""
        assert self.square is not None
        assert self.at is not None
        return _parts(self.at + self.square @ w)


def _parts(z: Complex) -> Real:
    return np.concatenate([z.real, z.imag])


def real_rows(e: Complex) -> tuple[Real, Real]:
    """Return the rows of Re(E z) and Im(E z) over (Re z, Im z)."""
    return np.concatenate([e.real, -e.imag], axis=1), np.concatenate([e.imag, e.real], axis=1)


def solve(problem: ConeProblem) -> tuple[Complex, Complex]:
    """Return the step w (p,) and the dual forces of the cones, complex (k,): the best point that was reached.

    In the standard form min ½|Bx + b|² + cᵀx, Gx + s = h, s in the cones, dual z in the cones, with
    s_k = (h_k + f_k t, Re, Im of E_k z + e_k). Each step solves the least-squares form of

        (BᵀB + GᵀW⁻²G) dx = ...      by  R of the rows [B; W⁻¹G],

    so that the squared matrix is never formed.
    """
    path = _Path(problem)
    best, stalled, near = path.point, 0, NEAR
    polished: list[_Polished] = []
    for _ in range(MOST):
        point = path.point
        stalled = 0 if point.error < 0.99 * best.error else stalled + 1
        if point.error < best.error:
            best = point
        if point.error < 1e-13 or stalled >= 8:
            break
        if point.error < near:
            polished.append(_polish(problem, point))
            if polished[-1].optimal:
                break
            near = point.error / AGAIN
        if not path.advanced():
            break
    if not polished or not polished[-1].optimal:
        polished.append(_polish(problem, best))
    nearest = min(polished, key=lambda each: each.away)
    return nearest.w, nearest.force


class _Polished(NamedTuple):
    """The nearest point of Newton's method, how far it is from the optimum, and whether that is rounding."""

    away: float
    optimal: bool
    w: Complex
    force: Complex


class _Point(NamedTuple):
    """Unknowns x (n,), s and z side by side (3, 2k), and how far they are from the optimum."""

    x: Real
    pair: Real
    error: float


class _Path:
    """Steps of the interior-point method: all cones side by side, their components one after the other.

    Rows of one dimension are what numpy is fast with: s and z, and directions of both, are (3, 2k).
    """

    def __init__(self, problem: ConeProblem) -> None:
        k, p = problem.e.shape
        with_t, n = problem.with_t, 2 * p + problem.with_t
        self.k, self.half = k, 2 * p
        offset = problem.offset
        g = np.zeros((3, k, n))
        g[1, :, : 2 * p], g[2, :, : 2 * p] = (-part for part in real_rows(problem.rows))
        self.c, self.x = np.zeros(n), np.zeros(n)
        if with_t:
            g[0, :, -1] = -problem.f
            self.c[-1] = 1.0
            self.x[-1] = 1.2 * max(float(np.abs(offset[problem.f > 0]).max()), 1e-300) + 1e-3
        self.g, self.flat = g.transpose(1, 0, 2), g.reshape(3 * k, n)
        self.h = np.concatenate((problem.h, offset.real, offset.imag))
        self.square = problem.squares
        self.at = np.zeros(0) if problem.at is None else _parts(problem.at)
        # the rows [B; W⁻¹G], of which those of B stay as they are
        above = len(self.at)
        self.stack = np.zeros((above + 3 * k, n))
        if self.square is not None:
            self.stack[:above, : 2 * p] = self.square
        self.matrix = self.stack[above:]
        self.cells = self.matrix.reshape(3, k, n).transpose(1, 0, 2)
        self.both, self.frame, self.lam_size = np.empty((3, 2 * k)), np.empty((3, 2 * k)), np.empty(2 * k)

        self.pair = np.zeros((3, 2 * k))
        s, z = self.pair[:, :k], self.pair[:, k:]
        s[:] = (self.h - self.flat @ self.x).reshape(3, k)
        tail = np.hypot(s[1], s[2])
        room = (s[0] - tail) * (s[0] + tail)
        if not with_t and s[0].min() > 0 and room.min() > 0:
            # within all limits: on the central path
            z[:] = s * _MIRROR / room
            z *= 0.5 * float(self.at @ self.at) / k * min(1.0, float(np.sqrt(room.min())))
        else:
            short = tail - s[0]
            s[0] += np.where(short > -1e-2, short + 1.0, 0.0)
            z[0] = 1.0 / max(float(problem.f.sum()), 1.0) if with_t else 1.0
        self._judge()

    @property
    def point(self) -> _Point:
        return _Point(self.x, self.pair, self.error)

    def _judge(self) -> None:
        """Return the residuals of the two equations, and of the gap."""
        s, z = self.pair.reshape(3, 2, -1).swapaxes(0, 1).reshape(2, -1)
        self.rx = z @ self.flat
        self.rx += self.c
        if self.square is not None:
            self.rx[: self.half] += (self.square @ self.x[: self.half] + self.at) @ self.square
        self.rz = self.flat @ self.x
        self.rz += s
        self.rz -= self.h
        self.gap = float(s @ z)
        self.error = max(self.gap, sqrt(self.rx @ self.rx), sqrt(self.rz @ self.rz))

    def advanced(self) -> bool:
        """Take a step: predictor and corrector; False where the point is at the edge of a cone."""
        k, pair = self.k, self.pair
        head, tail = pair[0], np.hypot(pair[1], pair[2])
        size = (head - tail) * (head + tail)
        if not size.min() > 0:
            return False
        # Nesterov-Todd scaling W = β(u uᵀ - J), by the product form of √(s₀² - |s₁|²)
        size = np.sqrt(size)
        unit = pair / size
        of_s, of_z = unit[:, :k], unit[:, k:]
        product = of_s * of_z
        twice = np.sqrt(2 + 2 * (product[0] + product[1] + product[2]))
        u = of_z * _MIRROR
        u += of_s
        u[0] += twice
        u /= np.sqrt(twice * u[0])
        of_s, of_z = size[:k], size[k:]
        scaling = u[:, None] * u
        scaling -= _J
        beta = np.sqrt(of_s / of_z)
        # W⁻¹ = J (W/β) J/β
        inverse = scaling * (_SIGNS / beta)
        scaling *= beta
        # (k, 3, 3)
        scaling, inverse = scaling.transpose(2, 0, 1), inverse.transpose(2, 0, 1)
        np.matmul(inverse, self.g, out=self.cells)
        try:
            r_inverse = np.linalg.inv(triangle(self.stack))
        except np.linalg.LinAlgError:
            return False
        lam, rz_scaled = np.empty((2, 3, k))
        np.matvec(scaling, pair[:, k:].T, out=lam.T)
        np.matvec(inverse, self.rz.reshape(3, k).T, out=rz_scaled.T)
        lam_size, frame, both = self.lam_size, self.frame, self.both
        lam_size[:k] = lam_size[k:] = np.sqrt(of_s * of_z)
        frame[:, :k] = frame[:, k:] = lam * _MIRROR
        frame /= lam_size
        # first straight on, then with what that tells: λ∘(W dz + W⁻¹ds) = λ∘wanted
        self._direct(r_inverse, lam - rz_scaled, 1.0, -lam)
        worst = self._edge()
        alpha = min(1.0, 1 / worst) if worst > 0 else 1.0
        sigma = (1 - alpha) ** 3
        # the second-order term counts as far as the first step goes: else a short step is turned about by it
        ds, dz = both[:, :k], both[:, k:]
        product = ds * dz
        target = ds[0] * dz
        target += dz[0] * ds
        target[0] = product[0] + product[1] + product[2]
        target *= -(alpha**2)
        target[0] += sigma * self.gap / k
        # λ∘u = target, in the cones' product; u takes its place
        product = frame[:, :k] * target
        head = (product[0] + product[1] + product[2]) / lam_size[:k]
        target -= head * lam
        target /= lam[0]
        target[0] = head
        target -= lam
        rz_scaled *= sigma - 1
        rz_scaled -= target
        self._direct(r_inverse, rz_scaled, 1 - sigma, target)
        worst = self._edge()
        alpha = min(1.0, 0.995 / worst) if worst > 0 else 1.0
        self.x = self.x + alpha * self.dx
        both *= alpha
        moved = np.empty((3, 2 * k))
        np.matvec(scaling, ds.T, out=moved[:, :k].T)
        np.matvec(inverse, dz.T, out=moved[:, k:].T)
        moved += pair
        self.pair = moved
        self._judge()
        return True

    def _direct(self, r_inverse: Real, rhs: Real, share: float, wanted: Real) -> None:
        """Solve for a direction in `dx` and, scaled, in `both`: ds, dz."""
        flat = rhs.reshape(-1)
        self.dx = r_inverse.dot((flat.dot(self.matrix) - share * self.rx).dot(r_inverse))
        dz = self.matrix.dot(self.dx)
        dz -= flat
        dz = dz.reshape(3, self.k)
        np.subtract(wanted, dz, out=self.both[:, : self.k])
        self.both[:, self.k :] = dz

    def _edge(self) -> float:
        """One over the largest step for which λ + step·direction stays in the cones; negative: any step."""
        frame, both = self.frame, self.both
        product = both * frame
        first = product[0] + product[1]
        first += product[2]
        part = (first + both[0]) / (frame[0] + 1)
        tail = np.hypot(both[1] + part * frame[1], both[2] + part * frame[2])
        tail -= first
        tail /= self.lam_size
        return float(tail.max())


_MIRROR = np.array([[1.0], [-1.0], [-1.0]])
_SIGNS = (_MIRROR * _MIRROR.T)[:, :, None]
_J = np.diag(_MIRROR[:, 0])[:, :, None]


def _polish(problem: ConeProblem, point: _Point) -> _Polished:
    """Finish by Newton's method on the active constraints ½(|E w + e|² - (h + f t)²) = 0 with multipliers ν.

    It is at the optimum where the conditions of Karush, Kuhn and Tucker, which of a convex problem suffice, hold to rounding.
    """
    p, half, n = problem.e.shape[1], 2 * problem.e.shape[1], len(point.x)
    s, z = np.split(point.pair, 2, axis=1)
    w = problem.to_w @ (point.x[:p] + 1j * point.x[p:half])
    t = float(point.x[-1]) if problem.with_t else 0.0
    # what rounding does to the values of the rows
    rounding = 16 * (problem.rounding + EPS * max(1.0, float((np.abs(problem.e) @ np.abs(w)).max())))
    nu = np.where(_active(s, z), z[0] / s[0], 0.0)
    slope, along = np.zeros(n), np.empty((len(nu), n))
    slope[half:] = 1.0
    best: tuple[float, Complex, Complex] | None = None
    worse, optimal = 0, False
    for _ in range(STEPS):
        value, radius = problem.values(w, t)
        slack = radius - np.abs(value)
        rows = value.conj()[:, None] * problem.rows
        along[:, :p], along[:, p:half] = rows.real, -rows.imag
        if problem.with_t:
            along[:, -1] = -problem.f * radius
        if problem.squares is not None:
            slope[:half] = problem.left(w) @ problem.squares
        gradient = nu.dot(along)
        gradient += slope
        off = float(np.abs(np.concatenate((gradient, nu * slack * radius))).max())
        away = max(off, float(-slack.min()))
        worse = 0 if best is None or away < best[0] else worse + 1
        if best is None or away < best[0]:
            # of large multipliers the pulls are rounded by as much more
            optimal = max(off / max(1.0, float(nu.max())), float(-slack.min())) < rounding
            best = away, w, nu * value
        if away < rounding / 8 or worse > (0 if best[0] < rounding else 3) or away > FAR * best[0]:
            break
        solved = _step(problem, slope, along, -0.5 * slack * (2 * radius - slack), nu, rounding)
        if solved is None:
            break
        moved, nu = solved
        w = w + problem.to_w @ (moved[:p] + 1j * moved[p:half])
        if problem.with_t:
            t += float(moved[half])
    assert best is not None
    away, w, force = best
    return _Polished(away, optimal, w, force)


def _step(
    problem: ConeProblem, slope: Real, along: Real, above: Real, nu: Real, rounding: float
) -> tuple[Real, Real] | None:
    """Return the step (n,) and ν of the quadratic problem with the linear constraints above + along·step <= 0.

    A constraint whose ν becomes negative leaves the active ones, the one that is broken most joins them. None where
    that does not end.
    """
    p, n = problem.e.shape[1], len(slope)
    half = 2 * p
    # of orthonormal coordinates: nothing of κ(α) is squared in it
    upper = np.zeros((n, n))
    weighed = problem.adjoint @ (nu[:, None] * problem.rows)
    upper[:p, :p] = upper[p:half, p:half] = weighed.real
    upper[p:half, :p] = weighed.imag
    upper[:p, p:half] = -weighed.imag
    if problem.with_t:
        upper[half, half] = -float(nu @ (problem.f * problem.f))
    if problem.own is not None:
        upper[:half, :half] += problem.own
    largest = 10 * max(float(nu.max()), 1.0)
    active = nu > 0
    for _ in range(CHANGES):
        chosen = active.nonzero()[0]
        end = n + len(chosen)
        system, rhs = np.zeros((end, end)), np.empty(end)
        part = along[chosen]
        system[:n, :n], system[n:, :n], system[:n, n:] = upper, part, part.T
        rhs[:n], rhs[n:] = slope, above[chosen]
        solution = _consistent(system, -rhs, largest, problem.cut)
        if not np.isfinite(solution).all():
            return None
        moved, pulls = solution[:n], solution[n:]
        if end > n and pulls.min() < 0:
            active[chosen[pulls.argmin()]] = False
            continue
        after = along.dot(moved)
        after += above
        after[chosen] = -1.0
        worst = after.argmax()
        if after[worst] > rounding and end <= 2 * n:
            active[worst] = True
            continue
        pull = np.zeros(len(nu))
        pull[chosen] = pulls
        return moved, pull
    return None


def _active(s: Real, z: Real) -> NDArray[np.bool_]:
    """Whether cones look active: their forces are larger than what is left to their edge."""
    slack = s[0] - np.hypot(s[1], s[2])
    return np.asarray(slack / np.abs(s).max() < z[0] / np.abs(z).max())


def _consistent(system: Real, rhs: Real, largest: float, cut: float) -> Real:
    """Solve a symmetric system; of a singular one (the optimum is not unique) a solution of least norm in like units."""
    try:
        u = np.asarray(np.linalg.solve(system, rhs))
        if np.isfinite(u).all() and np.abs(u).max() <= largest:
            return u
    except np.linalg.LinAlgError:
        pass
    # rows and columns of like size: what is small by its units alone is not cut off
    scale = np.ones(len(rhs))
    for _ in range(EVEN):
        size = np.sqrt(np.abs(scale[:, None] * system * scale).max(axis=1))
        scale /= np.where(size > 0, size, 1.0)
    try:
        return np.asarray(scale * np.linalg.lstsq(scale[:, None] * system * scale, scale * rhs, rcond=cut)[0])
    except np.linalg.LinAlgError:
        return np.full(len(rhs), np.nan)
