"""Known masses: corrections of many rotors at once; and what a compensated sum costs and saves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from functools import partial

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from cli.bench.measure import Measurement, measured, peak

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

DOMAIN = "rotors"


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of two-plane corrections, by numbers of rotors and of planes."""
    rng = np.random.default_rng(7)
    k, planes = 5, np.array([0.0, 0.09])
    for rotors in (1, 10, 100, 1000, 10_000) if quick else (1, 10, 100, 1000, 10_000, 100_000, 1_000_000):
        u = rng.normal(size=(rotors, k)) + 1j * rng.normal(size=(rotors, k))
        z = rng.uniform(0, 0.09, (rotors, k))
        for method, solve in (("compensated", _ours), ("plain sums", _plain)):
            error = max(_error(u[i], z[i], planes, solve(u[i], z[i], planes)) for i in range(min(rotors, 20)))
            call = partial(solve, u, z, planes)
            work, held = "rotors of two planes, 5 masses each", float(peak(call))
            yield measured(DOMAIN, work, method, call, size=rotors, error=error, bytes=held)
    # the same with a rotor that is balanced to 1e-12: where plain sums fail
    u = np.concatenate([u[0, :4], -u[0, :4] * (1 + 1e-12)])
    z = np.tile(z[0, :4], 2)
    for method, solve in (("compensated", _ours), ("plain sums", _plain)):
        yield measured(
            DOMAIN,
            "nearly balanced, 8 masses",
            method,
            partial(solve, u, z, planes),
            error=_error(u, z, planes, solve(u, z, planes)),
        )
    for p in (1, 2, 5, 10, 20, 50):
        places = np.linspace(0.0, 1.0, p)
        u = rng.normal(size=(100, 20)) + 1j * rng.normal(size=(100, 20))
        z = rng.uniform(0, 1, (100, 20))
        call = partial(_ours, u, z, places)
        work, held = "planes of each of 100 rotors, 20 masses", float(peak(call))
        yield measured(DOMAIN, work, "compensated", call, size=p, bytes=held)


def _ours(u: Complex, z: Real, planes: Real) -> Complex:
    return correct(u, z, planes).unbalance


def _plain(u: Complex, z: Real, planes: Real) -> Complex:
    """Riul eqs. (15)-(20) as they stand: moments about A, then forces by difference."""
    a, b = planes
    in_b = -(u * (z - a)).sum(axis=-1) / (b - a)
    return np.stack([-u.sum(axis=-1) - in_b, in_b], axis=-1)


def exact_corrections(moment: Complex, z: Real, planes: Real) -> list[tuple[Fraction, Fraction]]:
    """Solve min Σ|W|² under Σ U + Σ W = 0, Σ U z + Σ W z_p = 0 in rational numbers (one plane: the first only)."""
    p = [Fraction(x) for x in planes.tolist()]
    parts = []
    for part in (moment.real, moment.imag):
        u = [Fraction(x) for x in part.tolist()]
        force = sum(u)
        if len(p) == 1:
            parts.append([-force])
            continue
        couple = sum(a * Fraction(b) for a, b in zip(u, z.tolist(), strict=True))
        # the multipliers of the two conditions: W_p = a + b z_p
        n, s, q = Fraction(len(p)), sum(p), sum(x * x for x in p)
        a = (-force * q + couple * s) / (n * q - s * s)
        b = (-couple * n + force * s) / (n * q - s * s)
        parts.append([a + b * x for x in p])
    return list(zip(*parts, strict=True))


def off(found: complex, true: tuple[Fraction, Fraction]) -> float:
    """Return the distance of a complex double from an exact complex number."""
    return math.hypot(Fraction(found.real) - true[0], Fraction(found.imag) - true[1])


def _error(u: Complex, z: Real, planes: Real, found: Complex) -> float:
    """Return the worst relative error of corrections."""
    true = exact_corrections(u, z, planes)
    return max(off(w, t) / math.hypot(*t) for w, t in zip(found.tolist(), true, strict=True))


def _trial(u: Complex, z: Real, planes: Real) -> list[tuple[float, float]]:
    fix = correct(u, z, planes)
    true = exact_corrections(u, z, planes)
    errors = [off(w, t) for w, t in zip(fix.unbalance.tolist(), true, strict=True)]
    return list(zip(errors, fix.error_estimate().tolist(), strict=True))


def _masses(rng: np.random.Generator, k: int) -> Complex:
    return np.asarray((rng.normal(size=k) + 1j * rng.normal(size=k)) * 10.0 ** rng.uniform(-2, 2, k))


def _cancelling(rng: np.random.Generator) -> list[tuple[float, float]]:
    half = _masses(rng, int(rng.integers(1, 30)))
    left = 10.0 ** rng.uniform(-15, -1)
    u = np.concatenate([half, -half * (1 + left * rng.normal(size=len(half)))])
    z = np.tile(rng.uniform(-1, 2, len(half)), 2)
    return _trial(u, z + left * rng.normal(size=len(z)) * rng.integers(0, 2), np.array([0.0, 1.0]))


def _near_planes(rng: np.random.Generator) -> list[tuple[float, float]]:
    k, p = int(rng.integers(1, 12)), int(rng.integers(2, 6))
    planes = rng.uniform(-1, 1) + rng.uniform(-1, 1, p) * 10.0 ** rng.uniform(-15, -1)
    if len(np.unique(planes)) < 2:
        return []
    return _trial(_masses(rng, k), rng.uniform(-2, 2, k), planes)


def _scales(rng: np.random.Generator) -> list[tuple[float, float]]:
    k, p = int(rng.integers(1, 12)), int(rng.integers(1, 8))
    mass, length = 10.0 ** rng.uniform(-12, 12, 2)
    return _trial(mass * _masses(rng, k), length * rng.uniform(-1, 2, k), length * rng.uniform(0, 1, p))


CAMPAIGNS = {
    "cancelling unbalances": ("pairs of masses that cancel to 1e-1 … 1e-15", _cancelling),
    "near planes": ("two to five planes 1e-1 … 1e-15 apart", _near_planes),
    "rotor scales": ("masses and lengths of 1e-12 … 1e12, one to seven planes", _scales),
}
