"""Stress of what is found from measured vibration: the program's own bounds against 80 digits."""

from __future__ import annotations

from typing import Any

import mpmath as mp
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
from benchmarks.stress.pairs import Pairs, noise, pairs
from benchmarks.truth.vibration import DIGITS, exact, exact_least_squares, optimum

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


# --- least squares ---


def _of_balance(fix: Balance, true: Any) -> Pairs:
    """Corrections and residuals against exact corrections."""
    left = exact(fix.initial) + exact(fix.influence) * true
    return pairs(fix.corrections.tolist(), true, fix.error_estimate()) + pairs(
        fix.residual.tolist(), left, fix.error_estimate("residual")
    )


def _least_squares(a: Complex, b: Complex, weights: Real | None = None, ridge: float = 0.0) -> Pairs:
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


def _of_optimum(fix: Balance) -> Pairs:
    """Corrections and residuals against the true optimum; where it is not found, minimax by its dual bound."""
    out: Pairs = []
    with mp.workdps(DIGITS):
        true = optimum(fix)
        if true is None:
            return out
        out += _of_balance(fix, true)
        if fix.of_largest and fix.bound is not None:
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
    a, v, weights = _problem(rng)
    return _of_optimum(minimax(a, v, weights=weights))


def _limited(rng: np.random.Generator) -> Pairs:
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
