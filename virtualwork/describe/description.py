"""A mechanism as its designer describes it: who is pinned, guided, geared, driven and loaded by what. Frozen, SI.

What it must not say is refused: unknown names, links of zero length, gears that are none. Nothing is solved here:
this is what the order of solution, the formulas and the studies work on.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from dalembert.arithmetic.records import Record, record
from dalembert.arithmetic.varied import heading, rotation
from virtualwork.describe import DescriptionError, known
from virtualwork.describe.parts import (
    GROUND,
    Force,
    Friction,
    Gear,
    Guess,
    Guide,
    Input,
    Link,
    Motor,
    Point,
    Rigid,
    Spring,
    Torque,
    TorsionSpring,
    as_point,
    as_points,
)

Bodies = Mapping[str, Mapping[str, complex]]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Description(Record):
    """The description of a planar mechanism; `virtualwork.Mechanism` is one that can also be asked.

    Raises
    ------
    DescriptionError
        Where names are unknown or sizes contradict each other; the message names the place.
    """

    ground: Mapping[str, complex]
    links: Mapping[str, Link]
    guides: tuple[Guide, ...] = ()
    gears: tuple[Gear, ...] = ()
    inputs: tuple[Input, ...] = ()
    guess: Guess = field(default_factory=Guess)
    name: str = ""
    gravity: complex = 0j
    forces: tuple[Force, ...] = ()
    torques: tuple[Torque, ...] = ()
    springs: tuple[Spring, ...] = ()
    torsion_springs: tuple[TorsionSpring, ...] = ()
    motors: tuple[Motor, ...] = ()
    friction: tuple[Friction, ...] = ()
    tolerances: Mapping[str, float] = field(default_factory=dict)

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
    ) -> None:
        values = {
            "ground": as_points(ground),
            "links": MappingProxyType(dict(links)),
            "guides": tuple(guides),
            "gears": tuple(gears),
            "inputs": (inputs,) if isinstance(inputs, Input) else tuple(inputs),
            "guess": guess or Guess(),
            "name": name,
            "gravity": as_point(gravity),
            "forces": tuple(forces),
            "torques": tuple(torques),
            "springs": tuple(springs),
            "torsion_springs": tuple(torsion_springs),
            "motors": tuple(motors),
            "friction": tuple(friction),
            "tolerances": MappingProxyType(dict(tolerances or {})),
        }
        for key, value in values.items():
            object.__setattr__(self, key, value)
        refuse(self)

    def __repr__(self) -> str:
        counts = ((len(self.links), "link"), (len(self.pins) + len(self.guides) + len(self.gears), "joint"))
        said = ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for n, what in counts)
        driven = ", ".join(e.name for e in self.inputs) or "nothing"
        return f"{type(self).__name__}({self.name!r}: {said}, driven: {driven})"

    @cached_property
    def size(self) -> float:
        """The characteristic length, m: the longest distance between two points of one link or of the ground.

        Every tolerance is relative to it.
        """
        return max(self.spans, default=0.0) or 1.0

    @property
    def spans(self) -> list[float]:
        """Distances of two points of one link or of the ground, and of guides from their bodies' axes, m."""
        spans = [abs(a - b) for body in self.bodies.values() for a in body.values() for b in body.values()]
        return spans + [abs(g.through) for g in self.guides if not isinstance(g.through, str)]

    @cached_property
    def bodies(self) -> Mapping[str, Mapping[str, complex]]:
        """The points of each body in its own axes; the ground comes first."""
        return {GROUND: self.ground} | {name: link.points for name, link in self.links.items()}

    @cached_property
    def points(self) -> Mapping[str, tuple[str, complex]]:
        """Each named point: the first body that has it, the ground before the links, and its place in that body's axes."""
        found: dict[str, tuple[str, complex]] = {}
        for body, points in self.bodies.items():
            for name, z in points.items():
                found.setdefault(name, (body, z))
        return found

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

        >>> arm = Description({"O": 0j}, {"arm": Link({"O": 0j, "P": 1}, mass=2, center=0.25, inertia=0.1)},
        ...                   motors=[Motor("arm", "tool", mass=1, center=1)])
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

    def guide_of(self, entry: Input) -> int:
        """The guide along which a slide input drives."""
        return next(i for i, guide in enumerate(self.guides) if guide.point == entry.slider)

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


