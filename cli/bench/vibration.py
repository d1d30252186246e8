"""Stress of least squares: nearly dependent planes, weights and scales, against 60 digits."""

from __future__ import annotations

import numpy as np

from balancing import DependentPlanes, least_squares
from cli.errors import DataError

try:
    import mpmath as mp
except ImportError:  # an extra of the tests: only campaigns need it
    mp = None


def _trial(rng: np.random.Generator) -> list[tuple[float, float]]:
    if mp is None:
        raise DataError("this campaign needs mpmath: install dalembert with its extra, dalembert[test]")
    planes = int(rng.integers(1, 5))
    sensors = planes + int(rng.integers(0, 5))
    a = rng.normal(size=(sensors, planes)) + 1j * rng.normal(size=(sensors, planes))
    if planes > 1:  # the last plane nearly a combination of the others
        mix = rng.normal(size=planes - 1)
        a[:, -1] = a[:, :-1] @ mix + 10.0 ** rng.uniform(-10, 0) * a[:, -1]
    a = a * 10.0 ** rng.uniform(-6, 6, planes) * 10.0 ** rng.uniform(-2, 2, (sensors, 1))
    b = (
        a
        @ (rng.normal(size=planes) + 1j * rng.normal(size=planes))
        * (1 + 10.0 ** rng.uniform(-8, 0) * rng.normal(size=sensors))
    )
    try:
        fix = least_squares(a, b)
    except DependentPlanes:
        return []
    with mp.workdps(60):
        m = mp.matrix(a.tolist())
        true = mp.lu_solve(m.H * m, -(m.H * mp.matrix([[x] for x in b.tolist()])))
        errors = [float(abs(mp.mpc(complex(w)) - true[i])) for i, w in enumerate(fix.corrections)]
    return list(zip(errors, fix.error_estimate().tolist(), strict=True))


CAMPAIGNS = {"least squares": ("nearly dependent planes, rows and columns of 1e-6 … 1e6", _trial)}
