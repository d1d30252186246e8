"""The formulas of an assembly with every number of its description as an input, for a second run in 32 digits.

What the plan forms of dimensions, differences of coordinates and sums of angles, is then on the tape too, and rounds in
the second run as little as all the rest. A file's decimals enter as they are written there; numbers that came as
floats are exactly these.

Further inputs of the tape
--------------------------
`sign GROUP`         of every closed form that has two assemblies
`links.crank.B.x`    a dimension, by its path
`guess crank`        an angle of the guess, and `at 0`, an input there: of gears, belts and racks, whose constant is that of the guess
`phase 0`            the constant of one of these that the guess fixes by way of other links
`slip 0`             which way the first contact slips, ±1
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal
from functools import cached_property
from typing import Any

from dalembert.arithmetic.doubled import PI, Doubled
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.recorded import Number, Recorder, bare, lifted
from dalembert.arithmetic.varied import Precise, Varied
from virtualwork.describe.cams import Cam
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, changed, dimensions, number_of
from virtualwork.describe.laws import splined
from virtualwork.formulas.branch import Branch
from virtualwork.formulas.group_loops import gaps, unknowns
from virtualwork.formulas.numbers import Written
from virtualwork.formulas.positions import State
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import Recording
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Plan, turns

# of 1e-15 of a quarter turn a guide stands at it, as in `plan.topology.direction`
QUARTER = PI * 0.5


class Meeting(Written):
    """Recorded numbers, of two assemblies that meet in every pose."""

    def sqrt(self, x: Number) -> Number:
        """The root of the size."""
        return super().sqrt(abs(bare(x)))


MEETING = Meeting()


class Unrounded(Written):
    """Recorded numbers whose linear systems round no constant to 16 digits.

    Recorded numbers leave arithmetic of constants to Python: of a column of ones, as of slides along fixed lines, the
    reflection's √3 would be a float, and the solution no better in 32 digits than in 16.
    """

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder

    def system(self, rows: list[list[Number]], right: list[Number], least: float = 0.0) -> list[Number]:
        """Solve rows·x = right."""
        return super().system([self._written(row) for row in rows], self._written(right), least)

    def _written(self, row: list[Number]) -> list[Number]:
        """The numbers of a row; a constant but zero, which costs nothing, is an operation too."""
        return [x if isinstance(x, (int, float)) and x == 0 else lifted(self.recorder, bare(x)) for x in row]


class Numbers:
    """A description whose numbers are inputs of the tape, called by their paths.

    Attributes
    ----------
    mechanism : Description
    known : dict of an input's name to its value
    """

    def __init__(self, m: Description, recorder: Recorder) -> None:
        self._of, self._recorder = m, recorder
        self.known: dict[str, Doubled] = {}
        numbers: dict[str, Any] = {}
        for path, dimension in dimensions(m).items():
            if dimension.where[0] != "inputs":
                number = self._number(dimension)
                if isinstance(number, Varied):
                    numbers[path] = number
        self.mechanism = changed(m, numbers)
        if m.meshes:
            self.mechanism = replace(self.mechanism, guess=self._guess())
        if m.cams:
            pi: Any = self.enter("pi", math.pi, PI)
            cams = tuple(
                replace(cam, pi=pi, spline=self._spline(f"cam {i}", cam))
                for i, cam in enumerate(self.mechanism.cams)
            )
            self.mechanism = replace(self.mechanism, cams=cams)

    def _number(self, dimension: Dimension) -> Any:
        x = float(complex(number_of(self._of, dimension)).real)
        exact = Doubled(x, self.rest(dimension.kind, x))
        if dimension.where[0] == "guides" and dimension.where[-1] == "angle":
            quarters = round(x / (math.pi / 2))
            if abs(x / (math.pi / 2) - quarters) <= 1e-15 * max(1.0, abs(quarters)):
                exact = QUARTER * float(quarters)
        if not exact.low and (x == 0 or (dimension.kind not in ("angle", "length") and abs(x) == 1)):
            # it is as exact as it stands, and costs nothing; of lengths of 1 there are roots and angles
            return x
        return self.enter(dimension.path, x, exact)

    def enter(self, name: str, x: float, exact: Doubled) -> Precise:
        """A number as an input of the tape."""
        self.known[name] = exact
        return Precise(x, self._recorder.input(name))

    def _spline(self, name: str, cam: Cam) -> Any:
        """The spline through a cam's table, to 32 digits; None of a law."""
        if cam.history is None:
            return None

        def number(of: str, x: Decimal) -> Any:
            high = float(x)
            low = float(x - Decimal(high))
            return self.enter(f"{name} {of}", high, Doubled(high, low)) if high or low else 0.0

        kind = "length" if cam.slides else "angle"
        off = [(self.rest("angle", at), self.rest(kind, lift)) for at, lift in cam.history]
        return splined(cam.history, off, number)

    def rest(self, kind: str, x: float) -> float:
        """What a number of the description is exactly, less the float."""
        decimals = self._of.decimals
        return 0.0 if decimals is None else decimals.rest(kind, x)

    def _guess(self) -> Any:
        m = self._of
        angles: Mapping[str, Any] = {
            name: self.enter(f"guess {name}", x, Doubled(x, self.rest("angle", x))) if x else x
            for name, x in m.guess.angles.items()
        }
        at: list[Any] = []
        for j, (x, entry) in enumerate(zip(m.at, m.inputs, strict=True)):
            exact = Doubled(x, self.rest("length" if entry.is_slide else "angle", x))
            at.append(self.enter(f"at {j}", x, exact) if x else x)
        return type(m.guess)(at, angles, m.guess.points)