def known_by_guess(m: Description) -> tuple[dict[str, float], dict[str, complex]]:
    """Rough link angles and point positions from the guess, the ground and the inputs, as far as they reach."""
    angles = dict(m.guess.angles)
    points = dict(m.ground) | dict(m.guess.points)
    for j, e in enumerate(m.inputs):
        if e.link is not None and e.on == GROUND:
            angles[e.link] = m.at[j]
    for g in m.guides:
        if g.turned is not None and g.on == GROUND:
            angles.setdefault(g.link, g.angle + g.turned)
        if g.turned is not None and g.link == GROUND:
            angles.setdefault(g.on, -(g.angle + g.turned))
    before = -1
    while len(angles) + len(points) > before:
        before = len(angles) + len(points)
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
        _link(name, link, m.pins, {g.point for g in m.guides if g.link == name})
    for i, guide in enumerate(m.guides, 1):
        _guide(f"[[{'sliders' if guide.is_slider else 'slots'}]] {i} ({guide.point})", guide, m.bodies)
    for i, gear in enumerate(m.gears, 1):
        for body in (*gear.links, gear.arm):
            known(body, m.bodies, f"[[gears]] {i}", "link")
        if gear.ratio == 0 or len({*gear.links, gear.arm}) < 3:
            raise DescriptionError(
                f"[[gears]] {i}: expected two links, an arm that is neither, and a ratio other than 0"
            )
    for i, entry in enumerate(m.inputs, 1):
        _input("[input]" if len(m.inputs) == 1 else f"[[input]] {i}", entry, m)
    if m.guess.at is not None and len(m.guess.at) != len(m.inputs):
        raise DescriptionError(
            f"[guess] at: found {len(m.guess.at)} values, expected one for each of {len(m.inputs)} inputs"
        )
    for name in m.guess.angles:
        known(name, m.links, f"[guess] {name}", "link or point")
    loads: Mapping[str, Sequence[Force | Torque]] = {"forces": m.forces, "torques": m.torques}
    for table, entries in loads.items():
        for i, load in enumerate(entries, 1):
            known(load.link, m.links, f"[[{table}]] {i} link", "link")
            if isinstance(load, Force) and isinstance(load.point, str):
                what = f"point of link {load.link}"
                known(load.point, m.bodies[load.link], f"[[{table}]] {i} point", what)
    for i, spring in enumerate(m.springs, 1):
        for body, point in spring.between:
            known(body, m.bodies, f"[[springs]] {i} between", "link")
            if isinstance(point, str):
                known(point, m.bodies[body], f"[[springs]] {i} between", f"point of {body}")


def _link(name: str, link: Link, pins: Collection[str], guided: Collection[str]) -> None:
    seen: dict[complex, str] = {}
    for point, z in link.points.items():
        if not (abs(z) < float("inf")):
            raise DescriptionError(f"[links.{name}] points.{point}: found {z}, expected finite coordinates")
        shared = point in pins or point in guided
        if z in seen and shared and seen[z] in pins:
            raise DescriptionError(
                f"[links.{name}] points: {seen[z]} and {point} are both joints at the same place: "
                "a link of zero length; pin the links at one point name instead"
            )
        if shared:
            seen[z] = point
    if link.mass < 0 or link.inertia < 0:
        raise DescriptionError(f"[links.{name}]: mass and inertia must not be negative")


def _guide(where: str, guide: Guide, bodies: Bodies) -> None:
    known(guide.link, bodies, where + " link", "link")
    known(guide.on, bodies, where + " on", "link")
    owner = GROUND if guide.link == GROUND else f"link {guide.link}"
    known(guide.point, bodies[guide.link], where + " point", f"point of {owner}")
    if isinstance(guide.through, str):
        known(guide.through, bodies[guide.on], where + " through", f"point of {guide.on}")
    if guide.link == guide.on:
        raise DescriptionError(f"{where}: link '{guide.link}' cannot be guided by itself")


def _input(where: str, entry: Input, m: Description) -> None:
    names = [guide.point for guide in m.guides]
    if (entry.link is None) == (entry.slider is None):
        raise DescriptionError(f"{where}: expected either a link or a slider")
    if entry.slider is None:
        known(entry.link, m.links, where + " link", "link")
        known(entry.on, m.bodies, where + " on", "link")
        return
    known(entry.slider, names, where + " slider", "slot or slider")
    if names.count(entry.slider) > 1:
        raise DescriptionError(f"{where} slider: '{entry.slider}' runs in more than one guide")
