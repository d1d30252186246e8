"""A sweep of one input, or its law over time: the effort between its poses, and whether it is a cycle.

After a cycle pose and loads come back to themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.branch.limits import TURNS
from virtualwork.formulas.dynamics import Dynamics, Moving
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.solving import Solving

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
    poses : Solving
    """

    def __init__(self, poses: Solving) -> None:
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

    def at(self, place: Reals) -> Solving:
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


# the fewest poses of a turn, or of a law of motion, from which mean, work and energy are formed
FINE = 1440
# whole turns, and a law that ends where it begins, as tables have them in six decimals; loads that repeat themselves
ROUNDED, SAME = 1e-6, 1e-9
# poses at which loads are compared with those some turns later
COMPARED = 16


@guarded
@dataclass(frozen=True)
class Sweep:
    """The poses of one input, one after the other.

    Attributes
    ----------
    motion : Motion
        One input. Where its poses have a time (`poses.time`), the sweep is over the time; else over the input.
    """

    motion: Moving

    @property
    def lock(self) -> Lock:
        """That of the poses."""
        return self.motion.dynamics.lock

    @property
    def poses(self) -> Solving:
        """The poses of the sweep."""
        return self.motion.dynamics.poses

    @cached_property
    def between(self) -> Between:
        """The same motion between the poses."""
        return Between(self.poses)

    @cached_property
    def input(self) -> Reals:
        """The input, (n,)."""
        return self.poses.inputs[:, 0]

    @property
    def timed(self) -> bool:
        """Whether the cycle is over time."""
        return self.poses.time is not None

    @cached_property
    def place(self) -> Reals:
        """What the cycle is over, (n,): the time, s, or the input, rad or m."""
        return self.between.place

    @cached_property
    def effort(self) -> Reals:
        """The effort by virtual work, (n,)."""
        return self.motion.dynamics.effort[:, 0]

    @cached_property
    def speed(self) -> Number:
        """The input's speed, one or (n,)."""
        return self.poses.rates[0][0]

    # --- whether it is one ------------------------------------------------------------------------------------------
    @cached_property
    def turns(self) -> int | None:
        """How many whole turns of the input the sweep is; None where it is not a whole number of them, or a slide.

        A law over time that comes back is no turn: 0.
        """
        span = float(self.input[-1] - self.input[0])
        if self.poses.mechanism.inputs[0].is_slide:
            return 0 if self.timed and abs(span) <= ROUNDED * float(np.ptp(self.input)) else None
        turns = round(span / (2 * np.pi))
        within = ROUNDED * max(abs(span), float(np.ptp(self.input)))
        return turns if abs(span - 2 * np.pi * turns) <= within else None

    @cached_property
    def whole(self) -> bool:
        """Whether the sweep is a whole cycle, after which pose and loads come back to themselves."""
        return self.reason is None

    @cached_property
    def reason(self) -> str | None:
        """Why the sweep is no whole cycle, and which would be one; None where it is one."""
        entry = self.poses.mechanism.inputs[0]
        if self.poses.n < 2:
            return "one pose is no cycle: give a sweep over whole turns of the input, 0deg:360deg:1deg"
        if self.timed:
            if self.turns is None:
                return (
                    f"the law of motion does not end where it begins ({self._shown(self.input[0])}, then "
                    f"{self._shown(self.input[-1])}): a cycle over time ends in its first pose"
                )
        elif not ((steps := np.diff(self.input)) > 0).all() and not (steps < 0).all():
            return (
                f"the input {entry.name} does not rise or fall throughout: a cycle that dwells or returns needs a "
                "column time_s with a time for each row"
            )
        elif entry.is_slide:
            return (
                f"one stroke of the slide {entry.name} is no cycle: give its motion there and back as a table over "
                "time (--cases with a column time_s)"
            )
        if self.turns and self._repeats(self.turns):
            return None
        if self.timed and self.turns == 0:
            return None
        return self._turns_needed()

    def _shown(self, q: float) -> str:
        slide = self.poses.mechanism.inputs[0].is_slide
        return f"{q:.6g} m" if slide else f"{np.degrees(q):.6g} deg"

    def _turns_needed(self) -> str:
        """Why a sweep of angles is no whole cycle: it is a part of one, or the loads do not repeat after a turn."""
        name = self.poses.mechanism.inputs[0].name
        sense = -1 if self.input[-1] < self.input[0] else 1
        covered = self._shown(abs(float(self.input[-1] - self.input[0])))
        turn = self._steady(np.linspace(self.input[0], self.input[0] + sense * 2 * np.pi, FINE + 1))
        if not np.isfinite(turn).all():
            return (
                f"the sweep covers {covered}, and the input {name} cannot turn a whole turn: give its motion "
                "there and back as a table over time (--cases with a column time_s)"
            )
        for turns in range(1, TURNS + 1):
            if self._repeats(sense * turns):
                start = float(np.degrees(self.input[0]))
                end = start + sense * 360 * turns
                return (
                    f"the sweep covers {covered} of the input {name}, and a whole cycle is {360 * turns} deg: "
                    f"sweep from {start:.10g}deg to {end:.10g}deg"
                )
        return f"the loads do not repeat within {TURNS} turns of the input {name}"

    def _repeats(self, turns: int) -> bool:
        """Whether the effort some turns later is the same."""
        after, size = self._steady(self._compared + 2 * np.pi * turns), float(np.abs(self._before).max())
        return bool(np.abs(after - self._before).max() <= SAME * size)

    @cached_property
    def _compared(self) -> Reals:
        """Some inputs over the sweep, in uneven steps."""
        share = (np.arange(COMPARED) + 0.5) / COMPARED
        return np.asarray(self.input.min() + np.ptp(self.input) * share**1.5)

    def _steady(self, q: Reals) -> Reals:
        """The effort at other inputs, of a law over time at its mean speed."""
        rates = self.poses.rates
        if any(np.ndim(rate) for of in rates for rate in of):
            rates = [[float(np.abs(self.speed).mean())], [0.0], [0.0]]
        poses = self.poses.again(q[:, None], rates)
        if self.timed:
            poses.time = np.full(len(q), self.place[0])
        return Dynamics(poses).effort[:, 0]

    @cached_property
    def _before(self) -> Reals:
        return self._steady(self._compared)
