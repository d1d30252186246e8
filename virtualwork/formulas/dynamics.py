"""Loads and forces of a mechanism in motion or at rest, on demand: effort, reactions, shaking force and moment."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.formulas.forces import (
    Applied,
    AppliedMoment,
    Contact,
    Effort,
    Force,
    Generalized,
    JointForce,
    JointMoment,
    NewtonEuler,
    Reaction,
    Shaking,
    ShakingMoment,
)
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loaded_pose import LoadedPose, Setting
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.numbers import FAST, ONE, TOGETHER, Complexes, Number, Reals, leave_out, xy
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.formulas.solving import Solving
from virtualwork.formulas.statics import Statics
from virtualwork.plan.joint_forces import Order
from virtualwork.plan.steps import Joint


@guarded
class NamedForces:
    """Forces by the names under which they are handed out, from their values by their keys; each is formed on its first request."""

    poses: Solving
    lock: Lock

    def values(self, keys: Sequence[Force]) -> list[Any]:
        """Forces (n,) each; of estimates of their errors the length of a vector's."""
        raise NotImplementedError

    def value(self, key: Force) -> Any:
        """A force by its key, (n,)."""
        return self.values([key])[0]

    def _shown(self, vector: Any) -> Any:
        """A vector as it is handed out; of estimates the length."""
        return vector

    def _each(self, kind: type[Effort | NewtonEuler]) -> Reals:
        """A quantity of every input, (n, k)."""
        return np.stack(self.values([kind(j) for j in range(len(self.poses.mechanism.inputs))]), axis=1)

    @cached_property
    def effort(self) -> Reals:
        """The effort at each input by virtual work, (n, k)."""
        return self._each(Effort)

    @cached_property
    def newton_euler(self) -> Reals:
        """The effort at each input by Newton and Euler, (n, k): ΣM = 0 of the driven link with its joint forces."""
        return self._each(NewtonEuler)

    def joint_force(self, joint: Joint, body: str) -> Complexes:
        """The force of a joint on one of its bodies, (n,) complex; NaN where statics does not determine it."""
        return np.asarray(self.value(JointForce(joint.key, body)))

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """The moment of a joint on one of its bodies about the joint's point, (n,): a guide's, or a pin's friction."""
        return np.asarray(self.value(JointMoment(joint.key, body)))

    def contact(self, cam: int) -> Reals:
        """How hard a cam (from 0) presses on its follower along the normal, (n,); below zero it would have to pull."""
        return np.asarray(self.value(Contact(cam)))

    def reaction(self, joint: str, on: str) -> Reals:
        """The force of all others on a link at a joint, (n, 2): of a pin and of a guide, where both are of that name."""
        return self._shown(np.asarray(self.value(Reaction(joint, on))))  # type: ignore[no-any-return]

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Shaking force (n, 2) and shaking moment (n,) on the ground, about its origin.

        All that the moving links do to the ground through joints, springs and the drive's own reaction: by
        d'Alembert the sum of their weights, applied loads and inertia loads. No reaction is formed for it.
        """
        force, moment = self.values([Shaking(), ShakingMoment()])
        return self._shown(force), moment

    def applied(self, link: str) -> tuple[Complexes, Reals]:
        """What acts on a link but its weight and inertia, reduced to its centre of mass: (n,) complex N, (n,) N·m."""
        force, moment = self.values([Applied(link), AppliedMoment(link)])
        return force, moment


@guarded
class Dynamics(NamedForces):
    """The loads and forces of poses; each is formed on the first request. `Motion.dynamics` is one.

    Attributes
    ----------
    poses : Solving
    case : LoadCase
        What acts, the same for all motions of an assembly.
    moves : bool
        Whether anything moves at all.

    """

    def __init__(self, poses: Solving) -> None:
        self.poses, self.lock = poses, poses.lock
        self.setting = Setting(poses)
        self.moves = self.setting.moves
        self._known: dict[Force, Any] = {}
        recordings, key = poses.branch.recordings, ("loads", self.moves)
        with self.lock:
            if key not in recordings:
                recordings[key] = LoadCase(poses.mechanism, poses.plan, self.moves)
        self.case: LoadCase = recordings[key]

    @cached_property
    def beyond_tables(self) -> list[tuple[Tabled, NDArray[np.bool_]]]:
        """Of the loads that tables give: the poses outside their rows, (n,)."""
        tables = self.case.tables
        beyond = [(load, ~np.isfinite(load.over(self.poses.place(load)))) for load in tables]
        return [(load, np.broadcast_to(bad, self.poses.n)) for load, bad in beyond if bad.any()]

    # --- the loads ----------------------------------------------------------------------------------------------
    @cached_property
    def paths(self) -> LoadPaths:
        """How the loads bear on what moves, and how joint forces follow; made once for an assembly."""
        recordings, key = self.poses.branch.recordings, ("load paths", self.moves)
        if key not in recordings:
            recordings[key] = LoadPaths(self.case)
        result: LoadPaths = recordings[key]
        return result

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
        k = len(self.poses.mechanism.inputs)
        by = [self.poses.along(j if k > 1 else -1) for j in range(k)]
        pose = LoadedPose(self.setting, by[0].st, self.poses.along() if k > 1 and self.moves else None, by)
        return PoseForces(self.paths, pose, self._solve, ONE.system, _outside)

    @property
    def pose(self) -> LoadedPose:
        """The pose as the loads see it: of floats, or written down."""
        return (self.poses.recording.forces if self.on_tape else self.forces).pose

    def _solve(self, targets: Iterable[str], order: int) -> None:
        k, wanted = len(self.poses.mechanism.inputs), tuple(targets)
        for j in range(k) if k > 1 else ():
            self.poses.advance(wanted, 1, j)
        if k == 1 or self.moves:
            self.poses.advance(wanted, order)

    def _there(self, value: Any) -> Any:
        """A value of one pose, NaN where that is not assembled."""
        if not self.poses.assembled.all():
            leave_out(value, ~self.poses.assembled)
        return value

    # --- the forces ---------------------------------------------------------------------------------------------
    def _shown(self, vector: Complexes) -> Reals:
        return xy(vector)

    def values(self, keys: Sequence[Force]) -> list[Any]:
        """Forces (n,) each: of many poses from the tape, of one by the formulas on floats."""
        new = [key for key in keys if key not in self._known]
        taped = [key for key in new if self._on_tape(key)]
        self._known |= zip(taped, self.poses.taped(taped), strict=True)
        for key in new:
            if key not in self._known:
                self._known[key] = self._alone(key)
        return [self._known[key] for key in keys]

    def _on_tape(self, key: Force) -> bool:
        return self.on_tape or (key.is_joint_force and self.reactions.redundant)

    def _alone(self, key: Force) -> Any:
        """A force of one pose."""
        try:
            value = key.value(self.forces)
            if isinstance(key, Effort | Generalized) and self._too_fast(key.input):
                value = np.nan
        except (ZeroDivisionError, OverflowError):
            return self.poses.taped([key])[0]
        # no −0
        return self._there(np.array([value], complex if key.is_vector else float) + 0.0)

    def _too_fast(self, j: int) -> bool:
        m, by = self.poses.mechanism, self.forces.pose.by[j]
        reach = m.size if m.inputs[j].is_slide else 1.0
        rates = (by.angle.get(body) for group in self.poses.plan.groups for body in group.angles)
        return any(rate and rate[0] is not None and not abs(rate[0]) * reach < FAST for rate in rates)

    @property
    def friction_iterations(self) -> int:
        """How often friction and reactions were exchanged until they agreed; 0 without friction."""
        return self.poses.friction_iterations if self.case.friction else 0

    @property
    def locked(self) -> NDArray[np.bool_]:
        """(n,): poses in which friction locks the mechanism: no reaction balances its own friction."""
        return self.poses.locked if self.case.friction else np.zeros(self.poses.n, dtype=bool)

    @cached_property
    def without_length(self) -> dict[int, NDArray[np.bool_]]:
        """Of the springs whose pull needs a direction, by number: the poses in which their ends meet, (n,)."""
        m, result = self.poses.mechanism, {}
        for number, spring in enumerate(m.springs, 1):
            if (spring.stiffness and spring.free_length) or (spring.damping and self.moves):
                a, b = (self.poses.point(link, m.place(link, p)) for link, p in spring.between)
                meet = np.broadcast_to(np.abs(a - b) <= TOGETHER * m.size, self.poses.n)
                if meet.any():
                    result[number] = meet
        return result

    @property
    def reactions(self) -> Order:
        """The joints, and how their forces follow from each other."""
        return self.paths.order

    @property
    def statics(self) -> Statics | None:
        """All equilibrium equations at once, where the constraints are redundant; else None."""
        return self.poses.statics if self.reactions.redundant else None


class Moving(Protocol):
    """A motion, as the studies need it."""

    @property
    def dynamics(self) -> Dynamics:
        """Its forces, which hold its poses."""


def _outside(name: str) -> Number:
    raise LookupError(name)
