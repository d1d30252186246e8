"""FreeCAD sketches (`.FCStd`: a zip with Document.xml): a sketch of lines as a linkage drawn in one pose.

A line is a link, points made coincident are a pin. Fixed are points on the origin, points whose two distances from it
have values, and blocked lines. Lines of a triangle, and lines that meet at a fixed angle, are one link. A point on a line
is a slot; a point with one fixed distance from the axes slides. A sketch names no input: the first link that is
pinned to the ground drives.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from dalembert.documents.markup import parse
from dalembert.documents.values import LARGEST_FILE, finite
from dalembert.errors import DataError
from virtualwork.exchange.drawn import GROUND, Drawing, Drive, Groups
from virtualwork.exchange.places import Exact, direction, place

# numbers of Sketcher's constraints (ConstraintType of its source)
COINCIDENT, HORIZONTAL, VERTICAL, PARALLEL, TANGENT, DISTANCE, DISTANCE_X, DISTANCE_Y = 1, 2, 3, 4, 5, 6, 7, 8
ANGLE, PERPENDICULAR, ON_OBJECT, BLOCK = 9, 10, 13, 17
# of constraints between two lines: these hold their angle
STIFF = (PARALLEL, TANGENT, ANGLE, PERPENDICULAR)
H_AXIS, V_AXIS, NONE = -1, -2, -2000
START, END = 1, 2
Vertex = tuple[int, int]
ORIGIN: Vertex = (H_AXIS, START)
# of a document, which holds parts of every kind beside its sketches
MOST_ELEMENTS = 500_000


@dataclass
class Constraint:
    """A constraint between up to two elements, each with its number and which of its points."""

    kind: int
    first: Vertex
    second: Vertex


@dataclass
class Sketch:
    """The lines of one sketch, by their numbers, and what holds them."""

    name: str
    lines: dict[int, tuple[Exact, Exact]] = field(default_factory=dict)
    constraints: list[Constraint] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    """What is no line."""

    def at(self, vertex: Vertex) -> Exact:
        """Return where a point of a line stands."""
        return self.lines[vertex[0]][vertex[1] - 1]


def is_document(data: bytes) -> bool:
    """Whether the bytes are a zip that holds a FreeCAD document."""
    if data[:2] != b"PK":
        return False
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return "Document.xml" in archive.namelist()
    except zipfile.BadZipFile:
        return False


def read(file: str, data: bytes) -> list[Drawing]:
    """Read a drawing of every sketch with lines."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entry = archive.getinfo("Document.xml")
            if entry.file_size > LARGEST_FILE:
                raise DataError(
                    f"{file}: Document.xml: {entry.file_size} bytes: expected at most {LARGEST_FILE}"
                )
            root = parse(f"{file}, Document.xml", archive.read(entry), MOST_ELEMENTS)
    except (zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise DataError(f"{file}: no zip of FreeCAD: {error}") from None
    sketches = list(_sketches(file, root))
    if not sketches:
        raise DataError(f"{file}: no sketch with lines: expected a Sketcher sketch whose lines are links")
    return [_Linkage(sketch).drawing() for sketch in sketches]


def _sketches(file: str, root: Any) -> Iterator[Sketch]:
    kinds = {each.get("name"): each.get("type") for each in root.iter("Object") if each.get("type")}
    for thing in root.iter("Object"):
        if kinds.get(thing.get("name")) != "Sketcher::SketchObject" or thing.find("Properties") is None:
            continue
        sketch = Sketch(str(thing.get("name")))
        own = [of for of in thing.iter("Property") if of.get("name") == "Geometry"]
        for number, geometry in enumerate(each for of in own for each in of.iter("Geometry")):
            of = str(geometry.get("type", "")).removeprefix("Part::Geom")
            line = geometry.find("LineSegment")
            what = f"{sketch.name}, line {number + 1}"
            if line is None or _is_construction(geometry):
                sketch.others.append(
                    f"{'a line of construction' if line is not None else of.lower()} {number + 1}"
                )
                continue
            x1, y1, x2, y2 = (
                finite(file, what, line.get(key)) for key in ("StartX", "StartY", "EndX", "EndY")
            )
            sketch.lines[number] = place(x1, y1), place(x2, y2)
        for each in thing.iter("Constrain"):
            kind, a, ap, b, bp = (
                int(finite(file, f"{sketch.name}, constraint", each.get(key, "0")))
                for key in ("Type", "First", "FirstPos", "Second", "SecondPos")
            )
            sketch.constraints.append(Constraint(kind, (a, ap), (b, bp)))
        if sketch.lines:
            yield sketch


def _is_construction(geometry: Any) -> bool:
    mark = geometry.find("Construction")
    flag = mark.get("value") if mark is not None else geometry.get("construction", "0")
    return str(flag).lower() in ("1", "true")


class _Linkage:
    """A sketch as links and pins."""

    def __init__(self, sketch: Sketch) -> None:
        self.s, self.d = sketch, Drawing(name=sketch.name, length="mm")
        ends = [(line, end) for line in sketch.lines for end in (START, END)]
        self.points = Groups([ORIGIN, *ends, *(v for c in sketch.constraints for v in (c.first, c.second))])
        self.links = Groups(sketch.lines)
        self.fixed: tuple[set[Vertex], set[Vertex]] = (set(), set())

    def drawing(self) -> Drawing:
        s, d = self.s, self.d
        for what in s.others:
            d.leave(what, "only lines are links")
        for c in s.constraints:
            if c.kind == COINCIDENT:
                # the origin stands for what lies on it
                a, b = (c.second, c.first) if c.second == ORIGIN else (c.first, c.second)
                self.points.join(a, b)
        self._stiffen()
        self._ground()
        self._bodies()
        self._slots()
        driven = [
            n
            for n, body in d.bodies.items()
            if n != GROUND and body.points.keys() & d.bodies[GROUND].points.keys()
        ]
        if driven:
            d.drives.append(Drive(driven[0]))
            d.notes.append(
                f"the sketch names no input: {driven[0]}, which is pinned to the ground, is the input"
            )
        return d

    def _vertex(self, line: int, end: int) -> Vertex:
        return self.points.of((line, end))

    def _stiffen(self) -> None:
        """Lines of a triangle, and lines that meet at an angle that is held, are one link."""
        ends = {i: {self._vertex(i, START), self._vertex(i, END)} for i in self.s.lines}
        at: dict[Vertex, dict[Vertex, list[int]]] = {}
        for i, (u, v) in ((i, tuple(pair)) for i, pair in ends.items() if len(pair) == 2):
            at.setdefault(u, {}).setdefault(v, []).append(i)
            at.setdefault(v, {}).setdefault(u, []).append(i)
        for sides in at.values():
            for v in sides:
                for w in sides.keys() & at[v].keys():
                    self.links.join(*sorted((*sides[v], *sides[w], *at[v][w])))
        for each in self.s.constraints:
            a, b = each.first[0], each.second[0]
            if each.kind in STIFF and a in ends and b in ends and ends[a] & ends[b]:
                self.links.join(a, b)

    def _ground(self) -> None:
        """Collect the points whose x, and whose y, is fixed."""
        x, y = self.fixed
        for coordinate in self.fixed:
            coordinate.add(ORIGIN)
        for _ in range(len(self.s.constraints) + 1):
            before = len(x) + len(y)
            for c in self.s.constraints:
                for of, held in ((DISTANCE_X, x), (DISTANCE_Y, y)):
                    if c.kind == of and c.first[1]:
                        second = ORIGIN if c.second[0] == NONE else c.second
                        self._carry(held, c.first, second)
                if c.kind == ON_OBJECT and c.second[0] in (H_AXIS, V_AXIS):
                    (y if c.second[0] == H_AXIS else x).add(self.points.of(c.first))
                if c.kind in (HORIZONTAL, VERTICAL) and c.first[1] and c.second[0] != NONE:
                    self._carry(y if c.kind == HORIZONTAL else x, c.first, c.second)
                if c.kind == BLOCK and c.first[0] in self.s.lines:
                    for end in (START, END):
                        x.add(self._vertex(c.first[0], end))
                        y.add(self._vertex(c.first[0], end))
            if len(x) + len(y) == before:
                break

    def _carry(self, held: set[Vertex], first: Vertex, second: Vertex) -> None:
        a, b = self.points.of(first), self.points.of(second)
        if a in held or b in held:
            held.update((a, b))

    def _bodies(self) -> None:
        d, names = self.d, dict[int, str]()
        vertices: dict[Vertex, str] = {}
        for i in self.s.lines:
            corners = [self._vertex(i, end) for end in (START, END)]
            standing = all(v in self.fixed[0] and v in self.fixed[1] for v in corners)
            root = self.links.of(i)
            names[i] = GROUND if standing else names.get(root) or f"line{i + 1}"
            if not standing:
                names[root] = names[i]
            for end, v in zip((START, END), corners, strict=True):
                point = vertices.setdefault(v, f"P{len(vertices) + 1}")
                at = self.s.at((i, end))
                d.body(names[i]).points[point] = at
                if v in self.fixed[0] and v in self.fixed[1]:
                    d.bodies[GROUND].points[point] = at
        self.names, self.vertices = names, vertices

    def _slots(self) -> None:
        """Add slots: points with one fixed coordinate, and points on lines."""
        d = self.d
        for v, point in self.vertices.items():
            of_x, of_y = (v in held for held in self.fixed)
            if of_x == of_y:
                continue
            link = next(n for n, body in d.bodies.items() if point in body.points)
            at = d.bodies[link].points[point]
            d.guide(point, link, GROUND, at, 0.0 if of_y else 90.0, prism=False)
        for c in self.s.constraints:
            if (
                c.kind == ON_OBJECT
                and c.second[0] in self.s.lines
                and c.first[1]
                and c.first[0] in self.s.lines
            ):
                a, b = self.s.lines[c.second[0]]
                link, on = self.names[c.first[0]], self.names[c.second[0]]
                if link != on:
                    point = self.vertices[self.points.of(c.first)]
                    d.guide(point, link, on, self.s.at(c.first), direction(a, b), prism=False)
