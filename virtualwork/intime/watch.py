"""A step, and what it must not pass: ends of a motion, kinks of what acts."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from virtualwork.formulas.numbers import EPS, Number

Floats = list[float]
Several = Sequence[Number]
Value = Callable[[float, Floats, Floats], float]
Rate = Callable[[float, Floats, Floats, Floats], float]
"""A quantity at a state (t, q, q̇), and its derivative in time, of (t, q, q̇, rates)."""
Levels = Mapping[int, float]
"""An input's number → its value that ends the motion."""
# how far a level must be from where a step begins, relative to what is watched, and that at least
APART, SMALL = 64 * EPS, 1e-3
# of a step, at which it is looked whether a level has been passed; halvings of a quarter, and Newton's steps
QUARTERS, HALVINGS, NEWTONS = (0.25, 0.5, 0.75, 1.0), 24, 12


class Step(NamedTuple):
    """Changes of q and q̇, the work, the rates at the end, the errors of (q, q̇) as the method knows them, and h·|λ|."""

    dq: Floats
    dv: Floats
    work: float
    rates: Floats
    errors: tuple[Floats, ...]
    stiffness: float


@dataclass
class Watch:
    """A quantity that must not pass a level within a step: the step ends there.

    `levels` rise, and repeat after `period` where it is given; `rate` is the quantity's derivative in time, where it is
    known. Where the watch `ends` the path, the level is met to rounding; else nearly, for it is a kink of what acts.
    """

    name: str
    value: Value
    rate: Rate | None
    levels: Sequence[float]
    period: float | None = None
    ends: bool = False

    def passed(self, before: float, after: float, left: float | None) -> float | None:
        """The first level between two values; not the first value's own, nor that which was left just now."""
        low, high = min(before, after), max(before, after)
        apart = APART * max(abs(low), abs(high), SMALL)
        inside = [x for x in self._inside(low, high) if abs(x - before) > apart and x != left]
        return min(inside, key=lambda x: abs(x - before), default=None)

    def _inside(self, low: float, high: float) -> list[float]:
        if self.period is None:
            return list(self.levels[bisect_left(self.levels, low) : bisect_right(self.levels, high)])
        first = math.floor((low - self.levels[0]) / self.period)
        last = math.floor((high - self.levels[0]) / self.period)
        shifts = (turn * self.period for turn in range(first, last + 1))
        return [x + shift for shift in shifts for x in self.levels if low <= x + shift <= high]


def between(
    q: Several, v: Several, rates: Several, h: Number, dq: Several, dv: Several, after: Several, share: Number
) -> tuple[list[Number], list[Number]]:
    """A state within a step, roughly: of the polynomial of degree 5 through q, q̇ and q̈ at both ends.

    Of one motion or of many: numbers or arrays. `after` are the rates at the step's end.
    """
    x = share
    places, speeds = [], []
    for a, b, c, d, e, f in zip(q, v, rates, dq, dv, after, strict=False):
        # what is left to fit after the Taylor polynomial of degree 2 at the beginning
        p, r, s = d - h * (b + 0.5 * h * c), h * (e - h * c), h * h * (f - c)
        c3, c4, c5 = 10 * p - 4 * r + 0.5 * s, -15 * p + 7 * r - s, 6 * p - 3 * r + 0.5 * s
        places.append(a + x * (h * b + x * (0.5 * h * h * c + x * (c3 + x * (c4 + x * c5)))))
        speeds.append(b + x * h * c + x * x * (3 * c3 + x * (4 * c4 + x * 5 * c5)) / h)
    return places, speeds
