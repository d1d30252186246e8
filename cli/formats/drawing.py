"""Drawings of a mechanism in SVG and DXF: shapes, curves and names, on layers and in the unit of its file."""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

import numpy as np

from cli.formats.markup import add, digits, document
from cli.formats.skeleton import Skeleton, Travel
from dalembert.errors import DataError
from virtualwork import drawing
from virtualwork.describe.parts import GROUND
from virtualwork.drawing import Circle, Line, standing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Complexes = NDArray[np.complex128]

# layer -> its colour as a number of DXF and for the web, and the roles of the shapes on it
LAYERS = {
    "GROUND": (8, "#777777", "hatch frame"),
    "GUIDES": (3, "#1c8a3c", "rail slot block"),
    "LINKS": (5, "#1f4fd8", "link"),
    "GEARS": (6, "#8e24aa", "wheel spoke belt rack cam roller"),
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
# of the drawing's extent: margin, width of a stroke
MARGIN, STROKE = 0.06, 0.003
# units of length -> $INSUNITS of DXF
DXF_UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "nm": 11, "um": 13, "µm": 13}


@dataclass(frozen=True)
class Text:
    """A name beside a place."""

    role: str
    at: complex
    text: str
    height: float

    @property
    def reach(self) -> tuple[complex, ...]:
        """The place where it begins."""
        return (self.at,)


@dataclass
class Strokes:
    """All strokes of a drawing, from the back to the front; the role of each is its layer, `unit` the length of a number."""

    unit: str
    shapes: list[Line | Circle | Text]

    def extent(self) -> tuple[complex, complex]:
        """Return the lower left and the upper right corner."""
        z = np.array([z for shape in self.shapes for z in shape.reach])
        return complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())


def draw(s: Skeleton, travel: Travel, unit: str, factor: float) -> Strokes:
    """Return the drawing of the start pose and of the curves over the travel; `factor` metres are one of the unit."""
    ways = [travel.way(k) or (np.nan, np.nan) for k in range(len(s.m.guides))]
    drawn = drawing.draw(s.m, ways)
    made = Strokes(unit, [])
    for shape in drawn.shapes:
        stood = standing(shape, s.world, factor)
        made.shapes.append(replace(stood, role=LAYER[shape.role]))
    for name in travel.traced if travel.motion is not None else ():
        z = travel.curve(name) @ np.array([1, 1j]) / factor
        made.shapes += [_run(part) for part in _runs(z)]
    symbol = drawn.symbol / factor
    for label in drawn.labels:
        place = s.world(label.body, label.at) / factor + symbol * (1.2 + 1.2j)
        made.shapes.append(Text("NAMES", place, label.text, NAME * symbol))
    return made


def _runs(z: Complexes) -> list[Complexes]:
    """Return the stretches of a curve without gaps, each of two places at least."""
    parts = [p[np.isfinite(p)] for p in np.split(z, np.flatnonzero(~np.isfinite(z)))]
    return [p for p in parts if len(p) > 1]


def _run(z: Complexes) -> Line:
    closed = bool(abs(z[-1] - z[0]) <= 1e-9 * np.ptp(np.abs(z - z.mean())) + 1e-12 * np.abs(z).max())
    return Line("CURVES", GROUND, tuple((z[:-1] if closed else z).tolist()), closed)


def svg(drawing: Strokes, comment: str, millimetres: float) -> bytes:
    """Return the drawing as SVG, in its true size; `millimetres` are one of its unit."""
    low, high = drawing.extent()
    extent = max(high.real - low.real, high.imag - low.imag) or 1.0
    edge = MARGIN * extent
    width, height = high.real - low.real + 2 * edge, high.imag - low.imag + 2 * edge
    root = Element("svg", xmlns="http://www.w3.org/2000/svg")
    root.set("width", f"{width * millimetres:.6g}mm")
    root.set("height", f"{height * millimetres:.6g}mm")
    # y points down
    root.set("viewBox", digits(low.real - edge, -high.imag - edge, width, height))
    groups = {}
    for name, (_, colour, _) in LAYERS.items():
        groups[name] = add(root, "g", id=name, fill="none", stroke=colour)
        groups[name].set("stroke-width", digits(STROKE * extent))
        groups[name].set("stroke-linejoin", "round")
    groups["NAMES"].attrib |= {"fill": LAYERS["NAMES"][1], "stroke": "none", "font-family": "sans-serif"}
    for s in drawing.shapes:
        into = groups[s.role]
        if isinstance(s, Line):
            points = " ".join(f"{z.real!r},{-z.imag + 0.0!r}" for z in s.points)
            add(into, "polygon" if s.closed else "polyline", points=points)
        elif isinstance(s, Circle):
            add(into, "circle", cx=s.centre.real, cy=-s.centre.imag, r=s.radius, fill="white")
        else:
            text = add(into, "text", s.text, x=s.at.real, y=-s.at.imag)
            text.set("font-size", digits(s.height))
    return document(root, comment)


def dxf(drawing: Strokes, comment: str) -> bytes:
    """Return the drawing as DXF (AutoCAD 2010), by ezdxf."""
    try:
        from ezdxf.filemanagement import new
    except ImportError:
        raise DataError("DXF is written by ezdxf: pip install 'dalembert[cad]'") from None
    made = new("R2010")
    made.header["$INSUNITS"] = DXF_UNITS[drawing.unit]
    made.header["$MEASUREMENT"] = 0 if drawing.unit in ("in", "ft") else 1
    for name, (colour, _, _) in LAYERS.items():
        made.layers.add(name, color=colour)
    space = made.modelspace()
    for s in drawing.shapes:
        at = {"layer": s.role}
        if isinstance(s, Line):
            space.add_lwpolyline([(z.real, z.imag) for z in s.points], close=s.closed, dxfattribs=at)
        elif isinstance(s, Circle):
            space.add_circle((s.centre.real, s.centre.imag), s.radius, dxfattribs=at)
        else:
            space.add_text(s.text, height=s.height, dxfattribs=at | {"insert": (s.at.real, s.at.imag)})
    low, high = drawing.extent()
    made.header["$EXTMIN"], made.header["$EXTMAX"] = (low.real, low.imag, 0), (high.real, high.imag, 0)
    text = io.StringIO()
    made.write(text)
    # 999: a comment, which every reader skips
    return f"999\n{comment}\n{text.getvalue()}".encode()
