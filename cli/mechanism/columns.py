"""Poses and forces of a mechanism as tables, and as the JSON document has them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism import quantities
from cli.mechanism.quantities import (
    TURNED,
    Quantity,
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
from cli.mechanism.solve import Analysis
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.mechanism.quantities import Numbers, Reals
    from cli.show.columns import Cell, Document
    from virtualwork.formulas.asked import Key
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


def table(analysis: Analysis, forces: bool, found: Sequence[Mapping[Key, Any]] = ()) -> Table:
    """A row for each pose, one assembly after the other: what --only asks for side by side, or its forces.

    `found`: what the poses of each assembly have been asked for already; there are no bounds of it.
    """
    wanted = quantities.forces(analysis) if forces else quantities.places(analysis)
    n, shown = analysis.inputs.n, analysis.inputs.shown
    every = found or [solved(motion, keys_of(wanted)) for motion in analysis.motions]
    times = len(every)
    parts = [cells_of(wanted, each, n, analysis.given) for each in every]

    @cache
    def formed() -> None:
        for motion in analysis.motions:
            form_bounds(analysis, motion, wanted)

    def error(each: Quantity) -> list[float]:
        formed()
        return [
            b
            for motion in analysis.motions
            for b in bounds_of(sum(bound(analysis, motion, key) for key in keys_of([each])))  # type: ignore[arg-type]
        ]

    columns = [Column("step", "", [*analysis.inputs.steps] * times)]
    if analysis.several:
        numbers = [str(assembly.number) for assembly in analysis.assemblies for _ in range(n)]
        columns.append(Column("branch", "", numbers))
    inputs = [
        column(header, values.tolist() * times, partial(bounds_of, np.tile(TURNED * np.abs(values), times)))
        for header, values in zip(analysis.input_columns, shown.T, strict=True)
    ]
    columns += [] if forces else inputs
    for each in wanted:
        if each.key[:1] == ("newton-euler",) and not each.less:
            # an input stands before its effort
            columns.append(inputs[each.key[1]])
        values = parts[0][each] if times == 1 else [v for part in parts for v in part[each]]
        if _has_column(analysis, each, values):
            bounds = None if found else partial(error, each)
            columns.append(column(each.header, values, bounds))
    return Table(columns, keys=pose_keys(analysis))


def _has_column(analysis: Analysis, each: Quantity, values: Numbers) -> bool:
    """Whether a table has it: the moment of a pin only where friction makes one."""
    if each.key[:1] != ("moment",) or each.key[1].startswith("guide:"):
        return bool(each.key)
    if not analysis.block_of:
        return any(value != 0 for value in values)
    # the blocks of a sweep all have the column that one of them may need
    return any(
        load.path is None and (load.joint, load.body) == each.key[1:]
        for motion in analysis.motions
        for load in motion.dynamics.scene.friction
    )


# --- as JSON ----------------------------------------------------------------------------------------------------------
def document(analysis: Analysis, forces: bool) -> list[Document]:
    """The poses as INTERFACE's JSON has them, every assembly after the other at each input."""
    listed = []
    keys = keys_of(in_json(analysis, forces))
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        found, whole = solved(motion, keys), analysis.assembled(motion)
        condition = motion.condition if analysis.only is None else None
        marks = marks_of(analysis, motion)
        listed.append(poses_of(analysis, assembly.number, found, whole, condition, marks, forces))
    return [pose for each in zip(*listed, strict=True) for pose in each]


def in_json(analysis: Analysis, forces: bool) -> list[Quantity]:
    """What the document has of every pose."""
    return _moving(analysis) + (quantities.forces(analysis) if forces else [])


def _moving(analysis: Analysis) -> list[Quantity]:
    return sorted(
        quantities.places(analysis), key=lambda each: ("links", "points", "slides").index(each.path[0])
    )


def poses_of(
    analysis: Analysis,
    branch: int,
    found: Mapping[Key, Any],
    assembled: NDArray[np.bool_],
    condition: Reals | None,
    marks: list[list[str]],
    forces: bool,
) -> Iterator[Document]:
    """The poses of one assembly, from what they have been asked for."""
    n, given, m = len(assembled), analysis.given, analysis.mechanism
    shown = {
        e.name: {analysis.input_names[e.name]: values.tolist()}
        for e, values in zip(m.inputs, analysis.inputs.shown.T, strict=True)
    }
    tree: Document = {**(next(iter(shown.values())) if len(m.inputs) == 1 else {"inputs": shown})}
    tree |= {"branch": [branch] * n, "assembled": assembled.tolist()}
    if condition is not None:
        tree["condition"] = cells(condition)
    tree |= {"marks": marks} | nested(cells_of(_moving(analysis), found, n, given, assembled), n)
    if forces:
        tree |= nested(cells_of(quantities.forces(analysis), found, n, given), n)
    return in_rows(tree, n)


def marks_of(analysis: Analysis, motion: Motion) -> list[list[str]]:
    """What is special about each pose: a change point, a limit of the input, a dead point."""
    found: list[list[str]] = [[] for _ in range(motion.n)]
    track = motion.assembly.track
    if not track.active:
        return found
    near = 1e-9 * track.length
    q = motion.inputs[:, 0]
    for at in track.crossings:
        for i in np.flatnonzero(np.abs(q - at) <= near):
            if "change point" not in found[i]:
                found[i].append("change point")
    if track.has_limits:
        reach = motion.assembly.reach
        for limit in reach.limits():
            for i in np.flatnonzero(np.abs(reach.apart(q, limit.input)) <= near):
                found[i] += [word for word in ("limit", "dead point") if word not in found[i]]
    return found
