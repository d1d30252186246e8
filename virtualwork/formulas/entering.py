"""The formulas of an assembly in which groups enter the tape: their unknowns and every derivative of these.

So do groups without a closed form where their Jacobian is singular, groups that are singular in every pose, and groups close
to a change point, where two branches meet and a series gives what the Jacobian cannot. Whoever runs the tape solves for each
derivative in turn: the columns of a group's Jacobian and what its loops have without it (`right side`) are on the tape.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dalembert.arithmetic.recorded import Number
from virtualwork.formulas.numbers import cross
from virtualwork.formulas.positions import columns
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.recording import Recording
from virtualwork.plan.steps import Group


class Entering(Recording):
    """The formulas of an assembly in which some groups enter.

    Further inputs of the tape: `x GROUP 0` of these groups too, and `rate GROUP 0 1 0`, of the first unknown the first
    derivative over input 0 (in time: over the count of the inputs).

    Further keys of `value`
    -----------------------
    ("group column", group, loop, unknown)   of the group's Jacobian, complex
    ("right side", group, order, way, loop)  a derivative of a loop without the unknowns' own of that order, complex
    """

    def __init__(self, entering: Iterable[str], *of: Any, **more: Any) -> None:
        self.entering = frozenset(entering)
        # the right sides that were met on the way, by group, order and way
        self.right: dict[tuple[str, int, int], list[Number]] = {}
        super().__init__(*of, **more)

    def rates_of(self, way: int, given: list[list[Number]]) -> Rates:
        return _Entering(self, way, given)

    def enters(self, group: Group) -> bool:
        return group.name in self.entering

    def _margin(self, group: str) -> Number:
        return 0.0 if self.enters(self.solved(group)) else super()._margin(group)

    def _transmission(self, group: str) -> Number:
        of = self.solved(group)
        if not self.enters(of):
            return super()._transmission(group)
        (c1, c2), *_ = columns(of, self.st)
        across = cross(c1, c2)
        return across * across / ((c1.conjugate() * c1).real * (c2.conjugate() * c2).real)

    def _group_column(self, group: str, loop: int, unknown: int) -> Number:
        return columns(self.solved(group), self.st)[loop][unknown]

    def _right_side(self, group: str, order: int, way: int, loop: int) -> Number:
        self.solve(self.plan.writes(self.solved(group)), order)
        return self.right[group, order, way][loop]


class _Entering(Rates):
    """Derivatives of which those of some groups enter."""

    def __init__(self, recording: Entering, way: int, given: list[list[Number]]) -> None:
        super().__init__(recording.plan, recording.st, given)
        self.recording, self.way = recording, way

    def _group(self, group: Group, k: int) -> None:
        if not self.recording.enters(group):
            super()._group(group, k)
            return
        name = group.name
        self.recording.right[name, k, self.way] = self.right_side(group, k)
        count = len(group.angles) + len(group.slides)
        enter = self.recording.recorder.input
        self.write(group, k, [enter(f"rate {name} {i} {k} {self.way}") for i in range(count)])
