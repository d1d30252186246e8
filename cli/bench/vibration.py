"""Stress of what is found from measured vibration: the program's own bounds against 80 digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing import (
    Balance,
    DependentPlanes,
    DependentTrials,
    influence_coefficients,
    influence_error,
    least_squares,
    minimax,
)
from cli.errors import DataError

try:
    import mpmath as mp
except ImportError:  # an extra of the tests: only campaigns need it
    mp = None

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Pairs = list[tuple[float, float]]

DIGITS = 80


def needed() -> None:
    """DataError where mpmath is missing."""
    if mp is None:
        raise DataError("this campaign needs mpmath: install dalembert with its extra, dalembert[test]")


def exact(array: Any) -> Any:
    """Return numbers, complex or real, as a matrix of mpmath; a vector as a column."""
    rows = array.tolist()
    return mp.matrix([[mp.mpmathify(x) for x in row] for row in rows] if array.ndim == 2 else rows)


def pairs(found: Sequence[Any], true: Sequence[Any], bound: Any) -> Pairs:
    """Return (error, bound) of each number."""
    return [
        (float(abs(mp.mpmathify(f) - t)), float(b))
        for f, t, b in zip(list(found), list(true), list(bound), strict=True)
    ]


def noise(rng: np.random.Generator, *shape: int) -> Complex:
    """Draw complex normal numbers."""
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


def exact_least_squares(a: Any, b: Any) -> Any:
    """Solve A x + b ≈ 0 (the normal equations are harmless in so many digits)."""
    return mp.lu_solve(a, -b) if a.rows == a.cols else mp.lu_solve(a.H * a, -(a.H * b))


# --- least squares ---


def _of_balance(fix: Balance, true: Any) -> Pairs:
    """Corrections and residuals against exact corrections."""
    left = exact(fix.initial) + exact(fix.influence) * true
    return pairs(fix.corrections.tolist(), true, fix.error_estimate()) + pairs(
        fix.residual.tolist(), left, fix.error_estimate("residual")
    )


def _least_squares(a: Complex, b: Complex, weights: Real | None = None, ridge: float = 0.0) -> Pairs:
    needed()
    try:
        fix = least_squares(a, b, weights, ridge=ridge)
    except DependentPlanes:
        return []
    with mp.workdps(DIGITS):
        m, v = exact(a), exact(b)
        if weights is not None:
            for i, w in enumerate(weights.tolist()):
                m[i, :] *= mp.sqrt(w)
                v[i] *= mp.sqrt(w)
        if ridge:
            rows, planes = m.rows, m.cols
            m, v = _below(m, planes), _below(v, planes)
            for p in range(planes):
                m[rows + p, p] = ridge * mp.norm(m[:rows, p])
        return _of_balance(fix, exact_least_squares(m, v))


def _below(matrix: Any, rows: int) -> Any:
    """Return a matrix with rows of zeros below it."""
    out = mp.zeros(matrix.rows + rows, matrix.cols)
    out[: matrix.rows, :] = matrix
    return out


def _dependent(rng: np.random.Generator, sensors: int, planes: int, depth: float) -> Complex:
    """Draw coefficients whose last plane is nearly a combination of the others."""
    a = noise(rng, sensors, planes)
    if planes > 1:
        a[:, -1] = a[:, :-1] @ noise(rng, planes - 1) + 10.0 ** rng.uniform(-depth, 0) * a[:, -1]
    return a


def _near_dependent(rng: np.random.Generator) -> Pairs:
    planes = int(rng.integers(1, 5))
    sensors = planes + int(rng.integers(0, 5))
    a = _dependent(rng, sensors, planes, 10)
    b = a @ noise(rng, planes) * (1 + 10.0 ** rng.uniform(-16, 0) * rng.normal(size=sensors))
    return _least_squares(a, b)


def _wide(rng: np.random.Generator) -> Pairs:
    planes = int(rng.integers(1, 5))
    sensors = planes + int(rng.integers(0, 5))
    a = _dependent(rng, sensors, planes, 6)
    a = a * 10.0 ** rng.uniform(-12, 12, planes) * 10.0 ** rng.uniform(-6, 6, (sensors, 1))
    b = (
        a
        @ (noise(rng, planes) / np.abs(a).max(axis=0))
        * (1 + 10.0 ** rng.uniform(-8, 0) * noise(rng, sensors))
    )
    weights = 10.0 ** rng.uniform(-4, 4, sensors) if rng.random() < 0.3 else None
    return _least_squares(a, b, weights, float(10.0 ** rng.uniform(-4, 0)) if rng.random() < 0.2 else 0.0)


# --- influence coefficients ---


def _trial_runs(rng: np.random.Generator) -> Pairs:
    """Masses put on, left on, several in a run, changes of the reading down to 1e-12 of it, units 1e-12 … 1e12."""
    needed()
    planes, sensors = int(rng.integers(1, 5)), int(rng.integers(1, 5))
    runs = planes + int(rng.integers(0, 3))
    added = noise(rng, runs, planes) * (rng.random((runs, planes)) < 0.4)
    added[np.arange(planes), np.arange(planes)] += 1
    kept = rng.random(runs) < 0.5
    on, standing = added.copy(), np.zeros(planes, dtype=complex)
    for j in range(runs):
        on[j] += standing
        if kept[j]:
            standing = on[j].copy()
    on *= 10.0 ** rng.uniform(-12, 12) * 10.0 ** rng.uniform(-2, 2, planes)
    unit = 10.0 ** rng.uniform(-12, 12)
    v0 = unit * noise(rng, sensors)
    change = noise(rng, runs, sensors) * unit * 10.0 ** rng.uniform(-12, 1)
    v = v0 + change
    try:
        found = influence_coefficients(v0, v, on)
    except DependentTrials:
        return []
    bound = influence_error(v0, v, on)
    out: Pairs = []
    with mp.workdps(DIGITS):
        t = exact(on)
        for s in range(sensors):
            rise = mp.matrix([mp.mpmathify(x) - mp.mpmathify(complex(v0[s])) for x in v[:, s].tolist()])
            out += pairs(found[s].tolist(), exact_least_squares(t, -rise), bound[s])
    return out


# --- minimax and limits ---


def optimum(fix: Balance) -> Any:
    """Return the true optimum in many digits by Newton's method on its conditions; None if they do not hold there.

    Of a convex problem any point is the optimum at which the conditions hold: the active rows at their limits, their
    multipliers positive, the others within.
    """
    alpha, v, w = fix.influence, fix.initial, fix.corrections
    planes = len(w)
    weight = np.ones(len(v)) if fix.weights is None else fix.weights
    with_t = fix.bound is not None
    rows: list[tuple[list[Any], Any, Any]] = []  # row, offset, limit (None: t)
    if with_t:
        t0 = float((weight * np.abs(fix.residual)).max())
        for s in range(len(v)):
            if np.abs(alpha[s]).max() > 0 and weight[s] * abs(fix.residual[s]) > t0 * (1 - 1e-8):
                scaled = [mp.mpmathify(x) * mp.mpf(weight[s]) for x in (*alpha[s].tolist(), complex(v[s]))]
                rows.append((scaled[:-1], scaled[-1], None))
    elif fix.max_residual is not None:
        for s in np.flatnonzero(np.abs(fix.residual) > fix.max_residual * (1 - 1e-8)).tolist():
            limit = mp.mpf(float(fix.max_residual[s]))
            rows.append(
                (
                    [mp.mpmathify(x) / limit for x in alpha[s].tolist()],
                    mp.mpmathify(complex(v[s])) / limit,
                    mp.mpf(1),
                )
            )
    if fix.max_mass is not None:
        for p in np.flatnonzero(np.abs(w) > fix.max_mass * (1 - 1e-8)).tolist():
            row = [mp.mpf(0)] * planes
            row[p] = 1 / mp.mpf(float(fix.max_mass[p]))
            rows.append((row, mp.mpf(0), mp.mpf(1)))
    n, m = 2 * planes + with_t, len(rows)
    x = [mp.mpf(float(part)) for part in (*w.real, *w.imag)] + ([mp.mpf(t0)] if with_t else [])
    square = None
    if not with_t:
        roots = [mp.sqrt(mp.mpf(float(u))) for u in weight]
        square = [
            ([mp.mpmathify(z) * r for z in row.tolist()], mp.mpmathify(complex(b)) * r)
            for row, b, r in zip(alpha, v, roots, strict=True)
        ]
    mu: Any = None
    for _ in range(12):
        z = [mp.mpc(x[p], x[planes + p]) for p in range(planes)]
        slope, hessian = [mp.mpf(0)] * n, mp.zeros(n)
        if with_t:
            slope[-1] = mp.mpf(1)
        for row, b in square or ():
            value = b + mp.fdot(row, z)
            pull = [mp.conj(e) * value for e in row]
            re = [e.real for e in row] + [-e.imag for e in row]
            im = [e.imag for e in row] + [e.real for e in row]
            for i in range(2 * planes):
                slope[i] += pull[i].real if i < planes else pull[i - planes].imag
                for j in range(i + 1):
                    hessian[i, j] += re[i] * re[j] + im[i] * im[j]
        gradient, gap, across = [], [], []
        for row, b, limit in rows:
            value = b + mp.fdot(row, z)
            size = abs(value)
            u = mp.conj(value / size)
            turned = [u * e for e in row]
            gradient.append(
                [e.real for e in turned]
                + [-e.imag for e in turned]
                + ([mp.mpf(-1 if limit is None else 0)] if with_t else [])
            )
            across.append(([e.imag for e in turned] + [e.real for e in turned], size))
            gap.append(size - (x[-1] if limit is None else limit))
        if mu is None:  # the multipliers that go best with the point
            if m == 0:
                mu = []
            else:
                try:
                    mu = _multipliers(alpha * weight[:, None] ** 0.5, fix.max_mass, gradient, slope)
                except ZeroDivisionError:
                    return None
        for k, (row, size) in enumerate(across):
            for i in range(2 * planes):
                for j in range(i + 1):
                    hessian[i, j] += mu[k] / size * row[i] * row[j]
        system, rhs = mp.zeros(n + m), mp.zeros(n + m, 1)
        for i in range(n):
            for j in range(i + 1):
                system[i, j] = system[j, i] = hessian[i, j]
            for k in range(m):
                system[i, n + k] = system[n + k, i] = gradient[k][i]
            rhs[i] = -slope[i]
        for k in range(m):
            rhs[n + k] = -gap[k]
        try:
            step = mp.lu_solve(system, rhs)
        except ZeroDivisionError:
            return None
        x = [a + step[i] for i, a in enumerate(x)]
        mu = [step[n + k] for k in range(m)]
        if max(abs(step[i]) for i in range(2 * planes)) < mp.mpf(10) ** -35 * max(map(abs, x[: 2 * planes])):
            break
    else:
        return None
    if any(value <= 0 for value in mu):
        return None
    return mp.matrix([mp.mpc(x[p], x[planes + p]) for p in range(planes)])


def _multipliers(a: Complex, limit: Real | None, gradient: list[list[Any]], slope: list[Any]) -> list[Any]:
    """Return the multipliers that go best with a point, in orthonormal coordinates, where no plane outweighs others."""
    planes = a.shape[1]
    rows = np.concatenate([a / np.abs(a).max(), np.diag(np.zeros(planes) if limit is None else 1 / limit)])
    scale = np.abs(rows).max(axis=0)
    undo = exact(np.diag(1 / scale) @ np.linalg.inv(np.linalg.qr(rows / scale)[1]))

    def turned(row: list[Any]) -> list[Any]:
        down = mp.matrix([mp.mpc(row[p], row[planes + p]) for p in range(planes)])
        z = undo.H * down
        return [value.real for value in z] + [value.imag for value in z] + row[2 * planes :]

    g = mp.matrix([turned(row) for row in gradient])
    return list(mp.lu_solve(g * g.T, -(g * mp.matrix(turned(slope)))))


def _of_optimum(fix: Balance) -> Pairs:
    """Corrections and residuals against the true optimum; where it is not found, minimax by its dual bound."""
    out: Pairs = []
    with mp.workdps(DIGITS):
        true = optimum(fix)
        if true is None:
            return out
        out += _of_balance(fix, true)
        if fix.bound is not None:
            weight = np.ones(len(fix.initial)) if fix.weights is None else fix.weights
            left = exact(fix.initial) + exact(fix.influence) * true
            best = max(abs(r) * mp.mpf(float(w)) for r, w in zip(left, weight, strict=True))
            if fix.weights is None:
                bound = float(fix.error_estimate("residual_max"))
                out += pairs([fix.residual_max], [best], [bound])
                # no corrections leave less than the dual bound: it may lie above the optimum by rounding alone
                out.append((float(max(mp.mpf(fix.bound) - best, 0)), bound))
    return out


def _problem(rng: np.random.Generator) -> tuple[Complex, Complex, Real | None]:
    planes = int(rng.integers(1, 4))
    sensors = planes + int(rng.integers(1, 6))
    a = _dependent(rng, sensors, planes, 6)
    v = noise(rng, sensors)
    mass, unit = 10.0 ** rng.uniform(-12, 12, 2)
    weights = 10.0 ** rng.uniform(-1, 1, sensors) if rng.random() < 0.2 else None
    return a * unit / mass, v * unit, weights


def _minimax(rng: np.random.Generator) -> Pairs:
    needed()
    a, v, weights = _problem(rng)
    return _of_optimum(minimax(a, v, weights=weights))


def _limited(rng: np.random.Generator) -> Pairs:
    needed()
    a, v, weights = _problem(rng)
    free = np.abs(least_squares(a, v).corrections)
    limit = free * 10.0 ** rng.uniform(-1.5, 0.3, len(free))
    if rng.random() < 0.3:
        limit[rng.integers(len(limit))] = np.inf
    kind = rng.random()
    if kind < 0.5:
        fix = least_squares(a, v, weights, max_mass=limit)
    elif kind < 0.8:
        fix = minimax(a, v, limit, weights=weights)
    else:
        best, least = minimax(a, v).residual_max, least_squares(a, v).residual_max
        ceiling = float(best + (least - best) * rng.uniform(0.05, 0.95))
        fix = least_squares(a, v, weights, max_residual=ceiling)
    return _of_optimum(fix)


CAMPAIGNS = {
    "least squares, near-dependent planes": (
        "planes that depend on each other but for 1 … 1e-10",
        _near_dependent,
    ),
    "least squares, wide scales": ("rows of 1e-6 … 1e6, columns of 1e-12 … 1e12, weights, damping", _wide),
    "influence coefficients": (
        "trial masses kept and several at once, changes of 10 … 1e-12 of the reading, scales 1e-12 … 1e12",
        _trial_runs,
    ),
    "minimax": ("against the true optimum: planes dependent but for 1 … 1e-6, scales 1e-12 … 1e12", _minimax),
    "limited masses and residuals": ("the same under limits, least squares and minimax", _limited),
}
