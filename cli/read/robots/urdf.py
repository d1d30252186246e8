"""URDF: a tree of links; loops stand in `<gazebo>` blocks, as `<loop_joint>`, or as a second joint to the same child."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from cli.errors import DataError
from cli.read.robots import sdf
from cli.read.robots.elements import child, children, named, number, numbers, plain, stated, words
from cli.read.robots.robot import (
    Array,
    Inertial,
    Kind,
    Motor,
    Robot,
    RobotJoint,
    RobotLink,
    half_unit,
    pose,
    rpy,
    sphere_around,
    symmetric,
    unit,
)

KINDS: dict[str, Kind] = {**sdf.KINDS, "spherical": "ball"}


def read(file: str, root: Element) -> Robot:
    """Read a `<robot>`."""
    robot = Robot(file, "URDF", root.get("name", ""))
    joints = list(children(root, "joint"))
    for e in children(root, "link"):
        name = named(file, e)
        where = f"link '{name}'"
        held = _inertial(file, where, child(e, "inertial"))
        robot.add(RobotLink(name, np.eye(4), held, shapes=_shapes(file, where, e)))
    if not robot.links:
        raise DataError(f"{file}: <robot>: no link")
    _tree(robot, joints)
    for e in children(root, "loop_joint"):
        _loop(robot, e)
    for e in children(root, "gazebo"):
        for inner in children(e, "joint"):
            sdf.joint(robot, inner)
    for e in joints:
        mimic = child(e, "mimic")
        if mimic is not None:
            _mimic(robot, named(file, e), mimic)
    _motors(robot, root)
    return robot


def origin(file: str, where: str, element: Element | None) -> Array:
    """Return the pose that an `<origin>` gives."""
    if element is None:
        return np.eye(4)
    xyz = numbers(file, f"{where}, origin xyz", element.get("xyz"), 3, (0.0, 0.0, 0.0))
    angles = numbers(file, f"{where}, origin rpy", element.get("rpy"), 3, (0.0, 0.0, 0.0))
    return pose(xyz, rpy(*angles))


def _inertial(file: str, where: str, element: Element | None) -> Inertial | None:
    if element is None:
        return None
    mass, inertia = child(element, "mass"), child(element, "inertia")
    texts = {key: "0" if inertia is None else inertia.get(key, "0") for key in sdf.ENTRIES}
    entries = {key: number(file, f"{where}, inertia {key}", text) for key, text in texts.items()}
    return Inertial(
        0.0 if mass is None else number(file, f"{where}, mass", mass.get("value")),
        origin(file, f"{where}, inertial", child(element, "origin")),
        symmetric(entries),
        symmetric({key: half_unit(text) for key, text in texts.items()}),
    )


def _shapes(file: str, where: str, link: Element) -> list[tuple[Array, float]]:
    """Return spheres around the shapes of a link; none where the size of one is not said."""
    found = []
    for e in children(link, "visual", "collision"):
        geometry = child(e, "geometry")
        for shape in () if geometry is None else geometry:
            keys = [key for key in ("size", "radius", "length") if shape.get(key) is not None]
            size = [float(w) for key in keys for w in words(file, f"{where}, {key}", shape.get(key))]
            radius = sphere_around(plain(shape), size)
            if radius is None:
                return []
            found.append((origin(file, where, child(e, "origin"))[:3, 3], radius))
    return found


def _end(robot: Robot, e: Element, tag: str, where: str) -> str:
    found = child(e, tag)
    name = None if found is None else found.get("link")
    if name is None:
        raise DataError(f"{robot.file}: {where}: <{tag} link=…> is missing")
    robot.link(name, where)
    return name


def _tree(robot: Robot, joints: list[Element]) -> None:
    """Place every link; a link that has a parent already closes a loop."""
    file = robot.file
    rows = []
    for e in joints:
        where = f"joint '{named(file, e)}'"
        kind = KINDS.get(e.get("type", ""), "other")
        rows.append((e, where, kind, _end(robot, e, "parent", where), _end(robot, e, "child", where)))
    below = {row[4] for row in rows}
    roots = [name for name in robot.links if name not in below]
    if not roots:
        raise DataError(f"{file}: every link is the child of a joint: expected one that stands still")
    robot.ground = roots[0]
    placed, waiting = set(roots), rows
    closing = []
    while waiting:
        ready = [row for row in waiting if row[3] in placed]
        if not ready:
            raise DataError(f"{file}: {waiting[0][1]}: its links hang on one another alone")
        waiting = [row for row in waiting if row[3] not in placed]
        for row in ready:
            e, where, kind, parent, link = row
            frame = robot.links[parent].pose @ origin(file, where, child(e, "origin"))
            if link in placed:
                closing.append((row, frame))
                continue
            placed.add(link)
            robot.links[link].pose = frame
            _joint(robot, row, frame)
    for row, frame in closing:
        _joint(robot, row, frame)


def _joint(robot: Robot, row: tuple[Element, str, Kind, str, str], frame: Array) -> None:
    e, where, kind, parent, link = row
    axis = child(e, "axis")
    xyz = numbers(robot.file, f"{where}, axis", None if axis is None else axis.get("xyz"), 3, (1.0, 0.0, 0.0))
    direction = frame[:3, :3] @ unit(robot.file, f"{where}, axis", xyz) if kind != "fixed" else np.zeros(3)
    ends = (frame[:3, 3], robot.links[link].pose[:3, 3])
    made = RobotJoint(named(robot.file, e), kind, parent, link, ends, direction, type=e.get("type", ""))
    limit, dynamics = child(e, "limit"), child(e, "dynamics")
    made.more = stated(
        [] if limit is None else [limit.get(end) for end in ("lower", "upper")],
        None if dynamics is None else dynamics.get("friction"),
    )
    if dynamics is not None:
        made.damping = number(robot.file, f"{where}, damping", dynamics.get("damping", "0"))
    robot.join(made)


def _loop(robot: Robot, e: Element) -> None:
    """`<loop_joint>`: each of its two links has the joint's place in its own axes."""
    file, name = robot.file, named(robot.file, e)
    where = f"loop_joint '{name}'"
    kind = KINDS.get(e.get("type", "revolute"), "other")
    sides = []
    for tag in ("link1", "link2"):
        side = child(e, tag)
        if side is None:
            raise DataError(f"{file}: {where}: <{tag} link=… xyz=…> is missing")
        link = robot.link(named(file, side, "link"), where)
        sides.append((link.name, link.pose @ origin(file, f"{where}, {tag}", side)))
    axis = child(e, "axis")
    xyz = numbers(file, f"{where}, axis", None if axis is None else axis.get("xyz"), 3, (0.0, 0.0, 1.0))
    (a, at), (b, other) = sides
    direction = at[:3, :3] @ unit(file, f"{where}, axis", xyz)
    robot.join(RobotJoint(name, kind, a, b, (at[:3, 3], other[:3, 3]), direction))


