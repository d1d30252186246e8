"""A mechanism as a page that computes: its formulas on tapes with every dimension as an input, and what the page needs beside them.

The page holds no mechanics of its own. It chooses each loop's assembly at the guess by the tape of the choice, looks along the
input for places where a radicand touches or crosses zero, and runs the tape of the poses with the signs that follow.
What a tape has not is left to a page that replays: `refused` says what.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.engines.javascript import engine, written
from dalembert.arithmetic.recorded import Number, Real, bare
from dalembert.arithmetic.tape import Tape
from dalembert.page import Page, Shown, packed
from dalembert.page.typed import units
from virtualwork.animation import JointForce, Series, moving_page
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, changed, dimensions, value
from virtualwork.describe.text import toml_text
from virtualwork.drawing import Circle, Coil, Drawing, Line, draw
from virtualwork.family.written import Written
from virtualwork.forces import Forces
from virtualwork.formulas.asked import FORCES, Key, names
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.poses import Poses
from virtualwork.picture.paper import travel_of
from virtualwork.quantities import Quantity, places
from virtualwork.quantities import forces as quantities_of_forces

ORDERS = 2
"""How often places are differentiated in time."""
# no page computes more poses at a step of the hand
MOST = 4000
# input, speed, acceleration, jerk, as an input of a description calls them
RATES = ("value", "speed", "acceleration", "jerk")


@dataclass
class Computed(Series):
    """Poses of which the page computes every column: a column says where on the tape it stands."""

    of: Formulas | None = None

    def _unit_rates(self, key: Key) -> list[Any]:
        assert self.of is not None
        row = self.of.row(key)
        return [{"row": row + i} for i in range(len(names(key)))]

    def _add(self, name: str, values: Any, header: str = "", owner: str = "", exact: bool = True) -> int:
        if not isinstance(values, dict):
            return super()._add(name, values, header, owner, exact)
        self._index[name] = len(self._packed)
        self._packed.append({"header": header, "owner": owner, **values})
        return self._index[name]

    def _paths(self, names: list[str]) -> dict[str, list[Any]]:
        self._fine = np.empty(0)
        return {}


class Formulas:
    """The tapes of a page, and which quantity stands in which row of the tape of the poses.

    Parameters
    ----------
    assembly : Assembly
        Of the description that the page begins with.
    poses : Poses
        Over the sweep of the page.
    order : int
        How often places are differentiated in time.
    """

    def __init__(self, assembly: Assembly, poses: Poses, order: int = ORDERS) -> None:
        self.assembly, self.poses, self.order = assembly, poses, order
        self.mechanism: Description = assembly.mechanism
        self.dimensions = dimensions(self.mechanism)
        self.keys: dict[Key, int] = {}
        self._rows = 0

    @cached_property
    def written(self) -> Written:
        """The formulas with the dimensions as inputs."""
        fixed = [d for d in self.dimensions.values() if d.where[0] != "inputs"]
        moves = (True, True, self.order > ORDERS)
        return Written(self.assembly, fixed, moves, own_signs=True, settled=False)

    def refused(self, keys: Sequence[Key]) -> str:
        """Say why a page cannot compute these quantities; empty where it can."""
        m, own = self.mechanism, self.assembly
        forces = any(key[0] in FORCES for key in keys)
        _ = own.track
        if not m.inputs:
            return "nothing drives it"
        if self.poses.n > MOST:
            return f"more than {MOST} poses are no matter of a moment"
        if own.geared:
            return "a gear needs angles with their whole turns"
        if own.folded:
            return "loops are singular in every pose"
        if any(np.ndim(rate) and np.ptp(rate) for rates in self.poses.rates for rate in rates):
            return "the speed follows a law in time"
        if forces and m.friction:
            return "friction is found by iteration"
        if {g.name: g.kind for g in self.written.plan.groups} != {g.name: g.kind for g in own.plan.groups}:
            return "its loops have a closed form for these numbers alone"
        if self.written.open_gears:
            return "a gear's phase depends on links that the guess places"
        if not self.written.recording.takes(keys):
            return "the joint forces are statically redundant"
        if forces:
            loads = self.written.recording.forces[0].case.loads
            if any(isinstance(load, Tabled) for load in loads):
                return "a load is given by a table"
            if m.torsion_springs and len(m.inputs) > 1:
                return "a torsion spring counts its turns along several inputs"
        return ""

    def row(self, key: Key) -> int:
        """The first row of a quantity on the tape of the poses, which gets it."""
        if key not in self.keys:
            self.keys[key] = self._rows
            self._rows += len(names(key))
        return self.keys[key]

    def column(self, each: Quantity, si: float = 1.0) -> dict[str, Any]:
        """What a column or a name asks the tape of the poses for."""
        if not each.key:
            return {"zero": 1}
        found: dict[str, Any] = {"row": self.row(each.key) + each.imaginary}
        if each.less:
            found["less"] = self.row(each.less)
        if each.turns:
            found["turns"] = 1
        if each.order:
            found["order"] = each.order
        return found

    # --- tapes ----------------------------------------------------------------------------------------------------
    def tapes(self, drawn: Mapping[str, Number]) -> dict[str, Tape]:
        """The tapes of the page, once all rows are given out."""
        written = self.written
        groups = written.plan.groups
        closed = [g.name for g in written.closed]
        every = ("closed", *(g.name for g in groups))
        found = {
            "pose": written.tape((*self.keys, every)),
            "choice": written.choice,
            "margins": written.tape([("margin", name) for name in closed]),
            "short": written.short,
            "drawn": written.recording.recorder.tape(dict(drawn)),
        }
        if any(g.kind == "Newton" for g in groups):
            found["steps"] = written.steps
        if self.mechanism.torsion_springs:
            springs = range(len(self.mechanism.torsion_springs))
            found["twists"] = written.tape([("twist", i) for i in springs])
        return found

    def document(self) -> dict[str, Any]:
        """What the page knows of the mechanism beside its tapes."""
        m, written = self.mechanism, self.written
        iterated = {g.name for g in written.plan.groups if g.kind == "Newton"}
        closed = {g.name for g in written.closed}
        groups = [
            {
                "name": g.name,
                "sign": self.assembly.signs.get(g.name, 1),
                **({"start": list(self.assembly.starts[g.name])} if g.name in iterated else {}),
                **({"angles": len(g.angles)} if g.name in iterated else {}),
            }
            for g in written.plan.groups
            if g.name in closed or g.name in iterated
        ]
        return {
            "dimensions": [self._dimension(d) for d in self.dimensions.values()],
            "inputs": [self._input(j) for j in range(len(m.inputs))],
            "groups": groups,
            "springs": [s.turns for s in m.torsion_springs],
            "size": float(m.size),
            "n": self.poses.n,
            "rates": [bool(np.any(rate)) for rate in self.poses.rates[0]],
            "toml": self._toml(),
        }

    def _dimension(self, d: Dimension) -> list[Any]:
        return [d.path, d.kind, float(np.real(value(self.mechanism, d.path)))]

    def _input(self, j: int) -> dict[str, Any]:
        m = self.mechanism
        entry = m.inputs[j]
        paths = {
            str(d.where[2]): d.path
            for d in self.dimensions.values()
            if d.where[0] == "inputs" and d.where[1] == j
        }
        rates = [float(np.ravel(np.asarray(rate[j], dtype=float))[0]) for rate in self.poses.rates]
        return {
            "name": str(entry.name),
            "slides": entry.is_slide,
            "at": float(m.at[j]),
            "follows": m.guess.at is None,
            "paths": [paths.get(rate) for rate in RATES],
            "rates": rates,
            "sweep": packed(self.poses.inputs[:, j]),
        }

    def _toml(self) -> list[Any] | None:
        """The file in pieces: lines of text and paths; what was left out as it is the default stands only where it was changed."""
        m = self.mechanism
        try:
            own = toml_text(m)
            marked = {
                d.path: 0.5 + (i + 1) * 1.000123456789e-4 for i, d in enumerate(self.dimensions.values())
            }
            text = toml_text(changed(m, marked))
        except DescriptionError:
            return None
        known = set(_keyed(own))
        marks = {repr(number): path for path, number in marked.items()}
        lines: list[Any] = []
        for (head, key), line in zip(_keyed(text), text.splitlines(), strict=True):
            pieces: list[Any] = [""]
            for word in _words(line):
                if word in marks:
                    pieces += [[marks[word]], ""]
                else:
                    pieces[-1] += word
            lines.append({"of": pieces, "needed": (head, key) in known or not key})
        found = {word for line in text.splitlines() for word in _words(line)} & set(marks)
        return lines if len(found) == len(marks) else None


def _words(line: str) -> list[str]:
    """A line of TOML in numbers and what stands between them."""
    return re.split(r"((?<![\w.\"+-])\d+\.\d+(?![\w.\"]))", line)


def _keyed(text: str) -> list[tuple[str, str]]:
    """Each line's table and key; tables of a list are counted."""
    found, head, count = [], "", 0
    for line in text.splitlines():
        if line.startswith("["):
            count += 1
            head = f"{line} {count}"
            found.append((head, ""))
        else:
            found.append((head, line.partition(" = ")[0] if " = " in line else ""))
    return found


