"""Forces of a mechanism in motion or at rest, on demand: effort, reactions, shaking force and moment."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import guarded
from virtualwork.formulas.block import Block
from virtualwork.formulas.effort import effort, generalized
from virtualwork.formulas.forces import (
    Effort,
    Force,
    JointForce,
    JointMoment,
    NewtonEuler,
    Shaking,
    ShakingMoment,
)
from virtualwork.formulas.numbers import TOGETHER, Complexes, Number, Reals, leave_out, xy
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.reactions import Reactions, settle
from virtualwork.formulas.resultants import applied_loads, reduced, resultant, shaking_loads
from virtualwork.formulas.scene import Scene
from virtualwork.formulas.statics import Statics
from virtualwork.plan.steps import Joint, joints_at

V = TypeVar("V", Reals, Complexes)


@guarded
class Dynamics:
    """The forces of poses; each is formed when first asked for. `Motion.dynamics` is one.

    Attributes
    ----------
    scene : Scene
        The loads.
    friction_iterations : int
        How often friction and reactions were exchanged; 0 without friction.

    Parameters
    ----------
    poses : Poses
    taped : bool
        Whether the forces come from the tape of the poses, where it has them; else they are formed over blocks.
    """

    def __init__(self, poses: Poses, *, taped: bool = True) -> None:
        self.poses, self.lock, self.taped = poses, poses.lock, taped
        self.scene = Scene(poses)
        self._effort: Reals | None = None
        self._euler: Reals | None = None
        self._forces: dict[tuple[str, str], Complexes] = {}

    def _from_tape(self, *quantities: Force) -> list[Any] | None:
        """Forces, (n,) each; None where they are formed over blocks."""
        return self.poses.taped(quantities) if self.taped else None

    @cached_property
    def over_blocks(self) -> Dynamics:
        """The same forces formed over blocks throughout, as sums over the loads are."""
        return Dynamics(self.poses, taped=False) if self.taped else self

    @cached_property
    def _settled(self) -> tuple[int, NDArray[np.bool_]]:
        if not self.scene.friction:
            return 0, np.ones(self.poses.n, dtype=bool)
        return settle(self.scene)

    @property
    def friction_iterations(self) -> int:
        """How often friction and reactions were exchanged until they agreed."""
        return self._settled[0]

    @property
    def locked(self) -> NDArray[np.bool_]:
        """(n,): poses in which friction locks the mechanism: no reaction balances its own friction."""
        return ~self._settled[1]

    def _moving(self, values: V) -> V:
        """Values that depend on friction, without those of poses in which it locks the mechanism."""
        if self.scene.friction:
            values = values.copy()
            leave_out(values, self.locked)
        return values

    @cached_property
    def without_length(self) -> dict[int, NDArray[np.bool_]]:
        """Of the springs whose pull needs a direction, by number: the poses in which their ends meet, (n,)."""
        m, found = self.poses.mechanism, {}
        for number, spring in enumerate(m.springs, 1):
            if (spring.stiffness and spring.free_length) or (spring.damping and self.scene.moves):
                a, b = (self.poses.point(link, m.place(link, p)) for link, p in spring.between)
                meet = np.broadcast_to(np.abs(a - b) <= TOGETHER * m.size, self.poses.n)
                if meet.any():
                    found[number] = meet
        return found

    @property
    def effort(self) -> Reals:
        """The effort at each input by virtual work, (n, k)."""
        if self._effort is None:
            found = self._from_tape(*(Effort(j) for j in range(len(self.poses.mechanism.inputs))))
            self._effort = None if found is None else np.stack(found, axis=1)
        if self._effort is None:
            # friction settles first: the loads depend on it
            _ = self._settled
            self._effort = self._moving(effort(self.scene))
        return self._effort

    @property
    def generalized(self) -> Reals:
        """What balances the loads at each input, (n, k): the effort, but for motors that sit on another body than `on`."""
        _ = self._settled
        return self._moving(generalized(self.scene))

    @cached_property
    def reactions(self) -> Reactions:
        """The joint forces, each formed when asked for."""
        _ = self._settled
        return Reactions(self.scene)

    @property
    def by_key(self) -> Mapping[str, Joint]:
        """The joints by their keys."""
        return self.reactions.by_key

    @cached_property
    def statics(self) -> Statics | None:
        """All equilibrium equations at once, where the constraints are redundant; else None."""
        if not self.reactions.redundant:
            return None
        return Statics(self.reactions)

    @property
    def newton_euler(self) -> Reals:
        """The effort at each input by Newton and Euler, (n, k): ΣM = 0 of the driven link with its joint forces."""
        if self._euler is None:
            found = self._from_tape(*(NewtonEuler(j) for j in range(len(self.poses.mechanism.inputs))))
            self._euler = None if found is None else np.stack(found, axis=1)
        if self._euler is None:
            r, inputs = self.reactions, self.poses.mechanism.inputs
            if self.statics is not None:
                found = [
                    self.statics.get(("force" if entry.is_slide else "torque", str(j), ""))
                    for j, entry in enumerate(inputs)
                ]
            else:
                found = r.over(*(partial(r.effort, j=j) for j in range(len(inputs))))
            self._euler = self._moving(np.stack(found, axis=1))
        return self._euler

    def joint_force(self, joint: Joint, body: str) -> Complexes:
        """The force of a joint on one of its bodies, (n,) complex; NaN where statics does not determine it."""
        key = joint.key, body
        if key not in self._forces:
            found = self._from_tape(JointForce(*key))
            if found is not None:
                self._forces[key] = found[0]
            elif self.statics is not None:
                self._forces[key] = self.statics.joint_force(joint, body)
            else:
                form = partial(self.reactions.joint_force, joint=joint, body=body)
                (self._forces[key],) = self.reactions.over(form, kind=complex)
            self._forces[key] = self._moving(self._forces[key])
        return self._forces[key]

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """The moment of a joint on one of its bodies about the joint's point, (n,): a guide's, or a pin's friction."""
        found = self._from_tape(JointMoment(joint.key, body))
        if found is not None:
            return np.asarray(found[0])
        r = self.reactions
        result = np.zeros(self.poses.n)
        if joint.guide is not None:
            g = self.poses.mechanism.guides[joint.guide]
            if self.statics is None:
                (result,) = r.over(partial(r.guide_moment, guide=joint.guide, body=body))
            elif g.is_slider:
                value = self.statics.guide_moment(joint)
                result = value if body == g.link else -value
        for load in self.scene.friction:
            if load.path is None and load.joint == joint.key and load.body == body:
                result = result + r.over(load.form)[0]
        return self._moving(result)

    def contact(self, cam: int) -> Reals:
        """How hard a cam (from 0) presses on its follower along the normal, (n,); below zero it would have to pull."""
        statics, r = self.statics, self.reactions
        if statics is None:
            return self._moving(r.over(lambda block: r.contact(block, cam))[0])
        drive = self.poses.mechanism.cam_drives[cam]
        unit = 1.0 if drive.guide is not None else self.poses.mechanism.size
        push = statics.get(("contact", str(cam), "")) * unit

        def form(block: Block) -> Number:
            here = push[block.rows]
            return r.contact(block, cam, here if block.st.many else float(here[0]))

        return self._moving(r.over(form)[0])

    def reaction(self, joint: str, on: str) -> Reals:
        """The force of all others on a link at a joint, (n, 2)."""
        return xy(self.at_joint(joint, on))

    def at_joint(self, joint: str, on: str) -> Complexes:
        """The same, (n,) complex: of a pin and of a guide, where both are of that name."""
        total, *others = (
            self.joint_force(found, on) for found in joints_at(self.reactions.joints, joint, on)
        )
        for force in others:
            total = total + force
        return total

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Shaking force (n, 2) and shaking moment (n,) on the ground, about its origin.

        All that the moving links do to the ground through joints, springs and the drive's own reaction: by
        d'Alembert the sum of their weights, applied loads and inertia loads. No reaction is formed for it.
        """
        taped = self._from_tape(Shaking(), ShakingMoment())
        if taped is not None:
            return xy(taped[0]), taped[1]
        n = self.poses.n
        force, moment = np.zeros(n, complex), np.zeros(n)
        loads = shaking_loads(self.scene.loads)

        def work(block: Block) -> None:
            f, m = resultant(loads, block)
            if f is not None:
                force[block.rows] = f
            if m is not None:
                moment[block.rows] = m

        self.scene.each((), work)
        out = ~self.poses.assembled
        if self.scene.lost is not None:
            out = out | self.scene.lost
        leave_out(force, out)
        leave_out(moment, out)
        return xy(force), moment

    def applied(self, link: str) -> tuple[Complexes, Reals]:
        """What acts on a link but its weight and inertia, reduced to its centre of mass: (n,) complex N, (n,) N·m."""
        _ = self._settled
        n = self.poses.n
        force, moment = np.zeros(n, complex), np.zeros(n)
        loads = applied_loads(self.scene.case.everything, link)
        for block in self.scene.blocks([f"angle:{link}"]) if loads else ():
            f, m = reduced(loads, block, self.scene.rigid[link].center)
            force[block.rows] += 0.0 if f is None else f
            moment[block.rows] += 0.0 if m is None else m
        return self._moving(force), self._moving(moment)


class Moving(Protocol):
    """A motion, as the studies need it."""

    @property
    def dynamics(self) -> Dynamics:
        """Its forces, which hold its poses."""
