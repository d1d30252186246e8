"""The formulas of an assembly with nothing in them that counts as exact but what the user gave.

The constants of the plan, vectors and angles formed of dimensions, enter the tape with what their forming rounds: what
hangs on them alone is then on the tape too, where a mechanism has links that stand still. The unknowns x of a group
that enter are off by one step of Newton's, J⁻¹ times what they leave open of the group's loops. It is on the tape: so
a rounding in forming several loops, and one that reaches the result besides, counts once and with its sign.

Further inputs of the tape
--------------------------
`z 0 x`, `z 0 y`                      a vector of the plan
`constant BODY`, `whole BODY`         the constant of an angle in the steps, and in the plan's angles
`inverse GROUP 0 0`                   J⁻¹ of a group's loops
`step`                                1: how much of Newton's steps is made
`f 0`                                 the first unknown of redundant statics
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any

from dalembert.arithmetic.recorded import RECORDED, Number, Recorder, bare
from dalembert.arithmetic.rounding import UNIT_ROUNDOFF
from dalembert.arithmetic.varied import made
from virtualwork.formulas.asked import Key
from virtualwork.formulas.dynamics import applied_loads, reduced
from virtualwork.formulas.effort import generalized_force
from virtualwork.formulas.lanes import Turning
from virtualwork.formulas.newton import gaps
from virtualwork.formulas.positions import State
from virtualwork.formulas.recording import Recording
from virtualwork.formulas.statics import equations
from virtualwork.plan.steps import Angle, Group, Place, Plan, Step, Term, Turn


class Constants:
    """A plan whose constants are inputs of the tape.

    Attributes
    ----------
    plan : Plan
    numbers : dict of input to its value and error

    Parameters
    ----------
    plan : Plan
    given : iterable of the places of each body
        Its points, and through where its guides run, as the user gave them.
    """

    def __init__(self, plan: Plan, given: Iterable[Collection[complex]]) -> None:
        self.recorder = Recorder()
        bodies = [*given]
        self._given = {sign * z for places in bodies for z in places for sign in (1, -1)}
        self._apart = {a - b for places in bodies for a in places for b in places}
        self.numbers: dict[str, tuple[float, float]] = {}
        self._vectors: dict[tuple[complex, str], complex] = {}
        self.plan = replace(
            plan,
            steps=tuple(self._step(step) for step in plan.steps),
            anchors={body: (node, self._terms(terms)) for body, (node, terms) in plan.anchors.items()},
            angles={body: self._angle(f"whole {body}", of) for body, of in plan.angles.items()},
            directions={guide: self._vector(z, f"guide {guide}") for guide, z in plan.directions.items()},
        )

    def _number(self, name: str, value: float, error: float) -> Any:
        # what is on an axis is exactly there
        if value in (0.0, 1.0, -1.0):
            return value
        self.numbers[name] = value, error
        return self.recorder.input(name)

    def _vector(self, z: complex, of: str) -> complex:
        """A vector of a body, wrong by a rounding where it is not as it was given: of its parts if it joins two places."""
        if (z, of) not in self._vectors:
            name, rounding = f"z {len(self._vectors)}", 0.0 if z in self._given else UNIT_ROUNDOFF
            x, y = (
                self._number(f"{name} {axis}", v, rounding * abs(v if z in self._apart else z))
                for axis, v in (("x", z.real), ("y", z.imag))
            )
            self._vectors[z, of] = made(z, RECORDED.join(x, y))
        return self._vectors[z, of]

    def _terms(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        return tuple(replace(t, z=self._vector(t.z, t.body)) for t in terms)

    def _angle(self, name: str, of: Angle) -> Angle:
        if not of.const:
            return of
        error = 2 * UNIT_ROUNDOFF * max(abs(of.const), of.size)
        return replace(of, const=made(of.const, self._number(name, of.const, error)))

    def _turn(self, turn: Turn) -> Turn:
        return replace(turn, angle=self._angle(f"constant {turn.body}", turn.angle))

    def _step(self, step: Step) -> Step:
        if isinstance(step, Turn):
            return self._turn(step)
        if isinstance(step, Place):
            return replace(step, terms=self._terms(step.terms))
        if isinstance(step, Group):
            closures = tuple(replace(c, terms=self._terms(c.terms)) for c in step.closures)
            return replace(step, ties=tuple(self._turn(tie) for tie in step.ties), closures=closures)
        return step


class Doubted(Recording):
    """The formulas of an assembly, with constants as inputs and unknowns that may be wrong.

    Further keys of `value`
    -----------------------
    ("generalized", j)            the effort as if every motor sat on the body that its angle is measured from
    ("applied", link)             complex: what acts on a link but its weight and inertia
    ("applied moment", link)      about its centre of mass
    ("gap", group's name, loop)   complex: what the unknowns that enter leave open of a loop
    ("balance", row)              what the forces that enter leave of an equation of redundant statics

    Parameters
    ----------
    plain : Recording
        The formulas as they are.
    branch : Turning
        The assembly.
    entered : frozenset of str
        Groups whose unknowns enter though they have a closed form.
    """

    def __init__(self, plain: Recording, branch: Turning, entered: frozenset[str]) -> None:
        m = branch.mechanism
        through = {body: [m.through(g) for g in m.guides if g.on == body] for body in m.bodies}
        constants = Constants(branch.plan, [[*of.values(), *through[body]] for body, of in m.bodies.items()])
        self.constants, self.entered = constants.numbers, entered
        self._left: dict[str, list[Number]] = {}
        self._groups: dict[Key, tuple[str, ...]] = {}
        super().__init__(
            branch.mechanism,
            constants.plan,
            branch.signs,
            plain.moves,
            plain.turning_over,
            branch.geared,
            recorder=constants.recorder,
        )

    def enters(self, group: Group) -> bool:
        """Whether the unknowns of a group enter."""
        return group.name in self.entered or super().enters(group)

    def step(self, group: Group, st: State) -> list[Number] | None:
        """−J⁻¹ times what the loops leave open."""
        enter, name = self.recorder.input, group.name
        self._left[name] = gaps(group, st)
        rows = [enter("step") * bare(part) for gap in self._left[name] for part in (gap.real, gap.imag)]
        return [
            -sum((enter(f"inverse {name} {i} {r}") * row for r, row in enumerate(rows)), 0.0)
            for i in range(len(group.angles) + len(group.slides))
        ]

    def hangs_on(self, key: Key) -> tuple[str, ...]:
        """The groups that a quantity hangs on; looked for once, which one pose after the other would pay for."""
        if key not in self._groups:
            self._groups[key] = super().hangs_on(key)
        return self._groups[key]

    def _generalized(self, j: int) -> Number:
        paths, _, block = self.forces
        return self._negative(generalized_force(paths, block, j))

    def _applied(self, link: str) -> Number:
        return self._reduced(link)[0]

    def _applied_moment(self, link: str) -> Number:
        return self._reduced(link)[1]

    def _reduced(self, link: str) -> tuple[Number, Number]:
        self.solve([f"angle:{link}"], 0)
        paths, _, block = self.forces
        return reduced(applied_loads(paths.case.loads, link), block, self.mechanism.rigid[link].center)

    def _gap(self, group: str, loop: int) -> Number:
        return self._left[self.solved(group).name][loop]

    def _balance(self, row: int) -> Number:
        return self._balances.get(row, 0.0)

    @cached_property
    def _balances(self) -> dict[int, Number]:
        """What the unknown forces that enter leave of every equation."""
        self._places()
        _, of, block = self.forces
        found: dict[int, Number] = {}
        for row, column, value in equations(of, block):
            value = bare(value)
            if column is not None:
                value = value * self.recorder.input(f"f {column}")
            found[row] = found.get(row, 0.0) + value
        return found