def drawn_numbers(own: Drawing, live: Drawing, formulas: Formulas) -> tuple[list[Any], dict[str, Number]]:
    """Which numbers of the drawing hang on dimensions: (shape, place in it, row of the tape), and the numbers by their rows."""
    places: list[Any] = []
    numbers: dict[str, Number] = {}

    def note(shape: int, what: str, k: int, number: Any) -> None:
        if isinstance(bare(number), Real):
            places.append([shape, what, k, len(numbers)])
            numbers[f"{len(numbers)}"] = bare(number)

    def parts(z: Any) -> Iterator[Any]:
        z = bare(z)
        yield from (z.real, z.imag)

    for i, (mine, shape) in enumerate(zip(own.shapes, live.shapes, strict=True)):
        assert type(mine) is type(shape)
        if isinstance(shape, Line):
            for k, x in enumerate(x for z in shape.points for x in parts(z)):
                note(i, "p", k, x)
        elif isinstance(shape, Circle):
            for k, x in enumerate(parts(shape.centre)):
                note(i, "z", k, x)
            note(i, "s", 0, shape.radius)
        elif isinstance(shape, Coil):
            for e, (_, z) in enumerate(shape.ends):
                for k, x in enumerate(parts(z)):
                    note(i, "ends", 3 * e + 1 + k, x)
    for i, points in enumerate(formulas.written.mechanism.bodies.values()):
        for k, x in enumerate(parts(next(iter(points.values()), 0j))):
            note(i, "at", k, x)
    for i, label in enumerate(live.labels):
        for k, x in enumerate(parts(label.at)):
            note(i, "label", k, x)
    return places, numbers


