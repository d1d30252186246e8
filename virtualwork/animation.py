"""A motion as a page that moves: its drawing, its columns, and which of them are whose place, angle, rate and force.

The columns are the caller's, under the names of the CSV with SI units (`H_x_m`, `coupler_angle_deg`, `H_vx_m_s`, …), and stand
in the page with every digit of a position. What the drawing needs beyond them is added here: places of points that the columns
leave out, and where nothing has a speed the velocities for a unit of the input, from which instant centres follow.

A page holds a list of series: the first is drawn in full, the others as ghosts over it (other assemblies, variants).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.page import Page, Shown, fits, packed, page, rounded
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.drawing import Circle, Coil, Drawing, Line, Row, Shape, tracers
from virtualwork.forces import Forces
from virtualwork.formulas.kinematics import AnglePartial, PointPartial
from virtualwork.formulas.numbers import xy
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.quantity import Quantity
from virtualwork.motion_table import columns

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from virtualwork.plan.steps import Joint

TURN = 6.0
"""The time of a turn of the input at speed 1, s."""
FINE = 181
"""The least number of poses a turn of a drawn path."""
# what keeps every digit, with inputs and times; of rates and forces the page keeps seven
_PLACE = re.compile(r"_([xy]_m|position_m|deg|rad)\Z")
_RATES = {"v": "v{}_m_s", "a": "a{}_m_s2"}


@dataclass(frozen=True)
class JointForce:
    """A joint's force on a link: the joint's point, what it is called, and the column of its x; that of y is named alike."""

    point: str
    name: str
    column: str

    @classmethod
    def of(cls, joint: Joint, on: str, of: str) -> JointForce:
        """Return a joint's force on a link from another, its columns named as in the CSV."""
        return cls(joint.name, f"{joint.name}: {of} on {on}", f"{joint.name}_{of}_on_{on}_fx_N")


