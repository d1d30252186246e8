"""MJCF, MuJoCo's own format: nested bodies, their joints and sites; what ties and drives them is in `mjcf_model`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from dalembert.documents import markup as xml
from dalembert.documents.robots import WORLD, Array, Kind, Robot, RobotJoint, RobotLink
from rigidbody3d.robots.elements import pose
from rigidbody3d.robots.mjcf_model import Defaults, Frames, Masses, Ties, leading

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
