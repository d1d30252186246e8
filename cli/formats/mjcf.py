"""MJCF, MuJoCo's own format, read and written: nested bodies, loops closed by equalities, gears and springs as tendons, inputs as actuators, the start as a key frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from cli.formats import markup as xml
from cli.formats.drawn import GROUND
from cli.formats.robot import (
    DIAGONAL_FIRST,
    LIGHT,
    WORLD,
    Array,
    Frames,
    Inertial,
    Kind,
    Motor,
    Robot,
    RobotJoint,
    RobotLink,
    Spring,
    mass_of_shapes,
    pose,
    printed,
)
from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.formats.skeleton import Branching, Joint, Skeleton

PLURAL = {"gear": "gears", "belt": "belt", "rack": "rack"}
# MuJoCo takes nothing lighter
LIGHTEST = 2e-15
INSIDE = (
    "inertial joint freejoint geom site body frame camera light replicate attach composite flexcomp plugin"
)
# tag -> the tags in it that are read, or that say nothing of a mechanism
READ = {
    "mujoco": "compiler option default worldbody equality tendon actuator keyframe "
    "size visual statistic asset contact sensor custom extension",
    "worldbody": INSIDE,
    "body": INSIDE,
    "frame": INSIDE,
    "tendon": "fixed spatial",
    "keyframe": "key",
}
KINDS: dict[str, Kind] = {"hinge": "turn", "slide": "slide", "ball": "ball"}


def read(file: str, root: Element, folder: Path | None) -> Robot:
    """Read a `<mujoco>`; files that it includes are followed inside its folder alone."""
    xml.include(file, root, folder, [0])
    robot = Robot(file, root.get("model", ""), notes=xml.passed_over(root, READ))
    _Reader(robot, root).read()
    return robot


class _Reader:
    """Reads the bodies; `classes` are the defaults, by class and tag."""

    def __init__(self, robot: Robot, root: Element) -> None:
        self.robot, self.file, self.root = robot, robot.file, root
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        self.sites: dict[str, tuple[str, Array]] = {}
        # how angles are written, whether shapes give masses, and what all of these are together
        compiler = {key: text for e in xml.children(root, "compiler") for key, text in e.attrib.items()}
        self.frames = Frames(
            self.file, compiler.get("angle", "degree") != "radian", compiler.get("eulerseq", "xyz")
        )
        self.shapes = compiler.get("inertiafromgeom", "auto")
        self.total = xml.At(self.file, "compiler").number("settotalmass", compiler.get("settotalmass", "-1"))
        options = list(xml.children(root, "option"))
        flags = [flag for e in options for flag in xml.children(e, "flag")]
        gravity = next(
            (text for e in reversed(options) if (text := e.get("gravity")) is not None), "0 0 -9.81"
        )
        robot.gravity = np.array(xml.At(self.file, "option").numbers("gravity", gravity, 3))
        if any(flag.get("gravity") == "disable" for flag in flags):
            robot.gravity = None
        for e in xml.children(root, "default"):
            self._defaults(e, "main", self.classes["main"])

    def _defaults(self, element: Element, name: str, above: dict[str, dict[str, str]]) -> None:
        mine = {tag: dict(values) for tag, values in above.items()}
        for e in element:
            if e.tag != "default":
                mine.setdefault(e.tag, {}).update(e.attrib)
        self.classes[name] = mine
        for e in xml.children(element, "default"):
            self._defaults(e, xml.named(self.file, e, "class"), mine)

    def whole(self, e: Element, of: str = "main", kind: str = "") -> dict[str, str]:
        """Return an element's attributes with those of its class, of its tag or of the tag of its `kind`."""
        name = e.get("class", of)
        if name not in self.classes:
            raise DataError(f"{self.file}: <{e.tag}>: no default class is called '{name}'")
        return self.classes[name].get(kind or e.tag, {}) | e.attrib

    def read(self) -> None:
        robot = self.robot
        robot.add(RobotLink(WORLD, np.eye(4)))
        for e in xml.children(self.root, "worldbody"):
            self._inside(e, WORLD, np.eye(4), "main")
        masses = [link.inertial for link in robot.links.values() if link.inertial is not None]
        share = self.total / (sum(held.mass for held in masses) or 1.0)
        for held in masses if share > 0 else ():
            held.mass, held.tensor, held.half = held.mass * share, held.tensor * share, held.half * share
        self._equalities()
        self._tendons()
        self._actuators()

    def _contents(self, element: Element, of: str, frame: Array) -> Iterator[tuple[Element, str, Array]]:
        """Yield what a body holds, in frames too, each with its default class and the pose in the body in which it is written."""
        for e in element:
            if e.tag == "frame":
                inner = frame @ self.frames.pose(f"frame '{e.get('name', '')}'", e.attrib)
                yield from self._contents(e, e.get("childclass", of), inner)
            else:
                yield e, of, frame

    def _inside(self, element: Element, link: str, base: Array, of: str) -> None:
        """Read bodies and sites inside a body, which stands at `base` in the world."""
        for e, class_, frame in self._contents(element, of, np.eye(4)):
            if e.tag == "site" and e.get("name"):
                at = frame @ self.frames.pose(f"site '{e.get('name')}'", self.whole(e, class_))
                self.sites[xml.named(self.file, e)] = link, at[:3, 3]
            elif e.tag == "body":
                self._body(e, link, base @ frame, e.get("childclass", class_))
            elif e.tag in ("replicate", "attach", "composite", "flexcomp"):
                self.robot.notes.append(f"<{e.tag}> is left out: generated bodies are not read")

    def _body(self, e: Element, parent: str, base: Array, of: str) -> None:
        robot = self.robot
        name = e.get("name") or f"body {len(robot.links)}"
        where = f"body '{name}'"
        if e.get("gravcomp", "0").strip("0. "):
            robot.notes.append(f"{where}: its gravcomp is left out: its whole weight acts")
        here = base @ self.frames.pose(where, e.attrib)
        held = [
            (inner, self.whole(inner, class_), at) for inner, class_, at in self._contents(e, of, np.eye(4))
        ]
        joints = [(values, at) for j, values, at in held if j.tag == "joint"]
        if any(j.tag == "freejoint" for j, _, _ in held) or any(v.get("type") == "free" for v, _ in joints):
            robot.notes.append(f"{where}: its free joint is left out: the body is fixed")
            joints = []
        inertial = xml.child(e, "inertial")
        mass = self._inertial(where, inertial)
        if self.shapes == "true" or (self.shapes == "auto" and inertial is None):
            geoms = ((values, at) for g, values, at in held if g.tag == "geom")
            mass = mass_of_shapes(self.frames, where, geoms, robot.notes)
        robot.add(RobotLink(name, here, mass))
        above = parent
        if not joints:
            robot.join(
                RobotJoint(f"{name} fixed", "fixed", parent, name, (here[:3, 3], here[:3, 3]), np.zeros(3))
            )
        for k, (values, at) in enumerate(joints, 1):
            # several joints of a body follow one another, with nothing between them
            below = name if k == len(joints) else f"{name} {k}"
            if below != name:
                robot.add(RobotLink(below, here))
            self._joint(values, f"{name} joint {k}", above, below, here @ at)
            above = below
        self._inside(e, name, here, of)

    def _joint(self, values: dict[str, str], name: str, parent: str, below: str, here: Array) -> None:
        name = values.get("name") or name
        at = xml.At(self.file, f"joint '{name}'")
        type_ = values.get("type", "hinge")
        kind = KINDS.get(type_, "other")
        place = here @ pose(at.numbers("pos", values.get("pos"), 3, (0.0, 0.0, 0.0)))
        axis = at.numbers("axis", values.get("axis"), 3, (0.0, 0.0, 1.0))
        direction = here[:3, :3] @ at.direction("axis", axis)
        keys = ("range", "frictionloss", "armature")
        more = tuple("limits" if k == "range" else k for k in keys if values.get(k, "0").strip("0. "))

        def coordinate(value: float) -> float:
            return self.frames.angle(value) if kind == "turn" else value

        value = coordinate(at.number("ref", values.get("ref", "0")))
        made = RobotJoint(
            name, kind, parent, below, (place[:3, 3], place[:3, 3]), np.asarray(direction), value
        )
        made.type, made.more = type_, more
        made.stiffness, made.damping, rest = _leading(at, values, "stiffness", "damping", "springref")
        made.rest = coordinate(rest)
        self.robot.join(made)

    def _inertial(self, where: str, e: Element | None) -> Inertial | None:
        if e is None:
            return None
        at = xml.At(self.file, where)
        place = self.frames.pose(f"{where}, inertial", e.attrib)
        mass = at.number("mass", e.get("mass"))
        texts = dict.fromkeys(DIAGONAL_FIRST, "0")
        for key, names in (("diaginertia", DIAGONAL_FIRST[:3]), ("fullinertia", DIAGONAL_FIRST)):
            if e.get(key) is not None:
                at.numbers(key, e.get(key), len(names))
                texts |= dict(zip(names, e.get(key, "").split(), strict=True))
        return Inertial(mass, place, *printed(texts))

    def _every(self, section: str) -> Iterator[tuple[int, Element]]:
        """Yield the elements of all sections of a name, with their numbers there."""
        for part in xml.children(self.root, section):
            yield from enumerate(part, 1)

    # --- what closes loops ----------------------------------------------------------------------------------
    def _equalities(self) -> None:
        robot = self.robot
        for k, e in self._every("equality"):
            values = self.whole(e, kind="equality")
            name = values.get("name") or f"{e.tag} {k}"
            where = f"equality '{name}'"
            at = xml.At(self.file, where)
            if values.get("active") == "false":
                robot.notes.append(f"{where}: left out: it is not active")
            elif e.tag in ("connect", "weld"):
                self._connect(e.tag, name, at, values)
            elif e.tag == "joint":
                stated = at.numbers("polycoef", values.get("polycoef", ""))
                offset, factor, *powers = [*stated, *(0.0, 1.0, 0.0, 0.0, 0.0)[len(stated) :]]
                if any(powers):
                    robot.notes.append(f"{where}: left out: its polynomial is not a straight line")
                    continue
                first = xml.named(self.file, e, "joint1")
                robot.couple(name, first, values.get("joint2", ""), factor, offset, where)
            elif e.tag == "tendon" and "tendon2" not in values:
                robot.couplings.append((name, self._fixed(xml.named(self.file, e, "tendon1"), at)))
            else:
                robot.notes.append(f"{where}: left out: <{e.tag}> has no equivalent")

    def _connect(self, tag: str, name: str, at: xml.At, values: dict[str, str]) -> None:
        robot = self.robot
        if "site1" in values or "site2" in values:
            sides = []
            for key in ("site1", "site2"):
                if values.get(key) not in self.sites:
                    raise DataError(f"{at.file}: {at.where}: no site is called '{values.get(key)}'")
                link, inside = self.sites.pop(values[key])
                sides.append((link, (robot.links[link].pose @ pose(inside))[:3, 3]))
            (a, one), (b, other) = sides
        else:
            a, b = values.get("body1", ""), values.get("body2") or WORLD
            anchor = at.numbers("anchor", values.get("anchor"), 3, (0.0, 0.0, 0.0))
            base = robot.link(a, at.where).pose
            robot.link(b, at.where)
            # at the file's own configuration the place is the same on both
            one = other = (base @ pose(anchor))[:3, 3]
        kind: Kind = "fixed" if tag == "weld" else "ball"
        robot.join(RobotJoint(name, kind, a, b, (one, other), np.zeros(3)))

    def _fixed(self, name: str, at: xml.At) -> list[tuple[str, float]]:
        """Return the terms of a fixed tendon."""
        for _, e in self._every("tendon"):
            if e.tag == "fixed" and e.get("name") == name:
                own = xml.At(self.file, f"tendon '{name}'")
                joints = xml.children(e, "joint")
                return [(xml.named(self.file, j, "joint"), own.number("", j.get("coef"))) for j in joints]
        raise DataError(f"{self.file}: {at.where}: no fixed tendon is called '{name}'")

    def _tendons(self) -> None:
        for k, e in self._every("tendon"):
            self._spring(e, xml.At(self.file, f"tendon '{e.get('name') or k}'"))
        for name, (link, at) in self.sites.items():
            self.robot.links[link].points[name] = at

    def _spring(self, e: Element, at: xml.At) -> None:
        """Read a tendon that pulls: between two sites, or on joints."""
        values = self.whole(e, kind="tendon")
        lost = xml.stated([values.get("range")], values.get("frictionloss"))
        if lost:
            self.robot.notes.append(f"{at.where}: its {' and '.join(lost)} are left out")
        stiffness, damping = _leading(at, values, "stiffness", "damping")
        if not (stiffness or damping):
            return
        text = values.get("springlength", "-1")
        rest = at.numbers("springlength", text)
        if not 1 <= len(rest) <= 2:
            raise at.error("springlength", text, "1 or 2 numbers")
        ends, terms = [], []
        if e.tag == "fixed":
            terms = self._fixed(xml.named(self.file, e), at)
        else:
            sites = [s.get("site", "") for s in e]
            if len(sites) != 2 or not all(s in self.sites for s in sites):
                self.robot.notes.append(f"{at.where}: left out: it does not run straight between two sites")
                return
            ends = [self.sites[s] for s in sites]
        if len(rest) > 1 and rest[0] != rest[-1]:
            self.robot.notes.append(
                f"{at.where}: it is slack from {rest[0]:g} to {rest[-1]:g}: the first length is used"
            )
        open_ = "springlength" not in values or (rest[0] == -1.0 and not terms)
        self.robot.springs.append(
            Spring(at.where, ends, terms, stiffness, damping, None if open_ else rest[0])
        )

    def _actuators(self) -> None:
        robot = self.robot
        speeds = self._speeds()
        for k, e in self._every("actuator"):
            values = self.whole(e)
            name = values.get("name") or f"actuator {k}"
            if "joint" in values:
                terms = [(values["joint"], 1.0)]
            elif "tendon" in values:
                terms = self._fixed(values["tendon"], xml.At(self.file, f"actuator '{name}'"))
            else:
                robot.notes.append(f"actuator '{name}': left out: it drives no joint")
                continue
            speed = sum(factor * speeds.get(joint, 0.0) for joint, factor in terms)
            robot.motors.append(Motor(name, terms, speed or None))

    def _speeds(self) -> dict[str, float]:
        """Return the joints' speeds in the first key frame."""
        text = next((e.get("qvel") for _, e in self._every("keyframe")), None)
        own = [j.name for j in self.robot.joints.values() if j.kind in ("turn", "slide")]
        result = xml.At(self.file, "key").numbers("qvel", text)
        if len(result) != len(own):
            if result:
                self.robot.notes.append(
                    f"key, qvel: left out: found {len(result)} speeds, expected {len(own)}: one for each joint"
                )
            return {}
        # a key frame at rest has no speed
        return {name: v for name, v in zip(own, result, strict=True) if v != 0}


