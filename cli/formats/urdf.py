"""URDF, read and written: a tree of links. Loops stand in `<gazebo>` blocks, as `<loop_joint>`, or as a second joint to one child."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from cli.formats import markup as xml
from cli.formats import sdf
from cli.formats.robot import (
    GROUND,
    ROWS,
    Array,
    Inertial,
    Kind,
    Robot,
    RobotJoint,
    RobotLink,
    pose,
    printed,
    rpy,
    sphere_around,
)
from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.formats.skeleton import Branching, Skeleton
    from virtualwork.describe.parts import Belt, Gear

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

# a limit that is none
LARGE = 1e9


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
    made.more = xml.stated(
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


# --- writing ------------------------------------------------------------------------------------------------------
def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    root = Element("robot", name=s.m.name or "mechanism")
    # where each link's axes begin: at the joint on which it hangs, in its own axes of the mechanism's file
    origin = {GROUND: 0j}
    for b in s.walk():
        origin[b.child] = b.joint.ends[1] if b.child == b.joint.link else b.joint.ends[0]
    for name in s.bodies:
        _add_link(s, root, name, origin[name])
    for b in s.walk():
        _add_joint(s, root, b, origin)
    for name in s.bodies:
        _add_frames(s, root, name, origin[name])
    gazebo = Element("gazebo")
    for j in s.closing:
        ends = (j.ends[0] - origin[j.on], j.ends[1] - origin[j.link])
        sdf.add_joint(gazebo, s, replace(j, ends=ends), GROUND)
    sdf.add_welds(gazebo, s)
    racks = _add_gears(s, root, gazebo)
    sdf.add_plugins(gazebo, s)
    if len(gazebo):
        root.append(gazebo)
    lost = f"racks are left out: {racks}: <mimic> ties one joint to one other" if racks else ""
    return xml.document(root, comment), s.left_out(("massless",), lost)


def _add_link(s: Skeleton, root: Element, name: str, origin: complex) -> None:
    part, link = s.bodies[name], xml.add(root, "link", name=name)
    if part.mass > 0 or part.inertia > 0:
        inertial = xml.add(link, "inertial")
        xml.add(inertial, "origin", xyz=xml.spatial(part.center - origin), rpy="0 0 0")
        xml.add(inertial, "mass", value=part.mass)
        # in the plane only izz acts
        xml.add(inertial, "inertia", None, **{n: part.inertia if n[1] == n[2] else 0.0 for n in ROWS})
    for middle, turn, sides in s.boxes(name):
        visual = xml.add(link, "visual")
        xml.add(visual, "origin", xyz=xml.spatial(middle - origin), rpy=xml.digits(0.0, 0.0, turn))
        xml.add(xml.add(visual, "geometry"), "box", size=xml.digits(*sides))


def _add_joint(s: Skeleton, root: Element, b: Branching, origin: dict[str, complex]) -> None:
    j, parent, part = b.joint, s.bodies[b.parent], s.bodies[b.child]
    kind = "prismatic" if j.kind == "slide" else "continuous" if j.limits is None else "revolute"
    made = xml.add(root, "joint", name=j.name, type=kind)
    at = parent.inside(part.world(origin[b.child])) - origin[b.parent]
    xml.add(made, "origin", xyz=xml.spatial(at), rpy=xml.digits(0.0, 0.0, part.turn - parent.turn))
    xml.add(made, "parent", link=b.parent)
    xml.add(made, "child", link=b.child)
    xml.add(made, "axis", xyz=xml.digits(*j.axis(part, b.sense)))
    if kind != "continuous" or j.input is not None:
        limit = xml.add(made, "limit")
        low, high = (
            j.limits
            or (j.guide is not None and s.travel.way(j.guide))
            or (j.value - s.m.size, j.value + s.m.size)
        )
        if kind != "continuous":
            limit.attrib |= {"lower": xml.digits(low - j.value), "upper": xml.digits(high - j.value)}
        peak = 0.0 if j.input is None else s.travel.peak
        # the format wants both numbers; where nothing limits them they are large
        limit.set("effort", xml.digits(LARGE if peak is None else peak))
        limit.set("velocity", xml.digits(LARGE))


def _add_frames(s: Skeleton, root: Element, name: str, origin: complex) -> None:
    """Add named points that no joint holds as links without mass, fixed there."""
    for frame, z in s.free_points(name).items():
        xml.add(root, "link", name=frame)
        made = xml.add(root, "joint", name=f"{frame} fixed", type="fixed")
        xml.add(made, "origin", xyz=xml.spatial(z - origin), rpy="0 0 0")
        xml.add(made, "parent", link=name)
        xml.add(made, "child", link=frame)


def _add_gears(s: Skeleton, root: Element, gazebo: Element) -> int:
    """Write gears, belts and racks of two joints of the tree as `<mimic>`, other gears as gearboxes of the simulator.

    Returns the number of racks that are neither.
    """
    from virtualwork.describe.parts import Rack

    gearboxes: list[Gear | Belt] = []
    racks = 0
    parts: tuple[Gear | Belt | Rack, ...] = (*s.m.gears, *s.m.belts, *s.m.racks)
    for g, mesh in zip(parts, s.m.meshes, strict=True):
        terms = s.mesh(mesh)
        driven = {j.name for j in s.joints if j.input is not None}
        last = [name for name in terms if name not in driven]
        joint = next((e for e in root.iter("joint") if last and e.get("name") == last[-1]), None)
        if len(terms) == 2 and joint is not None and joint.find("mimic") is None:
            (other,) = (name for name in terms if name != last[-1])
            # of coordinates that may run against the pins' own sense
            factor = -terms[other] / terms[last[-1]]
            xml.add(joint, "mimic", joint=other, multiplier=factor)
        elif isinstance(g, Rack):
            racks += 1
        else:
            gearboxes.append(g)
    sdf.add_gearboxes(gazebo, gearboxes, GROUND)
    return racks
