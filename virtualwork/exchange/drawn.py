"""A planar mechanism in one pose: bodies, joints and inputs. Importers fill it; what robots and drawings export is read from its bodies.

A pin is a point that several bodies have by the same name.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import product
from typing import Generic, TypeVar

from dalembert.documents.values import exact
from dalembert.units import to_si
from virtualwork.describe.parts import GROUND as GROUND
from virtualwork.describe.parts import Gear, Guide, Rack
from virtualwork.exchange.places import ORIGIN, Exact, apart, coordinates, direction

# places nearer than this share of the drawing's size are one place
SAME = 1e-9
Thing = TypeVar("Thing", bound=Hashable)


def together(parts: Sequence[tuple[float, complex, float]]) -> tuple[float, complex, float]:
    """Return mass, centre and moment of inertia of several masses as one body (Huygens-Steiner)."""
    heavy = [part for part in parts if part[0] != 0]
    if len(heavy) <= 1:
        # wheels on fixed axles may have a moment of inertia and no mass
        mass, center, _ = heavy[0] if heavy else parts[0]
        return mass, center, math.fsum(i for _, _, i in parts)
    mass = math.fsum(m for m, _, _ in heavy)
    x, y = (sum(exact(m) * coordinates(c)[k] for m, c, _ in heavy) / exact(mass) for k in (0, 1))
    center = Exact(Fraction(x), Fraction(y))
    return mass, center, math.fsum(i + m * apart(c, center) ** 2 for m, c, i in parts)


@dataclass
class Body:
    """A rigid body: named points, mass, centre and moment of inertia in its own axes; where these axes stand in the pose."""

    points: dict[str, complex] = field(default_factory=dict)
    at: complex = ORIGIN
    turn: float = 0.0
    mass: float = 0.0
    center: complex = ORIGIN
    inertia: float = 0.0

    def world(self, z: complex) -> complex:
        """Return a place of its axes in those of the ground."""
        return self.at + z * cmath.rect(1.0, self.turn)

    def inside(self, z: complex) -> complex:
        """Return a place of the ground in its axes."""
        return (z - self.at) * cmath.rect(1.0, -self.turn)


@dataclass
class Drive:
    """An input: the angle of `link` against `on`, or the way along a guide; `at` in the pose, `speed` as TOML has it."""

    link: str | None = None
    on: str = GROUND
    slider: str | None = None
    at: float = 0.0
    speed: str | float | None = None

    @property
    def moves(self) -> object:
        """The pair or the guide that it moves: equal for inputs that move the same."""
        return frozenset((self.link, self.on)) if self.slider is None else self.slider


@dataclass
class Load:
    """A force, torque or spring: its table, the bodies on which it acts, and its values as in TOML.

    `ends` are the places (body, place in its axes); values that are places of a body stand there and nowhere else.
    """

    table: str
    ends: list[tuple[str, complex | None]]
    values: dict[str, object]


@dataclass
class Drawing:
    """One mechanism of a file, in the file's units."""

    name: str = ""
    length: str = "m"
    angle: str = "deg"
    posed: bool = True
    """True: it stands as it is drawn; False: its angles are unknown."""
    own_axes: bool = False
    """Each body's points are in axes of its own, which the file gives; False: in the ground's, as they are drawn."""
    bodies: dict[str, Body] = field(default_factory=lambda: {GROUND: Body()})
    guides: dict[str, Guide] = field(default_factory=dict)
    """By the names that racks and inputs have for them: guides may share a point until they are written."""
    gears: list[Gear] = field(default_factory=list)
    racks: list[Rack] = field(default_factory=list)
    drives: list[Drive] = field(default_factory=list)
    spare: list[Drive] = field(default_factory=list)
    """Further inputs, taken where `drives` leave the mechanism free: robot files may name too few or too many."""
    loads: list[Load] = field(default_factory=list)
    welds: list[tuple[str, str]] = field(default_factory=list)
    gravity: tuple[float, float] | None = None
    notes: list[str] = field(default_factory=list)
    refused: str = ""
    """Why its description has no motion; empty where it moves."""

    @property
    def metres(self) -> float:
        """The length that the number 1 means, m."""
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
            for values in ([z.real for z in places], [z.imag for z in places]):
                extents.append(max(values, default=0.0) - min(values, default=0.0))
        return max(extents)

    def holders(self, point: str) -> list[str]:
        """Return the bodies that have a point."""
        return [name for name, body in self.bodies.items() if point in body.points]

    def leave(self, what: str, why: str) -> None:
        """Note what is left out, and why.

        >>> d = Drawing()
        >>> d.leave("slide radius of C7", "there is no joint on an arc")
        >>> d.notes
        ['slide radius of C7: left out: there is no joint on an arc']
        """
        self.notes.append(f"{what}: left out: {why}")

    def weld(self, names: Sequence[str]) -> None:
        """Fix bodies to the first of them."""
        self.welds += [(names[0], other) for other in names[1:]]

    def rename(self, new: Callable[[str], str]) -> None:
        """Give bodies other names, wherever joints, inputs and loads name them."""
        for k, s in self.guides.items():
            if (ends := (new(s.link), new(s.on))) != (s.link, s.on):
                self.guides[k] = Guide(s.point, *ends, s.through, s.angle, s.turned)
        self.gears = [renamed(g, new) for g in self.gears]
        self.racks = [replace(r, gear=new(r.gear)) for r in self.racks]
        for e in (*self.drives, *self.spare):
            e.link, e.on = e.link and new(e.link), new(e.on)
        for load in self.loads:
            load.ends = [(new(name), at) for name, at in load.ends]
        self.welds = [(new(p), new(q)) for p, q in self.welds]

    def pair(self, e: Drive) -> tuple[str, str]:
        """Return the two bodies that an input moves against each other, that which moves first."""
        if e.slider is None:
            return str(e.link), e.on
        s = self.guides[e.slider]
        return (s.link, s.on) if s.link != GROUND else (s.on, s.link)

    def ties(self) -> Iterator[tuple[tuple[str, ...], int]]:
        """Yield the bodies that each joint and input ties, and for how many joints it counts: an input holds its bodies.

        Shafts that share a place of the ground turn each on its own.
        """
        for names in self.pins().values():
            yield from [((GROUND, n), 1) for n in names] if GROUND in names else [(tuple(names), 1)]
        yield from (((s.link, s.on), 1) for s in self.guides.values())
        yield from (((*g.links, g.arm), 1) for g in self.gears)
        rolling = ((r.gear, self.guides[r.slider]) for r in self.racks)
        yield from (((gear, s.link, s.on), 1) for gear, s in rolling)
        yield from ((self.pair(e), 2) for e in self.drives)

    def add(self, guide: Guide) -> str:
        """Add a guide; return the name that racks and inputs have for it."""
        name = unused(guide.point, self.guides)
        self.guides[name] = guide
        return name

    def guide(self, point: str, link: str, on: str, at: complex, angle: float, prism: bool = True) -> str:
        """Add a prism or a slot between two bodies that stand at angle 0; a point that `link` has there already serves."""
        name = self.point_at(link, at, point)
        self.body(on)
        return self.add(Guide(name, link, on, at, angle, -angle if prism else None))

    def cylinder(self, names: tuple[str, str], ends: tuple[str, str], at: tuple[Exact, Exact]) -> str:
        """Add a cylinder and its rod, pinned at their far ends, the one sliding in the other."""
        barrel, rod = names
        self.body(barrel).points[ends[0]] = at[0]
        self.body(rod).points[ends[1]] = at[1]
        angle = direction(*at)
        return self.add(Guide(ends[1], rod, barrel, at[1], angle, -angle))

    def point_at(self, body: str, at: complex, wanted: str) -> str:
        """Return a body's point at a place, by its name; made where it has none there."""
        held = self.body(body).points
        name = next((p for p, z in held.items() if z == at), None) or self.fresh(wanted)
        held[name] = at
        return name

    def moved(self, line: tuple[Exact, Exact], z: Exact, what: str, point: str) -> None:
        """Note by how much a guide's line is moved to go through its point, where it misses it."""
        (a, b), length = line, apart(*line)
        off = float((b.x - a.x) * (z.y - a.y) - (b.y - a.y) * (z.x - a.x)) / length
        if abs(off) > 1e3 * SAME * length:
            by = f"{abs(off):.3g} {self.length}"
            self.notes.append(f"{what}: its line is moved by {by} to pass through {point}")

    def fresh(self, wanted: str) -> str:
        """Return a point's name that no body uses yet."""
        used = {p for body in self.bodies.values() for p in body.points}
        return unused(wanted, used)


