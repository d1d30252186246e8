"""The poses of `dalembert mechanism`, Newton's iterates; the worked solution: loops, roots of closed forms, parts of the motion."""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.poses import column, over_poses, pose_head
from cli.cases.study import PoseCase, PoseStudy
from dalembert.angles import in_turn, read_degrees
from dalembert.dataclass import dataclass
from dalembert.results.columns import Column, Table, finite, listed, names, number
from dalembert.results.way import Topic, figures, vector_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.analysis import Analysis
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Group
    from virtualwork.study.loops import GroupAt, Root
    from virtualwork.study.parts import Parts

# radians between the solution from the guess and that of the groups: beyond it they are two assemblies
SAME = 1e-6


@dataclass
class Solved(PoseCase):
    """The poses of one mechanism, and Newton's iterates."""

    study: Poses

    @cached_property
    def extra(self) -> dict[str, Table]:
        """Newton-Raphson iterates, which --newton shows."""
        return iterates(self.analysis) if self.study.newton else {}

    def way(self) -> list[Topic]:
        """Return the loops, the closed forms, Newton's iterates and the parts of the motion."""
        return way(self.analysis, newton=self.study.newton)

    def figure(self) -> Figure:
        """Draw the mechanism to scale, with ghosts and paths; or the curves of single quantities."""
        from cli.cases.picture import curves, drawn, is_by_quantity

        return curves(self.analysis) if is_by_quantity(self.analysis) else drawn(self.analysis)


@dataclass(frozen=True)
class Poses(PoseStudy):
    """Solve the poses of every case, with their rates.

    Attributes
    ----------
    newton : bool
        Whether all loops are solved at once in addition.
    """

    newton: bool = False

    kind = Solved

    @property
    def poses_alone(self) -> bool:
        """Whether a file of tables has the poses and nothing else."""
        return not self.newton

    @property
    def extra_in_json(self) -> bool:
        """Whether the JSON document of each variant has more than its poses."""
        return self.newton


def iterates(analysis: Analysis) -> dict[str, Table]:
    """Solve every pose by Newton-Raphson from the guess; return the iterates of the first and the largest difference."""
    from virtualwork.study.newton_table import all_at_once

    assembly = analysis.assemblies[0]
    solutions = [all_at_once(assembly, tuple(row)) for row in analysis.inputs.whole.values.tolist()]
    first = solutions[0]
    away = [i for i, each in enumerate(solutions) if not each.closed or not each.difference < SAME]
    for i in away[:3]:
        why = "did not converge" if not solutions[i].closed else "found another assembly"
        analysis.warnings.append(f"newton from the guess {why} at step {analysis.inputs.whole.steps[i]}")
    if len(away) > 3:
        analysis.warnings.append(
            f"newton from the guess missed the assembly at {len(away)} of {len(solutions)} poses"
        )
    columns = [names("k", [each.k for each in first.iterates])]
    for i, unknown in enumerate(first.unknowns):
        values = [each.unknowns[i] for each in first.iterates]
        turns = i < first.angles
        # the first is the guess, as the file has it
        shown = [read_degrees(value) for value in values] if turns else values
        columns.append(number(unknown, "angle" if turns else "length", shown))
        columns[-1].place = (columns[-1].header,)
    columns.append(number("residual", "length", [each.residual for each in first.iterates]))
    rows = zip(first.unknowns, np.array(first.jacobian).T.tolist(), strict=True)
    jacobian = [Column(unknown, "", row, place=str(j)) for j, (unknown, row) in enumerate(rows)]
    about = [names("unknowns", [list(first.unknowns)]), names("at", ["the guess"])]
    difference = max(
        (each.difference for each in solutions if math.isfinite(each.difference)), default=math.nan
    )
    return {
        "newton": Table(
            columns, ("k",), "iterates[]", above="Newton-Raphson, all loops at once, from the guess"
        ),
        "jacobian": Table(jacobian, (), "jacobian.rows[]", above="at the guess, x and y of each loop"),
        "of the jacobian": Table([], place="jacobian", documented=about),
        "difference": Table(
            [Column("newton_difference", "rad", [difference], place="newton_difference_rad")],
            place="",
            above="largest, to the assembly solved group by group",
        ),
    }


# --- the worked solution ----------------------------------------------------------------------------------------------
Document = dict[str, Any]
CHACE = {
    1: "case 1, length and direction of one vector: W + (V + s·U)·e^{iφ} = 0",
    2: "case 2, length of one vector and direction of another: W + V·e^{iφ} + s·U = 0",
    3: "case 3, two lengths: W + s1·U1 + s2·U2 = 0",
    4: "case 4, two directions: W + V1·e^{iφ1} + V2·e^{iφ2} = 0",
}


