"""The forces on a tape: loads, effort by virtual work and joint forces over the one recorded pose."""

from __future__ import annotations

from dalembert.arithmetic.recorded import Number, bare
from virtualwork.describe.parts import TorsionSpring
from virtualwork.formulas.block import Block, Shared, Table
from virtualwork.formulas.effort import generalized_force
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.numbers import WRITTEN
from virtualwork.formulas.positions import State
from virtualwork.formulas.quantity import Recording
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.reactions import JointForces


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


def forces_of(recording: Recording) -> tuple[LoadPaths, JointForces, Block]:
    """The loads over the recorded pose, with everything solved that they depend on."""
    case = LoadCase(recording.mechanism, recording.plan, any(recording.moves[:2]))
    paths = LoadPaths(case)
    recording.solve(*case.targets())
    return paths, JointForces(paths, set()), RecordedBlock(recording, recording.together, recording.by)


def efforts(recording: Recording) -> list[Number]:
    """The effort at each input by virtual work, through the carriers of motors."""
    _, _, block = recording.forces
    m, k = recording.mechanism, len(recording.mechanism.inputs)
    force = [generalized(recording, j) for j in range(k)]
    if not m.carried:
        return force
    matrix: list[list[Number]] = [[float(i == j) for j in range(k)] for i in range(k)]
    for j in m.carried:
        link, carrier = str(m.inputs[j].link), m.carrier(j)
        recording.solve([f"angle:{link}", f"angle:{carrier}"], 1)
        for i in range(k):
            turned = [block.turning(body, i) for body in (link, carrier)]
            driven, carried = (0.0 if t is None else t for t in turned)
            matrix[i][j] = driven - carried
    return recording.kind.system(matrix, force) if k > 1 else [force[0] / matrix[0][0]]


def generalized(recording: Recording, j: int) -> Number:
    """The effort at input j as if every motor sat on the body that its angle is measured from."""
    paths, _, block = recording.forces
    force = generalized_force(paths, block, j)
    return 0.0 if force is None else -bare(force)
