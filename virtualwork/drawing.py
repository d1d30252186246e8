"""The drawing of a mechanism: lines and circles in the axes of its bodies, springs between two of them, names.

Every picture walks this one list, from the back to the front: on paper, in a page that moves, in a drawing for a CAD
program. A shape's `role` says what it is, and with it which line or layer it gets; `ROLES` lists them. Where a body
stands is a motion's matter: a shape at a pose is its points carried along by its body.

>>> from virtualwork.describe.parts import Input, Link
>>> crank = Description({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
>>> [(shape.role, shape.body) for shape in draw(crank).shapes if shape.role in ("link", "pin", "tip")]
[('link', 'crank'), ('pin', 'ground'), ('tip', 'crank')]
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from math import isfinite, pi

from dalembert.arithmetic.varied import heading, root, rotation
from virtualwork.describe.cams import CamDrive
from virtualwork.describe.description import Description
from virtualwork.describe.meshes import Belt, Gear, Rack
from virtualwork.describe.parts import GROUND, Guide, Spring
from virtualwork.describe.values import joined
from virtualwork.formulas.profiles import STEPS, profile
from virtualwork.shapes import Circle as Circle
from virtualwork.shapes import Coil as Coil
from virtualwork.shapes import Line as Line
from virtualwork.shapes import Row as Row
from virtualwork.shapes import Shape as Shape

ROLES = {
    "rail": "the walls of a guide in the ground",
    "hatch": "what marks the ground as fixed",
    "frame": "the foot of a fixed pivot",
    "link": "a link: a bar, or the hull of its points, its slots and its centre of mass",
    "wheel": "the pitch circle of a gear, or of a belt's pulley",
    "belt": "a belt or a chain where it runs between its wheels",
    "rack": "the pitch line of a rack, with its teeth",
    "cam": "the profile of a cam",
    "roller": "a follower's roller, or its flat face",
    "spoke": "a mark that shows how a wheel turns",
    "slot": "the outline of a slot",
    "block": "the block of a slider",
    "spring": "a spring",
    "mass": "a centre of mass",
    "pin": "a pin or a slot's point",
    "tip": "a named point without a joint",
}

SYMBOL = 0.016
"""The radius of a pin, of the size of the mechanism."""
TOOTH = ((0.1, -1.0), (0.4, 1.0), (0.6, 1.0), (0.9, -1.0))
"""The outline of a tooth: along the rack, of the tooth's length, and across, of half its height."""
UNKNOWN_TRAVEL = 0.2
"""The drawn length of a guide whose use is unknown, either way, in sizes of the mechanism."""


@dataclass(frozen=True)
class Label:
    """A name and where it stands, in the axes of its body; `of` is "point" or "link"."""

    of: str
    body: str
    at: complex
    text: str


def standing(shape: Shape, at: Callable[[str, complex], complex], unit: float = 1.0) -> Line | Circle:
    """Return a shape where its bodies stand, in the ground's axes and in a unit of this number of metres: a spring as its line.

    `at` returns where a place of a body stands, m.
    """
    if isinstance(shape, Circle):
        return Circle(shape.role, GROUND, at(shape.body, shape.centre) / unit, shape.radius / unit)
    if isinstance(shape, Coil):
        points: Iterable[complex] = shape.along(*(at(*end) for end in shape.ends))
    else:
        points = (at(shape.body, z) for z in shape.points)
    return Line(shape.role, GROUND, tuple(z / unit for z in points), isinstance(shape, Line) and shape.closed)


@dataclass(frozen=True)
class Drawing:
    """The shapes of a mechanism from the back to the front, and its names.

    Attributes
    ----------
    parts : tuple of Shape or Row
        From the back to the front.
    symbol : float
        The radius of a pin, m: the measure of every symbol.
    """

    parts: tuple[Shape | Row, ...]
    labels: tuple[Label, ...]
    symbol: float

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """The shapes, with every line of a row on its own."""
        rows = (part.lines() if isinstance(part, Row) else (part,) for part in self.parts)
        return tuple(chain.from_iterable(rows))


