"""SDF: links with poses of their own, so that loops are joints as any; poses may be relative to other frames."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from cli.errors import DataError
from cli.read.robots.elements import child, children, named, number, numbers, plain, stated, text
from cli.read.robots.robot import (
    WORLD,
    Array,
    Inertial,
    Kind,
    Motor,
    Robot,
    RobotJoint,
    RobotLink,
    half_unit,
    pose,
    quaternion,
    rpy,
    symmetric,
    unit,
)

KINDS: dict[str, Kind] = {
    "revolute": "turn",
    "continuous": "turn",
    "prismatic": "slide",
    "fixed": "fixed",
    "ball": "ball",
}
ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
MODEL = "__model__"


def read(file: str, root: Element) -> Robot:
    """Read the first `<model>` of an `<sdf>`, in a `<world>` or not."""
    world = child(root, "world")
    models = list(children(root if world is None else world, "model"))
    if not models:
        raise DataError(f"{file}: <sdf>: no <model>")
    robot = Robot(file, "SDF", models[0].get("name", ""))
    if len(models) > 1:
        robot.notes.append(f"models after the first are left out: {len(models) - 1}")
    robot.add(RobotLink(WORLD, np.eye(4)))
    if world is not None:
        given = text(world, "gravity")
        robot.gravity = np.array(numbers(file, "world, gravity", given, 3, (0.0, 0.0, -9.8)))
    _Model(robot, models[0], root.get("version", "1.0")).read()
    return robot


def _named_text(file: str, element: Element, tag: str, where: str) -> str:
    found = text(element, tag)
    if not found:
        raise DataError(f"{file}: {where}: <{tag}> is missing")
    return found


def read_pose(file: str, where: str, element: Element | None) -> Array:
    """Return what a `<pose>` says, whatever it is relative to."""
    if element is None or not (element.text or "").strip():
        return np.eye(4)
    where = f"{where}, pose"
    if element.get("rotation_format") == "quat_xyzw":
        x = numbers(file, where, element.text, 7)
        try:
            return pose(x[:3], quaternion(x[6], *x[3:6]))
        except ValueError as error:
            raise DataError(f"{file}: {where}: {error}") from None
    v = numbers(file, where, element.text, 6)
    angles = np.radians(v[3:]) if element.get("degrees") in ("true", "1") else v[3:]
    return pose(v[:3], rpy(*angles))


class _Model:
    """The frames of a model, each worked out when it is first asked for."""

    def __init__(self, robot: Robot, element: Element, version: str) -> None:
        self.robot, self.element, self.file = robot, element, robot.file
        try:
            self.old = tuple(int(v) for v in version.split(".")[:2]) <= (1, 4)
        except ValueError:
            self.old = False
        self.at: dict[str, Array] = {WORLD: np.eye(4)}
        self.asked: set[str] = set()
        self.frames = {
            named(self.file, e): e for e in children(element, "link", "joint", "frame") if e.get("name")
        }

    def read(self) -> None:
        robot, file = self.robot, self.file
        self.at[MODEL] = read_pose(file, "model", child(self.element, "pose"))
        for e in children(self.element, "model", "include"):
            robot.notes.append(f"<{plain(e)}> in the model: left out: files and models inside are not read")
        static = False
        if text(self.element, "static") in ("true", "1"):
            robot.notes.append(f"model '{robot.name}' is static: nothing in it moves")
            static = True
        for e in children(self.element, "link"):
            name = named(file, e)
            where = f"link '{name}'"
            robot.add(RobotLink(name, self.frame(name, where), _inertial(file, where, child(e, "inertial"))))
        for e in children(self.element, "frame"):
            held = e.get("attached_to", "")
            name = named(file, e)
            if held in robot.links:
                inside = np.linalg.inv(robot.links[held].pose) @ self.frame(name, f"frame '{name}'")
                robot.links[held].points[name] = inside[:3, 3]
        for e in () if static else children(self.element, "joint"):
            joint(robot, e, self)
        if not any(WORLD in (j.parent, j.child) for j in robot.joints.values()):
            robot.ground = next((name for name in robot.links if name != WORLD), WORLD)
        self._motors()

    def frame(self, name: str, where: str) -> Array:
        """Return the pose of a frame in the world."""
        if name in self.at:
            return self.at[name]
        if name not in self.frames:
            raise DataError(f"{self.file}: {where}: no frame is called '{name}'")
        if name in self.asked:
            raise DataError(f"{self.file}: {where}: the pose of '{name}' is relative to itself")
        self.asked.add(name)
        e = self.frames[name]
        given = child(e, "pose")
        base = "" if given is None else given.get("relative_to", "")
        if not base:
            base = MODEL
            if plain(e) == "joint":
                base = _named_text(self.file, e, "child", f"joint '{name}'")
            elif plain(e) == "frame":
                base = e.get("attached_to") or MODEL
        self.at[name] = self.frame(base, where) @ read_pose(self.file, where, given)
        return self.at[name]

    def _motors(self) -> None:
        """The joints that plug-ins drive; else those whose greatest effort is not zero where others' is."""
        robot, file = self.robot, self.file
        speeds = driven(file, self.element)
        if not speeds:
            efforts = {}
            for e in children(self.element, "joint"):
                effort = text(e, "axis", "limit", "effort")
                efforts[named(file, e)] = None if effort is None else number(file, "effort", effort)
            if 0.0 in efforts.values():
                speeds = dict.fromkeys(
                    n for n, effort in efforts.items() if effort != 0 and n in robot.joints
                )
        robot.motors = [Motor(name, [(name, 1.0)], speed) for name, speed in speeds.items()]