class PartKind(NamedTuple):
    """A part of a velocity or an acceleration: its word in the table, its array, its unit, its key in JSON."""

    word: str
    of: str
    unit: str
    key: str = ""


PARTS = (
    PartKind("base", "base_velocity", "m_s", "base_velocity_m_s"),
    PartKind("turning", "turning_velocity", "m_s", "turning_velocity_m_s"),
    PartKind("", "carried_velocity", "m_s", "carried_velocity_m_s"),
    PartKind("relative", "relative_velocity", "m_s", "relative_velocity_m_s"),
    PartKind("sum", "velocity", "m_s"),
    PartKind("base", "base_acceleration", "m_s2", "base_m_s2"),
    PartKind("tangential", "tangential", "m_s2", "tangential_m_s2"),
    PartKind("normal", "normal", "m_s2", "normal_m_s2"),
    PartKind("relative", "relative", "m_s2", "relative_m_s2"),
    PartKind("Coriolis", "coriolis", "m_s2", "coriolis_m_s2"),
    PartKind("sum", "acceleration", "m_s2"),
)
"""Without a word: in JSON alone; without a key: in the table alone."""


def way(analysis: Analysis, *, newton: bool = False) -> list[Topic]:
    """Return the topics of one mechanism, one assembly after the other."""
    result: list[Topic] = []
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        topics = [*_loops(motion), *_groups(analysis, motion)]
        if newton and assembly is analysis.assemblies[0]:
            topics.append(_newton(analysis, motion))
        if any(np.any(rate) for rates in motion.poses.rates[:2] for rate in rates):
            topics.append(_parts(analysis, motion))
        for topic in topics:
            if analysis.several:
                topic.head = {"branch": assembly.number, **topic.head}
                topic.title = f"Assembly {assembly.number}: {topic.heading}"
        result += topics
    return result


def _loops(motion: Motion) -> list[Topic]:
    from virtualwork.study.loops import loops

    texts = [loop.text for loop in loops(motion.mechanism, motion.assembly.plan)]
    if not texts:
        return []
    return [Topic("loops", texts, "Vector loops (Ibrahim, eqs. 1.3.1, 1.3.3)", {"loops": texts})]


def _groups(analysis: Analysis, motion: Motion) -> list[Topic]:
    from virtualwork.study.loops import CASES, apex, closed_form

    assembly, m = motion.assembly, motion.mechanism
    groups = []
    for group in assembly.plan.groups:
        head: Document = {"links": list(group.links)}
        title = f"Group {', '.join(group.links)}"
        if group.kind == "Newton":
            head |= {"case": None, "method": "Newton-Raphson"}
            text = (
                f"No closed form: {len(group.angles)} angles and {len(group.slides)} slides from {len(group.closures)} loops "
                "by Newton and Raphson, x(k+1) = x(k) − Φ⁻¹·f(x(k)) (Nicoletti, lecture 7); --newton shows iterates."
            )
            groups.append(Topic("group", [text], title, head))
            continue
        case = CASES[group.kind]
        name, _ = apex(m, group)
        at = [closed_form(assembly, group, tuple(row)) for row in motion.inputs.tolist()]
        head |= {"case": case, "method": "closed form"}
        head |= over_poses(analysis, [_root_entry(m, group, name, each) for each in at])
        parts: list[str | Table] = [f"Chace's {CHACE[case]}"]
        first = next((i for i, each in enumerate(at) if each is not None), None)
        if first is None:
            parts.append("It cannot be assembled.")
        else:
            instant = at[first]
            assert instant is not None
            if len(at) > 1:
                parts.append(f"At {analysis.pose_text(first)}:")
            parts += _root_text(group, instant)
        parts.append(_root_table(analysis, m, group, name, at))
        groups.append(Topic("group", parts, title, head))
    return groups


def _unknowns(m: Any, group: Group, root: Root) -> Document:
    return {
        **{
            f"{body}_deg": in_turn(float(read_degrees(a)))
            for body, a in zip(group.angles, root.angles, strict=True)
        },
        **{f"{m.guides[g].point}_m": s for g, s in zip(group.slides, root.slides, strict=True)},
    }


def _root_entry(m: Any, group: Group, name: str, at: GroupAt | None) -> Document:
    if at is None:
        return {"roots": [], "taken": None}
    return {
        "vectors_m": dict(zip("WVU", listed((at.offset, *at.vectors)), strict=True)),
        "roots": [
            {
                "point": name,
                "x_m": root.point.real + 0.0,
                "y_m": root.point.imag + 0.0,
                "unknowns": _unknowns(m, group, root),
            }
            for root in at.roots
        ],
        "taken": at.taken,
    }


