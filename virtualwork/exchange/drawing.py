"""Drawings and tables of a mechanism: its shapes and curves in SVG and DXF, curves in CSV, the profile of a cam in all three."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element

import numpy as np

from dalembert.angles import read_degrees
from dalembert.documents.markup import add, digits, document
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table, number
from dalembert.results.text import csv_text
from dalembert.units import UNITS, to_si
from virtualwork.describe.cams import CamDrive
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.drawing import Circle, Line, standing, tracers
from virtualwork.exchange.drawn import Body
from virtualwork.formulas.profiles import FINE, ProfilePoint, profile
from virtualwork.picture.paper import travel_of
from virtualwork.study.cams import check_cam

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.mechanism import Mechanism
    from virtualwork.motion import Motion

    Array = NDArray[np.float64]
    Complexes = NDArray[np.complex128]


def start_of(m: Mechanism, inputs: tuple[float, ...]) -> Motion:
    """Return the motion of the pose in which a file begins, at the speed of the mechanism's own file.

    Raises
    ------
    DataError
        Where it cannot be assembled there.
    """
    rates = [e.speed or 0.0 for e in m.inputs]
    start = m.motion([inputs], speed=[rates]) if len(inputs) > 1 else m.motion(inputs[0], speed=rates[0])
    if not start.assembled[0]:
        raise DataError("it cannot be assembled at that input: nothing is exported")
    return start


def bodies_of(m: Mechanism, motion: Motion) -> dict[str, Body]:
    """Return the ground and the links as bodies that stand in the first pose of a motion; m, kg, rad."""
    bodies = {GROUND: Body(dict(m.ground))}
    for name, link in m.links.items():
        at, turn = complex(motion.at(name, 0j).complex(0)[0]), float(motion.link(name).angle[0])
        rigid = m.rigid[name]
        bodies[name] = Body(dict(link.points), at, turn, rigid.mass, rigid.center, rigid.inertia)
    return bodies


# poses over the travel of the input
SAMPLES = 721


class Travel:
    """One input from one end of its travel to the other, or over a whole period; nothing with several inputs."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m

    @cached_property
    def limits(self) -> tuple[float, float] | None:
        """The ends of the input's travel, rad or m; None where it is not limited on both sides."""
        result = self.m.check.input_limits
        return None if result is None or not all(map(math.isfinite, result)) else result

    @cached_property
    def motion(self) -> Motion | None:
        """The motion over the travel at the file's speed."""
        m = self.m
        if len(m.inputs) != 1:
            return None
        track = m.assembly.track
        low, high = self.limits or (track.start, track.start + (m.assembly.reach.period or track.length))
        input_limits = self.m.check.input_limits
        if self.limits is None and input_limits is not None:
            low, high = (
                (input_limits[0], input_limits[0] + track.length)
                if math.isfinite(input_limits[0])
                else (input_limits[1] - track.length, input_limits[1])
            )
        e = m.inputs[0]
        return m.motion(np.linspace(low, high, SAMPLES), e.speed or 0.0, e.acceleration or 0.0)

    def curve(self, point: str) -> Array:
        """The places (n, 2) of a point over the travel, m; NaN where it is not assembled."""
        assert self.motion is not None
        return self.motion.point(point).position

    @cached_property
    def traced(self) -> list[str]:
        """The points whose curves are drawn: those that no joint holds; where there are none, all that move."""
        return tracers(self.m) or self.moving

    @property
    def moving(self) -> list[str]:
        """The points that are not the ground's."""
        return [p for p in self.m.points if p not in self.m.ground]

    def way(self, guide: int) -> tuple[float, float] | None:
        """The least and the largest position along a guide, m."""
        low, high = (math.nan, math.nan) if self.motion is None else travel_of(self.motion.poses)[guide]
        return (low, high) if math.isfinite(low) else None

    @cached_property
    def peak(self) -> float | None:
        """The greatest effort of the input over a whole period, N·m or N; None where it is limited or nothing acts."""
        if self.motion is None or self.m.check.input_limits is not None:
            return None
        peak = self.motion.cycle.peak
        return peak if math.isfinite(peak) and peak > 0 else None


# --- shapes -------------------------------------------------------------------------------------------------------
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


def draw(m: Mechanism, inputs: tuple[float, ...], travel: Travel, unit: str, metres: float) -> Strokes:
    """Return the drawing of a pose and of the curves over the travel; `metres` are one of the unit."""
    start = start_of(m, inputs)
    bodies = bodies_of(m, start)
    # guides are as long as they are used
    drawn = (travel.motion or start).drawing

    def world(body: str, z: complex) -> complex:
        return bodies[body].world(z)

    made = Strokes(unit, [])
    for shape in drawn.shapes:
        made.shapes.append(replace(standing(shape, world, metres), role=LAYER[shape.role]))
    for name in travel.traced if travel.motion is not None else ():
        z = travel.curve(name) @ np.array([1, 1j]) / metres
        made.shapes += [_run(part) for part in _runs(z)]
    symbol = drawn.symbol / metres
    for label in drawn.labels:
        place = world(label.body, label.at) / metres + symbol * (1.2 + 1.2j)
        made.shapes.append(Text("NAMES", place, label.text, NAME * symbol))
    return made


