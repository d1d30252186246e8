"""Poses and forces of a mechanism as tables, and as the JSON document has them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.analysis import Analysis
from dalembert.angles import degrees
from dalembert.results.columns import Column, Table
from virtualwork.formulas.forces import Force, JointMoment
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.quantity import Quantity
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.results.columns import Cell, Document
    from virtualwork.motion import Motion

    Reals = NDArray[np.float64]
    Numbers = Sequence[float | None]

# of an input that was turned to radians and back, or to metres
TURNED = 2 * float(np.finfo(float).eps)
_UNIT = re.compile(r"_(m|m_s|m_s2|m_s3|deg|rad_s|rad_s2|rad_s3|N|N_m|kg|kg_m|kg_m2|J)\Z")


def column(header: str, values: Sequence[Cell], error: Callable[[], list[float]] | None = None) -> Column:
    """Return a column by its header, name and unit."""
    unit = _UNIT.search(header)
    if unit is None:
        return Column(header, "", values, error)
    return Column(header[: unit.start()], unit[1], values, error)


# --- what they are ----------------------------------------------------------------------------------------------------
def keys_of(wanted: Iterable[Component]) -> list[Quantity]:
    """Return the keys of components for a motion, each once."""
    return list(dict.fromkeys(key for each in wanted for key in (each.key, each.less) if key))


def solved(motion: Motion, keys: Sequence[Quantity]) -> dict[Quantity, Any]:
    """Solve quantities of a motion in one pass; return them by their keys, (n,)."""
    return dict(zip(keys, motion.values(keys), strict=True))


def cells(values: Reals, finite: NDArray[np.bool_] | None = None) -> Numbers:
    """Return Python's numbers; None where there is none; no −0."""
    finite = np.isfinite(values) if finite is None else finite
    listed: list[float] = (values + 0.0).tolist()
    if finite.all():
        return listed
    return [v if is_finite else None for v, is_finite in zip(listed, finite.tolist(), strict=True)]


def cells_of(
    wanted: Iterable[Component],
    computed: Mapping[Quantity, Any],
    n: int,
    driven: Mapping[str, Reals],
    where: NDArray[np.bool_] | None = None,
) -> dict[Component, Numbers]:
    """Return the numbers of n poses as they are shown.

    Parameters
    ----------
    computed : mapping
        The quantities that the motion has computed.
    driven : mapping
        The requested angles of driven links, degrees.
    where : array (n,) of bool, optional
        The poses that have numbers.
    """
    shown: dict[Component, Numbers] = {}
    finite = np.ones(n, dtype=bool)
    for each in wanted:
        if not each.key:
            # the moment of a pin is zero where there is a force in it
            shown[each] = cells(np.zeros(n), finite)
            continue
        value = computed[each.key]
        if each.less:
            # where neither has a finite value, there is no difference
            with np.errstate(invalid="ignore"):
                value = value - computed[each.less]
        if each.link:
            set_by_hand = each.link in driven
            part = in_one_turn(driven[each.link]) if set_by_hand else degrees(np.exp(1j * value))
            finite = np.isfinite(value)
        else:
            # statics may determine one component of a force alone
            part = each.of(value)
            finite = np.isfinite(part)
        shown[each] = cells(part, finite if where is None else finite & where)
    return shown


def in_one_turn(angle: Reals) -> Reals:
    """Return angles in [0, 360) degrees."""
    reduced = np.mod(angle, 360.0)
    return np.where(reduced >= 360.0, 0.0, reduced)


def form_bounds(motion: Motion, wanted: Iterable[Component], driven: Mapping[str, Reals]) -> None:
    """Form the bounds of all numbers, which have most of the work in common."""
    keys = keys_of(wanted)
    moving = [key for key in keys if not key.is_force]
    if len(moving) < len(keys):
        motion.dynamics.error_estimate().together()
    # an angle that was given is as it was given
    motion.rounding.together(
        [key for key in moving if not (isinstance(key, Angle) and key.is_angle and key.body in driven)]
    )


def bound(motion: Motion, key: Quantity, driven: Mapping[str, Reals]) -> Reals:
    """Bound the error of a quantity, as it is shown."""
    if isinstance(key, Force):
        return np.asarray(motion.dynamics.error_estimate().value(key))
    if not key.is_angle:
        return motion.rounding.of(key)
    if not isinstance(key, Angle):
        return np.asarray(np.degrees(motion.rounding.of(key)))
    if key.body in driven:
        return TURNED * np.abs(driven[key.body])
    value = motion.value(key)
    return np.degrees(motion.rounding.of(key)) + degrees_off(value, degrees(np.exp(1j * value)))