@dataclass
class Series:
    """Poses of one mechanism with their columns.

    Parameters
    ----------
    poses, drawing
        What moves, and what it is drawn as.
    columns : mapping
        Of numbers, under their SI names; (n,) each.
    over : sequence of str
        The columns of the inputs, or of time.
    fine : bool
        Draw paths over the inputs' range where the poses are too few to draw them; else through the poses alone.
    """

    poses: Poses
    drawing: Drawing
    columns: Mapping[str, Shown]
    over: Sequence[str]
    forces: Sequence[JointForce] = ()
    name: str = ""
    fine: bool = True
    _packed: list[dict[str, Any]] = field(default_factory=list)
    _index: dict[str, int] = field(default_factory=dict)

    @property
    def mechanism(self) -> Description:
        """The mechanism that is drawn."""
        return self.poses.mechanism

    def document(self) -> dict[str, Any]:
        """Return the series as the page reads it."""
        m = self.mechanism
        self._packed, self._index = [], {}
        owners = sorted({*m.links, *m.points}, key=len, reverse=True)
        for name, shown in self.columns.items():
            owner = next((o for o in owners if name.startswith(f"{o}_")), "")
            exact = name in self.over or bool(_PLACE.search(name))
            k = self._add(name, shown.values, shown.header, owner, exact)
            if shown.si != 1:
                self._packed[k]["si"] = shown.si
        names = list(m.points)
        timed = self.poses.moves[0] and all(
            f"{name}_vx_m_s" in self._index for name in names if name not in m.ground
        )
        unit = not timed and len(m.inputs) == 1
        points = [self._point(name, unit) for name in names]
        paths = self._paths([name for name in names if name not in m.ground])
        for point in points:
            if point["name"] in paths:
                point["path"] = paths[point["name"]]
        order = list(m.bodies)
        return {
            "name": self.name,
            "n": self.poses.n,
            "columns": self._packed,
            "over": [self._index[name] for name in self.over],
            "points": points,
            "bodies": [self._body(name, names, unit) for name in order],
            "pins": [[order.index(body) for body in bodies] for bodies in m.pins.values()],
            "shapes": [_shape(shape, order) for shape in self.drawing.parts],
            "labels": [
                {"of": one.of, "b": order.index(one.body), "z": _pairs([one.at]), "t": one.text}
                for one in self.drawing.labels
            ],
            "forces": [
                {
                    "name": f.name,
                    "point": names.index(f.point),
                    "x": self._index[f.column],
                    "y": self._index[f.column.replace("_fx_", "_fy_")],
                }
                for f in self.forces
            ],
            "fine": self.fine_inputs[2] if paths and self.fine_inputs else 0,
            "timed": not unit,
            **self._free(names),
        }

    def _free(self, names: list[str]) -> dict[str, Any]:
        """Return the free-body diagrams of the page; empty on a page that replays."""
        return {}

    def _add(
        self, name: str, values: ArrayLike, header: str = "", owner: str = "", exact: bool = True
    ) -> int:
        """Add a column; without a header the page does not list it."""
        self._index[name] = len(self._packed)
        self._packed.append({"header": header, "owner": owner, **packed(values, exact)})
        return self._index[name]

    def _column(self, name: str, values: Callable[[], ArrayLike]) -> int:
        """Return the place of a column of places or angles, added where the caller's have it not."""
        return self._index[name] if name in self._index else self._add(name, values(), name)

    def _point(self, name: str, unit: bool) -> dict[str, Any]:
        m = self.mechanism
        body, place = m.points[name]
        entry: dict[str, Any] = {
            "name": name,
            "moves": body != GROUND,
            "trace": name in tracers(m),
            "x": self._column(f"{name}_x_m", lambda: self.poses.point(body, place, 0, name).real),
            "y": self._column(f"{name}_y_m", lambda: self.poses.point(body, place, 0, name).imag),
        }
        for key, form in _RATES.items():
            columns = [f"{name}_{form.format(axis)}" for axis in "xy"]
            if all(column in self._index for column in columns):
                entry[key] = [self._index[column] for column in columns]
        if unit and body != GROUND:
            rates = self._unit_rates(PointPartial(body, place, name, 0, 1))
            entry["v"] = [
                self._add(f"{name} {axis}", v, exact=False) for axis, v in zip("xy", rates, strict=True)
            ]
        return entry

    def _body(self, name: str, names: list[str], unit: bool) -> dict[str, Any]:
        points = self.mechanism.bodies[name]
        entry: dict[str, Any] = {
            "name": name,
            "points": [names.index(p) for p in points],
            "point": names.index(next(iter(points))) if points else None,
            "at": _pairs([next(iter(points.values()), 0j)]),
            "angle": None,
            "omega": None,
        }
        if name != GROUND:
            angles = (f"{name}_angle_deg", f"{name}_angle_rad")
            angle = next((a for a in angles if a in self._index), angles[1])
            entry["angle"] = self._column(angle, lambda: self.poses.angle(name))
            entry["omega"] = self._index.get(f"{name}_omega_rad_s")
            entry["alpha"] = self._index.get(f"{name}_alpha_rad_s2")
            if unit:
                (rate,) = self._unit_rates(AnglePartial(name, 0, 1))
                entry["omega"] = self._add(f"{name} omega", rate, exact=False)
        return entry

    def _unit_rates(self, key: Quantity) -> list[Any]:
        """Return the columns of a derivative to the one input, that of x and of y."""
        z = self.poses.values([key])[0]
        return list(xy(z).T) if np.iscomplexobj(z) else [z]

    def _paths(self, names: list[str]) -> dict[str, list[Any]]:
        """Return the paths of points where the poses themselves are too few to draw them."""
        if not self.fine_inputs:
            return {}
        m, poses = self.mechanism, self.poses.again(np.linspace(*self.fine_inputs)[:, None])
        places = {name: poses.point(*m.points[name], 0, name) for name in names}
        return {name: [packed(part, exact=False) for part in (z.real, z.imag)] for name, z in places.items()}

    @cached_property
    def fine_inputs(self) -> tuple[float, float, int] | None:
        """The first and the last input of a path that is drawn finer than the poses, and how many; None where they are enough."""
        m, q = self.mechanism, self.poses.inputs
        if len(m.inputs) != 1 or not self.fine:
            return None
        slide = m.inputs[0].is_slide
        low, high = float(np.nanmin(q)), float(np.nanmax(q))
        if low == high and not slide:
            high = low + 2 * np.pi
        turns = 1.0 if slide else (high - low) / (2 * np.pi)
        count = int(np.clip(np.ceil(FINE * turns), FINE if slide else 2, 8 * FINE))
        return None if low == high or len(q) >= count else (low, high, count)


def _pairs(points: Sequence[complex]) -> list[float]:
    z = np.asarray(points, dtype=complex)
    return rounded(np.stack([z.real, z.imag], axis=-1))


def _shape(shape: Shape | Row, order: list[str]) -> dict[str, Any]:
    entry: dict[str, Any] = {"r": shape.role, "b": order.index(shape.body)}
    if isinstance(shape, Line):
        entry |= {"p": _pairs(shape.points)} | ({"c": 1} if shape.closed else {})
    elif isinstance(shape, Row):
        entry |= {"p": _pairs(shape.points), "d": _pairs([shape.step]), "n": shape.count}
        entry |= {"j": 1} if shape.joined else {}
    elif isinstance(shape, Circle):
        entry |= {"z": _pairs([shape.centre]), "s": rounded([shape.radius])[0]}
    elif isinstance(shape, Coil):
        ends = [(order.index(body), *_pairs([z])) for body, z in shape.ends]
        # along 0 -> 1: the real part is the share of its length, the imaginary part a distance sideways
        entry |= {"p": _pairs(shape.along(0, 1)), "ends": [x for end in ends for x in end]}
    return entry


