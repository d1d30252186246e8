"""Estimates of the rounding errors of forces: effort, joint forces, shaking force.

Each is that of a quantity on the tape (`virtualwork.digits.estimates`). With joint friction, loads and forces are exchanged in 32
digits until neither changes; where statics is redundant, the unknown forces are refined in 32 digits (`second_run`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any, cast

import numpy as np

from dalembert.arithmetic.guard import guarded
from virtualwork.digits.estimates import Estimates
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import (
    Applied,
    AppliedMoment,
    Contact,
    Effort,
    JointForce,
    JointMoment,
    NewtonEuler,
    Reaction,
    Shaking,
    ShakingMoment,
)
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.plan.steps import Joint


@guarded
class ForceErrors:
    """Estimates of the rounding errors of forces, under the names of these; each is formed on its first request."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.dynamics, self.n, self.lock = dynamics, dynamics.poses.n, dynamics.lock
        self.mechanism = dynamics.poses.mechanism
        # forces with estimates are those of a motion
        self._poses = cast(Lanes, dynamics.poses)
        self.estimates = Estimates(self._poses, self._values)

    def of(self, key: Quantity) -> Reals:
        """Of a force by its key, (n,): the length of the error of a vector."""
        return self.estimates.of(key)

    def _values(self, keys: Sequence[Quantity]) -> list[Any]:
        """The forces as they were handed out."""
        return self._poses.values(keys, lambda: self.dynamics)

    def together(self, reactions: Iterable[Quantity] | None = None) -> None:
        """Form the estimates of some joints' forces, or of all: they have most of the second run in common."""
        if reactions is not None:
            self.estimates.together(reactions)
            return
        inputs, joints = range(len(self.mechanism.inputs)), self.dynamics.reactions.joints
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
        return joint.guide is not None and self.mechanism.guides[joint.guide].is_slider

    def _each(self, kind: type[Effort | NewtonEuler]) -> Reals:
        """Of a quantity of every input, (n, k)."""
        keys = [kind(j) for j in range(len(self.mechanism.inputs))]
        self.estimates.together(keys)
        return np.stack([self.estimates.of(key) for key in keys], axis=1)

    @cached_property
    def effort(self) -> Reals:
        """Of `Dynamics.effort`, (n, k)."""
        return self._each(Effort)

    @cached_property
    def newton_euler(self) -> Reals:
        """Of `Dynamics.newton_euler`, (n, k)."""
        return self._each(NewtonEuler)

    def joint_force(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_force`, (n,): the length of the error."""
        return self.estimates.of(JointForce(joint.key, body))

    def contact(self, cam: int) -> Reals:
        """Of `Dynamics.contact`, (n,)."""
        return self.estimates.of(Contact(cam))

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_moment`, (n,)."""
        return self.estimates.of(JointMoment(joint.key, body)) if self._holds(joint) else np.zeros(self.n)

    def reaction(self, joint: str, on: str) -> Reals:
        """Of `Dynamics.reaction`, (n,): the length of the error."""
        return self.estimates.of(Reaction(joint, on))

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Of `Dynamics.shaking`: the length of the force's error (n,), and the moment's (n,)."""
        self.estimates.together([Shaking(), ShakingMoment()])
        return self.estimates.of(Shaking()), self.estimates.of(ShakingMoment())

    def applied(self, link: str) -> tuple[Reals, Reals]:
        """Of `Dynamics.applied`: the length of the force's error (n,), and the moment's (n,)."""
        self.estimates.together([Applied(link), AppliedMoment(link)])
        return self.estimates.of(Applied(link)), self.estimates.of(AppliedMoment(link))
