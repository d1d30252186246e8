"""What the terminal and the report say of a balancing in the field, in the same order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.field.runs import Complex, Real
from cli.field.solve import FieldBalancing, Solved
from cli.field.tolerance import verdicts
from cli.read.units import degrees, from_si, to_si, written
from cli.show.text import angle_text, table_text

if TYPE_CHECKING:
    from cli.show.columns import Cell

    Columns = dict[str, list[Cell]]

FEW = 6  # so many rotors are shown in full

METHOD = (
    "Influence coefficients from trial runs (E. L. Thearle 1934), corrections by least squares or by the smallest largest "
    "residual (T. P. Goodman 1964; second-order cone program), all runs of a log fitted together; tolerance after ISO "
    "21940-11. The masses are at the radius of the trial masses."
)


def sense(found: FieldBalancing) -> str:
    """Say how phases and mass angles are counted."""
    request = found.request
    lags = request.phase_lag or found.runs.lags
    if request.four_run:
        return "Mass angles as in the table; no phase is used."
    if request.rotation is None and not lags:
        return "Phases and mass angles are counted in one common sense, from one mark on the rotor."
    turning = (
        f"the shaft turns {request.rotation} as seen against +z"
        if request.rotation
        else "phases are counted with the mass angles"
    )
    return (
        f"The instrument's phases {'lag' if lags else 'lead'} ({turning}); all phases given out are counted in the sense of the "
        "mass angles."
    )


def conventions(found: FieldBalancing) -> str:
    """Say how angles and phases are counted and what the corrections mean."""
    state = (
        "the rotor as it stands, with the trial masses that were left on it"
        if found.request.from_here
        else "the rotor in its initial state, all trial masses off"
    )
    return (
        f"{sense(found)}\nCorrections: {found.runs.per}{'es' if found.runs.per == 'mass' else 's'} to ADD to {state}, "
        "at the radius of the trial masses."
    )


def influence_table(found: FieldBalancing, solved: Solved, i: int) -> Columns:
    """The influence coefficients: a row for each sensor."""
    columns: Columns = {"sensor": [str(channel) for channel in solved.group.channels]}
    per = f"{amplitude_unit(found)}/{found.unit}"
    for p, plane in enumerate(solved.planes):
        alpha = solved.alpha[i, :, p]
        columns[f"{plane}: {per}"] = to_si(np.abs(alpha), found.runs.per, found.runs.mass_unit).tolist()
        columns[f"{plane}: phase°"] = _hundredths(alpha)
    return columns


def _hundredths(values: Complex) -> list[Cell]:
    return [round(angle, 2) for angle in degrees(values).tolist()]


def masses_said(found: FieldBalancing, planes: list[str], masses: Complex, spec: str) -> list[str]:
    """Say a mass in each plane."""
    return [
        f"{found.amount(abs(w)):.6g} {found.unit} at {angle_text(degrees(complex(w)), spec)}° in {plane}"
        for plane, w in zip(planes, masses, strict=True)
    ]


def split_lines(found: FieldBalancing, solved: Solved, i: int) -> list[str]:
    """How each correction is split onto the places there are, a line for each plane."""
    lines = []
    for p, plane in enumerate(solved.planes):
        parts = found.split(solved.corrections[i, p])
        if parts:
            shares = " + ".join(
                f"{found.amount(part[2]):.5g} {found.unit} at {part[1]:.5g}° (place {part[0]})"
                for part in parts
            )
            lines.append(f"{plane} split: {shares}")
    return lines


def _known(values: Real) -> list[Cell]:
    return [value if np.isfinite(value) else "unknown" for value in values.tolist()]


def residual_table(found: FieldBalancing, solved: Solved, i: int) -> Columns:
    """Vibration before and after, a row for each sensor."""
    before, after = solved.initial[i], solved.residual[i]
    columns: Columns = {
        "sensor": [str(channel) for channel in solved.group.channels],
        f"before {amplitude_unit(found)}": np.abs(before).tolist(),
        f"predicted {amplitude_unit(found)}": np.abs(after).tolist(),
    }
    if solved.balance is not None:
        spread = solved.balance.vibration_deviation(solved.total)[i]
        if np.isfinite(spread).any():
            columns[f"± {amplitude_unit(found)}"] = _known(spread)
        if found.ceiling is not None:
            within = solved.balance.probability_within(found.ceiling)[i]
            columns[f"within {found.ceiling:g}: probability"] = _known(within)
    if not found.request.four_run:
        columns["phase°"] = _hundredths(after)
    return columns


def amplitude_unit(found: FieldBalancing) -> str:
    """The amplitude's unit as people write it."""
    return written(found.runs.amplitude_unit)


