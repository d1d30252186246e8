"""The forces on a tape, over the one recorded pose."""

from __future__ import annotations

from virtualwork.describe.parts import TorsionSpring
from virtualwork.formulas.block import Block, Shared, Table
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.numbers import WRITTEN, Number
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.formulas.positions import State
from virtualwork.formulas.quantity import Recording
from virtualwork.formulas.rates import Rates


class RecordedSetting(Shared):
    """What the one recorded block is told of its poses."""

    def __init__(self, recording: Recording) -> None:
        super().__init__(recording.mechanism, recording.plan)
        self.recording = recording

    @property
    def rates(self) -> tuple[Number, Number]:
        """q̇ and q̈ of the one input."""
        speed, acceleration, _ = self.recording.rates
        return speed[0], acceleration[0]

    def wound(self, spring: TorsionSpring, st: State, within: Number) -> Number:
        """The twist next to the one that enters."""
        number = self.mechanism.torsion_springs.index(spring)
        return self.recording.unwrapped(f"near spring {number}", WRITTEN.exp(within))


class RecordedBlock(Block):
    """The recorded pose as the loads see it."""

    def __init__(self, recording: Recording, along: Rates | None, by: list[Rates]) -> None:
        super().__init__(RecordedSetting(recording), recording.st, along, by)
        self.recording = recording

    def table(self, load: Table) -> Number:
        """The force of a table, as it enters."""
        return self._entering("table", load)

    def slope(self, load: Table) -> Number:
        """How steep it is, as it enters."""
        return self._entering("slope", load)

    def _entering(self, what: str, load: Table) -> Number:
        number = next(i for i, of in enumerate(self.recording.tables) if load.alike(of))
        enter = self.recording.recorder.input
        return WRITTEN.join(enter(f"{what} {number} x"), enter(f"{what} {number} y"))


def forces_of(recording: Recording) -> PoseForces:
    """The forces of the recorded pose; friction and redundant joint forces enter the tape."""
    paths = LoadPaths(LoadCase(recording.mechanism, recording.plan, any(recording.moves[:2])))
    block = RecordedBlock(recording, recording.together, recording.by)
    return PoseForces(paths, block, recording.solve, recording.kind.system, recording.recorder.input)
