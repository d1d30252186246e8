"""What a step must not pass: ends of a motion, kinks of what acts."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from virtualwork.formulas.numbers import EPS

Floats = list[float]
Value = Callable[[float, Floats, Floats], float]
Rate = Callable[[float, Floats, Floats, Floats], float]
"""A quantity at a state (t, q, q̇), and its derivative in time, of (t, q, q̇, rates)."""
Levels = Mapping[int, float]
"""An input's number → its value that ends the motion."""


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
    """A quantity that must not pass a level within a step: the step ends there (`meeting`).

    `levels` rise, and repeat after `period` where it is given; `rate` is the quantity's derivative in time, where it is
    known. Where the watch `ends` the path, the level is met to rounding; else nearly, for it is a kink of what acts.

    `side` is that of the level on which the quantity lies until then, 1 above it and −1 below; 0 where the quantity
    itself says so at the beginning of a step. A quantity that is `linear` in (t, q, q̇) has a polynomial of its own.
    Of a quantity that begins at its level no sign counts that is within `noise`, or so little of what it comes to. Where it only comes near the level, by no more than `touch`, and turns back, it meets it too.
    """

    name: str
    value: Value
    rate: Rate | None
    levels: Sequence[float]
    period: float | None = None
    ends: bool = False
    side: int = 0
    linear: bool = False
    touch: float = 0.0
    noise: float = 0.0

    def inside(self, low: float, high: float) -> list[float]:
        """The levels between two values."""
        if self.period is None:
            return list(self.levels[bisect_left(self.levels, low) : bisect_right(self.levels, high)])
        first = math.floor((low - self.levels[0]) / self.period)
        last = math.floor((high - self.levels[0]) / self.period)
        shifts = (turn * self.period for turn in range(first, last + 1))
        return [x + shift for shift in shifts for x in self.levels if low <= x + shift <= high]


def sign(x: float) -> int:
    """The sign of a number: 1, −1 or 0."""
    return int(x > 0) - int(x < 0)


def noise(level: float, scale: Any) -> Any:
    """How near its level rounding lets an input lie that is on it; `scale` is what its errors are relative to."""
    return 4 * EPS * np.maximum(abs(level), scale)