def handles(m: Description) -> list[list[Any]]:
    """What can be dragged: the path of a point, its body, its name, and for a point in polar form the point it is counted from."""
    found: list[list[Any]] = [[f"ground.{name}", "ground", name, None] for name in m.ground]
    every = dimensions(m)
    for link, part in m.links.items():
        for point in part.points:
            for path in (f"links.{link}.{point}", f"links.{link}.points.{point}"):
                if f"{path}.x" in every:
                    found.append([path, link, point, None])
                elif point in part.polar and f"{path}.length" in every:
                    found.append([path, link, point, part.polar[point].origin])
    return found


def computing_page(
    poses: Poses,
    columns: Mapping[str, tuple[Quantity | int, Shown]],
    named: Sequence[Quantity],
    forces: Sequence[JointForce] = (),
    bare_units: Mapping[str, str] | None = None,
    others: Sequence[Series] = (),
    first: Sequence[float] | None = None,
    order: int = ORDERS,
    name: str = "",
) -> Page | str:
    """Return the page of a mechanism that computes itself, or the reason why there is none.

    Parameters
    ----------
    poses : Poses
        Over the sweep.
    columns : mapping
        What is listed: of each column its quantity, or the number of an input, and its header with its unit.
    named : sequence of Quantity
        What can be asked for by name.
    bare_units : mapping of kind to unit
        The units of lengths and angles that are typed and shown: those of the file.
    others : sequence of Series
        Other motions, which the page draws as ghosts.
    first : sequence of float
        The input of the pose that is shown at first; default: the first of the sweep.
    """
    assembly: Assembly = poses.branch  # type: ignore[assignment]
    m = assembly.mechanism
    formulas = Formulas(assembly, poses, order)
    reason = formulas.refused([key for each in named for key in (each.key, each.less) if key])
    if reason:
        return reason
    listed: dict[str, Shown] = {}
    for header, (what, how) in columns.items():
        asked: Any = {"input": what} if isinstance(what, int) else formulas.column(what)
        listed[header] = Shown(asked, how.header, how.si)
    over = [header for header, (what, _) in columns.items() if isinstance(what, int)]
    travel = travel_of(poses)
    drawing = draw(m, travel)
    series = Computed(poses, drawing, listed, over, forces, name, of=formulas)

    def computed() -> tuple[str, dict[str, Any]]:
        quantities: dict[str, dict[str, Any]] = {}
        # of two joints of one name on one link that which has the number
        for each in sorted(named, key=lambda one: not one.key):
            for word in each.names:
                quantities.setdefault(word, formulas.column(each))
        places, numbers = drawn_numbers(drawing, draw(formulas.written.mechanism, travel), formulas)
        tapes = ",\n".join(f"{key}: {written(tape)}" for key, tape in formulas.tapes(numbers).items())
        model = formulas.document() | {
            "quantities": quantities,
            "drawn": places,
            "handles": handles(m),
            "units": units(["length", "angle", *(d.kind for d in formulas.dimensions.values())]),
            "bare": dict(bare_units or {}),
            "first": list(map(float, poses.inputs[0] if first is None else first)),
        }
        return f"{engine()}\nconst tapes = {{\n{tapes}\n}};\n", {"model": model}

    return moving_page(m.name, [series, *others], computed=computed)


