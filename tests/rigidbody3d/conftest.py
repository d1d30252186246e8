"""An independent answer for rotations: Taylor series in integers, some 60 digits, of nothing but the equations of motion."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

BITS = 256
ONE = 1 << BITS


def _fixed(x: float | Fraction) -> int:
    return int((x if isinstance(x, Fraction) else Fraction(float(x))) * ONE)


def _series(a: list[int], b: list[int], k: int) -> int:
    return sum(a[i] * b[k - i] for i in range(k + 1)) >> BITS


def taylor_rotation(inertia, omega, attitude, t, *, gravity=0.0, order=40, reach=0.25):
    """Integrate ω and q with exact doubles as data; `gravity` is the mgl of a top whose axis is body z.

    Returns (omega, attitude) as lists of Fractions. The step is `reach` over |ω|.
    """
    I = [_fixed(x) for x in inertia]
    w = [_fixed(x) for x in omega]
    q = [_fixed(x) for x in attitude]
    mgl = _fixed(gravity)
    rate = max(
        float(np.linalg.norm(omega)), float(np.sqrt(abs(gravity) / min(inertia[:2]))) if gravity else 0.0
    )
    steps = max(1, int(np.ceil(abs(t) * rate / reach)))
    h = int((t if isinstance(t, Fraction) else Fraction(float(t))) / steps * ONE)
    for _ in range(steps):
        W = [[x] for x in w]
        Q = [[x] for x in q]
        for k in range(order):
            M = [0, 0, 0]
            if gravity:  # torque mgl e_z × (-g): body components mgl (2(yz+wx), -2(xz-wy), 0)
                M[0] = mgl * (2 * (_series(Q[2], Q[3], k) + _series(Q[0], Q[1], k))) >> BITS
                M[1] = -mgl * (2 * (_series(Q[1], Q[3], k) - _series(Q[0], Q[2], k))) >> BITS
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                rise = (I[b] - I[c]) * _series(W[b], W[c], k) // ONE + M[a]
                W[a].append(rise * ONE // I[a] // (k + 1))
            x, y, z = W[0], W[1], W[2]
            s = lambda i, v: _series(Q[i], v, k)  # noqa: B023, E731
            for a, rise in enumerate(
                (
                    -s(1, x) - s(2, y) - s(3, z),
                    s(0, x) + s(2, z) - s(3, y),
                    s(0, y) - s(1, z) + s(3, x),
                    s(0, z) + s(1, y) - s(2, x),
                )
            ):
                Q[a].append(rise // 2 // (k + 1))
        w, q = ([_horner(series, h) for series in group] for group in (W, Q))
    return [Fraction(x, ONE) for x in w], [Fraction(x, ONE) for x in q]


def _horner(series: list[int], h: int) -> int:
    total = 0
    for c in reversed(series):
        total = (total * h >> BITS) + c
    return total


@pytest.fixture(scope="session")
def taylor():
    return taylor_rotation