def _root_text(group: Group, at: GroupAt) -> list[str]:
    w, (v, u) = at.offset, at.vectors
    lines = [f"  W = {vector_text(w)}, V = {vector_text(v)}, U = {vector_text(u)}"]
    if group.kind == "RRR":
        d2, r1, r2 = abs(w) ** 2, abs(v), abs(u)
        root = ((r1 + r2) ** 2 - d2) * (d2 - (r1 - r2) ** 2)
        lines.append(f"  d² = |W|² = {figures(d2)}, r1 = |V| = {figures(r1)}, r2 = |U| = {figures(r2)}")
        lines.append(
            f"  a = (d² + r1² − r2²)/(2·d²) = {figures((d2 + r1 * r1 - r2 * r2) / (2 * d2))}, "
            f"h = ±√[((r1 + r2)² − d²)·(d² − (r1 − r2)²)]/(2·d²) = ±{figures(max(root, 0.0) ** 0.5 / (2 * d2))}"
        )
        lines.append("  V·e^{iφ1} = −(a + i·h)·W: the two circles cut in two points")
    elif group.kind == "RRP":
        y, x = -(w * u.conjugate()).imag, abs(v)
        lines.append(
            f"  across the line y = −Im(W·Ū) = {figures(y)}, along it x = ±√(r² − y²) = ±{figures(max(x * x - y * y, 0.0) ** 0.5)}"
        )
        lines.append("  V·e^{iφ} = (x + i·y)·U, s = −Re(W·Ū) − x (Ibrahim §1.11: the two solution sets)")
    elif group.kind == "RPR":
        seen = v * u.conjugate()
        root = abs(w) ** 2 - seen.imag**2
        lines.append(
            f"  V·Ū = p + i·q = {figures(seen.real)} + i·({figures(seen.imag)}), "
            f"p + s = ±√(|W|² − q²) = ±{figures(max(root, 0.0) ** 0.5)}"
        )
    else:
        lines.append("  s1 = −(W × U2)/(U1 × U2), s2 = −(U1 × W)/(U1 × U2) by Cramer's rule")
    return lines


def _root_table(analysis: Analysis, m: Any, group: Group, name: str, at: list[GroupAt | None]) -> Table:
    rows = [
        (i, k, root, instant.taken == k)
        for i, instant in enumerate(at)
        if instant is not None
        for k, root in enumerate(instant.roots, 1)
    ]
    shown = analysis.inputs.whole.shown
    inputs = [
        column(header, [float(shown[i][j]) for i, *_ in rows])
        for j, header in enumerate(analysis.input_columns)
    ]
    unknowns = [_unknowns(m, group, root) for _, _, root, _ in rows]
    columns = [
        *(inputs if len(at) > 1 else []),
        Column("root", "", [str(k) for _, k, _, _ in rows]),
        Column(f"{name}_x", "m", [root.point.real for _, _, root, _ in rows]),
        Column(f"{name}_y", "m", [root.point.imag for _, _, root, _ in rows]),
        *(column(key, [each[key] for each in unknowns]) for key in (unknowns[0] if unknowns else ())),
        names("taken", ["yes" if taken else "no" for *_, taken in rows]),
    ]
    return Table(columns, ("root",))


def _newton(analysis: Analysis, motion: Motion) -> Topic:
    from virtualwork.study.newton_table import all_at_once, worked

    assembly = motion.assembly
    start = None
    entries: list[Document] = []
    rows: list[Document] = []
    text: list[str | Table] = [
        "All loops at once, x(k+1) = x(k) − Φ(x(k))⁻¹·f(x(k)): the first pose from the guess, each further one from the last "
        "solution; f in m, Φ and Δx per radian of an angle."
    ]
    for i, row in enumerate(motion.inputs.tolist()):
        done = all_at_once(assembly, tuple(row), start=start)
        iterates = worked(assembly, tuple(row), done)
        keys = [f"{n}_{'deg' if k < done.angles else 'm'}" for k, n in enumerate(done.unknowns)]
        every = []
        for it in iterates:
            turned, slid = np.split(it.unknowns, [done.angles])
            shown = [*map(read_degrees, turned.tolist()), *slid.tolist()]
            unknowns = dict(zip(keys, shown, strict=True))
            every.append(
                {
                    "k": it.k,
                    "unknowns": unknowns,
                    "residual": listed(it.residual),
                    "jacobian": listed(it.jacobian),
                    "step": listed(it.step),
                }
            )
            rows.append(
                {
                    **dict(zip(analysis.input_columns, analysis.inputs.whole.shown[i].tolist(), strict=True)),
                    "k": str(it.k), **unknowns, "f_m": float(np.linalg.norm(it.residual)),
                }
            )  # fmt: skip
        difference = finite(done.difference)
        entries.append(
            {**pose_head(analysis, i), "iterates": every, "closed": done.closed, "difference_rad": difference}
        )
        if not i:
            text += _first_step(keys, every[0])
        if done.closed:
            start = done.iterates[-1].unknowns
    headers = list(rows[0]) if rows else []
    text.append(Table([column(key, [each[key] for each in rows]) for key in headers], ("k",)))
    differences = [e["difference_rad"] for e in entries if e["difference_rad"] is not None]
    if differences:
        text.append(
            f"Largest difference to the assembly solved group by group: {figures(max(differences))} rad"
        )
    return Topic("newton", text, "Newton-Raphson (Nicoletti, lecture 7)", {"poses": entries})


