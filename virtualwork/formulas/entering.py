"""The formulas of an assembly in which groups enter the tape: their unknowns and every derivative of these.

So do groups without a closed form where their Jacobian is singular, groups that are singular in every pose, and groups close
to a change point, where two branches meet and a series gives what the Jacobian cannot. Whoever runs the tape solves for each
derivative in turn: the columns of a group's Jacobian and what its loops have without it (`RightSide`) are on the tape.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dalembert.arithmetic.recorded import Number
from virtualwork.formulas.positions import columns
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.recording import Recording
from virtualwork.plan.steps import Group


class Entering(Recording):
    """The formulas of an assembly in which some groups enter.

    Further inputs of the tape: `x GROUP 0` of these groups too, and `rate GROUP 0 1 0`, of the first unknown the first
    derivative over input 0 (in time: over the count of the inputs).
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


class GroupColumn(Quantity, kind="group column"):
    """An entry of the Jacobian of a group: of a loop, by an unknown."""

    is_vector = True
    group: str
    loop: int
    unknown: int

    def write(self, recording: Entering) -> Number:
        return columns(recording.solved(self.group), recording.st)[self.loop][self.unknown]


class RightSide(Quantity, kind="right side"):
    """A derivative of a loop without the unknowns' own of that order: over an input, or in time (`way`)."""

    is_vector = True
    group: str
    loop: int
    way: int
    order: int

    def write(self, recording: Entering) -> Number:
        recording.solve(recording.plan.writes(recording.solved(self.group)), self.order)
        return recording.right[self.group, self.order, self.way][self.loop]


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