def _mimic(robot: Robot, name: str, mimic: Element) -> None:
    where = f"joint '{name}', mimic"
    other = named(robot.file, mimic, "joint")
    if other not in robot.joints:
        raise DataError(f"{robot.file}: {where}: no joint is called '{other}'")
    factor = number(robot.file, f"{where} multiplier", mimic.get("multiplier", "1"))
    robot.couplings.append((name, [(name, 1.0), (other, -factor)]))
    offset = number(robot.file, f"{where} offset", mimic.get("offset", "0"))
    if offset:
        robot.notes.append(f"{where}: its offset {offset:g} is left out: the drawn pose is that of the file")


def _motors(robot: Robot, root: Element) -> None:
    """The joints that a plug-in, a transmission or a command interface drives."""
    speeds: dict[str, float | None] = {}
    for e in children(root, "gazebo"):
        speeds |= sdf.driven(robot.file, e)
    for e in children(root, "transmission"):
        for joint in children(e, "joint"):
            speeds.setdefault(named(robot.file, joint), None)
    for control in children(root, "ros2_control"):
        for joint in children(control, "joint"):
            if child(joint, "command_interface") is not None:
                speeds.setdefault(named(robot.file, joint), None)
    robot.motors = [Motor(name, [(name, 1.0)], speed) for name, speed in speeds.items()]