def draw(
    mechanism: Description, travel: Sequence[tuple[float, float]] = (), cam_steps: int = STEPS
) -> Drawing:
    """Return what a mechanism is drawn as.

    Parameters
    ----------
    travel : sequence of (least, largest)
        Of each guide, m: over which slides it is drawn. Default, and where NaN: some way about its `through`; of a guide
        that is hardly used some way about its block or pin.
    cam_steps : int
        Points of a cam's profile.
    """
    # symbols keep their size where the dimensions vary
    size = complex(mechanism.size).real
    s, reach = SYMBOL * size, UNKNOWN_TRAVEL * size
    spans = [_long_enough(span, reach, s) for span in (travel or [(-reach, reach)] * len(mechanism.guides))]
    guides = list(zip(mechanism.guides, spans, strict=True))
    meshes = [
        *(_wheels(mechanism, gear) for gear in mechanism.gears),
        *(_pulleys(mechanism, belt) for belt in mechanism.belts),
        *(_pinion(mechanism, rack) for rack in mechanism.racks),
    ]
    wheels = list(dict.fromkeys(chain.from_iterable(meshes)))
    slots = {
        name: [span for span in guides if span[0].on == name and not span[0].is_slider]
        for name in mechanism.bodies
    }
    # a slot hides its own link, and lies under the links that run in it
    order = [GROUND, *sorted(mechanism.links, key=lambda name: not slots[name])]
    layers: list[Iterable[Shape | Row]] = [
        *(_in_ground(mechanism, guide, span, s) for guide, span in guides),
        *(_foot(z, s) for name, z in mechanism.ground.items() if name in mechanism.pins),
    ]
    for name in order:
        layers += [_link(mechanism, name, guides, wheels, s)] if name != GROUND else []
        layers += [_slot(mechanism, guide, span, s) for guide, span in slots[name]]
    layers += [
        *(_belt(mechanism, belt) for belt in mechanism.belts),
        wheels,
        *(_teeth(mechanism, rack, spans[mechanism.guide_at(rack.slider)], s) for rack in mechanism.racks),
        [
            Line("spoke", w.body, (w.centre, w.centre + w.radius))
            for w in wheels
            if w.body != GROUND and len(mechanism.bodies[w.body]) < 2
        ],
        *(_cam(mechanism, drive, cam_steps) for drive in mechanism.cam_drives),
        *(_block(mechanism, guide, s) for guide, _ in guides if guide.is_slider),
        *(_touching(mechanism, drive) for drive in mechanism.cam_drives),
        (_coil(mechanism, spring, s) for spring in mechanism.springs),
        *(_mass(body, own.center, s) for body, own in mechanism.rigid.items() if complex(own.mass)),
        _points(mechanism, s),
    ]
    return Drawing(tuple(chain.from_iterable(layers)), tuple(_labels(mechanism)), s)


def tracers(mechanism: Description) -> list[str]:
    """Return the points whose paths are of interest: those of a link alone, that no joint holds.

    A fixed pin in a moving slot is the ground's; the point of any other guide runs along a line that is drawn.
    """
    held = {*mechanism.ground, *mechanism.pins, *(guide.point for guide in mechanism.guides)}
    return [name for name in mechanism.points if name not in held]


def _long_enough(span: tuple[float, float], reach: float, s: float) -> tuple[float, float]:
    """Return over what to draw a guide: some way about its block or pin where it is hardly used, as in a single pose."""
    low, high = span if all(map(isfinite, span)) else (0.0, 0.0)
    middle = (low + high) / 2
    return (low, high) if high - low > 4 * s else (middle - reach, middle + reach)


def _coil(mechanism: Description, spring: Spring, s: float) -> Coil:
    a, b = ((body, mechanism.place(body, point)) for body, point in spring.between)
    return Coil((a, b), 1.6 * s)


