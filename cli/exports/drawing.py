"""What a mechanism is drawn as, on layers and in the unit of its file: the shapes of every picture, curves, names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cli.exports.skeleton import Skeleton
from cli.exports.travel import Travel
from virtualwork import drawing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Complexes = NDArray[np.complex128]

# layer -> its colour as a number of DXF and for the web, and the roles of the shapes on it
LAYERS = {
    "GROUND": (8, "#777777", "hatch frame"),
    "GUIDES": (3, "#1c8a3c", "rail slot block"),
    "LINKS": (5, "#1f4fd8", "link"),
    "GEARS": (6, "#8e24aa", "wheel spoke"),
    "SPRINGS": (30, "#d2691e", "spring"),
    "MASSES": (2, "#b8860b", "mass"),
    "CURVES": (1, "#c62828", ""),
    "JOINTS": (7, "#000000", "pin"),
    "POINTS": (4, "#00838f", "tip"),
    "NAMES": (9, "#555555", ""),
}
LAYER = {role: layer for layer, (_, _, roles) in LAYERS.items() for role in roles.split()}
# height of a name, of a pin's radius
NAME = 1.8


@dataclass(frozen=True)
class Line:
    """A run of strokes, closed where the last leads to the first."""

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
    """All strokes, from the back to the front; `unit` is the length that a number means."""

    unit: str
    shapes: list[Line | Circle | Text]

    def extent(self) -> tuple[complex, complex]:
        """Return the lower left and the upper right corner."""
        places: list[complex] = []
        for s in self.shapes:
            if isinstance(s, Line):
                places += s.places
            elif isinstance(s, Circle):
                places += [s.center - s.radius * (1 + 1j), s.center + s.radius * (1 + 1j)]
            else:
                places.append(s.at)
        z = np.array(places)
        return complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())


def draw(s: Skeleton, travel: Travel, unit: str, factor: float) -> Drawing:
    """Return the drawing of the start pose and of the curves over the travel; `factor` metres are one of the unit."""
    ways = [travel.way(k) or (np.nan, np.nan) for k in range(len(s.m.guides))]
    drawn = drawing.draw(s.m, ways)

    def at(body: str, z: complex) -> complex:
        return s.parts[body].world(z) / factor

    made = Drawing(unit, [])
    for shape in drawn.shapes:
        layer = LAYER[shape.role]
        if isinstance(shape, drawing.Circle):
            made.shapes.append(Circle(layer, at(shape.body, shape.centre), shape.radius / factor))
        elif isinstance(shape, drawing.Line):
            made.shapes.append(Line(layer, [at(shape.body, z) for z in shape.points], shape.closed))
        else:
            start, end = (s.parts[body].world(z) for body, z in shape.ends)
            made.shapes.append(Line(layer, [z / factor for z in shape.along(start, end)]))
    if travel.motion is not None:
        for name in travel.traced:
            z = travel.curve(name) @ np.array([1, 1j]) / factor
            made.shapes += [_run(part) for part in _runs(z)]
    symbol = drawn.symbol / factor
    for label in drawn.labels:
        place = at(label.body, label.at) + symbol * (1.2 + 1.2j)
        made.shapes.append(Text("NAMES", place, label.text, NAME * symbol))
    return made


def _runs(z: Complexes) -> list[Complexes]:
    """Return the stretches of a curve without gaps, each of two places at least."""
    parts = [p[np.isfinite(p)] for p in np.split(z, np.flatnonzero(~np.isfinite(z)))]
    return [p for p in parts if len(p) > 1]


def _run(z: Complexes) -> Line:
    closed = bool(abs(z[-1] - z[0]) <= 1e-9 * np.ptp(np.abs(z - z.mean())) + 1e-12 * np.abs(z).max())
    return Line("CURVES", [complex(w) for w in (z[:-1] if closed else z)], closed)
