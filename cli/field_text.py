"""What the terminal and the report say of a balancing in the field, in the same order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cli.read.units import degrees, from_si
from cli.show.text import angle_text, table_text

if TYPE_CHECKING:
    from cli.field_job import Field, Solved

FEW = 6  # so many rotors are shown in full


def conventions(field: Field) -> str:
    """Say how angles and phases are counted and what the corrections mean."""
    wanted = field.wanted
    state = (
        "the rotor as it stands, with the trial masses that were left on it"
        if wanted.from_here
        else "the rotor in its initial state, all trial masses off"
    )
    return (
        f"{wanted.conventions}\nCorrections: {field.runs.per}{'es' if field.runs.per == 'mass' else 's'} to ADD to {state}, "
        "at the radius of the trial masses."
    )


def runs_table(field: Field, solved: Solved, i: int) -> dict[str, list[Any]]:
    """The readings: a row for each sensor, amplitude and phase of each run beside each other."""
    group = solved.group
    columns: dict[str, list[Any]] = {"sensor": [str(channel) for channel in group.channels]}
    for name, values in [("initial", group.initial[i])] + [
        (f"run {trial.run}", group.runs[i, j]) for j, trial in enumerate(group.trials)
    ]:
        columns[f"{name}: {unit(field)}"] = [float(abs(value)) for value in values]
        if not field.wanted.four_run:
            columns[f"{name}: phase°"] = [float(degrees(value)) for value in values]
    return columns


def trials_lines(field: Field, solved: Solved, i: int) -> list[str]:
    """What was on the rotor in each trial run, a line each."""
    lines = []
    for j, trial in enumerate(solved.group.trials):
        masses = " + ".join(
            f"{field._amount(abs(t)):.6g} {field._unit} at {angle_text(degrees(t), '.6g')}° in {plane}"
            for plane, t in zip(solved.group.planes, solved.group.on[i, j], strict=True)
            if t
        )
        lines.append(f"run {trial.run}: {masses} on{', kept' if trial.kept else ''}")
    return lines


def influence_table(field: Field, solved: Solved, i: int) -> dict[str, list[Any]]:
    """The influence coefficients: a row for each sensor."""
    columns: dict[str, list[Any]] = {"sensor": [str(channel) for channel in solved.group.channels]}
    per = f"{unit(field)}/{field._unit}"
    from cli.read.units import to_si

    for p, plane in enumerate(solved.planes):
        alpha = solved.alpha[i, :, p]
        columns[f"{plane}: {per}"] = [
            float(a) for a in to_si(np.abs(alpha), field.runs.per, field.runs.mass_unit)
        ]
        columns[f"{plane}: phase°"] = [round(float(a), 2) for a in degrees(alpha)]
    return columns


def correction_table(field: Field, solved: Solved, i: int) -> dict[str, list[Any]]:
    """The corrections with their uncertainty, and the equivalent removal."""
    w = solved.corrections[i]
    columns: dict[str, list[Any]] = {
        "plane": list(solved.planes),
        f"ADD {field._unit}": [float(field._amount(abs(c))) for c in w],
        "at angle°": [float(degrees(c)) for c in w],
    }
    spreads = field.uncertainty(solved)
    if spreads is not None:
        columns[f"± {field._unit}"] = [_known(field._amount(x)) for x in spreads[0][i]]
        columns["± angle°"] = [_known(x) for x in spreads[1][i]]
    columns["or REMOVE at°"] = [float(degrees(-c)) if c else 0.0 for c in w]
    return columns


def split_lines(field: Field, solved: Solved, i: int) -> list[str]:
    """How each correction is split onto the places there are, a line for each plane."""
    lines = []
    for p, plane in enumerate(solved.planes):
        parts = field.split(solved.corrections[i, p])
        if parts:
            shares = " + ".join(
                f"{field._amount(part[2]):.5g} {field._unit} at {part[1]:.5g}° (place {part[0]})"
                for part in parts
            )
            lines.append(f"{plane} split: {shares}")
    return lines


def _known(value: Any) -> Any:
    return float(value) if np.isfinite(value) else "unknown"


def residual_table(field: Field, solved: Solved, i: int) -> dict[str, list[Any]]:
    """Vibration before and after, a row for each sensor."""
    before, after = solved.initial[i], solved.residual[i]
    columns: dict[str, list[Any]] = {
        "sensor": [str(channel) for channel in solved.group.channels],
        f"before {unit(field)}": [float(abs(v)) for v in before],
        f"predicted {unit(field)}": [float(abs(v)) for v in after],
    }
    if not field.wanted.four_run:
        columns["phase°"] = [round(float(degrees(v)), 2) for v in after]
    return columns


def unit(field: Field) -> str:
    """The amplitude's unit as people write it."""
    text = field.runs.amplitude_unit
    tag = ""
    for suffix, name in (("_pp", " pk-pk"), ("_pk", " pk"), ("_rms", " r.m.s.")):
        if text.endswith(suffix):
            text, tag = text[: -len(suffix)], name
    return text.replace("um", "µm").replace("_s2", "/s²").replace("_s", "/s") + tag


