"""How far the input goes: every limit of a branch, the range around the guess, after how many turns it repeats itself.

And why a pose cannot be assembled: the group that does not close, by how much, and the nearest input where it would.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import cached_property, partial
from math import isfinite, lcm

import numpy as np

from dalembert.arithmetic.guard import guarded
from dalembert.dataclass import dataclass, replace
from virtualwork.branch.noted import SAME
from virtualwork.branch.track import Track
from virtualwork.describe import AssemblyError
from virtualwork.formulas.closed_forms import Gap
from virtualwork.formulas.newton import newton
from virtualwork.formulas.numbers import EPS, Complexes, Reals
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group, turns

# turns of the input within which a branch is looked for to come back to itself
TURNS = 32
# poses of a turn that are compared for it
COMPARED = 60
# turns of the input within which the ends of its range are looked for
TURNED = (1, 2, 4, 8, 16, TURNS)
# sizes of the mechanism within which the limits of a slide are looked for
SLIDES = (1, 2, 4)


@dataclass(frozen=True)
class Limit:
    """Where the input can go no further, because a group's radicand crosses zero; `side` is where it is assembled."""

    group: str
    input: float
    side: int


@dataclass(frozen=True)
class Shortfall:
    """The first group of a pose that does not close.

    Attributes
    ----------
    group : str
    gap : Gap
        The length that it needs and the one that there is, m.
    nearest : float or None
        The nearest input at which it would close, rad or m; None with several inputs, and where none is known.
    """

    group: str
    gap: Gap
    nearest: float | None

    def text(self, length: Callable[[float], str] = "{:.6g} m".format) -> str:
        """By how much it does not close, with lengths as they are to be shown."""
        text = self.gap.text(length)
        return text if text.startswith(self.group.split(" + ")[0]) else f"{self.group}: {text}"


