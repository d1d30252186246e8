"""Known masses: corrections of many rotors at once; and what a compensated sum costs and saves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from benchmarks.speed.measure import Measurement, measured, peak
from benchmarks.truth.rotors import exact_corrections, off

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


def _error(u: Complex, z: Real, planes: Real, found: Complex) -> float:
    """Return the worst relative error of corrections."""
    true = exact_corrections(u, z, planes)
    return max(off(w, t) / math.hypot(*t) for w, t in zip(found.tolist(), true, strict=True))
