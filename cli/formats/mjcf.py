"""MJCF, MuJoCo's own format, read and written: nested bodies, loops closed by equalities, gears and springs as tendons, inputs as actuators, the start as a key frame."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from cli.formats import markup as xml
from cli.formats.mjcf_model import Defaults, Frames, Masses, Ties, leading
from cli.formats.robot import (
    GROUND,
    LIGHT,
    WORLD,
    Array,
    Kind,
    Robot,
    RobotJoint,
    RobotLink,
    pose,
)

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
# what an option may disable
ACTING = ("constraint", "equality", "passive", "spring", "damper", "actuation")
KINDS: dict[str, Kind] = {"hinge": "turn", "slide": "slide", "ball": "ball"}


def read(file: str, root: Element, folder: Path | None) -> Robot:
    """Read a `<mujoco>`; files that it includes are followed inside its folder alone."""
    xml.include(file, root, folder, [0])
    robot = Robot(file, root.get("model", ""), notes=xml.passed_over(root, READ))
    _Reader(robot, root).read()
    return robot


class _Reader:
    """Reads the bodies, their joints and their sites."""

    def __init__(self, robot: Robot, root: Element) -> None:
        self.robot, self.file, self.root = robot, robot.file, root
        self.defaults = Defaults(self.file, root)
        self.sites: dict[str, tuple[str, Array]] = {}
        """Named places: the link, and the pose in it."""
        self.bodies: list[str] = []
        # joints that hold a body in another
        self.tree: set[str] = set()
        # bodies with a free joint, and what they stand in
        self.free: dict[str, str] = {}
        compiler = {key: text for e in xml.children(root, "compiler") for key, text in e.attrib.items()}
        self.frames = Frames(
            self.file, compiler.get("angle", "degree") != "radian", compiler.get("eulerseq", "xyz")
        )
        if compiler.get("coordinate", "local") != "local":
            raise xml.At(self.file, "compiler").error("coordinate", compiler["coordinate"], "local")
        self.masses = Masses(self.frames, compiler)
        options = list(xml.children(root, "option"))
        flags = [flag for e in options for flag in xml.children(e, "flag")]
        gravity = next(
            (text for e in reversed(options) if (text := e.get("gravity")) is not None), "0 0 -9.81"
        )
        robot.gravity = np.array(xml.At(self.file, "option").numbers("gravity", gravity, 3))
        disabled = [key for flag in flags for key, text in flag.attrib.items() if text == "disable"]
        if "gravity" in disabled:
            robot.gravity = None
        robot.notes += [
            f"option: '{key}' is disabled there, and acts here" for key in disabled if key in ACTING
        ]

    def read(self) -> None:
        robot = self.robot
        robot.add(RobotLink(WORLD, np.eye(4)))
        for e in xml.children(self.root, "worldbody"):
            self._inside(e, WORLD, np.eye(4), "main")
        self.masses.finish(robot, self.bodies)
        self.tree = set(robot.joints)
        Ties(robot, self.root, self.defaults, self.sites).read()
        closing = (j for name, j in robot.joints.items() if name not in self.tree)
        self._fix_what_is_free({link for j in closing for link in (j.parent, j.child)})

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
                at = frame @ self.frames.pose(f"site '{e.get('name')}'", self.defaults.whole(e, class_))
                self.sites[xml.named(self.file, e)] = link, at
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
            (inner, self.defaults.whole(inner, class_), at)
            for inner, class_, at in self._contents(e, of, np.eye(4))
        ]
        joints = [(values, at) for j, values, at in held if j.tag == "joint"]
        if any(j.tag == "freejoint" for j, _, _ in held) or any(v.get("type") == "free" for v, _ in joints):
            self.free[name] = parent
            joints = []
        geoms = ((values, at) for g, values, at in held if g.tag == "geom")
        mass = self.masses.of_body(where, xml.child(e, "inertial"), geoms, robot.notes)
        robot.add(RobotLink(name, here, mass))
        self.bodies.append(name)
        above = parent
        if not joints and name not in self.free:
            self._fix(name, parent)
        for k, (values, at) in enumerate(joints, 1):
            # several joints of a body follow one another, with nothing between them
            below = name if k == len(joints) else f"{name} {k}"
            if below != name:
                robot.add(RobotLink(below, here))
            self._joint(values, f"{name} joint {k}", above, below, here @ at)
            above = below
        self._inside(e, name, here, of)

    def _fix(self, name: str, parent: str) -> None:
        here = self.robot.links[name].pose[:3, 3]
        self.robot.join(RobotJoint(f"{name} fixed", "fixed", parent, name, (here, here), np.zeros(3)))

    def _fix_what_is_free(self, tied: set[str]) -> None:
        """Fix bodies with a free joint, but for those that equalities tie, at themselves or at a body that they carry."""
        carriers = {j.child: j.parent for name, j in self.robot.joints.items() if name in self.tree}
        held = set(tied)
        for link in tied:
            while link in carriers and carriers[link] not in held:
                link = carriers[link]
                held.add(link)
        for name, parent in self.free.items():
            if name not in held:
                self.robot.notes.append(f"body '{name}': its free joint is left out: the body is fixed")
                self._fix(name, parent)

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
        made.stiffness, made.damping, rest = leading(at, values, "stiffness", "damping", "springref")
        made.rest = coordinate(rest)
        if values.get("springdamper", "0").strip("0. "):
            self.robot.notes.append(f"{at.where}: its springdamper is left out: give stiffness and damping")
        self.robot.join(made)


# --- writing ------------------------------------------------------------------------------------------------------
def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    m = s.m
    root = Element("mujoco", model=m.name or "mechanism")
    light, least, raised = _bounds(s)
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
    return xml.document(root, comment), raised + s.left_out(
        ("springs", "torsion springs", "inputs", "gravity")
    )


def _bounds(s: Skeleton) -> tuple[float, float, list[str]]:
    """Return the least mass and the least moment of inertia, below all but those of zero; and what MuJoCo raises all the same."""
    bodies = s.bodies.items()
    masses, inertias = (
        [x for x in each if x > 0] for each in zip(*((p.mass, p.inertia) for _, p in bodies), strict=True)
    )
    light = max(min([LIGHT * max(masses, default=1.0), *masses]), LIGHTEST)
    least = max(min([light * s.m.size**2, *inertias]), LIGHTEST)
    names = [name for name, p in bodies if 0 < p.mass < light or 0 < p.inertia < least]
    what = f"{', '.join(names)}: MuJoCo raises a mass or a moment of inertia below {LIGHTEST:g}"
    return light, least, [what] if names else []


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
    for k, turning in enumerate(m.torsion_springs):
        on, link = turning.links
        terms = s.terms({link: 1.0, on: -1.0})
        made = _fixed(tendon, f"torsion spring {k + 1}", terms)
        made.attrib |= {"stiffness": xml.digits(turning.stiffness), "damping": xml.digits(turning.damping)}
        here = sum(c * next(j.value for j in s.joints if j.name == name) for name, c in terms.items())
        made.set("springlength", xml.digits(here - float(s.start.poses.twist(k)[0])))


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
