"""The integrals of a cycle in 32 digits: the effort of every pose goes through the sum, or through the spline, once more.

The slopes of the spline are refined: what floats leave of its equations in 32 digits says what they are off by (N. J. Higham,
Accuracy and Stability of Numerical Algorithms, 2nd ed., §12.1).
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.engines.doubled import TURN
from dalembert.arithmetic.guard import guarded
from virtualwork.digits.forces import ForceErrors
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import Effort
from virtualwork.formulas.numbers import Reals

# steps of refinement
STEPS = 2
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
        ((found,),) = self.errors.estimates.second.doubled([Effort(0)]).values()
        exact = DoubledArray.of(found) + np.zeros(len(self._values))
        # close to a change point another run than this one knows the effort
        others = ~(exact.off(self._values) <= 2 * self.errors.effort[:, 0])
        exact[others] = self._values[others]
        return exact

    @cached_property
    def more(self) -> Reals:
        """By how much more the effort may be off than that tells, (n,)."""
        estimate = self.errors.effort[:, 0]
        more = estimate - self.effort.off(self._values)
        return np.where(more > LEFT * estimate, more, 0.0)

    def integral(self, values: Any) -> Any:
        """∫ values over the sweep."""
        if self.turns is not None:
            return values[:-1].sum() / float(len(values) - 1) * self.span
        if len(values) < 4:
            return (np.diff(self.place) * (values[:-1] + values[1:]) / 2.0).sum()
        return Spline(self.place, values).over_steps().sum()

    def between(self, values: Any, low: float, high: float) -> Any:
        """∫ values from one place to another one, of the spline alone."""
        forward = slice(None, None, -1 if self.place.high[-1] < self.place.high[0] else 1)
        if self.turns is not None:
            values[-1] = values[0]
        spline = Spline(self.place[forward], values[forward], self.turns is not None)
        return spline.up_to(high) - spline.up_to(low)

    def most(self, each: Reals) -> float:
        """What errors of the poses come to in an integral, at the most."""
        # the weights of a spline exceed those of the trapezoidal rule by less than a half
        return 1.5 * float(np.trapezoid(each, np.abs(self.place.high - self.place.high[0])))

    def off(self, exact: Any, value: float, more: Reals | None = None) -> float:
        """How far a number is from that in 32 digits; `more` than this the poses may be off, (n,)."""
        return float(exact.off(value)) + (0.0 if more is None else self.most(more))


class Spline:
    """A cubic spline in 32 digits through values at rising places, (n,) each, as scipy's `CubicSpline` is one."""

    def __init__(self, place: DoubledArray, values: DoubledArray, periodic: bool = False) -> None:
        self.place, self.values = place, values
        self.step, self.rise = np.diff(place), np.diff(values) / np.diff(place)
        if periodic:
            slopes = _solved(*self._cyclic())
            self.slopes = np.concatenate([slopes, slopes[:1]])
        elif len(self.step) > 2:
            self.slopes = _solved(*self._not_a_knot())
        else:
            # a parabola, or a straight line
            h, d = self.step, self.rise
            bend = (d[-1] - d[0]) / (place[-1] - place[0])
            inner = d[:-1] + h[:-1] * bend
            self.slopes = np.concatenate([d[:1] - h[:1] * bend, inner, d[-1:] + h[-1:] * bend])

    def _cyclic(self) -> tuple[Any, Any, Any, Any]:
        """The equations of the slopes: of the slope before, of its own, of the one behind it, and the right sides."""
        h, d = self.step, self.rise
        before, rise = h[np.arange(-1, len(h) - 1)], d[np.arange(-1, len(h) - 1)]
        return h, 2.0 * (before + h), before, 3.0 * (h * rise + before * d)

    def _not_a_knot(self) -> tuple[Any, Any, Any, Any]:
        """The same with one cubic through the first three places, and one through the last three."""
        h, d = self.step, self.rise
        first, last = h[0] + h[1], h[-2] + h[-1]
        begin = ((h[0] + 2.0 * first) * h[1] * d[0] + h[0] * h[0] * d[1]) / first
        end = (h[-1] * h[-1] * d[-2] + (2.0 * last + h[-1]) * h[-2] * d[-1]) / last
        inner = 3.0 * (h[1:] * d[:-1] + h[:-1] * d[1:])
        none = DoubledArray([0.0])

        def row(a: Any, b: Any, c: Any) -> Any:
            return np.concatenate([a.reshape(1), b, c.reshape(1)])

        lower, middle = row(none, h[1:], last), row(h[1], 2.0 * (h[:-1] + h[1:]), h[-2])
        return lower, middle, row(first, h[:-1], none), row(begin, inner, end)

    def over_steps(self) -> Any:
        """The integral over each step, (n − 1,)."""
        h, f, s = self.step, self.values, self.slopes
        return h * (f[:-1] + f[1:]) / 2.0 + h * h * (s[:-1] - s[1:]) / 12.0

    def up_to(self, at: float) -> Any:
        """The integral from the first place to another one."""
        i = int(np.clip(np.searchsorted(self.place.high, at, "right") - 1, 0, len(self.step) - 1))
        h, f, s = self.step[i], self.values[i : i + 2], self.slopes[i : i + 2]
        u = (at - self.place[i]) / h
        cube, fourth = u * u * u, u * u * u * u / 4.0
        inside = f[0] * (u - cube + 2.0 * fourth) + f[1] * (cube - 2.0 * fourth)
        turned = s[0] * (u * u / 2.0 - 2.0 * cube / 3.0 + fourth) + s[1] * (fourth - cube / 3.0)
        rest = h * inside + h * h * turned
        return self.over_steps()[:i].sum() + rest if i else rest


def _solved(lower: Any, middle: Any, upper: Any, right: Any) -> Any:
    """Solve lower·x of the row before + middle·x + upper·x of the row behind = right; the first row is behind the last."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    n = len(right)
    row = np.arange(n)
    before, behind = np.roll(row, 1), np.roll(row, -1)
    entries = np.concatenate([lower.high, middle.high, upper.high])
    places = np.tile(row, 3), np.concatenate([before, row, behind])
    inverse = splu(csc_array((entries, places), shape=(n, n)))
    x = DoubledArray(inverse.solve(right.value))
    for _ in range(STEPS):
        rest = right - lower * x[before] - middle * x - upper * x[behind]
        x = x + inverse.solve(rest.value)
    return x
