"""A choice of assembly: which way every loop closes, as the guess has it. Frozen data, and positions by it alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, partial

import numpy as np

from dalembert.arithmetic.guard import Lock, guarded, own_lock, unlocked
from dalembert.arithmetic.records import Record, record
from dalembert.dataclass import dataclass, field
from virtualwork.branch.sampling import depths, vanishes
from virtualwork.describe.description import Description
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.group_loops import Loops
from virtualwork.formulas.positions import State, principal, run
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Plan, Step, geared


@guarded
@record
@dataclass(frozen=True, eq=False, repr=False)
class Choice(Record):
    """A mechanism put together in one way.

    Attributes
    ----------
    mechanism : Description
    plan : Plan
        The order of solution.
    signs : dict of group name to ±1
    starts : dict of group name to the unknowns of a Newton group at the guess's input
    number : int
        1 for the guess's assembly; others count on.
    phases : dict of a gear's number to its constant Σ c·θ, rad
    """

    mechanism: Description
    plan: Plan = field(repr=False)
    signs: Mapping[str, int] = field(default_factory=dict)
    starts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    number: int = 1
    warnings: tuple[str, ...] = field(default=(), repr=False)
    phases: Mapping[int, float] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.mechanism!r}, {self.number})"

    @property
    def lock(self) -> Lock:
        """Of all that is worked out of it: its poses, loads and forces have the same."""
        return own_lock(self)

    @cached_property
    def cases(self) -> dict[str, Case]:
        """The closed forms that are ready to be solved, by their group's name."""
        return {}

    def case(self, group: Group) -> Case:
        """The closed form of a group, made ready once."""
        if group.name not in self.cases:
            self.cases[group.name] = Case(group)
        return self.cases[group.name]

    @cached_property
    def systems(self) -> dict[Group, Loops]:
        """The loops of groups without a closed form, and of all groups at once, that are ready to be solved."""
        return {}

    def loops(self, group: Group) -> Loops:
        """The loops of a group over its unknowns, made ready once."""
        if group not in self.systems:
            self.systems[group] = Loops(group)
        return self.systems[group]

    @cached_property
    def merged(self) -> tuple[Plan, Group | None]:
        """All loops at once: one plan with one group of every unknown; None where there is no loop."""
        whole = plan(self.mechanism, merged=True, phases=self.phases)
        return whole, next(iter(whole.groups), None)

    @cached_property
    def geared(self) -> set[str]:
        """Bodies of which the angle is needed with its whole turns."""
        return geared(self.plan.steps)

    @cached_property
    def plain(self) -> dict[str, Callable[[State], None]]:
        """The closed forms that keep their sign wherever the input goes, as far as is known, each ready to be solved."""
        return {
            g.name: partial(self.case(g).solve, sign=self.signs[g.name], size=self.mechanism.size)
            for g in self.plan.groups
            if g.name in self.signs and self.geared.isdisjoint(g.members)
        }

    @cached_property
    def known_steps(self) -> dict[tuple[str, ...], tuple[Step, ...]]:
        """What targets depend on, as far as requested."""
        return {}

    @unlocked
    def needed(self, targets: Iterable[str]) -> tuple[Step, ...]:
        """The steps that targets depend on; worked out once for each set of targets."""
        key = tuple(targets)
        if key not in self.known_steps:
            self.known_steps[key] = self.plan.needed(key)
        return self.known_steps[key]

    def before(self, group: Group) -> list[Step]:
        """The steps that a group depends on."""
        return [step for step in self.needed(self.plan.writes(group)) if step is not group]

    def run_untracked(self, steps: Iterable[Step], st: State) -> None:
        """Work out positions with the signs as they are, as if no change point lay on the way."""
        run(steps, st, self._close)

    def _close(self, group: Group, st: State) -> None:
        self.close_with(group, st, self.signs[group.name])

    def close_with(self, group: Group, st: State, sign: int) -> None:
        """Close a group in one of its two assemblies; angles that gears need lie within half a turn of 0."""
        self.case(group).solve(st, sign, self.mechanism.size)
        for body in self.geared.intersection(group.members):
            st.angle[body] = principal(np.angle(st.turn[body]))

    def singular_around(self, length: float) -> list[str]:
        """The closed forms, by name, that are singular in all poses around the guess: with several inputs, none a tenth of a length away."""
        at, result = self.mechanism.at, list[str]()
        golden = np.sqrt(np.arange(2.0, 2 + len(at)))
        off = (np.multiply.outer(np.arange(1.0, 25), golden) % 1.0 - 0.5) * 0.1 * length
        st, size = State([a + off[:, j] for j, a in enumerate(at)]), self.mechanism.size
        with np.errstate(all="ignore"):
            for step in self.plan.steps:
                if isinstance(step, Group) and step.kind == "Newton":
                    break
                self.run_untracked([step], st)
                if isinstance(step, Group) and step.kind != "PRP":
                    case = self.case(step)
                    if vanishes(st.margin[step.name], depths(case, st, size)[1]):
                        result.append(step.name)
                        case.solve(st, None, size)
        return result
