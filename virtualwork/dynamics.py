"""Forces of a mechanism in motion or at rest, on demand: effort, reactions, shaking force and moment."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork.dyads import Number, cross
from virtualwork.errors import DescriptionError
from virtualwork.loads import Block, Scene, plus
from virtualwork.mechanism import GROUND
from virtualwork.reactions import Joint, Reactions
from virtualwork.work import effort

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.motion import Motion
    from virtualwork.statics import Statics

    Reals = NDArray[np.float64]

EXTERNAL = ("weight", "inertia force", "inertia torque", "applied force", "applied torque")


class Dynamics:
    """The forces of a motion; each is formed when first asked for. `Motion.dynamics` makes one.

    Attributes
    ----------
    scene : Scene
        The loads.
    friction_iterations : int
        How often friction and reactions were exchanged; 0 without friction.
    """

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.scene = Scene(motion)

    @cached_property
    def _settled(self) -> tuple[int, NDArray[np.bool_]]:
        if not self.scene.rubs:
            return 0, np.ones(self.motion.n, dtype=bool)
        from virtualwork.friction import settle

        return settle(self.scene)

    @property
    def friction_iterations(self) -> int:
        """How often friction and reactions were exchanged until they agreed."""
        return self._settled[0]

    @property
    def locked(self) -> NDArray[np.bool_]:
        """(n,): poses in which friction locks the mechanism: no reaction balances its own friction."""
        return ~self._settled[1]

    @cached_property
    def effort(self) -> Reals:
        """The effort at each input by virtual work, (n, k)."""
        if self.scene.rubs:
            _ = self._settled
        found = effort(self.scene)
        if self.scene.rubs:
            found[self.locked] = np.nan
        return found

    @cached_property
    def reactions(self) -> Reactions:
        """The joint forces, each formed when asked for."""
        _ = self._settled
        return Reactions(self.scene)

    @cached_property
    def statics(self) -> Statics | None:
        """All equilibrium equations at once, where the constraints are redundant; else None."""
        if not self.reactions.redundant:
            return None
        from virtualwork.statics import Statics

        return Statics(self.reactions)

    @cached_property
    def newton_euler(self) -> Reals:
        """The effort at each input by Newton and Euler, (n, k): ΣM = 0 of the driven link with its joint forces."""
        found = []
        for j, entry in enumerate(self.motion.mechanism.inputs):
            if self.statics is None:
                found.append(self.reactions.effort(j))
            else:
                found.append(self.statics.get(("force" if entry.is_slide else "torque", str(j), "")))
        return np.stack(found, axis=1)

    def joint_force(self, joint: Joint, body: str) -> NDArray[np.complex128]:
        """The force of a joint on one of its bodies, (n,) complex; NaN where statics does not determine it."""
        solver = self.reactions if self.statics is None else self.statics
        found = solver.joint_force(joint, body)
        if self.scene.rubs:
            found[self.locked] = np.nan
        return found

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """The moment of a joint on one of its bodies about the joint's point, (n,): a guide's, or a pin's friction."""
        n = self.motion.n
        found = np.zeros(n)
        if joint.guide is not None:
            g = self.motion.mechanism.guides[joint.guide]
            if self.statics is None:
                found = self.reactions.guide_moment(joint.guide, body)
            elif g.is_slider:
                value = self.statics.get(("moment", joint.key, ""))
                found = value if body == g.link else -value
        for load in self.scene.rubs:
            if load.path is None and load.joint == joint.key and load.body == body:
                found = found + self.reactions.over(load.value, float)
        return found

    def joints_named(self, name: str) -> list[Joint]:
        """The joints at a point: a pin, a guide, or both.

        Raises
        ------
        DescriptionError
            Where there is none.
        """
        found = [joint for joint in self.reactions.joints if joint.name == name]
        if not found:
            known = ", ".join(dict.fromkeys(joint.name for joint in self.reactions.joints))
            raise DescriptionError(f"no joint at '{name}': expected one of {known}")
        return found

    def reaction(self, joint: str, on: str) -> Reals:
        """The force of all others on a link at a joint, (n, 2)."""
        here = [found for found in self.joints_named(joint) if on in found.bodies]
        if not here:
            raise DescriptionError(f"link '{on}' has no joint at '{joint}'")
        total: Any = sum(self.joint_force(found, on) for found in here)
        return np.stack([total.real, total.imag], axis=-1)

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Shaking force (n, 2) and shaking moment (n,) on the ground, about its origin.

        All that the moving links do to the ground through joints, springs and the drive's own reaction: by
        d'Alembert the sum of their weights, applied loads and inertia loads. No reaction is formed for it.
        """
        n = self.motion.n
        force, moment = np.zeros(n, complex), np.zeros(n)
        loads = [load for load in self.scene.loads if load.kind in EXTERNAL and load.body != GROUND]
        for block in self.scene.blocks():
            f: Number = None
            m: Number = None
            for load in loads:
                value = block.keep(load)
                if value is None:
                    continue
                if load.path is None:
                    m = plus(m, value)
                else:
                    f = plus(f, value)
                    m = plus(m, cross(block.position(load.path), value))
            if f is not None:
                force[block.rows] = f
            if m is not None:
                moment[block.rows] = m
        bad = ~self.motion.assembled
        force[bad], moment[bad] = np.nan, np.nan
        return np.stack([force.real, force.imag], axis=-1), moment

    def applied(self, link: str) -> tuple[NDArray[np.complex128], Reals]:
        """What acts on a link but its weight and inertia, reduced to its centre of mass: (n,) complex N, (n,) N·m."""
        if self.scene.rubs:
            _ = self._settled
        n = self.motion.n
        force, moment = np.zeros(n, complex), np.zeros(n)
        center = self.scene.rigid[link].center
        loads = [load for load in [*self.scene.loads, *self.scene.rubs] if load.body == link]
        for block in self.scene.blocks([f"angle:{link}"]):
            for load in loads:
                value = (
                    None if load.kind in ("weight", "inertia force", "inertia torque") else block.keep(load)
                )
                if value is None:
                    continue
                if load.path is None:
                    moment[block.rows] += value
                    continue
                force[block.rows] += value
                arm = load.arm(block, center)
                if arm is not None:
                    moment[block.rows] += cross(arm, value)
        return force, moment

    def blocks(self) -> list[Block]:
        """The scene's blocks."""
        return self.scene.blocks()
