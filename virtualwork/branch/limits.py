"""How far the input goes: every limit of a branch, the range around the guess, after how many turns it repeats itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from math import lcm
from typing import TYPE_CHECKING, Protocol

import numpy as np

from virtualwork.branch.change_point import ChangePoint
from virtualwork.branch.choice import Along
from virtualwork.branch.radicand import crossing
from virtualwork.formulas.numbers import Complexes, Reals
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group, Plan, turns

if TYPE_CHECKING:
    from virtualwork.branch.continuation import Continuation

# places nearer than this share of a turn are one
SAME = 1e-6
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


class Covered(Along, Protocol):
    """The way of the one input, which is looked through as far as it is asked for."""

    plan: Plan
    active: bool
    slides: bool
    settled: bool
    one_turn: tuple[float, dict[str, list[ChangePoint]]] | None

    def cover(self, low: float, high: float) -> None:
        """Look for change points and limits over the inputs from low to high."""


class Searched(Covered, Protocol):
    """The same with what was met on the way: where radicands cross zero, and where groups without a closed form end."""

    repeats: bool
    brackets: list[tuple[str, float, float]]
    continuations: dict[str, Continuation]

    @property
    def repetition(self) -> int | None:
        """How many turns of the input bring every group back to where it stood."""

    @property
    def turns(self) -> int | None:
        """How many turns of the input tell the poses of the branch apart."""

    @property
    def range(self) -> tuple[float, float]:
        """The ends of the input's range around the guess."""

    @property
    def has_limits(self) -> bool:
        """Was any limit met in what was covered?"""

    @property
    def period(self) -> float | None:
        """The input's span after which the branch repeats."""

    def margin(self, group: Group, q: Reals) -> Reals:
        """The group's radicand at inputs q."""


def own_range(track: Searched) -> tuple[float, float]:
    """The ends of the input's range around the guess; infinite where none was met."""
    low, high = -np.inf, np.inf
    within = [n for n in TURNED if n <= (track.repetition or TURNS)]
    for reach in SLIDES if track.slides else within[-1:] if track.repeats else within:
        back = 0 if track.repeats else reach
        track.cover(track.start - back * track.length, track.start + reach * track.length)
        ends = _around(track)
        low = max((v.input for v in ends if v.side > 0 and v.input < track.start), default=-np.inf)
        high = min((v.input for v in ends if v.side < 0 and v.input > track.start), default=np.inf)
        # a slide: on, until every range that was met has both of its ends
        if np.isfinite(high - low) and not (track.slides and (ends[0].side < 0 or ends[-1].side > 0)):
            break
    return low, high


def limits(track: Searched) -> list[Limit]:
    """Where the input can go no further, over one period of the branch or what was covered; see `Track.limits`."""
    back = 0.0 if track.repeats else track.length
    track.cover(track.start - back, track.start + (track.period or track.length))
    # a slide is looked along farther
    if not track.slides and not track.has_limits:
        return []
    low, high = track.range
    apart = not track.repeats or track.turns != track.repetition
    if track.period is None or not np.isfinite(high - low) or not apart:
        return _ends(track)
    track.cover(low, low + track.period)
    near = SAME * track.length
    return [v for v in _around(track) if -near < v.input - low < track.period - near]


def _around(track: Searched) -> list[Limit]:
    """The limits in what was covered; of a branch that repeats itself, before and after it too."""
    ends = _ends(track)
    if not track.repeats:
        return ends
    again = (track.repetition or 1) * track.length
    return [replace(v, input=v.input + n * again) for n in (-1, 0, 1) for v in ends]


def _ends(track: Searched) -> list[Limit]:
    """The limits in what was covered."""
    by_name = {g.name: g for g in track.plan.groups}
    found = [
        Limit(name, *crossing(partial(track.margin, by_name[name]), a, b)) for name, a, b in track.brackets
    ]
    for name, way in track.continuations.items():
        found += [Limit(name, q, side) for q, side in way.ends]
    unique: list[Limit] = []
    for limit in sorted(found, key=lambda x: x.input):
        if not unique or abs(limit.input - unique[-1].input) > 1e-10 * track.length:
            unique.append(limit)
    return unique


def repetition(track: Covered) -> int | None:
    """How many turns of the input bring every group back to where it stood; see `Track.repetition`."""
    if not track.active or track.slides:
        return None
    track.cover(track.start, track.start + track.length)
    if track.settled or track.one_turn is not None or not track.plan.groups:
        return 1
    steps = track.assembly.needed([key for g in track.plan.groups for key in track.plan.writes(g)])
    factors = [k for t in turns(steps) for _, k in t.angle.inputs]
    ratios = [Fraction(k).limit_denominator(TURNS) for k in factors]
    if any(abs(float(r) - k) > 1e-12 * abs(k) for r, k in zip(ratios, factors, strict=True)):
        return None
    whole = lcm(*(r.denominator for r in ratios))
    q = track.start + track.length * (np.arange(COMPARED) + 0.5) / COMPARED
    here = _stands(track, q)
    for n in range(whole, TURNS + 1, whole):
        track.cover(track.start - n * track.length, track.start + track.length)
        # beyond a limit there is nothing to compare: what is not assembled contradicts nothing
        if not (np.abs(_stands(track, q - n * track.length) - here) > SAME).any():
            return n
    return None


def _stands(track: Covered, q: Reals) -> Complexes:
    """Rotations and slides (over the size) of all groups at inputs q; NaN where not assembled."""
    st = State([q], many=True)
    with np.errstate(all="ignore"):
        track.run(track.assembly.needed([key for g in track.plan.groups for key in track.plan.writes(g)]), st)
    rows = [st.turn[b] for g in track.plan.groups for b in g.members]
    rows += [st.slide[s] / track.assembly.mechanism.size for g in track.plan.groups for s in g.slides]
    return np.array([np.broadcast_to(row, q.shape) for row in rows])