@guarded
class Reach:
    """How far the one input goes, and the branch's own scale; each is looked for when first asked for."""

    def __init__(self, track: Track) -> None:
        self.track, self.lock = track, track.lock
        # where a radicand is zero between two inputs, and on which side of it the group is assembled
        self._crossings: dict[tuple[str, float, float], tuple[float, int]] = {}

    @cached_property
    def turns(self) -> int | None:
        """How many turns of the input tell the poses of the branch apart: its period.

        As many as bring every group back to where it stood; a branch between two limits needs only what tells its own
        inputs apart, where change points do not make other limits of other turns. None with a slide or several inputs, and where no number of turns up to
        `TURNS` does it.
        """
        n, track = self.repetition, self.track
        if n == 1 or track.slides or not track.has_limits:
            return n
        low, high = self.range
        if not np.isfinite(high - low):
            return n
        own = max(1, int(np.ceil((high - low) / track.length)))
        if n is None or own >= n or not track.crossings:
            return own
        track.cover(track.start, track.start + n * track.length)
        ends, whole = np.array([limit.input for limit in self._ends()]), n * track.length
        beside = np.abs((ends[:, None] + own * track.length - ends + whole / 2) % whole - whole / 2).min(
            axis=1
        )
        return own if (beside < SAME * track.length).all() else n

    @cached_property
    def repetition(self) -> int | None:
        """How many turns of the input bring every group back to where it stood, as far as poses can be compared.

        A branch that passes an odd number of change points in a turn needs two; a fractional gear its own number.
        """
        track = self.track
        if not track.active or track.slides:
            return None
        track.cover(track.start, track.start + track.length)
        if any(t.slides and t.angle.runs for t in turns(track.plan.steps)):
            # what a rack moves runs on and on
            return None
        if track.settled or track.comes_back or not track.plan.groups:
            return 1
        steps = track.assembly.needed([key for g in track.plan.groups for key in track.plan.writes(g)])
        factors = [k for t in turns(steps) for _, k in t.angle.inputs]
        ratios = [Fraction(k).limit_denominator(TURNS) for k in factors]
        if any(abs(float(r) - k) > 1e-12 * abs(k) for r, k in zip(ratios, factors, strict=True)):
            return None
        whole = lcm(*(r.denominator for r in ratios))
        q = track.start + track.length * (np.arange(COMPARED) + 0.5) / COMPARED
        here = self._stands(q)
        for n in range(whole, TURNS + 1, whole):
            track.cover(track.start - n * track.length, track.start + track.length)
            # beyond a limit there is nothing to compare: what is not assembled contradicts nothing
            if not (np.abs(self._stands(q - n * track.length) - here) > SAME).any():
                return n
        return None

    def _stands(self, q: Reals) -> Complexes:
        """Rotations and slides (over the size) of all groups at inputs q; NaN where not assembled."""
        plan, assembly = self.track.plan, self.track.assembly
        st = State([q])
        with np.errstate(all="ignore"):
            self.track.run(assembly.needed([key for g in plan.groups for key in plan.writes(g)]), st)
        rows = [st.turn[b] for g in plan.groups for b in g.members]
        rows += [st.slide[s] / assembly.mechanism.size for g in plan.groups for s in g.slides]
        return np.array([np.broadcast_to(row, q.shape) for row in rows])

    @property
    def period(self) -> float | None:
        """The input's span after which the branch repeats, rad; None where it does not, or with a slide."""
        return None if self.turns is None else self.turns * self.track.length

    def in_period(self, q: float) -> float:
        """An input in [0, period of the branch)."""
        period = self.period
        if period is None or not isfinite(q):
            return q
        q %= period
        # an input of −1e-15 is 0, not a whole period
        return 0.0 if period - q < 1e-9 or q < 1e-9 else q

    def distinct(self, inputs: Iterable[float]) -> tuple[float, ...]:
        """Inputs in their order in [0, period of the branch), each once."""
        unique: list[float] = []
        for q in sorted(map(self.in_period, inputs)):
            if self.period is None or not unique or q - unique[-1] > 1e-8:
                unique.append(q)
        return tuple(unique)

    def apart(self, q: Reals, from_: float) -> Reals:
        """How far inputs are from one, by the nearest way round the branch."""
        d = np.asarray(q - from_)
        return d if self.period is None else d - self.period * np.round(d / self.period)

    @cached_property
    def range(self) -> tuple[float, float]:
        """The ends of the input's range around the guess, or next to it, rad or m; infinite where none was met."""
        track = self.track
        low, high = -np.inf, np.inf
        within = [n for n in TURNED if n <= (self.repetition or TURNS)]
        for reach in SLIDES if track.slides else within[-1:] if track.repeats else within:
            back = 0 if track.repeats else reach
            track.cover(track.start - back * track.length, track.start + reach * track.length)
            ends = self._around()
            start = self._inside(ends)
            low = max((v.input for v in ends if v.side > 0 and v.input < start), default=-np.inf)
            high = min((v.input for v in ends if v.side < 0 and v.input > start), default=np.inf)
            # a slide: on, until every range that was met has both of its ends
            if np.isfinite(high - low) and not (track.slides and (ends[0].side < 0 or ends[-1].side > 0)):
                break
        return low, high

    def _inside(self, ends: list[Limit]) -> float:
        """The guess's own input; if it cannot be assembled there, the nearest one inside a limit."""
        start, nudge = self.track.start, SAME * self.track.length
        near = sorted((v.input + v.side * nudge for v in ends), key=lambda q: abs(q - start))
        return next((q for q in (start, *near) if np.isfinite(self._stands(np.array([q]))).all()), start)

    def limits(self) -> list[Limit]:
        """Where the input can go no further, over one period of the branch or what was covered, to full precision.

        The poses of a branch between two limits are distinguished over less than brings them back: ends of other ranges
        are those of the turns in which its own lies.
        """
        track = self.track
        back = 0.0 if track.repeats else track.length
        track.cover(track.start - back, track.start + (self.period or track.length))
        # a slide is looked along farther
        if not track.slides and not track.has_limits:
            return []
        low, high = self.range
        apart = not track.repeats or self.turns != self.repetition
        if self.period is None or not np.isfinite(high - low) or not apart:
            return self._ends()
        track.cover(low, low + self.period)
        near = SAME * track.length
        return [v for v in self._around() if -near < v.input - low < self.period - near]

    def _around(self) -> list[Limit]:
        """The limits in what was covered; of a branch that repeats itself, before and after it too."""
        ends = self._ends()
        if not self.track.repeats:
            return ends
        again = (self.repetition or 1) * self.track.length
        return [replace(v, input=v.input + n * again) for n in (-1, 0, 1) for v in ends]

    def _ends(self) -> list[Limit]:
        """The limits in what was covered."""
        track = self.track
        by_name = {g.name: g for g in track.plan.groups}
        limits = []
        for x in track.brackets:
            here = x.group, x.low, x.high
            if here not in self._crossings:
                self._crossings[here] = crossing(partial(track.margin_at, by_name[x.group]), x.low, x.high)
            q, side = self._crossings[here]
            limits.append(Limit(x.group, q + x.on, side))
        for name, way in track.continuations.items():
            limits += [Limit(name, q, side) for q, side in way.ends]
        unique: list[Limit] = []
        order = [*by_name]
        for limit in sorted(limits, key=lambda x: x.input):
            if not unique or abs(limit.input - unique[-1].input) > 1e-10 * track.length:
                unique.append(limit)
            # groups that depend on the one that ends here end with it
            elif order.index(limit.group) < order.index(unique[-1].group):
                unique[-1] = limit
        return unique

    def shortfall(self, inputs: tuple[float, ...]) -> Shortfall | None:
        """Say why a pose cannot be assembled; None where it can.

        Parameters
        ----------
        inputs : tuple of float
            rad, or m for a slide.

        Examples
        --------
        A rod of 50 mm that should reach a line 52 mm away.

        >>> from virtualwork import Guess, Guide, Input, Link, Mechanism
        >>> m = Mechanism({"O": (0, 0)}, {"crank": Link({"O": (0, 0), "A": (0.06, 0)}),
        ...               "rod": Link({"A": (0, 0), "B": (0.05, 0)})}, [Guide("B", "rod")],
        ...               inputs=Input("crank"), guess=Guess(0.0, {"rod": 0.1}))
        >>> found = m.assembly.reach.shortfall((np.arcsin(52 / 60),))
        >>> found.text(), round(float(np.degrees(found.nearest)), 6)
        ('rod reaches 0.05 m, 0.052 m needed: 0.002 m short', 56.44269)
        """
        st, track = State(list(inputs)), self.track
        if track.active:
            track.cover(inputs[0], inputs[0])
        with np.errstate(all="ignore"):
            for step in track.plan.steps:
                if isinstance(step, Group):
                    gap = None
                    if step.kind == "Newton":
                        gap = self._left(step, inputs)
                    elif step.name not in track.folded:
                        gap = track.assembly.case(step).gap(st)
                    if gap is not None:
                        return Shortfall(step.name, gap, self._nearest(inputs[0]))
                try:
                    track.run([step], st)
                except ZeroDivisionError:
                    # the ends of a dyad coincide: what follows has no place, and no gap
                    return None
        return None

    def nowhere(self, of: str = "") -> AssemblyError:
        """The error of a mechanism that cannot be assembled at any input that was looked at."""
        gap = self.shortfall(self.track.assembly.mechanism.at)
        why = f"; at the guess {gap.text()}" if gap else ""
        return AssemblyError(f"the mechanism cannot be assembled at any input{of}{why}")

    def _nearest(self, q: float) -> float | None:
        """The limit of the input next to q, on q's own turn; of two as near, the one towards the guess."""
        track = self.track
        if not track.active:
            return None
        apart = [float(self.apart(np.array(q), limit.input)) for limit in self.limits()]
        least = min(map(abs, apart), default=0.0)
        near = [q - d for d in apart if abs(d) <= least + 1e-9 * track.length]
        return min(near, key=lambda x: abs(x - track.start)) if near else None

    def _left(self, group: Group, inputs: tuple[float, ...]) -> Gap | None:
        """The least gap that Newton-Raphson leaves in a group without a closed form, from the guess's own pose on."""
        assembly = self.track.assembly
        st = self.track.pose(assembly.needed(assembly.plan.writes(group)), inputs)
        unknowns = [*(st.turn[b] for b in group.members), *(st.slide[s] for s in group.slides)]
        if np.isfinite(unknowns).all():
            return None
        start = np.asarray(assembly.starts[group.name], dtype=float)[None]
        loops = assembly.loops(group)
        x, _ = newton(loops, st, start, assembly.mechanism.size)
        gap = float(np.linalg.norm(loops.over(st)(x)[0]))
        return Gap(gap, 0.0, "its loops have a gap of {by} at least")


def crossing(margin: Callable[[float], float], a: float, b: float) -> tuple[float, int]:
    """The radicand's crossing between a and b: regula falsi (Illinois), then the last bits by bisection.

    Returns it, and on which side of it the group is assembled, ±1.
    """
    fa, fb = margin(a), margin(b)
    side = -1 if fa >= 0 else 1
    for _ in range(200):
        if fa == 0 or fb == 0 or abs(b - a) <= 2 * EPS * max(abs(a), abs(b)):
            break
        q = b - fb * (b - a) / (fb - fa)
        if not min(a, b) < q < max(a, b):
            q = (a + b) / 2
            if q in (a, b):
                break
        f = margin(q)
        if (f >= 0) != (fb >= 0):
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = q, f
    return (a if abs(fa) < abs(fb) else b), side
