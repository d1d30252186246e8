"""Stress of free rotation: nearly symmetric, flat and separatrix bodies, against a Taylor series of 40 digits."""

from __future__ import annotations

from typing import Any

import numpy as np

from cli.errors import DataError
from rigidbody3d import FreeBody

try:
    import mpmath as mp
except ImportError:  # an extra of the tests: only campaigns need it
    mp = None


def taylor_step(inertia: list[Any], state: list[Any], h: Any, order: int) -> list[Any]:
    """Advance Euler's equations and q' = q·(0, ω)/2 by the power series of both; (ω, q) -> (ω, q)."""
    i1, i2, i3 = inertia
    rate = [(i2 - i3) / i1, (i3 - i1) / i2, (i1 - i2) / i3]
    c = [[x] for x in state]

    def product(x: list[Any], y: list[Any], n: int) -> Any:
        return mp.fdot(x[: n + 1], y[n::-1])

    for n in range(order):
        w, q = c[:3], c[3:]
        # all products of order n before anything of order n + 1 is appended
        new = [rate[k] * product(w[(k + 1) % 3], w[(k + 2) % 3], n) for k in range(3)]
        new += [
            (-product(q[1], w[0], n) - product(q[2], w[1], n) - product(q[3], w[2], n)) / 2,
            (product(q[0], w[0], n) + product(q[2], w[2], n) - product(q[3], w[1], n)) / 2,
            (product(q[0], w[1], n) + product(q[3], w[0], n) - product(q[1], w[2], n)) / 2,
            (product(q[0], w[2], n) + product(q[1], w[1], n) - product(q[2], w[0], n)) / 2,
        ]
        for series, value in zip(c, new, strict=True):
            series.append(value / (n + 1))
    return [mp.fsum(x * h**n for n, x in enumerate(series)) for series in c]


def _compare(inertia: list[float], omega: list[float], time: float) -> list[tuple[float, float]]:
    if mp is None:
        raise DataError("this campaign needs mpmath: install dalembert with its extra, dalembert[test]")
    with mp.workdps(40):
        state = [*map(mp.mpf, omega), mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(0)]
        fastest = float(np.linalg.norm(omega)) * max(inertia) / min(inertia)
        steps = max(1, int(np.ceil(time * fastest / 0.5)))
        for _ in range(steps):
            state = taylor_step([mp.mpf(x) for x in inertia], state, mp.mpf(time) / steps, 30)
        found = FreeBody(inertia, omega).at(np.array([time]))
        q = [mp.mpf(float(x)) for x in found.attitude[0]]
        sign = 1 if mp.fdot(q, state[3:]) > 0 else -1
        # the angle between two attitudes is twice that between their quaternions
        angle = 2 * float(mp.sqrt(mp.fsum((sign * x - y) ** 2 for x, y in zip(q, state[3:], strict=True))))
    return [(angle, float(found.error_estimate()[0]))]


def _time(rng: np.random.Generator, omega: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(rng.uniform(0.1, 6) / np.linalg.norm(omega))


def _anybody(rng: np.random.Generator) -> list[tuple[float, float]]:
    scale = 10.0 ** rng.uniform(-9, 9)
    a, b = rng.uniform(0.3, 2, 2)
    c = rng.uniform(max(abs(a - b), 0.3), a + b)
    omega = rng.normal(size=3)
    return _compare((scale * np.array([a, b, c])).tolist(), omega.tolist(), _time(rng, omega))


def _nearly_symmetric(rng: np.random.Generator) -> list[tuple[float, float]]:
    a, c = 1.0, rng.uniform(0.3, 1.9)
    moments = np.array([a, a * (1 + 10.0 ** rng.uniform(-15, -1)), c])
    omega = rng.normal(size=3)
    return _compare(rng.permutation(moments).tolist(), omega.tolist(), _time(rng, omega))


def _nearly_flat(rng: np.random.Generator) -> list[tuple[float, float]]:
    a, b = rng.uniform(0.5, 2, 2)
    moments = np.array([a, b, (a + b) * (1 - 10.0 ** rng.uniform(-15, -1))])
    omega = rng.normal(size=3)
    return _compare(moments.tolist(), omega.tolist(), _time(rng, omega))


CAMPAIGNS = {
    "free bodies": ("random moments and velocities, scale 1e-9 … 1e9", _anybody),
    "nearly symmetric bodies": ("two moments that differ by 1e-1 … 1e-15", _nearly_symmetric),
    "nearly flat bodies": ("the triangle inequality met to 1e-1 … 1e-15", _nearly_flat),
}
