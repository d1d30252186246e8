"""A mechanism as its designer describes it: its links, guides, gears, inputs and loads. Frozen, SI.

Unknown names, links of zero length and parts that contradict themselves are refused. Nothing is solved here: the order
of solution, the formulas and the studies work on this.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from numbers import Real
from types import MappingProxyType
from typing import Any

from dalembert.arithmetic.records import Record, record
from dalembert.dataclass import dataclass, field
from virtualwork.describe import DescriptionError, require
from virtualwork.describe.cams import CamDrive, drive_of
from virtualwork.describe.forms import Form, Free, Pair
from virtualwork.describe.keys import Key, Keys, Part, check, declared, place_of, table_keys
from virtualwork.describe.meshes import Mesh
from virtualwork.describe.parts import (
    GROUND,
    PARTS,
    Belt,
    Cam,
    Force,
    Friction,
    Gear,
    Guess,
    Guide,
    Input,
    Link,
    Motor,
    Rack,
    Rigid,
    Spring,
    Torque,
    TorsionSpring,
)
from virtualwork.describe.points import as_points, by_name, several
from virtualwork.describe.units import Decimals
from virtualwork.describe.values import Point, as_point


@record
@dataclass(frozen=True, eq=False, repr=False)
class Description(Record):
    """The description of a planar mechanism; `virtualwork.Mechanism` adds its motion and its studies.

    Raises
    ------
    DescriptionError
        Where names are unknown or sizes contradict each other; the message names the place.
    """

    ground: Mapping[str, complex] = declared(Free("ground"), "named fixed points [x, y]", needed=False)
    links: Mapping[str, Link] = declared(Free("links"), "the moving links by name")
    guides: tuple[Guide, ...] = ()
    gears: tuple[Gear, ...] = ()
    inputs: tuple[Input, ...] = ()
    guess: Guess = declared(Free("guess"), "roughly how it stands: this chooses the assembly", default=None)
    name: str = declared(Free("name"), "what the mechanism is called", default="")
    gravity: complex = declared(Pair("acceleration"), "its two components, m/s2", default=0j)
    forces: tuple[Force, ...] = ()
    torques: tuple[Torque, ...] = ()
    springs: tuple[Spring, ...] = ()
    torsion_springs: tuple[TorsionSpring, ...] = ()
    motors: tuple[Motor, ...] = ()
    friction: tuple[Friction, ...] = ()
    belts: tuple[Belt, ...] = ()
    racks: tuple[Rack, ...] = ()
    cams: tuple[Cam, ...] = ()
    tolerances: Mapping[str, float] = declared(
        Free("tolerances"),
        'limits of dimensions by their paths: "links.crank.B.x" = "0.05 mm" is ± that',
        default=None,
    )
    # of the file that it was read from
    decimals: Decimals | None = field(default=None, compare=False)

    def __init__(
        self,
        ground: Mapping[str, Point],
        links: Mapping[str, Link],
        guides: Sequence[Guide] = (),
        gears: Sequence[Gear] = (),
        inputs: Input | Sequence[Input] = (),
        guess: Guess | None = None,
        name: str = "",
        gravity: Point = 0j,
        forces: Sequence[Force] = (),
        torques: Sequence[Torque] = (),
        springs: Sequence[Spring] = (),
        torsion_springs: Sequence[TorsionSpring] = (),
        motors: Sequence[Motor] = (),
        friction: Sequence[Friction] = (),
        tolerances: Mapping[str, float] | None = None,
        belts: Sequence[Belt] = (),
        racks: Sequence[Rack] = (),
        cams: Sequence[Cam] = (),
        decimals: Decimals | None = None,
    ) -> None:
        values = {
            "ground": as_points(ground, "ground"),
            "links": MappingProxyType(dict(by_name("links", links))),
            "guides": several("guides", guides),
            "gears": several("gears", gears),
            "inputs": (inputs,) if isinstance(inputs, Input) else several("inputs", inputs),
            "guess": guess or Guess(),
            "name": name,
            "gravity": _gravity(gravity),
            "forces": several("forces", forces),
            "torques": several("torques", torques),
            "springs": several("springs", springs),
            "torsion_springs": several("torsion_springs", torsion_springs),
            "motors": several("motors", motors),
            "friction": several("friction", friction),
            "belts": several("belts", belts),
            "racks": several("racks", racks),
            "cams": several("cams", cams),
            "tolerances": MappingProxyType(dict(tolerances or {})),
            "decimals": decimals,
        }
        for key, value in values.items():
            object.__setattr__(self, key, value)
        refuse_kinds(self)
        refuse(self)

    def __repr__(self) -> str:
        counts = (
            (len(self.links), "link"),
            (len(self.pins) + len(self.guides) + len(self.meshes) + len(self.cams), "joint"),
        )
        sizes = ", ".join(f"{n} {noun}{'' if n == 1 else 's'}" for n, noun in counts)
        driven = ", ".join(e.name for e in self.inputs) or "nothing"
        return f"{type(self).__name__}({self.name!r}: {sizes}, driven: {driven})"

    @cached_property
    def size(self) -> float:
        """The characteristic length, m: the longest distance between two points of one link or of the ground.

        Every tolerance is relative to it.
        """
        return max(self.spans, default=0.0) or 1.0

    @property
    def spans(self) -> list[float]:
        """Distances of two points of one link or of the ground, of guides from their bodies' axes, and radii, m."""
        spans = [abs(a - b) for body in self.bodies.values() for a in body.values() for b in body.values()]
        spans += [abs(g.through) for g in self.guides if not isinstance(g.through, str)]
        wheels = [abs(rack.radius) for rack in self.racks] + [cam.prime_radius for cam in self.cams]
        return spans + wheels + [radius for belt in self.belts for radius in belt.radii]

    @cached_property
    def bodies(self) -> Mapping[str, Mapping[str, complex]]:
        """The points of each body in its own axes; the ground comes first."""
        return {GROUND: self.ground} | {name: link.points for name, link in self.links.items()}

    @cached_property
    def points(self) -> Mapping[str, tuple[str, complex]]:
        """Each named point: the first body that has it, the ground before the links, and its place in that body's axes."""
        places: dict[str, tuple[str, complex]] = {}
        for body, points in self.bodies.items():
            for name, z in points.items():
                places.setdefault(name, (body, z))
        return places

    @cached_property
    def pins(self) -> Mapping[str, tuple[str, ...]]:
        """The bodies that meet at each pin, in the order of the file, the ground first."""
        holders: dict[str, list[str]] = {}
        for body, points in self.bodies.items():
            for point in points:
                holders.setdefault(point, []).append(body)
        return {point: tuple(bodies) for point, bodies in holders.items() if len(bodies) > 1}

    @cached_property
    def at(self) -> tuple[float, ...]:
        """The inputs at which the guess is meant: its `at`, else each input's own value, else its guessed angle."""
        if self.guess.at is not None:
            return self.guess.at
        return tuple(
            entry.value if entry.value is not None else self.guess.angles.get(entry.name, 0.0)
            for entry in self.inputs
        )

    @cached_property
    def rigid(self) -> Mapping[str, Rigid]:
        """Mass properties of every link with the motors it carries (Ibrahim §2.3: their mass and centre join the link).

        The common centre is Σ m z / Σ m, and the inertia about it gains Σ m |z − z_G|² (Steiner).

        >>> links = {"arm": Link({"O": 0j, "P": 1}, mass=2, center=0.25, inertia=0.1), "tool": Link({"P": 0j})}
        >>> arm = Description({"O": 0j}, links, motors=[Motor("arm", "tool", mass=1, center=1)])
        >>> arm.rigid["arm"]
        Rigid(mass=3.0, center=(0.5+0j), inertia=0.475)
        """
        return {body: self._rigid(body, link) for body, link in self.links.items()}

    def _rigid(self, body: str, link: Link) -> Rigid:
        parts = [(link.mass, link.center, link.inertia)]
        parts += [
            (motor.mass, motor.center, 0.0) for motor in self.motors if motor.carrier == body and motor.mass
        ]
        if len(parts) == 1:
            return Rigid(*parts[0])
        mass = sum(part[0] for part in parts)
        center = sum((part[0] * part[1] for part in parts), 0j) / mass if mass else link.center
        return Rigid(mass, center, sum(i + w * abs(z - center) ** 2 for w, z, i in parts))

    @property
    def applies(self) -> bool:
        """Whether anything but weight and inertia acts on a link: forces, torques, springs, friction."""
        return any((self.forces, self.torques, self.springs, self.torsion_springs, self.friction))

    def place(self, body: str, point: complex | str | None) -> complex:
        """A point in the axes of its body, given by its place or its name; None is the link's own centre of mass."""
        if point is None:
            return self.links[body].center
        return self.bodies[body][point] if isinstance(point, str) else point

    def through(self, guide: Guide) -> complex:
        """A point of a guide's line, in the axes of the body that carries it."""
        return self.place(guide.on, guide.through)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        """The relations of gears, belts and racks, in this order."""
        racks = [(rack, self.guide_at(rack.slider)) for rack in self.racks]
        return (
            *(gear.mesh for gear in self.gears),
            *(belt.mesh for belt in self.belts),
            *(rack.mesh_on(i, self.guides[i].on) for rack, i in racks),
        )

    @cached_property
    def cam_drives(self) -> tuple[CamDrive, ...]:
        """Every cam in its place: what carries it, where its follower stands at lift zero."""
        return tuple(drive_of(self, number) for number in range(len(self.cams)))

    @property
    def ratios(self) -> tuple[float, ...]:
        """The ratios of gears and belts."""
        return *(gear.ratio for gear in self.gears), *(belt.ratio for belt in self.belts)

    @cached_property
    def guided(self) -> dict[str, int]:
        """The points that run in guides, each with the number of its guide: of two of them that of the first."""
        points = [guide.point for guide in self.guides]
        return {point: points.index(point) for point in points}

    def guide_at(self, point: str | None) -> int:
        """The guide in which a point runs."""
        return self.guided[str(point)]

    def guide_of(self, entry: Input) -> int:
        """The guide along which a slide input drives."""
        return self.guide_at(entry.slider)

    def driver_of(self, guide: int) -> int | None:
        """The input that drives along a guide; None where none does."""
        point = self.guides[guide].point
        return next((j for j, entry in enumerate(self.inputs) if entry.slider == point), None)

    def carrier(self, j: int) -> str:
        """The body that feels the reaction of input j's torque: the carrier of its motor, else what it is driven on."""
        entry = self.inputs[j]
        return next((motor.carrier for motor in self.motors if motor.drives == entry.link), entry.on)

    @cached_property
    def carried(self) -> list[int]:
        """The turning inputs whose motor sits on another body than `on`."""
        return [j for j, e in enumerate(self.inputs) if not e.is_slide and self.carrier(j) != e.on]