def _inertial(file: str, where: str, element: Element | None) -> Inertial | None:
    """Read an `<inertial>`; without one the format means 1 kg, which nobody has said."""
    if element is None:
        return None
    own = dict.fromkeys(ENTRIES, "0") | dict.fromkeys(("ixx", "iyy", "izz"), "1")
    texts = {key: text(element, "inertia", key) or own[key] for key in ENTRIES}
    entries = {key: number(file, f"{where}, {key}", word) for key, word in texts.items()}
    mass = text(element, "mass")
    # what `dalembert export` writes beside numbers that the format asks for
    if child(element, "massless") is not None:
        return None
    if child(element, "point_mass") is not None:
        entries = dict.fromkeys(ENTRIES, 0.0)
    return Inertial(
        1.0 if mass is None else number(file, f"{where}, mass", mass),
        read_pose(file, f"{where}, inertial", child(element, "pose")),
        symmetric(entries),
        symmetric({key: half_unit(word) for key, word in texts.items()}),
    )


def joint(robot: Robot, e: Element, model: _Model | None = None) -> None:
    """Add a `<joint>`, of a model or of a `<gazebo>` block of URDF, where its pose is relative to its child."""
    file, name = robot.file, named(robot.file, e)
    where = f"joint '{name}'"
    parent, below = (_named_text(file, e, tag, where) for tag in ("parent", "child"))
    if parent == WORLD and model is None:
        parent = robot.ground
    robot.link(parent, where)
    robot.link(below, where)
    given = child(e, "pose")
    if model is not None:
        frame = model.frame(name, where)
    else:
        frame = robot.links[below].pose @ read_pose(file, where, given)
    axis = child(e, "axis")
    type_ = e.get("type", "")
    if type_ == "gearbox":
        reference = text(e, "gearbox_reference_body") or text(e, "reference_body") or WORLD
        if reference == WORLD and model is None:
            reference = robot.ground
        robot.link(reference, where)
        ratio = number(file, f"{where}, gearbox_ratio", text(e, "gearbox_ratio") or "1")
        sense = float(
            np.sign(
                _axis(file, where, axis, frame, None) @ _axis(file, where, child(e, "axis2"), frame, None)
            )
        )
        robot.gears.append((parent, below, -ratio * (sense or 1.0), reference))
        return
    kind = KINDS.get(type_, "other")
    direction = np.zeros(3) if kind in ("fixed", "ball") else _axis(file, where, axis, frame, model)
    at = frame[:3, 3]
    robot.join(RobotJoint(name, kind, parent, below, (at, at), direction, type=type_))
    made = robot.joints[name]
    made.more = stated(
        [text(axis, "limit", end) for end in ("lower", "upper")], text(axis, "dynamics", "friction")
    )
    tags = ("damping", "spring_stiffness", "spring_reference")
    made.damping, made.stiffness, made.rest = (
        number(file, f"{where}, {tag}", text(axis, "dynamics", tag) or "0") for tag in tags
    )
    mimic = child(axis, "mimic")
    if mimic is not None:
        factor = number(file, f"{where}, mimic multiplier", text(mimic, "multiplier") or "1")
        robot.couplings.append((name, [(name, 1.0), (named(file, mimic, "joint"), -factor)]))


def _axis(file: str, where: str, axis: Element | None, frame: Array, model: _Model | None) -> Array:
    """Return the direction of an axis in the world."""
    element = child(axis, "xyz")
    xyz = numbers(file, f"{where}, axis", text(element), 3, (0.0, 0.0, 1.0))
    turned = frame
    if element is not None and model is not None:
        base = element.get("expressed_in", "")
        if base:
            turned = model.frame(base, where)
        elif model.old or text(axis, "use_parent_model_frame") in ("true", "1"):
            turned = model.at[MODEL]
    return np.asarray(turned[:3, :3] @ unit(file, f"{where}, axis", xyz))


def driven(file: str, element: Element) -> dict[str, float | None]:
    """Return the joints that plug-ins drive, with the speed that they begin with."""
    found: dict[str, float | None] = {}
    for plugin in children(element, "plugin"):
        for name in children(plugin, "joint_name", "jointName"):
            if which := text(name):
                speed = text(plugin, "initial_velocity")
                found[which] = None if speed is None else number(file, "plugin, initial_velocity", speed)
    return found
