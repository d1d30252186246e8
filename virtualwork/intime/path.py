"""A way through time: steps of chosen length, the nodes between them, and any time between two nodes."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.equations import Equations, Floats, Lost

# steps of one simulation
MOST = 200_000
# of a step's error, by its power law: how much of the allowed one is aimed at
SAFETY, SHRINK, GROW = 0.9, 0.2, 6.0
# steps in a row that the method's stability limits, not its accuracy
STIFF = 15


class Step(Protocol):
    """What a step gives: changes of q and q̇, the work, the rates at its end, and h·|λ|."""

    dq: Floats
    dv: Floats
    work: float
    rates: Floats
    stiffness: float


class Method(Protocol):
    """A one-step method."""

    name: str
    order: int
    stable: float

    def step(self, f: Equations, t: float, q: Floats, v: Floats, rates: Floats, h: float) -> Step:
        """One step."""

    def size(self, done: Step, scale: Floats) -> float:
        """Its error over that allowed."""

    def steps(
        self, f: Equations, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
    ) -> tuple[Reals, Reals, Reals]:
        """Changes over steps from many states, each of its own length."""


@dataclass
class Watch:
    """A quantity that must not pass a level within a step: the step ends there.

    `ends`: the path ends there too.
    """

    name: str
    value: Callable[[float, Floats, Floats], float]
    levels: Sequence[float]
    ends: bool = False

    def passed(self, before: float, after: float) -> float | None:
        """The first level between two values, the first value's own left out."""
        low, high = min(before, after), max(before, after)
        near = 64 * EPS * max(abs(low), abs(high), 1e-3)
        inside = self.levels[bisect_left(self.levels, low) : bisect_right(self.levels, high)]
        return min((x for x in inside if abs(x - before) > near), key=lambda x: abs(x - before), default=None)


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
        for row, value in zip(
            (self.t, self.q, self.v, self.rates, self.work), (t, q, v, rates, work), strict=True
        ):
            row.append(value)  # type: ignore[arg-type]

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

    Returns
    -------
    Path
        `ended` says why: "end", "stiff", "lost", "budget", the name of a watch, or what `check` says.
    """
    t, q, v, work = start
    path = Path(equations, method)
    rates = equations(t, q, v)
    path.put(t, q, v, rates, work)
    k, span = equations.k, end - t
    fastest = [max(abs(x), s / span if span else 1.0) for x, s in zip(v, equations.scale, strict=True)]
    low_q, low_v = [0.0] * k, [0.0] * k
    h, stiff = 0.0, 0
    power = -1.0 / method.order
    grow = GROW
    while t < end:
        if len(path.t) > budget:
            path.ended = "budget"
            return path
        allowed = [tolerance * s + 4 * EPS * abs(x) for x, s in zip(q, equations.scale, strict=True)]
        if not h:
            steep = max(
                abs(x) / s
                for x, s in zip((*v, *rates), (*allowed, *(tolerance * x for x in fastest)), strict=False)
            )
            h = min(span, (0.01 / steep) ** (1 / (method.order + 1)) if steep else span)
        next_stop = stops[i] if (i := bisect_right(stops, t)) < len(stops) else end
        limit = min(next_stop, end) - t
        # no sliver is left before a stop
        own, h = h, limit if h > 0.99 * limit else min(h, 0.5 * limit) if h > 0.5 * limit else h
        if h < 16 * EPS * max(abs(t), span * 1e-3):
            path.ended = "lost"
            return path
        try:
            done = method.step(equations, t, q, v, rates, h)
        except Lost:
            path.rejected += 1
            h *= 0.25
            grow = 1.0
            continue
        scale = [
            *allowed,
            *(tolerance * max(f, abs(x + d)) for f, x, d in zip(fastest, v, done.dv, strict=True)),
        ]
        error = method.size(done, scale)
        if not error <= 1.0:
            path.rejected += 1
            h *= max(SHRINK, SAFETY * error**power) if error < math.inf else SHRINK
            grow = 1.0
            continue
        found = _met(equations, method, watches, t, q, v, rates, h, done)
        met = None
        if found is not None:
            met, h, done = found
        stiff = stiff + 1 if done.stiffness > method.stable else max(0, stiff - 1)
        t = min(next_stop, end) if h == limit else t + h
        q, low_q = _added(q, low_q, done.dq)
        v, low_v = _added(v, low_v, done.dv)
        work += done.work
        rates = done.rates
        fastest = [max(f, abs(x)) for f, x in zip(fastest, v, strict=True)]
        path.put(t, q, v, rates, work)
        if met is not None and met.ends:
            path.ended = met.name
            return path
        if check is not None and (why := check(t, q, v)):
            path.ended = why
            return path
        if stiff >= STIFF:
            path.ended = "stiff"
            return path
        if met is None:
            h = (
                max(own, h) * min(grow, max(SHRINK, SAFETY * error**power))
                if h < own
                else h * min(grow, SAFETY * error**power if error else grow)
            )
        else:
            h = own
        grow = GROW
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


def _met(
    equations: Equations,
    method: Method,
    watches: Sequence[Watch],
    t: float,
    q: Floats,
    v: Floats,
    rates: Floats,
    h: float,
    done: Step,
) -> tuple[Watch, float, Step] | None:
    """The first watch that a step passes a level of, the length of the step that ends there, and that step."""
    first: tuple[Watch, float, Step] | None = None
    for watch in watches:
        states = _between(q, v, rates, h, done)
        before = watch.value(t, q, v)
        for share in (0.25, 0.5, 0.75, 1.0):
            level = watch.passed(before, watch.value(t + share * h, *states(share)))
            if level is None:
                continue
            at = _bisected(lambda s: watch.value(t + s * h, *states(s)) - level, share - 0.25, share)
            found = _sharpened(equations, method, watch, level, t, q, v, rates, at * h)
            if found is not None and (first is None or found[0] < first[1]):
                first = watch, *found
            break
    return first


def _sharpened(
    equations: Equations,
    method: Method,
    watch: Watch,
    level: float,
    t: float,
    q: Floats,
    v: Floats,
    rates: Floats,
    h: float,
) -> tuple[float, Step] | None:
    """The length of a step that ends at a level, to rounding, by secants of the method's own steps."""

    def off(length: float) -> tuple[float, Step]:
        done = method.step(equations, t, q, v, rates, length)
        end = (
            [x + d for x, d in zip(q, done.dq, strict=True)],
            [x + d for x, d in zip(v, done.dv, strict=True)],
        )
        return watch.value(t + length, *end) - level, done

    try:
        gap, done = off(h)
        other = h * (1 + 1e-6) + 4 * EPS * abs(t)
        gap_there, _ = off(other)
        for _ in range(8):
            if gap == 0.0 or gap == gap_there:
                break
            change = -gap * (other - h) / (gap_there - gap)
            if not abs(change) > 2 * EPS * max(abs(t), abs(h)):
                break
            other, gap_there = h, gap
            h += change
            if h <= 0:
                return None
            gap, done = off(h)
    except Lost:
        return None
    return h, done


