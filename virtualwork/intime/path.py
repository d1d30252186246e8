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
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.positions import unwound
from virtualwork.intime.coordinates import Coordinates
from virtualwork.intime.equations import Equations
from virtualwork.intime.explicit import DormandPrince
from virtualwork.intime.implicit import Radau
from virtualwork.intime.marching import Nodes, loop, over
from virtualwork.intime.watch import Floats

Method = DormandPrince | Radau


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
        del self.rows[max(1, self.steps) :]

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
        """q, q̇, q̈ (n, k) and the work (n,) at times on the way: a step of the method from the node before each."""
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
            q[on] += dq
            v[on] += dv
            work[on] += dw
            a[on] = self.equations.many(times[on], q[on], v[on])[:, :-1]
        return q, v, a, work

    def _before(self, times: Reals) -> Any:
        """The node before each time."""
        return np.clip(np.searchsorted(self.nodes.t, times, side="right") - 1, 0, self.steps)

    # --- the inputs -----------------------------------------------------------------------------------------------
    @cached_property
    def inputs(self) -> Reals:
        """The inputs at the nodes (n, k), whole turns and all."""
        q, v = self.nodes.q, self.nodes.v
        if self.coordinates.own:
            return q
        found, speed, _ = self.coordinates.states(q, v, v, np.zeros_like(q))
        turning = np.array([not e.is_slide for e in self.coordinates.inputs])
        return np.asarray(self.first + followed(found, speed, self.nodes.t, turning))

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
    found = loop(equations.k, equations.rates)
    return None if rounds.ready(found) is None else found
