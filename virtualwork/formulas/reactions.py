"""Joint forces by Newton and Euler, each formed on request.

How they follow from each other is worked out once for a mechanism (`load_paths`); here the combinations become numbers of a pose.
"""

from __future__ import annotations

from collections.abc import Callable

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import Number, dot, minus, plus, times
from virtualwork.plan.joint_forces import Side
from virtualwork.plan.steps import Joint


class JointForces:
    """The joint forces of a pose."""

    def __init__(self, paths: LoadPaths) -> None:
        self.paths = paths
        self.order = paths.order
        self.plan, self.mechanism = paths.plan, paths.mechanism
        self.joints, self.by_key = self.order.joints, self.order.by_key

    @property
    def redundant(self) -> bool:
        """Whether statics cannot give every joint force: more unknowns than equations."""
        return self.order.redundant

    def force(self, pose: LoadedPose, body: str, *, touched: bool = True) -> Number:
        """The sum of the loads on a body, those of cams (`touched`) among them."""
        return self.paths.force(body, touched=touched).value(pose)

    def moment(self, pose: LoadedPose, body: str, *, touched: bool = True) -> Number:
        """The moment of the loads on a body about its centre of mass."""
        return self.paths.moment(body, self.mechanism.rigid[body].center, touched=touched).value(pose)

    def on_side(self, pose: LoadedPose, side: Side) -> Number:
        """The force of a joint on a body, complex; None where it is zero throughout."""
        joint, body = side
        pose.names.add(f"{joint} on {body}")
        return self.paths.value(pose, self.paths.side(side))

    def place(self, pose: LoadedPose, side: Side) -> Number:
        """Where a joint's force acts, from the body's centre of mass, in ground axes."""
        body = side[1]
        z, guide, direction = self.paths.place(side)
        z -= self.mechanism.rigid[body].center
        return (z if guide is None else z + direction * pose.st.slide[guide]) * pose.st.turn[body]

    def joint_force(self, pose: LoadedPose, joint: Joint, body: str) -> Number:
        """The force of a joint on a body, without the force of an input that drives it."""
        value = self.on_side(pose, (joint.key, body))
        guide = joint.guide
        if guide is not None and value is not None and self.is_pushed(guide):
            # along a driven guide the joint's own equilibrium leaves the effort, which is a result of its own, or a tooth force
            rail = self.rail(pose, guide)
            value = value - dot(value, rail) * rail
        value = plus(value, self.borne(pose, joint, body))
        return plus(value, self.rubbed(pose, joint, body))

    def is_pushed(self, guide: int) -> bool:
        """Whether another part than the rail pushes along a guide: an input, a cam, or the teeth of a wheel that has a bearing."""
        driven = self.mechanism.driver_of(guide) is not None
        cam = any(drive.guide == guide for drive in self.mechanism.cam_drives)
        return (
            driven or cam or any(self.meshing(mesh) is not None for mesh in self.order.racks.get(guide, ()))
        )

    def meshing(self, mesh: int) -> str | None:
        """Where the teeth of a rack's wheel act.

        The name of the pin on which the wheel turns on the body that carries the rack's guide; "" where the wheel rolls
        along a rack of that body; None where it is neither, and the tooth force is taken to act along the guide.
        """
        of = self.mechanism.meshes[mesh]
        assert of.guide is not None
        g = self.mechanism.guides[of.guide]
        if of.wheel == g.link:
            return ""
        wheel, carrier = self.mechanism.bodies[of.wheel], self.mechanism.bodies[g.on]
        return next((name for name in wheel if name in carrier), None)

    def tooth(self, pose: LoadedPose, mesh: int) -> Number:
        """The tooth force of a rack along its slide, positive on the link of the guide."""
        return self.paths.value(pose, self.paths.tooth(mesh))

    def contact(self, pose: LoadedPose, cam: int, push: Number = None) -> Number:
        """How hard a cam presses on its follower along the normal; below zero it would have to pull.

        `push`: what it does along the follower's coordinate, where statics determines it.
        """
        touch = self.paths.touches.every[cam]
        if push is None:
            push = self.paths.value(pose, self.paths.push(touch))
        return times(times(touch.drive.cam.sign, abs(touch.at(pose.st).unit())), push)

    def borne(
        self,
        pose: LoadedPose,
        joint: Joint,
        body: str,
        tooth: Callable[[LoadedPose, int], Number] | None = None,
    ) -> Number:
        """What the bearing of a rack's wheel bears of the tooth force (`tooth`), on one body."""
        tooth = tooth or self.tooth
        total: Number = None
        if joint.guide is not None:
            return total
        for guide, meshes in self.order.racks.items():
            for mesh in meshes:
                if self.meshing(mesh) != joint.name:
                    continue
                wheel, carrier = self.mechanism.meshes[mesh].wheel, self.mechanism.guides[guide].on
                if body in (wheel, carrier):
                    force = times(self.rail(pose, guide), tooth(pose, mesh))
                    total = plus(total, force) if body == wheel else minus(total, force)
        return total

    def rubbed(self, pose: LoadedPose, joint: Joint, body: str) -> Number:
        """The friction force along a guide belongs to its reaction."""
        total: Number = None
        for load in self.paths.case.friction:
            if load.path is None or load.joint != joint.key:
                continue
            # no load stands there: it feels the reverse of the other body's
            if body == GROUND:
                total = minus(total, load.form(pose))
            elif load.body == body:
                total = plus(total, load.form(pose))
        return total

    def rail(self, pose: LoadedPose, guide: int | None) -> Number:
        """The direction of a guide, a unit vector."""
        assert guide is not None
        on = self.mechanism.guides[guide].on
        d = self.plan.directions[guide]
        return d if on == GROUND else d * pose.st.turn[on]

    def guide_moment(self, pose: LoadedPose, guide: int, body: str) -> Number:
        """The moment of a guide on one of its bodies about its point."""
        g = self.mechanism.guides[guide]
        if not g.is_slider:
            return None
        value = self.paths.value(pose, self.paths.couple("guide", guide))
        value = plus(value, self.beside(pose, guide))
        return value if value is None or body == g.link else -value

    def beside(
        self, pose: LoadedPose, guide: int, tooth: Callable[[LoadedPose, int], Number] | None = None
    ) -> Number:
        """The load of a guide whose link teeth push, off the guide's line: at the pitch point of the wheel."""
        tooth = tooth or self.tooth
        g, m = self.mechanism.guides[guide], self.mechanism
        total: Number = None
        for mesh in self.order.racks.get(guide, ()):
            pin, rack = self.meshing(mesh), m.meshes[mesh].rack
            if pin and rack is not None:
                across = (
                    dot(1j * self.plan.directions[guide], m.bodies[g.on][pin] - m.through(g)) - rack.radius
                )
                total = plus(total, times(across, tooth(pose, mesh)))
        return total

    def effort(self, pose: LoadedPose, j: int) -> Number:
        """The effort at input j by Newton and Euler: ΣM = 0 of the driven link, or the force along the slide."""
        entry = self.mechanism.inputs[j]
        if not entry.is_slide:
            return self.paths.value(pose, self.paths.couple("input", j))
        guide = self.mechanism.guide_of(entry)
        value = self.on_side(pose, (f"guide:{guide}", self.mechanism.guides[guide].link))
        value = None if value is None else dot(value, self.rail(pose, guide))
        for mesh in self.order.racks.get(guide, ()):
            value = minus(value, self.tooth(pose, mesh))
        return value
