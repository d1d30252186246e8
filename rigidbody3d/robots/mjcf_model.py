"""What MJCF says of its bodies: default classes, orientations, masses as the compiler makes them; what ties and drives them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from dalembert.documents import markup as xml
from dalembert.documents.robots import LIGHT, WORLD, Array, Inertial, Kind, Motor, Robot, RobotJoint, Spring
from dalembert.errors import DataError
from rigidbody3d.robots.elements import DIAGONAL_FIRST, pose, printed, rotation, stated
from rigidbody3d.turning import along, turned

if TYPE_CHECKING:
    from rigidbody3d.body import Body


class Defaults:
    """The attributes that elements have by their default class, and by their tag."""

    def __init__(self, file: str, root: Element) -> None:
        self.file = file
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for e in xml.children(root, "default"):
            self._add(e, "main", self.classes["main"])

    def _add(self, element: Element, name: str, above: dict[str, dict[str, str]]) -> None:
        mine = {tag: dict(values) for tag, values in above.items()}
        for e in element:
            if e.tag != "default":
                mine.setdefault(e.tag, {}).update(e.attrib)
        self.classes[name] = mine
        for e in xml.children(element, "default"):
            self._add(e, xml.named(self.file, e, "class"), mine)

    def whole(self, e: Element, of: str = "main", kind: str = "") -> dict[str, str]:
        """Return an element's attributes with those of its class, of its tag or of the tag of its `kind`."""
        name = e.get("class", of)
        if name not in self.classes:
            raise DataError(f"{self.file}: <{e.tag}>: no default class is called '{name}'")
        return self.classes[name].get(kind or e.tag, {}) | e.attrib


@dataclass(frozen=True)
class Frames:
    """How a file writes orientations: angles in degrees or rad, Euler angles about which axes."""

    file: str
    degrees: bool
    sequence: str

    def __post_init__(self) -> None:
        """Check the axes."""
        if len(self.sequence) != 3 or not set(self.sequence.lower()) <= set("xyz"):
            raise xml.At(self.file, "compiler").error("eulerseq", self.sequence, "three of x, y, z")

    def angle(self, value: float) -> float:
        """Return an angle of the file in rad."""
        return float(np.radians(value)) if self.degrees else value

    def pose(self, where: str, e: Mapping[str, str]) -> Array:
        """Return the pose that pos and one of quat, euler, axisangle, xyaxes, zaxis give."""
        at = xml.At(self.file, where)
        place = at.numbers("pos", e.get("pos"), 3, (0.0, 0.0, 0.0))
        turn = np.eye(3)
        if "quat" in e:
            turn = rotation(at, at.numbers("quat", e["quat"], 4))
        elif "euler" in e:
            for axis, angle in zip(self.sequence, at.numbers("euler", e["euler"], 3), strict=True):
                value = self.angle(angle)
                one = [("xyz".index(axis.lower()), np.cos(value), np.sin(value))]
                turn = turn @ turned(one, np.eye(3)) if axis.islower() else turned(one, turn)
        elif "axisangle" in e:
            from rigidbody3d.attitude import from_vector

            *v, angle = at.numbers("axisangle", e["axisangle"], 4)
            turn = rotation(at, from_vector(self.angle(angle) * at.direction("axisangle", v)).tolist())
        elif "xyaxes" in e:
            v = at.numbers("xyaxes", e["xyaxes"], 6)
            x = at.direction("xyaxes", v[:3])
            y = at.direction("xyaxes", np.array(v[3:]) - x * (x @ v[3:]))
            turn = np.column_stack([x, y, np.cross(x, y)])
        elif "zaxis" in e:
            turn = along(at.direction("zaxis", at.numbers("zaxis", e["zaxis"], 3))[None])[0]
        return pose(place, turn)


# of a shape with neither mass nor density, kg/m³
DENSITY = 1000.0
# of the heaviest body: a least mass that does not count
NEGLIGIBLE = 10 * LIGHT
# shapes that fill no space
FLAT = ("plane", "hfield")
# how many of a shape's sizes are used, those along its own axes being halves
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