def renamed(gear: Gear, new: Callable[[str], str]) -> Gear:
    """Return a gear of the same links by other names."""
    first, second = map(new, gear.links)
    return replace(gear, links=(first, second), arm=new(gear.arm))


def pins_of(
    joints: Iterable[tuple[str, dict[str, complex]]], near: float, name: Callable[[str, str], str]
) -> list[tuple[str, dict[str, complex]]]:
    """Return the pins of joints, each its name and its place on its bodies: joints that meet in one place of a body are one pin.

    Parameters
    ----------
    joints : iterable of (name, {body: place})
    near : float
        Places of a body no farther apart than this are one.
    name : callable
        Chooses the name of a pin among that of a joint and of the pin that it joins.

    Examples
    --------
    >>> pins_of([("A", {"a": 0j, "b": 1j}), ("B", {"b": 1j, "c": 0j})], 0.0, min)
    [('A', {'b': 1j, 'c': 0j, 'a': 0j})]
    """
    pins: list[tuple[str, dict[str, complex]]] = []
    for label, ends in joints:
        for pin in [e for e in pins if any(b in e[1] and abs(e[1][b] - z) <= near for b, z in ends.items())]:
            pins.remove(pin)
            label, ends = name(label, pin[0]), ends | pin[1]
        pins.append((label, ends))
    names: list[str] = []
    for label, _ in pins:
        names.append(unused(label, names))
    return list(zip(names, (ends for _, ends in pins), strict=True))


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


