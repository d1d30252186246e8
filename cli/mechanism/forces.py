"""Forces as JSON, as tables and as text: effort, reactions, shaking, cycle, equilibria, counterweights."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism.poses import cells, pair

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.mechanism.solve import Job
    from virtualwork.motion import Motion
    from virtualwork.plan.joints import Joint

Column = list[Any]
GROUND = "ground"


def effort_name(slide: bool) -> str:
    """`torque_N_m` of a turning input, `force_N` of a slide."""
    return "force_N" if slide else "torque_N_m"


def rows_of(job: Job, motion: Motion) -> list[tuple[Joint, str, str]]:
    """The reactions asked for: (joint, on, from), each pair once, `on` the later in the file."""
    wanted = []
    for joint in motion.dynamics.reactions.joints:
        if len(joint.bodies) == 2:
            pairs = [(joint.bodies[1], joint.bodies[0])]
        else:
            pairs = [(body, "pin") for body in joint.bodies if body != GROUND]
        for on, of in pairs:
            if job.only is None or joint.name in job.only or on in job.only:
                wanted.append((joint, on, of))
    return wanted


def poses(job: Job) -> list[dict[str, Any]]:
    """Effort, reactions and shaking force of every pose, in the order of the JSON's poses."""
    parts = [_motion_parts(job, motion) for motion in job.motions]
    return [part[i] for i in range(len(job.inputs.shown)) for part in parts]


def _motion_parts(job: Job, motion: Motion) -> list[dict[str, Any]]:
    d, inputs = motion.dynamics, job.mechanism.inputs
    d.solve([(joint, on) for joint, on, _ in rows_of(job, motion)])
    work, euler = ([cells(values[:, j]) for j in range(len(inputs))] for values in (d.effort, d.newton_euler))
    reactions = []
    for joint, on, of in rows_of(job, motion):
        force = d.joint_force(joint, on)
        columns = (*pair(force), cells(d.joint_moment(joint, on)))
        reactions.append(({"joint": joint.name, "on": on, "from": of}, columns))
    shaking, moment = d.shaking
    shake = cells(shaking[:, 0]), cells(shaking[:, 1]), cells(moment)
    found = []
    for i in range(motion.n):
        efforts = []
        for j, entry in enumerate(inputs):
            name = effort_name(entry.is_slide)
            efforts.append({f"input_{name}": euler[j][i], f"virtual_work_{name}": work[j][i]})
        found.append(
            {
                "effort": efforts[0]
                if len(inputs) == 1
                else {"inputs": {e.name: part for e, part in zip(inputs, efforts, strict=True)}},
                "reactions": [
                    {**names, "fx_N": fx[i], "fy_N": fy[i], "moment_N_m": m[i]}
                    for names, (fx, fy, m) in reactions
                ],
                "shaking": {"fx_N": shake[0][i], "fy_N": shake[1][i], "moment_N_m": shake[2][i]},
            }
        )
    return found


def table(job: Job) -> dict[str, Column]:
    """One row per pose: effort both ways, their difference, every reaction, shaking force and moment."""
    columns: dict[str, Column] = {}

    def put(key: str, values: Column) -> None:
        columns.setdefault(key, []).extend(values)

    for assembly, motion in zip(job.assemblies, job.motions, strict=True):
        d = motion.dynamics
        put("step", list(job.inputs.steps))
        if job.several:
            put("branch", [str(assembly.number)] * motion.n)
        several = len(job.mechanism.inputs) > 1
        for j, entry in enumerate(job.mechanism.inputs):
            prefix = f"{entry.name}_" if several else ""
            put(f"{prefix}input_{'m' if entry.is_slide else 'deg'}", job.inputs.shown[:, j].tolist())
            name = effort_name(entry.is_slide)
            put(f"{prefix}input_{name}", cells(d.newton_euler[:, j]))
            put(f"{prefix}virtual_work_{name}", cells(d.effort[:, j]))
            put(f"{prefix}difference_{name}", cells(d.newton_euler[:, j] - d.effort[:, j]))
        for joint, on, of in rows_of(job, motion):
            force = d.joint_force(joint, on)
            lead = f"{joint.name}_{of}_on_{on}"
            x, y = pair(force)
            put(f"{lead}_fx_N", x)
            put(f"{lead}_fy_N", y)
            moment = d.joint_moment(joint, on)
            if joint.guide is not None or (_rubs(motion, joint, on) if job.block_of else moment.any()):
                put(f"{lead}_moment_N_m", cells(moment))
        shaking, moment = d.shaking
        put("shaking_fx_N", cells(shaking[:, 0]))
        put("shaking_fy_N", cells(shaking[:, 1]))
        put("shaking_moment_N_m", cells(moment))
    return columns


