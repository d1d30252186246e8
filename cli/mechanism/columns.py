"""Poses, forces and studies of a mechanism as columns."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cli.mechanism.forces import acts_by_friction, effort_name, rows_of
from cli.mechanism.poses import LINK, POINT, SLIDE, cells, of_links, of_points, of_slide, pair
from cli.mechanism.solve import Analysis
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.mechanism.studies import Document, Studies
    from cli.show.columns import Cell
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Joint

    Reals = NDArray[np.float64]

TURNED = 2 * float(np.finfo(float).eps)  # of an input that was turned to radians and back, or to metres
_UNIT = re.compile(r"_(m|m_s|m_s2|m_s3|deg|rad_s|rad_s2|rad_s3|N|N_m|kg|kg_m|kg_m2|J)\Z")
STUDY_KEYS = ("quantity", "of", "k", "link")
"""The columns that name a row of a study's table."""


def column(header: str, values: Sequence[Cell], error: Callable[[], list[float]] | None = None) -> Column:
    """Return a column by its header, name and unit."""
    unit = _UNIT.search(header)
    if unit is None:
        return Column(header, "", values, error)
    return Column(header[: unit.start()], unit[1], values, error)


def bounds_of(bounds: Reals) -> list[float]:
    """Return bounds as Python's numbers; where there is none, no digit holds."""
    return [math.inf if bound != bound else bound for bound in bounds.tolist()]


def link_error(analysis: Analysis, motion: Motion, name: str, order: int) -> Reals:
    """Bound the error of a link's angle (degrees) or of its rate."""
    if order:
        return motion.link(name).error_estimate(order)
    if name in analysis.given:
        return TURNED * np.abs(analysis.given[name])
    angle = np.degrees(motion.link(name).error_estimate(0))
    # in degrees it lies in a whole turn
    return np.asarray(angle + np.finfo(float).eps * 360)


def _point_error(motion: Motion, name: str, order: int) -> Reals:
    return motion.point(name).error_estimate(order)


def _slide_error(motion: Motion, name: str, order: int) -> Reals:
    return motion.slide(name).error_estimate(order)


def _together(analysis: Analysis, motion: Motion) -> None:
    """Form the bounds of all places and rates of a motion that its table shows."""
    orders = range(analysis.order + 1)
    keys = [motion.point(name).key(k) for name in analysis.points for k in orders]
    keys += [motion.slide(name).key(k) for name in analysis.slides for k in orders]
    # an angle that was given is as it was given
    keys += [
        motion.link(name).key(k) for name in analysis.links for k in orders if k or name not in analysis.given
    ]
    motion.rounding.together(keys)


def _all_forces(motion: Motion) -> None:
    motion.dynamics.error_estimate().together()


class _Stack:
    """Columns that grow by the poses of one assembly after the other."""

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self._values: dict[str, list[Cell]] = {}
        self._errors: dict[str, list[Callable[[], Reals]]] = {}
        # forms bounds that have most of their work in common, before the first is asked for
        self.before: list[Callable[[], None]] = []

    def put(self, header: str, values: Iterable[Cell], error: Callable[[], Reals] | None = None) -> None:
        """Add the cells of an assembly."""
        self._values.setdefault(header, []).extend(values)
        if error is not None:
            self._errors.setdefault(header, []).append(error)

    def begin(self, motion: Motion, number: int) -> None:
        """Add the columns that name a row."""
        inputs = self._analysis.inputs
        self.put("step", inputs.steps)
        if self._analysis.several:
            self.put("branch", [str(number)] * motion.n)

    def input(self, j: int) -> None:
        """Add an input as it was asked for."""
        shown = self._analysis.inputs.shown[:, j]
        self.put(self._analysis.input_columns[j], shown.tolist(), lambda: TURNED * np.abs(shown))

    def _error(self, header: str) -> list[float]:
        while self.before:
            self.before.pop()()
        return [bound for error in self._errors[header] for bound in bounds_of(error())]

    def table(self) -> Table:
        """Return what has been put."""
        columns = [
            column(header, values, partial(self._error, header) if header in self._errors else None)
            for header, values in self._values.items()
        ]
        return Table(columns, keys=pose_keys(self._analysis))


def pose_keys(analysis: Analysis) -> tuple[str, ...]:
    """Return the columns that name a pose or a link in it."""
    return ("step", "branch", "link", *analysis.input_columns)


def poses(analysis: Analysis) -> Table:
    """One row for each pose and assembly: what --only asks for, side by side."""
    stack = _Stack(analysis)
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        stack.begin(motion, assembly.number)
        for j in range(len(analysis.mechanism.inputs)):
            stack.input(j)
        stack.before.append(partial(_together, analysis, motion))
        for name, point in of_points(motion, analysis.points, analysis.order).items():
            for key, values in point.items():
                k = next(k for k, keys in enumerate(POINT) if key in keys)
                stack.put(f"{name}_{key}", values, partial(_point_error, motion, name, k))
        for name in analysis.slides:
            for key, values in of_slide(motion, name, analysis.order).items():
                stack.put(f"{name}_{key}", values, partial(_slide_error, motion, name, SLIDE.index(key)))
        for name, link in of_links(motion, analysis.links, analysis.order, analysis.given).items():
            for key, values in link.items():
                error = partial(link_error, analysis, motion, name, LINK.index(key))
                stack.put(f"{name}_{key}", values, error)
    return stack.table()