UNITS: Keys = {
    "length": Key(Form(), "the unit of bare lengths", name="length", default="m"),
    "angle": Key(Form(), "the unit of bare angles", name="angle", default="rad"),
}
"""The keys of [units]."""

FILE: Keys = {
    **table_keys(Description),
    "source": Key(Free("anything"), "where it is from; not evaluated"),
    "note": Key(Free("anything"), "a remark; not evaluated"),
    "report": Key(
        Free("report"), "the head of a report: title, machine, customer, date, author; not evaluated"
    ),
    "units": Key(Free("units"), "what bare lengths and angles mean"),
}
"""The keys at the top of the file in addition to the tables of the parts."""


def slide_by_guess(
    m: Description, i: int, angles: Mapping[str, Any], points: Mapping[str, Any]
) -> float | None:
    """The slide of a guide where the guess knows its point and its line; None where it does not.

    Parameters
    ----------
    m : Description
    i : int
    angles, points : mapping
        As `known_by_guess` has them.
    """
    from dalembert.arithmetic.varied import rotation

    g = m.guides[i]
    turned = {GROUND: 0.0, **angles}
    here = next((p for p in m.bodies[g.on] if p in points), None)
    if g.point not in points or g.on not in turned or (g.on != GROUND and here is None):
        return None
    start = m.through(g)
    if here is not None and g.on != GROUND:
        start = points[here] + (start - m.bodies[g.on][here]) * rotation(turned[g.on])
    run = (points[g.point] - start) * rotation(g.angle + turned[g.on]).conjugate()
    return run.real  # type: ignore[no-any-return]


