"""The formulas of one assembly, written down on a tape: positions, rates, loads, effort, joint forces.

The same formulas as everywhere, handed recorded numbers. What depends on more than the pose enters as an input of the
tape beside the inputs of the mechanism: the sign of a closed form where it turns over on the way, the unknowns of a
group that has none, the whole turns of an angle, the force that a table gives.

Inputs of a tape
----------------
`q0`, `v0`, `a0`, `j0`   input 0 of the mechanism and its derivatives in time; `q1` … of further ones
`sign GROUP`             ±1, of a closed form that changes its sign along the input
`x GROUP 0`              the unknowns of a group without a closed form: angles, then slides
`near BODY`              the angle, with its whole turns, of a body of which the angle itself is needed
`near spring 0`          the same of a torsion spring's twist
`table 0 x`, `table 0 y` the force of the first load that is given by a table
`time`                   where a table is over it
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from dalembert.arithmetic.guard import Lock, guarded, own_lock
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder, bare, squared
from dalembert.arithmetic.systems import regularity
from dalembert.arithmetic.tape import Tape
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.asked import FORCES, JOINTS, Key, names
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.newton import gaps, put_unknowns, unknowns
from virtualwork.formulas.numbers import PARTS, WRITTEN, Written
from virtualwork.formulas.positions import State, columns, run
from virtualwork.formulas.rates import Rates, chain_rule
from virtualwork.formulas.touches import Touch
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Path, Plan, Step, Term, path_reads

if TYPE_CHECKING:
    from virtualwork.formulas.loads import Tabled
    from virtualwork.formulas.pose_forces import PoseForces

# sin² of a transmission angle below which a force may have no digit left
NEAR = 1e-18
NAMES = ("q", "v", "a", "j")


@guarded
class Recording:
    """The formulas of an assembly, written down as far as they are asked for.

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
        self.st = State([self.recorder.input(f"q{j}") for j in range(k)], kind=kind)
        self.rates = [
            [self.recorder.input(f"{name}{j}") if there else None for j in range(k)]
            for name, there in zip(NAMES[1:], moves, strict=True)
        ]
        self.cases = {g.name: Case(g, bare) for g in plan.groups if g.kind != "Newton"}
        self.by = [self.rates_of(j, [[1.0] if i == j else [] for i in range(k)]) for j in range(k)]
        given = [[rate[j] for rate in self.rates] for j in range(k)]
        # in time, with several inputs
        self.together = self.rates_of(k, given) if k > 1 else None
        self._done: set[tuple[int, int, int]] = set()
        self._values: dict[Key, Number] = {}
        self._forces: PoseForces | None = None
        # how far the loops of groups without a closed form are from closing as they enter, m
        self.open_loops: dict[str, Number] = {}

    @property
    def lock(self) -> Lock:
        """That of the recorder, into which motions of one assembly, and variants, write."""
        return own_lock(self.recorder)

    def rates_of(self, way: int, given: list[list[Number]]) -> Rates:
        """The derivatives over an input, or in time with several inputs (`way` is their count), before any is written down."""
        return Rates(self.plan, self.st, given)

    # --- solving ------------------------------------------------------------------------------------------------
    def enters(self, group: Group) -> bool:
        """Whether the unknowns of a group enter: it has no closed form."""
        return group.kind == "Newton"

    def unknowns(self, group: Group) -> list[Number]:
        """The unknowns of a group, angles and then slides, as they enter."""
        return [
            self.recorder.input(f"x {group.name} {i}") for i in range(len(group.angles) + len(group.slides))
        ]

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
        steps = self.plan.needed(targets)
        for k in range(order + 1):
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

    @property
    def along(self) -> Rates:
        """The derivatives over the one input, or in time with several."""
        return self.by[0] if self.together is None else self.together

    def _in_time(self, order: int, get: Callable[[int], Number]) -> Number:
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
            from virtualwork.formulas.recorded_forces import forces_of

            self._forces = forces_of(self)
        return self._forces

    # --- what can be asked ------------------------------------------------------------------------------------------
    def value(self, key: Key) -> Number:
        """A quantity, written down once.

        Keys
        ----
        ("point", body, z, node or None, order)      position or a time derivative, complex
        ("angle", body, order)                       θ in (−π, π], ω, α, the angular jerk
        ("turn", body)                               e^{iθ}, complex
        ("dpoint", body, z, node or None, j, order)  ∂P/∂q_j, complex; order 2 with one input: ∂²P/∂q²
        ("dangle", body, j, order)
        ("slide", guide, order), ("dslide", guide, j, order)
        ("effort", j), ("newton-euler", j), ("force", joint's key, body), ("moment", joint's key, body)
        ("reaction", joint's name, body)             of all joints of that name: a pin, and the guide its point runs in
        ("shaking",), ("shaking moment",)            complex; real
        ("load", n), ("load at", n), ("load torque", n)   of the load case: a force, where it acts, a torque
        ("rail", guide)                              a unit vector along a guide
        ("contact", cam)                             how hard a cam, from 0, presses on its follower
        ("generalized", j)                           the effort as if every motor sat on the body its angle is measured from
        ("applied", link), ("applied moment", link)  what acts on a link but its weight and inertia, about its centre of mass
        ("bearing", n), ("rubbing", n)               of the n-th contact with friction: the force that it bears, a pin's complex, a
                                                     guide's along its normal; the rate at which it slides
        ("entry", row, column)                       of the equations of all links (`statics`): of A, or of b (column None)
        ("over", number)                             what the table of a load is over
        ("pressure angle", cam), ("curvature radius", cam)
        ("closed", groups' names …)                  a finite number where these groups are assembled
        ("margin", group's name)                     the radicand of a closed form, relative
        ("transmission", group's name)               sin² of the transmission angle of a two-link group
        ("twist", number)                            of a torsion spring, within half a turn of free
        ("column", loop, unknown)                    of the Jacobian of all loops (`loops`), complex; as their columns
        ("size",)                                    the mechanism's characteristic length
        ("regularity", group's name)                 of a larger group: how far its Jacobian is from singular, of 1
        """
        if key not in self._values:
            kind, *of = key
            if kind in FORCES:
                found = self.forces.value(key)
            else:
                found = getattr(self, f"_{kind.replace('-', '_').replace(' ', '_')}")(*of)
            self._values[key] = 0.0 if found is None else bare(found)
        return self._values[key]

    def takes(self, keys: Iterable[Key]) -> bool:
        """Whether quantities can be written down: friction iterates, and redundant statics is a system of its own."""
        kinds = {key[0] for key in keys}
        if kinds.isdisjoint(FORCES):
            return True
        if self.mechanism.friction:
            return False
        return kinds.isdisjoint(JOINTS) or not self.forces.redundant

    def tape(self, keys: Iterable[Key], more: Mapping[str, Number] | None = None) -> Tape:
        """The tape of quantities: outputs are called as `names` says; and of `more` numbers by name."""
        return self.recorder.tape({**self.outputs(keys), **(more or {})})

    def outputs(self, keys: Iterable[Key]) -> dict[str, Number]:
        """The numbers of quantities, written down, by their names."""
        outputs: dict[str, Number] = {}
        for key in keys:
            value = self.value(key)
            parts = [value.real, value.imag][: len(names(key))]
            if key[0] in FORCES:
                parts = [RECORDED.unsigned(part) for part in parts]
            outputs.update(zip(names(key), parts, strict=True))
        return outputs

    def state(self) -> Iterator[Number]:
        """What is written down that much depends on: directions, slides, and of forces what blocks keep too."""
        yield from (*self.st.turn.values(), *self.st.slide.values())
        if self._forces:
            yield from (value[1] for of, value in self._forces.block.kept.items() if of.lasts)

    def _point(self, body: str, z: complex, node: str | None, order: int) -> Number:
        path = self._path(body, z, node)
        self.solve(path_reads(path), order)
        if order == 0:
            return self.st.at(path)
        return self._in_time(order, lambda k: self.along.vector(path, k))

    def _dpoint(self, body: str, z: complex, node: str | None, j: int, order: int = 1) -> Number:
        path = self._path(body, z, node)
        self.solve(path_reads(path), order)
        return self.by[j].vector(path, order)

    def _path(self, body: str, z: complex, node: str | None) -> Path:
        if node is not None:
            return node, ()
        base, terms = self.plan.anchors[body]
        return base, (*terms, Term(z, body))

    def _turn(self, body: str) -> Number:
        self.solve((f"angle:{body}",), 0)
        return self.st.turn[body]

    def _twist(self, number: int) -> Number:
        spring = self.mechanism.torsion_springs[number]
        if all(self.plan.angles[body].by_inputs for body in spring.links):
            # the inputs alone fix it, whole turns included
            return 0.0
        from virtualwork.formulas.block import Shared

        self.solve([f"angle:{body}" for body in spring.links], 0)
        return Shared.within(self.st, spring)

    @cached_property
    def tables(self) -> list[Tabled]:
        """The loads that tables give, in the order in which their forces enter."""
        return self.forces.case.tables

    def _angle(self, body: str, order: int) -> Number:
        if body == GROUND:
            return 0.0
        self.solve((f"angle:{body}",), order)
        if order == 0:
            return WRITTEN.angle(self.st.turn[body])
        return self._in_time(order, lambda k: self.along.angle[body][k - 1])

    def _dangle(self, body: str, j: int, order: int = 1) -> Number:
        if body == GROUND:
            return 0.0
        self.solve((f"angle:{body}",), order)
        return self.by[j].angle[body][order - 1]

    def _slide(self, guide: int, order: int) -> Number:
        self.solve((f"slide:{guide}",), order)
        if order == 0:
            return self.st.slide[guide]
        return self._in_time(order, lambda k: self.along.slide[guide][k - 1])

    def _dslide(self, guide: int, j: int, order: int = 1) -> Number:
        self.solve((f"slide:{guide}",), order)
        return self.by[j].slide[guide][order - 1]

    def _pressure_angle(self, cam: int) -> Number:
        return self._touch(cam).at(self.st).pressure_angle()

    def _curvature_radius(self, cam: int) -> Number:
        return self._touch(cam).at(self.st).curvature_radius()

    def _touch(self, cam: int) -> Touch:
        touch = Touch(self.mechanism, self.plan, self.mechanism.cam_drives[cam])
        self.solve(touch.targets, 0)
        return touch

    def _over(self, number: int) -> Number:
        """An angle of unknown turns in (−π, π]."""
        load = self.tables[number]
        if load.axis == "time":
            return self.recorder.input("time")
        if load.axis == "input":
            return self.st.inputs[0]
        angle = self.plan.angles[load.body]
        if load.axis == "angle" and not angle.bases:
            return self.st.affine(angle)
        return self.value(("angle", load.body, int(load.axis == "speed")))

    def hangs_on(self, key: Key) -> tuple[str, ...]:
        """The groups that a quantity depends on, by name: where one of them is not assembled, it has no value.

        What cancels is not on the tape: a platform that stays level has the angle 0 there, whatever carries it.
        """
        steps = () if key[0] in ("margin", "transmission", "size") else self.steps(key)[0]
        return tuple(step.name for step in steps if isinstance(step, Group))

    def steps(self, key: Key) -> tuple[tuple[Step, ...], int]:
        """The steps that a quantity depends on, and how often they are differentiated."""
        kind, *of = key
        order = of[-1] if kind in ("point", "angle", "slide", "dpoint", "dangle", "dslide") else 0
        if kind in ("point", "dpoint"):
            targets = path_reads(self._path(*of[:3]))
        elif kind in ("angle", "dangle", "turn"):
            targets = {f"angle:{of[0]}"}
        elif kind in ("slide", "dslide"):
            targets = {f"slide:{of[0]}"}
        elif kind in ("pressure angle", "curvature radius"):
            targets = Touch(self.mechanism, self.plan, self.mechanism.cam_drives[of[0]]).targets
        else:
            targets = {key for g in self.plan.groups for key in self.plan.writes(g)}
            order = self.forces.case.targets()[1] if kind in FORCES else 0
        return self.plan.needed(targets), order

    def _closed(self, *groups: str) -> Number:
        total: Number = 0.0
        for group in map(self.solved, groups):
            if self.enters(group):
                total = sum(map(abs, unknowns(group, self.st)), total)
            else:
                total = total + WRITTEN.sqrt(self.st.margin[group.name])
                if group.kind == "PRP":
                    total = total + abs(self.st.slide[group.slides[0]])
        return total

    def _regularity(self, group: str) -> Number:
        cols = columns(self.solved(group), self.st)
        return regularity([[part(c) for c in row] for row in cols for part in PARTS])

    @cached_property
    def loops(self) -> Group | None:
        """All loops at once: one group of every unknown; None where there is no loop."""
        return next(iter(plan(self.mechanism, merged=True).groups), None)

    def _column(self, loop: int, unknown: int) -> Number:
        assert self.loops is not None
        self.solve([key for s in self.plan.steps for key in self.plan.writes(s)], 0)
        return columns(self.loops, self.st)[loop][unknown]

    def _size(self) -> Number:
        longest: Number = 0.0
        for span in map(bare, self.mechanism.spans):
            longest = RECORDED.select(span - longest, span, longest)
        return longest

    def _margin(self, group: str) -> Number:
        return self.st.margin[self.solved(group).name]

    def _transmission(self, group: str) -> Number:
        """Between the two links, between a rod and the normal of its guide, of a slot as it passes its pivot, between guides."""
        of = self.solved(group)
        margin: Number = self.st.margin[of.name]
        if of.kind != "RPR":
            return margin
        size, w = bare(self.mechanism.size), self.cases[of.name].offset(self.st)
        return margin * (size * size / (w.conjugate() * w).real)

    def solved(self, group: str) -> Group:
        """A group, with its position written down."""
        of = next(g for g in self.plan.groups if g.name == group)
        self.solve(self.plan.writes(of), 0)
        return of
