"""What is told of a mechanism below the terminal's table: check, iterates, cycle, equilibria, order of solution."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from cli.mechanism.columns import column
from cli.mechanism.solve import ORDERS, Analysis
from cli.mechanism.studies import Document, Studies
from cli.read.units import written
from cli.show.columns import Section, Table
from cli.show.text import heading, table_text
from virtualwork.formulas.asked import Key
from virtualwork.plan.steps import Group, Place, Slide, Turn

METHOD = (
    "Assur groups one after the other, two-link groups in closed form (Chace), larger ones by Newton-Raphson; rates by the "
    "derivatives of the loop equations along the input; effort by virtual work and by Newton and Euler, joint forces by "
    "d'Alembert's principle (R. Ibrahim, Mecanismos, PMR/EPUSP; J. A. Riul, Dinâmica das Máquinas; R. Nicoletti, SEM 104). "
    "Angles are counter-clockwise, reactions are what the link `from` exerts on the link `on`."
)


def sections(studies: Studies, tables: Mapping[str, Callable[[], Table]]) -> list[Section]:
    """What the report shows: every table, and the order of solution."""
    shown = [Section(heading(name), [table()]) for name, table in tables.items()]
    return [*shown, Section("Order of solution", explained(studies))] if studies.asked.explain else shown


def afterword(studies: Studies) -> str:
    """All that was asked for, a paragraph each."""
    document = studies.document
    texts: dict[str, Callable[..., str]] = {
        "check": check_text,
        "cycle": cycle_text,
        "equilibria": equilibria_text,
        "counterweights": counterweights_text,
    }
    parts = [newton_text(document)] if studies.asked.newton else []
    parts += [text(document[key]) for key, text in texts.items() if key in document]
    return "\n\n".join([*parts, *(explained(studies) if studies.asked.explain else [])])


def explained(studies: Studies) -> list[str]:
    """The order of solution, and of the forces what was done."""
    analysis = studies.analysis
    return [explain_text(analysis), *([explain_forces(analysis)] if studies.asked.forces else [])]


def check_text(document: Document) -> str:
    """The same as sentences."""
    d = document
    lines = [f"mobility {d['mobility']} (Grübler), {d['mobility_by_rank']} by the rank of the Jacobian"]
    if d["mobility"] != d["mobility_by_rank"]:
        lines[-1] += ": they differ, because constraints depend on each other"
    if d["redundant"]:
        lines.append(f"redundant among themselves: {', '.join(d['redundant'])}")
    for g in d["groups"]:
        lines.append(f"group {' + '.join(g['links'])}: {g['kind']}, {g['method']}")
    for f in d["four_bars"]:
        low, high = (f"{v:.6g}" if v is not None else "?" for v in f["transmission_deg"])
        lines.append(
            f"four-bar {', '.join(f['links'])}: {f['grashof']}, transmission angle {low} to {high} deg"
        )
    for key in ("input_limits", "dead_points", "change_points"):
        unit = "deg" if f"{key}_deg" in d else "m"
        values = d[f"{key}_{unit}"]
        text = (
            "none"
            if not values
            else ", ".join("open" if v is None else f"{v:.12g}" for v in values) + f" {unit}"
        )
        lines.append(f"{key.replace('_', ' ')}: {text}")
    if "singular" in d:
        lines.append(f"singular in every pose: {', '.join(d['singular'])}")
    return "\n".join(lines)


def newton_text(document: Document) -> str:
    """The table of iterates, the Jacobian at the guess, and the difference to the closed form."""
    rows = document["iterates"]
    table = table_text({key: [row[key] for row in rows] for key in rows[0]})
    jacobian = document["jacobian"]
    shown = table_text(
        {name: [row[j] for row in jacobian["rows"]] for j, name in enumerate(jacobian["unknowns"])}
    )
    difference = document["newton_difference_rad"]
    return (
        f"Newton-Raphson, all loops at once, from the guess:\n{table}\nJacobian at the guess (x and y of each loop):\n"
        f"{shown}\nlargest difference to the assembly solved group by group: "
        + ("nothing to compare" if difference is None else f"{difference:.3g} rad")
    )


def explain_text(analysis: Analysis) -> str:
    """The order of solution, and for this request what was solved and what was skipped."""
    motion = analysis.motions[0]
    plan = motion.assembly.plan
    reached: dict[int, int] = {}
    for step, order in motion.solved:
        reached[id(step)] = max(order, reached.get(id(step), 0))
    lines = ["order of solution:"]
    for i, step in enumerate(plan.steps, 1):
        if isinstance(step, Turn):
            text = f"angle of {step.body}: {_angle_text(analysis, step)}"
        elif isinstance(step, Slide):
            text = f"slide at {analysis.mechanism.guides[step.guide].point}: the input"
        elif isinstance(step, Place):
            text = f"point {step.node}"
        else:
            assert isinstance(step, Group)
            how = "Newton-Raphson" if step.kind == "Newton" else f"{step.kind}, closed form"
            text = f"group {step.name}: {how}"
        done = (
            f"solved to {ORDERS[reached[id(step)]]}"
            if id(step) in reached
            else "skipped: nothing asked for hangs on it"
        )
        lines.append(f"{i:4d}  {text}  [{done}]")
    return "\n".join([*lines, _operations(analysis)])


def _operations(analysis: Analysis) -> str:
    """What all points and links of a pose cost, with rates where the input has any."""
    motion = analysis.motions[0]
    m = motion.mechanism
    moves = any(not isinstance(rate, float) or rate for rates in motion.poses.rates for rate in rates)
    keys: list[Key] = []
    told = []
    for order, what in enumerate(("", " with velocities", " with accelerations")[: 3 if moves else 1]):
        keys += [("point", body, 0j, p, order) for body in m.links for p in m.bodies[body]]
        keys += [("angle", body, order) for body in m.links]
        told.append(f"{motion.lanes.operations(keys)}{what}")
    return f"operations a pose of all points and links: {', '.join(told)}"


def _angle_text(analysis: Analysis, step: Turn) -> str:
    parts = [
        f"{k:g}·input {analysis.mechanism.inputs[j].name}"
        if k != 1
        else f"input {analysis.mechanism.inputs[j].name}"
        for j, k in step.angle.inputs
    ]
    parts += [f"{r:g}·{base}" if r != 1 else base for base, r in step.angle.bases]
    if step.angle.const:
        parts.append(f"{math.degrees(step.angle.const):g} deg")
    return " + ".join(parts) or "fixed"


def cycle_text(part: Document) -> str:
    """The cycle below the table."""
    lines = ["cycle:"]
    for key, value in part.items():
        if value is not None:
            its = column(key, [value])
            lines.append(f"  {its.name.replace('_', ' '):<18} {value:.6g} {written(its.unit)}")
    return "\n".join(lines)


def equilibria_text(rows: list[Document]) -> str:
    """The equilibria below the table."""
    lines = [f"equilibria: {len(rows)}"]
    for row in rows:
        word = {True: "stable", False: "unstable", None: "undecided"}[row["stable"]]
        if "inputs" in row:
            place = ", ".join(f"{name} {_input_text(value)}" for name, value in row["inputs"].items())
        else:
            place = _input_text(row)
        energy = "" if row["potential_J"] is None else f", potential {row['potential_J']:.6g} J"
        lines.append(f"  {place}: {word}{energy}")
    return "\n".join(lines)


def counterweights_text(part: Document) -> str:
    """The counterweights below the table."""
    lines = ["counterweights (mass times radius from the link's pivot, angle from the link's x-axis):"]
    lines += [
        f"  {w['link']}: {w['mass_radius_kg_m']:.6g} kg·m at {w['angle_deg']:.4g}°" for w in part["weights"]
    ]
    lines.append(
        f"  RMS shaking force of inertia {part['shaking_rms_before_N']:.6g} N -> {part['shaking_rms_after_N']:.6g} N"
    )
    return "\n".join(lines)


def explain_forces(analysis: Analysis) -> str:
    """Which loads did work, which do none, which are absent, which reactions were formed."""
    from virtualwork.formulas.effort import ledger

    motion = analysis.motions[0]
    lines = ["forces:"]
    keys: list[Key] = [("force", joint.key, joint.bodies[-1]) for joint in motion.dynamics.reactions.joints]
    keys += [("effort", j) for j in range(len(analysis.mechanism.inputs))]
    if motion.lanes.takes(keys):
        lines.append(f"  operations a pose: {motion.lanes.operations(keys)}")
    for j, entry in enumerate(analysis.mechanism.inputs):
        works, workless, absent = ledger(motion.dynamics.scene, j)
        lines.append(f"  virtual work at input {entry.name}: {', '.join(works) or 'no load does any'}")
        if workless:
            lines.append(f"  do no work, never evaluated for it: {', '.join(workless)}")
        if j == 0 and absent:
            lines += [f"  absent: {line}" for line in absent]
    lines.append("  joint forces, action and reaction, do no work together: none enters the effort")
    lines.append(
        f"  formed for the reactions: {', '.join(sorted(motion.dynamics.reactions.formed)) or 'nothing'}"
    )
    if motion.dynamics.scene.friction:
        lines.append(f"  friction: {motion.dynamics.friction_iterations} iterations")
    return "\n".join(lines)


def _input_text(values: Document) -> str:
    """The value of an input with its unit."""
    return f"{values['input_m']:.6g} m" if "input_m" in values else f"{values['input_deg']:.6g}°"
