"""The loads of a mechanism at its poses: what acts, and the requested forces."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.guard import guarded
from virtualwork.describe.parts import Rigid
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loaded_pose import LoadedPose, Setting
from virtualwork.formulas.loads import FrictionLoad, Load
from virtualwork.formulas.numbers import ONE, Number, leave_out
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.rates import Rates


@guarded
class Scene:
    """The loads of a mechanism at its poses.

    Attributes
    ----------
    poses : Poses
    case : LoadCase
        What acts, the same for all motions of an assembly.
    moves : bool
        Whether anything moves at all.
    """

    def __init__(self, poses: Poses, *, at_rest: bool = False) -> None:
        self.poses, self.lock = poses, poses.lock
        self.mechanism, self.plan = poses.mechanism, poses.plan
        self.setting = Setting(poses, at_rest)
        self.moves = self.setting.moves
        prepared = poses.branch.prepared
        with self.lock:
            if self.moves not in prepared:
                prepared[self.moves] = LoadCase(self.mechanism, self.plan, self.moves)
        self.case: LoadCase = prepared[self.moves]

    @cached_property
    def paths(self) -> LoadPaths:
        """How the loads bear on what moves, and how joint forces follow; made once for an assembly."""
        load_paths = self.poses.branch.load_paths
        if self.moves not in load_paths:
            load_paths[self.moves] = LoadPaths(self.case)
        result: LoadPaths = load_paths[self.moves]
        return result

    @property
    def loads(self) -> list[Load]:
        """Every load that is not zero throughout, friction apart."""
        return self.case.loads

    @property
    def friction(self) -> list[FrictionLoad]:
        """The friction loads."""
        return self.case.friction

    @property
    def rigid(self) -> Mapping[str, Rigid]:
        """Mass properties of every link."""
        return self.mechanism.rigid

    @property
    def on_tape(self) -> bool:
        """Whether forces come from the tape: of many poses, and where there is friction to solve."""
        return self.poses.many or bool(self.case.contacts)

    @cached_property
    def forces(self) -> PoseForces:
        """The forces of the one pose, by the formulas as they stand.

        Raises
        ------
        ZeroDivisionError
            At a singular pose, whose forces come from the tape.
        """
        k = len(self.mechanism.inputs)
        by = [self.poses.along(j if k > 1 else -1) for j in range(k)]
        pose = LoadedPose(self.setting, by[0].st, self.poses.along() if k > 1 and self.moves else None, by)
        return PoseForces(self.paths, pose, self._solve, ONE.system, _outside)

    @property
    def pose(self) -> LoadedPose:
        """The pose as the loads see it: of floats, or written down."""
        pose: LoadedPose = (self.poses.recording.forces if self.on_tape else self.forces).pose
        return pose

    def along(self, targets: Iterable[str]) -> Rates | None:
        """The derivatives of one pose to the second order along its rates; None at a singular pose."""
        try:
            self.poses.advance(tuple(targets), 2)
        except (ZeroDivisionError, OverflowError):
            return None
        return self.poses.along()

    def _solve(self, targets: Iterable[str], order: int) -> None:
        k, wanted = len(self.mechanism.inputs), tuple(targets)
        for j in range(k) if k > 1 else ():
            self.poses.advance(wanted, 1, j)
        if k == 1 or self.moves:
            self.poses.advance(wanted, order)

    def over(
        self,
        forms: Sequence[Callable[[LoadedPose], Number]],
        kind: type,
        targets: Iterable[str] = (),
        order: int = 1,
        name: str = "",
    ) -> list[Any]:
        """What forms make of the pose as the loads see it, (n,) each; NaN where a pose is not assembled.

        `targets`: what they depend on beyond the loads and the places of all joints, with derivatives up to an order.
        `name`: under which the tape of forms that are the same for all poses is kept.
        """
        wanted = tuple(targets)
        if self.on_tape:
            return self.poses.formed(forms, kind, wanted, order, name)
        try:
            self.forces.solve_places()
            self._solve(wanted, order)
            values = [form(self.forces.pose) for form in forms]
        except (ZeroDivisionError, OverflowError):
            return self.poses.formed(forms, kind, wanted, order, name)
        result: list[Any] = [np.array([0.0 if value is None else value], kind) for value in values]
        if not self.poses.assembled.all():
            for value in result:
                leave_out(value, ~self.poses.assembled)
        return result


def _outside(name: str) -> Number:
    raise LookupError(name)
