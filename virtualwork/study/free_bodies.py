"""Free-body diagrams: every link cut loose, with all that acts on it, inertia forces too: ΣF = 0, ΣM = 0.

Ibrahim §2.2 and §2.3, Riul, unit II, figures 3 to 5: loads, weights, joint forces, −m·a_G and −I_G·α (d'Alembert).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import (
    Effort,
    JointForce,
    JointMoment,
    Load,
    LoadPlace,
    LoadTorque,
    MeshForce,
    MeshTorque,
    Rail,
    ToothPlace,
)
from virtualwork.formulas.kinematics import Point
from virtualwork.formulas.touches import Touch
from virtualwork.plan.joint_forces import pairs

if TYPE_CHECKING:
    from collections.abc import Iterator

    from virtualwork.describe.description import Description
    from virtualwork.formulas.load_case import LoadCase
    from virtualwork.formulas.loaded_pose import LoadedPose
    from virtualwork.formulas.numbers import Complexes, Number, Reals
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.formulas.reactions import JointForces
    from virtualwork.plan.steps import Joint

SHORT = {
    "weight": "W",
    "inertia force": "−m·a",
    "inertia torque": "−I·α",
    "applied force": "F",
    "applied torque": "T",
}


class Force(NamedTuple):
    """A force on a link over all poses: where it acts (m) and what it is (N), (n,) complex in ground axes."""

    name: str
    kind: str
    at: Complexes
    force: Complexes


class Torque(NamedTuple):
    """A torque on a link over all poses, (n,) N·m."""

    name: str
    kind: str
    torque: Reals


class Part(NamedTuple):
    """What acts on a link, by the keys of its quantities: a force with its place, or a torque (`at` is None)."""

    name: str
    kind: str
    key: Quantity
    at: Quantity | None
    sign: float
    along: Quantity | None = None
    """Of a drive or of teeth along a guide: the direction of its effort."""


def parts(case: LoadCase, of: JointForces) -> dict[str, list[Part]]:
    """Return what acts on every link, as `free_bodies` has it over poses, for tapes."""
    m = of.mechanism
    rubbing = {joint.key for joint, *_ in case.contacts if joint.guide is None}
    result: dict[str, list[Part]] = {body: [] for body in m.links}
    for i, load in enumerate(case.loads):
        if load.body != GROUND:
            name = SHORT.get(load.kind, load.kind)
            torque = load.path is None
            key: Quantity = LoadTorque(i) if torque else Load(i)
            result[load.body].append(Part(name, load.kind, key, None if torque else LoadPlace(i), 1.0))
    for joint in of.joints:
        for body in joint.bodies:
            if body == GROUND:
                continue
            guide = joint.guide
            at: Quantity | None = Point(body, 0j, joint.name, 0) if guide is None else _block_key(m, guide)
            name = f"{joint.name}: {_other(joint, body)}"
            result[body].append(Part(name, "joint force", JointForce(joint.key, body), at, 1.0))
            if joint.key in rubbing or (guide is not None and m.guides[guide].is_slider):
                result[body].append(Part(name, "joint moment", JointMoment(joint.key, body), None, 1.0))
    for body, part in _meshes(of):
        if body != GROUND:
            result[body].append(part)
    for j, entry in enumerate(m.inputs):
        guide = m.guide_of(entry) if entry.is_slide else None
        ends = (
            (str(entry.link), m.carrier(j)) if guide is None else (m.guides[guide].link, m.guides[guide].on)
        )
        for body, sign in zip(ends, (1.0, -1.0), strict=True):
            if body == GROUND:
                continue
            at, along = (None, None) if guide is None else (_block_key(m, guide), Rail(guide))
            letter = "T" if guide is None else "F"
            name = letter if sign > 0 else f"−{letter}"
            result[body].append(Part(name, "drive", Effort(j), at, sign, along))
    return result


def _block_key(m: Description, guide: int) -> Quantity:
    g = m.guides[guide]
    return Point(g.link, 0j, g.point, 0)


def _other(joint: Joint, body: str) -> str:
    """The body that a joint's force on a body comes from."""
    others = [of for _, on, of in pairs([joint]) if on == body]
    return (others or [on for _, on, of in pairs([joint]) if of == body])[0]


class FreeBody(NamedTuple):
    """A link cut loose."""

    link: str
    outline: dict[str, Complexes]
    """Its points, (n,) m."""
    center: Complexes
    forces: list[Force]
    torques: list[Torque]

    def resultant(self) -> tuple[Complexes, Reals]:
        """ΣF and ΣM about the centre of mass, (n,): rounding, as the link is in (dynamic) equilibrium."""
        total = sum((f.force for f in self.forces), np.zeros_like(self.center))
        moment = sum((t.torque for t in self.torques), np.zeros(len(self.center)))
        for f in self.forces:
            arm = f.at - self.center
            moment = moment + (np.conj(arm) * f.force).imag
        return total, moment


