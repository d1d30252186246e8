"""The change points and limits of the loops of a mechanism along its one input, in what was looked through.

What a group has in one round of all that it depends on it has in every other: it is looked through once, and carried on.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from dalembert.dataclass import dataclass, replace
from virtualwork.branch.pace import Pace
from virtualwork.formulas.numbers import Reals
from virtualwork.plan.steps import Group

if TYPE_CHECKING:
    # a mechanism that passes no change point does not load it
    from virtualwork.branch.change_point import Along, ChangePoint, ChangePoints

# places nearer than this share of a turn of what turns fastest are one
SAME = 1e-6
NOWHERE: Reals = np.empty(0)


@dataclass(frozen=True)
class Bracket:
    """Where a radicand crosses zero: between two inputs, or as far from them as `on`."""

    group: str
    low: float
    high: float
    on: float = 0.0

    def carried(self, on: float) -> Bracket:
        """The same farther on."""
        return replace(self, on=self.on + on)


@dataclass(frozen=True)
class Seen:
    """What a group has from one input on to where everything that it depends on stands as before."""

    period: float
    changes: tuple[ChangePoint, ...]
    brackets: tuple[Bracket, ...]


class Noted:
    """What was looked through: of each group its change points, and between which inputs it has a limit."""

    def __init__(self, track: Along, pace: Pace) -> None:
        self.track, self.pace = track, pace
        self.flips: dict[str, Reals] = {}
        self.changes: dict[str, ChangePoints] = {}
        self.brackets: list[Bracket] = []
        # of groups that come back to where they stood within a turn
        self.seen: dict[str, Seen] = {}

    def take_over(self, group: Group, a: float, b: float) -> None:
        """Note the change points and limits from a to b of a group that stands again as where it was looked through."""
        seen, edge = self.seen[group.name], SAME * self.pace.one_turn(group)

        def copies(at: float) -> Reals:
            first, last = (a - edge - at) / seen.period, (b + edge - at) / seen.period
            return np.arange(np.ceil(first), np.floor(last) + 1) * seen.period

        changes = [replace(c, input=c.input + on) for c in seen.changes for on in copies(c.input).tolist()]
        self._add(group, changes)
        present = set(self.brackets)
        for x in seen.brackets:
            others = (x.carried(on) for on in copies((x.low + x.high) / 2 + x.on).tolist())
            self.brackets += [other for other in others if other not in present]

    def note(
        self, group: Group, flips: Reals, brackets: list[Bracket], share: float
    ) -> tuple[ChangePoint, ...]:
        """Keep a group's change points, each with the branch through it, and its limits; return the change points."""
        if not len(flips) and not brackets:
            return ()
        around = [x for x in [*self.brackets, *brackets] if x.group == group.name]
        out = {x for x in around for where in flips if x.on == 0 and x.low <= where <= x.high}
        self.brackets[:] = [x for x in [*self.brackets, *brackets] if x not in out]
        noted, same = self.flips.get(group.name, NOWHERE), SAME * self.pace.one_turn(group)
        fresh = np.array([where for where in flips if np.abs(noted - where).min(initial=np.inf) > same])
        if not len(fresh):
            return ()
        from virtualwork.branch.change_point import through

        self.track.assembly.plain.pop(group.name, None)
        self.flips[group.name] = self._as_passed(group, np.sort(np.append(noted, fresh)))
        # the branch through each one can be told only once all of them are known
        changes = [through(self.track, group, float(where), share) for where in fresh]
        self._add(group, changes)
        return tuple(changes)

    def _add(self, group: Group, changes: Iterable[ChangePoint]) -> None:
        """Keep change points, those that are kept already apart."""
        kept = [*self.changes.get(group.name, ()), *changes]
        if not kept:
            return
        from virtualwork.branch.change_point import ChangePoints

        # of two that are one, the first
        order = sorted(range(len(kept)), key=lambda i: (kept[i].input, i))
        same, chosen = SAME * self.pace.one_turn(group), list[int]()
        for i in order:
            if chosen and kept[i].input - kept[chosen[-1]].input <= same:
                chosen[-1] = min(chosen[-1], i)
            else:
                chosen.append(i)
        self.changes[group.name] = ChangePoints(kept[i] for i in chosen)
        self.flips[group.name] = self._as_passed(group, np.array([kept[i].input for i in chosen]))

    def _as_passed(self, group: Group, flips: Reals) -> Reals:
        """Change points in their order; a guess at one of them means the branch beyond it."""
        here = np.abs(flips - self.track.start) < 1e-9 * self.pace.one_turn(group)
        return np.where(here, np.minimum(flips, self.track.start), flips)

    def apart(self, group: Group, flips: Reals, period: float = np.inf) -> Reals:
        """Change points in their order, each once; of a group that repeats itself, those of one period."""
        flips, same = np.sort(flips), SAME * self.pace.one_turn(group)
        flips = flips[np.diff(flips, prepend=-np.inf) > same]
        return flips[flips < flips[0] + period - same] if len(flips) else flips


def divides(period: float, length: float) -> bool:
    """Whether a length is a whole number of periods."""
    return abs(length / period - round(length / period)) < SAME and period <= length * (1 + SAME)