def known_by_guess(m: Description) -> tuple[dict[str, float], dict[str, complex]]:
    """Rough link angles and point positions from the guess, the ground and the inputs, as far as they reach."""
    # the schema needs no tape
    from dalembert.arithmetic.varied import heading, rotation

    angles = dict(m.guess.angles)
    points = dict(m.guess.points) | dict(m.ground)
    driven = {e.link: (e.on, at) for e, at in zip(m.inputs, m.at, strict=True) if e.link is not None}
    # exact where each is driven on the next one, down to the ground
    exact = {GROUND: 0.0}
    for _ in driven:
        exact |= {link: exact[on] + at for link, (on, at) in driven.items() if on in exact}
    del exact[GROUND]
    angles |= exact
    for g in m.guides:
        if g.turned is not None and g.on == GROUND:
            angles.setdefault(g.link, g.angle + g.turned)
        if g.turned is not None and g.link == GROUND:
            angles.setdefault(g.on, -(g.angle + g.turned))
    before = -1
    while len(angles) + len(points) > before:
        before = len(angles) + len(points)
        for name, (on, angle) in driven.items():
            if on in angles:
                angles.setdefault(name, angles[on] + angle)
        for name, link in m.links.items():
            here = [p for p in link.points if p in points]
            if name not in angles and len(here) >= 2:
                ends = max(
                    ((a, b) for a in here for b in here),
                    key=lambda ab: abs(link.points[ab[1]] - link.points[ab[0]]),
                )
                local = link.points[ends[1]] - link.points[ends[0]]
                seen = points[ends[1]] - points[ends[0]]
                if local and seen:
                    angles[name] = heading(seen / local)
            if name in angles and here:
                turn = rotation(angles[name])
                for p, z in link.points.items():
                    points.setdefault(p, points[here[0]] + (z - link.points[here[0]]) * turn)
    return angles, points


