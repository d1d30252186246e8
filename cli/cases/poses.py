"""Poses and forces of a mechanism as tables, and as the JSON document has them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.quantities import (
    TURNED,
    bound,
    bounds_of,
    cells,
    cells_of,
    form_bounds,
    in_rows,
    keys_of,
    nested,
    solved,
)
from dalembert.results.columns import Column, Table
from virtualwork.formulas.forces import JointMoment
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.cases.quantities import Numbers, Reals
    from dalembert.results.columns import Cell, Document
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.motion import Motion

_UNIT = re.compile(r"_(m|m_s|m_s2|m_s3|deg|rad_s|rad_s2|rad_s3|N|N_m|kg|kg_m|kg_m2|J)\Z")


def column(header: str, values: Sequence[Cell], error: Callable[[], list[float]] | None = None) -> Column:
    """Return a column by its header, name and unit."""
    unit = _UNIT.search(header)
    if unit is None:
        return Column(header, "", values, error)
    return Column(header[: unit.start()], unit[1], values, error)


def pose_keys(analysis: Analysis) -> tuple[str, ...]:
    """Return the columns that name a pose or a link in it."""
    return ("step", "branch", "link", *analysis.input_columns)


def table(analysis: Analysis, computed: Sequence[Mapping[Quantity, Any]] = ()) -> Table:
    """A row for each pose, one assembly after the other.

    `computed`: what the poses of each assembly have computed already; there are no bounds of it.
    """
    wanted = analysis.tabled
    n, shown, driven = analysis.inputs.n, analysis.inputs.whole.shown, analysis.set_angles
    every = computed or [solved(motion, keys_of(wanted)) for motion in analysis.motions]
    times = len(every)
    parts = [cells_of(wanted, each, n, driven) for each in every]

    @cache
    def formed() -> None:
        for motion in analysis.motions:
            form_bounds(motion, wanted, driven)

    def error(each: Component) -> list[float]:
        formed()
        bounds = [sum(bound(motion, key, driven) for key in keys_of([each])) for motion in analysis.motions]
        if each.polar == "angle":
            # across the vector, over its length
            lengths = [np.abs(of[each.key] - of[each.less]) for of in every]
            with np.errstate(divide="ignore", invalid="ignore"):
                bounds = [
                    np.degrees(b / size) + TURNED * 360 for b, size in zip(bounds, lengths, strict=True)
                ]
        return [b for each in bounds for b in bounds_of(each)]  # type: ignore[arg-type]

    columns = [Column("step", "", [*analysis.inputs.whole.steps] * times)]
    if analysis.several:
        numbers = [str(assembly.number) for assembly in analysis.assemblies for _ in range(n)]
        columns.append(Column("branch", "", numbers))
    columns += [
        column(header, values.tolist() * times, partial(bounds_of, np.tile(TURNED * np.abs(values), times)))
        for header, values in zip(analysis.input_columns, shown.T, strict=True)
    ]
    for each in wanted:
        values = parts[0][each] if times == 1 else [v for part in parts for v in part[each]]
        if _has_column(analysis, each, values):
            columns.append(
                column(each.header, values, None if computed or not each.key else partial(error, each))
            )
    return Table(columns, keys=pose_keys(analysis))


def _has_column(analysis: Analysis, each: Component, values: Numbers) -> bool:
    """Whether a table has it: the moment of a pin only where friction makes one, or where it is requested by name."""
    only = analysis.request.only
    if only is not None and not set(only).isdisjoint(each.names):
        return True
    if not isinstance(each.key, JointMoment) or each.key.joint.startswith("guide:"):
        return bool(each.key)
    if not analysis.block_of:
        return any(value != 0 for value in values)
    # the blocks of a sweep all have the column that one of them may need
    return any(
        load.path is None and (load.joint, load.body) == (each.key.joint, each.key.body)
        for motion in analysis.motions
        for load in motion.dynamics.scene.friction
    )


def by_link(analysis: Analysis) -> Table:
    """A row for each pose and link of the first assembly, for a file of expected values in that form."""
    wanted = [each for each in analysis.places if each.path[0] == "links"]
    names = list(dict.fromkeys(each.path[1] for each in wanted))
    heads = list(dict.fromkeys(each.path[2] for each in wanted))
    solved_here = solved(analysis.motions[0], keys_of(wanted))
    shown = cells_of(wanted, solved_here, analysis.inputs.n, analysis.set_angles)
    numbers = {each.path[1:]: values for each, values in shown.items()}
    steps = analysis.inputs.whole.steps
    columns = [
        Column("step", "", [step for step in steps for _ in names]),
        Column("link", "", names * len(steps)),
        *(
            column(
                head,
                [
                    numbers[name, head][i] if (name, head) in numbers else None
                    for i in range(len(steps))
                    for name in names
                ],
            )
            for head in heads
        ),
    ]
    return Table(columns, keys=("step", "link"))


# --- as JSON ----------------------------------------------------------------------------------------------------------
def documents(analysis: Analysis) -> list[Document]:
    """The poses as the JSON document has them, every assembly after the other at each input."""
    listed = []
    keys = keys_of(in_json(analysis))
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        computed, whole = solved(motion, keys), analysis.assembled(motion)
        condition = motion.condition if analysis.request.only is None else None
        marks = marks_of(analysis, motion)
        listed.append(poses_of(analysis, assembly.number, computed, whole, condition, marks))
    return [pose for each in zip(*listed, strict=True) for pose in each]


def in_json(analysis: Analysis) -> list[Component]:
    """What the document has of every pose."""
    return _moving(analysis) + analysis.forces


def _moving(analysis: Analysis) -> list[Component]:
    return sorted(
        analysis.places, key=lambda each: ("links", "points", "slides", "cams", "vectors").index(each.path[0])
    )


def poses_of(
    analysis: Analysis,
    branch: int,
    computed: Mapping[Quantity, Any],
    assembled: NDArray[np.bool_],
    condition: Reals | None,
    marks: list[list[str]],
) -> Iterator[Document]:
    """The poses of one assembly, from what they have computed."""
    n, driven, m = len(assembled), analysis.set_angles, analysis.mechanism
    shown = {
        e.name: {analysis.input_names[e.name]: values.tolist()}
        for e, values in zip(m.inputs, analysis.inputs.whole.shown.T, strict=True)
    }
    tree: Document = {**(next(iter(shown.values())) if len(m.inputs) == 1 else {"inputs": shown})}
    tree |= {"branch": [branch] * n, "assembled": assembled.tolist()}
    if condition is not None:
        tree["condition"] = cells(condition)
    tree |= {"marks": marks} | nested(cells_of(_moving(analysis), computed, n, driven, assembled), n)
    if analysis.forces:
        tree |= nested(cells_of(analysis.forces, computed, n, driven), n)
    return in_rows(tree, n)


def pose_head(analysis: Analysis, i: int) -> Document:
    """What names a pose in JSON: `input_deg`, or `inputs` of several."""
    shown = analysis.inputs.whole.shown[i].tolist()
    every = {
        e.name: {analysis.input_names[e.name]: value}
        for e, value in zip(analysis.mechanism.inputs, shown, strict=True)
    }
    return next(iter(every.values())) if len(every) == 1 else {"inputs": every}


def over_poses(analysis: Analysis, entries: list[Document]) -> Document:
    """What a topic has in JSON: of one pose its entry, of several the list `poses`."""
    if len(entries) == 1:
        return entries[0]
    return {"poses": [{**pose_head(analysis, i), **entry} for i, entry in enumerate(entries)]}


def marks_of(analysis: Analysis, motion: Motion) -> list[list[str]]:
    """What is special about each pose: a change point, a limit of the input, a dead point."""
    result: list[list[str]] = [[] for _ in range(motion.n)]
    track = motion.assembly.track
    if not track.active:
        return result
    near = 1e-9 * track.length
    q = motion.inputs[:, 0]
    for at in track.crossings:
        for i in np.flatnonzero(np.abs(q - at) <= near):
            if "change point" not in result[i]:
                result[i].append("change point")
    if track.has_limits:
        reach = motion.assembly.reach
        for limit in reach.limits():
            for i in np.flatnonzero(np.abs(reach.apart(q, limit.input)) <= near):
                result[i] += [word for word in ("limit", "dead point") if word not in result[i]]
    return result


# --- further tables ---------------------------------------------------------------------------
def listed(names: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    """A table of rows below headers."""
    columns = [column(name, [row[i] for row in rows]) for i, name in enumerate(names)]
    return Table(columns, keys=("step", "branch", "quantity", "of", "k", "link"))
