"""The first level that a step passes, and the step that ends there.

Where a quantity turns, and where it passes a level, its polynomial over the step says (`passing`). The polynomial is
not as exact as the method: the time is that of the method's own steps, and a turn close to the level is computed by them too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.passing import DEGREE, SAMPLED, at, basis, offsets, speeds, through, turns, zero
from virtualwork.intime.path import Path
from virtualwork.intime.watch import Floats, Step, Watch, sign

# of the range of a quantity over a step: a turn so near its level is computed by the method itself
NEAR = 0.05
# of what it comes to over a step: on which side of its own level it lies there is not known
OWN = 1e-9
# how near a level that was met just now a step begins at most, of the same
LEFT = 1e-6
# steps of Newton's method, or of the secant; then only halvings
NEWTONS, MOST = 12, 80
END = np.array([[0.0, 1.0]])
# shares of a step between which a parabola turns, one after the other
PARABOLAS = (0.02, 1e-3, 1e-4)


class Meeting(NamedTuple):
    """A watch, the level it has met, the length of the step that ends there, and that step; None where it has no length."""

    watch: Watch
    level: float
    h: float
    done: Step | None


@dataclass
class Stretch:
    """A step from the last node of a path: its length, what it does, and the levels at which it begins."""

    path: Path
    h: float
    done: Step
    left: Mapping[str, float]

    def __post_init__(self) -> None:
        # levels that are not left over all the step
        self.still: dict[str, float] = {}
        _, q, v, rates, _ = self.path.last
        self._places, self._speeds = [], []
        h, done = self.h, self.done
        for x, speed, a, dq, dv, a1 in zip(q, v, rates, done.dq, done.dv, done.rates, strict=False):
            c = offsets(speed, a, h, dq, speed + dv, a1)
            self._places.append([x + d for d in c[:-1]] + [x + dq])
            self._speeds.append(speeds(speed, a, h, c, speed + dv, a1))

    def first(self, watches: Sequence[Watch]) -> Meeting | None:
        """The first level that is passed; None where there is none.

        Raises
        ------
        Lost
            Where the mechanism cannot be assembled within the step.
        """
        every = (meeting for watch in watches if (meeting := self._of(watch)) is not None)
        return min(every, key=lambda meeting: meeting.h, default=None)

    def _of(self, watch: Watch) -> Meeting | None:
        b = self._controls(watch)
        low, high = float(b.min()), float(b.max())
        near = NEAR * (high - low) if watch.ends else 0.0
        every = (self._met(watch, level, b, near) for level in watch.inside(low - near, high + near))
        passed = (meeting for meeting in every if meeting is not None)
        return min(passed, key=lambda meeting: meeting.h, default=None)

    def _controls(self, watch: Watch) -> Reals:
        """The control values of what is watched."""
        t, _, _, _, _ = self.path.last
        places, rates = np.array(self._places).T, np.array(self._speeds).T
        if not watch.linear:
            places, rates = (basis(DEGREE, SAMPLED) @ x for x in (places, rates))
        steps = np.linspace(0.0, self.h, len(places)).tolist()
        states = zip(steps, places.tolist(), rates.tolist(), strict=True)
        values = np.array([watch.value(t + x, q, v) for x, q, v in states])
        return values if watch.linear else np.asarray(through() @ values)

    def _met(self, watch: Watch, level: float, b: Reals, near: float) -> Meeting | None:
        """Where one level is passed."""
        g = b - level
        size = float(np.abs(g).max())
        left = self.left.get(watch.name) == level
        own = not g[0] or (left and abs(g[0]) <= LEFT * size + watch.noise)
        if own:
            g[0] = 0.0
        side = watch.side or sign(float(g[0]))
        if side * g[0] < 0:
            return Meeting(watch, level, 0.0, None)
        rest = side * g[1:] if side else np.abs(g[1:]) * (g[1:].min() * g[1:].max() > 0)
        # where it lies between its control values, and they beyond the level, there is no turn to look for
        shares = END if rest.min() > near else turns(g[None])
        low, slack = 0.0, OWN * size + watch.noise
        for x, value in zip(shares[0, 1:].tolist(), at(g[None], shares)[0, 1:].tolist(), strict=True):
            if own:
                if abs(value) <= slack:
                    continue
                # here it has left its own level
                side, own = side or sign(value), False
                if side * value < 0:
                    return Meeting(watch, level, 0.0, None)
            elif x > low:
                end, gap = x * self.h, side * value
                if x < 1.0 and abs(value) < near:
                    end, gap = self._turn(watch, level, side, low, x)
                if gap <= 0:
                    start = float(zero(side * g[None], np.array([low]), np.array([x]))[0]) * self.h
                    return self._sharpened(watch, level, side, low * self.h, end, min(start, end))
                if x < 1.0 and gap <= watch.touch:
                    return Meeting(watch, level, end, self._step(end))
            low = x
        if own:
            self.still[watch.name] = level
        elif watch.ends:
            watch.side = side
        return None

    # --- by the method's own steps --------------------------------------------------------------------------------
    def _step(self, h: float) -> Step:
        path = self.path
        t, q, v, rates, _ = path.last
        return path.method.step(path.equations, t, q, v, rates, h)

    def _state(self, h: float, done: Step) -> tuple[float, Floats, Floats]:
        t, q, v, _, _ = self.path.last
        there = [x + d for x, d in zip(q, done.dq, strict=True)]
        return t + h, there, [x + d for x, d in zip(v, done.dv, strict=True)]

    def _turn(self, watch: Watch, level: float, side: int, low: float, x: float) -> tuple[float, float]:
        """When the quantity is nearest to the level close to a share of the step, and how far it lies there."""

        def gap(h: float) -> float:
            return side * (watch.value(*self._state(h, self._step(h))) - level)

        h = x * self.h
        for share in PARABOLAS:
            d = min(share * self.h, 0.5 * (h - low * self.h), 0.5 * (self.h - h))
            if not d > 0:
                break
            before, here, after = gap(h - d), gap(h), gap(h + d)
            bend = before - 2 * here + after
            if not bend > 0:
                break
            h += max(-d, min(d, 0.5 * d * (before - after) / bend))
        return h, gap(h)

    def _sharpened(self, watch: Watch, level: float, side: int, low: float, high: float, h: float) -> Meeting:
        """The step that ends at a level, passed between two lengths, by Newton's method within them."""
        t = self.path.end
        enough = 2 * EPS * max(abs(t), high) if watch.ends else 1e-7 * high
        # of the secant, where no derivative is known
        before: tuple[float, float] | None = None
        for i in range(MOST):
            done = self._step(h)
            state = self._state(h, done)
            gap = side * (watch.value(*state) - level)
            low, high = (h, high) if gap > 0 else (low, h)
            rate = 0.0
            if watch.rate is not None:
                rate = side * watch.rate(*state, done.rates)
            elif before is not None and h != before[0]:
                rate = (gap - before[1]) / (h - before[0])
            before = h, gap
            change = -gap / rate if rate else 0.0 if not gap else 0.5 * (low + high) - h
            if not gap or (rate and abs(change) <= enough) or high - low <= enough:
                break
            new = h + change
            h = new if low < new < high and i < NEWTONS else 0.5 * (low + high)
        return Meeting(watch, level, h, done)