def moving_page(
    title: str,
    series: Sequence[Series],
    time: str = "",
    computed: Callable[[], tuple[str, dict[str, Any]]] | None = None,
    note: str = "",
) -> Page:
    """Return the page of a mechanism's motion.

    Parameters
    ----------
    series : sequence of Series
        The first is drawn in full, the others as ghosts.
    time : str
        The column of the poses' own times, s; without it a turn of the input takes some seconds.
    computed : callable
        Returns the script that computes the first series anew, and the data that it reads.
    note : str
        What the page says below its drawing.

    Raises
    ------
    ValueError
        More poses than a page can hold.
    """
    fits(series[0].poses.n)
    documents = [one.document() for one in series]
    first, m = series[0], series[0].mechanism
    columns = [column["header"] for column in documents[0]["columns"]]
    slide = m.inputs[0].is_slide
    rate = "m/s" if documents[0]["timed"] else f"m for each {'m' if slide else 'rad'} of the input"
    span = float(np.ptp(first.poses.inputs[:, 0])) if first.poses.n else 0.0
    # a motion in time begins anew, wherever it ended
    wraps = bool(time) or (first.poses.n > 1 and all(_comes_back(first, name) for name in m.links))
    rest: dict[str, Any] = {
        "units": {"v": rate, "a": "m/s²", "f": "N"},
        "lasts": TURN if slide or len(m.inputs) > 1 else TURN * max(span / (2 * np.pi), 0.25),
        "wraps": wraps,
        "plots": [columns.index(header) for header in _first_plots(first)],
    }
    if time:
        rest["clock"] = documents[0]["over"][0]
    if time or len(m.inputs) == 1:
        rest["x"] = documents[0]["over"][0]
    if note:
        rest["note"] = note
    script, more = ("", {}) if computed is None else computed()
    return page(title, "plane", documents, script, **rest, **more)


def _first_plots(series: Series) -> list[str]:
    """Return the columns to begin with: an effort where there is one, and the place of a point that draws a path."""
    m = series.mechanism
    free = [p for p in m.points if p not in m.ground]
    moving = dict.fromkeys([*tracers(m), *free])
    efforts = [name for name in series.columns if "virtual_work" in name]
    names = [*efforts[:1], *(f"{p}_{axis}_m" for p in moving for axis in "yx"), *series.columns]
    return [series.columns[name].header for name in names if name in series.columns][:2]


def _comes_back(series: Series, link: str) -> bool:
    """Return whether a link ends at its first position."""
    first = next(iter(series.mechanism.links[link].points.items()))
    z = series.poses.point(link, first[1], 0, first[0])[[0, -1]]
    turned = np.exp(1j * series.poses.angle(link)[[0, -1]])
    gap = max(abs(z[1] - z[0]) / series.mechanism.size, abs(turned[1] - turned[0]))
    return bool(gap < 1e-6)


def of_motion(poses: Poses, drawing: Drawing, forces: Forces | None, note: str = "") -> Page:
    """Return the page of one motion with the columns of its table, and of its joint forces; `note` is what it says too."""
    table = columns(poses)
    over = list(table)[: poses.inputs.shape[1]]
    del table["assembled"]
    pairs = () if forces is None else forces.reactions.pairs
    arrows = [JointForce.of(*pair) for pair in pairs]
    if forces is not None:
        table |= force_columns(forces, pairs)
    return moving_page(poses.mechanism.name, [Series(poses, drawing, plain(table), over, arrows)], note=note)


def force_columns(forces: Forces, pairs: Iterable[tuple[Joint, str, str]]) -> dict[str, ArrayLike]:
    """Return the columns of joint forces: (joint, on, from) each."""
    table: dict[str, ArrayLike] = {}
    for joint, on, of in pairs:
        parts = xy(forces.joint_force(joint, on))
        lead = f"{joint.name}_{of}_on_{on}"
        table |= {f"{lead}_fx_N": parts[:, 0], f"{lead}_fy_N": parts[:, 1]}
    return table


def plain(table: Mapping[str, ArrayLike]) -> dict[str, Shown]:
    """Return columns as a page shows them, in SI units under their own names."""
    return {name: Shown(values, name) for name, values in table.items()}
