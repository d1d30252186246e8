"""The formulas of one assembly written down with some of its dimensions as inputs of the tape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.recorded import Recorder
from dalembert.arithmetic.tape import Tape
from dalembert.arithmetic.varied import Varied
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.guess import distance
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, changed, value
from virtualwork.formulas.asked import Key
from virtualwork.formulas.recording import Recording
from virtualwork.plan.guessed import known_by_guess
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Step, Turn


class Written:
    """Formulas of an assembly, in which dimensions are inputs of the tape, called by their paths.

    Parameters
    ----------
    assembly : Assembly
        Of the description that the dimensions are varied of.
    dimensions : sequence of Dimension
        None of an input of the mechanism: those enter as its value and rates.
    moves : tuple of bool
        Whether the inputs have a speed, an acceleration, a jerk.
    own_signs : bool
        Whether the sign of every closed form enters too (`sign GROUP`), as each variant has its own.
    settled : bool
        See `Recording`.
    """

    def __init__(
        self,
        assembly: Assembly,
        dimensions: Sequence[Dimension],
        moves: tuple[bool, ...],
        own_signs: bool,
        settled: bool = True,
    ) -> None:
        recorder = Recorder()
        m: Description = assembly.mechanism
        self.mechanism = varied(m, dimensions, recorder)
        self.plan = plan(self.mechanism)
        # whether a gear's constant is that of links which the guess has to place first
        self.open_gears = any(turn.angle.gears for step in self.plan.steps for turn in _turns(step))
        closed = [g.name for g in self.closed]
        signs = {name: assembly.signs.get(name, 1) for name in closed}
        turning = closed if own_signs else assembly.turning_over
        self.recording = Recording(
            self.mechanism, self.plan, signs, moves, turning, assembly.geared, settled, recorder
        )
        self._tapes: dict[tuple[Key, ...], Tape] = {}
        self._slopes: dict[tuple[Key, tuple[str, ...]], Tape] = {}

    @property
    def closed(self) -> list[Group]:
        """The groups with a closed form that has two branches."""
        return [g for g in self.plan.groups if g.kind not in ("Newton", "PRP")]

    def tape(self, keys: Iterable[Key]) -> Tape:
        """The tape of quantities, written once."""
        asked = tuple(keys)
        if asked not in self._tapes:
            self._tapes[asked] = self.recording.tape(asked)
        return self._tapes[asked]

    def slopes(self, key: Key, enters: tuple[str, ...]) -> Tape:
        """The tape of a quantity's derivatives to what enters, as far as it hangs on that; written once."""
        if (key, enters) not in self._slopes:
            tape = self.tape((key,))
            there = [name for name in enters if name in tape.inputs]
            self._slopes[key, enters] = derivatives(tape, there)
        return self._slopes[key, enters]

    def choice(self, group: Group) -> Tape:
        """The tape of a group's radicand, and of its distance from what the guess says, at the inputs of the guess."""
        rec = self.recording
        rec.solve(self.plan.writes(group), 0)
        angles, points = known_by_guess(self.mechanism)
        apart = distance(group, rec.st, self.plan, self.mechanism, angles, points)
        return rec.recorder.tape({"margin": rec.st.margin[group.name], "distance": apart})


def _turns(step: Step) -> tuple[Turn, ...]:
    return (step,) if isinstance(step, Turn) else step.ties if isinstance(step, Group) else ()


def varied(m: Description, dimensions: Sequence[Dimension], recorder: Recorder) -> Description:
    """The description with recorded numbers at some dimensions, called by their paths; decisions see its own numbers."""
    numbers = {d.path: Varied(float(value(m, d.path).real), recorder.input(d.path)) for d in dimensions}
    return changed(m, numbers)
