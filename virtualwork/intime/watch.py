"""What a step must not pass: ends of a motion, kinks of what acts."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from virtualwork.formulas.numbers import EPS, Reals

Floats = list[float]


class Check(Protocol):
    """What is asked at every node of a way through time."""

    def __call__(self, t: float, q: Floats, v: Floats) -> str:
        """Why the way ends here; empty where it goes on."""

    def quiet(self, q: Reals) -> bool:
        """Whether it has nothing to say at any of many places, (n, k), nor has to see them."""


@dataclass
class Watch:
    """A quantity that must not pass a level within a step: the step ends there.

    `levels` rise, and repeat after `period` where it is given; `rate` is the quantity's derivative in time, where it is
    known. Where the watch `ends` the path, the level is met to rounding; else nearly, for it is a kink of what acts.
    """

    name: str
    value: Callable[[float, Floats, Floats], float]
    rate: Callable[[float, Floats, Floats, Floats], float] | None
    levels: Sequence[float]
    period: float | None = None
    ends: bool = False

    def passed(self, before: float, after: float, left: float | None) -> float | None:
        """The first level between two values; not the first value's own, nor that which was left just now."""
        low, high = min(before, after), max(before, after)
        near = 64 * EPS * max(abs(low), abs(high), 1e-3)
        inside = [x for x in self._inside(low, high) if abs(x - before) > near and x != left]
        return min(inside, key=lambda x: abs(x - before), default=None)

    def _inside(self, low: float, high: float) -> list[float]:
        if self.period is None:
            return list(self.levels[bisect_left(self.levels, low) : bisect_right(self.levels, high)])
        first = math.floor((low - self.levels[0]) / self.period)
        last = math.floor((high - self.levels[0]) / self.period)
        shifts = (turn * self.period for turn in range(first, last + 1))
        return [x + shift for shift in shifts for x in self.levels if low <= x + shift <= high]