def solid(shape: str, size: list[float]) -> Body:
    """Return a shape along its own axes, its density 1 kg/m³.

    >>> float(solid("box", [0.5, 1.0, 1.5]).mass)
    6.0
    """
    from rigidbody3d.body import Body, compose
    from rigidbody3d.shapes import measure_of

    if shape == "ellipsoid":
        # a sphere stretched along its axes: its second moments are m a²/5
        a, b, c = np.square(size)
        mass = np.asarray(4 / 3 * np.pi * math.prod(size))
        return Body(mass, np.zeros(3), mass / 5 * np.diag([b + c, a + c, a + b]))
    r, h = size[0], size[-1]
    named = {
        "sphere": {"radius": r},
        "box": dict(zip(("width", "height", "depth"), (2 * x for x in size), strict=False)),
    }.get(shape, {"radius": r, "length": 2 * h})
    kind = "cylinder" if shape == "capsule" else shape
    whole = Body.of(kind, measure_of(kind, **named)[0], **named)
    if shape != "capsule":
        return whole
    # its two halves of a sphere, each with its centre of mass 3r/8 beyond the cylinder's end
    end = measure_of("sphere", radius=r)[0] / 2
    half = Body(end, np.zeros(3), end * r * r * np.diag([83 / 320, 83 / 320, 2 / 5]))
    return compose([whole, *(half.moved([0.0, 0.0, side * (h + 3 / 8 * r)]) for side in (1, -1))])


class Masses:
    """What a file says of all its masses: the settings of its `<compiler>`.

    Shapes give a body its mass, of some groups alone; principal moments that no body can have are replaced by their
    mean; a body has a least mass and least principal moments; all bodies together have a total.
    """

    def __init__(self, frames: Frames, compiler: Mapping[str, str]) -> None:
        at = xml.At(frames.file, "compiler")
        self.frames = frames
        self.shapes = compiler.get("inertiafromgeom", "auto")
        self.groups = at.numbers("inertiagrouprange", compiler.get("inertiagrouprange"), 2, (0.0, 5.0))
        self.balanced = compiler.get("balanceinertia") == "true"
        self.least_mass, self.least_inertia, self.total = (
            at.number(key, compiler.get(key, "-1")) for key in ("boundmass", "boundinertia", "settotalmass")
        )

    def of_body(
        self,
        where: str,
        inertial: Element | None,
        geoms: Iterable[tuple[Mapping[str, str], Array]],
        notes: list[str],
    ) -> Inertial | None:
        """Return the inertia of a body: its own, or that of its shapes, each by its attributes and the pose in which it is written."""
        mass = None if inertial is None else self._stated(where, inertial)
        if self.shapes == "true" or (self.shapes == "auto" and inertial is None):
            mass = self._of_shapes(where, geoms, notes) or mass
        return mass if mass is None else self._bounded(mass)

    def _stated(self, where: str, e: Element) -> Inertial:
        """Return what an `<inertial>` states."""
        at = xml.At(self.frames.file, where)
        place = self.frames.pose(f"{where}, inertial", e.attrib)
        mass = at.number("mass", e.get("mass"))
        texts = dict.fromkeys(DIAGONAL_FIRST, "0")
        for key, names in (("diaginertia", DIAGONAL_FIRST[:3]), ("fullinertia", DIAGONAL_FIRST)):
            if e.get(key) is not None:
                at.numbers(key, e.get(key), len(names))
                texts |= dict(zip(names, e.get(key, "").split(), strict=True))
        return Inertial(mass, place, *printed(texts))

    def _of_shapes(
        self, where: str, geoms: Iterable[tuple[Mapping[str, str], Array]], notes: list[str]
    ) -> Inertial | None:
        from rigidbody3d.body import compose

        at, (low, high) = xml.At(self.frames.file, where), self.groups
        counted = [
            (values, frame)
            for values, frame in geoms
            if values.get("type") not in FLAT
            and low <= at.number("geom group", values.get("group", "0")) <= high
        ]
        shells = sum(values.get("shellinertia") == "true" for values, _ in counted)
        if shells:
            notes.append(f"{where}: shellinertia of {shells} shapes is left out: they are taken as solid")
        parts = [part for values, frame in counted if (part := self._of_shape(where, values, frame, notes))]
        if not sum(part.mass for part in parts) > 0:
            return None
        body = compose(parts)
        return Inertial(float(body.mass), pose(body.center), body.inertia, np.zeros((3, 3)))

    def _of_shape(self, where: str, values: Mapping[str, str], frame: Array, notes: list[str]) -> Body | None:
        from rigidbody3d.body import Body

        at, shape = xml.At(self.frames.file, where), values.get("type", "sphere")
        if "mass" in values and at.number("geom mass", values["mass"]) == 0:
            return None
        if shape not in SIZES or "mesh" in values:
            notes.append(f"{where}: the mass of a {values.get('mesh', shape)} is not imported")
            return None
        here = self.frames.pose(f"{where}, geom", values)
        size = at.numbers("geom size", values.get("size", "0"))
        if "fromto" in values:
            ends = np.array(at.numbers("geom fromto", values["fromto"], 6)).reshape(2, 3)
            way = ends[1] - ends[0]
            here = pose(ends.mean(axis=0), along(at.direction("geom fromto", way)[None])[0])
            # across it has one size, whatever its shape
            size = size[:1] * (SIZES[shape] - 1) + [float(np.linalg.norm(way)) / 2]
        if len(size) < SIZES[shape] or min(size[: SIZES[shape]]) <= 0:
            raise at.error("geom size", values.get("size", ""), f"{SIZES[shape]} above zero")
        whole = solid(shape, size[: SIZES[shape]])
        density = at.number("geom density", values.get("density", str(DENSITY)))
        mass = at.number("geom mass", values.get("mass", repr(density * float(whole.mass))))
        if mass < 0:
            raise at.error("geom mass", f"{mass:g}", "one of zero or more")
        held = frame @ here
        own = Body(np.asarray(mass), np.zeros(3), mass / whole.mass * whole.inertia)
        return own.turned(held[:3, :3]).moved(held[:3, 3])

    def _bounded(self, held: Inertial) -> Inertial:
        """Return an inertia with its principal moments balanced, and the least mass and moments."""
        moments, axes = np.linalg.eigh(held.tensor)
        made = moments
        if self.balanced and moments[0] + moments[1] < moments[2]:
            made = np.full(3, moments.mean())
        if moments.any():
            made = np.maximum(made, self.least_inertia)
        if (made != moments).any():
            held.tensor = (axes * made) @ axes.T
        # a wheel on a fixed axle may have none
        held.mass = max(held.mass, self.least_mass) if held.mass else 0.0
        return held

    def finish(self, robot: Robot, bodies: Iterable[str]) -> None:
        """Give all bodies together their total, and name those without mass that MuJoCo gives the least one.

        A least mass is mostly what MuJoCo needs to step a body without one; what has none, and moments of zero, stay so.
        """
        held = {name: robot.links[name].inertial for name in bodies}
        masses = [each for each in held.values() if each is not None]
        none = [name for name, each in held.items() if each is None]
        if none and self.least_mass > NEGLIGIBLE * max((each.mass for each in masses), default=0.0):
            robot.notes.append(f"boundmass: left out for {', '.join(none)}, which stay without mass")
        share = self.total / (sum(held.mass for held in masses) or 1.0)
        for each in masses if share > 0 else ():
            each.mass, each.tensor, each.half = each.mass * share, each.tensor * share, each.half * share


