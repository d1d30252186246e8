"""The same motion between the poses of a sweep: over the input at its steady rates, over time by its law."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.poses import Poses

# poses of an interval in which a largest value is looked for; intervals that are looked into; rounds at most
INSIDE, LOOKED, ROUNDS = 33, 4, 12
# values whose difference is rounding are one value
ALIKE = 1e-12


class Between:
    """The effort of a motion with one input, at any place of its sweep.

    The place is the time where the poses have one, else the input. Over time the law is the polynomial of degree
    five with the positions, speeds and accelerations of the poses: it is the cubic spline, where they come from one.

    Attributes
    ----------
    poses : Poses
    """

    def __init__(self, poses: Poses) -> None:
        self.poses = poses

    @cached_property
    def place(self) -> Reals:
        """The time or the input of the poses, (n,)."""
        return self.poses.inputs[:, 0] if self.poses.time is None else self.poses.time

    @cached_property
    def defined(self) -> bool:
        """Whether the motion is defined between the poses."""
        speed, acceleration, _ = (rates[0] for rates in self.poses.rates)
        if self.poses.time is None:
            return not (np.ndim(speed) or np.ndim(acceleration))
        return bool(np.ndim(speed) and np.ndim(acceleration))

    @cached_property
    def _law(self) -> tuple[Any, Any, Any]:
        from scipy.interpolate import BPoly

        speed, acceleration, _ = (rates[0] for rates in self.poses.rates)
        law = BPoly.from_derivatives(
            self.place, np.stack([self.poses.inputs[:, 0], speed, acceleration], axis=1)
        )
        return law, law.derivative(), law.derivative(2)

    def at(self, place: Reals) -> Poses:
        """The poses at other places, (m,)."""
        if self.poses.time is None:
            return self.poses.again(place[:, None], self.poses.rates)
        q, speed, acceleration = (of(place) for of in self._law)
        rates: list[list[Number]] = [[speed], [acceleration], [0.0]]
        result = self.poses.again(q[:, None], rates)
        result.time = place
        return result

    def effort(self, place: Reals) -> Reals:
        """The effort by virtual work at other places, (m,)."""
        return Dynamics(self.at(place)).effort[:, 0]

    def power(self, place: Reals) -> Reals:
        """Effort times the input's speed at other places, (m,)."""
        poses = self.at(place)
        return np.asarray(Dynamics(poses).effort[:, 0] * poses.rates[0][0])


def largest(of: Callable[[Reals], Reals], place: Reals, values: Reals) -> tuple[float, float]:
    """The first place of the largest size of a function, and that size, from its values at rising places.

    The intervals beside the largest values are divided until the value stands; the last places are those of the
    parabola's vertex, so that the value is as exact as the function. Of places whose values differ by rounding the first
    counts; the size is the largest of all, no less than any of the values.

    >>> at, peak = largest(np.cos, np.linspace(-1, 1, 4), np.cos(np.linspace(-1, 1, 4)))
    >>> round(at, 7) + 0.0, peak
    (0.0, 1.0)
    """
    size = np.abs(values)
    inner = np.concatenate([[-np.inf], size, [-np.inf]])
    tops = np.flatnonzero((inner[1:-1] >= inner[:-2]) & (inner[1:-1] >= inner[2:]))
    tops = tops[np.argsort(-size[tops], kind="stable")][:LOOKED]
    result = []
    for i in tops.tolist():
        at, value = _within(of, place[max(i - 1, 0)], place[min(i + 1, len(place) - 1)])
        # NaN is not larger
        result.append((at, value) if value > size[i] else (float(place[i]), float(size[i])))
    best = max(value for _, value in result)
    return min(at for at, value in result if value >= best * (1 - ALIKE)), best


def _within(of: Callable[[Reals], Reals], low: float, high: float) -> tuple[float, float]:
    """The place of the largest size between two places, and that size; NaN where the function is not defined throughout."""
    at, best = low, -np.inf
    for _ in range(ROUNDS):
        q = np.linspace(low, high, INSIDE)
        size = np.abs(of(q))
        if not np.isfinite(size).all():
            return at, float(np.nan)
        i = int(np.argmax(size))
        top = float(size[i])
        settled = top <= best * (1 + ALIKE)
        if top > best:
            at, best = float(q[i]), top
        if settled and 0 < i < INSIDE - 1:
            a, b, c = size[i - 1 : i + 2].tolist()
            if (bend := a - 2 * b + c) < 0:
                vertex = float(q[i] + (q[1] - q[0]) * (a - c) / (2 * bend))
                value = float(np.abs(of(np.array([vertex]))[0]))
                return (vertex, value) if value >= best * (1 - ALIKE) else (at, best)
        if settled:
            break
        low, high = float(q[max(i - 1, 0)]), float(q[min(i + 1, INSIDE - 1)])
    return at, best
