"""Estimates of the rounding errors of forces: effort, joint forces, shaking force.

Each is that of a quantity on the tape (`virtualwork.digits.estimates`), but for joint forces where statics is
redundant. Those solve the equilibrium of all links, A f + b = 0, by singular values: what the computed f leave there in
32 digits, A⁺ times that, is what they are off by, one step of iterative refinement (N. J. Higham, Accuracy and
Stability of Numerical Algorithms, 2nd ed., §12.1).

With joint friction, loads and forces are exchanged in 32 digits until neither changes, and enter that balance so.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, cast

import numpy as np

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.engines.doubled import OWN
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.guard import guarded
from virtualwork.describe.parts import GROUND
from virtualwork.digits.estimates import Estimates
from virtualwork.digits.exact import Balance
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import (
    Applied,
    AppliedMoment,
    Contact,
    Effort,
    Generalized,
    JointForce,
    JointMoment,
    NewtonEuler,
    Reaction,
    Shaking,
    ShakingMoment,
)
from virtualwork.formulas.kinematics import Turn
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.statics import NULL, Column
from virtualwork.plan.steps import Joint, joints_at


@guarded
class ForceErrors:
    """Estimates of the rounding errors of forces, under the names of these; each is formed when first asked for."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.dynamics, self.n, self.lock = dynamics, dynamics.poses.n, dynamics.lock
        self.mechanism = dynamics.poses.mechanism
        # forces that are asked for estimates are those of a motion
        self._poses = cast(Lanes, dynamics.poses)
        self.estimates = Estimates(self._poses, self._values, lambda: dynamics)

    @property
    def by_key(self) -> Mapping[str, Joint]:
        """The joints by their keys."""
        return self.dynamics.by_key

    def _values(self, keys: Sequence[Quantity]) -> list[Any]:
        """The forces as they were handed out."""
        return self._poses.values(keys, lambda: self.dynamics)

    def together(self, reactions: Iterable[Quantity] | None = None) -> None:
        """Form the estimates of some joints' forces, or of all: they have most of the second run in common."""
        if reactions is not None:
            if self._redundant is None:
                self.estimates.together(reactions)
            return
        inputs, joints = range(len(self.mechanism.inputs)), self.dynamics.reactions.joints
        keys: list[Quantity] = [Shaking(), ShakingMoment(), *(Effort(j) for j in inputs)]
        if self._redundant is None:
            keys += [NewtonEuler(j) for j in inputs]
            sides = [(joint, body) for joint in joints for body in joint.bodies]
            keys += [JointForce(joint.key, body) for joint, body in sides]
            keys += [JointMoment(joint.key, body) for joint, body in sides if self._holds(joint)]
        self.estimates.together(keys)

    def _holds(self, joint: Joint) -> bool:
        """Whether a joint has a moment: it keeps its bodies from turning against each other, or it rubs."""
        if any(load.path is None and load.joint == joint.key for load in self.dynamics.scene.friction):
            return True
        return joint.guide is not None and self.mechanism.guides[joint.guide].is_slider

    def _each(self, kind: type[Effort | Generalized | NewtonEuler]) -> Reals:
        """Of a quantity of every input, (n, k)."""
        keys = [kind(j) for j in range(len(self.mechanism.inputs))]
        self.estimates.together(keys)
        return np.stack([self.estimates.of(key) for key in keys], axis=1)

    @cached_property
    def effort(self) -> Reals:
        """Of `Dynamics.effort`, (n, k)."""
        return self._each(Effort)

    @cached_property
    def generalized(self) -> Reals:
        """Of the generalized forces Σ F·K_j, (n, k): the effort, but for motors that sit on another body than `on`."""
        return self._each(Generalized)

    @cached_property
    def newton_euler(self) -> Reals:
        """Of `Dynamics.newton_euler`, (n, k)."""
        if self._redundant is None:
            return self._each(NewtonEuler)
        kinds = ["force" if entry.is_slide else "torque" for entry in self.mechanism.inputs]
        return np.stack([self._of((kind, str(j), "")) for j, kind in enumerate(kinds)], axis=1)

    def joint_force(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_force`, (n,): the length of the error."""
        if self._redundant is None:
            return self.estimates.of(JointForce(joint.key, body))
        if joint.guide is None:
            if body == GROUND:
                others = [self.joint_force(joint, other) for other in joint.bodies if other != GROUND]
                return np.asarray(sum(others))
            return np.hypot(self._of(("fx", joint.key, body)), self._of(("fy", joint.key, body)))
        # along the rail's normal, whose direction rounds too
        assert self.dynamics.statics is not None
        normal: Column = ("normal", joint.key, "")
        turned = self.estimates.of(Turn(self.mechanism.guides[joint.guide].on))
        along = self._rubbing(joint)
        return np.asarray(
            self._of(normal) + along + (turned + EPS) * np.abs(self.dynamics.statics.get(normal))
        )

    def contact(self, cam: int) -> Reals:
        """Of `Dynamics.contact`, (n,); infinite where statics is redundant."""
        return self.estimates.of(Contact(cam)) if self._redundant is None else np.full(self.n, np.inf)

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_moment`, (n,)."""
        if not self._holds(joint):
            return np.zeros(self.n)
        if self._redundant is None:
            return self.estimates.of(JointMoment(joint.key, body))
        if joint.guide is None:
            return self._rubbing(joint)
        return self._of(("moment", joint.key, ""))

    def reaction(self, joint: str, on: str) -> Reals:
        """Of `Dynamics.reaction`, (n,): the length of the error."""
        if self._redundant is None:
            return self.estimates.of(Reaction(joint, on))
        here = joints_at(self.dynamics.reactions.joints, joint, on)
        return np.asarray(sum(self.joint_force(found, on) for found in here))

    at_joint = reaction

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Of `Dynamics.shaking`: the length of the force's error (n,), and the moment's (n,)."""
        self.estimates.together([Shaking(), ShakingMoment()])
        return self.estimates.of(Shaking()), self.estimates.of(ShakingMoment())

    def applied(self, link: str) -> tuple[Reals, Reals]:
        """Of `Dynamics.applied`: the length of the force's error (n,), and the moment's (n,)."""
        self.estimates.together([Applied(link), AppliedMoment(link)])
        return self.estimates.of(Applied(link)), self.estimates.of(AppliedMoment(link))

    def _rubbing(self, joint: Joint) -> Reals:
        """Of a joint's friction, (n,): the torque of a pin, the force along a guide."""
        contacts = self.dynamics.scene.case.contacts
        numbers = [n for n, (rubbing, *_) in enumerate(contacts) if rubbing == joint]
        return np.asarray(sum((self.estimates.second.friction_error(n) for n in numbers), np.zeros(self.n)))

    # --- redundant statics ------------------------------------------------------------------------------------------
    @cached_property
    def _redundant(self) -> tuple[list[Column], Reals] | None:
        """The unknown forces of all links and their estimates, (n, unknowns); torques divided by the size."""
        statics = self.dynamics.statics
        if statics is None:
            return None
        value, least = statics.solved[0], statics.least[0]
        if np.isnan(value).all():
            return statics.unknowns, np.full(value.shape, np.nan)
        # what statics does not determine has a part in the balance too
        known = {f"f {i}": Doubled(column) for i, column in enumerate(np.nan_to_num(least).T)}
        keys: list[Quantity] = [Balance(row) for row in range(statics.rows)]
        left = self.estimates.second.doubled(keys, known)
        rest = np.stack([np.broadcast_to(left[key][0].value, self.n) for key in keys], axis=1)
        off = np.full(value.shape, np.inf)
        system = statics.system()[0]
        good = np.isfinite(system).all(axis=(1, 2)) & np.isfinite(rest).all(axis=1)
        back = np.linalg.pinv(system[good], rcond=NULL)
        off[good] = OWN * np.abs(back @ rest[good][..., None])[..., 0]
        return statics.unknowns, off

    def _of(self, unknown: Column) -> Reals:
        """One of the unknowns of redundant statics, (n,)."""
        assert self._redundant is not None
        assert self.dynamics.statics is not None
        names, errors = self._redundant
        scaled = unknown[0] in ("moment", "gear", "torque")
        own = 0.5 * EPS * np.abs(self.dynamics.statics.get(unknown)) if scaled else 0.0
        scale = self.mechanism.size if scaled else 1.0
        return np.asarray(scale * errors[:, names.index(unknown)] + own)
