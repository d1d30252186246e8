"""A mechanism drawn in one pose, whatever program drew it: bodies with axes parallel to the ground's, joints, inputs.

Coordinates are exact fractions of the decimals in the file, so that a difference of two of them is rounded once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import product

from cli.imports.messages import damaged
from cli.read.names import Groups, unused
from dalembert.units import to_si

GROUND = "ground"
Place = tuple[Fraction, Fraction]
LARGEST = 1e60
# drawn places nearer than this share of the drawing's size are one
SAME = 1e-9


def exact(value: float) -> Fraction:
    """Return the decimal that a number was written as; ValueError where it is no finite number.

    >>> float(exact(0.3) - exact(0.1))
    0.2
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"found {value!r}, expected a finite number")
    return Fraction(repr(value))


def place(x: float, y: float) -> Place:
    """Return a place from its two coordinates."""
    return exact(x), exact(y)


def finite(file: str, where: str, word: object) -> float:
    """Return the finite number that a word is; DataError names the place where it is none."""
    try:
        value = float(str(word))
        exact(value)
    except ValueError:
        raise damaged(file, where, word, "a finite number") from None
    return value


def apart(a: Place, b: Place) -> float:
    """Return the distance of two places."""
    return math.hypot(float(a[0] - b[0]), float(a[1] - b[1]))


def direction(a: Place, b: Place) -> float:
    """Return the direction from one place to another, degrees from the x-axis."""
    return math.degrees(math.atan2(float(b[1] - a[1]), float(b[0] - a[0])))


@dataclass
class Body:
    """A rigid body: its named points and its centre of mass in its own axes; how these stand in the pose, rad."""

    points: dict[str, Place] = field(default_factory=dict)
    turn: float = 0.0
    at: Place = (Fraction(0), Fraction(0))
    mass: float = 0.0
    center: Place = (Fraction(0), Fraction(0))
    inertia: float = 0.0


@dataclass
class Slide:
    """A point of `link` on the line of `on` through a place, at an angle; `turned` None is a slot, else a prism."""

    point: str
    link: str
    on: str
    through: Place
    angle: float
    turned: float | None = None


@dataclass
class Mesh:
    """Two gears: (ω_b − ω_arm) = ratio·(ω_a − ω_arm)."""

    a: str
    b: str
    ratio: float
    arm: str


@dataclass
class Toothed:
    """A wheel and a rack: the slide grows by radius·(θ_gear − θ_on), `on` the body that carries it."""

    gear: str
    slide: Slide
    radius: float


@dataclass
class Drive:
    """An input: the angle of `link` against `on`, or the way along a slide; `at` in the pose, `speed` as TOML has it."""

    link: str | None = None
    on: str = GROUND
    slide: Slide | None = None
    at: float = 0.0
    speed: str | float | None = None

    @property
    def moves(self) -> object:
        """What it moves, the same of inputs that move the same."""
        return id(self.slide) if self.slide else frozenset((self.link, self.on))

    @property
    def pair(self) -> tuple[str, str]:
        """The two bodies that it moves against each other, that which moves first."""
        s = self.slide
        if s is None:
            return str(self.link), self.on
        return (s.link, s.on) if s.link != GROUND else (s.on, s.link)


@dataclass
class Load:
    """A force, torque or spring: its table, the bodies it holds on to, and its values as TOML has them.

    `ends` are the places (body, place in its axes); values that are places of a body stand there and nowhere else.
    """

    table: str
    ends: list[tuple[str, Place | None]]
    values: dict[str, object]


