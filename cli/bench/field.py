"""Measured vibration: least squares and minimax against 60 digits and against the dual bound."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from balancing import (
    influence_coefficients,
    influence_from_amplitudes,
    least_squares,
    minimax,
    place_from_stock,
)
from cli.bench.measure import Measurement, measured

Complex = NDArray[np.complex128]

DOMAIN = "field"
EPS = float(np.finfo(float).eps)


def _noise(rng: np.random.Generator, *shape: int) -> Complex:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of corrections from measured vibration."""
    rng = np.random.default_rng(3)
    alpha, v = _noise(rng, 24, 8), _noise(rng, 24)
    yield measured(
        DOMAIN,
        "24 sensors, 8 planes",
        "least squares",
        lambda: least_squares(alpha, v).corrections,
        error=_off_normal(alpha, v),
        aim_ns=60e3,
    )
    yield measured(
        DOMAIN,
        "24 sensors, 8 planes",
        "numpy.linalg.lstsq alone",
        lambda: np.linalg.lstsq(alpha, -v, rcond=None),
    )
    gaps = []
    for _ in range(20):
        fix = minimax(_noise(rng, 24, 8), _noise(rng, 24))
        assert fix.bound is not None
        gaps.append(1 - fix.bound / float(fix.residual_max))
    yield measured(
        DOMAIN, "24 sensors, 8 planes", "minimax", lambda: minimax(alpha, v), error=max(gaps), aim_ns=6e6
    )
    yield measured(DOMAIN, "24 sensors, 8 planes", "minimax, masses limited", lambda: minimax(alpha, v, 0.05))
    for rotors in (1, 100, 10_000) if quick else (1, 100, 10_000, 100_000):
        truth, a = _noise(rng, rotors, 2), _noise(rng, rotors, 2, 2)
        first = -np.matvec(a, truth)
        runs = first[:, None] + np.swapaxes(a, -1, -2)
        on = np.broadcast_to(np.eye(2, dtype=complex), (rotors, 2, 2))

        def both(first: Complex = first, runs: Complex = runs, on: Complex = on) -> Complex:
            return least_squares(influence_coefficients(first, runs, on), first).corrections

        kappa = np.linalg.cond(a)
        error = float((np.abs(both() - truth).max(axis=1) / np.abs(truth).max(axis=1) / kappa).max())
        yield measured(
            DOMAIN, "two planes, two sensors, three runs", "error over κ", both, size=rotors, error=error
        )
    masses = 12.3 * np.exp(2j * np.pi * np.arange(3) / 3)
    reading = np.abs(6.1 + (0.1 + 0.3j) * masses)[:, None]
    found = influence_from_amplitudes([6.1], reading, masses).influence[0]
    yield measured(
        DOMAIN,
        "four-run method",
        "least squares",
        partial(influence_from_amplitudes, [6.1], reading, masses),
        error=abs(found / (0.1 + 0.3j) - 1),
    )
    arms = 2 * np.pi * np.arange(16) / 16
    yield measured(
        DOMAIN,
        "stock of three weights, 16 places",
        "meeting in the middle",
        partial(place_from_stock, 17.3 * np.exp(1j), arms, [1, 2, 5]),
    )


def _off_normal(alpha: Complex, v: Complex) -> float:
    """Return |αᴴ r| / (‖α‖ ‖r‖), which is zero at the least-squares point."""
    r = least_squares(alpha, v).residual
    return float(np.linalg.norm(alpha.conj().T @ r) / np.linalg.norm(alpha, 2) / np.linalg.norm(r))


def _trial_least_squares(rng: np.random.Generator) -> list[tuple[float, float]]:
    p = int(rng.integers(1, 9))
    s = p + int(rng.integers(0, 17))
    kappa = 10.0 ** rng.uniform(0, 8)
    q, _ = np.linalg.qr(_noise(rng, s, p))
    alpha = (
        q * np.geomspace(1, 1 / kappa, p) @ np.linalg.qr(_noise(rng, p, p))[0] * 10.0 ** rng.uniform(-9, 9)
    )
    w = _noise(rng, p) * 10.0 ** rng.uniform(-6, 6)
    found = least_squares(alpha, -(alpha @ w)).corrections
    return [(float(np.abs(found - w).max()), EPS * p * kappa * float(np.abs(w).max()))]


def _trial_minimax(rng: np.random.Generator) -> list[tuple[float, float]]:
    p = int(rng.integers(1, 9))
    s = p + int(rng.integers(1, 17))
    unit = 10.0 ** rng.uniform(-9, 9)
    alpha, v = unit * _noise(rng, s, p), _noise(rng, s)
    fix = minimax(alpha, v)
    assert fix.bound is not None
    largest = float(fix.residual_max)
    return [(max(largest - fix.bound, 0.0), 100 * EPS * largest)]


CAMPAIGNS = {
    "least squares of readings": (
        "rotors that can be balanced, condition numbers 1 … 1e8, units 1e-9 … 1e9",
        _trial_least_squares,
    ),
    "minimax": ("random problems, units 1e-9 … 1e9: the gap to the dual bound", _trial_minimax),
}