def forces(analysis: Analysis) -> Table:
    """One row per pose: effort both ways, their difference, every reaction, shaking force and moment."""
    stack = _Stack(analysis)
    several = len(analysis.mechanism.inputs) > 1
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        d = motion.dynamics
        stack.begin(motion, assembly.number)
        stack.before.append(partial(_all_forces, motion))
        for j, entry in enumerate(analysis.mechanism.inputs):
            stack.input(j)
            prefix, name = f"{entry.name}_" if several else "", effort_name(entry.is_slide)
            euler, work = d.newton_euler[:, j], d.effort[:, j]
            of_euler, of_work = (
                partial(_effort, motion, j, "newton_euler"),
                partial(_effort, motion, j, "effort"),
            )
            stack.put(f"{prefix}input_{name}", cells(euler), of_euler)
            stack.put(f"{prefix}virtual_work_{name}", cells(work), of_work)
            of_both = partial(_effort, motion, j, "newton_euler", "effort")
            stack.put(f"{prefix}difference_{name}", cells(euler - work), of_both)
        for joint, on, of in rows_of(analysis, motion):
            lead = f"{joint.name}_{of}_on_{on}"
            of_force, of_moment = partial(_joint, motion, joint, on, 0), partial(_joint, motion, joint, on, 1)
            for axis, values in zip("xy", pair(d.joint_force(joint, on)), strict=True):
                stack.put(f"{lead}_f{axis}_N", values, of_force)
            moment = d.joint_moment(joint, on)
            # the blocks of a sweep all have the column that one of them may need
            rubs = acts_by_friction(motion, joint, on) if analysis.block_of else moment.any()
            if joint.guide is not None or rubs:
                stack.put(f"{lead}_moment_N_m", cells(moment), of_moment)
        shaking, moment = d.shaking
        for k, axis in enumerate("xy"):
            stack.put(f"shaking_f{axis}_N", cells(shaking[:, k]), partial(_shaking, motion, 0))
        stack.put("shaking_moment_N_m", cells(moment), partial(_shaking, motion, 1))
    return stack.table()


def _effort(motion: Motion, j: int, *ways: str) -> Reals:
    """Bounds of an input's effort by one way, or of the difference of two."""
    bounds = motion.dynamics.error_estimate()
    return np.asarray(sum(getattr(bounds, way)[:, j] for way in ways))


def _shaking(motion: Motion, moment: int) -> Reals:
    return np.asarray(motion.dynamics.error_estimate().shaking[moment])


def _joint(motion: Motion, joint: Joint, on: str, moment: int) -> Reals:
    bounds = motion.dynamics.error_estimate()
    return bounds.joint_moment(joint, on) if moment else bounds.joint_force(joint, on)


def studies(found: Studies) -> dict[str, Callable[[], Table]]:
    """Return the tables of the studies, by their options' names."""
    document = found.document
    tables: dict[str, Callable[[], Table]] = {
        "--newton": lambda: of_iterates(document),
        "--check": lambda: of_check(document["check"]),
        "--equilibrium": lambda: of_equilibria(document["equilibria"], found.analysis.input_names),
        "--flywheel": lambda: of_cycle(document["cycle"]),
        "--counterweights": lambda: of_counterweights(document["counterweights"]),
    }
    return {flag: tables[flag] for flag in found.request.tables if flag != "--forces"}


def of_check(document: Document) -> Table:
    """What the mechanism is: a row for each statement, named as in the JSON."""
    rows: list[tuple[str, str, Cell]] = [
        ("mobility", "", document["mobility"]),
        ("mobility_by_rank", "", document["mobility_by_rank"]),
        *(("redundant", name, True) for name in document["redundant"]),
        *(("group", " + ".join(g["links"]), f"{g['kind']}, {g['method']}") for g in document["groups"]),
    ]
    for f in document["four_bars"]:
        links = ", ".join(f["links"])
        rows.append(("grashof", links, f["grashof"]))
        for word, value in zip(("least", "largest"), f["transmission_deg"], strict=True):
            rows.append((f"{word}_transmission_deg", links, value))
    for key in document:
        if key.startswith(("input_limits", "dead_points", "change_points")):
            values = ["none"] if not document[key] else ["open" if v is None else v for v in document[key]]
            rows += [(key, str(i) if len(values) > 1 else "", v) for i, v in enumerate(values, 1)]
    return _columns(("quantity", "of", "value"), rows)


def of_equilibria(found: list[Document], inputs: dict[str, str]) -> Table:
    """The positions of rest; `inputs`: the name of each input and of its quantity, `input_deg` or `input_m`."""
    if len(inputs) == 1:
        places = [[row[key] for key in inputs.values()] for row in found]
        names = list(inputs.values())
    else:
        places = [[row["inputs"][name][key] for name, key in inputs.items()] for row in found]
        names = [f"{name}_{key}" for name, key in inputs.items()]
    rows = [(*place, row["stable"], row["potential_J"]) for place, row in zip(places, found, strict=True)]
    return _columns((*names, "stable", "potential_J"), rows)


def of_cycle(part: Document) -> Table:
    """Mean, peak and RMS effort, work, flywheel: one row."""
    return _records([part])


def of_counterweights(part: Document) -> Table:
    """A counterweight a row, with the shaking force before and after all of them."""
    rms = {key: value for key, value in part.items() if key != "weights"}
    return _records([w | rms for w in part["weights"]])


def of_iterates(part: Document) -> Table:
    """The iterates of Newton and Raphson."""
    return _records(part["iterates"])


def _records(rows: list[Document]) -> Table:
    return _columns(list(rows[0]), [list(row.values()) for row in rows])


def _columns(names: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    columns = [column(name, [row[i] for row in rows]) for i, name in enumerate(names)]
    return Table(columns, keys=("step", "branch", *STUDY_KEYS))
