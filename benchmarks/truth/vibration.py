"""What is found from measured vibration, in 80 digits: least squares, the minimax optimum, the four-run fit."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from balancing import Balance

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

DIGITS = 80


def exact(array: Any) -> Any:
    """Return numbers, complex or real, as a matrix of mpmath; a vector as a column."""
    rows = array.tolist()
    return mp.matrix([[mp.mpmathify(x) for x in row] for row in rows] if array.ndim == 2 else rows)


def exact_least_squares(a: Any, b: Any) -> Any:
    """Solve A x + b ≈ 0 (the normal equations are harmless in so many digits)."""
    return mp.lu_solve(a, -b) if a.rows == a.cols else mp.lu_solve(a.H * a, -(a.H * b))


def optimum(fix: Balance) -> Any:
    """Return the true optimum in many digits by Newton's method on its conditions; None if they do not hold there.

    Of a convex problem any point is the optimum at which the conditions hold: the active rows at their limits, their
    multipliers positive, the others within.
    """
    alpha, v, w = fix.influence, fix.initial, fix.corrections
    planes = len(w)
    weight = np.ones(len(v)) if fix.weights is None else fix.weights
    with_t = fix.of_largest
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


def nearest_fit(near: complex, first: float, read: list[float], t: list[complex]) -> tuple[Any, Any]:
    """Return the least-squares coefficient next to one, and its misfit, by Newton's method."""
    o, a = mp.mpf(first), mp.mpmathify(near)
    for _ in range(20):
        g, h = mp.zeros(2, 1), mp.zeros(2)
        cost = mp.mpf(0)
        for r, m in zip(read, map(mp.mpmathify, t), strict=True):
            y = o + a * m
            size = abs(y)
            slope = mp.conj(y / size) * m
            f = size - mp.mpf(r)
            j, across = (slope.real, -slope.imag), (slope.imag, slope.real)
            cost += f * f
            for i in range(2):
                g[i] += j[i] * f
                for k in range(2):
                    h[i, k] += j[i] * j[k] + f / size * across[i] * across[k]
        step = mp.lu_solve(h, g)
        move = mp.mpc(step[0], step[1])
        a -= move
        if abs(move) < mp.mpf(10) ** (-DIGITS // 2) * abs(a):
            return a, mp.sqrt(cost / len(read))
    return None, None