def refuse_kinds(m: Description) -> None:
    """Refuse a part that stands in the list of others, each with its place.

    Raises
    ------
    DescriptionError
    """
    for kind in PARTS:
        for i, part in enumerate(getattr(m, kind.collection), 1):
            if not isinstance(part, kind):
                raise DescriptionError(
                    f"{kind.collection} {i}: expected {kind.__name__}, found {type(part).__name__}"
                )
    if not isinstance(m.guess, Guess):
        raise DescriptionError(f"guess: expected Guess, found {type(m.guess).__name__}")
    for name, link in m.links.items():
        if not isinstance(link, Link):
            raise DescriptionError(f"links '{name}': expected Link, found {type(link).__name__}")


def refuse(m: Description) -> None:
    """Refuse unknown names and impossible sizes, each with its place.

    Raises
    ------
    DescriptionError
    """
    if GROUND in m.links:
        raise DescriptionError("[links.ground]: 'ground' is the fixed body; give this link another name")
    if not m.links:
        raise DescriptionError("[links]: the mechanism has no links")
    for name, link in m.links.items():
        for point, z in link.points.items():
            if not (abs(z) < float("inf")):
                raise DescriptionError(
                    f"[links.{name}] points.{point}: found {z}, expected finite coordinates"
                )
        check(link, f"[links.{name}]", m)
    for name, earlier, later in joints_apart(m):
        points = m.links[name].points
        if points[earlier] == points[later]:
            raise DescriptionError(
                f"[links.{name}] points: {earlier} and {later} are both joints at the same place: "
                "a link of zero length; pin the links at one point name instead"
            )
    # an input may name a guide: a guide's own names come first
    for _, number, part in sorted(listed(m), key=lambda entry: isinstance(entry[2], Input)):
        check(part, place_of(part.table, number, len(m.inputs)) + part.label, m)
    followers: dict[Any, int] = {}
    for number, drive in enumerate(m.cam_drives, 1):
        first = followers.setdefault(drive.guide if drive.body is None else drive.body, number)
        if first != number:
            raise DescriptionError(f"[[cams]] {number}: its follower is that of [[cams]] {first} already")
    if m.guess.at is not None and len(m.guess.at) != len(m.inputs):
        raise DescriptionError(
            f"[guess] at: found {len(m.guess.at)} values, expected one for each of {len(m.inputs)} inputs"
        )
    for name in m.guess.angles:
        require(name, m.links, f"[guess] {name}", "link or point")
    for name in m.guess.points:
        require(name, m.points, f"[guess] {name}", "link or point")


def listed(m: Description) -> Iterator[tuple[int, int, Part]]:
    """Every part that stands in a list: its index there, its number in its table from 1, and the part."""
    for kind in PARTS:
        count: dict[str, int] = {}
        for i, part in enumerate(getattr(m, kind.collection)):
            count[part.table] = count.get(part.table, 0) + 1
            yield i, count[part.table], part


def _gravity(value: Point) -> complex:
    """Read gravity; a number alone, which would act along x, is refused."""
    if isinstance(value, Real) and value != 0:
        raise DescriptionError(f"gravity: found {value!r}, expected its two components, such as (0, -9.81)")
    return as_point(value, "gravity")


def joints_apart(m: Description) -> Iterator[tuple[str, str, str]]:
    """Pairs of joints of one link, (link, point, later point), that must not stand at one place."""
    for name, link in m.links.items():
        guided = {g.point for g in m.guides if g.link == name}
        joints = [point for point in link.points if point in m.pins or point in guided]
        for i, later in enumerate(joints):
            yield from ((name, earlier, later) for earlier in joints[:i] if earlier in m.pins)