def _rubs(motion: Motion, joint: Joint, on: str) -> bool:
    """Whether a pin's friction has a moment on a body: its column stands in every block of a sweep."""
    return any(
        r.path is None and r.joint == joint.key and r.body == on for r in motion.dynamics.scene.friction
    )


def warnings(job: Job) -> list[str]:
    """What the forces cannot say, pose by pose: dead points, change points, locked friction, redundant joints."""
    found = [listed(job, what, places, len(places)) for what, places in troubles(job)]
    return list(dict.fromkeys([*found, *statements(job)]))


def troubles(job: Job) -> list[tuple[str, list[float]]]:
    """What the forces cannot say, and the inputs where they cannot."""
    found: list[tuple[str, list[float]]] = []

    def note(bad: NDArray[np.bool_], what: str) -> None:
        if bad.any():
            found.append((what, job.inputs.shown[bad, 0].tolist()))

    for motion in job.motions:
        d = motion.dynamics
        there = motion.assembled
        for values, what in (
            (
                d.effort,
                "the effort by virtual work has no finite value: a dead point, where the input cannot move the rest",
            ),
            (
                d.newton_euler if d.statics is None else d.effort,
                "the joint forces have no finite value: loads in line with the links at a dead or change point",
            ),
        ):
            if not motion.assembly.track.folded:  # singular in every pose: that is said once
                note(there & ~np.isfinite(values).all(axis=1) & ~d.locked, what)
        if d.scene.friction:
            note(there & d.locked, "friction locks the mechanism: no reaction balances its own friction")
    return found


def statements(job: Job) -> list[str]:
    """What is to be said of the forces whatever the pose."""
    found: list[str] = []
    for motion in job.motions:
        d = motion.dynamics
        if d.statics is not None:
            found += d.statics.undetermined()
    for motion in job.motions[:1]:
        for body, r in motion.dynamics.scene.rigid.items():
            if r.inertia and not r.mass and motion.dynamics.scene.moves and not _pinned(job, body, r.center):
                found.append(
                    f"[links.{body}]: an inertia and no mass, though its centre moves: no inertia force from it"
                )
    if job.mechanism.friction and not any(motion.dynamics.scene.moves for motion in job.motions):
        found.append(
            "friction: nothing moves (speed zero), so that its direction and size are not determined: left out"
        )
    return list(dict.fromkeys(found))


def _pinned(job: Job, body: str, center: complex) -> bool:
    """Whether a link turns about its centre, pinned to the ground there."""
    points = job.mechanism.links[body].points
    return any(GROUND in bodies and points.get(name) == center for name, bodies in job.mechanism.pins.items())


def listed(job: Job, what: str, places: list[float], count: int) -> str:
    """One line for what happens at some inputs: the first five of them, and how many more there are."""
    unit = "m" if job.mechanism.inputs[0].is_slide else "deg"
    named = ", ".join(f"{place:g} {unit}" for place in places[:5])
    more = f" and {count - 5} further poses" if count > 5 else ""
    return f"at input {named}{more}: {what}"


# -- cycle --------------------------------------------------------------------------------------------------------


def cycle(job: Job, coefficient: float | None) -> dict[str, Any]:
    """Mean, peak and RMS effort over the sweep, work, energy error, flywheel."""
    from virtualwork.study.cycle import Cycle

    motion = job.motions[0]
    m = job.mechanism
    if len(m.inputs) != 1:
        raise DataError(f"{job.file}: a cycle has one input, found {len(m.inputs)}")
    name = effort_name(m.inputs[0].is_slide)
    empty: dict[str, Any] = {f"{key}_{name}": None for key in ("mean", "peak", "rms")}
    empty |= {"work_J": None, "energy_closure_J": None, "flywheel_inertia_kg_m2": None}
    if motion.n < 2 or not np.isfinite(motion.effort).all():
        job.warnings.append(
            "cycle: the effort is not finite at every pose of the sweep: no mean, work or flywheel"
        )
        return empty
    c = Cycle(motion)
    found = {
        f"mean_{name}": c.mean,
        f"peak_{name}": c.peak,
        f"rms_{name}": c.rms,
        "work_J": c.work,
        "energy_closure_J": c.closure,
        "flywheel_inertia_kg_m2": None,
    }
    if coefficient is not None:
        if m.inputs[0].is_slide:
            raise DataError(f"{job.file}: --flywheel: the input is a slide: a flywheel turns")
        try:
            found["flywheel_inertia_kg_m2"] = c.flywheel(coefficient)
        except ValueError as error:
            raise DataError(f"{job.file}: --flywheel: {error}") from None
        found["energy_fluctuation_J"] = c.fluctuation
    return found


