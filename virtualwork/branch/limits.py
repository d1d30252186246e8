"""Where the input can go no further: every limit of a branch, and the range around the guess between two of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from virtualwork.branch.continuation import Continuation
from virtualwork.branch.period import SAME, TURNS, Covered
from virtualwork.branch.radicand import crossing
from virtualwork.formulas.numbers import Reals
from virtualwork.plan.steps import Group

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
