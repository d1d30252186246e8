"""SDF: links with poses of their own, loops closed by joints as any other, gears as gearboxes."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from dalembert.documents import markup as xml
from dalembert.documents.robots import (
    INERTIA_ALONE,
    MASSLESS,
    POINT_MASS,
    ROWS,
    WORLD,
    Array,
    Gearbox,
    Inertial,
    Kind,
    Robot,
    RobotJoint,
    RobotLink,
)
from dalembert.errors import DataError
from rigidbody3d.robots.elements import pose, printed, rotation, rpy, stated

KINDS: dict[str, Kind] = {
    "revolute": "turn",
    "continuous": "turn",
    "prismatic": "slide",
    "fixed": "fixed",
    "ball": "ball",
}
# tag -> the tags in it that are read, or that say nothing of a mechanism
READ = {
    "sdf": "world model light actor",
    "world": "gravity model physics scene light plugin gui wind audio atmosphere magnetic_field spherical_coordinates state",
    "model": "pose static link joint frame plugin model include self_collide allow_auto_disable enable_wind",
    "link": "pose inertial visual collision sensor light gravity self_collide enable_wind must_be_base_link velocity_decay",
    "inertial": "pose mass inertia massless point_mass inertia_alone",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "joint": "parent child pose axis axis2 gearbox_ratio gearbox_reference_body physics sensor",
    "axis": "xyz limit dynamics mimic use_parent_model_frame initial_position",
    "dynamics": "damping friction spring_stiffness spring_reference",
}
MODEL = "__model__"


def read(file: str, root: Element) -> Robot:
    """Read the first `<model>` of an `<sdf>` with joints, in a `<world>` or not: worlds begin with the floor."""
    world = xml.child(root, "world")
    models = list(xml.children(root if world is None else world, "model"))
    if not models:
        raise DataError(f"{file}: <sdf>: no <model>")
    model = next((e for e in models if xml.child(e, "joint") is not None), models[0])
    robot = Robot(file, model.get("name", ""), notes=xml.passed_over(root, READ))
    if len(models) > 1:
        others = ", ".join(e.get("name", "without a name") for e in models if e is not model)
        robot.notes.append(f"models left out: {others}")
    robot.add(RobotLink(WORLD, np.eye(4)))
    if world is not None:
        numbers = xml.At(file, "world").numbers("gravity", xml.text(world, "gravity"), 3, (0.0, 0.0, -9.8))
        robot.gravity = np.array(numbers)
    _Model(robot, model, root.get("version", "1.0")).read()
    return robot


def _named_text(at: xml.At, element: Element, tag: str) -> str:
    result = xml.text(element, tag)
    if not result:
        raise DataError(f"{at.file}: {at.where}: <{tag}> is missing")
    return result


def read_pose(at: xml.At, element: Element | None) -> Array:
    """Return the pose of a `<pose>` element, in the frame to which it is relative."""
    if element is None or not (element.text or "").strip():
        return np.eye(4)
    at = at.inside("pose")
    if element.get("rotation_format") == "quat_xyzw":
        *xyz, x, y, z, w = at.numbers("", element.text, 7)
        return pose(xyz, rotation(at, (w, x, y, z)))
    v = at.numbers("", element.text, 6)
    angles = np.radians(v[3:]) if element.get("degrees") in ("true", "1") else v[3:]
    return pose(v[:3], rpy(*angles))


class _Model:
    """The frames of a model; each is computed on the first request."""

    def __init__(self, robot: Robot, element: Element, version: str) -> None:
        self.robot, self.element, self.file = robot, element, robot.file
        try:
            self.old = tuple(int(v) for v in version.split(".")[:2]) <= (1, 4)
        except ValueError:
            self.old = False
        self.at: dict[str, Array] = {WORLD: np.eye(4)}
        self.frames = {
            xml.named(self.file, e): e
            for e in xml.children(element, "link", "joint", "frame")
            if e.get("name")
        }

    def read(self) -> None:
        robot, file = self.robot, self.file
        own = xml.child(self.element, "pose")
        self.at[MODEL] = read_pose(xml.At(file, "model"), own)
        base = "" if own is None else own.get("relative_to", "")
        placed = {
            "relative_to": base * (base != WORLD),
            "placement_frame": self.element.get("placement_frame", ""),
        }
        for key, of in placed.items():
            if of:
                robot.notes.append(
                    f"model: {key}='{of}' is left out: the model stands elsewhere in the world"
                )
        for e in xml.children(self.element, "model", "include"):
            robot.notes.append(
                f"<{e.tag}> in the model: left out: nested models and included files are not read"
            )
        bases = {frame for e in self.element.iter("pose") if (frame := e.get("frame"))}
        if bases:
            robot.notes.append(
                f"pose: its attribute frame ({', '.join(sorted(bases))}) is left out: SDF 1.7 and later have relative_to"
            )
        static = xml.text(self.element, "static") in ("true", "1")
        if static:
            robot.notes.append(f"model '{robot.name}' is static: nothing in it moves")
        for e in xml.children(self.element, "link"):
            name, at = xml.placed(file, e)
            inertial = xml.child(e, "inertial")
            if inertial is not None and inertial.get("auto") in ("true", "1"):
                robot.notes.append(f"{at.where}: the mass and inertia of its shapes are not imported (auto)")
                inertial = None
            robot.add(RobotLink(name, self.frame(name, at), _inertial(at, inertial)))
            if xml.text(e, "gravity") in ("false", "0"):
                robot.notes.append(f"{at.where}: its <gravity> is left out: its whole weight acts")
        for e in xml.children(self.element, "frame"):
            name, at = xml.placed(file, e)
            held = self.holder(name, at)
            if held in robot.links:
                inside = np.linalg.inv(robot.links[held].pose) @ self.frame(name, at)
                robot.links[held].points[name] = inside[:3, 3]
        for e in () if static else xml.children(self.element, "joint"):
            read_joint(robot, e, self)
        if not any(WORLD in (j.parent, j.child) for j in robot.joints.values()):
            robot.ground = next((name for name in robot.links if name != WORLD), WORLD)
        self._motors()

    def frame(self, name: str, at: xml.At) -> Array:
        """Return the pose of a frame in the world."""
        # the frame, that to which it is relative, and so on to one that is known
        chain: dict[str, Element | None] = {}
        while name not in self.at:
            if name not in self.frames:
                raise DataError(f"{self.file}: {at.where}: no frame is called '{name}'")
            if name in chain:
                raise DataError(f"{self.file}: {at.where}: the pose of '{name}' is relative to itself")
            e = self.frames[name]
            own = chain[name] = xml.child(e, "pose")
            base = "" if own is None else own.get("relative_to", "")
            if not base and e.tag == "joint":
                base = _named_text(xml.At(self.file, f"joint '{name}'"), e, "child")
            name = base or (e.get("attached_to") if e.tag == "frame" else None) or MODEL
        for inner, own in reversed(chain.items()):
            self.at[inner] = self.at[name] @ read_pose(at, own)
            name = inner
        return self.at[name]

    def holder(self, name: str, at: xml.At) -> str:
        """Return the link that holds a frame: a frame that is attached to none is the model's, and so its first link's."""
        passed: set[str] = set()
        while name in self.frames and self.frames[name].tag != "link":
            if name in passed:
                raise DataError(f"{self.file}: {at.where}: the frame '{name}' is attached to itself")
            passed.add(name)
            e = self.frames[name]
            name = (xml.text(e, "child") if e.tag == "joint" else e.get("attached_to")) or MODEL
        first = self.element.get("canonical_link") or next(
            iter(n for n in self.robot.links if n != WORLD), ""
        )
        return first if name == MODEL else name

    def _motors(self) -> None:
        """Set the motors: the joints that plug-ins drive; without plug-ins those with an effort limit, where others have the limit 0."""
        robot, file = self.robot, self.file
        speeds = driven(file, self.element)
        if not speeds:
            efforts = {}
            for e in xml.children(self.element, "joint"):
                effort = xml.text(e, "axis", "limit", "effort")
                efforts[xml.named(file, e)] = (
                    None if effort is None else xml.At(file, "effort").number("", effort)
                )
            if 0.0 in efforts.values():
                speeds = dict.fromkeys(
                    n for n, effort in efforts.items() if effort != 0 and n in robot.joints
                )
        robot.drive(speeds)


def _inertial(at: xml.At, element: Element | None) -> Inertial | None:
    """Read an `<inertial>`; without one the format means 1 kg, which no author wrote."""
    if element is None:
        return None
    texts = {key: xml.text(element, "inertia", key) or str(int(key[1] == key[2])) for key in ROWS}
    for key, word in texts.items():
        at.number(key, word)
    mass = "0" if xml.child(element, INERTIA_ALONE) is not None else xml.text(element, "mass")
    # what `dalembert export` writes beside numbers that the format asks for
    if xml.child(element, MASSLESS) is not None:
        return None
    tensor, half = printed(texts)
    if xml.child(element, POINT_MASS) is not None:
        tensor = np.zeros((3, 3))
    return Inertial(
        1.0 if mass is None else at.number("mass", mass),
        read_pose(at.inside("inertial"), xml.child(element, "pose")),
        tensor,
        half,
    )


def read_joint(robot: Robot, e: Element, model: _Model | None = None) -> None:
    """Add a `<joint>`, of a model or of a `<gazebo>` block of URDF, where its pose is relative to its child."""
    name, at = xml.placed(robot.file, e)

    def resolved(link: str) -> str:
        if model is not None:
            link = model.holder(link, at)
        elif link == WORLD:
            link = robot.ground
        return robot.link(link, at.where).name

    parent, below = (resolved(_named_text(at, e, tag)) for tag in ("parent", "child"))
    if model is not None:
        frame = model.frame(name, at)
    else:
        frame = robot.links[below].pose @ read_pose(at, xml.child(e, "pose"))
    axis = xml.child(e, "axis")
    type_ = e.get("type", "")
    if type_ == "gearbox":
        reference = resolved(xml.text(e, "gearbox_reference_body") or xml.text(e, "reference_body") or WORLD)
        ratio = at.number("gearbox_ratio", xml.text(e, "gearbox_ratio") or "1")
        sense = float(np.sign(_axis(at, axis, frame, None) @ _axis(at, xml.child(e, "axis2"), frame, None)))
        robot.gears.append(Gearbox((parent, below), -ratio * (sense or 1.0), reference))
        return
    kind = KINDS.get(type_, "other")
    direction = np.zeros(3) if kind in ("fixed", "ball") else _axis(at, axis, frame, model)
    made = RobotJoint(name, kind, parent, below, (frame[:3, 3], frame[:3, 3]), direction, type=type_)
    robot.join(made)
    made.more = stated(
        [xml.text(axis, "limit", end) for end in ("lower", "upper")], xml.text(axis, "dynamics", "friction")
    )
    if at.number("initial_position", xml.text(axis, "initial_position") or "0"):
        robot.notes.append(f"{at.where}: its initial_position is left out: the pose is that of coordinate 0")
    made.damping, made.stiffness, made.rest = (
        at.number(tag, xml.text(axis, "dynamics", tag) or "0")
        for tag in ("damping", "spring_stiffness", "spring_reference")
    )
    mimic = xml.child(axis, "mimic")
    if mimic is not None:
        words = {inner.tag: inner.text or "" for inner in mimic}
        robot.mimic(name, xml.named(robot.file, mimic, "joint"), words)


def _axis(at: xml.At, axis: Element | None, frame: Array, model: _Model | None) -> Array:
    """Return the direction of an axis in the world."""
    element = xml.child(axis, "xyz")
    xyz = at.numbers("axis", xml.text(element), 3, (0.0, 0.0, 1.0))
    turned = frame
    if element is not None and model is not None:
        base = element.get("expressed_in", "")
        if base:
            turned = model.frame(base, at)
        elif model.old or xml.text(axis, "use_parent_model_frame") in ("true", "1"):
            turned = model.at[MODEL]
    return np.asarray(turned[:3, :3] @ at.direction("axis", xyz))


def driven(file: str, element: Element) -> dict[str, float | None]:
    """Return the joints that plug-ins drive, with the speed that they begin with."""
    result: dict[str, float | None] = {}
    for plugin in xml.children(element, "plugin"):
        for name in xml.children(plugin, "joint_name", "jointName"):
            if which := xml.text(name):
                speed = xml.text(plugin, "initial_velocity")
                at = xml.At(file, "plugin")
                result[which] = None if speed is None else at.number("initial_velocity", speed)
    return result