def _first_step(keys: list[str], entry: Document) -> list[str | Table]:
    """Return the system of the first step with its numbers."""
    names_of = [key.rpartition("_")[0] for key in keys]
    system = Table(
        [
            Column("equation", "", [f"loop {k // 2 + 1}, {'xy'[k % 2]}" for k in range(len(entry["residual"]))]),
            *(
                Column(f"∂/∂{name}", "", [line[j] for line in entry["jacobian"]])
                for j, name in enumerate(names_of)
            ),
            Column("f", "m", entry["residual"]),
        ],
        ("equation",),
    )  # fmt: skip
    steps = ", ".join(
        f"Δ{name} = {figures(step)}{' rad' if key.endswith('_deg') else ' m'}"
        for key, name, step in zip(keys, names_of, entry["step"], strict=True)
        if step is not None
    )
    return ["Φ and f at the first guess:", system, f"  {steps}"]


def _parts(analysis: Analysis, motion: Motion) -> Topic:
    from virtualwork.study.parts import parts

    every = parts(motion.poses)
    entries: list[Document] = []
    whole = motion.assembled
    for i in range(motion.n):
        points = [
            {
                "point": each.point,
                "on": each.on,
                "from": each.base,
                **{k.key: listed(getattr(each, k.of)[i]) for k in PARTS if k.key},
            }
            for each in every
        ]
        entries.append({"points": points if whole[i] else []})
    first = int(np.argmax(whole))
    text: list[str | Table] = [
        "V = V_base + ω × R + V_rel; A = A_base + α × R − ω²·R + A_rel + 2·ω × V_rel (Ibrahim, eqs. 1.7.4 to 1.10.7)."
    ]
    if motion.n > 1:
        text.append(f"At {analysis.pose_text(first)}:")
    if whole.any():
        text += [
            _parts_table(every, first, "m_s", "Velocities:"),
            _parts_table(every, first, "m_s2", "Accelerations:"),
        ]
    figure = partial(_polygons, every, first) if whole.any() else None
    return Topic(
        "parts", text, "Parts of velocity and acceleration", over_poses(analysis, entries), figure=figure
    )


def _parts_table(every: list[Parts], i: int, unit: str, above: str) -> Table:
    from virtualwork.textbook.combinations import sense

    kinds = [kind for kind in PARTS if kind.unit == unit and kind.word]
    rows = []
    for each in every:
        values = [complex(getattr(each, kind.of)[i]) for kind in kinds]
        whole = abs(values[-1])
        for kind, value in zip(kinds, values, strict=True):
            # rounding of nothing is shown as nothing
            x, y = (0.0 if abs(part) < 1e-12 * whole else part for part in (value.real, value.imag))
            if kind.word == "sum" or x or y:
                rows.append((each, kind.word, complex(x, y)))
    return Table(
        [
            Column("point", "", [each.point for each, *_ in rows]),
            Column("on", "", [each.on for each, *_ in rows]),
            Column("from", "", [each.base for each, *_ in rows]),
            Column("part", "", [word for _, word, _ in rows]),
            Column("x", unit, [v.real for *_, v in rows]),
            Column("y", unit, [v.imag for *_, v in rows]),
            Column("size", unit, [abs(v) for *_, v in rows]),
            Column("sense", "deg", [None if v == 0 else float(np.degrees(sense(v))) for *_, v in rows]),
        ],
        ("point", "on", "from", "part"),
        above=above,
    )  # fmt: skip


def _polygons(every: list[Parts], i: int) -> Figure:
    from dalembert.drawing.sheet import blank
    from virtualwork.picture.polygons import rates

    figure = blank()
    rates(every, i, figure)
    return figure