def summary(field: Field, solved: Solved, i: int) -> list[str]:
    """The figures of merit, a line each."""
    after = solved.residual[i]
    size = np.abs(after)
    lines = [
        f"residual: r.m.s. {np.sqrt(np.square(size).mean()):.6g}, largest {size.max():.6g} {unit(field)} "
        f"(before: {np.abs(solved.initial[i]).max():.6g})"
    ]
    if solved.bound is not None:
        lines.append(
            f"smallest possible largest residual, by the dual problem: {solved.bound[i]:.10g} {unit(field)}"
        )
    if solved.group.repeats:
        lines.append(
            f"repeated readings scatter by {solved.group.reading_sd[i]:.4g} {unit(field)} (standard deviation of one reading as a "
            f"vector, {solved.group.repeats} complex degree{'s' * (solved.group.repeats > 1)} of freedom)"
        )
    if solved.residual_95 is not None:
        known = []
        if field.wanted.reading_error is not None:
            relative, angle = field.wanted.reading_error
            known.append(f"of {100 * relative:.3g} % and {np.degrees(angle):.3g}°")
        if solved.group.reading_sd[i]:
            known.append(
                f"{'or ' if known else ''}as the repeats scatter{' where that is more' if known else ''}"
            )
        lines.append(
            f"with reading errors {' '.join(known)} (one standard deviation) the largest residual stays below {solved.residual_95[i]:.4g} {unit(field)} in 95 % of cases"
        )
    if np.isfinite(solved.condition[i]):
        lines.append(f"condition number of the scaled coefficients: {solved.condition[i]:.4g}")
    for channel, misfit in zip(
        solved.group.channels, solved.fits[i].misfit if solved.fits else (), strict=False
    ):
        lines.append(f"sensor {channel}: misfit of the amplitudes {misfit:.3g} {unit(field)} (r.m.s.)")
    return lines


def verdict(field: Field, solved: Solved, i: int) -> list[str]:
    """The ISO verdict, a line for each plane."""
    if field.wanted.tolerance is None:
        return []
    grade, whole = field.wanted.tolerance
    lines = [
        f"tolerance{' ' + grade if grade else ''}: U_per = {from_si(whole, 'unbalance', 'g_mm'):.6g} g·mm, shared equally"
    ]
    for plane, share, before in field._verdict(solved, i):
        initial = (
            "not determined"
            if np.isnan(before)
            else f"{from_si(before, 'unbalance', 'g_mm'):.6g} g·mm ({'within' if before <= share else 'beyond'})"
        )
        lines.append(
            f"  plane {plane}: permissible {from_si(share, 'unbalance', 'g_mm'):.6g}, initial {initial}"
        )
    return lines


def notes(field: Field) -> str:
    """Above the terminal's table: conventions, readings, coefficients."""
    parts = [conventions(field)]
    for rotor in range(min(len(field.runs.rotors), FEW)):
        k, i = field.place[rotor]
        solved = field.solved[k]
        name = f"rotor {field.runs.rotors[rotor]}: " if field.several else ""
        parts.append(f"{name}influence coefficients\n" + table_text(influence_table(field, solved, i)))
    if len(field.runs.rotors) > FEW:
        parts.append(f"… and {len(field.runs.rotors) - FEW} further rotors\n")
    return "\n".join(parts) + "\nmaterial to ADD:"


def afterword(field: Field) -> str:
    """Below the terminal's table: removal, residual, confidence, verdict."""
    parts = []
    for rotor in range(min(len(field.runs.rotors), FEW)):
        k, i = field.place[rotor]
        solved = field.solved[k]
        name = f"rotor {field.runs.rotors[rotor]}: " if field.several else ""
        removal = ", ".join(
            f"{plane} at {angle_text(degrees(-w), '.2f')}°"
            for plane, w in zip(solved.planes, solved.corrections[i], strict=True)
            if w
        )
        lines = [
            f"{name}or REMOVE the same amounts opposite: {removal}"
            if removal
            else f"{name}nothing to correct",
            "",
        ]
        lines[1:1] = [f"{name}{line}" for line in split_lines(field, solved, i)]
        lines += [f"{name}predicted vibration", table_text(residual_table(field, solved, i)).rstrip("\n"), ""]
        lines += [*summary(field, solved, i), *verdict(field, solved, i)]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)
