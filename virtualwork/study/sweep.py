"""Whether a sweep of one input, or its law over time, is a cycle: after it pose and loads come back to themselves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.branch.limits import TURNS
from virtualwork.formulas.dynamics import Dynamics, Moving
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.poses import Poses
from virtualwork.study.between import Between

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
    def poses(self) -> Poses:
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
        elif not self._one_way:
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

    @property
    def _one_way(self) -> bool:
        steps = np.diff(self.input)
        return bool((steps > 0).all() or (steps < 0).all())

    def _shown(self, q: float) -> str:
        slide = self.poses.mechanism.inputs[0].is_slide
        return f"{q:.6g} m" if slide else f"{np.degrees(q):.6g} deg"

    def _turns_needed(self) -> str:
        """Why a sweep of angles is no whole cycle: it is a part of one, or not one turn brings the loads back."""
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
            if self._alike(self._after(sense * turns)):
                start = float(np.degrees(self.input[0]))
                end = start + sense * 360 * turns
                return (
                    f"the sweep covers {covered} of the input {name}, and a whole cycle is {360 * turns} deg: "
                    f"sweep from {start:.10g}deg to {end:.10g}deg"
                )
        return f"the loads do not come back to themselves within {TURNS} turns of the input {name}"

    def _repeats(self, turns: int) -> bool:
        return self._alike(self._after(turns))

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

    def _after(self, turns: int) -> Reals:
        """The effort some turns later."""
        return self._steady(self._compared + 2 * np.pi * turns)

    def _alike(self, after: Reals) -> bool:
        size = float(np.abs(self._before).max())
        return bool(np.abs(after - self._before).max() <= SAME * size)
