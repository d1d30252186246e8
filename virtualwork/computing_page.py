"""A mechanism as a page that computes: its formulas on tapes with every dimension as an input, and the page's further data.

The page holds no mechanics of its own. It chooses each loop's assembly at the guess by the tape of the choice, looks along the
input for places where a radicand touches or crosses zero, and runs the tape of the poses with the signs that follow.
What a tape has not is left to a page that replays: `refused` says what.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.engines.javascript import engine, literal
from dalembert.arithmetic.recorded import Number
from dalembert.arithmetic.tape import Tape
from dalembert.page import Page, Shown, packed, spelled
from dalembert.units import LISTED
from virtualwork.animation import JointForce, Series, moving_page
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.guess import informed
from virtualwork.branch.sampling import FINE
from virtualwork.branch.track import SAMPLES
from virtualwork.describe.description import Description, known_by_guess
from virtualwork.describe.dimensions import dimensions, value
from virtualwork.drawing import Drawing, draw
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.forces import Forces
from virtualwork.formulas.forces import Effort, Over, Rub, Slip
from virtualwork.formulas.kinematics import Angle, Point
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.loops import Closed, Margin, Twist
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.quantity import Quantity
from virtualwork.page_shapes import cams, drawn_numbers, handles, profiles
from virtualwork.picture.paper import travel_of
from virtualwork.plan.steps import Group
from virtualwork.quantities import Component, places
from virtualwork.quantities import forces as quantities_of_forces
from virtualwork.study.free_bodies import parts
from virtualwork.toml_template import toml_template

ORDERS = 2
"""The highest derivative of positions in time."""
# input, speed, acceleration, jerk, as an input of a description calls them
RATES = ("value", "speed", "acceleration", "jerk")


@dataclass
class Computed(Series):
    """Poses of which the page computes every column: a column says where on the tape it stands."""

    of: Formulas | None = None

    def _free(self, names: list[str]) -> dict[str, Any]:
        """The links cut loose: of each what acts on it, as rows of the tape."""
        if not self.forces:
            return {}
        assert self.of is not None
        forces = self.of.written.recording.forces
        order = list(self.mechanism.bodies)
        loose = [
            {
                "b": order.index(link),
                "parts": [
                    {
                        "n": part.name,
                        "k": part.kind,
                        "s": part.sign,
                        "f": self._hidden(part.key),
                        **({} if part.at is None else {"at": self._hidden(part.at)}),
                        **({} if part.along is None else {"along": self._hidden(part.along)}),
                    }
                    for part in every
                ],
            }
            for link, every in parts(forces.paths).items()
        ]
        return {"loose": loose}

    def _hidden(self, key: Quantity) -> list[int]:
        """Columns of a quantity that the page does not list."""
        return [self._add(f"{key} {i}", column) for i, column in enumerate(self._unit_rates(key))]

    def _unit_rates(self, key: Quantity) -> list[Any]:
        assert self.of is not None
        row, rest = self.of.row(key), self.of.locking(key)
        return [{"row": row + i, **rest} for i in range(len(key.names))]

    def _add(self, name: str, values: Any, header: str = "", owner: str = "", exact: bool = True) -> int:
        if not isinstance(values, dict):
            return super()._add(name, values, header, owner, exact)
        self._index[name] = len(self._packed)
        self._packed.append({"header": header, "owner": owner, **values})
        return self._index[name]

    def _paths(self, names: list[str]) -> dict[str, list[Any]]:
        """No path: the page computes those that its poses are too few for."""
        assert self.of is not None
        if self.fine_inputs:
            self.of.traced = names
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
        The highest derivative of positions in time.
    """

    def __init__(self, assembly: Assembly, poses: Poses, order: int = ORDERS) -> None:
        self.assembly, self.poses, self.order = assembly, poses, order
        self.mechanism: Description = assembly.mechanism
        self.dimensions = dimensions(self.mechanism)
        self.keys: dict[Quantity, int] = {}
        self.traced: list[str] = []
        """Points whose paths need more poses than the page has."""
        self._rows = 0

    @cached_property
    def written(self) -> VariedFormulas:
        """The formulas with the dimensions as inputs."""
        fixed = [d for d in self.dimensions.values() if d.where[0] != "inputs"]
        moves = (True, True, self.order > ORDERS)
        return VariedFormulas(self.assembly, fixed, moves, True, settled=False)

    def refused(self, keys: Sequence[Quantity]) -> str:
        """Return why a page cannot compute these quantities; empty if it can."""
        m, own = self.mechanism, self.assembly
        forces = any(key.is_force for key in keys)
        _ = own.track
        if not m.inputs:
            return "nothing drives it"
        if own.folded:
            return "loops are singular in every pose"
        if {g.name: g.kind for g in self.written.plan.groups} != {g.name: g.kind for g in own.plan.groups}:
            return "its loops have a closed form for these numbers alone"
        if forces and m.friction and self.written.recording.forces.redundant:
            return "the joint forces are statically redundant, and there is friction"
        if forces:
            if any(load.axis == "time" for load in self.written.recording.tables) and self.poses.time is None:
                return "a torque depends on the time, which the poses do not have"
            if m.torsion_springs and len(m.inputs) > 1:
                return "a torsion spring counts its turns along several inputs"
        return ""

    def row(self, key: Quantity) -> int:
        """The first row of a quantity on the tape of the poses, which gets it."""
        if key not in self.keys:
            self.keys[key] = self._rows
            self._rows += len(key.names)
        return self.keys[key]

    def column(self, each: Component, si: float = 1.0) -> dict[str, Any]:
        """Return the request to the tape of the poses for a column or a name."""
        if not each.key:
            return {"zero": 1}
        request: dict[str, Any] = {"row": self.row(each.key) + each.imaginary, **self.locking(each.key)}
        if each.less:
            request["less"] = self.row(each.less)
        if each.link:
            request["turns"] = 1
        if each.order:
            request["order"] = each.order
        return request

    def locking(self, key: Quantity) -> dict[str, Any]:
        """Return whether a quantity depends on the friction of joints, and so has no value where they lock."""
        locks = self.mechanism.friction and (key.is_joint_force or isinstance(key, Effort))
        return {"locks": 1} if locks else {}

    # --- tapes ----------------------------------------------------------------------------------------------------
    def tapes(self, drawn: Mapping[str, Number]) -> dict[str, Tape]:
        """The tapes of the page, after all rows are numbered."""
        written = self.written
        groups = written.plan.groups
        closed = [g.name for g in written.closed]
        every = Closed(tuple(g.name for g in groups))
        tapes = {
            "pose": written.tape((*self.keys, every)),
            "choice": written.choice,
            "margins": written.tape([Margin(name) for name in closed]),
            "short": written.short,
            "drawn": written.recording.recorder.tape(dict(drawn)),
        }
        if self.traced:
            places = [Point(self.mechanism.points[name][0], 0j, name, 0) for name in self.traced]
            tapes["paths"] = written.tape((*places, every))
        tapes |= profiles(written.mechanism, written.recording.recorder)
        if self._bears:
            system = self._bears.system.items()
            entries = {f"{row} {column}": value for (row, column), value in system}
            tapes["statics"] = written.recording.recorder.tape(entries)
        if self._rubs:
            names = [f"friction {n}" for n in range(self._rubs)]
            rubs = [Rub(n) for n in range(self._rubs)]
            tapes["slips"] = written.tape([Slip(n) for n in range(self._rubs)])
            tapes["rubs"] = written.tape(rubs)
            tapes["slopes"] = written.evaluation(rubs, tuple(names), False)
        if self._loaded and self.written.recording.tables:
            tapes["over"] = written.tape([Over(i) for i in range(len(self.written.recording.tables))])
        if any(g.kind == "Newton" for g in groups):
            tapes |= {"steps": written.steps, "guessed": written.guessed}
        winding = [body for g in written.closed for body in self._closed(g)["winds"]]
        if winding:
            tapes["winds"] = written.tape([Angle(body, 0) for body in winding])
        if self.mechanism.torsion_springs:
            springs = range(len(self.mechanism.torsion_springs))
            tapes["twists"] = written.tape([Twist(i) for i in springs])
        return tapes

    def document(self) -> dict[str, Any]:
        """Return the data of the mechanism for the page, other than its tapes."""
        m, written = self.mechanism, self.written
        iterated = {g.name for g in written.plan.groups if g.kind == "Newton"}
        closed = {g.name for g in written.closed}
        groups = [
            {"name": g.name, **(self._iterated(g) if g.name in iterated else self._closed(g))}
            for g in written.plan.groups
            if g.name in closed or g.name in iterated
        ]
        return {
            "dimensions": [
                [d.path, d.kind, float(np.real(value(m, d.path)))] for d in self.dimensions.values()
            ],
            "inputs": [self._input(j) for j in range(len(m.inputs))],
            "groups": groups,
            "phases": written.phases,
            "pace": self._pace,
            "springs": [s.turns for s in m.torsion_springs],
            "tables": [self._table(load) for load in self.written.recording.tables] if self._loaded else [],
            "files": self._files(),
            **({"statics": self._statics(self._bears)} if self._bears else {}),
            **({} if self.poses.time is None else {"time": packed(self.poses.time)}),
            "size": float(m.size),
            "n": self.poses.n,
            "comesBack": bool(iterated and len(m.inputs) == 1 and self.assembly.track.whole),
            "toml": toml_template(m, list(self.dimensions)),
        }

    @property
    def _loaded(self) -> bool:
        """Whether forces are among the quantities."""
        return any(key.is_force for key in self.keys)

    @property
    def _rubs(self) -> int:
        """Return the number of contacts with friction, if forces are among the quantities."""
        return len(self.written.recording.forces.case.contacts) if self._loaded else 0

    def _files(self) -> list[str]:
        """The tables that the file names."""
        parts = (*self.mechanism.inputs, *self.mechanism.forces, *self.mechanism.torques)
        tables = [getattr(part, "history", None) for part in parts]
        return sorted({getattr(table, "name", "") for table in tables} - {""})

    @property
    def _bears(self) -> PoseForces | None:
        """The forces, where those of joints are among the quantities and statics alone is redundant."""
        carried = any(key.is_joint_force for key in self.keys)
        forces = self.written.recording.forces if carried else None
        return forces if forces is not None and forces.redundant else None

    @staticmethod
    def _statics(of: PoseForces) -> dict[str, Any]:
        """Return the places of the entries in the equations of all links: (row, column) each, the last column that of b."""
        count = len(of.unknowns)
        places = [[row, count if column is None else column] for row, column in of.system]
        return {"count": count, "rows": 1 + max(row for row, _ in places), "places": places}

    def _table(self, load: Tabled) -> dict[str, Any]:
        """A load's table: its rows; whether it is periodic, and whether the whole turns of its angle are unknown."""
        at, force = (np.array(column) for column in zip(*load.table, strict=True))
        bases = load.axis == "angle" and self.written.plan.angles[load.body].bases
        return {
            "at": list(map(float, at)),
            "x": list(map(float, force.real)),
            "y": list(map(float, force.imag)),
            "periodic": load.periodic,
            "turns": bool(bases),
        }

    def _closed(self, group: Group) -> dict[str, Any]:
        """A group with a closed form: its sign, and which of its links' whole turns are counted."""
        winding = self.written.recording.geared.intersection(group.members)
        return {"sign": self.assembly.signs[group.name], "winds": sorted(winding)}

    @property
    def _pace(self) -> int:
        """Return the factor by which the page refines its steps along the input, for links that gears turn fast."""
        track = self.assembly.track
        if not track.active:
            return 1
        usual = (self.mechanism.size if track.slides else 2 * np.pi) / SAMPLES
        pace = track.pace
        fast = [max([pace.fastest(g), *pace.driving(g).values()]) for g in self.assembly.plan.groups]
        return max(1, *(int(np.ceil(usual * of / FINE)) for of in fast), 1)

    def _iterated(self, group: Group) -> dict[str, Any]:
        """A group without a closed form: its unknowns at the guess, and what the guess says of them."""
        known, _ = known_by_guess(self.mechanism)
        return {
            "start": list(self.assembly.starts[group.name]),
            "angles": len(group.angles),
            "rows": 2 * len(group.closures),
            "free": self.written.free[group.name],
            "sure": all(body in known for body in group.angles),
            "informed": informed(self.mechanism, group),
        }

    def _input(self, j: int) -> dict[str, Any]:
        m = self.mechanism
        entry = m.inputs[j]
        paths = {
            str(d.where[2]): d.path
            for d in self.dimensions.values()
            if d.where[0] == "inputs" and d.where[1] == j
        }
        rates = [packed(np.ravel(np.asarray(rate[j], dtype=float))) for rate in self.poses.rates]
        return {
            "name": str(entry.name),
            "slides": entry.is_slide,
            "at": float(m.at[j]),
            "follows": m.guess.at is None,
            "paths": [paths.get(rate) for rate in RATES],
            "rates": rates,
            # whether the file has any, be they zero
            "rated": any(getattr(entry, rate) is not None for rate in RATES[1:]),
            "sweep": packed(self.poses.inputs[:, j]),
        }


