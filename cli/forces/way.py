"""The worked solution of `dalembert forces`: the ledger of every pose, links that carry motors, free-body diagrams."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.ledger import Entry, components, entries_of, ledger
from cli.cases.poses import over_poses
from dalembert.results.columns import Column, Table, finite, names
from dalembert.results.way import Topic, figures, vector_text
from virtualwork.describe.parts import GROUND

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.analysis import Analysis
    from virtualwork.motion import Motion
    from virtualwork.study.free_bodies import FreeBody


def way(analysis: Analysis) -> list[Topic]:
    """Return the topics of one mechanism."""
    instants: list[tuple[list[Column], list[Entry]]] = []
    equations: list[str] = []
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        moves = motion.dynamics.scene.moves and any(np.any(rate) for rate in motion.poses.rates[0])
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
        torque = [None if j is None else finite(float(v)) for v in _effort(analysis, j)]
        text = [
            f"m′ = {figures(link.mass)} + {figures(motor.mass)} = {figures(whole.mass)} kg",
            f"r_G′ = (m·r_G + m_M·r_M)/m′ = ({figures(link.mass)}·{_pair(link.center)} + "
            f"{figures(motor.mass)}·{_pair(motor.center)})/{figures(whole.mass)} = {_pair(whole.center)} m in the link's axes",
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
            "center_m": [whole.center.real + 0.0, whole.center.imag + 0.0],
            "inertia_kg_m2": whole.inertia,
            "torque_N_m": torque[0] if len(torque) == 1 else torque,
        }
        title = f"Link {motor.carrier} with the motor of {motor.drives} (Ibrahim §2.3)"
        motors.append(Topic("motor", text, title, head))
    return motors


def _effort(analysis: Analysis, j: int | None) -> list[float]:
    motion = analysis.motions[0]
    if j is None:
        return []
    values: list[float] = motion.dynamics.effort[:, j].tolist()
    return values


def _pair(z: complex) -> str:
    return vector_text(z.real, z.imag)


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
    def pair(z: complex) -> list[float | None]:
        return [finite(z.real + 0.0), finite(z.imag + 0.0)]

    return {
        "link": body.link,
        "center_m": pair(complex(body.center[i])),
        "forces": [
            {"name": f.name, "kind": f.kind, "at_m": pair(complex(f.at[i])), "force_N": pair(complex(f.force[i]))}
            for f in body.forces
        ],
        "torques": [{"name": t.name, "kind": t.kind, "torque_N_m": finite(float(t.torque[i]))} for t in body.torques],
    }  # fmt: skip


def _diagrams(bodies: list[FreeBody], i: int) -> Figure:
    from cli.show.picture import blank
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