def degrees_off(angle: Reals, shown: Reals) -> Reals:
    """What the degrees as they are shown round besides, whole turns apart."""
    from dalembert.arithmetic.doubled import PI, Doubled

    off = (Doubled(angle) * (180.0 / PI) - shown).value
    return np.asarray(np.abs(off - 360.0 * np.rint(off / 360.0)))


def bounds_of(bounds: Reals) -> list[float]:
    """Return bounds as Python's numbers; where there is none, no digit holds."""
    return [math.inf if bound != bound else bound for bound in bounds.tolist()]


# --- as a table ----
def pose_keys(analysis: Analysis) -> tuple[str, ...]:
    """Return the columns that name a pose or a link in it."""
    return ("step", "branch", "link", *analysis.input_columns)


def table(analysis: Analysis, computed: Sequence[Mapping[Quantity, Any]] = ()) -> Table:
    """Return a table with a row for each pose, one assembly after the other.

    `computed`: quantities of each assembly that are computed already; they have no errors.
    """
    wanted, driven, motions = analysis.tabled, analysis.set_angles, analysis.motions if not computed else ()
    several, headers, inputs = analysis.several, analysis.input_columns, analysis.inputs.whole
    every = computed or [solved(motion, keys_of(wanted)) for motion in motions]
    n, times = len(inputs.shown), len(every)
    parts = [cells_of(wanted, each, n, driven) for each in every]

    @cache
    def formed() -> None:
        for motion in motions:
            form_bounds(motion, wanted, driven)

    def error(each: Component) -> list[float]:
        formed()
        bounds = [sum(bound(motion, key, driven) for key in keys_of([each])) for motion in motions]
        if each.polar == "angle":
            # across the vector, over its length
            lengths = [np.abs(of[each.key] - of[each.less]) for of in every]
            with np.errstate(divide="ignore", invalid="ignore"):
                bounds = [
                    np.degrees(b / size) + TURNED * 360 for b, size in zip(bounds, lengths, strict=True)
                ]
        return [b for each in bounds for b in bounds_of(each)]  # type: ignore[arg-type]

    columns = [Column("step", "", [*inputs.steps] * times)]
    if several:
        numbers = [str(assembly.number) for assembly in analysis.assemblies for _ in range(n)]
        columns.append(Column("branch", "", numbers))
    columns += [
        column(header, values.tolist() * times, partial(bounds_of, np.tile(TURNED * np.abs(values), times)))
        for header, values in zip(headers, inputs.shown.T, strict=True)
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
        for load in motion.dynamics.case.friction
    )


def by_link(analysis: Analysis) -> Table:
    """Return a table with a row for each pose and link of the first assembly: files of expected values may have that form."""
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


SINGULAR = {
    "points": "point",
    "links": "link",
    "slides": "slide",
    "cams": "cam",
    "vectors": "vector",
    "effort": "input",
    "reactions": "joint",
}
"""What a row of the table of a kind of quantities is called."""


def by_owner(analysis: Analysis, table: Table) -> list[Table]:
    """Return the table of one pose as short tables: a row for each point, link, slide and joint.

    The first has what names the pose.
    """
    columns = {column.header: column for column in table.columns}
    kinds: dict[str, dict[tuple[str, ...], dict[str, Column]]] = {}
    kind, owner = "", tuple[str, ...]()
    for each in analysis.tabled:
        shown = columns.get(each.header)
        if shown is None:
            continue
        if each.path:
            kind, *between, head = each.path
            owner = between[-1] if between and isinstance(between[-1], tuple) else tuple(between[-1:])
        elif owner:
            # what tables alone have stands with the quantity before it
            head = each.header.removeprefix(f"{owner[0]}_")
        if not owner:
            head = each.header
        kinds.setdefault(kind, {}).setdefault(owner, {})[head] = shown
    made = [Table([column for column in table.columns if column.header in table.keys])]
    for kind, rows in kinds.items():
        heads = dict.fromkeys(head for row in rows.values() for head in row)
        names = {SINGULAR.get(kind, ""): [owner[0] for owner in rows if owner]}
        if kind == "reactions":
            names |= {"on": [owner[1] for owner in rows], "from": [owner[2] for owner in rows]}
        lead = [Column(name, "", cells) for name, cells in names.items() if cells]
        made.append(Table([*lead, *(of_rows(head, list(rows.values())) for head in heads)], [*names]))
    return made