def free_bodies(dynamics: Dynamics) -> list[FreeBody]:
    """Return every link cut loose, with all that acts on it.

    Examples
    --------
    A weight of 2·9.81 N on an arm of 0.5 m, held at 0°: the bearing carries it, the drive holds its moment.

    >>> from virtualwork import Input, Link, Mechanism
    >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"), gravity=-9.81j)
    >>> body, = free_bodies(arm.motion(0.0).dynamics)
    >>> [(f.name, complex(f.force[0])) for f in body.forces], [(t.name, float(t.torque[0])) for t in body.torques]
    ([('W', -19.62j), ('O: ground', 19.62j)], [('T', 9.81)])
    """
    m, poses = dynamics.poses.mechanism, dynamics.poses
    effort = dynamics.effort
    over = dynamics.scene.over
    result = {
        body: FreeBody(
            body,
            {name: poses.point(body, 0j, 0, name) for name in link.points},
            poses.point(body, m.rigid[body].center),
            [],
            [],
        )
        for body, link in m.links.items()
    }
    for load in dynamics.scene.case.everything:
        if load.body == GROUND or load.kind == "friction":
            # the friction of a joint is in its force and moment
            continue
        name = SHORT.get(load.kind, load.kind)
        if load.path is None:
            (torque,) = over([load.form], float)
            result[load.body].torques.append(Torque(name, load.kind, torque))
        else:
            (force,) = over([load.form], complex)
            at = poses.point(load.body, load.place)
            result[load.body].forces.append(Force(name, load.kind, at, force))
    for joint in dynamics.reactions.joints:
        for body in joint.bodies:
            if body == GROUND:
                continue
            if joint.guide is None:
                at = poses.point(body, 0j, 0, joint.name)
            else:
                at = _block(dynamics, joint.guide)
            name = f"{joint.name}: {_other(joint, body)}"
            result[body].forces.append(Force(name, "joint force", at, dynamics.joint_force(joint, body)))
            moment = dynamics.joint_moment(joint, body)
            if np.any(np.nan_to_num(moment)):
                result[body].torques.append(Torque(name, "joint moment", moment))
    for number, touch in enumerate(dynamics.reactions.paths.touches.every):
        forms = partial(_normal, touch=touch), partial(_touching, touch=touch)
        way, at = over(forms, complex, touch.targets)
        force = dynamics.contact(number) * way
        for body, other, sign in (
            (touch.body, touch.drive.cam.cam, 1.0),
            (touch.drive.cam.cam, touch.body, -1.0),
        ):
            if body != GROUND:
                result[body].forces.append(Force(f"N: {other}", "contact force", at, sign * force))
    for body, part in _meshes(dynamics.reactions):
        if body == GROUND:
            continue
        force, at, along = (_value(dynamics, key) for key in (part.key, part.at, part.along))
        if at is None:
            result[body].torques.append(Torque(part.name, part.kind, part.sign * force))
        else:
            result[body].forces.append(Force(part.name, part.kind, at, part.sign * force * along))
    for j, entry in enumerate(m.inputs):
        if not entry.is_slide:
            for body, sign in ((str(entry.link), 1.0), (m.carrier(j), -1.0)):
                if body != GROUND:
                    result[body].torques.append(
                        Torque("T" if sign > 0 else "−T", "drive", sign * effort[:, j])
                    )
            continue
        i = m.guide_of(entry)
        g = m.guides[i]
        (rail,) = over([partial(dynamics.reactions.rail, guide=i)], complex)
        at = _block(dynamics, i)
        for body, sign in ((g.link, 1.0), (g.on, -1.0)):
            if body != GROUND:
                result[body].forces.append(
                    Force("F" if sign > 0 else "−F", "drive", at, sign * effort[:, j] * rail)
                )
    return list(result.values())


def _value(dynamics: Dynamics, key: Any) -> Any:
    return None if key is None else np.asarray(dynamics.value(key))


def _meshes(of: JointForces) -> Iterator[tuple[str, Part]]:
    """What gears and belts turn each of their links by; of racks the tooth force at the pitch point of the wheel."""
    m = of.mechanism
    for i, mesh in enumerate(m.meshes):
        pin = None if mesh.guide is None else of.meshing(i)
        if mesh.guide is None or pin is None:
            for body in mesh.torques:
                yield body, Part(mesh.kind, f"{mesh.kind} torque", MeshTorque(i, body), None, 1.0)
            continue
        g = m.guides[mesh.guide]
        # the wheel turns on the body of the guide, or rolls along it
        for body, sign in ((g.link, 1.0), (mesh.wheel if pin else g.on, -1.0)):
            yield body, Part("teeth", "tooth force", MeshForce(i), ToothPlace(i), sign, Rail(mesh.guide))


def _normal(pose: LoadedPose, touch: Touch) -> Number:
    """The direction in which a cam presses on its follower, a unit vector."""
    unit = touch.at(pose.st).unit()
    return touch.drive.cam.sign * unit / abs(unit)


def _touching(pose: LoadedPose, touch: Touch) -> Number:
    """Where a cam and its follower touch."""
    return touch.axis(pose.st) + touch.at(pose.st).touch()


def _block(dynamics: Dynamics, guide: int) -> Complexes:
    """Where a guide's block stands, (n,)."""
    m, poses = dynamics.poses.mechanism, dynamics.poses
    g = m.guides[guide]
    z = m.bodies[g.link][g.point]
    return np.full(poses.n, z) if g.link == GROUND else poses.point(g.link, z)