def _ends(mechanism: Description, guide: Guide, span: tuple[float, float], beyond: float) -> list[complex]:
    """Return the ends of a guide's line, in the axes of the body that carries it."""
    along = rotation(guide.angle)
    start = mechanism.through(guide)
    return [start + (span[0] - beyond) * along, start + (span[1] + beyond) * along]


def _in_ground(
    mechanism: Description, guide: Guide, span: tuple[float, float], s: float
) -> Iterator[Shape | Row]:
    """The walls along which a block of the ground's own guide slides."""
    if guide.on != GROUND or not guide.is_slider:
        return
    low, high = _ends(mechanism, guide, span, 4 * s)
    along = rotation(guide.angle)
    for side in (2, -2):
        wall = (low + side * 1j * s * along, high + side * 1j * s * along)
        yield Line("rail", GROUND, wall)
        yield _hatched(*wall, s * side / 2)


def _hatched(start: complex, end: complex, depth: float) -> Row:
    """Short strokes to the left of a line (to the right where the depth is negative)."""
    count = max(2, round(abs(complex(end - start)) / (1.8 * abs(depth))))
    way = (end - start) / count
    along = way / abs(way) if way else 1
    first = start + 0.7 * way
    return Row("hatch", GROUND, (first, first + (1j * depth - 0.7 * abs(depth)) * along), way, count)


def _foot(z: complex, s: float) -> Iterator[Shape | Row]:
    left, right = z + (-1.9 - 3.2j) * s, z + (1.9 - 3.2j) * s
    yield Line("frame", GROUND, (z, left, right), closed=True)
    yield Line("frame", GROUND, (left - 0.9 * s, right + 0.9 * s))
    yield _hatched(left - 0.9 * s, right + 0.9 * s, -s)


def _link(
    mechanism: Description,
    name: str,
    guides: list[tuple[Guide, tuple[float, float]]],
    wheels: list[Circle],
    s: float,
) -> Iterator[Shape]:
    """The hull of a link's points and of the guides that it carries; a bar where they are on one line."""
    points = list(mechanism.links[name].points.values())
    for guide, span in guides:
        if guide.on == name:
            points += _ends(mechanism, guide, span, 3 * s)
    own = mechanism.rigid[name]
    if len(points) == 1 and complex(own.mass):
        points.append(own.center)
    outline = hull(points)
    if len(outline) > 1:
        yield Line("link", name, outline, closed=len(outline) > 2)
    elif name not in {w.body for w in wheels} | {cam.cam for cam in mechanism.cams} and not any(
        name == g.link and g.is_slider for g, _ in guides
    ):
        yield Circle("link", name, outline[0], 3 * s)


def hull(points: Iterable[complex]) -> tuple[complex, ...]:
    """Return the convex hull, counter-clockwise (Andrew's chain); two points where all lie on one line.

    >>> hull([0j, 1 + 0j, 1 + 1j, 1j, 0.5 + 0.5j])
    (0j, (1+0j), (1+1j), 1j)
    >>> hull([0j, 2 + 0j, 1 + 0j])
    (0j, (2+0j))
    """
    # numbers that vary stay what they are: which of them are corners is decided by their own values
    own = {complex(z): z for z in points}
    return tuple(own[z] for z in _corners(sorted(own, key=lambda z: (z.real, z.imag))))


def _corners(ordered: list[complex]) -> Sequence[complex]:
    if len(ordered) < 3:
        return ordered
    width = abs(ordered[-1] - ordered[0])

    def chain_of(line: Iterable[complex]) -> list[complex]:
        corners: list[complex] = []
        for z in line:
            # what turns left by less than rounding lies on the line
            while len(corners) > 1 and _turn(corners[-2], corners[-1], z) <= 1e-9 * width * abs(
                z - corners[-2]
            ):
                corners.pop()
            corners.append(z)
        return corners[:-1]

    return (*chain_of(ordered), *chain_of(reversed(ordered)))