def _leading(at: xml.At, values: Mapping[str, str], *keys: str) -> list[float]:
    """Return for each key the first of one number or several, such as a stiffness with its polynomial's."""
    return [(at.numbers(key, values.get(key)) or [0.0])[0] for key in keys]


# --- writing ------------------------------------------------------------------------------------------------------
def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    m = s.m
    root = Element("mujoco", model=m.name or "mechanism")
    light = max(LIGHT * (max(p.mass for p in s.bodies.values()) or 1.0), LIGHTEST)
    inertias = [p.inertia for p in s.bodies.values() if p.inertia > 0]
    least = max(min([light * m.size**2, *inertias]), LIGHTEST)
    xml.add(
        root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false", boundmass=light, boundinertia=least
    )  # fmt: skip
    xml.add(root, "option", gravity=xml.spatial(m.gravity), timestep=0.0005, integrator="implicitfast")
    default = xml.add(root, "default")
    # as stiff as the solver of constraints takes it
    xml.add(default, "equality", solref="0.001 1", solimp="0.9999 0.9999 0.001 0.5 2")
    xml.add(default, "geom", contype="0", conaffinity="0")
    world = xml.add(root, "worldbody")
    bodies = {GROUND: world}
    for b in s.walk():
        bodies[b.child] = _body(s, b, bodies[b.parent])
    for name, body in bodies.items():
        _add_contents(s, name, body)
    equality = Element("equality")
    for j in s.closing:
        _close(j, bodies, equality)
    for link, block in s.welds:
        xml.add(equality, "weld", body1=link, body2=block)
    tendon = Element("tendon")
    count = dict.fromkeys(PLURAL, 0)
    for mesh in m.meshes:
        count[mesh.kind] += 1
        name = f"{PLURAL[mesh.kind]} {count[mesh.kind]}"
        _fixed(tendon, name, s.mesh(mesh))
        xml.add(equality, "tendon", tendon1=name)
    _springs(s, tendon, bodies)
    actuator = Element("actuator")
    for k, e in enumerate(m.inputs):
        joint = s.joint_of(k)
        motor = xml.add(actuator, "motor", name=e.name)
        if joint is None:
            _fixed(tendon, f"input {e.name}", s.free_input(k))
            motor.set("tendon", f"input {e.name}")
        else:
            motor.set("joint", joint.name)
        if s.travel.peak is not None:
            motor.set("ctrlrange", xml.digits(-s.travel.peak, s.travel.peak))
    root.extend(e for e in (equality, tendon, actuator) if len(e))
    _key(s, xml.add(root, "keyframe"))
    return xml.document(root, comment), s.left_out(("springs", "torsion springs", "inputs", "gravity"))