def page_of(poses: Poses, drawing: Drawing, forces: Forces | None = None, over: Sequence[float] = ()) -> Page:
    """Return the page of one motion: it computes itself where its formulas can be written down, else it replays and says why.

    Parameters
    ----------
    drawing : Drawing
        What a page that replays draws.
    forces : Forces, optional
        Those of the motion, where they are to be there too.
    over : sequence of float
        The input of the pose that is shown at first.
    """
    m = poses.mechanism
    named = places(m, ORDERS)
    moves = any(np.any(rate) for rates in poses.rates for rate in rates)
    listed = [each for each in named if not each.order or moves]
    arrows: list[JointForce] = []
    if forces is not None:
        pairs = forces.reactions.order.pairs
        every = quantities_of_forces(m, pairs)
        named += every
        listed += [each for each in every if each.key and not each.reverse]
        arrows = [JointForce.of(*pair) for pair in pairs]
    degree = float(np.pi / 180)
    several = len(m.inputs) > 1
    columns: dict[str, tuple[Quantity | int, Shown]] = {}
    for j, entry in enumerate(m.inputs):
        header = f"{entry.name}_input_m" if entry.is_slide else f"{entry.name}_input_deg"
        header = header if several else header.removeprefix(f"{entry.name}_")
        columns[header] = j, Shown((), header, 1.0 if entry.is_slide else degree)
    for each in listed:
        columns[each.header] = each, Shown((), each.header, degree if each.turns else 1.0)
    made = computing_page(poses, columns, named, arrows, first=over or None)
    if isinstance(made, Page):
        return made
    from virtualwork.animation import of_motion

    return of_motion(poses, drawing, forces, f"This page replays what was computed: {made}.")
