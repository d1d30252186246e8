"""The integrals of a cycle in 32 digits: the effort of every pose goes through the sum, or through the spline, once more."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.doubled_splines import Spline
from dalembert.arithmetic.engines.doubled import TURN
from dalembert.arithmetic.guard import guarded
from virtualwork.digits.forces import ForceErrors
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import Effort
from virtualwork.formulas.numbers import Reals

# of an estimate: what the second run leaves of it is its own rounding
LEFT = 1e-3


@guarded
class CycleRun:
    """The effort of a sweep of one input in 32 digits, and integrals over it.

    Parameters
    ----------
    dynamics : Dynamics
    place : array (n,)
        What the sweep is over: the time where the poses have one, else the input.
    is_even : bool
        Whether its steps are equal: they are so to 32 digits.
    turns : int, optional
        The turns of a periodic sweep, whose integrals are sums; None: they are those of a spline.
    """

    def __init__(self, dynamics: Dynamics, place: Reals, is_even: bool, turns: int | None) -> None:
        poses = dynamics.poses
        self.lock, self.turns = dynamics.lock, turns
        self.errors, self.place = ForceErrors(dynamics), DoubledArray(place)
        self._values = dynamics.effort[:, 0]
        if poses.time is None:
            self.place = DoubledArray(place, self.errors.estimates.second.rest[:, 0])
            if is_even:
                self.place = self._even()
            poses = poses.again(poses.inputs, poses.rates)
            poses.input_rest = (self.place - place).value[:, None]
            self.errors = ForceErrors(Dynamics(poses))

    def _even(self) -> Any:
        """The inputs in even steps."""
        place, span = self.place, self.span
        if self.turns is not None:
            span = DoubledArray.of(TURN * float(self.turns))
        return place[0] + span * np.arange(len(place)) / float(len(place) - 1)

    @property
    def span(self) -> Any:
        """The length of the sweep."""
        return self.place[-1] - self.place[0]

    @cached_property
    def effort(self) -> Any:
        """The effort, (n,)."""
        ((effort,),) = self.errors.estimates.second.doubled([Effort(0)]).values()
        exact = DoubledArray.of(effort) + np.zeros(len(self._values))
        # close to a change point another run than this one knows the effort, at a limit none
        off = exact.off(self._values)
        others = ~((off <= 2 * self.errors.effort[:, 0]) & np.isfinite(off))
        exact[others] = self._values[others]
        return exact

    @cached_property
    def more(self) -> Reals:
        """By how much more the effort may be off than that tells, (n,)."""
        estimate = self.errors.effort[:, 0]
        more = estimate - self.effort.off(self._values)
        return np.where(more >= LEFT * estimate, more, 0.0)

    def integral(self, values: Any) -> Any:
        """∫ values over the sweep."""
        if self.turns is not None:
            return values[:-1].sum() / float(len(values) - 1) * self.span
        if len(values) < 4:
            return (np.diff(self.place) * (values[:-1] + values[1:]) / 2.0).sum()
        return Spline(self.place, values).up_to(self.place.high[-1])

    def between(self, values: Any, low: float, high: float) -> Any:
        """∫ values from one place to another one, of the spline alone."""
        if self.turns is not None:
            values[-1] = values[0]
        spline = Spline(self.place, values, self.turns is not None)
        return abs(spline.up_to(high) - spline.up_to(low))

    def most(self, each: Reals) -> float:
        """What errors of the poses come to in an integral, at the most."""
        # the weights of a spline exceed those of the trapezoidal rule by less than a half
        return 1.5 * float(np.trapezoid(each, np.abs(self.place.high - self.place.high[0])))

    def off(self, exact: Any, value: float, more: Reals | None = None) -> float:
        """How far a number is from that in 32 digits; `more` than this the poses may be off, (n,)."""
        return float(exact.off(value)) + (0.0 if more is None else self.most(more))
