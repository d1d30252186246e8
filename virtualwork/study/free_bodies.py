"""Free-body diagrams: every link cut loose, with all that acts on it, inertia forces too: ΣF = 0, ΣM = 0.

Ibrahim §2.2 and §2.3, Riul, unit II, figures 3 to 5: loads, weights, joint forces, −m·a_G and −I_G·α (d'Alembert).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import (
    Contact,
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
from virtualwork.formulas.kinematics import ContactPlace, ContactWay, Point
from virtualwork.plan.joint_forces import pairs

if TYPE_CHECKING:
    from collections.abc import Iterator

    from virtualwork.describe.description import Description
    from virtualwork.formulas.load_case import LoadCase
    from virtualwork.formulas.load_paths import LoadPaths
    from virtualwork.formulas.numbers import Complexes, Reals
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.formulas.touches import Touches
    from virtualwork.plan.joint_forces import Order
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
    """Of a drive or of teeth along a guide, and of a cam: the direction of its effort."""


def parts(paths: LoadPaths) -> dict[str, list[Part]]:
    """Return what acts on every link by the keys of its quantities."""
    m, case, of = paths.mechanism, paths.case, paths.order
    result: dict[str, list[Part]] = {body: [] for body in m.links}
    for body, part in (*_loads(case), *_joints(case, of), *_meshes(of), *_drives(m), *_cams(paths.touches)):
        if body != GROUND:
            result[body].append(part)
    return result


def _loads(case: LoadCase) -> Iterator[tuple[str, Part]]:
    for i, load in enumerate(case.loads):
        name = SHORT.get(load.kind, load.kind)
        if load.path is None:
            yield load.body, Part(name, load.kind, LoadTorque(i), None, 1.0)
        else:
            yield load.body, Part(name, load.kind, Load(i), LoadPlace(i), 1.0)


def _joints(case: LoadCase, of: Order) -> Iterator[tuple[str, Part]]:
    m = of.mechanism
    rubbing = {joint.key for joint, *_ in case.contacts if joint.guide is None}
    for joint in of.joints:
        guide = joint.guide
        for body in joint.bodies:
            if body == GROUND:
                continue
            at = Point(body, 0j, joint.name, 0) if guide is None else _block(m, guide)
            name = f"{joint.name}: {_other(joint, body)}"
            yield body, Part(name, "joint force", JointForce(joint.key, body), at, 1.0)
            if joint.key in rubbing or (guide is not None and m.guides[guide].is_slider):
                yield body, Part(name, "joint moment", JointMoment(joint.key, body), None, 1.0)


def _drives(m: Description) -> Iterator[tuple[str, Part]]:
    for j, entry in enumerate(m.inputs):
        if entry.is_slide:
            guide = m.guide_of(entry)
            g = m.guides[guide]
            for body, name, sign in ((g.link, "F", 1.0), (g.on, "−F", -1.0)):
                yield body, Part(name, "drive", Effort(j), _block(m, guide), sign, Rail(guide))
        else:
            for body, name, sign in ((str(entry.link), "T", 1.0), (m.carrier(j), "−T", -1.0)):
                yield body, Part(name, "drive", Effort(j), None, sign)


def _block(m: Description, guide: int) -> Point:
    """Where a guide's block stands."""
    return Point(m.guides[guide].link, 0j, m.guides[guide].point, 0)


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
    for body, every in parts(dynamics.paths).items():
        for part in every:
            load, at, along = (_value(dynamics, key) for key in (part.key, part.at, part.along))
            load = part.sign * load if along is None else part.sign * load * along
            if at is not None:
                result[body].forces.append(Force(part.name, part.kind, at, load))
            elif part.kind != "joint moment" or np.any(np.nan_to_num(load)):
                result[body].torques.append(Torque(part.name, part.kind, load))
    return list(result.values())


def _value(dynamics: Dynamics, key: Any) -> Any:
    if key is None:
        return None
    return np.asarray(dynamics.value(key) if key.is_force else dynamics.poses.values((key,))[0])


def _cams(touches: Touches) -> Iterator[tuple[str, Part]]:
    for number, touch in enumerate(touches.every):
        cam, at, way = touch.drive.cam.cam, ContactPlace(number), ContactWay(number)
        for body, other, sign in ((touch.body, cam, 1.0), (cam, touch.body, -1.0)):
            yield body, Part(f"N: {other}", "contact force", Contact(number), at, sign, way)


def _meshes(of: Order) -> Iterator[tuple[str, Part]]:
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