def _fixed(tendon: Element, name: str, terms: dict[str, float]) -> Element:
    made = xml.add(tendon, "fixed", name=name)
    for joint, factor in terms.items():
        xml.add(made, "joint", joint=joint, coef=factor)
    return made


def _springs(s: Skeleton, tendon: Element, bodies: dict[str, Element]) -> None:
    """Add springs and dampers, between two places and between two links."""
    m = s.m
    for k, spring in enumerate(m.springs, 1):
        made = xml.add(
            tendon, "spatial", name=f"spring {k}", stiffness=spring.stiffness, damping=spring.damping
        )
        made.set("springlength", xml.digits(spring.free_length))
        for side, (body, point) in zip("ab", spring.between, strict=True):
            site = f"spring {k} {side}"
            xml.add(bodies[body], "site", name=site, pos=xml.spatial(m.place(body, point)))
            xml.add(made, "site", site=site)
    for k, turning in enumerate(m.torsion_springs, 1):
        on, link = turning.links
        terms = s.terms({link: 1.0, on: -1.0})
        made = _fixed(tendon, f"torsion spring {k}", terms)
        made.attrib |= {"stiffness": xml.digits(turning.stiffness), "damping": xml.digits(turning.damping)}
        here = sum(c * next(j.value for j in s.joints if j.name == name) for name, c in terms.items())
        made.set("springlength", xml.digits(here - s.twist(turning)))


