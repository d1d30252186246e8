"""A way through time: steps of chosen length, the nodes between them, and any time between two nodes."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dalembert.arithmetic.engines import rounds
from dalembert.arithmetic.loop import Loop
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.control import (
    GROW,
    SAFETY,
    SHRINK,
    STIFF,
    added,
    allowed,
    first_steps,
    longer,
    shorter,
    shortest,
    stiffer,
    tried,
)
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.explicit import DormandPrince
from virtualwork.intime.marching import ROUNDS, beginning, follow, loop, march, over
from virtualwork.intime.powers import names
from virtualwork.intime.step import Method, Step
from virtualwork.intime.watch import Check, Floats, Watch, between

# steps of one simulation
MOST = 200_000
# of a planned step's error over the one allowed: halves of what a tolerance chose may be so much rougher than this one's
ROUGH = 256.0


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
    # whether times are reached from the node after them
    backwards: bool = False

    def put(self, t: float, q: Floats, v: Floats, rates: Floats, work: float) -> None:
        """Add a node."""
        self.t.append(t)
        self.q.append(q)
        self.v.append(v)
        self.rates.append(rates)
        self.work.append(work)

    def drop(self) -> None:
        """Take the last node away, but for the first."""
        if len(self.t) > 1:
            for of in (self.t, self.q, self.v, self.rates, self.work):
                of.pop()

    def back(self, stops: Sequence[float]) -> None:
        """Take away the nodes that lie beyond the last of some times by no more than rounding of it."""
        for stop in stops[: bisect_right(stops, self.t[-1])][-1:]:
            while len(self.t) > 1 and 0 < self.t[-1] - stop <= 1e-9 * max(abs(stop), stop - self.t[0]):
                self.drop()

    def extend(self, rows: Reals, k: int) -> None:
        """Add nodes: a row (t, q, q̇, rates, work) each."""
        self.t += rows[:, 0].tolist()
        self.q += rows[:, 1 : k + 1].tolist()
        self.v += rows[:, k + 1 : 2 * k + 1].tolist()
        self.rates += rows[:, 2 * k + 1 : -1].tolist()
        self.work += rows[:, -1].tolist()

    def turning(self, i: int) -> float:
        """When the first input turns back between node i and the next, by the secant within a bracket."""
        low, high = self.t[i], self.t[i + 1]
        down, up = self.v[i][0], self.v[i + 1][0]
        for _ in range(60):
            middle = low - down * (high - low) / (up - down)
            if not low < middle < high:
                break
            speed = float(self.at(np.array([middle]))[1][0, 0])
            if speed == 0.0:
                return middle
            # of the end that stays, half of it counts (Illinois)
            if (speed > 0) == (up > 0):
                high, up, down = middle, speed, 0.5 * down
            else:
                low, down, up = middle, speed, 0.5 * up
        return 0.5 * (low + high)

    def at(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """q, q̇, q̈ (n, k) and the work (n,) at times on the way: a step of the method from the node before each."""
        t = np.array(self.t)
        # a stiff method does not go back
        if self.backwards and self.method.stable < np.inf:
            i = np.minimum(np.searchsorted(t, times), len(t) - 1)
        else:
            i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1)
        q, v = np.array(self.q)[i], np.array(self.v)[i]
        work, h = np.array(self.work)[i], times - t[i]
        on = np.flatnonzero(h)
        if len(on):
            state = t[i[on]], q[on], v[on], np.array(self.rates)[i[on]], h[on]
            if compiled(self.equations, self.method) is not None:
                dq, dv, dw = over(self.equations.k, self.equations.rates, {}, *state)
            else:
                dq, dv, dw = self.method.steps(self.equations, *state)
            q[on] += dq
            v[on] += dv
            work[on] += dw
        a = np.array(self.rates)[i, : q.shape[1]]
        if len(on):
            a[on] = self.equations.many(times[on], q[on], v[on])[:, : q.shape[1]]
        return q, v, a, work


def walk(
    equations: Equations,
    method: Method,
    start: tuple[float, Floats, Floats, float],
    end: float,
    tolerance: float,
    watches: Sequence[Watch] = (),
    stops: Sequence[float] = (),
    check: Check | None = None,
    budget: int = MOST,
    left: Mapping[str, float] | None = None,
    plan: Sequence[float] = (),
) -> Path:
    """Go from a state to a time.

    Parameters
    ----------
    start : (t, q, q̇, work)
    tolerance : float
        Of the error of each step: of an input, relative to its `scale`; of a speed, to the largest met so far.
    stops : rising times
        No step passes them.
    check : Check
        Asked at every node; the path ends where it says why.
    left : mapping of a watch's name to its level
        Levels at which the path begins, and which the first step does not meet again.
    plan : rising times
        Where steps end, as far as it goes: they are judged roughly.

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
    steepest, h = first_steps(span, tolerance, equations.scale, q, v, rates)
    fastest, h = [float(x) for x in steepest], float(h)
    low_q, low_v = [0.0] * k, [0.0] * k
    grow, stiff = GROW, 0.0
    left = left or {}
    power = -1.0 / method.order
    by_code, cut = not stops or bool(plan), False
    while t < end:
        if by_code and not (len(path.t) - 1) % ROUNDS and compiled(equations, method) is not None:
            # it goes on as far as nothing happens that has to be looked at step by step
            given = {"end": end, "span": span, "tolerance": tolerance}
            state = beginning(t, q, v, rates, h, fastest, work) | {"grow": grow, "stiff": stiff}
            for names_of, low in (("lq", low_q), ("lv", low_v)):
                state |= {f"{names_of}{j}": x for j, x in enumerate(low)}
            (t, h, grow, stiff, work), q, v, low_q, low_v, rates, fastest = _marched(
                path, given, state, watches, check, budget, left, plan
            )
            left, by_code = {}, False
            if path.ended:
                return path
            continue
        if len(path.t) > budget:
            path.ended = "budget"
            return path
        i = bisect_right(stops, t)
        stop = min(stops[i], end) if i < len(stops) else end
        before, whole = h, stop - t
        i = bisect_right(plan, t + shortest(t, span))
        planned = i < len(plan)
        # where a step of the plan could not be done it is shorter
        h = min(plan[i] - t, whole, h if cut else math.inf) if planned else tried(h, whole)
        if h < shortest(t, span):
            path.ended = "lost"
            return path
        node = Node(equations, method, t, q, v, rates)
        try:
            done = method.step(equations, t, q, v, rates, h)
        except (Lost, ZeroDivisionError, ValueError, OverflowError):
            # of the rates, or of their tape
            path.rejected += 1
            h, grow, cut = shorter(h, SHRINK), 1.0, True
            continue
        error = method.size(done, allowed(tolerance, equations.scale, q, fastest, v, done.dv))
        wanted = SAFETY * error**power if error else GROW
        if not error < (ROUGH if planned else 1.0):
            path.rejected += 1
            h, grow, cut = shorter(h, wanted), 1.0, True
            continue
        cut = False
        following = longer(h, wanted, before, grow)
        try:
            found = node.met(watches, h, done, left) if watches else None
        except Lost:
            # within the step it cannot be assembled
            path.rejected += 1
            h, grow, cut = shorter(h, SHRINK), 1.0, True
            continue
        met, left, grow = None, {}, GROW
        if found is not None:
            met, level, h, done = found
            left = {met.name: level}
        stiff = stiffer(stiff, done.stiffness, method.stable)
        t = stop if h == whole else plan[i] if planned and h == plan[i] - t else t + h
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
    if isinstance(method, DormandPrince) and equations.plain:
        rounds.on_floats(loop(k, equations.rates), len(path.t) + path.rejected)
    return path


