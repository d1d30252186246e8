"""`--check`, `--newton` and `--explain`: what the mechanism is, and how it was solved."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.solve import ORDERS, Job

if TYPE_CHECKING:
    from virtualwork.branch.assembly import Assembly
    from virtualwork.branch.track import Track
    from virtualwork.study.newton_table import AllAtOnce


def check_document(job: Job) -> dict[str, Any]:
    """The character of the mechanism."""
    from virtualwork.study.check import Check

    check = Check(job.mechanism.assembly)
    slide = bool(job.mechanism.inputs) and job.mechanism.inputs[0].is_slide
    unit = "m" if slide else "deg"

    def shown(values: Any) -> Any:
        if values is None:
            return None
        return [None if not math.isfinite(v) else (v if slide else math.degrees(v)) for v in values]

    return {
        "mobility": check.mobility,
        "mobility_by_rank": check.mobility_by_rank,
        "redundant": list(check.redundant),
        "groups": list(check.groups),
        "four_bars": [
            {
                "links": list(f.links),
                "grashof": f.grashof,
                "transmission_deg": [math.degrees(v) if math.isfinite(v) else None for v in f.transmission],
            }
            for f in check.four_bars
        ],
        f"input_limits_{unit}": shown(check.input_limits),
        f"dead_points_{unit}": shown(check.dead_points),
        f"change_points_{unit}": shown(check.change_points),
        **({"singular": list(check.singular)} if check.singular else {}),
    }


def check_text(document: dict[str, Any]) -> str:
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


def newton_tables(job: Job) -> tuple[list[AllAtOnce], dict[str, Any]]:
    """Newton-Raphson from the guess at every pose; the table of the first, the largest difference of all."""
    from virtualwork.study.newton_table import all_at_once

    assembly = job.assemblies[0]
    done = [all_at_once(assembly, tuple(row)) for row in job.inputs.values.tolist()]
    first = done[0]
    names = [
        *(f"{n}_deg" for n in first.unknowns[: first.angles]),
        *(f"{n}_m" for n in first.unknowns[first.angles :]),
    ]
    iterates = []
    for it in first.iterates:
        values = [*np.degrees(it.unknowns[: first.angles]).tolist(), *it.unknowns[first.angles :].tolist()]
        iterates.append({"k": it.k, **dict(zip(names, values, strict=True)), "residual_m": it.residual})
    away = [i for i, d in enumerate(done) if not d.closed or not d.difference < 1e-6]
    for i in away[:3]:
        why = "did not converge" if not done[i].closed else "found another assembly"
        job.warnings.append(f"newton from the guess {why} at step {job.inputs.steps[i]}")
    if len(away) > 3:
        job.warnings.append(f"newton from the guess missed the assembly at {len(away)} of {len(done)} poses")
    differences = [d.difference for d in done if math.isfinite(d.difference)]
    return done, {
        "iterates": iterates,
        "newton_difference_rad": max(differences) if differences else None,
        "jacobian": {"unknowns": list(first.unknowns), "at": "the guess", "rows": first.jacobian.tolist()},
    }


def newton_text(document: dict[str, Any]) -> str:
    """The table of iterates, the Jacobian at the guess, and the difference to the closed form."""
    from cli.show.text import table_text

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


def explain_text(job: Job) -> str:
    """The order of solution, and for this request what was solved and what was skipped."""
    from virtualwork.plan.steps import Group, Place, Slide, Turn

    motion = job.motions[0]
    plan = motion.assembly.plan
    reached: dict[int, int] = {}
    for step, order in motion.solved:
        reached[id(step)] = max(order, reached.get(id(step), 0))
    lines = ["order of solution:"]
    for i, step in enumerate(plan.steps, 1):
        if isinstance(step, Turn):
            text = f"angle of {step.body}: {_angle_text(job, step)}"
        elif isinstance(step, Slide):
            text = f"slide at {job.mechanism.guides[step.guide].point}: the input"
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
    return "\n".join(lines)


def _angle_text(job: Job, step: Any) -> str:
    parts = [
        f"{k:g}·input {job.mechanism.inputs[j].name}" if k != 1 else f"input {job.mechanism.inputs[j].name}"
        for j, k in step.angle.inputs
    ]
    parts += [f"{r:g}·{base}" if r != 1 else base for base, r in step.angle.bases]
    if step.angle.const:
        parts.append(f"{math.degrees(step.angle.const):g} deg")
    return " + ".join(parts) or "fixed"


def _on_branch(job: Job, track: Track, found: list[float], digits: int) -> list[float]:
    """Inputs as they are shown, each once, deg in [0, period of the branch) or m."""
    if job.mechanism.inputs[0].is_slide:
        return sorted({round(v, digits) for v in found})
    if track.turns is None:
        return sorted({round(math.degrees(v), digits) for v in found})
    full = 360.0 * track.turns
    return sorted({round(math.degrees(v) % full, digits) % full for v in found})


def limit_warnings(job: Job, counted: list[tuple[int, int]] | None = None) -> list[str]:
    """One line for the poses that cannot be assembled, with the limit of the input that is near them; and branches.

    `counted`: how many these are of each assembly, and the first, where blocks of poses have told it.
    """
    lines = []
    if counted is None:
        gaps = [~job.assembled(motion) for motion in job.motions]
        counted = [(int(gap.sum()), int(np.argmax(gap))) for gap in gaps]
    for assembly, (missing, first) in zip(job.assemblies, counted, strict=True):
        track = assembly.track
        name = job.mechanism.inputs[0].name
        if missing:
            text = f"{missing} of {job.inputs.n} poses cannot be assembled"
            if track.active:
                slide = job.mechanism.inputs[0].is_slide
                shown = _on_branch(job, track, [v.input for v in track.limits()], 12)
                unit = "m" if slide else "deg"
                if shown:
                    values = ", ".join(f"{v:.13g}" for v in shown)
                    text += f": the input {name} has the limit{'s' * (len(shown) > 1)} {values} {unit}"
            lines.append(text + _shortfall(job, assembly, first))
        lines += _branch_lines(job, assembly)
        lines += track.warnings()
    return list(dict.fromkeys(lines))


def _shortfall(job: Job, assembly: Assembly, i: int) -> str:
    """By how much a pose does not close, and the nearest input where it would."""
    from virtualwork.branch.shortfall import shortfall

    pose = job.inputs.part(i, i + 1)
    found = shortfall(assembly, tuple(pose.values[0].tolist()))
    if found is None:
        return ""
    factor, unit = (1e3, "mm") if job.mechanism.size < 2 else (1.0, "m")
    shown = ", ".join(
        f"{v:.10g} {'m' if e.is_slide else 'deg'}"
        for e, v in zip(job.mechanism.inputs, pose.shown[0], strict=True)
    )
    text = f"; at {shown}: {found.text(lambda v: f'{v * factor:.6g} {unit}')}"
    if found.nearest is not None:
        slide = job.mechanism.inputs[0].is_slide
        there = found.nearest if slide else math.degrees(found.nearest)
        text += f"; it would close at {there:.10g} {'m' if slide else 'deg'}"
    return text


def _branch_lines(job: Job, assembly: Assembly) -> list[str]:
    """Change points on the way from the guess to the poses: which branch was taken, and the other."""
    track = assembly.track
    if not track.active:
        return []
    least, largest = job.inputs.span
    low, high = min(least, track.start), max(largest, track.start)
    lines = []
    slide = job.mechanism.inputs[0].is_slide
    for changes in track.changes.values():
        inside = [c for c in changes if low - 1e-12 <= c.input <= high + 1e-12]
        if not inside:
            continue
        at = _on_branch(job, track, [c.input for c in inside], 9)
        c = inside[0]
        group = next(g for g in assembly.plan.groups if g.name == c.group)
        names = [*group.angles, *(job.mechanism.guides[g].point for g in group.slides)]

        def rates(values: Any, names: list[str] = names) -> str:
            return ", ".join(
                f"d{n}/dq = {round(float(v), 12) + 0.0:.6g}" for n, v in zip(names, values, strict=True)
            )

        text = f"change point at {', '.join(f'{v:.10g}' for v in at)} {'m' if slide else 'deg'}: the branches of {c.group} cross; "
        text += f"the motion goes on along its tangent ({rates(c.rates[0])})"
        if c.other is not None:
            text += f", the other branch would go with {rates(c.other)}"
        lines.append(text)
    return lines