def _body(s: Skeleton, b: Branching, inside: Element) -> Element:
    """Add a body with its joint."""
    parent, part, j = s.bodies[b.parent], s.bodies[b.child], b.joint
    body = xml.add(inside, "body", name=b.child, pos=xml.spatial(parent.inside(part.at)))
    turned = part.turn - parent.turn
    if turned:
        body.set("euler", xml.digits(0.0, 0.0, turned))
    made = xml.add(body, "joint", name=j.name, type="hinge" if j.kind == "turn" else "slide")
    # of a slide the place means nothing to MuJoCo, but it is the point's
    made.set("pos", xml.spatial(j.ends[1] if b.child == j.link else j.ends[0]))
    made.set("axis", xml.digits(*j.axis(part, b.sense)))
    if j.value:
        made.set("ref", xml.digits(j.value))
    if j.limits is not None:
        made.set("range", xml.digits(*j.limits))
    return body


def _add_contents(s: Skeleton, name: str, body: Element) -> None:
    """Add what a body has: mass, named points, a drawing."""
    part = s.bodies[name]
    if part.mass > 0 or part.inertia > 0:
        xml.add(
            body,
            "inertial",
            pos=xml.spatial(part.center),
            mass=part.mass,
            diaginertia=xml.digits(*3 * (part.inertia,)),
        )
    for point, z in part.points.items():
        # a point of several links stands on the first
        if next(holder for holder, other in s.bodies.items() if point in other.points) == name:
            xml.add(body, "site", name=point, pos=xml.spatial(z))
    for a, b in s.strokes(name):
        xml.add(body, "geom", type="capsule", size=s.thickness, fromto=f"{xml.spatial(a)} {xml.spatial(b)}")


def _close(j: Joint, bodies: dict[str, Element], equality: Element) -> None:
    """Close a loop at a pin."""
    sites = []
    for name, z in zip((j.on, j.link), j.ends, strict=True):
        sites.append(f"{j.name} on {name}")
        xml.add(bodies[name], "site", name=sites[-1], pos=xml.spatial(z))
    xml.add(equality, "connect", name=j.name, site1=sites[0], site2=sites[1])


def _key(s: Skeleton, keyframe: Element) -> None:
    """The start: coordinates, speeds, efforts of the inputs."""
    walked = [b.joint for b in s.walk()]
    start = {"qpos": xml.digits(*(j.value for j in walked)), "qvel": xml.digits(*(j.rate for j in walked))}
    xml.add(keyframe, "key", name="start", **start)
