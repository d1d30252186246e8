"""The formulas of an assembly with nothing in them that counts as exact but what the user gave.

The constants of the plan, vectors and angles formed of dimensions, enter the tape with what their forming rounds: what
hangs on them alone is then on the tape too, where a mechanism has links that stand still. The unknowns x of a group
that enter are off by one step of Newton's, J⁻¹ times what they leave open of the group's loops. It is on the tape: so
a rounding in forming several loops, and one that reaches the result besides, counts once and with its sign.

Further inputs of the tape
--------------------------
`z 0 x`, `z 0 y`                      a vector of the plan
`constant BODY`, `whole BODY`         the constant of an angle in the steps, and in the plan's angles
`factor 1.5`                          by what an angle is multiplied, worked out of the ratios of gears
`inverse GROUP 0 0`                   J⁻¹ of a group's loops
`step`                                1: how much of Newton's steps is made
`f 0`                                 the first unknown of redundant statics
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.exact import two_sum
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder, bare
from dalembert.arithmetic.rounding import UNIT_ROUNDOFF
from dalembert.arithmetic.varied import made
from virtualwork.describe.description import Description
from virtualwork.formulas.asked import Key
from virtualwork.formulas.dynamics import applied_loads, reduced
from virtualwork.formulas.effort import generalized_force
from virtualwork.formulas.lanes import Turning
from virtualwork.formulas.newton import gaps
from virtualwork.formulas.positions import State
from virtualwork.formulas.recording import Recording
from virtualwork.formulas.statics import equations
from virtualwork.plan.steps import Angle, Group, Place, Plan, Step, Term, Turn

K = TypeVar("K")


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
    ratios : iterable of float
        Of its gears.
    """

    def __init__(
        self, plan: Plan, given: Iterable[Collection[complex]], ratios: Iterable[float] = ()
    ) -> None:
        self.recorder = Recorder()
        self._ratios = {1.0, *map(abs, ratios)}
        # of the vectors of bodies, by what their parts err
        self._known: dict[complex, tuple[float, float]] = {}
        for places in given:
            self._known |= _differences(np.array(places, dtype=complex), self._known)
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
        """A vector of a body: a place as it was given, or what is known of two places; any other is wrong by a rounding."""
        if (z, of) not in self._vectors:
            name, errors = f"z {len(self._vectors)}", self._known.get(z, (UNIT_ROUNDOFF * abs(z),) * 2)
            x, y = (
                self._number(f"{name} {axis}", v, error)
                for axis, v, error in zip("xy", (z.real, z.imag), errors, strict=True)
            )
            self._vectors[z, of] = made(z, RECORDED.join(x, y))
        return self._vectors[z, of]

    def _terms(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        return tuple(replace(t, z=self._vector(t.z, t.body)) for t in terms)

    def _angle(self, name: str, of: Angle) -> Angle:
        const = of.const
        if const:
            error = 2 * UNIT_ROUNDOFF * max(abs(const), of.size)
            const = made(const, self._number(name, const, error))
        return replace(of, const=const, inputs=self._factors(of.inputs), bases=self._factors(of.bases))

    def _factors(self, given: tuple[tuple[K, float], ...]) -> tuple[tuple[K, float], ...]:
        """What angles are multiplied by: where it is no ratio as given, it is worked out of ratios, and rounds as they do."""
        return tuple(
            (of, f if f.is_integer() or abs(f) in self._ratios else made(f, self._factor(f)))
            for of, f in given
        )

    def _factor(self, f: float) -> Any:
        return self._number(f"factor {f!r}", f, 2 * UNIT_ROUNDOFF * max(abs(f), *self._ratios))

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


def _ratios(m: Description) -> Iterable[float]:
    """By what the turns of gears, belts and racks are multiplied."""
    yield from m.ratios
    for rack in m.racks:
        yield from (rack.radius, 1 / rack.radius)


def _differences(
    places: NDArray[np.complex128], known: dict[complex, tuple[float, float]]
) -> dict[complex, tuple[float, float]]:
    """Places of a body and the vectors between them, with what the subtraction of each part errs by, exactly.

    Of vectors that two pairs have alike, or that are known already, the largest counts.
    """
    from_here = np.append(places, 0)
    x, dx = two_sum(from_here.real[:, None], -from_here.real)
    y, dy = two_sum(from_here.imag[:, None], -from_here.imag)
    found: dict[complex, tuple[float, float]] = {}
    for z, *errors in zip(*(part.ravel().tolist() for part in (x + 1j * y, abs(dx), abs(dy))), strict=True):
        before = found.get(z) or known.get(z, (0.0, 0.0))
        found[z] = max(before[0], errors[0]), max(before[1], errors[1])
    return found


@guarded
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
        places = [[*of.values(), *through[body]] for body, of in m.bodies.items()]
        constants = Constants(branch.plan, places, _ratios(m))
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
