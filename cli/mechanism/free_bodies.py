"""The forces link by link: the table of states that `dalembert work` reads, the ledger, free-body diagrams.

The table has one row for each pose and link.
The unknown is the input's effort: `?` in the driven link's torque; where that cell holds a known torque, in a row of
its own. A drive that reacts on a moving link, or along a guide, is `?NAME*factor` in each of its components. With
several inputs every pose has as many velocity fields (column `field`): a unit of each input's virtual velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.ledger import Entry, components, entries_of, ledger
from cli.cases.poses import bound, bounds_of, cells, cells_of, column, keys_of, over_poses, pose_keys, solved
from dalembert.results.columns import Column, Table, finite, listed, names
from dalembert.results.way import Topic, figures, vector_text
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.forces import Applied, AppliedMoment, Rail
from virtualwork.formulas.kinematics import Angle, Carried, Point
from virtualwork.quantities import FORCE, LINK, POINT, links, vector

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.poses import Numbers
    from dalembert.results.columns import Cell
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.motion import Motion
    from virtualwork.study.free_bodies import FreeBody

    Part = dict[str, Sequence[Cell]]
    Row = dict[str, Cell]

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
        for k, pair in enumerate(POINT):
            if name in pair:
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
    return np.asarray(motion.dynamics.value(Rail(guide)))


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


# --- the worked solution ----------------------------------------------------------------------------------------------
def way(analysis: Analysis) -> list[Topic]:
    """Return the topics of one mechanism."""
    instants: list[tuple[list[Column], list[Entry]]] = []
    equations: list[str] = []
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        moves = motion.dynamics.moves and any(np.any(rate) for rate in motion.poses.rates[0])
        # at rest the displacements are virtual: of a unit speed of each input alone
        units = [None] if moves else list(range(len(analysis.mechanism.inputs)))
        entries = [entries_of(motion, unit) for unit in units]
        if not equations:
            equations = _equations(analysis, motion, [e[0] for e in entries], moves)
        for i in range(motion.n):
            head = _pose(analysis, i)
            if analysis.several:
                head.append(names("branch", [assembly.number]))
            instants.append((head, [entry for each in entries for entry in each[i]]))
    return [*_motors(analysis), ledger("poses[]", instants, equations), *_free_bodies(analysis)]


def _motors(analysis: Analysis) -> list[Topic]:
    """Return the links that carry a motor: their common centre G′ and inertia, and the motor's torque on both (Ibrahim §2.3)."""
    m, motors = analysis.mechanism, []
    for motor in m.motors:
        if motor.carrier == GROUND:
            continue
        link, whole = m.links[motor.carrier], m.rigid[motor.carrier]
        j = next((j for j, e in enumerate(m.inputs) if e.link == motor.drives), None)
        effort = analysis.motions[0].dynamics.effort
        torque = [] if j is None else listed(effort[:, j])
        text = [
            f"m′ = {figures(link.mass)} + {figures(motor.mass)} = {figures(whole.mass)} kg",
            f"r_G′ = (m·r_G + m_M·r_M)/m′ = ({figures(link.mass)}·{vector_text(link.center)} + "
            f"{figures(motor.mass)}·{vector_text(motor.center)})/{figures(whole.mass)} = {vector_text(whole.center)} m in the link's axes",
            f"I_G′ = I_G + m·|r_G − r_G′|² + m_M·|r_M − r_G′|² = {figures(whole.inertia)} kg·m²",
        ]
        if torque and torque[0] is not None:
            text.append(
                f"T_M = {figures(torque[0])} N·m on {motor.drives}, {figures(-torque[0])} N·m on {motor.carrier}"
            )
        head: dict[str, Any] = {
            "carrier": motor.carrier,
            "drives": motor.drives,
            "mass_kg": whole.mass,
            "center_m": listed(whole.center),
            "inertia_kg_m2": whole.inertia,
            "torque_N_m": torque[0] if len(torque) == 1 else torque,
        }
        title = f"Link {motor.carrier} with the motor of {motor.drives} (Ibrahim §2.3)"
        motors.append(Topic("motor", text, title, head))
    return motors