def _turn(a: complex, b: complex, c: complex) -> float:
    return ((b - a).conjugate() * (c - b)).imag


def _wheels(mechanism: Description, gear: Gear) -> Iterator[Circle]:
    """The pitch circles of two wheels on an arm: r_a / r_b = |ratio|, their sum (outside) or difference (inside) the arm.

    None where the wheels share their axis, or where the links turn alike.
    """
    arm = mechanism.bodies[gear.arm]
    axes = [_axis(mechanism, body, gear.arm) for body in gear.links]
    if complex(gear.ratio) == 1 or gear.arm in gear.links or "" in axes or axes[0] == axes[1]:
        return
    second = abs(arm[axes[1]] - arm[axes[0]]) / abs(1 - gear.ratio)
    for body, axis, radius in zip(gear.links, axes, (abs(gear.ratio) * second, second), strict=True):
        yield Circle("wheel", body, mechanism.bodies[body][axis], radius)


def _pulleys(mechanism: Description, belt: Belt) -> Iterator[Circle]:
    """The wheels of a belt, where they turn on pins of the body that carries both."""
    axes = [_axis(mechanism, body, belt.arm) for body in belt.links]
    if all(axes):
        for body, axis, radius in zip(belt.links, axes, belt.radii, strict=True):
            yield Circle("wheel", body, mechanism.bodies[body][axis], radius)


def _belt(mechanism: Description, belt: Belt) -> Iterator[Line]:
    """A belt: tangents of its wheels, and around them, in the axes of the body that carries both."""
    axes = [_axis(mechanism, body, belt.arm) for body in belt.links]
    if not all(axes):
        return
    here, there = (mechanism.bodies[belt.arm][axis] for axis in axes)
    (first, second), way = belt.radii, there - here
    side = -1 if belt.crossed else 1
    if abs(way) <= abs(first - side * second):
        # the one stands inside the other
        return
    # from the line of centres to where the belt touches
    share = (first - side * second) / abs(way)
    touch = heading(joined(share, root(1 - share * share)))
    along = way / abs(way)
    behind, ahead = 2 * pi - 2 * touch, 2 * touch if side > 0 else 2 * pi - 2 * touch
    start = touch if side > 0 else touch - pi
    around = [there + second * along * rotation(start - side * ahead * (k / 24)) for k in range(25)]
    back = [here + first * along * rotation(-(touch + behind * (k / 24))) for k in range(25)]
    yield Line("belt", belt.arm, (*around, *back), closed=True)


def _pinion(mechanism: Description, rack: Rack) -> Iterator[Circle]:
    """The wheel of a rack, about its pin on the body that carries the rack's guide, or about its own guided point."""
    guide = mechanism.guides[mechanism.guide_at(rack.slider)]
    axis = guide.point if guide.link == rack.gear else _axis(mechanism, rack.gear, guide.on)
    if axis:
        yield Circle("wheel", rack.gear, mechanism.bodies[rack.gear][axis], abs(rack.radius))


def _teeth(mechanism: Description, rack: Rack, span: tuple[float, float], s: float) -> Iterator[Row]:
    """The pitch line of a rack with its teeth, as long as its wheel rolls on it."""
    guide = mechanism.guides[mechanism.guide_at(rack.slider)]
    d, start = rotation(guide.angle), mechanism.through(guide)
    low, high = span[0] - 4 * s, span[1] + 4 * s
    if guide.link == rack.gear:
        # the wheel rolls: its rack is of the body that carries the slot
        body, origin, along = guide.on, start + 1j * rack.radius * d, d
        depth = -1j * rack.radius * d
    else:
        axis = _axis(mechanism, rack.gear, guide.on)
        if not axis or guide.turned is None:
            return
        back = rotation(-(guide.angle + guide.turned))
        touch = mechanism.bodies[guide.on][axis] - 1j * rack.radius * d - start
        body, along = guide.link, d * back
        origin = mechanism.bodies[guide.link][guide.point] + touch * back
        # as far as the guided point, too
        point = -(touch * d.conjugate()).real
        low, high = min(-high, point), max(-low, point)
        depth = 1j * rack.radius * along
    tooth = max(s, 0.06 * abs(rack.radius))
    depth *= 0.7 * tooth / abs(rack.radius)
    count = min(60, max(4, round(complex((high - low) / (2.4 * tooth)).real)))
    step = (high - low) / count
    first = tuple(origin + (low + step * x) * along + y * depth for x, y in TOOTH)
    yield Row("rack", body, first, step * along, count, joined=True)


