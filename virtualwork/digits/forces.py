"""Estimates of the rounding errors of forces: effort, joint forces, shaking force.

Each is that of a quantity on the tape (`virtualwork.digits.estimates`). With joint friction, loads and forces are exchanged in 32
digits until neither changes; where statics is redundant, the unknown forces are refined in 32 digits (`second_run`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np

from dalembert.arithmetic.guard import guarded
from virtualwork.digits.estimates import Estimates
from virtualwork.formulas.dynamics import Dynamics, NamedForces
from virtualwork.formulas.forces import (
    Effort,
    JointForce,
    JointMoment,
    NewtonEuler,
    Shaking,
    ShakingMoment,
)
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.plan.steps import Joint


@guarded
class ForceErrors(NamedForces):
    """Estimates of the rounding errors of forces, under the names of these; each is formed on its first request."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.dynamics, self.lock = dynamics, dynamics.lock
        # forces with estimates are those of a motion
        self.poses = poses = cast(Lanes, dynamics.poses)
        # held against the forces as they were handed out
        self.estimates = Estimates(poses, lambda keys: poses.values(keys, lambda: dynamics))

    def values(self, keys: Sequence[Quantity]) -> list[Any]:
        """Of forces by their keys, (n,) each: the length of the error of a vector."""
        self.estimates.together(keys)
        return [self.estimates.of(key) for key in keys]

    def together(self, reactions: Iterable[Quantity] | None = None) -> None:
        """Form the estimates of some joints' forces, or of all: they have most of the second run in common."""
        if reactions is not None:
            self.estimates.together(reactions)
            return
        joints = self.dynamics.reactions.joints
        inputs = range(len(self.poses.mechanism.inputs))
        keys: list[Quantity] = [Shaking(), ShakingMoment(), *(Effort(j) for j in inputs)]
        keys += [NewtonEuler(j) for j in inputs]
        sides = [(joint, body) for joint in joints for body in joint.bodies]
        keys += [JointForce(joint.key, body) for joint, body in sides]
        keys += [JointMoment(joint.key, body) for joint, body in sides if self._holds(joint)]
        self.estimates.together(keys)

    def _holds(self, joint: Joint) -> bool:
        """Whether a joint has a moment: it keeps its bodies from turning against each other, or it rubs."""
        if any(load.path is None and load.joint == joint.key for load in self.dynamics.case.friction):
            return True
        return joint.guide is not None and self.poses.mechanism.guides[joint.guide].is_slider

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        return super().joint_moment(joint, body) if self._holds(joint) else np.zeros(self.poses.n)