@dataclass
class Drawing:
    """All that a file says of one mechanism, in the file's units."""

    name: str = ""
    length: str = "m"
    angle: str = "deg"
    posed: bool = True
    """It stands as it is drawn; False: at angles that are sought."""
    own_axes: bool = False
    """Each body's points are in axes of its own, which the file gives; False: in the ground's, as they are drawn."""
    bodies: dict[str, Body] = field(default_factory=lambda: {GROUND: Body()})
    slides: list[Slide] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    racks: list[Toothed] = field(default_factory=list)
    drives: list[Drive] = field(default_factory=list)
    spare: list[Drive] = field(default_factory=list)
    """What may drive it where its inputs leave it free; of robots, whose files may name too few or too many of them."""
    loads: list[Load] = field(default_factory=list)
    welds: list[tuple[str, str]] = field(default_factory=list)
    gravity: tuple[float, float] | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def metres(self) -> float:
        """What one of its lengths is, m."""
        return to_si(1.0, "length", self.length)

    def body(self, name: str) -> Body:
        """Return a body, made where there is none of that name."""
        return self.bodies.setdefault(name, Body())

    def pins(self) -> dict[str, list[str]]:
        """Return the bodies of each point that more than one body has."""
        result: dict[str, list[str]] = {}
        for name, body in self.bodies.items():
            for point in body.points:
                result.setdefault(point, []).append(name)
        return {point: names for point, names in result.items() if len(names) > 1}

    def size(self) -> float:
        """Return the largest extent of the drawing, or of a body of it."""
        extents = [0.0]
        for places in [list(b.points.values()) for b in self.bodies.values()]:
            for axis in (0, 1):
                values = [float(p[axis]) for p in places]
                extents.append(max(values, default=0.0) - min(values, default=0.0))
        return max(extents)

    def holders(self, point: str) -> list[str]:
        """Return the bodies that have a point."""
        return [name for name, body in self.bodies.items() if point in body.points]

    def leave(self, what: str, why: str) -> None:
        """Note what has no meaning here.

        >>> d = Drawing()
        >>> d.leave("slide radius of C7", "arcs have no joint here")
        >>> d.notes
        ['slide radius of C7: left out: arcs have no joint here']
        """
        self.notes.append(f"{what}: left out: {why}")

    def weld(self, names: Sequence[str]) -> None:
        """Fix bodies to the first of them."""
        self.welds += [(names[0], other) for other in names[1:]]

    def rename(self, new: Callable[[str], str]) -> None:
        """Give every body another name, wherever it is named beside its own place."""
        for s in self.slides:
            s.link, s.on = new(s.link), new(s.on)
        for m in self.meshes:
            m.a, m.b, m.arm = new(m.a), new(m.b), new(m.arm)
        for r in self.racks:
            r.gear = new(r.gear)
        for e in (*self.drives, *self.spare):
            e.link, e.on = e.link and new(e.link), new(e.on)
        for load in self.loads:
            load.ends = [(new(name), at) for name, at in load.ends]
        self.welds = [(new(p), new(q)) for p, q in self.welds]

    def ties(self) -> Iterator[tuple[tuple[str, ...], int]]:
        """Yield the bodies that each joint and input ties, and for how many joints it counts: an input holds its bodies.

        Shafts that share a place of the ground turn each on its own.
        """
        for names in self.pins().values():
            yield from [((GROUND, n), 1) for n in names] if GROUND in names else [(tuple(names), 1)]
        yield from (((s.link, s.on), 1) for s in self.slides)
        yield from (((m.a, m.b, m.arm), 1) for m in self.meshes)
        yield from (((r.gear, r.slide.link, r.slide.on), 1) for r in self.racks)
        yield from ((e.pair, 2) for e in self.drives)

    def guide(self, point: str, link: str, on: str, at: Place, angle: float, prism: bool = True) -> Slide:
        """Add a prism or a slot between two bodies that stand at angle 0; a point that `link` has there already serves."""
        name = self.point_at(link, at, point)
        self.body(on)
        self.slides.append(Slide(name, link, on, at, angle, -angle if prism else None))
        return self.slides[-1]

    def cylinder(self, names: tuple[str, str], ends: tuple[str, str], at: tuple[Place, Place]) -> Slide:
        """Add a cylinder and its rod, pinned at their far ends, the one sliding in the other."""
        barrel, rod = names
        self.body(barrel).points[ends[0]] = at[0]
        self.body(rod).points[ends[1]] = at[1]
        angle = direction(*at)
        self.slides.append(Slide(ends[1], rod, barrel, at[1], angle, -angle))
        return self.slides[-1]

    def point_at(self, body: str, at: Place, wanted: str) -> str:
        """Return a body's point at a place, by its name; made where it has none there."""
        held = self.body(body).points
        name = next((p for p, z in held.items() if z == at), None) or self.fresh(wanted)
        held[name] = at
        return name

    def moved(self, line: tuple[Place, Place], z: Place, what: str, point: str) -> None:
        """Note by how much a guide's line is moved to go through its point, where it misses it."""
        (a, b), length = line, apart(*line)
        off = float((b[0] - a[0]) * (z[1] - a[1]) - (b[1] - a[1]) * (z[0] - a[0])) / length
        if abs(off) > 1e3 * SAME * length:
            by = f"{abs(off):.3g} {self.length}"
            self.notes.append(f"{what}: its line is moved by {by} to go through {point}")

    def fresh(self, wanted: str) -> str:
        """Return a point's name that no body uses yet."""
        used = {p for body in self.bodies.values() for p in body.points}
        return unused(wanted, used)