# --- what ties and drives the bodies ---------------------------------------------------------------------------------
# a sine: what decimals of an orientation are off by
TURNED = 1e-6


class Ties:
    """Reads them into a robot whose bodies are read; `sites` are its named places, each a link and the pose in it."""

    def __init__(
        self, robot: Robot, root: Element, defaults: Defaults, sites: Mapping[str, tuple[str, Array]]
    ) -> None:
        self.robot, self.file, self.root = robot, robot.file, root
        self.defaults, self.sites = defaults, sites
        # those that close loops
        self.closing: set[str] = set()

    def read(self) -> None:
        """Read all of them."""
        self._equalities()
        self._tendons()
        self._actuators()

    def _every(self, section: str) -> Iterator[tuple[int, Element]]:
        """Yield the elements of all sections of a name, with their numbers there."""
        for part in xml.children(self.root, section):
            yield from enumerate(part, 1)

    # --- what closes loops ----------------------------------------------------------------------------------
    def _equalities(self) -> None:
        robot = self.robot
        for k, e in self._every("equality"):
            values = self.defaults.whole(e, kind="equality")
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
                robot.note_offset(where, *at.numbers("polycoef", values.get("polycoef", ""))[:1])
            else:
                robot.notes.append(f"{where}: left out: <{e.tag}> has no equivalent")

    def _connect(self, tag: str, name: str, at: xml.At, values: dict[str, str]) -> None:
        """Pin or weld two bodies: where a weld holds no angle, it is a pin too."""
        robot = self.robot
        if "site1" in values or "site2" in values:
            (a, one), (b, other) = (self._side(values.get(key), at) for key in ("site1", "site2"))
        else:
            a, b = values.get("body1", ""), values.get("body2") or WORLD
            first, second = (robot.link(body, at.where).pose for body in (a, b))
            anchor = pose(at.numbers("anchor", values.get("anchor"), 3, (0.0, 0.0, 0.0)))
            # at the file's own configuration the place is the same on both
            one = other = first @ anchor if tag == "connect" else second @ anchor
            stated = at.numbers("relpose", values.get("relpose"), 7, (0.0,) * 7)
            if tag == "weld" and any(stated[3:]):
                one = first @ pose(stated[:3], rotation(at.inside("relpose"), stated[3:])) @ anchor
        kind: Kind = "ball"
        if tag == "weld" and at.number("torquescale", values.get("torquescale", "1")) != 0:
            kind = "fixed"
            apart = one[:3, :3].T @ other[:3, :3]
            off = float(np.linalg.norm(apart - apart.T) / np.sqrt(8))
            if off > TURNED:
                robot.notes.append(
                    f"{at.where}: as the file stands its bodies are turned by a sine of {off:.3g} out of it: fixed as they stand"
                )
        robot.join(RobotJoint(name, kind, a, b, (one[:3, 3], other[:3, 3]), np.zeros(3)))

    def _side(self, site: str | None, at: xml.At) -> tuple[str, Array]:
        """Return the body of a site that closes a loop, and its pose."""
        if site is None or site not in self.sites:
            raise DataError(f"{at.file}: {at.where}: no site is called '{site}'")
        self.closing.add(site)
        link, inside = self.sites[site]
        return link, self.robot.links[link].pose @ inside

    def _fixed(self, name: str, at: xml.At) -> list[tuple[str, float]]:
        """Return the terms of a fixed tendon by its name."""
        for _, e in self._every("tendon"):
            if e.tag == "fixed" and e.get("name") == name:
                return self._terms(e, xml.At(self.file, f"tendon '{name}'"))
        raise DataError(f"{self.file}: {at.where}: no fixed tendon is called '{name}'")

    def _terms(self, e: Element, at: xml.At) -> list[tuple[str, float]]:
        joints = xml.children(e, "joint")
        return [(xml.named(self.file, j, "joint"), at.number("", j.get("coef"))) for j in joints]

    def _tendons(self) -> None:
        for k, e in self._every("tendon"):
            self._spring(e, xml.At(self.file, f"tendon '{e.get('name') or k}'"))
        for name, (link, at) in self.sites.items():
            if name not in self.closing:
                self.robot.links[link].points[name] = at[:3, 3]

    def _spring(self, e: Element, at: xml.At) -> None:
        """Read a tendon that pulls: between two sites, or on joints."""
        values = self.defaults.whole(e, kind="tendon")
        lost = stated([values.get("range")], values.get("frictionloss"))
        if lost:
            self.robot.notes.append(f"{at.where}: its {' and '.join(lost)} are left out")
        stiffness, damping = leading(at, values, "stiffness", "damping")
        if not (stiffness or damping):
            return
        text = values.get("springlength", "-1")
        rest = at.numbers("springlength", text)
        if not 1 <= len(rest) <= 2:
            raise at.error("springlength", text, "1 or 2 numbers")
        ends, terms = [], []
        if e.tag == "fixed":
            terms = self._terms(e, at)
        else:
            sites = [s.get("site", "") for s in e]
            if len(sites) != 2 or not all(s in self.sites for s in sites):
                self.robot.notes.append(f"{at.where}: left out: it does not run straight between two sites")
                return
            ends = [(link, place[:3, 3]) for link, place in map(self.sites.__getitem__, sites)]
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
            values = self.defaults.whole(e)
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


def leading(at: xml.At, values: Mapping[str, str], *keys: str) -> list[float]:
    """Return for each key the first of one number or several, such as a stiffness with its polynomial's."""
    return [(at.numbers(key, values.get(key)) or [0.0])[0] for key in keys]
