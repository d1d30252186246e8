"""SDF, read and written: links with poses of their own, loops closed by joints as any other, gears as gearboxes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from cli.formats.drawn import GROUND
from cli.formats.markup import At, add, child, children, digits, document, named, placed, plain, stated, text
from cli.formats.robot import (
    LIGHT,
    ROWS,
    WORLD,
    Array,
    Inertial,
    Kind,
    Motor,
    Robot,
    RobotJoint,
    RobotLink,
    pose,
    printed,
    rotation,
    rpy,
)
from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.formats.skeleton import Joint, Skeleton
    from virtualwork.describe.meshes import Belt, Gear

KINDS: dict[str, Kind] = {
    "revolute": "turn",
    "continuous": "turn",
    "prismatic": "slide",
    "fixed": "fixed",
    "ball": "ball",
}
MODEL = "__model__"
# name space of the marks on numbers that the format asks for and the mechanism does not have
SPACE = "https://dalembert.invalid/sdf"
MASSLESS, POINT_MASS, INERTIA_ALONE = "massless", "point_mass", "inertia_alone"
PLUGIN = {"filename": "gz-sim-joint-controller-system", "name": "gz::sim::systems::JointController"}


def read(file: str, root: Element) -> Robot:
    """Read the first `<model>` of an `<sdf>` with joints, in a `<world>` or not: worlds begin with the floor."""
    world = child(root, "world")
    models = list(children(root if world is None else world, "model"))
    if not models:
        raise DataError(f"{file}: <sdf>: no <model>")
    model = next((e for e in models if child(e, "joint") is not None), models[0])
    robot = Robot(file, "SDF", model.get("name", ""))
    if len(models) > 1:
        others = ", ".join(e.get("name", "without a name") for e in models if e is not model)
        robot.notes.append(f"models left out: {others}")
    robot.add(RobotLink(WORLD, np.eye(4)))
    if world is not None:
        numbers = At(file, "world").numbers("gravity", text(world, "gravity"), 3, (0.0, 0.0, -9.8))
        robot.gravity = np.array(numbers)
    _Model(robot, model, root.get("version", "1.0")).read()
    return robot


def _named_text(at: At, element: Element, tag: str) -> str:
    result = text(element, tag)
    if not result:
        raise DataError(f"{at.file}: {at.where}: <{tag}> is missing")
    return result


def read_pose(at: At, element: Element | None) -> Array:
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
        self.entered: set[str] = set()
        self.frames = {
            named(self.file, e): e for e in children(element, "link", "joint", "frame") if e.get("name")
        }

    def read(self) -> None:
        robot, file = self.robot, self.file
        self.at[MODEL] = read_pose(At(file, "model"), child(self.element, "pose"))
        for e in children(self.element, "model", "include"):
            robot.notes.append(
                f"<{plain(e)}> in the model: left out: nested models and included files are not read"
            )
        static = text(self.element, "static") in ("true", "1")
        if static:
            robot.notes.append(f"model '{robot.name}' is static: nothing in it moves")
        for e in children(self.element, "link"):
            name, at = placed(file, e)
            robot.add(RobotLink(name, self.frame(name, at), _inertial(at, child(e, "inertial"))))
        for e in children(self.element, "frame"):
            name, at = placed(file, e)
            held = self.holder(name, at)
            if held in robot.links:
                inside = np.linalg.inv(robot.links[held].pose) @ self.frame(name, at)
                robot.links[held].points[name] = inside[:3, 3]
        for e in () if static else children(self.element, "joint"):
            read_joint(robot, e, self)
        if not any(WORLD in (j.parent, j.child) for j in robot.joints.values()):
            robot.ground = next((name for name in robot.links if name != WORLD), WORLD)
        self._motors()

    def frame(self, name: str, at: At) -> Array:
        """Return the pose of a frame in the world."""
        if name in self.at:
            return self.at[name]
        if name not in self.frames:
            raise DataError(f"{self.file}: {at.where}: no frame is called '{name}'")
        if name in self.entered:
            raise DataError(f"{self.file}: {at.where}: the pose of '{name}' is relative to itself")
        self.entered.add(name)
        e = self.frames[name]
        pose = child(e, "pose")
        base = "" if pose is None else pose.get("relative_to", "")
        if not base:
            base = MODEL
            if plain(e) == "joint":
                base = _named_text(At(self.file, f"joint '{name}'"), e, "child")
            elif plain(e) == "frame":
                base = e.get("attached_to") or MODEL
        self.at[name] = self.frame(base, at) @ read_pose(at, pose)
        return self.at[name]

    def holder(self, name: str, at: At) -> str:
        """Return the link that holds a frame: a frame that is attached to none is the model's, and so its first link's."""
        passed: set[str] = set()
        while name in self.frames and plain(self.frames[name]) != "link":
            if name in passed:
                raise DataError(f"{self.file}: {at.where}: the frame '{name}' is attached to itself")
            passed.add(name)
            e = self.frames[name]
            name = (text(e, "child") if plain(e) == "joint" else e.get("attached_to")) or MODEL
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
            for e in children(self.element, "joint"):
                effort = text(e, "axis", "limit", "effort")
                efforts[named(file, e)] = None if effort is None else At(file, "effort").number("", effort)
            if 0.0 in efforts.values():
                speeds = dict.fromkeys(
                    n for n, effort in efforts.items() if effort != 0 and n in robot.joints
                )
        robot.motors = [Motor(name, [(name, 1.0)], speed) for name, speed in speeds.items()]


def _inertial(at: At, element: Element | None) -> Inertial | None:
    """Read an `<inertial>`; without one the format means 1 kg, which no author wrote."""
    if element is None:
        return None
    texts = {key: text(element, "inertia", key) or str(int(key[1] == key[2])) for key in ROWS}
    for key, word in texts.items():
        at.number(key, word)
    mass = "0" if child(element, INERTIA_ALONE) is not None else text(element, "mass")
    # what `dalembert export` writes beside numbers that the format asks for
    if child(element, MASSLESS) is not None:
        return None
    tensor, half = printed(texts)
    if child(element, POINT_MASS) is not None:
        tensor = np.zeros((3, 3))
    return Inertial(
        1.0 if mass is None else at.number("mass", mass),
        read_pose(at.inside("inertial"), child(element, "pose")),
        tensor,
        half,
    )


def read_joint(robot: Robot, e: Element, model: _Model | None = None) -> None:
    """Add a `<joint>`, of a model or of a `<gazebo>` block of URDF, where its pose is relative to its child."""
    name, at = placed(robot.file, e)

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
        frame = robot.links[below].pose @ read_pose(at, child(e, "pose"))
    axis = child(e, "axis")
    type_ = e.get("type", "")
    if type_ == "gearbox":
        reference = resolved(text(e, "gearbox_reference_body") or text(e, "reference_body") or WORLD)
        ratio = at.number("gearbox_ratio", text(e, "gearbox_ratio") or "1")
        sense = float(np.sign(_axis(at, axis, frame, None) @ _axis(at, child(e, "axis2"), frame, None)))
        # a check of inertias loads no mechanism
        from virtualwork.describe.meshes import Gear

        robot.gears.append(Gear((parent, below), -ratio * (sense or 1.0), reference))
        return
    kind = KINDS.get(type_, "other")
    direction = np.zeros(3) if kind in ("fixed", "ball") else _axis(at, axis, frame, model)
    made = RobotJoint(name, kind, parent, below, (frame[:3, 3], frame[:3, 3]), direction, type=type_)
    robot.join(made)
    made.more = stated(
        [text(axis, "limit", end) for end in ("lower", "upper")], text(axis, "dynamics", "friction")
    )
    if at.number("initial_position", text(axis, "initial_position") or "0"):
        robot.notes.append(f"{at.where}: its initial_position is left out: the pose is that of coordinate 0")
    made.damping, made.stiffness, made.rest = (
        at.number(tag, text(axis, "dynamics", tag) or "0")
        for tag in ("damping", "spring_stiffness", "spring_reference")
    )
    mimic = child(axis, "mimic")
    if mimic is not None:
        factor, offset, zero = (
            at.number(f"mimic {tag}", text(mimic, tag) or default)
            for tag, default in (("multiplier", "1"), ("offset", "0"), ("reference", "0"))
        )
        other = named(robot.file, mimic, "joint")
        robot.couple(name, name, other, factor, offset - factor * zero, f"{at.where}, mimic")


def _axis(at: At, axis: Element | None, frame: Array, model: _Model | None) -> Array:
    """Return the direction of an axis in the world."""
    element = child(axis, "xyz")
    xyz = at.numbers("axis", text(element), 3, (0.0, 0.0, 1.0))
    turned = frame
    if element is not None and model is not None:
        base = element.get("expressed_in", "")
        if base:
            turned = model.frame(base, at)
        elif model.old or text(axis, "use_parent_model_frame") in ("true", "1"):
            turned = model.at[MODEL]
    return np.asarray(turned[:3, :3] @ at.direction("axis", xyz))


def driven(file: str, element: Element) -> dict[str, float | None]:
    """Return the joints that plug-ins drive, with the speed that they begin with."""
    result: dict[str, float | None] = {}
    for plugin in children(element, "plugin"):
        for name in children(plugin, "joint_name", "jointName"):
            if which := text(name):
                speed = text(plugin, "initial_velocity")
                at = At(file, "plugin")
                result[which] = None if speed is None else at.number("initial_velocity", speed)
    return result


# --- writing ------------------------------------------------------------------------------------------------------
def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    m = s.m
    root = Element("sdf", {"version": "1.9", "xmlns:dalembert": SPACE})
    world = add(root, "world", name="default")
    add(world, "gravity", digits(m.gravity.real, m.gravity.imag, 0.0))
    model = add(world, "model", name=m.name or "mechanism")
    light = LIGHT * max((p.mass for p in s.bodies.values()), default=0.0) or LIGHT
    for name in s.bodies:
        if name != GROUND:
            _add_link(s, model, name, light)
    for j in s.joints:
        add_joint(model, s, j)
    add_welds(model, s)
    add_gearboxes(model, (*m.gears, *m.belts), WORLD)
    add_plugins(model, s)
    lost = f"racks are left out: {len(m.racks)}: the format has no such joint" if m.racks else ""
    return document(root, comment), s.left_out(("gravity",), lost)


def add_pose(element: Element, z: complex, turn: float = 0.0) -> None:
    """Add the pose of a place of the plane."""
    add(element, "pose", digits(z.real, z.imag, 0.0, 0.0, 0.0, turn))


def _add_link(s: Skeleton, model: Element, name: str, light: float) -> None:
    part, link = s.bodies[name], add(model, "link", name=name)
    add_pose(link, part.at, part.turn)
    inertial = add(link, "inertial")
    mass, inertia = part.mass, part.inertia
    if mass <= 0 < inertia:
        mass = light
        SubElement(inertial, f"dalembert:{INERTIA_ALONE}")
    elif mass <= 0:
        mass, inertia = light, light * s.m.size**2
        SubElement(inertial, f"dalembert:{MASSLESS}")
    elif inertia <= 0:
        inertia = LIGHT * mass * s.m.size**2
        SubElement(inertial, f"dalembert:{POINT_MASS}")
    add_pose(inertial, part.center)
    add(inertial, "mass", digits(mass))
    tensor = add(inertial, "inertia")
    for entry in ROWS:
        # in the plane only izz acts
        add(tensor, entry, digits(inertia if entry[1] == entry[2] else 0.0))
    for k, (middle, turn, sides) in enumerate(s.boxes(name), 1):
        visual = add(link, "visual", name=f"stroke {k}")
        add_pose(visual, middle, turn)
        add(add(add(visual, "geometry"), "box"), "size", digits(*sides))
    for point, z in s.free_points(name).items():
        add_pose(add(model, "frame", name=point, attached_to=name), z)


def add_joint(model: Element, s: Skeleton, j: Joint, ground: str = WORLD) -> None:
    """Add a joint; its place is seen from the link, which cannot be the ground."""
    on, link, ends, sense = j.on, j.link, j.ends, 1.0
    if link == GROUND:
        on, link, ends, sense = link, on, (ends[1], ends[0]), -1.0
    kind = {"turn": "revolute", "slide": "prismatic"}[j.kind]
    made = add(model, "joint", name=j.name, type=kind)
    add(made, "parent", ground if on == GROUND else on)
    add(made, "child", link)
    add_pose(made, ends[1])
    axis = add(made, "axis")
    add(axis, "xyz", digits(*j.axis(s.bodies[link], sense)))
    limit = add(axis, "limit")
    if j.limits is not None:
        for tag, value in zip(("lower", "upper"), j.limits, strict=True):
            # the coordinate is 0 in the start pose
            add(limit, tag, digits(value - j.value))
    effort = 0.0 if j.input is None else -1.0 if s.travel.peak is None else s.travel.peak
    add(limit, "effort", digits(effort))


def add_welds(model: Element, s: Skeleton) -> None:
    """Add the joints that fix blocks to their links."""
    for link, block in s.welds:
        made = add(model, "joint", name=f"{block} fixed", type="fixed")
        add(made, "parent", link)
        add(made, "child", block)


def add_gearboxes(model: Element, gears: Iterable[Gear | Belt], ground: str) -> None:
    """Add gears and belts: θ of the child is −gearbox_ratio times that of the parent, both against the reference body."""
    for k, g in enumerate(gears, 1):
        a, b, arm = (ground if x == GROUND else x for x in (*g.links, g.arm))
        ratio = g.ratio
        if b == ground:
            a, b, ratio = b, a, 1 / ratio
        made = add(model, "joint", name=f"gears {k}", type="gearbox")
        add(made, "parent", a)
        add(made, "child", b)
        add(made, "gearbox_ratio", digits(-ratio))
        add(made, "gearbox_reference_body", arm)
        for tag in ("axis", "axis2"):
            add(add(made, tag), "xyz", digits(0.0, 0.0, 1.0))


def add_plugins(model: Element, s: Skeleton) -> None:
    """Add what drives the inputs, with the speed they begin with."""
    for k, e in enumerate(s.m.inputs):
        j = s.driven(k)
        if j is not None:
            plugin = add(model, "plugin", None, **PLUGIN)
            add(plugin, "joint_name", j.name)
            if e.speed is not None:
                add(plugin, "initial_velocity", digits(j.rate))