def unused(wanted: str, used: Iterable[str], between: str = "_") -> str:
    """Return a name that is not used: the wanted one, or that with a number.

    >>> unused("B", {"B", "B_2"})
    'B_3'
    """
    used, name, k = set(used), wanted, 1
    while name in used:
        k += 1
        name = f"{wanted}{between}{k}"
    return name


class Groups(Generic[Thing]):
    """Things joined into groups; each group has the name of one of its things.

    >>> groups = Groups("abcd")
    >>> groups.join("b", "a", "d"), groups.join("d", "a")
    (True, False)
    >>> groups.of("a"), groups.all()
    ('b', [['a', 'b', 'd'], ['c']])
    """

    def __init__(self, names: Iterable[Thing]) -> None:
        self._above = {name: name for name in names}

    def of(self, name: Thing) -> Thing:
        """Return what the group of a thing is called."""
        while self._above[name] != name:
            name = self._above[name]
        return name

    def join(self, *names: Thing) -> bool:
        """Join the groups of things under the name of the first's; return whether they were several."""
        groups = [self.of(name) for name in names]
        self._above |= dict.fromkeys(groups, groups[0]) if groups else {}
        return len(set(groups)) > 1

    def all(self) -> list[list[Thing]]:
        """Return the groups, in the order in which their first things were named."""
        result: dict[Thing, list[Thing]] = {}
        for name in self._above:
            result.setdefault(self.of(name), []).append(name)
        return list(result.values())
