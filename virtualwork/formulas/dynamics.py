"""Forces of a mechanism in motion or at rest, on demand: effort, reactions, shaking force and moment."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from virtualwork.describe.errors import DescriptionError
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Number, cross
from virtualwork.formulas.effort import effort, finished, write_effort
from virtualwork.formulas.load_paths import carried
from virtualwork.formulas.loads import plus
from virtualwork.formulas.reactions import Reactions
from virtualwork.formulas.scene import Block, Scene
from virtualwork.joints import Joint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.bounds.forces import ForceErrors
    from virtualwork.formulas.statics import Statics
    from virtualwork.motion import Motion

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
        self._forces: dict[tuple[str, str], NDArray[np.complex128]] = {}
        self._errors: ForceErrors | None = None

    @cached_property
    def _settled(self) -> tuple[int, NDArray[np.bool_]]:
        if not self.scene.rubs:
            return 0, np.ones(self.motion.n, dtype=bool)
        from virtualwork.formulas.friction import settle

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
        from virtualwork.formulas.statics import Statics

        return Statics(self.reactions)

    @cached_property
    def newton_euler(self) -> Reals:
        """The effort at each input by Newton and Euler, (n, k): ΣM = 0 of the driven link with its joint forces."""
        r, inputs = self.reactions, self.motion.mechanism.inputs
        if self.statics is not None:
            names = [("force" if entry.is_slide else "torque", str(j), "") for j, entry in enumerate(inputs)]
            return np.stack([self.statics.get(name) for name in names], axis=1)
        return np.stack(r.over(*(partial(r.effort, j=j) for j in range(len(inputs)))), axis=1)

    def solve(self, sides: Iterable[tuple[Joint, str]] | None = None) -> None:
        """Form effort, both ways, and joint forces in one pass over the poses, instead of each when asked for.

        Parameters
        ----------
        sides : iterable of (joint, body), optional
            The joint forces; default one side of every joint.
        """
        r, inputs = self.reactions, self.motion.mechanism.inputs
        if self.statics is not None or self.scene.rubs or carried(self.scene):
            return
        if sides is None:
            sides = [(joint, joint.bodies[-1]) for joint in r.joints]
        wanted = [side for side in sides if (side[0].key, side[1]) not in self._forces]
        n, k = self.motion.n, len(inputs)
        work, euler = np.zeros((n, k)), np.zeros((n, k))

        def efforts(block: Block) -> None:
            if "effort" not in self.__dict__:
                write_effort(self.scene, block, work)
            for j in range(k):
                value = r.effort(block, j)
                if value is not None:
                    euler[block.rows, j] = value

        forms = [partial(r.joint_force, joint=joint, body=body) for joint, body in wanted]
        found = r.over(*forms, kind=complex, also=efforts)
        for (joint, body), force in zip(wanted, found, strict=True):
            self._forces[joint.key, body] = force
        if self.scene.lost is not None:
            euler[self.scene.lost] = np.nan
        self.__dict__.setdefault("newton_euler", euler)
        if "effort" not in self.__dict__:
            self.__dict__["effort"] = finished(self.scene, work)

    def joint_force(self, joint: Joint, body: str) -> NDArray[np.complex128]:
        """The force of a joint on one of its bodies, (n,) complex; NaN where statics does not determine it."""
        key = joint.key, body
        if key not in self._forces:
            if self.statics is not None:
                self._forces[key] = self.statics.joint_force(joint, body)
            else:
                form = partial(self.reactions.joint_force, joint=joint, body=body)
                (self._forces[key],) = self.reactions.over(form, kind=complex)
            if self.scene.rubs:
                self._forces[key][self.locked] = np.nan
        return self._forces[key]

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """The moment of a joint on one of its bodies about the joint's point, (n,): a guide's, or a pin's friction."""
        r = self.reactions
        found = np.zeros(self.motion.n)
        if joint.guide is not None:
            g = self.motion.mechanism.guides[joint.guide]
            if self.statics is None:
                (found,) = r.over(partial(r.guide_moment, guide=joint.guide, body=body))
            elif g.is_slider:
                value = self.statics.get(("moment", joint.key, ""))
                found = value if body == g.link else -value
        for load in self.scene.rubs:
            if load.path is None and load.joint == joint.key and load.body == body:
                found = found + r.over(load.value)[0]
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
        total, *others = (self.joint_force(found, on) for found in here)
        for force in others:
            total = total + force
        return pairs(total)

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Shaking force (n, 2) and shaking moment (n,) on the ground, about its origin.

        All that the moving links do to the ground through joints, springs and the drive's own reaction: by
        d'Alembert the sum of their weights, applied loads and inertia loads. No reaction is formed for it.
        """
        n = self.motion.n
        force, moment = np.zeros(n, complex), np.zeros(n)
        loads = [load for load in self.scene.loads if load.kind in EXTERNAL and load.body != GROUND]

        def work(block: Block) -> None:
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

        self.scene.each((), work)
        out = ~self.motion.assembled
        force[out], moment[out] = np.nan, np.nan
        if self.scene.lost is not None:
            force[self.scene.lost], moment[self.scene.lost] = np.nan, np.nan
        return pairs(force), moment

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

    def error_estimate(self) -> ForceErrors:
        """Return bounds of the rounding errors of all forces, under the names of what they bound.

        Dimensions, loads and inputs are taken as exact. With joint friction there are none: infinite.

        Examples
        --------
        A weight of 2·9.81 N on an arm of 0.5 m at 60°:

        >>> from virtualwork import Input, Link, Mechanism
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"),
        ...                 gravity=-9.81j)
        >>> found = arm.motion(np.pi / 3).dynamics
        >>> bool(abs(found.effort[0, 0] - 4.905) <= found.error_estimate().effort[0, 0] < 1e-14)
        True
        """
        from virtualwork.bounds.forces import ForceErrors

        if self._errors is None:
            self._errors = ForceErrors(self)
        return self._errors

    def blocks(self) -> list[Block]:
        """The scene's blocks."""
        return self.scene.blocks()


def pairs(z: NDArray[np.complex128]) -> Reals:
    """x + iy as rows (x, y), without a copy."""
    return np.ascontiguousarray(z).view(float).reshape(-1, 2)