def centers(d: Drawing, a: str, b: str) -> Iterator[tuple[str, str, str]]:
    """Yield what may be the centres of two gears: a pin of the one, a pin of the other, a body that turns about both."""
    pins = d.pins()
    for p, q in product(*(d.bodies.get(gear, Body()).points for gear in (a, b))):
        if p != q and p in pins and q in pins:
            first, second = (_turning_at(d, pins, point) for point in (p, q))
            yield from ((p, q, arm) for arm in first if arm in second and arm not in (a, b))


def _turning_at(d: Drawing, pins: dict[str, list[str]], point: str) -> list[str]:
    """Return the bodies that turn about a pin: those of other pins in the same place of one of its bodies too."""
    result = dict.fromkeys(pins[point])
    for body in pins[point]:
        held = d.bodies[body].points
        for other, names in pins.items():
            if other in held and held[other] == held[point]:
                result |= dict.fromkeys(names)
    return list(result)


def merge(d: Drawing, keep: str, gone: str) -> None:
    """Make two bodies one; both stand at the same angle."""
    if gone == GROUND:
        keep, gone = gone, keep
    a, b = d.bodies[keep], d.bodies.pop(gone)
    if keep != GROUND and b.mass > 0:
        total = a.mass + b.mass
        center = tuple(
            (exact(a.mass) * p + exact(b.mass) * q) / exact(total)
            for p, q in zip(a.center, b.center, strict=True)
        )
        both = (center[0], center[1])
        a.inertia += a.mass * apart(a.center, both) ** 2 + b.inertia + b.mass * apart(b.center, both) ** 2
        a.mass, a.center = total, both
    for point, at in b.points.items():
        a.points.setdefault(point, at)

    d.rename(lambda name: keep if name == gone else name)


def _rename_point(d: Drawing, old: str, new: str) -> None:
    for body in d.bodies.values():
        if old in body.points:
            at = body.points.pop(old)
            body.points.setdefault(new, at)
    for s in d.slides:
        s.point = new if s.point == old else s.point


def _one_pin_at_a_place(d: Drawing) -> bool:
    """Two joints of one body at the same place are one pin."""
    near = SAME * d.size()
    joints = set(d.pins()) | {s.point for s in d.slides}
    for body in d.bodies.values():
        held = [p for p in body.points if p in joints]
        for i, p in enumerate(held):
            for q in held[:i]:
                if apart(body.points[p], body.points[q]) <= near:
                    if body is d.bodies[GROUND]:
                        # two shafts in one place of the ground are not pinned to each other
                        continue
                    _rename_point(d, p, q)
                    return True
    return False


def _rigid_pair(d: Drawing) -> tuple[str, str] | None:
    """Return two bodies that share two pins at different places: they cannot move against each other."""
    near = SAME * d.size()
    met: dict[tuple[str, str], list[str]] = {}
    for point, names in d.pins().items():
        for i, b in enumerate(names):
            for a in names[:i]:
                met.setdefault((a, b), []).append(point)
    for (a, b), points in met.items():
        at = d.bodies[a].points
        if len(points) > 1 and any(apart(at[points[0]], at[p]) > near for p in points[1:]):
            return a, b
    return None


