"""The one pose of a recording, as loads see it."""

from __future__ import annotations

from typing import Protocol

from dalembert.arithmetic.recorded import Recorder
from virtualwork.describe.description import Description
from virtualwork.describe.parts import TorsionSpring
from virtualwork.formulas.block import Block, Shared, Table
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.numbers import WRITTEN, Number
from virtualwork.formulas.positions import State
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Plan


class Recording(Protocol):
    """What is written down (`recording.Recording`), as its block needs it."""

    @property
    def mechanism(self) -> Description: ...
    @property
    def plan(self) -> Plan: ...
    @property
    def recorder(self) -> Recorder: ...
    @property
    def st(self) -> State: ...
    @property
    def rates(self) -> list[list[Number]]: ...
    @property
    def tables(self) -> list[Tabled]: ...
    @property
    def efforts(self) -> list[Number]: ...
    def unwrapped(self, near: str, turn: Number) -> Number: ...


class RecordedSetting(Shared):
    """What the one recorded block is told of its poses."""

    def __init__(self, recording: Recording) -> None:
        super().__init__(recording.mechanism, recording.plan)
        self.recording = recording

    def rates(self, rows: slice, many: bool) -> tuple[Number, Number]:
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
        super().__init__(RecordedSetting(recording), slice(None), recording.st, along, by)
        self.recording = recording

    def drive(self, j: int) -> Number:
        """The torque of input j's motor."""
        return self.recording.efforts[j]

    def table(self, load: Table) -> Number:
        """The force of a table, as it enters."""
        number = next(i for i, of in enumerate(self.recording.tables) if of is load)
        enter = self.recording.recorder.input
        return WRITTEN.join(enter(f"table {number} x"), enter(f"table {number} y"))
