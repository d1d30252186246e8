"""URDF: a tree of links. Loops stand in `<gazebo>` blocks, as `<loop_joint>`, or as a second joint to one child."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from dalembert.documents import markup as xml
from dalembert.documents.robots import ROWS, Array, Inertial, Kind, Robot, RobotJoint, RobotLink
from dalembert.errors import DataError
from rigidbody3d.robots import sdf
from rigidbody3d.robots.elements import pose, printed, rpy, sphere_around, stated

KINDS: dict[str, Kind] = {**sdf.KINDS, "spherical": "ball"}
# tag -> the tags in it that are read, or that say nothing of a mechanism
READ = sdf.READ | {
    "robot": "link joint loop_joint gazebo transmission ros2_control material sensor",
    "link": "inertial visual collision contact sensor",
    "inertial": "origin mass inertia",
    "joint": f"{sdf.READ['joint']} origin limit dynamics mimic calibration safety_controller",
    "gazebo": "joint plugin material visual collision sensor light mu1 mu2 kp kd minDepth maxVel maxContacts selfCollide "
    "self_collide laserRetro provideFeedback preserveFixedJoint disableFixedJointLumping",
}


class _Joint(NamedTuple):
    """A `<joint>` before its links have their places."""

    element: Element
    name: str
    at: xml.At
    parent: str
    child: str


def read(file: str, root: Element) -> Robot:
    """Read a `<robot>`."""
    robot = Robot(file, root.get("name", ""), notes=xml.passed_over(root, READ))
    joints = list(xml.children(root, "joint"))
    for e in xml.children(root, "link"):
        name, at = xml.placed(file, e)
        held = _inertial(at, xml.child(e, "inertial"))
        robot.add(RobotLink(name, np.eye(4), held, shapes=_shapes(at, e)))
    if not robot.links:
        raise DataError(f"{file}: <robot>: no link: expected one or more")
    _tree(robot, joints)
    for e in xml.children(root, "loop_joint"):
        _loop(robot, e)
    for e in xml.children(root, "gazebo"):
        for inner in xml.children(e, "joint"):
            sdf.read_joint(robot, inner)
    for e in joints:
        mimic = xml.child(e, "mimic")
        if mimic is not None:
            robot.mimic(xml.named(file, e), xml.named(file, mimic, "joint"), mimic.attrib)
    _motors(robot, root)
    return robot


def origin(at: xml.At, element: Element | None) -> Array:
    """Return the pose that an `<origin>` gives."""
    if element is None:
        return np.eye(4)
    xyz, angles = (
        at.numbers(f"origin {key}", element.get(key), 3, (0.0, 0.0, 0.0)) for key in ("xyz", "rpy")
    )
    return pose(xyz, rpy(*angles))


def _axis(at: xml.At, element: Element, default: tuple[float, float, float]) -> list[float]:
    """Return a joint's axis, of any length, in the joint's own axes."""
    axis = xml.child(element, "axis")
    return at.numbers("axis", None if axis is None else axis.get("xyz"), 3, default)


def _inertial(at: xml.At, element: Element | None) -> Inertial | None:
    if element is None:
        return None
    mass, inertia = xml.child(element, "mass"), xml.child(element, "inertia")
    texts = {key: "0" if inertia is None else inertia.get(key, "0") for key in ROWS}
    for key, text in texts.items():
        at.number(f"inertia {key}", text)
    return Inertial(
        0.0 if mass is None else at.number("mass", mass.get("value")),
        origin(at.inside("inertial"), xml.child(element, "origin")),
        *printed(texts),
    )


def _shapes(at: xml.At, link: Element) -> list[tuple[Array, float]]:
    """Return spheres around the shapes of a link; none where one has no size."""
    shapes = []
    for e in xml.children(link, "visual", "collision"):
        geometry = xml.child(e, "geometry")
        for shape in () if geometry is None else geometry:
            sizes = [
                (key, n)
                for key, n in (("size", 3), ("radius", 1), ("length", 1))
                if shape.get(key) is not None
            ]
            size = [x for key, n in sizes for x in at.numbers(key, shape.get(key), n)]
            radius = sphere_around(shape.tag, size)
            if radius is None:
                return []
            shapes.append((origin(at, xml.child(e, "origin"))[:3, 3], radius))
    return shapes


def _end(robot: Robot, e: Element, tag: str, at: xml.At) -> str:
    element = xml.child(e, tag)
    name = None if element is None else element.get("link")
    if name is None:
        raise DataError(f"{robot.file}: {at.where}: <{tag} link=…> is missing")
    robot.link(name, at.where)
    return name


def _tree(robot: Robot, joints: list[Element]) -> None:
    """Place every link; a link that has a parent already closes a loop."""
    waiting = []
    for e in joints:
        name, at = xml.placed(robot.file, e)
        waiting.append(_Joint(e, name, at, _end(robot, e, "parent", at), _end(robot, e, "child", at)))
    below = {joint.child for joint in waiting}
    roots = [name for name in robot.links if name not in below]
    if not roots:
        raise DataError(f"{robot.file}: every link is the child of a joint: expected one that is fixed")
    robot.ground = roots[0]
    there = set(roots)
    closing = []
    while waiting:
        ready = [joint for joint in waiting if joint.parent in there]
        if not ready:
            raise DataError(f"{robot.file}: {waiting[0].at.where}: its links depend on each other alone")
        waiting = [joint for joint in waiting if joint.parent not in there]
        for joint in ready:
            frame = robot.links[joint.parent].pose @ origin(joint.at, xml.child(joint.element, "origin"))
            if joint.child in there:
                closing.append((joint, frame))
                continue
            there.add(joint.child)
            robot.links[joint.child].pose = frame
            _join(robot, joint, frame)
    for joint, frame in closing:
        _join(robot, joint, frame)


def _join(robot: Robot, joint: _Joint, frame: Array) -> None:
    e, name, at, parent, link = joint
    type_ = e.get("type", "")
    kind = KINDS.get(type_, "other")
    xyz = _axis(at, e, (1.0, 0.0, 0.0))
    direction = np.zeros(3) if kind == "fixed" else frame[:3, :3] @ at.direction("axis", xyz)
    made = RobotJoint(
        name, kind, parent, link, (frame[:3, 3], robot.links[link].pose[:3, 3]), direction, type=type_
    )
    limit, dynamics = xml.child(e, "limit"), xml.child(e, "dynamics")
    made.more = stated(
        [] if limit is None else [limit.get(end) for end in ("lower", "upper")],
        None if dynamics is None else dynamics.get("friction"),
    )
    if dynamics is not None:
        made.damping = at.number("damping", dynamics.get("damping", "0"))
    robot.join(made)


def _loop(robot: Robot, e: Element) -> None:
    """Read a `<loop_joint>`: each of its two links has the joint's place in its own axes."""
    name, at = xml.placed(robot.file, e)
    kind = KINDS.get(e.get("type", "revolute"), "other")
    sides = []
    for tag in ("link1", "link2"):
        side = xml.child(e, tag)
        if side is None:
            raise DataError(f"{robot.file}: {at.where}: <{tag} link=… xyz=…> is missing")
        link = robot.link(xml.named(robot.file, side, "link"), at.where)
        sides.append((link.name, link.pose @ origin(at.inside(tag), side)))
    (a, frame), (b, other) = sides
    direction = frame[:3, :3] @ at.direction("axis", _axis(at, e, (0.0, 0.0, 1.0)))
    robot.join(RobotJoint(name, kind, a, b, (frame[:3, 3], other[:3, 3]), direction))


def _motors(robot: Robot, root: Element) -> None:
    """Set the motors: the joints that a plug-in, a transmission or a command interface drives."""
    speeds: dict[str, float | None] = {}
    for e in xml.children(root, "gazebo"):
        speeds |= sdf.driven(robot.file, e)
    for e in xml.children(root, "transmission"):
        for joint in xml.children(e, "joint"):
            speeds.setdefault(xml.named(robot.file, joint), None)
    for control in xml.children(root, "ros2_control"):
        for joint in xml.children(control, "joint"):
            if xml.child(joint, "command_interface") is not None:
                speeds.setdefault(xml.named(robot.file, joint), None)
    robot.drive(speeds)
