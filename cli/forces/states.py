"""The link-state table: one row for each pose and link, as `dalembert work` reads it.

The unknown is the input's effort: `?` in the driven link's torque; where that cell holds a known torque, in a row of
its own. A drive that reacts on a moving link, or along a guide, is `?NAME*factor` in each of its components. With
several inputs every pose has as many velocity fields (column `field`): a unit of each input's virtual velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.poses import bound, bounds_of, cells, cells_of, column, keys_of, pose_keys, solved
from dalembert.results.columns import Table
from virtualwork.formulas.forces import Applied, AppliedMoment
from virtualwork.formulas.kinematics import Angle, Carried, Point
from virtualwork.quantities import FORCE, LINK, POINT, links, vector

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.cases.poses import Numbers
    from dalembert.results.columns import Cell
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.motion import Motion

    Part = dict[str, Sequence[Cell]]
    Row = dict[str, Cell]

GROUND = "ground"
ORDER = (
    "step", "branch", "field", "link", "x_m", "y_m", "angle_deg", "mass_kg", "inertia_kg_m2", "vx_m_s", "vy_m_s",
    "omega_rad_s", "ax_m_s2", "ay_m_s2", "alpha_rad_s2", "fx_N", "fy_N", "fvx_m_s", "fvy_m_s", "torque_N_m",
)  # fmt: skip

EXACT = ("step", "branch", "field", "link", "mass_kg", "inertia_kg_m2")


@dataclass(frozen=True)
class Mark:
    """Where an input's unknown effort acts: cells of a link, and for a force, in a guide, its point's velocity."""

    link: str
    cells: Part
    guide: int | None = None


class Place(NamedTuple):
    """What a row is of: a link at a pose of a motion, in the field of an input, or an input's mark alone."""

    motion: Motion
    pose: int
    link: str
    field: int | None
    mark: Mark | None


def table(analysis: Analysis) -> Table:
    """Return centre of mass, angle, rates and loads of every link at every pose."""
    listed = rows(analysis)
    keys = {key for _, row in listed for key in row}

    @cache
    def bounds(motion: Motion, link: str, field: int | None, guide: int | None, name: str) -> list[float]:
        along = motion if field is None else motion.unit(field)
        center = motion.mechanism.rigid[link].center
        if name in ("fvx_m_s", "fvy_m_s"):
            assert guide is not None
            return bounds_of(_guided(motion, guide, link, field))
        key: Quantity = Applied(link) if name in FORCE else AppliedMoment(link)
        if name in LINK:
            key = Angle(link, LINK.index(name))
        for k, names in enumerate(POINT):
            if name in names:
                key = Point(link, center, None, k)
        return bounds_of(bound(along if key.order == 1 else motion, key, analysis.set_angles))

    def error(key: str) -> list[float]:
        result = []
        for place, row in listed:
            guide = None if place.mark is None else place.mark.guide
            value = row.get(key)
            number = isinstance(value, float) and value != 0
            result.append(
                bounds(place.motion, place.link, place.field, guide, key)[place.pose] if number else 0.0
            )
        return result

    columns = [
        column(key, [row.get(key) for _, row in listed], None if key in EXACT else partial(error, key))
        for key in ORDER
        if key in keys
    ]
    return Table(columns, keys=pose_keys(analysis))


def rows(analysis: Analysis) -> list[tuple[Place, Row]]:
    """Return the rows of the table, each with its link, pose and field."""
    rows: list[tuple[Place, Row]] = []
    several = analysis.several
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        order = analysis.order
        massive = any(r.mass or r.inertia for r in motion.mechanism.rigid.values())
        if order == 1 and massive:
            order = 2  # a speed alone already makes accelerations, and masses feel them
        parts = {name: _part(analysis, motion, name, order) for name in analysis.links}
        inputs = analysis.mechanism.inputs
        # with several inputs a virtual velocity field for each of them, else the motion's own velocities
        ways: list[int | None] = [*range(len(inputs))] if order >= 1 and len(inputs) > 1 else [None]
        fields = [
            (
                of,
                {} if of is None else {name: _virtual(motion, name, of) for name in analysis.links},
                _marks(motion, of) if order >= 1 else [],
            )
            for of in ways
        ]
        for i, (step, assembled) in enumerate(
            zip(analysis.inputs.whole.steps, motion.assembled, strict=True)
        ):
            head: Row = {"step": step}
            if several:
                head["branch"] = str(assembly.number)
            for of, velocities, marks in fields:
                lead = head if of is None else {**head, "field": inputs[of].name}
                here = {
                    name: {key: values[i] for key, values in (part | velocities.get(name, {})).items()}
                    for name, part in parts.items()
                }
                extra: list[tuple[Place, Row]] = []
                for mark in marks if assembled else ():
                    if mark.link not in here:
                        continue
                    wanted = {key: values[i] for key, values in mark.cells.items() if values[i] != ""}
                    row = here[mark.link]
                    if any(row.get(key) for key in wanted if key != "omega_rad_s") or "fvx_m_s" in wanted:
                        place = Place(motion, i, mark.link, of, mark)
                        extra.append((place, {**lead, "link": mark.link, **wanted}))
                    else:
                        row |= wanted
                rows += [
                    (Place(motion, i, name, of, None), {**lead, "link": name, **row})
                    for name, row in here.items()
                ]
                rows += extra
    return rows


