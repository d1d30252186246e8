"""Stress of steady precession and of the cones of a free symmetric body, against 50 digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np

from benchmarks.stress.pairs import Pairs
from rigidbody3d import cones, steady_precession


def _precession(rng: np.random.Generator) -> Pairs:
    """Steady precession near the least spin that allows it, near the vertical and the right angle; cones too."""
    I1, I3 = 10.0 ** rng.uniform(-12, 12) * rng.uniform(0.1, 1, 2)
    mgl = 10.0 ** rng.uniform(-12, 12)
    tilt = rng.choice([0.0, np.pi / 2]) + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9, 0)
    least = 2 * np.sqrt(I1 * mgl * max(np.cos(tilt), 1e-6)) / I3
    spin = least * (1 + 10.0 ** rng.uniform(-16, 1)) * rng.choice([-1, 1])
    omega = rng.normal(size=3) * 10.0 ** rng.uniform(-9, 9, 3)
    rates, found = steady_precession(I1, I3, mgl, tilt, spin), cones(I1, I3, omega)
    with mp.workdps(50):
        a, b, g, c, w = (
            mp.mpf(float(I1)),
            mp.mpf(float(I3)),
            mp.mpf(mgl),
            mp.cos(mp.mpf(float(tilt))),
            mp.mpf(spin),
        )
        root = (b * w) ** 2 - 4 * a * g * c
        large = b * w + mp.sign(w) * mp.sqrt(max(root, 0))
        x, y, z = map(mp.mpf, omega.tolist())
        across = mp.hypot(x, y)
        true = [
            mp.atan2(abs(a - b) * across * abs(z), a * across**2 + b * z**2),
            mp.atan2(across, abs(z)),
            mp.hypot(across, b * z / a),
            z * (a - b) / a,
        ]
        pairs = [
            (float(abs(mp.mpf(float(f)) - t)), float(e))
            for f, t, e in zip(found, true, found.error_estimate(), strict=True)
        ]
        if root >= 0 and np.isfinite(rates.slow):
            true = [2 * g / large, large / (2 * a * c)]
            pairs += [
                (float(abs(mp.mpf(float(f)) - t)), float(e))
                for f, t, e in zip(rates, true, rates.error_estimate(), strict=True)
            ]
    return pairs


CAMPAIGNS = {
    "steady precession and cones": ("near the least spin, the vertical and the right angle", _precession),
}