def summary(found: FieldBalancing, solved: Solved, i: int) -> list[str]:
    """The figures of merit, a line each."""
    after = solved.residual[i]
    size = np.abs(after)
    lines = [
        f"residual: r.m.s. {np.sqrt(np.square(size).mean()):.6g}, largest {size.max():.6g} {amplitude_unit(found)} "
        f"(before: {np.abs(solved.initial[i]).max():.6g})"
    ]
    if solved.bound is not None:
        lines.append(
            f"smallest possible largest residual, by the dual problem: {solved.bound[i]:.10g} {amplitude_unit(found)}"
        )
    if solved.group.repeats:
        lines.append(
            f"repeated readings scatter by {solved.group.reading_sd[i]:.4g} {amplitude_unit(found)} (standard deviation of one reading as a "
            f"vector, {solved.group.repeats} complex degree{'s' * (solved.group.repeats > 1)} of freedom)"
        )
    if solved.residual_95 is not None and np.isfinite(solved.residual_95[i]):
        known = []
        if found.request.reading_error is not None:
            relative, angle = found.request.reading_error
            known.append(f"of {100 * relative:.3g} % and {np.degrees(angle):.3g}°")
        elif solved.balance is not None:
            left = solved.balance.fit.degrees_of_freedom[i] > 0
            known.append(
                f"as the {'residuals of the fit' if left else 'readings behind the coefficients'} scatter"
            )
        if solved.group.reading_sd[i]:
            known.append(
                f"{'or ' if known else ''}as the repeats scatter{' where that is more' if known else ''}"
            )
        lines.append(
            f"with reading errors {' '.join(known)} (one standard deviation) the largest residual stays below {solved.residual_95[i]:.4g} {amplitude_unit(found)} in 95 % of cases"
        )
    if np.isfinite(solved.condition[i]):
        lines.append(f"condition number of the scaled coefficients: {solved.condition[i]:.4g}")
    for channel, misfit in zip(
        solved.group.channels, solved.fits[i].misfit if solved.fits else (), strict=False
    ):
        lines.append(
            f"sensor {channel}: misfit of the amplitudes {misfit:.3g} {amplitude_unit(found)} (r.m.s.)"
        )
    return lines


def verdict(found: FieldBalancing, solved: Solved, i: int) -> list[str]:
    """The ISO verdict, a line for each plane."""
    tolerance = found.request.tolerance
    if tolerance is None:
        return []
    whole = from_si(tolerance.permissible, "unbalance", "g_mm")
    lines = [
        f"tolerance{' ' + tolerance.grade if tolerance.grade else ''}: U_per = {whole:.6g} g·mm, shared equally"
    ]
    for v in verdicts(found, solved, i):
        share, before, after = (from_si(u, "unbalance", "g_mm") for u in v[1:])
        initial, residual = (
            said if size != size else f"{size:.6g} g·mm ({said})"
            for size, said in ((before, v.of(v.initial)), (after, v.of(v.residual)))
        )
        lines.append(
            f"  plane {v.plane}: permissible {share:.6g}, initial {initial}, residual as predicted {residual}"
        )
    return lines


def notes(found: FieldBalancing) -> str:
    """Above the terminal's table: conventions, readings, coefficients."""
    parts = [conventions(found)]
    for _, solved, i in found.each(FEW):
        parts.append(
            f"{found.of(solved.group, i)}influence coefficients\n"
            + table_text(influence_table(found, solved, i))
        )
    if len(found.runs.rotors) > FEW:
        parts.append(f"… and {len(found.runs.rotors) - FEW} further rotors\n")
    return "\n".join(parts) + "\nmaterial to ADD:"


def afterword(found: FieldBalancing) -> str:
    """Below the terminal's table: removal, residual, confidence, verdict."""
    parts = []
    for _, solved, i in found.each(FEW):
        name = found.of(solved.group, i)
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
        lines[1:1] = [f"{name}{line}" for line in split_lines(found, solved, i)]
        lines += [f"{name}predicted vibration", table_text(residual_table(found, solved, i)).rstrip("\n"), ""]
        lines += [*summary(found, solved, i), *verdict(found, solved, i)]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)