@guarded
class Exact(Recording):
    """The formulas of an assembly, with its numbers as inputs.

    Parameters
    ----------
    branch : Branch
        The assembly.
    plain : Recording
        The formulas as they are.
    """

    def __init__(self, branch: Branch, plain: Recording) -> None:
        recorder = Recorder()
        numbers = Numbers(branch.mechanism, recorder)
        self.known, self.folded = numbers.known, frozenset(branch.folded)
        order = plan(numbers.mechanism)
        self.phases: dict[str, float] = {}
        open_gears = {g for turn in turns(order.steps) for g, _ in turn.angle.gears}
        if open_gears:
            # from the links in the place of the guess
            self.phases = {f"phase {g}": branch.phases[g] for g in open_gears}
            phases: dict[int, Any] = {
                g: numbers.enter(f"phase {g}", branch.phases[g], Doubled(branch.phases[g]))
                for g in open_gears
            }
            order = plan(numbers.mechanism, phases=phases)
        order = _named_as(order, branch.plan)
        super().__init__(
            numbers.mechanism,
            order,
            branch.signs,
            plain.moves,
            [g.name for g in order.groups if g.kind != "Newton"],
            branch.geared,
            settled=False,
            recorder=recorder,
            kind=Unrounded(recorder),
        )
        if any(spring.turns for spring in self.mechanism.torsion_springs):
            self.turn = 2.0 * bare(numbers.enter("pi", math.pi, PI))

    @cached_property
    def closed(self) -> list[Group]:
        """The groups with a closed form that has two assemblies."""
        return [g for g in self.plan.groups if g.kind not in ("Newton", "PRP")]

    def _close(self, group: Group, st: State) -> None:
        if group.name in self.folded and not self.enters(group):
            # where the numbers do not quite meet, the root says how far off the assemblies are
            kind, st.kind = st.kind, MEETING
            self.cases[group.name].solve(st, 1.0, bare(self.mechanism.size))
            st.kind = kind
            return
        super()._close(group, st)

    def step(self, group: Group, st: State) -> list[Number] | None:
        return None if group.name in self.folded else super().step(group, st)

    # --- redundant statics ----------------------------------------------------------------------------------------
    @cached_property
    def balances(self) -> dict[int, Number]:
        """What the unknown forces that enter leave of every equation."""
        left: dict[int, Number] = {}
        for (row, column), part in self.forces.system.items():
            if column is not None:
                part = part * self.recorder.input(f"f {column}")
            left[row] = left.get(row, 0.0) + part
        return left


def _named_as(order: Plan, own: Plan) -> Plan:
    """An order of solution with the names of the groups of another.

    Where shares of gears cancel, a link is no part of a group in floats but is one as a number that enters.
    """
    names = iter([group.name for group in own.groups])
    steps = (replace(step, name=next(names)) if isinstance(step, Group) else step for step in order.steps)
    return replace(order, steps=tuple(steps))


class Unknown(Quantity, kind="unknown"):
    """An unknown of a group without a closed form."""

    group: str
    number: int

    def write(self, recording: Exact) -> Number:
        return unknowns(recording.solved(self.group), recording.st)[self.number]


class Gap(Quantity, kind="gap"):
    """What the unknowns of a group leave open of a loop."""

    is_vector = True
    group: str
    loop: int

    def write(self, recording: Exact) -> Number:
        return gaps(recording.solved(self.group), recording.st)[self.loop]


class Balance(Quantity, kind="balance"):
    """What the forces that enter leave of an equation of redundant statics."""

    row: int

    def write(self, recording: Exact) -> Number:
        return recording.balances.get(self.row, 0.0)