def _between(
    q: Floats, v: Floats, rates: Floats, h: float, done: Step
) -> Callable[[float], tuple[Floats, Floats]]:
    """States within a step, roughly: the polynomial of degree 5 through q, q̇ and q̈ at both ends."""

    def state(share: float) -> tuple[Floats, Floats]:
        x = share
        places, speeds = [], []
        for a, b, c, d, e, f in zip(q, v, rates, done.dq, done.dv, done.rates, strict=False):
            # what is left to fit after the Taylor polynomial of degree 2 at the beginning
            p, r, s = d - h * (b + 0.5 * h * c), h * (e - h * c), h * h * (f - c)
            c3, c4, c5 = 10 * p - 4 * r + 0.5 * s, -15 * p + 7 * r - s, 6 * p - 3 * r + 0.5 * s
            places.append(a + x * (h * b + x * (0.5 * h * h * c + x * (c3 + x * (c4 + x * c5)))))
            speeds.append(b + x * h * c + x * x * (3 * c3 + x * (4 * c4 + x * 5 * c5)) / h)
        return places, speeds

    return state


def _bisected(f: Callable[[float], float], low: float, high: float) -> float:
    """A root between two ends, to six digits."""
    sign = f(high) > 0
    for _ in range(24):
        middle = 0.5 * (low + high)
        if (f(middle) > 0) == sign:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)
