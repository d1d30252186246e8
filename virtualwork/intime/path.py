"""A way through time: steps of chosen length, the nodes between them, and any time between two nodes."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.step import Method, Step
from virtualwork.intime.watch import Floats, Watch

# steps of one simulation
MOST = 200_000
# of a step's error, by its power law: how much of the allowed one is aimed at
SAFETY, SHRINK, GROW = 0.9, 0.2, 6.0
# steps in a row that the method's stability limits, not its accuracy
STIFF = 15


@dataclass
class Path:
    """The nodes of a way through time, and why it ended."""

    equations: Equations
    method: Method
    t: list[float] = field(default_factory=list)
    q: list[Floats] = field(default_factory=list)
    v: list[Floats] = field(default_factory=list)
    rates: list[Floats] = field(default_factory=list)
    work: list[float] = field(default_factory=list)
    ended: str = ""
    rejected: int = 0

    def put(self, t: float, q: Floats, v: Floats, rates: Floats, work: float) -> None:
        """Add a node."""
        self.t.append(t)
        self.q.append(q)
        self.v.append(v)
        self.rates.append(rates)
        self.work.append(work)

    def at(self, times: Reals) -> tuple[Reals, Reals, Reals]:
        """q, q̇ (n, k) and the work (n,) at times on the way: a step of the method from the node before each."""
        t = np.array(self.t)
        i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1)
        q, v = np.array(self.q)[i], np.array(self.v)[i]
        work, h = np.array(self.work)[i], times - t[i]
        on = np.flatnonzero(h > 0)
        if len(on):
            rates = np.array(self.rates)[i[on]]
            dq, dv, dw = self.method.steps(self.equations, t[i[on]], q[on], v[on], rates, h[on])
            q[on] += dq
            v[on] += dv
            work[on] += dw
        return q, v, work


def walk(
    equations: Equations,
    method: Method,
    start: tuple[float, Floats, Floats, float],
    end: float,
    tolerance: float,
    watches: Sequence[Watch] = (),
    stops: Sequence[float] = (),
    check: Callable[[float, Floats, Floats], str] | None = None,
    budget: int = MOST,
    left: Mapping[str, float] | None = None,
) -> Path:
    """Go from a state to a time.

    Parameters
    ----------
    start : (t, q, q̇, work)
    tolerance : float
        Of the error of each step: of an input, relative to its `scale`; of a speed, to the largest met so far.
    stops : rising times
        No step passes them.
    check : callable
        Asked at every node; the path ends where it says why.
    left : mapping of a watch's name to its level
        Levels at which the path begins, and which the first step does not meet again.

    Returns
    -------
    Path
        `ended` says why: "end", "stiff", "lost", "budget", the name of a watch, or what `check` says.
    """
    t, q, v, work = start
    path = Path(equations, method)
    try:
        rates = equations(t, q, v)
    except Lost:
        path.put(t, q, v, [0.0] * (equations.k + 1), work)
        path.ended = "lost"
        return path
    path.put(t, q, v, rates, work)
    k, span = equations.k, end - t
    fastest = [max(abs(x), s / span if span else 1.0) for x, s in zip(v, equations.scale, strict=True)]
    low_q, low_v = [0.0] * k, [0.0] * k
    h, grow, stiff = 0.0, GROW, 0
    left = left or {}
    power = -1.0 / method.order
    while t < end:
        if len(path.t) > budget:
            path.ended = "budget"
            return path
        allowed = [tolerance * s + 4 * EPS * abs(x) for x, s in zip(q, equations.scale, strict=True)]
        if not h:
            slow = [tolerance * x for x in fastest]
            steep = max(abs(x) / s for x, s in zip((*v, *rates), (*allowed, *slow), strict=False))
            h = min(span, (0.01 / steep) ** (1 / (method.order + 1)) if steep else span)
        i = bisect_right(stops, t)
        stop = min(stops[i], end) if i < len(stops) else end
        wanted, whole = h, stop - t
        # no sliver is left before a stop
        h = whole if h > 0.99 * whole else min(h, max(0.5 * whole, 0.5 * h))
        if h < 16 * EPS * max(abs(t), span * 1e-3):
            path.ended = "lost"
            return path
        node = Node(equations, method, t, q, v, rates)
        try:
            done = method.step(equations, t, q, v, rates, h)
        except Lost:
            path.rejected += 1
            h, grow = 0.25 * h, 1.0
            continue
        ends = (max(f, abs(x + d)) for f, x, d in zip(fastest, v, done.dv, strict=True))
        error = method.size(done, [*allowed, *(tolerance * x for x in ends)])
        if not error <= 1.0:
            path.rejected += 1
            h, grow = h * (max(SHRINK, SAFETY * error**power) if error < math.inf else SHRINK), 1.0
            continue
        following = max(
            wanted if h < wanted else 0.0, h * min(grow, SAFETY * error**power if error else grow)
        )
        found = node.met(watches, h, done, left) if watches else None
        met, left, grow = None, {}, GROW
        if found is not None:
            met, level, h, done = found
            left = {met.name: level}
        stiff = stiff + 1 if done.stiffness > method.stable else max(0, stiff - 1)
        t = stop if h == whole else t + h
        q, low_q = _added(q, low_q, done.dq)
        v, low_v = _added(v, low_v, done.dv)
        work, rates, h = work + done.work, done.rates, following
        fastest = [max(f, abs(x)) for f, x in zip(fastest, v, strict=True)]
        path.put(t, q, v, rates, work)
        if met is not None and met.ends:
            path.ended = met.name
        elif check is not None:
            path.ended = check(t, q, v)
        if path.ended or stiff >= STIFF:
            path.ended = path.ended or "stiff"
            return path
    path.ended = "end"
    return path


def _added(x: Floats, low: Floats, d: Floats) -> tuple[Floats, Floats]:
    """x + d with what rounding left over before (Kahan)."""
    high, rest = [], []
    for a, b, c in zip(x, low, d, strict=True):
        c += b
        total = a + c
        high.append(total)
        rest.append(c - (total - a))
    return high, rest


@dataclass
class Node:
    """Where a step begins."""

    equations: Equations
    method: Method
    t: float
    q: Floats
    v: Floats
    rates: Floats

    def met(
        self, watches: Sequence[Watch], h: float, done: Step, left: Mapping[str, float]
    ) -> tuple[Watch, float, float, Step] | None:
        """The first watch that a step passes a level of: it, the level, the step that ends there, and its length."""
        first: tuple[Watch, float, float, Step] | None = None
        for watch in watches:
            before = watch.value(self.t, self.q, self.v)
            for share in (0.25, 0.5, 0.75, 1.0):
                value = self._value(watch, h, done, share)
                level = watch.passed(before, value, left.get(watch.name))
                if level is not None:
                    at = self._bisected(watch, level, h, done, share)
                    found = self._sharpened(watch, level, at * h)
                    if found is not None and (first is None or found[0] < first[2]):
                        first = watch, level, *found
                    break
        return first

    def _value(self, watch: Watch, h: float, done: Step, share: float) -> float:
        return watch.value(self.t + share * h, *_between(self.q, self.v, self.rates, h, done, share))

    def _bisected(self, watch: Watch, level: float, h: float, done: Step, high: float) -> float:
        """Where in a step a level lies, to seven digits."""
        low = high - 0.25
        up = self._value(watch, h, done, high) > level
        for _ in range(24):
            middle = 0.5 * (low + high)
            if (self._value(watch, h, done, middle) > level) == up:
                high = middle
            else:
                low = middle
        return 0.5 * (low + high)

    def _sharpened(self, watch: Watch, level: float, h: float) -> tuple[float, Step] | None:
        """The length of a step that ends at a level, by Newton's method over the method's own steps."""
        enough = 2 * EPS * max(abs(self.t), abs(h)) if watch.ends else 1e-7 * h
        # of the secant, where no derivative is known
        before: tuple[float, float] | None = None
        try:
            for _ in range(12):
                done = self.method.step(self.equations, self.t, self.q, self.v, self.rates, h)
                q = [x + d for x, d in zip(self.q, done.dq, strict=True)]
                v = [x + d for x, d in zip(self.v, done.dv, strict=True)]
                gap = level - watch.value(self.t + h, q, v)
                if watch.rate is not None:
                    rate = watch.rate(self.t + h, q, v, done.rates)
                    change = gap / rate if rate else 0.0
                elif before is None:
                    change = 1e-6 * h
                else:
                    change = gap * (h - before[0]) / (before[1] - gap) if before[1] != gap else 0.0
                before = h, gap
                if not abs(change) > enough or h + change <= 0:
                    break
                h += change
        except Lost:
            return None
        return h, done


def _between(
    q: Floats, v: Floats, rates: Floats, h: float, done: Step, share: float
) -> tuple[Floats, Floats]:
    """A state within a step, roughly: of the polynomial of degree 5 through q, q̇ and q̈ at both ends."""
    x = share
    places, speeds = [], []
    for a, b, c, d, e, f in zip(q, v, rates, done.dq, done.dv, done.rates, strict=False):
        # what is left to fit after the Taylor polynomial of degree 2 at the beginning
        p, r, s = d - h * (b + 0.5 * h * c), h * (e - h * c), h * h * (f - c)
        c3, c4, c5 = 10 * p - 4 * r + 0.5 * s, -15 * p + 7 * r - s, 6 * p - 3 * r + 0.5 * s
        places.append(a + x * (h * b + x * (0.5 * h * h * c + x * (c3 + x * (c4 + x * c5)))))
        speeds.append(b + x * h * c + x * x * (3 * c3 + x * (4 * c4 + x * 5 * c5)) / h)
    return places, speeds