def computing_page(
    poses: Poses,
    columns: Mapping[str, tuple[Component | int, Shown]],
    named: Sequence[Component],
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
    named : sequence of Component
        The quantities by name.
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
        request: Any = {"input": what} if isinstance(what, int) else formulas.column(what)
        listed[header] = Shown(request, how.header, how.si)
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
        places, numbers = drawn_numbers(
            drawing, draw(formulas.written.mechanism, travel, cam_steps=1), formulas.written.mechanism
        )
        # first: what is written for them says what the document has
        tapes = literal(formulas.tapes(numbers))
        kinds = {"length", "angle", *(d.kind for d in formulas.dimensions.values())}
        model = formulas.document() | {
            "quantities": quantities,
            "drawn": places,
            "cams": cams(drawing, m),
            "handles": handles(m),
            "units": {kind: spelled(LISTED[kind][0]) for kind in kinds} | dict(bare_units or {}),
            "first": list(map(float, poses.inputs[0] if first is None else first)),
            **({"fine": series.fine_inputs, "traced": formulas.traced} if formulas.traced else {}),
        }
        return f"{engine()}\nconst tapes = {tapes};\n", {"model": model}

    return moving_page(m.name, [series, *others], computed=computed)


def page_of(poses: Poses, drawing: Drawing, forces: Forces | None = None) -> Page:
    """Return the page of one motion: it computes itself where its formulas can be written down, else it replays and says why.

    Parameters
    ----------
    drawing : Drawing
        What a page that replays draws.
    forces : Forces, optional
        Those of the motion, where they are to be there too.
    """
    m = poses.mechanism
    named = places(m, ORDERS)
    moves = any(poses.moves)
    listed = [each for each in named if not each.order or moves]
    arrows: list[JointForce] = []
    if forces is not None:
        pairs = forces.reactions.pairs
        every = quantities_of_forces(m, pairs)
        named += every
        listed += [each for each in every if each.key and not each.reverse]
        arrows = [JointForce.of(*pair) for pair in pairs]
    degree = float(np.pi / 180)
    several = len(m.inputs) > 1
    columns: dict[str, tuple[Component | int, Shown]] = {}
    for j, entry in enumerate(m.inputs):
        header = f"{entry.name}_input_m" if entry.is_slide else f"{entry.name}_input_deg"
        header = header if several else header.removeprefix(f"{entry.name}_")
        columns[header] = j, Shown((), header, 1.0 if entry.is_slide else degree)
    for each in listed:
        columns[each.header] = each, Shown((), each.header, degree if each.in_degrees else 1.0)
    made = computing_page(poses, columns, named, arrows)
    if isinstance(made, Page):
        return made
    from virtualwork.animation import of_motion

    return of_motion(poses, drawing, forces, f"This page replays what was computed: {made}.")