def _free_bodies(analysis: Analysis) -> list[Topic]:
    """Return the free-body diagram of every link, as a table and to scale."""
    from virtualwork.study.free_bodies import free_bodies

    motion = analysis.motions[0]
    whole = motion.assembled
    if not whole.any():
        return []
    bodies = free_bodies(motion.dynamics)
    first = int(np.argmax(whole))
    entries: list[dict[str, Any]] = [
        {"bodies": [_body(body, i) for body in bodies] if whole[i] else []} for i in range(motion.n)
    ]
    rows: list[tuple[str, str, str, complex | None, complex | None, float | None]] = []
    for body in bodies:
        rows += [
            (body.link, f.name, f.kind, complex(f.at[first]), complex(f.force[first]), None)
            for f in body.forces
        ]
        rows += [(body.link, t.name, t.kind, None, None, float(t.torque[first])) for t in body.torques]
    links, called, kinds, places, forces, torques = zip(*rows, strict=True) if rows else ([],) * 6
    table = Table(
        [
            names("link", links),
            names("name", called),
            names("kind", kinds),
            *components("", "m", places),
            *components("F", "N", forces),
            Column("torque", "N_m", list(torques)),
        ],
        ("link", "name"),
    )
    text = "Every link cut loose: on each ΣF = 0 and ΣM_G = 0, inertia force −m·a_G and inertia torque −I_G·α among them."
    if motion.n > 1:
        text += f" At {analysis.pose_text(first)}:"
    title = "Free-body diagrams (Ibrahim §2.2, Riul, figures 3 to 5)"
    head = over_poses(analysis, entries)
    return [Topic("free bodies", [text, table], title, head, partial(_diagrams, bodies, first))]


def _body(body: FreeBody, i: int) -> dict[str, Any]:
    return {
        "link": body.link,
        "center_m": listed(body.center[i]),
        "forces": [
            {"name": f.name, "kind": f.kind, "at_m": listed(f.at[i]), "force_N": listed(f.force[i])}
            for f in body.forces
        ],
        "torques": [{"name": t.name, "kind": t.kind, "torque_N_m": finite(float(t.torque[i]))} for t in body.torques],
    }  # fmt: skip


def _diagrams(bodies: list[FreeBody], i: int) -> Figure:
    from dalembert.drawing.sheet import blank
    from virtualwork.picture.free_bodies import draw

    figure = blank()
    draw(bodies, i, figure)
    return figure


def _pose(analysis: Analysis, i: int) -> list[Column]:
    """Return the columns that name a pose: its inputs, as they are shown and for JSON."""
    shown = analysis.inputs.whole.shown[i].tolist()
    inputs = analysis.mechanism.inputs
    if len(inputs) == 1:
        key = analysis.input_names[inputs[0].name]
        return [Column("input", key.removeprefix("input_"), [shown[0]], place=key)]
    return [
        Column(f"{entry.name}_input", key.removeprefix("input_"), [value], place=f"inputs.{entry.name}.{key}")
        for (entry, key), value in zip(
            ((e, analysis.input_names[e.name]) for e in inputs), shown, strict=True
        )
    ]


def _equations(analysis: Analysis, motion: Motion, entries: list[list[Entry]], moves: bool) -> list[str]:
    """Return the balance of the first pose with its numbers."""
    lines = []
    if motion.n * len(analysis.motions) > 1:
        lines.append(f"Pose {analysis.inputs.whole.shown[0][0]:g}; the others in the same way.")
    if not moves:
        lines.append("The mechanism is at rest: the velocities are virtual, of a unit speed of the input.")
    for entry_list in entries:
        if not entry_list:
            lines.append("The pose cannot be assembled.")
            continue
        idle: dict[str, list[str]] = {}
        for e in entry_list:
            if e.workless:
                name = f"{e.symbol} at {e.point}" if e.point else f"{e.symbol} ({e.kind})"
                idle.setdefault(e.workless, []).append(name)
        lines += [f"No work, {why}: {', '.join(dict.fromkeys(which))}." for why, which in idle.items()]
        here = [e for e in entry_list if not e.workless]
        loads = [e for e in here if e.kind != "unknown"]
        drives = [e for e in here if e.kind == "unknown"]
        lines.append(f"ΣF·V + ΣT·ω = 0{f' for input {entry_list[0].field}' if entry_list[0].field else ''}:")
        lines.append("  " + (" + ".join(f"{e.symbol}·{e.rate}" for e in here) or "0") + " = 0")
        lines += [f"  {e.equation()}" for e in loads]
        lines.append(f"  sum without the drive: {figures(sum(e.power for e in loads))} W")
        lines += [f"  {e.equation()}" for e in drives]
    return lines
