"""MJCF, MuJoCo's own format: nested bodies, joints inside them, equalities that close loops, tendons, actuators."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from cli.read.robots.elements import At, child, children, named, parse
from cli.read.robots.robot import (
    DENSITY,
    DIAGONAL_FIRST,
    SIZES,
    WORLD,
    Array,
    Inertial,
    Kind,
    Motor,
    Robot,
    RobotJoint,
    RobotLink,
    Spring,
    about,
    pose,
    printed,
    quaternion,
    together,
    unit_mass,
)
from dalembert.errors import DataError, quote
from dalembert.tables.files import load

KINDS: dict[str, Kind] = {"hinge": "turn", "slide": "slide", "ball": "ball"}
INCLUDES = 20


def read(file: str, root: Element, folder: Path | None) -> Robot:
    """Read a `<mujoco>`; files that it includes are followed inside its folder alone."""
    _include(file, root, folder, [0])
    robot = Robot(file, "MJCF", root.get("model", ""))
    _Reader(robot, root).read()
    return robot


def _include(file: str, element: Element, folder: Path | None, seen: list[int]) -> None:
    """Put the files that are included in the place of their `<include>`."""
    for i, e in reversed(list(enumerate(element))):
        if e.tag != "include":
            _include(file, e, folder, seen)
            continue
        name = named(file, e, "file")
        if folder is None:
            raise DataError(f"{file}: <include file='{name}'>: standard input has no folder")
        path, home = (folder / name).resolve(), folder.resolve()
        if not path.is_relative_to(home):
            raise DataError(f"{file}: <include file='{name}'>: it lies outside the file's folder: not read")
        seen[0] += 1
        if seen[0] > INCLUDES:
            raise DataError(f"{file}: more than {INCLUDES} files are included")
        try:
            inner = parse(name, load(path))
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise DataError(f"{file}: <include file='{name}'>: {reason}") from None
        _include(file, inner, folder, seen)
        element[i : i + 1] = list(inner)


class _Reader:
    """Walks the bodies; `classes` are the defaults, by class and tag."""

    def __init__(self, robot: Robot, root: Element) -> None:
        self.robot, self.file, self.root = robot, robot.file, root
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        self.sites: dict[str, tuple[str, Array]] = {}
        # how angles are written, and whether shapes give masses
        compiler = {key: text for e in children(root, "compiler") for key, text in e.attrib.items()}
        self.degrees = compiler.get("angle", "degree") != "radian"
        self.sequence = compiler.get("eulerseq", "xyz")
        self.shapes = compiler.get("inertiafromgeom", "auto")
        if len(self.sequence) != 3 or not set(self.sequence.lower()) <= set("xyz"):
            raise At(self.file, "compiler").error("", f"eulerseq '{self.sequence}'", "three of x, y, z")
        robot.gravity = np.array([0.0, 0.0, -9.81])
        for e in children(root, "option"):
            if e.get("gravity") is not None:
                robot.gravity = np.array(At(self.file, "option").numbers("gravity", e.get("gravity"), 3))
        for e in children(root, "default"):
            self._defaults(e, "main", {})

    def _defaults(self, element: Element, name: str, above: dict[str, dict[str, str]]) -> None:
        mine = {tag: dict(values) for tag, values in above.items()}
        for e in element:
            if isinstance(e.tag, str) and e.tag != "default":
                mine.setdefault(e.tag, {}).update(e.attrib)
        self.classes[name] = mine
        for e in children(element, "default"):
            self._defaults(e, named(self.file, e, "class"), mine)

    def whole(self, e: Element, of: str) -> dict[str, str]:
        """Return an element's attributes with those of its class."""
        name = e.get("class", of)
        if name not in self.classes:
            raise DataError(f"{self.file}: <{e.tag}>: no default class is called '{name}'")
        return self.classes[name].get(e.tag, {}) | e.attrib

    def angle(self, value: float) -> float:
        """Return an angle of the file in rad."""
        return float(np.radians(value)) if self.degrees else value

    def read(self) -> None:
        robot = self.robot
        robot.add(RobotLink(WORLD, np.eye(4)))
        for e in children(self.root, "worldbody"):
            self._inside(e, WORLD, np.eye(4), "main")
        for e in children(self.root, "equality"):
            self._equalities(e)
        self._tendons()
        self._actuators()

    def frame(self, where: str, e: Mapping[str, str]) -> Array:
        """Return the pose that pos and one of quat, euler, axisangle, xyaxes, zaxis give."""
        at = At(self.file, where)
        place = at.numbers("pos", e.get("pos"), 3, (0.0, 0.0, 0.0))
        turned = np.eye(3)
        if "quat" in e:
            turned = at.rotation(at.numbers("quat", e["quat"], 4))
        elif "euler" in e:
            for axis, angle in zip(self.sequence, at.numbers("euler", e["euler"], 3), strict=True):
                one = about("xyz".index(axis.lower()), self.angle(angle))
                turned = turned @ one if axis.islower() else one @ turned
        elif "axisangle" in e:
            *v, angle = at.numbers("axisangle", e["axisangle"], 4)
            half = self.angle(angle) / 2
            turned = quaternion(np.cos(half), *(np.sin(half) * at.direction("axisangle", v)))
        elif "xyaxes" in e:
            v = at.numbers("xyaxes", e["xyaxes"], 6)
            x = at.direction("xyaxes", v[:3])
            y = at.direction("xyaxes", np.array(v[3:]) - x * (x @ v[3:]))
            turned = np.column_stack([x, y, np.cross(x, y)])
        elif "zaxis" in e:
            turned = _onto(at.direction("zaxis", at.numbers("zaxis", e["zaxis"], 3)))
        return pose(place, turned)

    def _inside(self, element: Element, link: str, base: Array, of: str) -> None:
        """Read bodies, sites and frames inside a body; `base` is the pose, in the world, in which they are written."""
        for e in element:
            if e.tag == "frame":
                frame = self.frame(f"frame '{e.get('name', '')}'", e.attrib)
                self._inside(e, link, base @ frame, e.get("childclass", of))
            elif e.tag == "site":
                values = self.whole(e, of)
                name = e.get("name")
                if name:
                    at = np.linalg.inv(self.robot.links[link].pose) @ base
                    at = at @ self.frame(f"site '{name}'", values)
                    self.sites[name] = link, at[:3, 3]
            elif e.tag == "body":
                self._body(e, link, base, e.get("childclass", of))
            elif e.tag in ("replicate", "attach", "composite", "flexcomp"):
                self.robot.notes.append(
                    f"<{e.tag}> is left out: bodies that are made while reading are not read"
                )

    def _body(self, e: Element, parent: str, base: Array, of: str) -> None:
        robot = self.robot
        name = e.get("name") or f"body {len(robot.links)}"
        where = f"body '{name}'"
        here = base @ self.frame(where, e.attrib)
        joints = list(children(e, "joint"))
        if child(e, "freejoint") is not None or any(self.whole(j, of).get("type") == "free" for j in joints):
            robot.notes.append(f"{where}: its free joint is left out: it is taken as fixed")
            joints = []
        inertial = child(e, "inertial")
        held = self._inertial(where, inertial)
        if self.shapes == "true" or (self.shapes == "auto" and inertial is None):
            held = self._of_shapes(where, e, of)
        robot.add(RobotLink(name, here, held))
        above = parent
        if not joints:
            robot.join(
                RobotJoint(f"{name} fixed", "fixed", parent, name, (here[:3, 3], here[:3, 3]), np.zeros(3))
            )
        for k, j in enumerate(joints, 1):
            # several joints of a body follow one another, with nothing between them
            below = name if k == len(joints) else f"{name} {k}"
            if below != name:
                robot.add(RobotLink(below, here))
            self._joint(self.whole(j, of), f"{name} joint {k}", above, below, here)
            above = below
        self._inside(e, name, here, of)

    def _joint(self, values: dict[str, str], name: str, parent: str, below: str, here: Array) -> None:
        name = values.get("name") or name
        at = At(self.file, f"joint '{name}'")
        type_ = values.get("type", "hinge")
        kind = KINDS.get(type_, "other")
        place = here @ pose(at.numbers("pos", values.get("pos"), 3, (0.0, 0.0, 0.0)))
        axis = at.numbers("axis", values.get("axis"), 3, (0.0, 0.0, 1.0))
        direction = here[:3, :3] @ at.direction("axis", axis)
        keys = ("range", "frictionloss", "armature")
        more = tuple("limits" if k == "range" else k for k in keys if values.get(k, "0").strip("0. "))

        def coordinate(value: float) -> float:
            return self.angle(value) if kind == "turn" else value

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
        at = At(self.file, where)
        place = self.frame(f"{where}, inertial", e.attrib)
        mass = at.number("mass", e.get("mass"))
        texts = dict.fromkeys(DIAGONAL_FIRST, "0")
        for key, names in (("diaginertia", DIAGONAL_FIRST[:3]), ("fullinertia", DIAGONAL_FIRST)):
            if e.get(key) is not None:
                numbers = e.get(key, "").split()
                at.numbers(key, e.get(key))
                if len(numbers) != len(names):
                    raise at.error(key, f"{len(numbers)} numbers", len(names))
                texts |= dict(zip(names, numbers, strict=True))
        return Inertial(mass, place, *printed(texts))

    def _of_shapes(self, where: str, body: Element, of: str) -> Inertial | None:
        """Return the inertia of a body's shapes."""
        at, parts = At(self.file, where), []
        for e in children(body, "geom"):
            values = self.whole(e, of)
            shape = values.get("type", "sphere")
            if shape not in SIZES or "mesh" in values:
                self.robot.notes.append(f"{where}: the mass of a {values.get('mesh', shape)} is not imported")
                continue
            here = self.frame(f"{where}, geom", values)
            size = at.numbers("geom size", values.get("size", "0"))
            if "fromto" in values:
                ends = np.array(at.numbers("geom fromto", values["fromto"], 6)).reshape(2, 3)
                way = ends[1] - ends[0]
                here = pose(ends.mean(axis=0), _onto(at.direction("geom fromto", way)))
                # across it has one size, whatever its shape
                size = size[:1] * (SIZES[shape] - 1) + [float(np.linalg.norm(way)) / 2]
            if len(size) < SIZES[shape] or min(size[: SIZES[shape]]) <= 0:
                raise at.error("geom size", len(size), f"{SIZES[shape]} above zero")
            volume, moments = unit_mass(shape, size[: SIZES[shape]])
            density = at.number("geom density", values.get("density", str(DENSITY)))
            mass = at.number("geom mass", values.get("mass", repr(density * volume)))
            parts.append((mass, here, mass * moments))
        return together(parts)

    # --- what closes loops ----------------------------------------------------------------------------------
    def _equalities(self, element: Element) -> None:
        robot = self.robot
        for k, e in enumerate(element, 1):
            if not isinstance(e.tag, str):
                continue
            values = self.whole(e, "main")
            name = values.get("name") or f"{e.tag} {k}"
            where = f"equality '{name}'"
            at = At(self.file, where)
            if values.get("active") == "false":
                robot.notes.append(f"{where}: left out: it is not active")
            elif e.tag in ("connect", "weld"):
                self._connect(e.tag, name, at, values)
            elif e.tag == "joint":
                terms = [(named(self.file, e, "joint1"), 1.0)]
                powers = at.numbers("polycoef", values.get("polycoef", "0 1 0 0 0"), 5)
                if any(powers[2:]):
                    robot.notes.append(f"{where}: left out: its polynomial is not a straight line")
                    continue
                if "joint2" in values:
                    terms.append((values["joint2"], -powers[1]))
                robot.couplings.append((name, terms))
            elif e.tag == "tendon" and "tendon2" not in values:
                robot.couplings.append((name, self._fixed(named(self.file, e, "tendon1"), at)))
            else:
                robot.notes.append(f"{where}: left out: <{e.tag}> has no like here")

    def _connect(self, tag: str, name: str, at: At, values: dict[str, str]) -> None:
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

    def _fixed(self, name: str, at: At) -> list[tuple[str, float]]:
        """Return the terms of a fixed tendon."""
        for element in children(self.root, "tendon"):
            for e in children(element, "fixed"):
                if e.get("name") == name:
                    own = At(self.file, f"tendon '{name}'")
                    joints = children(e, "joint")
                    return [(named(self.file, j, "joint"), own.number("", j.get("coef"))) for j in joints]
        raise DataError(f"{self.file}: {at.where}: no fixed tendon is called '{name}'")

    def _tendons(self) -> None:
        for element in children(self.root, "tendon"):
            for k, e in enumerate(children(element, "spatial", "fixed"), 1):
                self._spring(e, At(self.file, f"tendon '{e.get('name') or k}'"))
        points: dict[str, dict[str, Array]] = {}
        for name, (link, at) in self.sites.items():
            points.setdefault(link, {})[name] = at
        for link, held in points.items():
            self.robot.links[link].points = held

    def _spring(self, e: Element, at: At) -> None:
        """A tendon that pulls: between two sites, or on joints."""
        values = self.classes[e.get("class", "main")].get("tendon", {}) | e.attrib
        stiffness, damping = _leading(at, values, "stiffness", "damping")
        if not (stiffness or damping):
            return
        text = values.get("springlength", "-1")
        rest = at.numbers("springlength", text)
        if not 1 <= len(rest) <= 2:
            raise at.error("springlength", quote(text), "1 or 2 numbers")
        ends, terms = [], []
        if e.tag == "fixed":
            terms = self._fixed(named(self.file, e), at)
        else:
            sites = [s.get("site", "") for s in e]
            if len(sites) != 2 or not all(s in self.sites for s in sites):
                self.robot.notes.append(f"{at.where}: left out: it does not run straight between two sites")
                return
            ends = [self.sites[s] for s in sites]
        if len(rest) > 1 and rest[0] != rest[-1]:
            self.robot.notes.append(
                f"{at.where}: it is slack from {rest[0]:g} to {rest[-1]:g}: the first is taken"
            )
        open_ = "springlength" not in values or (rest[0] == -1.0 and not terms)
        self.robot.springs.append(
            Spring(at.where, ends, terms, stiffness, damping, None if open_ else rest[0])
        )

    def _actuators(self) -> None:
        robot = self.robot
        speeds = self._speeds()
        for element in children(self.root, "actuator"):
            for k, e in enumerate(element, 1):
                if not isinstance(e.tag, str):
                    continue
                values = self.whole(e, "main")
                name = values.get("name") or f"actuator {k}"
                if "joint" in values:
                    terms = [(values["joint"], 1.0)]
                elif "tendon" in values:
                    terms = self._fixed(values["tendon"], At(self.file, f"actuator '{name}'"))
                else:
                    robot.notes.append(f"actuator '{name}': left out: it drives no joint")
                    continue
                speed = sum(factor * speeds.get(joint, 0.0) for joint, factor in terms)
                robot.motors.append(Motor(name, terms, speed or None))

    def _speeds(self) -> dict[str, float]:
        """The joints' speeds in the first key frame."""
        keys = [key for e in children(self.root, "keyframe") for key in children(e, "key")]
        own = [j.name for j in self.robot.joints.values() if j.kind in ("turn", "slide")]
        if not keys or keys[0].get("qvel") is None:
            return {}
        result = At(self.file, "key").numbers("qvel", keys[0].get("qvel"))
        if len(result) != len(own):
            return {}
        # a key frame at rest says of no speed
        return {name: v for name, v in zip(own, result, strict=True) if v != 0}


def _leading(at: At, values: Mapping[str, str], *keys: str) -> list[float]:
    """Return for each key the first of one number or several, such as a stiffness with its polynomial's."""
    return [(at.numbers(key, values.get(key)) or [0.0])[0] for key in keys]


def _onto(z: Array) -> Array:
    """Return the least rotation that turns the z-axis onto a direction."""
    axis = np.cross([0.0, 0.0, 1.0], z)
    s, c = float(np.linalg.norm(axis)), float(z[2])
    if s < 1e-15:
        return np.eye(3) if c > 0 else about(0, np.pi)
    half = np.arctan2(s, c) / 2
    return quaternion(np.cos(half), *(np.sin(half) * axis / s))