def settle(d: Drawing) -> list[Drawing]:
    """Return the mechanisms of a drawing: what is rigid is one body, what nothing drives or holds is left out."""
    for _ in range(len(d.welds)):
        a, b = d.welds.pop()
        if a != b and a in d.bodies and b in d.bodies:
            merge(d, a, b)
    while not d.own_axes:
        if _one_pin_at_a_place(d):
            continue
        pair = _rigid_pair(d)
        if pair is None:
            break
        merge(d, *pair)
        d.notes.append(f"{pair[1]} and {pair[0]} share two pins: they are one body")
    _drop_what_is_rigid(d)
    _drop_what_dangles(d)
    return _parts(d)


def _drop_what_is_rigid(d: Drawing) -> None:
    for s in [s for s in d.slides if s.link == s.on]:
        d.slides.remove(s)
        d.leave(f"slide at {s.point}", "both sides are one body")
    for m in [m for m in d.meshes if len({m.a, m.b, m.arm}) < 3]:
        d.meshes.remove(m)
        d.leave(f"gears {m.a}, {m.b}", "they are one body, or one is its own arm")
    slides = list(map(id, d.slides))
    for r in list(d.racks):
        # a wheel in a slot may roll along a rack
        held = (r.slide.on,) if r.slide.turned is None else (r.slide.on, r.slide.link)
        if id(r.slide) in slides and r.gear not in held:
            continue
        d.racks.remove(r)
        d.leave(f"rack at {r.slide.point}", "its wheel and its guide are one body")
    for e in list(d.drives):
        if (e.slide is not None and id(e.slide) not in slides) or (e.link is not None and e.link == e.on):
            d.drives.remove(e)
            d.leave(f"input {e.link or (e.slide and e.slide.point)}", "its two sides are one body")


def _drop_what_dangles(d: Drawing) -> None:
    """Leave out bodies that no joint holds, or one pin or slot alone that nothing drives."""
    while True:
        holds = dict.fromkeys(d.bodies, 0)
        for names, joints in d.ties():
            for name in names:
                holds[name] += joints
        gone = [name for name, n in holds.items() if n < 2 and name != GROUND]
        if not gone:
            return
        for name in gone:
            d.bodies.pop(name)
            alone = "one joint alone holds it, and nothing drives it"
            d.leave(name, alone if holds[name] else "it has no joint")
        d.slides = [s for s in d.slides if {s.link, s.on} <= d.bodies.keys()]
        d.racks = [r for r in d.racks if {r.gear, r.slide.link, r.slide.on} <= d.bodies.keys()]
        for load in [a for a in d.loads if not {name for name, _ in a.ends} <= d.bodies.keys()]:
            d.loads.remove(load)
            d.notes.append(f"load on {', '.join(name for name, _ in load.ends)}: left out with its link")


def _parts(d: Drawing) -> list[Drawing]:
    """Split into mechanisms that have nothing but the ground in common; what nothing drives is left out."""
    groups = Groups(d.bodies)
    for names in (*(names for names, _ in d.ties()), *(dict(load.ends) for load in d.loads)):
        groups.join(*(name for name in names if name != GROUND))
    parts = []
    for group in groups.all():
        drives = [e for e in d.drives if e.pair[0] in group]
        if drives:
            parts.append(_part(d, set(group), drives))
        elif group != [GROUND]:
            d.leave(", ".join(group), f"nothing drives {'it' if len(group) == 1 else 'them'}")
    return parts


def _part(d: Drawing, names: set[str], drives: list[Drive]) -> Drawing:
    bodies = {name: body for name, body in d.bodies.items() if name in names}
    slides = [s for s in d.slides if {s.link, s.on} & names]
    used = {p for body in bodies.values() for p in body.points} | {s.point for s in slides}
    ground = Body({p: at for p, at in d.bodies[GROUND].points.items() if p in used})
    return replace(
        d,
        bodies={GROUND: ground} | bodies,
        slides=slides,
        meshes=[m for m in d.meshes if m.a in names or m.b in names],
        racks=[r for r in d.racks if r.gear in names],
        drives=drives,
        spare=[e for e in d.spare if set(e.pair) <= {GROUND, *names}],
        loads=[load for load in d.loads if any(name in names for name, _ in load.ends)],
        notes=[],
    )
