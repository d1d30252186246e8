"""Sines and cosines of 256 angles to a turn, to 32 digits: where sine, cosine and arctangent of doubled numbers begin.

The table is worked out on whole numbers, when it is first needed. Row 0 has the sines, row 1 what their floats leave out,
rows 2 and 3 are those of the cosines.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from dalembert.arithmetic.circular import BITS, half_pi
from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.recorded import Real

DIGITS = 200  # binary ones, of the whole numbers
WHOLE = 6755399441055744.0
"""1.5·2⁵²: what is added to it is rounded to a whole number."""
STEPS = 256
"""Angles to a turn."""
STEP = (0.02454369260617026, 9.567553118338697e-19, -2.3396639138424529e-35, 8.691048600495040e-52)
"""The angle between two of them, in four parts; each is the nearest double of what is left."""


@cache
def table() -> np.ndarray:
    """The table, (4, 256)."""
    step = (half_pi() * 4 // STEPS) >> BITS - DIGITS
    quarter = STEPS // 4
    sines = [Doubled.of(Fraction(_sine(k * step), 1 << DIGITS)) for k in range(quarter)] + [Doubled(1.0)]
    rows = np.empty((4, STEPS))
    for k in range(STEPS):
        for row, at in ((0, k), (2, k + quarter)):
            half, within = divmod(at % STEPS, 2 * quarter)
            sine = sines[min(within, 2 * quarter - within)]
            rows[row : row + 2, k] = np.array([sine.high, sine.low]) * (-1.0 if half else 1.0)
    return rows + 0.0


def _sine(x: int) -> int:
    """sin(x/2^DIGITS)·2^DIGITS by its series."""
    total, power, k = 0, x, 1
    while power:
        total += power
        power = -(power * x * x >> 2 * DIGITS) // ((k + 1) * (k + 2))
        k += 2
    return total


def place(shifted: Any) -> Any:
    """Where in the table k is, whole, of k + 1.5·2⁵²: k modulo 256, by the last bits."""
    return np.asarray(shifted, dtype=float).view(np.int64) & STEPS - 1


def entry(row: int, at: Any) -> Any:
    """A row of the table at places."""
    return table()[row][at]


def nearest(angle: Any) -> tuple[Doubled, Doubled, Doubled]:
    """The nearest angle of the table, in steps, its sine and its cosine; of floats, arrays or a recorded number."""
    shifted = angle * (1 / STEP[0]) + WHOLE
    if isinstance(shifted, Real):
        recorder = shifted.recorder
        at = recorder.node("place", shifted.settled)
        rows = [Real(recorder, recorder.node(f"entry{row}", at)) for row in range(4)]
    else:
        rows = [entry(row, place(shifted)) for row in range(4)]
    return Doubled(shifted - WHOLE), Doubled(*rows[:2]), Doubled(*rows[2:])
