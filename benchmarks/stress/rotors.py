"""Stress of corrections from known masses: cancelling masses, near planes, all scales, against rational numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from benchmarks.stress.pairs import Pairs
from benchmarks.truth.rotors import exact_corrections, off

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _trial(u: Complex, z: Real, planes: Real) -> Pairs:
    fix = correct(u, z, planes)
    true = exact_corrections(u, z, planes)
    errors = [off(w, t) for w, t in zip(fix.unbalance.tolist(), true, strict=True)]
    return list(zip(errors, fix.error_estimate().tolist(), strict=True))


def _masses(rng: np.random.Generator, k: int) -> Complex:
    return np.asarray((rng.normal(size=k) + 1j * rng.normal(size=k)) * 10.0 ** rng.uniform(-2, 2, k))


def _cancelling(rng: np.random.Generator) -> Pairs:
    half = _masses(rng, int(rng.integers(1, 30)))
    left = 10.0 ** rng.uniform(-15, -1)
    u = np.concatenate([half, -half * (1 + left * rng.normal(size=len(half)))])
    z = np.tile(rng.uniform(-1, 2, len(half)), 2)
    return _trial(u, z + left * rng.normal(size=len(z)) * rng.integers(0, 2), np.array([0.0, 1.0]))


def _near_planes(rng: np.random.Generator) -> Pairs:
    k, p = int(rng.integers(1, 12)), int(rng.integers(2, 6))
    planes = rng.uniform(-1, 1) + rng.uniform(-1, 1, p) * 10.0 ** rng.uniform(-15, -1)
    if len(np.unique(planes)) < 2:
        return []
    return _trial(_masses(rng, k), rng.uniform(-2, 2, k), planes)


def _scales(rng: np.random.Generator) -> Pairs:
    k, p = int(rng.integers(1, 12)), int(rng.integers(1, 8))
    mass, length = 10.0 ** rng.uniform(-12, 12, 2)
    return _trial(mass * _masses(rng, k), length * rng.uniform(-1, 2, k), length * rng.uniform(0, 1, p))


CAMPAIGNS = {
    "cancelling unbalances": ("pairs of masses that cancel to 1e-1 … 1e-15", _cancelling),
    "near planes": ("two to five planes 1e-1 … 1e-15 apart", _near_planes),
    "rotor scales": ("masses and lengths of 1e-12 … 1e12, one to seven planes", _scales),
}
