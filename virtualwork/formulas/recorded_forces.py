"""The forces on a tape, over the one recorded pose."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from virtualwork.formulas import numbers, recorded_block
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.formulas.rates import Rates


class Recording(recorded_block.Recording, Protocol):
    """A recording of positions and rates, as its forces need it; see `recording.Recording`."""

    @property
    def kind(self) -> numbers.Written: ...
    @property
    def moves(self) -> tuple[bool, ...]: ...
    @property
    def by(self) -> list[Rates]: ...
    @property
    def together(self) -> Rates | None: ...
    def solve(self, targets: Iterable[str], order: int) -> None: ...


def forces_of(recording: Recording) -> PoseForces:
    """The forces of the recorded pose; friction and redundant joint forces enter the tape."""
    paths = LoadPaths(LoadCase(recording.mechanism, recording.plan, any(recording.moves[:2])))
    block = recorded_block.RecordedBlock(recording, recording.together, recording.by)
    return PoseForces(paths, block, recording.solve, recording.kind.system, recording.recorder.input)
