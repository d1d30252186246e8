"""A way through time: steps of chosen length, each as long as its error allows, up to what must not be passed."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dalembert.arithmetic.engines import rounds
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
from virtualwork.intime.coordinates import Monitor
from virtualwork.intime.equations import Lost
from virtualwork.intime.explicit import DormandPrince
from virtualwork.intime.marching import ROUNDS, Nodes, beginning, follow, loop, march
from virtualwork.intime.meeting import Meeting, Stretch
from virtualwork.intime.path import Path, compiled
from virtualwork.intime.powers import state_names
from virtualwork.intime.watch import Floats, Step, Watch

# steps of one simulation
MOST = 200_000
# of a planned step's error over the one allowed: halves of what a tolerance chose may be so much rougher than this one's
ROUGH = 256.0
# of a planned step: one so short is left out
SLIVER = 1e-3
# what a step raises that cannot be done
UNDONE = (Lost, ZeroDivisionError, ValueError, OverflowError)


@dataclass
class Walk:
    """The way to a time, step by step.

    Attributes
    ----------
    end : float
    tolerance : float
        Of the error of each step: of an input, relative to its `scale`; of a speed, to the largest met so far.
    watches : sequence of Watch
    stops : rising times
        No step passes them.
    monitor : Monitor
        Asked at every node; the path ends where it says why.
    budget : int
        Of steps.
    left : mapping of a watch's name to its level
        Levels at which the path begins, and which the first step does not meet again.
    plan : rising times
        Where steps end, as far as it goes: they are judged roughly.
    """

    path: Path
    end: float
    tolerance: float
    watches: Sequence[Watch]
    stops: Sequence[float]
    monitor: Monitor
    budget: int
    left: Mapping[str, float]
    plan: Sequence[float]
    # called with the time reached
    progress: Callable[[float], None] | None = None
    # by how much the next step may be longer, and how many have been limited by the method's stability
    grow: float = GROW
    stiff: float = 0.0
    # whether the last one was refused
    cut: bool = False

    def go(self, t: float, q: Floats, v: Floats, work: float) -> None:
        """Fill the path from a state; its `ended` says why: "end", "stiff", "lost", "budget", a watch's name, or what the monitor says."""
        path, equations = self.path, self.path.equations
        try:
            rates = equations(t, q, v)
        except Lost:
            path.put(t, q, v, [0.0] * (equations.k + 1), work)
            path.ended = "lost"
            return
        path.put(t, q, v, rates, work)
        self.span = self.end - t
        fastest, h = first_steps(self.span, self.tolerance, equations.scale, q, v, rates)
        self.fastest, self.h = [float(x) for x in fastest], float(h)
        # what rounding leaves over
        self.low_q, self.low_v = [0.0] * equations.k, [0.0] * equations.k
        self.still: Mapping[str, float] = {}
        by_code = not self.stops or bool(self.plan)
        while not path.ended:
            if not path.end < self.end:
                path.ended = "end"
                if isinstance(path.method, DormandPrince) and equations.plain:
                    rounds.on_floats(loop(equations.k, equations.rates), len(path.rows) + path.rejected)
            elif by_code and not path.steps % ROUNDS and compiled(equations, path.method) is not None:
                # it goes on as far as nothing happens that has to be looked at step by step
                self._marches()
                self.left, by_code = {}, False
            else:
                self._steps()
            if self.progress is not None:
                self.progress(path.end)

    # --- step by step ---------------------------------------------------------------------------------------------
    def _steps(self) -> None:
        """One step, or none and a shorter one to be tried next."""
        path = self.path
        t, q, v, _, work = path.last
        if path.steps >= self.budget:
            path.ended = "budget"
            return
        least = shortest(t, self.span)
        stop = min(_next(self.stops, t), self.end)
        before, whole, mark = self.h, stop - t, self._mark(t + least)
        planned = mark < math.inf
        # where a step of the plan could not be done it is shorter
        h = min(mark - t, whole, before if self.cut else math.inf) if planned else tried(before, whole)
        if h < min(least, whole):
            path.ended = "lost"
            return
        # as long as the times at its ends say, whatever their rounding
        there = stop if h == whole else mark if h == mark - t else t + h
        length = there - t
        taken, wanted = self._tried(length, ROUGH if planned else 1.0)
        if taken is None:
            path.rejected += 1
            self.h, self.grow, self.cut = shorter(h, wanted), 1.0, True
            return
        done, step = taken
        following = longer(h, wanted, before, self.grow)
        self.left, self.grow, self.cut, self.h = self.still, GROW, False, following
        if step is not None:
            self.left = {step.watch.name: step.level}
            if step.done is None or t + step.h == t:
                path.ended = step.watch.name if step.watch.ends else ""
                return
            there, done = t + step.h if step.h < length else there, step.done
        self.stiff = stiffer(self.stiff, done.stiffness, path.method.stable)
        t = there
        q, self.low_q = _added(q, self.low_q, done.dq)
        v, self.low_v = _added(v, self.low_v, done.dv)
        self.fastest = [max(f, abs(x)) for f, x in zip(self.fastest, v, strict=True)]
        path.put(t, q, v, done.rates, work + done.work)
        if step is not None and step.watch.ends:
            path.ended = step.watch.name
        else:
            path.ended = self.monitor(t, q, v)
        if not path.ended and self.stiff >= STIFF:
            path.ended = "stiff"

    def _mark(self, after: float) -> float:
        """Where the plan ends the next step; a mark that is almost reached is left out."""
        mark = _next(self.plan, after)
        following = _next(self.plan, mark)
        return following if mark - after < SLIVER * (following - mark) < math.inf else mark

    def _tried(self, h: float, most: float) -> tuple[tuple[Step, Meeting | None] | None, float]:
        """A step and what it meets, None where its error is too large or it cannot be done; the length wanted, over its own."""
        path, method, scale = self.path, self.path.method, self.path.equations.scale
        t, q, v, rates, _ = path.last
        try:
            done = method.step(path.equations, t, q, v, rates, h)
        except UNDONE:
            # of the rates, or of their tape
            return None, SHRINK

        def judged(step: Step) -> tuple[bool, float]:
            error = method.size(step, allowed(self.tolerance, scale, q, self.fastest, v, step.dv))
            return error < most, SAFETY * error ** (-1.0 / method.order) if error else GROW

        holds, wanted = judged(done)
        if not holds:
            return None, wanted
        try:
            met = self._met(h, done) if self.watches else None
        except UNDONE:
            # within the step it cannot be assembled
            return None, SHRINK
        if met is not None and met.done is not None:
            # the whole step may have passed unseen what one that ends at a kink sees
            holds, shorter = judged(met.done)
            if not holds:
                return None, shorter * met.h / h
        return (done, met), wanted

    # --- by compiled code -----------------------------------------------------------------------------------------
    def _marches(self) -> None:
        """Go on to the end (of the plan), to where the monitor ends it, or to the last node before a watch."""
        path, equations, k = self.path, self.path.equations, self.path.equations.k
        inputs = {"end": self.end, "span": self.span, "tolerance": self.tolerance}
        inputs |= {f"scale{j}": x for j, x in enumerate(equations.scale)}
        state = beginning(Nodes(np.array(path.rows[-1]), k), self.h, self.fastest)
        state |= {"grow": self.grow, "stiff": self.stiff}
        lows = [f"l{name}" for name in state_names(k)[1:]]
        state |= dict(zip(lows, (*self.low_q, *self.low_v), strict=True))
        while not path.ended:
            before = state
            if self.plan:
                ahead = bisect_right(self.plan, path.end + shortest(path.end, self.span))
                ends = [x for x in self.plan[ahead : ahead + ROUNDS] if x <= self.end]
                if not ends:
                    break
                marched = follow(k, equations.rates, {}, state, np.array(ends)[:, None])
            else:
                marched = march(k, equations.rates, inputs, state)
            nodes = marched.nodes.at(np.s_[:, 0])
            taken = np.diff(nodes.t, prepend=path.end) > 0
            if not np.isfinite(nodes.table).all() or not equations.clear(nodes.q[:, 0]):
                # change points or a limit are near: step by step
                break
            path.rejected += len(taken) - int(taken.sum())
            step = self._passed(nodes.at(taken))
            if step is not None:
                state = before | dict.fromkeys(lows, 0.0) | {"h": step, "grow": 1.0, "stiff": 0.0}
                break
            state = marched.state
            if path.ended:
                break
            if path.steps >= self.budget:
                path.ended = "budget"
            elif self.plan:
                path.ended = "end" if path.end >= self.end else ""
            elif not state["left"][0] > 0:
                path.ended = "end" if state["t"][0] >= self.end else "stiff" if marched.stiff[0] else "lost"
        own = ("h", "grow", "stiff", *lows, *(f"f{j}" for j in range(k)))
        self.h, self.grow, self.stiff, *rest = (float(np.ravel(state[name])[0]) for name in own)
        self.low_q, self.low_v, self.fastest = rest[:k], rest[k : 2 * k], rest[2 * k :]

    def _passed(self, nodes: Nodes) -> float | None:
        """Take nodes over, as far as none has to be met before; then the length of the step that does so."""
        path = self.path
        if not self.watches and self.monitor.quiet(nodes.q):
            path.rows += nodes.table.tolist()
            return None
        for row in nodes.table.tolist():
            t, q, v, rates, _ = path.parted(row)
            if self.watches:
                before, place, speed, _, _ = path.last
                dq, dv = ([x - y for x, y in zip(*of, strict=True)] for of in ((q, place), (v, speed)))
                try:
                    met = self._met(t - before, Step(dq, dv, 0.0, rates, (), 0.0)) is not None
                except UNDONE:
                    met = True
                if met:
                    return float(t - before)
                self.left = self.still
            path.rows.append(row)
            path.ended = self.monitor(t, q, v)
            if path.ended:
                break
        return None

    def _met(self, h: float, done: Step) -> Meeting | None:
        """The first watch that a step passes a level of."""
        stretch = Stretch(self.path, h, done, self.left)
        meeting, self.still = stretch.first(self.watches), stretch.still
        return meeting


def _next(times: Sequence[float], after: float) -> float:
    """The first of rising times after one; infinite where there is none."""
    i = bisect_right(times, after)
    return times[i] if i < len(times) else math.inf


def _added(x: Floats, low: Floats, d: Floats) -> tuple[Floats, Floats]:
    """x + d of every input, and what rounding leaves."""
    high, rest = zip(*(added(*of) for of in zip(x, low, d, strict=True)), strict=True)
    return list(high), list(rest)
