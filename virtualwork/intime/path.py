"""A path through time in one set of coordinates: its nodes, and any time between two of them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.engines import rounds
from dalembert.arithmetic.loop import Loop
from virtualwork.describe import MechanismError
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.positions import unwound
from virtualwork.intime.coordinates import Coordinates
from virtualwork.intime.defect import step_errors
from virtualwork.intime.equations import Equations
from virtualwork.intime.explicit import TINY, DormandPrince
from virtualwork.intime.growth import Off, at_start, flows, free, grown, ways_of
from virtualwork.intime.implicit import Radau
from virtualwork.intime.marching import Nodes, loop, over
from virtualwork.intime.watch import Floats

Method = DormandPrince | Radau
# nodes of a path at which rounding is looked at; how far from each, as a share of what an input's errors are relative to
SAMPLES, BESIDE = 8, 2.0**-40
# standard deviations of rounding that count
DEVIATIONS = 3.0


@dataclass
class Path:
    """The nodes of a way through time, a row (t, q, q̇, rates, work) each, and why it ended; `first` are the inputs at its beginning."""

    coordinates: Coordinates
    method: Method
    first: Floats
    rows: list[Floats] = field(default_factory=list)
    ended: str = ""
    rejected: int = 0
    # whether times are reached from the node after them
    backwards: bool = False

    def __post_init__(self) -> None:
        self._nodes = Nodes(np.empty((0, 0)), self.equations.k)

    @property
    def equations(self) -> Equations:
        """The equations of motion in its coordinates."""
        return self.coordinates.equations

    @property
    def nodes(self) -> Nodes:
        """The nodes as arrays."""
        if len(self._nodes.table) != len(self.rows):
            self._nodes = Nodes(np.array(self.rows), self.equations.k)
        return self._nodes

    @property
    def end(self) -> float:
        """The last time reached."""
        return self.rows[-1][0]

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return len(self.rows) - 1

    def parted(self, row: Floats) -> tuple[float, Floats, Floats, Floats, float]:
        """t, q, q̇, the rates and the work of a row."""
        k = self.equations.k
        return row[0], row[1 : k + 1], row[k + 1 : 2 * k + 1], row[2 * k + 1 : -1], row[-1]

    @property
    def last(self) -> tuple[float, Floats, Floats, Floats, float]:
        """The same of the last node."""
        return self.parted(self.rows[-1])

    def put(self, t: float, q: Floats, v: Floats, rates: Floats, work: float) -> None:
        """Add a node."""
        self.rows.append([t, *q, *v, *rates, work])

    def drop(self) -> None:
        """Take the last node away, but for the first."""
        self.cut(self.steps)

    def cut(self, node: int) -> None:
        """Take away a node and all after it, but for the first."""
        del self.rows[max(1, node) :]
        # it is that of all nodes
        self.__dict__.pop("_noise", None)

    def back(self, stops: Sequence[float]) -> None:
        """Take away the nodes that lie beyond the last of some times by no more than rounding of it."""
        for stop in stops[: bisect_right(stops, self.end)][-1:]:
            while self.steps and 0 < self.end - stop <= 1e-9 * max(abs(stop), stop - self.rows[0][0]):
                self.drop()

    def turning(self, i: int) -> float:
        """When the first coordinate turns back between node i and the next, by the secant within a bracket."""
        (low, high), (down, up) = self.nodes.t[i : i + 2].tolist(), self.nodes.v[i : i + 2, 0].tolist()
        for _ in range(60):
            middle = low - down * (high - low) / (up - down)
            if not low < middle < high:
                break
            speed = float(self.at(np.array([middle]))[1][0, 0])
            if speed == 0.0:
                return float(middle)
            # of the end that stays, half of it counts (Illinois)
            if (speed > 0) == (up > 0):
                high, up, down = middle, speed, 0.5 * down
            else:
                low, down, up = middle, speed, 0.5 * up
        return float(0.5 * (low + high))

    def at(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """q, q̇, q̈ (n, k) and the work (n,) at times on the way: a step of the method from the node before each.

        Raises
        ------
        MechanismError
            A step of the implicit method does not converge.
        """
        t = self.nodes.t
        # a stiff method does not go back
        if self.backwards and self.method.stable < np.inf:
            i = np.minimum(np.searchsorted(t, times), len(t) - 1)
        else:
            i = self._before(times)
        node = self.nodes.at(i)
        q, v, a, work, h = node.q, node.v, node.rates[:, :-1], node.work, times - node.t
        on = np.flatnonzero(h)
        if len(on):
            here = node.at(on)
            if compiled(self.equations, self.method) is not None:
                dq, dv, dw = over(self.equations.rates, {}, here, h[on])
            else:
                state = here.t, here.q, here.v, here.rates
                dq, dv, dw = self.method.steps(self.equations, *state, h[on])
                lost = ~np.isfinite(dq).all(axis=1)
                if lost.any() and self.method.stable == np.inf:
                    at = float(times[on][lost][0])
                    raise MechanismError(f"at {at:.6g} s Newton's method does not converge within a step")
            q[on] += dq
            v[on] += dv
            work[on] += dw
            a[on] = self.equations.many(times[on], q[on], v[on])[:, :-1]
        return q, v, a, work

    def _before(self, times: Reals) -> Any:
        """The node before each time."""
        return np.clip(np.searchsorted(self.nodes.t, times, side="right") - 1, 0, self.steps)

    @property
    def _which(self) -> Any:
        """The nodes at which rounding is looked at."""
        return np.unique(np.linspace(0, self.steps, min(SAMPLES, 2 + self.steps // 4)).astype(int))

    @cached_property
    def _noise(self) -> tuple[Reals, Reals]:
        """The standard deviation of what rounding makes of the accelerations at some nodes, its logarithm (n, k), and their times.

        Of values at places so near each other a fourth difference has nothing but rounding in it; of five that round by
        themselves its square is 70 times theirs. The accelerations themselves do not tell: the pull of a spring of 10 m
        that is stretched by a millionth of a metre has nine digits fewer.
        """
        nodes, k = self.nodes, self.equations.k
        which, some = self._which, nodes.at(self._which)
        # at other distances beside every node: whole units of the last place would all round alike
        beside = BESIDE * (1.0 + np.modf(0.618 * np.arange(1, len(which) + 1))[0])[:, None]
        apart = np.arange(-4.0, 5.0)[:, None, None] * (beside * np.array(self.equations.scale))
        places = (some.q + apart).reshape(-1, k)
        t, v = np.tile(some.t, 9), np.tile(some.v, (9, 1))
        rates = self.equations.many(t, places, v)[:, :k].reshape(9, -1, k)
        squares = np.square(np.diff(rates, 4, axis=0)).mean(axis=0) / 70
        # none where a place beside a node cannot be assembled; near a pole it grows by powers of ten
        sizes = np.sqrt(np.where(np.isfinite(squares), squares, 0.0))
        return np.log(np.maximum(np.maximum(sizes, np.median(sizes, axis=0)), TINY)), some.t

    def noise_of_speeds(self, t: Reals) -> Reals:
        """What rounding of the accelerations may make of the speeds over each step between times (n,), (n − 1, k).

        A step takes each stage with its weight, and each of them rounds by itself.
        """
        (sizes, times), middle = self._noise, 0.5 * (t[1:] + t[:-1])
        noise = np.exp(np.stack([np.interp(middle, times, of) for of in sizes.T], axis=1))
        weight = DEVIATIONS * float(np.linalg.norm(self.method.stages[1]))
        return np.asarray(weight * noise * np.diff(t)[:, None])

    def _sizes(self, t: Reals) -> Reals:
        """What the loads add to the accelerations, summed without signs, (k, n) at times, from that at some nodes."""
        some = self.nodes.at(self._which)
        sizes = self.equations.load_sizes(some.t, some.q, some.v)
        return np.stack([np.interp(t, some.t, of) for of in sizes.T])

    @property
    def followed(self) -> bool:
        """Whether small changes are followed along the motion, which is smooth (see `Equations.smooth`); those of the inputs, if not."""
        return self.equations.smooth

    @property
    def judged(self) -> bool:
        """Whether the steps are judged by their defect: an implicit method's may be too long for it, and what passes a kink has none."""
        return self.followed and not self.stiff and None not in self.equations.kinks

    @property
    def stiff(self) -> bool:
        """Whether the steps are those of an implicit method."""
        return self.method.stable == np.inf

    def off(self, t: Reals, start: Off | None) -> tuple[Reals, Reals, Reals, Off]:
        """What inputs and their speeds are off by at times t (n,) from the first node to the last, for rounding and for the errors of the steps, (2k, n) each; by how much more in the middle between two times, (2k, n − 1); and the last state, by `start`, that of the first.

        Between two of the times there is at least one step, or better two of one length.
        """
        equations, k, h = self.equations, self.equations.k, np.diff(t)
        noise, sizes = self.noise_of_speeds(t).T, self._sizes(t)
        every = np.concatenate([t, 0.5 * (t[1:] + t[:-1])])
        every.sort()
        q, v, a = (x.T for x in (self.at(every) if self.followed else self.states(every))[:3])
        start = at_start(q[:, 0], v[:, 0]) if start is None else start
        ways = ways_of(h, q[:, ::2], v[:, ::2], sizes)
        if not self.followed:
            # nothing pulls back or apart, and all is off one way
            rates = np.abs(np.concatenate([v, a]))[:, ::2]
            ways[: 2 * k] = 0.5 * h * (rates[:, 1:] + rates[:, :-1])
            result = grown(free(h, k), h, noise, ways, start)
            return result.rounded, result.stepped, np.zeros((2 * k, len(h))), result.at(-1)

        def many(t: Reals, q: Reals, v: Reals) -> Reals:
            return equations.many(t, q.T, v.T)[:, :k].T

        motion, stiff = (every, q, v, a), self.stiff
        flow, rounds, slopes = flows(many, np.array(equations.scale), *motion, not equations.stops, stiff)
        none = np.zeros((2, 2 * k, len(h)))
        middle, local = step_errors(many, slopes, *motion) if self.judged else none
        result = grown(flow, h, np.hypot(noise, rounds), ways, start, local, stiff)
        last = result.at(-1)
        if not self.coordinates.own:
            seen = self.coordinates.seen(q[:, ::2].T)
            zero = np.zeros_like(seen)
            turning = np.gradient(seen, t, axis=2) if len(t) > 1 else zero
            rows = (seen, zero), (turning, seen)
            onto = np.concatenate([np.concatenate(row, axis=1) for row in rows])
            result, middle = result.onto(onto), np.einsum("ij...,j...->i...", onto[:, :, 1:], middle)
        return result.rounded, result.stepped, middle, last

    # --- the inputs -----------------------------------------------------------------------------------------------
    @cached_property
    def inputs(self) -> Reals:
        """The inputs at the nodes (n, k), whole turns and all."""
        q, v = self.nodes.q, self.nodes.v
        if self.coordinates.own:
            return q
        places, speed, _ = self.coordinates.states(q, v, v, np.zeros_like(q))
        turning = np.array([not e.is_slide for e in self.coordinates.inputs])
        return np.asarray(self.first + followed(places, speed, self.nodes.t, turning))

    def states(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """The inputs, their speeds and accelerations (n, k), and the work (n,)."""
        q, v, a, work = self.at(times)
        if self.coordinates.own:
            return q, v, a, work
        i = self._before(times)
        near = self.inputs[i]
        speed = self.coordinates.states(q, v, a, near)[1]
        near = near + 0.5 * speed * (times - self.nodes.t[i])[:, None]
        return *self.coordinates.states(q, v, a, near), work


def followed(q: Reals, v: Reals, times: Reals, turning: Any) -> Reals:
    """How far angles have come since the first of many times, (n, k), whole turns and all, and what does not turn."""
    change = np.diff(q, axis=0)
    near = 0.5 * (v[1:] + v[:-1]) * np.diff(times)[:, None]
    change = np.where(turning, unwound(change, near), change)
    return np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(change, axis=0)])


def compiled(equations: Equations, method: Method) -> Loop | None:
    """The loop of steps, where compiled code does it."""
    if not isinstance(method, DormandPrince) or not equations.plain:
        return None
    function = loop(equations.k, equations.rates)
    return None if rounds.ready(function) is None else function