def _axis(mechanism: Description, body: str, arm: str) -> str:
    """The pin on which a wheel turns on the body that carries it; empty where there is none."""
    return next((p for p in mechanism.bodies[body] if p in mechanism.bodies[arm]), "")


def _cam(mechanism: Description, drive: CamDrive, steps: int) -> Iterator[Shape]:
    """The profile of a cam."""
    points = profile(mechanism, drive, steps)
    yield Line("cam", drive.cam.cam, tuple(point.profile for point in points), closed=True)


def _touching(mechanism: Description, drive: CamDrive) -> Iterator[Shape]:
    """A follower's roller, or its flat face as far as it touches."""
    cam = drive.cam
    body, name, along = str(cam.follower), str(cam.point), 1 + 0j
    if drive.guide is not None:
        guide = mechanism.guides[drive.guide]
        body, name, along = guide.link, guide.point, 1j * rotation(-(guide.turned or 0.0))
    trace = mechanism.bodies[body][name]
    if cam.face == "roller":
        yield Circle("roller", body, trace, cam.roller)
    elif cam.face == "flat":
        offsets = [point.offset for point in profile(mechanism, drive)]
        offsets = sorted(offsets, key=lambda x: complex(x).real)
        edge = 0.15 * cam.base_radius
        yield Line(
            "roller", body, (trace + (offsets[0] - edge) * along, trace + (offsets[-1] + edge) * along)
        )


def _slot(mechanism: Description, guide: Guide, span: tuple[float, float], s: float) -> Iterator[Shape]:
    """The rounded outline of a slot, as wide as its pin."""
    low, high = _ends(mechanism, guide, span, 0)
    along = 1.35 * s * rotation(guide.angle)
    round_ = [cmath.exp(1j * (pi / 2 + pi * k / 8)) for k in range(9)]
    outline = [*(low + along * turn for turn in round_), *(high - along * turn for turn in round_)]
    yield Line("slot", guide.on, tuple(outline), closed=True)


def _block(mechanism: Description, guide: Guide, s: float) -> Iterator[Shape]:
    centre = mechanism.bodies[guide.link][guide.point]
    along = s * rotation(-(guide.turned or 0.0))
    corners = tuple(centre + along * corner for corner in (-3.2 - 2j, 3.2 - 2j, 3.2 + 2j, -3.2 + 2j))
    yield Line("block", guide.link, corners, closed=True)


def _mass(body: str, centre: complex, s: float) -> Iterator[Shape]:
    yield Circle("mass", body, centre, 0.9 * s)
    for way in (0.9, 0.9j):
        yield Line("mass", body, (centre - way * s, centre + way * s))


def _points(mechanism: Description, s: float) -> Iterator[Circle]:
    jointed = {*mechanism.pins, *(guide.point for guide in mechanism.guides)}
    for name, (body, z) in mechanism.points.items():
        yield Circle("pin", body, z, s) if name in jointed else Circle("tip", body, z, 0.6 * s)


def _labels(mechanism: Description) -> Iterator[Label]:
    yield from (Label("point", body, z, name) for name, (body, z) in mechanism.points.items())
    for name, link in mechanism.links.items():
        yield Label("link", name, sum(link.points.values()) / len(link.points), name)