def cycle_text(part: dict[str, Any]) -> str:
    """The cycle below the table."""
    lines = ["cycle:"]
    for key, value in part.items():
        if value is not None:
            name, unit = _split_unit(key)
            lines.append(f"  {name:<18} {value:.6g} {unit}")
    return "\n".join(lines)


def _split_unit(key: str) -> tuple[str, str]:
    for suffix in ("_torque_N_m", "_force_N"):
        if key.endswith(suffix):
            return key.removesuffix(suffix).replace("_", " ") + suffix.split("_")[1].join([" ", ""]), (
                "N·m" if "torque" in suffix else "N"
            )
    for suffix, unit in (("_kg_m2", "kg·m²"), ("_J", "J")):
        if key.endswith(suffix):
            return key.removesuffix(suffix).replace("_", " "), unit
    return key, ""


# -- equilibria ---------------------------------------------------------------------------------------------------


def equilibria(job: Job, swept: bool) -> tuple[list[dict[str, Any]], list[str]]:
    """The positions where the loads balance without effort, and what to say of them."""
    from virtualwork import equilibria as search

    m = job.mechanism
    spans = None
    if swept:
        spans = np.stack([job.inputs.values.min(axis=0), job.inputs.values.max(axis=0)], axis=1)
        held = spans[:, 0] == spans[:, 1]
        if held.any():
            spans = None
    found = search(m, spans)
    rows = []
    for e in found.found:
        values = {}
        for entry, value in zip(m.inputs, e.inputs, strict=True):
            shown = value if entry.is_slide else math.degrees(value) % 360.0
            values[entry.name] = {"input_m" if entry.is_slide else "input_deg": shown}
        place = next(iter(values.values())) if len(m.inputs) == 1 else {"inputs": values}
        rows.append({**place, "stable": e.stable, "potential_J": e.potential})
    said = []
    if not found.loaded:
        said.append("nothing acts at rest: every position is one of equilibrium")
    elif found.region:
        said.append("positions of rest fill a part of the range: they are not isolated, and not listed")
    elif found.everywhere:
        said.append(
            "the loads balance in every position: equilibrium everywhere, neither stable nor unstable"
        )
    elif not rows:
        said.append("no equilibrium: the loads balance at no position of the range")
    if any(row["stable"] is None for row in rows):
        said.append("stable null: the second variation of the potential vanishes there and does not decide")
    return rows, said


def equilibria_text(rows: list[dict[str, Any]]) -> str:
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


def _input_text(values: dict[str, Any]) -> str:
    """The value of an input with its unit."""
    return f"{values['input_m']:.6g} m" if "input_m" in values else f"{values['input_deg']:.6g}°"


# -- counterweights -----------------------------------------------------------------------------------------------


def counterweights(job: Job, links: list[str]) -> dict[str, Any]:
    """Counterweights on links that leave the least RMS shaking force over the sweep."""
    from virtualwork.study.counterweights import least_squares

    weights, before, after = least_squares(job.motions[0], links)

    def rms(force: NDArray[np.complex128]) -> float:
        return float(np.sqrt(np.nanmean(np.abs(force) ** 2)))

    return {
        "weights": [
            {
                "link": link,
                "mass_radius_kg_m": abs(w),
                "angle_deg": math.degrees(math.atan2(w.imag, w.real)) % 360.0,
            }
            for link, w in weights.items()
        ],
        "shaking_rms_before_N": rms(before),
        "shaking_rms_after_N": rms(after),
    }


def counterweights_text(part: dict[str, Any]) -> str:
    """The counterweights below the table."""
    lines = ["counterweights (mass times radius from the link's pivot, angle from the link's x-axis):"]
    lines += [
        f"  {w['link']}: {w['mass_radius_kg_m']:.6g} kg·m at {w['angle_deg']:.4g}°" for w in part["weights"]
    ]
    lines.append(
        f"  RMS shaking force of inertia {part['shaking_rms_before_N']:.6g} N -> {part['shaking_rms_after_N']:.6g} N"
    )
    return "\n".join(lines)


# -- explain ------------------------------------------------------------------------------------------------------


def explain_text(job: Job) -> str:
    """Which loads did work, which do none, which are absent, which reactions were formed."""
    from virtualwork.formulas.effort import ledger

    motion = job.motions[0]
    lines = ["forces:"]
    for j, entry in enumerate(job.mechanism.inputs):
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
