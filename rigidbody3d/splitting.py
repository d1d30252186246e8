"""A heavy symmetric top by splitting: exact free rotation and the exact kick of the weight, composed to order six.

A symplectic map, whose energy error does not grow with time.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# W. Kahan and R.-C. Li, Math. Comp. 66 (1997) 1089-1099: nine symmetric stages, order six
_STAGES = (
    0.39216144400731413928,
    0.33259913678935943860,
    -0.70624617255763935981,
    0.082213596293550800230,
    0.79854399093482996340,
)
STAGES = _STAGES + _STAGES[-2::-1]


def check_steps(planned: float, most: float) -> None:
    """Raise ValueError where an integration would take too many steps."""
    if planned > most:
        raise ValueError(
            f"the integration would take some {planned:.1g} steps, more than {most:.0e}: expected a shorter time "
            "or a slower rotation"
        )


def split(
    I1: float,
    I3: float,
    mgl: float,
    H0: Array,
    q0: Array,
    time: Array,
    per_turn: float,
    refine: int,
    most: float,
) -> tuple[Array, Array, int]:
    """Return momentum (n, 3) and attitude (n, 4) in space at each time, and the number of stages."""
    rate = max(float(np.linalg.norm(H0)) / min(I1, I3), math.sqrt(abs(mgl) / I1))
    longest = 2 * math.pi / rate / per_turn if rate else math.inf
    check_steps(float(np.abs(time).max(initial=0.0)) / longest, most)
    H, q = np.empty((len(time), 3)), np.empty((len(time), 4))
    count = 0
    for sign in (1.0, -1.0):
        state, now = [*H0.tolist(), *q0.tolist()], 0.0
        side = np.flatnonzero(time >= 0) if sign > 0 else np.flatnonzero(time < 0)
        for index in side[np.argsort(np.abs(time[side]), kind="stable")]:
            gap = float(time[index]) - now
            steps = refine * math.ceil(abs(gap) / longest) if gap else 0
            for _ in range(steps):
                for stage in STAGES:
                    _free_and_kick(state, stage * gap / steps, I1, I3, mgl)
                # a length that drifts by rounding would turn the body too far
                length = math.sqrt(sum(x * x for x in state[3:]))
                state[3:] = [x / length for x in state[3:]]
            count += steps * len(STAGES)
            now = float(time[index])
            H[index], q[index] = state[:3], state[3:]
    return H, q, count


def _free_and_kick(state: list[float], h: float, I1: float, I3: float, mgl: float) -> None:
    """Half a kick, a free rotation exp(H h/I1) q exp(e3 (1/I3 - 1/I1) H3 h), half a kick."""
    X, Y, Z, w, x, y, z = state
    # half of 2·mgl·h
    k = h * mgl
    X, Y = X - k * (y * z - w * x), Y + k * (x * z + w * y)
    axis = 2 * (x * z + w * y) * X + 2 * (y * z - w * x) * Y + (w * w - x * x - y * y + z * z) * Z
    size = math.sqrt(X * X + Y * Y + Z * Z)
    half = size * h / I1 / 2
    c = math.cos(half)
    s = math.sin(half) / size if size else 0.0
    p, q, r = s * X, s * Y, s * Z
    w, x, y, z = (
        c * w - p * x - q * y - r * z,
        c * x + p * w + q * z - r * y,
        c * y + q * w + r * x - p * z,
        c * z + r * w + p * y - q * x,
    )
    own = axis * h * (I1 - I3) / (I1 * I3) / 2
    c, s = math.cos(own), math.sin(own)
    w, x, y, z = c * w - s * z, c * x + s * y, c * y - s * x, c * z + s * w
    X, Y = X - k * (y * z - w * x), Y + k * (x * z + w * y)
    state[:] = X, Y, Z, w, x, y, z