def of_rows(head: str, rows: Sequence[Mapping[str, Column]]) -> Column:
    """Return a column of the single cells that some rows have below a header."""

    def error() -> list[float]:
        found = (row.get(head) for row in rows)
        return [0.0 if each is None or each.error is None else float(each.error()[0]) for each in found]

    return column(head, [row[head].values[0] if head in row else None for row in rows], error)


# --- as JSON ----------------------------------------------------------------------------------------------------------
def documents(analysis: Analysis) -> list[Document]:
    """Return the poses for the JSON document, one assembly after the other at each input."""
    listed = []
    keys = keys_of(in_json(analysis))
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        computed, whole = solved(motion, keys), analysis.assembled(motion)
        condition = motion.condition if analysis.request.only is None else None
        marks = marks_of(motion)
        listed.append(poses_of(analysis, assembly.number, computed, whole, condition, marks))
    return [pose for each in zip(*listed, strict=True) for pose in each]


def in_json(analysis: Analysis) -> list[Component]:
    """Return the components that the document has."""
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
    """Yield the documents of the poses of one assembly, from computed quantities."""
    n, driven = len(assembled), analysis.set_angles
    tree = _inputs(analysis, analysis.inputs.whole.shown.T.tolist())
    tree |= {"branch": [branch] * n, "assembled": assembled.tolist()}
    if condition is not None:
        tree["condition"] = cells(condition)
    # a cam has quantities of both kinds in one object
    numbers = cells_of(_moving(analysis), computed, n, driven, assembled)
    numbers |= cells_of(analysis.forces, computed, n, driven)
    return in_rows(tree | {"marks": marks} | nested(numbers, n), n)


def pose_head(analysis: Analysis, i: int) -> Document:
    """Return the inputs of a pose for JSON: `input_deg`, or `inputs` of several."""
    return _inputs(analysis, analysis.inputs.whole.shown[i].tolist())


def _inputs(analysis: Analysis, values: Sequence[Any]) -> Document:
    """Return the place of each input's value in JSON: `input_deg`, or below `inputs` of several."""
    pairs = zip(analysis.input_names.items(), values, strict=True)
    every = {name: {key: value} for (name, key), value in pairs}
    return next(iter(every.values())) if len(every) == 1 else {"inputs": every}


def over_poses(analysis: Analysis, entries: list[Document]) -> Document:
    """Return a topic for JSON: the entry of one pose, or the list `poses`."""
    if len(entries) == 1:
        return entries[0]
    return {"poses": [{**pose_head(analysis, i), **entry} for i, entry in enumerate(entries)]}


def marks_of(motion: Motion) -> list[list[str]]:
    """Return the marks of each pose: a change point, a limit of the input, a dead point."""
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


def nested(numbers: Mapping[Component, Numbers], n: int) -> dict[str, Any]:
    """Return the columns of n poses as a tree, at their places in JSON."""
    result: dict[str, Any] = {}
    for each, values in numbers.items():
        if each.path:
            of = result
            for name in each.path[:-1]:
                of = of.setdefault(name, {})
            of[each.path[-1]] = values
    if "reactions" in result:
        result["reactions"] = tuple(
            {"joint": [joint] * n, "on": [on] * n, "from": [of] * n} | force
            for (joint, on, of), force in result["reactions"].items()
        )
    return result


def in_rows(tree: Any, n: int) -> Iterator[Any]:
    """Yield n trees of values from a tree of columns, whose branches are mappings and tuples."""
    if not isinstance(tree, (dict, tuple)):
        return iter(tree)
    if not tree:
        return ({} if isinstance(tree, dict) else [] for _ in range(n))
    rows = zip(*[in_rows(of, n) for of in (tree.values() if isinstance(tree, dict) else tree)], strict=True)
    if isinstance(tree, tuple):
        return map(list, rows)
    names = tuple(tree)
    return (dict(zip(names, row, strict=True)) for row in rows)


# --- further tables ---------------------------------------------------------------------------
def listed(names: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    """Return a table of rows below headers."""
    columns = [column(name, [row[i] for row in rows]) for i, name in enumerate(names)]
    return Table(columns, keys=("step", "branch", "quantity", "of", "k", "link"))