def compiled(equations: Equations, method: Method) -> Loop | None:
    """The loop of steps, where compiled code does it."""
    if not isinstance(method, DormandPrince) or not equations.plain:
        return None
    found = loop(equations.k, equations.rates)
    return None if rounds.ready(found) is None else found


def _marched(
    path: Path,
    given: dict[str, float],
    state: dict[str, Any],
    watches: Sequence[Watch],
    check: Check | None,
    budget: int,
    left: Mapping[str, float],
    plan: Sequence[float],
) -> tuple[Floats, ...]:
    """Go on by compiled code: to the end (of the plan), to where `check` ends it, or to the last node before a watch."""
    equations = path.equations
    k = equations.k
    given |= {f"scale{j}": x for j, x in enumerate(equations.scale)}
    singles = ("t", "h", "grow", "stiff", "work")
    several = [[f"{name}{j}" for j in range(k)] for name in ("q", "v", "lq", "lv", "a", "f")]
    several[4] = names(k)[2]

    def parts(of: Mapping[str, Any]) -> tuple[Floats, ...]:
        return tuple([float(np.ravel(of[name])[0]) for name in group] for group in (singles, *several))

    while True:
        before = state
        if plan:
            ahead = bisect_right(plan, path.t[-1] + shortest(path.t[-1], given["span"]))
            ends = [x for x in plan[ahead : ahead + ROUNDS] if x <= given["end"]]
            if not ends:
                return parts(before)
            found = follow(k, equations.rates, {}, state, np.array(ends)[:, None])
        else:
            found = march(k, equations.rates, given, state)
        state, table = found.state, np.array(list(found.nodes.values()))[:, :, 0].T
        taken = np.diff(table[:, 0], prepend=np.ravel(before["t"])[0]) > 0
        if not np.isfinite(table).all() or not equations.clear(table[:, 1]):
            # change points or a limit are near: step by step
            return parts(before)
        path.rejected += len(taken) - int(taken.sum())
        rows = table[taken]
        if not watches and (check is None or check.quiet(rows[:, 1 : k + 1])):
            path.extend(rows, k)
            rows = rows[:0]
        for t, *row in rows.tolist():
            q, v, rates, work = row[:k], row[k : 2 * k], row[2 * k : 3 * k + 1], row[-1]
            if watches:
                h = t - path.t[-1]
                node = Node(equations, path.method, path.t[-1], path.q[-1], path.v[-1], path.rates[-1])
                dq, dv = ([x - y for x, y in zip(a, b, strict=True)] for a, b in ((q, node.q), (v, node.v)))
                if node.met(watches, h, Step(dq, dv, 0.0, rates, (), 0.0), left):
                    return (
                        [node.t, h, 1.0, 0.0, path.work[-1]],
                        node.q,
                        node.v,
                        [0.0] * k,
                        [0.0] * k,
                        node.rates,
                        parts(before)[-1],
                    )
                left = {}
            path.put(t, q, v, rates, work)
            path.ended = check(t, q, v) if check is not None else ""
            if path.ended:
                return parts(state)
        if len(path.t) > budget:
            path.ended = "budget"
        elif plan:
            path.ended = "end" if path.t[-1] >= given["end"] else ""
        elif not state["left"][0] > 0:
            path.ended = "end" if state["t"][0] >= given["end"] else "stiff" if found.stiff[0] else "lost"
        if path.ended:
            return parts(state)


def _added(x: Floats, low: Floats, d: Floats) -> tuple[Floats, Floats]:
    """x + d of every input, and what rounding leaves."""
    high, rest = zip(*(added(*of) for of in zip(x, low, d, strict=True)), strict=True)
    return list(high), list(rest)


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
        return watch.value(
            self.t + share * h, *between(self.q, self.v, self.rates, h, done.dq, done.dv, done.rates, share)
        )

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
        except (Lost, ZeroDivisionError, ValueError, OverflowError):
            return None
        return h, done