def _part(analysis: Analysis, motion: Motion, name: str, order: int) -> Part:
    body, highest = motion.mechanism.rigid[name], min(order, 2)
    wanted = links([name], highest)
    for k in range(highest + 1):
        wanted += vector((name,), "", POINT[k], Point(name, body.center, None, k))
    shown = cells_of(wanted, solved(motion, keys_of(wanted)), motion.n, analysis.set_angles)
    part: Part = {"mass_kg": [body.mass] * motion.n, "inertia_kg_m2": [body.inertia] * motion.n}
    part |= {each.path[-1]: values for each, values in shown.items()}
    if order >= 1:
        force, torque = motion.applied(name)
        # a pose that cannot be assembled has no loads either
        assembled = motion.assembled
        part |= _vector(FORCE, force, assembled)
        part["torque_N_m"] = cells(torque, np.isfinite(torque) & assembled)
    return part


def _vector(
    names: Sequence[str], z: NDArray[np.complex128], finite: NDArray[np.bool_] | bool = True
) -> dict[str, Numbers]:
    """Return the components of vectors by their names."""
    whole = np.isfinite(z) & finite
    return dict(zip(names, (cells(z.real, whole), cells(z.imag, whole)), strict=True))


def _virtual(motion: Motion, name: str, j: int) -> Part:
    """Return the virtual velocities of a link for a unit of input j."""
    center = motion.at(name, motion.mechanism.rigid[name].center)
    turning = cells(motion.link(name).coefficient(j))
    return {**_vector(POINT[1], center.coefficient(j)), "omega_rad_s": turning}


def _marks(motion: Motion, field: int | None) -> list[Mark]:
    """Return the marks of every input's effort, with the velocities of one field (None: the motion's own)."""
    m, n = motion.mechanism, motion.n
    marks: list[Mark] = []

    for j, entry in enumerate(m.inputs):
        name = f"?{entry.name}"
        if not entry.is_slide:
            reacts = m.carrier(j)
            plain = len(m.inputs) == 1 and reacts == GROUND
            for link, mark in ((str(entry.link), "?" if plain else name), (reacts, f"{name}*-1")):
                if link != GROUND:
                    effort = {"torque_N_m": [mark] * n, "omega_rad_s": cells(_turning(motion, link, field))}
                    marks.append(Mark(link, effort))
            continue
        i = next(i for i, g in enumerate(m.guides) if g.point == entry.slider)
        g = m.guides[i]
        rail = _rail(motion, i)
        for link, sign in ((g.link, 1.0), (g.on, -1.0)):
            if link == GROUND:
                continue
            at = _velocity(motion, link, g.point, field) if sign > 0 else _carried(motion, i, field)
            share: Part = {**_vector(("fvx_m_s", "fvy_m_s"), at)}
            share["fx_N"] = [_share(name, sign * float(c)) for c in rail.real]
            share["fy_N"] = [_share(name, sign * float(c)) for c in rail.imag]
            marks.append(Mark(link, share, i))
    return marks


def _share(name: str, factor: float) -> str:
    """Return `?NAME*factor`; empty where the factor is zero."""
    if not np.isfinite(factor) or factor == 0:
        return ""
    return name if factor == 1.0 else f"{name}*{factor!r}"


def _turning(motion: Motion, link: str, field: int | None) -> NDArray[np.float64]:
    of = motion.link(link)
    return of.omega if field is None else of.coefficient(field)


def _velocity(motion: Motion, link: str, point: complex | str, field: int | None) -> NDArray[np.complex128]:
    of = motion.at(link, point)
    return of.complex(1) if field is None else of.coefficient(field)


def _rail(motion: Motion, guide: int) -> NDArray[np.complex128]:
    """Return the direction of a guide."""
    forces = motion.dynamics
    (rail,) = forces.scene.over([partial(forces.reactions.rail, guide=guide)], complex)
    return np.asarray(rail)


def _carried(motion: Motion, guide: int, field: int | None) -> NDArray[np.complex128]:
    """Return the velocity of the point of a guide's body at which its slide stands, in one field (None: the motion's own)."""
    g = motion.mechanism.guides[guide]
    base = _velocity(motion, g.on, motion.mechanism.through(g), field)
    slide = motion.slide(g.point).position
    return np.asarray(base + 1j * _turning(motion, g.on, field) * slide * _rail(motion, guide))


def _guided(motion: Motion, guide: int, link: str, field: int | None) -> NDArray[np.float64]:
    """Return the error of the velocity of the point at which a driven slider's force acts on a link."""
    from virtualwork.digits.estimates import Estimates

    along = motion if field is None else motion.unit(field)
    g = motion.mechanism.guides[guide]
    if link == g.link:
        return along.at(link, g.point).error_estimate(1)
    value = _carried(motion, guide, field)
    return Estimates(along.poses, lambda _: [value]).of(Carried(guide, 1))
