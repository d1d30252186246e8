"""How fast the loops of a mechanism go round along its one input, and after what way they stand as before."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Protocol

import numpy as np

from virtualwork.branch.choice import Choice
from virtualwork.branch.sampling import common_rate
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group, Turn, turns

# so many times the way in which its longest loop changes is looked at at once, of a slide
LOOPS = 4


class Repeating(Protocol):
    """What is known of a group that stands again as before."""

    @property
    def period(self) -> float:
        """After what way of the input it does."""


class Pace:
    """The pace of an assembly along its one input."""

    def __init__(self, assembly: Choice) -> None:
        self.assembly = assembly
        self.slides = assembly.mechanism.inputs[0].is_slide
        self._speeds: dict[str, float] = {}

    @cached_property
    def length(self) -> float:
        """A turn of the input, rad; of a slide the way in which the loops that it moves change, m."""
        m = self.assembly.mechanism
        return 2 * np.pi if not self.slides else self._travel() if len(m.inputs) == 1 else m.size

    def fastest(self, group: Group) -> float:
        """How many times as fast as the input the fastest body turns that a group depends on, as gears say."""
        if group.name not in self._speeds:
            steps = [*self.assembly.before(group), group]
            factors = [k for t in turns(steps) if not t.slides for _, k in t.angle.inputs]
            self._speeds[group.name] = max(map(abs, factors), default=0.0)
        return self._speeds[group.name]

    def one_turn(self, group: Group) -> float:
        """The way of the input in which that one turns once."""
        if self.slides:
            # of what a rack turns
            return min(self.length, 2 * np.pi / max(self.fastest(group), 1e-300))
        return self.length / max(1.0, self.fastest(group))

    def driving(self, group: Group) -> dict[str, float]:
        """The bodies of loops that other bodies turn with so many times as fast, among all that a group depends on."""
        result: dict[str, float] = {}
        for step in self.assembly.before(group):
            if isinstance(step, Turn):
                for body, r in step.angle.bases:
                    if isinstance(step.body, str):
                        # what a slide turns is seen itself
                        body, r = (step.body, 1.0) if isinstance(body, int) else (body, r)
                        result[body] = max(abs(r), result.get(body, 0.0))
            elif isinstance(step, Group) and step.kind == "RPR":
                result.setdefault(step.angles[0], 1.0)
        return result

    def rate(self, group: Group, seen: Mapping[str, Repeating]) -> float | None:
        """How often a turn of the input brings all that a group depends on back to where it stood; None: never."""
        if self.slides:
            return None
        rates: list[float] = []
        for step in [*self.assembly.before(group), group]:
            rates += [k for t in turns([step]) for _, k in t.angle.inputs]
            if any(t.slides and t.angle.runs for t in turns([step])):
                # it runs on and on
                return None
            if any(not float(r).is_integer() for t in turns([step]) for _, r in t.angle.turning):
                return None
            if isinstance(step, Group) and step is not group and step.kind != "PRP":
                if step.name not in seen:
                    return None
                rates.append(2 * np.pi / seen[step.name].period)
        return common_rate(rates)

    def _travel(self) -> float:
        """How far a slide goes that is the input, by the arms of the loops that it moves; at most the size of all."""
        from virtualwork.formulas.rates import Rates

        ways = []
        st = State([np.array([self.assembly.mechanism.at[0]])])
        with np.errstate(all="ignore"):
            for group in self.assembly.plan.groups:
                before = self.assembly.before(group)
                if group.kind in ("PRP", "Newton"):
                    continue
                if any(isinstance(step, Group) and step.kind == "Newton" for step in before):
                    # without a closed form there are no arms that show how far it goes
                    return self.assembly.mechanism.size
                self.assembly.run_untracked([*before, group], st)
                case = self.assembly.case(group)
                w, (v, u) = case.offset(st), case.vectors(st)
                reach = {"RRR": np.abs(v) + np.abs(u), "RRP": np.abs(v), "RPR": np.abs(w) + np.abs(v)}[
                    group.kind
                ]
                d = Rates(self.assembly.plan, st, [[1.0]])
                d.advance(before, 1)
                moved = d.right_side(group, 1)[0]
                way = float(np.max(reach / np.abs(moved))) if moved is not None else np.inf
                if 0 < way < np.inf:
                    ways.append(LOOPS * way)
        return min(self.assembly.mechanism.size, max(ways, default=np.inf))
