"""The integrals of a cycle in 32 digits: the effort of every pose goes through the sum, or through the spline, once more."""

from __future__ import annotations

from decimal import Context, Decimal, localcontext
from functools import cached_property
from itertools import accumulate
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.engines.doubled import TURN
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.splines import DIGITS, periodic, rates, sums
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


class Spline:
    """The cubic spline through values at rising or falling places, (n,) each, as scipy's `CubicSpline` is one."""

    def __init__(self, place: DoubledArray, values: DoubledArray, is_periodic: bool = False) -> None:
        self.places = place.high
        x, y = (sums(of.high.tolist(), of.low.tolist()) for of in (place, values))
        self.place, self.values = x, y
        with localcontext(Context(prec=DIGITS)):
            # its second derivatives
            if is_periodic:
                self.bends = periodic(x, y)
                self.bends.append(self.bends[0])
            elif len(x) > 3:
                _, self.bends = rates(x, y)
            else:
                # a parabola, or a straight line
                first, last = ((y[k + 1] - y[k]) / (x[k + 1] - x[k]) for k in (0, len(x) - 2))
                self.bends = [2 * (last - first) / (x[-1] - x[0])] * len(x)
            steps = range(len(x) - 1)
            self.integrals = [*accumulate((self._within(i, x[i + 1]) for i in steps), initial=Decimal(0))]

    def _within(self, i: int, at: Decimal) -> Decimal:
        """The integral from a place to one within the step behind it."""
        h, t = self.place[i + 1] - self.place[i], at - self.place[i]
        y, bend, further = self.values[i], self.bends[i], self.bends[i + 1]
        slope = (self.values[i + 1] - y) / h - h * (2 * bend + further) / 6
        return t * (y + t * (slope / 2 + t * (bend / 6 + t * (further - bend) / (24 * h))))

    def up_to(self, at: float) -> DoubledArray:
        """The integral from the first place to another one, of which the last float is the last place."""
        with localcontext(Context(prec=DIGITS)):
            if at == self.places[-1]:
                total = self.integrals[-1]
            else:
                way = -1 if self.places[-1] < self.places[0] else 1
                i = int(
                    np.clip(np.searchsorted(way * self.places, way * at, "right") - 1, 0, len(self.place) - 2)
                )
                total = self.integrals[i] + self._within(i, Decimal(at))
            return DoubledArray(float(total), float(total - Decimal(float(total))))
