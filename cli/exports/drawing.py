"""A mechanism as strokes on layers, in the unit of its file: links, joints, ground, guides, curves, names."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cli.exports.outline import outline
from cli.exports.skeleton import Skeleton
from cli.exports.travel import Travel
from virtualwork.describe.parts import GROUND
from virtualwork.motion import SlideMotion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Complexes = NDArray[np.complex128]

# layer -> its colour, as a number of DXF and for the web
LAYERS = {
    "LINKS": (5, "#1f4fd8"),
    "JOINTS": (7, "#000000"),
    "GROUND": (8, "#777777"),
    "GUIDES": (3, "#1c8a3c"),
    "CURVES": (1, "#c62828"),
    "NAMES": (9, "#555555"),
}
# of the mechanism's size: radius of a pin, height of a name
PIN, NAME = 0.012, 0.025


@dataclass(frozen=True)
class Line:
    """A run of strokes, (n,) places; closed where the last leads to the first."""

    layer: str
    places: list[complex]
    closed: bool = False


@dataclass(frozen=True)
class Circle:
    """A circle."""

    layer: str
    center: complex
    radius: float


@dataclass(frozen=True)
class Text:
    """A name beside a place."""

    layer: str
    at: complex
    text: str
    height: float


@dataclass
class Drawing:
    """All strokes; `unit` is the length that a number means."""

    unit: str
    shapes: list[Line | Circle | Text]

    def extent(self) -> tuple[complex, complex]:
        """Return the lower left and the upper right corner."""
        z = np.array(
            [p for s in self.shapes for p in (s.places if isinstance(s, Line) else [s.center if isinstance(s, Circle) else s.at])]
        )  # fmt: skip
        return complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())


def draw(s: Skeleton, travel: Travel, unit: str, factor: float) -> Drawing:
    """Return the drawing of the start pose and of the curves over the travel; `factor` metres are one of the unit."""
    m = s.m
    made = Drawing(unit, [])
    size = m.size / factor
    placed: dict[str, complex] = {}
    for part in s.parts.values():
        places = {p: part.world(z) / factor for p, z in part.points.items()}
        if part.name == GROUND:
            for name, z in places.items():
                foot = size * PIN * 2
                made.shapes.append(Line("GROUND", [z, z + foot * (-1 - 2j), z + foot * (1 - 2j)], True))
                placed[name] = z
            continue
        placed |= places
        if part.name in m.links:
            _link(made, part.name, list(places.values()), size)
    for name in dict.fromkeys(j.point for j in s.joints):
        made.shapes.append(Circle("JOINTS", placed[name], size * PIN))
    _guides(s, travel, made, factor)
    for name, z in placed.items():
        if name in m.pins or name in {j.point for j in s.joints} or name not in m.ground:
            made.shapes.append(Text("NAMES", z + size * PIN * (1.2 + 1.2j), name, size * NAME))
    if travel.motion is not None:
        for name in travel.traced:
            z = travel.curve(name) @ np.array([1, 1j]) / factor
            made.shapes += [_run(part) for part in _runs(z)]
    return made


def _link(made: Drawing, name: str, places: list[complex], size: float) -> None:
    strokes = outline(places)
    if not strokes:
        return
    run = [a for a, _ in strokes] if len(strokes) > 1 else list(strokes[0])
    made.shapes.append(Line("LINKS", run, len(strokes) > 1))
    middle = sum(run) / len(run)
    made.shapes.append(Text("NAMES", middle + size * PIN * 1j, name, size * NAME))


def _guides(s: Skeleton, travel: Travel, made: Drawing, factor: float) -> None:
    """A line as long as the point's travel and a little more, and a block on it."""
    m = s.m
    for k, g in enumerate(m.guides):
        part = s.parts[g.on]
        here = float(SlideMotion(s.start, k).position[0])
        low, high = travel.way(k) or (here, here)
        along = cmath.rect(1.0, g.angle)
        room = 0.06 * m.size
        ends = [part.world(m.through(g) + way * along) / factor for way in (low - room, high + room)]
        made.shapes.append(Line("GUIDES", ends))
        z = part.world(m.through(g) + here * along) / factor
        turned = cmath.rect(1.0, part.turn + g.angle) * m.size * PIN / factor
        corners = [z + turned * c for c in (-3 - 2j, 3 - 2j, 3 + 2j, -3 + 2j)]
        made.shapes.append(Line("JOINTS", corners, True))


def _runs(z: Complexes) -> list[Complexes]:
    """Return the stretches of a curve without gaps, each of two places at least."""
    gaps = np.flatnonzero(~np.isfinite(z))
    parts = np.split(z, gaps)
    parts = [p[np.isfinite(p)] for p in parts]
    return [p for p in parts if len(p) > 1]


def _run(z: Complexes) -> Line:
    closed = bool(abs(z[-1] - z[0]) <= 1e-9 * np.ptp(np.abs(z - z.mean())) + 1e-12 * np.abs(z).max())
    return Line("CURVES", [complex(w) for w in (z[:-1] if closed else z)], closed)
