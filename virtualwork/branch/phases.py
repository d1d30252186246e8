"""The constants of gears, belts and racks, Σ c·x, in the order of solution: the link after them stands at its guess.

Where links have to be placed first, a constant is open in the plan (`Angle.gears`) until they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from virtualwork.describe.description import Description, slide_by_guess
from virtualwork.describe.meshes import Coordinate
from virtualwork.formulas.numbers import Number
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group, Plan, Step, Turn


class Phases:
    """The constants found so far, by the number of the gear, belt or rack.

    Parameters
    ----------
    m : Description
    angles, points : mapping
        What the guess says (`known_by_guess`).
    number : function
        Makes a plain number of one that may have a wrapping.
    """

    def __init__(
        self,
        m: Description,
        angles: Mapping[str, Number],
        points: Mapping[str, Number],
        number: Callable[[Number], Number],
    ) -> None:
        self.m, self.angles, self.points, self.number = m, angles, points, number
        self.constants: dict[int, Number] = {}

    def step(self, step: Step, st: State) -> Step:
        """A step with its constants, where all before it is placed in the state; the step itself where none is open."""
        if isinstance(step, Turn) and step.angle.gears:
            return self._turn(step, st)
        if isinstance(step, Group) and any(tie.angle.gears for tie in step.ties):
            return replace(step, ties=tuple(self._turn(tie, st) for tie in step.ties))
        return step

    def _turn(self, step: Turn, st: State) -> Turn:
        """Of several open constants all but the last are those of the guessed angles."""
        angle, constants = step.angle, self.constants
        for i, _ in angle.gears[:-1]:
            if i not in constants:
                constants[i] = self._guessed_constant(i, st)
        for i, p in angle.gears[-1:]:
            rest = st.whole(angle)
            if i not in constants and rest is not None:
                rest = self.number(rest) + sum(k * constants[g] for g, k in angle.gears[:-1])
                constants[i] = (self._guessed(step.body) - rest) / self.number(p)
            if i not in constants:
                constants[i] = self._guessed_constant(i, st)
        return closed_turn(step, constants)

    def _guessed_constant(self, gear: int, st: State) -> Number:
        """Σ c·x of a gear, a belt or a rack: of what is placed, and of the guess for the others."""
        total: Number = 0.0
        for x, c in self.m.meshes[gear].shares.items():
            placed = st.slide.get(x) if isinstance(x, int) else st.angle.get(x)
            total += self.number(c) * (self._guessed(x) if placed is None else self.number(placed))
        return total

    def _guessed(self, x: Coordinate) -> Number:
        """An angle or a slide of the guess; zero where it says nothing."""
        if isinstance(x, int):
            return self.number(slide_by_guess(self.m, x, self.angles, self.points) or 0.0)
        return self.number(self.angles.get(x, 0.0))


def closed_turn(turn: Turn, constants: Mapping[int, Number]) -> Turn:
    """A turn with the constants of its gears."""
    angle = turn.angle
    if not angle.gears:
        return turn
    const = angle.const + sum(p * constants[i] for i, p in angle.gears)
    return Turn(turn.body, replace(angle, const=const, gears=()))


def with_constants(order: Plan, constants: Mapping[int, Number]) -> Plan:
    """An order of solution with the constants of all gears, belts and racks."""
    steps: list[Step] = []
    for step in order.steps:
        if isinstance(step, Turn):
            steps.append(closed_turn(step, constants))
        elif isinstance(step, Group) and step.ties:
            steps.append(replace(step, ties=tuple(closed_turn(tie, constants) for tie in step.ties)))
        else:
            steps.append(step)
    return replace(order, steps=tuple(steps))