def _runs(z: Complexes) -> list[Complexes]:
    """Return the stretches of a curve without gaps, each of two places at least."""
    parts = [p[np.isfinite(p)] for p in np.split(z, np.flatnonzero(~np.isfinite(z)))]
    return [p for p in parts if len(p) > 1]


def _run(z: Complexes) -> Line:
    closed = bool(abs(z[-1] - z[0]) <= 1e-9 * np.ptp(np.abs(z - z.mean())) + 1e-12 * np.abs(z).max())
    return Line("CURVES", GROUND, tuple((z[:-1] if closed else z).tolist()), closed)


def picture(drawing: Strokes, suffix: str, comment: str, metres: float) -> bytes:
    """Return the drawing as a file; `metres` are one of its unit."""
    return _svg(drawing, comment, metres * 1000) if suffix == ".svg" else _dxf(drawing, comment)


def _svg(drawing: Strokes, comment: str, millimetres: float) -> bytes:
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


def _dxf(drawing: Strokes, comment: str) -> bytes:
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


# --- tables and profiles ------------------------------------------------------------------------------------------
def unit_of(bare: Mapping[str, str], suffix: str) -> tuple[str, float]:
    """Return the unit of length of a file with this suffix, and its metres: that of the mechanism's own file, or the metre."""
    length = bare.get("length", "m")
    held = length in (UNITS["length"] if suffix == ".csv" else DXF_UNITS)
    return (length, to_si(1.0, "length", length)) if held else ("m", 1.0)


class SeveralInputs(DataError):
    """Curves over the travel of an input, of a mechanism with several inputs."""


def curves(travel: Travel, length: str, angle: str) -> bytes:
    """Return the table of the input and of every moving point over its travel, in units of length and angle."""
    if travel.motion is None:
        raise SeveralInputs("curves need one input, and it has several")
    q, slides = travel.motion.inputs[:, 0], travel.m.inputs[0].is_slide
    columns = [number("input", "length", q, length) if slides else _angle("input", q, angle)]
    for name in travel.moving:
        place = travel.curve(name)
        columns += [number(f"{name}_{axis}", "length", place[:, k], length) for k, axis in enumerate("xy")]
    return csv_text(Table(columns).cells).encode()


def _angle(name: str, radians: Array, unit: str) -> Column:
    if unit == "rad":
        return Column(name, unit, radians)
    return number(name, "angle", list(map(read_degrees, radians.tolist())), unit)


def cam_bytes(
    m: Description, drive: CamDrive, suffix: str, file: str, bare: Mapping[str, str]
) -> tuple[bytes, list[str]]:
    """Return the profile of a cam as a file, and warnings; `bare` are the units of the mechanism's own file."""
    points = profile(m, drive, FINE)
    length, metres = unit_of(bare, suffix)
    notes = check_cam(m, drive.number).warnings
    if suffix == ".csv":
        return _profile_table(points, drive, length, bare.get("angle", "rad")), notes
    comment = " ".join(f"{m.name}: profile of {drive.label}, from {file}".split())
    center = m.bodies[drive.cam.cam][drive.pin] / metres
    strokes = _profile(points, length, metres, center, drive.cam.base_radius / metres)
    return picture(strokes, suffix, comment, metres), notes


def _profile(
    points: list[ProfilePoint], length: str, metres: float, center: complex, radius: float
) -> Strokes:
    """Return the profile, the pitch curve and a cross at the axis."""
    shapes = [
        Line("GEARS", GROUND, tuple(point.profile / metres for point in points), closed=True),
        *(
            Line("JOINTS", GROUND, (center - way * radius / 10, center + way * radius / 10))
            for way in (1 + 0j, 1j)
        ),
    ]
    if any(point.pitch != point.profile for point in points):
        shapes.append(Line("CURVES", GROUND, tuple(point.pitch / metres for point in points), closed=True))
    return Strokes(length, list(shapes))


def _profile_table(points: list[ProfilePoint], drive: CamDrive, length: str, angle: str) -> bytes:
    """Return a row for each point: the cam's angle, the lift, the profile, the pitch curve, pressure angle and radius."""

    def of(name: str) -> Any:
        return np.array([getattr(point, name) for point in points])

    def long(name: str, metres: Any) -> Column:
        return number(name, "length", np.where(np.isinf(metres), np.nan, metres), length)

    columns = [
        _angle("cam", of("angle"), angle),
        _angle("swing", of("lift"), angle) if drive.guide is None else long("lift", of("lift")),
        *(long(f"{name}_{axis}", z) for name in ("profile", "pitch") for axis, z in _axes(of(name))),
        _angle("pressure_angle", of("pressure_angle"), angle),
        long("curvature_radius", of("curvature_radius")),
    ]
    return csv_text(Table(columns).cells).encode()


def _axes(z: Complexes) -> tuple[tuple[str, Array], ...]:
    return ("x", z.real), ("y", z.imag)
