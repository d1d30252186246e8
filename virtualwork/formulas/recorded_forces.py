"""The forces on a tape: loads, effort by virtual work and joint forces over the one recorded pose."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from dalembert.arithmetic.recorded import Number, bare
from virtualwork.formulas import numbers
from virtualwork.formulas.block import Block
from virtualwork.formulas.effort import generalized_force
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.reactions import JointForces
from virtualwork.formulas.recorded_block import RecordedBlock, Recording


class Written(Recording, Protocol):
    """A recording of positions and rates, as its forces need it; see `recording.Recording`."""

    @property
    def kind(self) -> numbers.Written: ...
    @property
    def moves(self) -> tuple[bool, ...]: ...
    @property
    def by(self) -> list[Rates]: ...
    @property
    def together(self) -> Rates | None: ...
    @property
    def forces(self) -> tuple[LoadPaths, JointForces, Block]: ...
    @property
    def shaking(self) -> tuple[Number, Number]: ...
    def solve(self, targets: Iterable[str], order: int) -> None: ...
    def placed_forces(self) -> tuple[LoadPaths, JointForces, Block]: ...
    def value(self, quantity: Quantity) -> Number: ...
    def generalized(self, j: int) -> Number: ...
    def newton_euler(self, j: int) -> Number: ...
    def joint_force(self, joint: str, body: str) -> Number: ...
    def joint_moment(self, joint: str, body: str) -> Number: ...
    def applied(self, link: str) -> tuple[Number, Number]: ...


def forces_of(recording: Written) -> tuple[LoadPaths, JointForces, Block]:
    """The loads over the recorded pose, with everything solved that they depend on."""
    case = LoadCase(recording.mechanism, recording.plan, any(recording.moves[:2]))
    paths = LoadPaths(case)
    recording.solve(*case.targets())
    return paths, JointForces(paths, set()), RecordedBlock(recording, recording.together, recording.by)


def efforts(recording: Written) -> list[Number]:
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


def generalized(recording: Written, j: int) -> Number:
    """The effort at input j as if every motor sat on the body that its angle is measured from."""
    paths, _, block = recording.forces
    force = generalized_force(paths, block, j)
    return 0.0 if force is None else -bare(force)
