"""The formulas of one assembly, written down on a tape: positions, rates, loads, effort, joint forces.

The same formulas as everywhere, handed recorded numbers. What depends on more than the pose enters as an input of the
tape in addition to the inputs of the mechanism: the sign of a closed form where it turns over on the way, the unknowns of a
group that has none, the whole turns of an angle, the force that a table gives.

Inputs of a tape
----------------
`q0`, `v0`, `a0`, `j0`   input 0 of the mechanism and its derivatives in time; `q1` … of further ones
`sign GROUP`             ±1, of a closed form that changes its sign along the input
`x GROUP 0`              the unknowns of a group without a closed form: angles, then slides
`near BODY`              the angle, with its whole turns, of a body of which the angle itself is needed
`near spring 0`          the same of a torsion spring's twist
`table 0 x`, `table 0 y` the force of the first load with a table
`slope 0 x`, `slope 0 y` its derivative to what the table is over
`time`                   where a table is over it

Groups of which every derivative enters (`Entering`)
----------------------------------------------------
They are groups without a closed form where their Jacobian is singular, groups that are singular in every pose, and groups close
to a change point, where two branches meet and a series gives what the Jacobian cannot. Whoever runs the tape solves for each
derivative in turn: the columns of the Jacobian and what its loops have without it (`RightSide`) are on the tape.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from math import pi
from typing import TYPE_CHECKING, Any

from dalembert.arithmetic.guard import Lock, guarded, own_lock
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder, bare, squared
from dalembert.arithmetic.tape import Tape
from virtualwork.describe.description import Description
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.group_loops import gaps, put_unknowns
from virtualwork.formulas.numbers import WRITTEN, Written
from virtualwork.formulas.positions import State, columns, run
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.rates import Rates, chain_rule
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Plan

if TYPE_CHECKING:
    from virtualwork.formulas.loads import Tabled
    from virtualwork.formulas.pose_forces import PoseForces

# sin² of a transmission angle below which a force may have no digit left
NEAR = 1e-18
NAMES = ("q", "v", "a", "j")


@guarded
class Recording:
    """The formulas of an assembly, written down as far as requested.

    Parameters
    ----------
    mechanism : Description
        Its constants may vary (`Varied`).
    plan : Plan
        Of the same description.
    signs : mapping of group name to ±1
        Of the closed forms.
    moves : tuple of bool
        Whether the inputs have a speed, an acceleration, a jerk; what they have not is zero and costs nothing.
    turning_over : collection of group names
        Whose sign is an input of the tape.
    geared : set of str
        Bodies whose angle itself is needed.
    settled : bool
        Whether the unknowns of groups without a closed form are exact as they enter. Else one Newton step is on the
        tape, without which a derivative to a dimension would not see what the group makes of it.
    kind : Written
        The operations of its numbers.
    """

    def __init__(
        self,
        mechanism: Description,
        plan: Plan,
        signs: Mapping[str, Number],
        moves: tuple[bool, ...] = (True, True, True),
        turning_over: Iterable[str] = (),
        geared: Iterable[str] = (),
        settled: bool = True,
        recorder: Recorder | None = None,
        kind: Written = WRITTEN,
    ) -> None:
        self.mechanism, self.plan, self.signs, self.moves = mechanism, plan, signs, moves
        self.recorder = recorder or Recorder()
        self.turning_over, self.geared = frozenset(turning_over), frozenset(geared)
        self.settled = settled
        k = len(mechanism.inputs)
        self.kind = kind
        # a whole turn of a spring that is wound
        self.turn: Number = 2 * pi
        self.st = State([self.recorder.input(f"q{j}") for j in range(k)], kind=kind)
        self.rates = [
            [self.recorder.input(f"{name}{j}") if there else None for j in range(k)]
            for name, there in zip(NAMES[1:], moves, strict=True)
        ]
        self.cases = {g.name: Case(g, bare) for g in plan.groups if g.kind != "Newton"}
        self.by = [self.rates_of(j, [[1.0] if i == j else [] for i in range(k)]) for j in range(k)]
        rates = [[rate[j] for rate in self.rates] for j in range(k)]
        # in time, with several inputs
        self.together = self.rates_of(k, rates) if k > 1 else None
        self._done: set[tuple[int, int, int]] = set()
        # what is solved, to which order
        self._solved: dict[str, int] = {}
        self._values: dict[Quantity, Number] = {}
        # what tells where quantities cannot be had, by these and by whether loops may open
        self.doubts: dict[tuple[tuple[Quantity, ...], bool], tuple[Quantity, ...]] = {}
        # what the friction of joints is solved from, once it is written
        self.rubbing: Tape | None = None
        self._forces: PoseForces | None = None
        # how far the loops of groups without a closed form are from closing as they enter, m
        self.open_loops: dict[str, Number] = {}

    @property
    def lock(self) -> Lock:
        """That of the recorder, into which motions of one assembly, and variants, write."""
        return own_lock(self.recorder)

    def rates_of(self, way: int, rates: list[list[Number]]) -> Rates:
        """The derivatives over an input, or in time with several inputs (`way` is their count), before any is written down."""
        return Rates(self.plan, self.st, rates)

    # --- solving ------------------------------------------------------------------------------------------------
    def enters(self, group: Group) -> bool:
        """Whether the unknowns of a group enter: it has no closed form."""
        return group.kind == "Newton"

    def unknowns(self, group: Group) -> list[Number]:
        """The unknowns of a group, angles and then slides, as they enter."""
        return [self.recorder.input(name) for name in group.unknowns]

    def step(self, group: Group, st: State) -> list[Number] | None:
        """By how much a group's unknowns that enter are off, to first order; None where they are exact."""
        return None if self.settled else self.kind.solve(columns(group, st), gaps(group, st))

    def _close(self, group: Group, st: State) -> None:
        if self.enters(group):
            x = self.unknowns(group)
            put_unknowns(group, st, x)
            self.open_loops[group.name] = WRITTEN.sqrt(sum(map(squared, gaps(group, st)), 0.0))
            step = self.step(group, st)
            if step is not None:
                put_unknowns(group, st, [a + b for a, b in zip(x, step, strict=True)])
            return
        sign: Number = self.signs[group.name]
        if group.name in self.turning_over:
            sign = self.recorder.input(f"sign {group.name}")
        self.cases[group.name].solve(st, sign, bare(self.mechanism.size))
        for body in sorted(self.geared.intersection(group.members)):
            st.angle[body] = self.unwrapped(f"near {body}", st.turn[body])

    def unwrapped(self, near: str, turn: Number) -> Number:
        """The angle of a rotation next to one that enters, and is it but for rounding: with its whole turns."""
        about = self.recorder.input(near)
        return about + WRITTEN.angle(turn * WRITTEN.exp(about).conjugate())

    def solve(self, targets: Iterable[str], order: int) -> None:
        """Write down what targets depend on, up to an order of derivatives."""
        new = [target for target in targets if self._solved.get(target, -1) < order]
        steps = self.plan.needed(new) if new else ()
        for k in range(order + 1) if new else ():
            ways: list[tuple[int, Rates | None]] = [(-1, None)] if k == 0 else [*enumerate(self.by)]
            if k and self.together is not None:
                ways.append((len(self.by), self.together))
            for number, rates in ways:
                for step in steps:
                    key = id(step), k, number
                    if key in self._done:
                        continue
                    self._done.add(key)
                    if rates is None:
                        run([step], self.st, self._close)
                    else:
                        rates.advance([step], k)
        self._solved.update(dict.fromkeys(new, order))

    @property
    def along(self) -> Rates:
        """The derivatives over the one input, or in time with several."""
        return self.by[0] if self.together is None else self.together

    def in_time(self, order: int, get: Callable[[int], Number]) -> Number:
        """A derivative in time, of derivatives over the one input or along all."""
        if self.together is not None:
            return get(order)
        return chain_rule(order, get, [rate[0] for rate in self.rates])

    # --- forces ---------------------------------------------------------------------------------------------------
    @property
    def forces(self) -> PoseForces:
        """The loads over the recorded pose, with everything solved that they depend on."""
        if self._forces is None:
            # a dozen files: a motion without forces does not load them
            from virtualwork.formulas.pose_forces import forces_of

            self._forces = forces_of(self)
        return self._forces

    @cached_property
    def tables(self) -> list[Tabled]:
        """The loads that tables give, in the order in which their forces enter."""
        return self.forces.case.tables

    # --- quantities -----------------------------------------------------------------------------------------------
    def value(self, quantity: Quantity) -> Number:
        """A quantity, written down once."""
        if quantity not in self._values:
            value = quantity.write(self)
            self._values[quantity] = 0.0 if value is None else bare(value)
        return self._values[quantity]

    def takes(self, quantities: Iterable[Quantity]) -> bool:
        """Whether quantities can be written down: friction iterates, and redundant statics is a system of its own."""
        forces = [quantity for quantity in quantities if quantity.is_force]
        if not forces:
            return True
        if self.mechanism.friction:
            return False
        return not (any(each.is_joint_force for each in forces) and self.forces.redundant)

    def tape(self, quantities: Iterable[Quantity], more: Mapping[str, Number] | None = None) -> Tape:
        """The tape of quantities: outputs are called by their `names`; and of `more` numbers by name."""
        return self.recorder.tape({**self.outputs(quantities), **(more or {})})

    def outputs(self, quantities: Iterable[Quantity]) -> dict[str, Number]:
        """The numbers of quantities, written down, by their names."""
        outputs: dict[str, Number] = {}
        for quantity in quantities:
            value = self.value(quantity)
            parts = [value.real, value.imag][: len(quantity.names)]
            if quantity.is_force:
                parts = [RECORDED.unsigned(part) for part in parts]
            outputs.update(zip(quantity.names, parts, strict=True))
        return outputs

    def state(self) -> Iterator[Number]:
        """What is written down that much depends on: directions, slides, and of forces what blocks keep too."""
        yield from (*self.st.turn.values(), *self.st.slide.values())
        if self._forces:
            yield from (value[1] for of, value in self._forces.pose.kept.items() if of.lasts)

    @cached_property
    def loops(self) -> Group | None:
        """All loops at once: one group of every unknown; None where there is no loop."""
        return next(iter(plan(self.mechanism, merged=True).groups), None)

    def solved(self, group: str) -> Group:
        """A group, with its position written down."""
        of = next(g for g in self.plan.groups if g.name == group)
        self.solve(self.plan.writes(of), 0)
        return of


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

    def rates_of(self, way: int, rates: list[list[Number]]) -> Rates:
        return _Entering(self, way, rates)

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

    def __init__(self, recording: Entering, way: int, rates: list[list[Number]]) -> None:
        super().__init__(recording.plan, recording.st, rates)
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
