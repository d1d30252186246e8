"""What the report of a balancing in the field says: before, after, what to trim, the verdict; a page for each rotor."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from cli.field import columns, fit_words, picture, words
from cli.field.runs import Complex, Real
from cli.field.solve import FieldBalancing, Solved
from cli.field.tolerance import LastRun, first_reading, last_run, measured_verdicts, verdicts
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Section, Sheet, Table
from cli.show.verdicts import verdict_columns

MOST = 24  # rotors of one report


def sheets(found: FieldBalancing) -> Iterator[Sheet]:
    """Yield for each rotor what to do and what it does, and on a page of its own how it was found."""
    for rotor, (name, solved, i) in enumerate(found.each(MOST)):
        title = f"Rotor {name}" if name else ""
        yield Sheet(title, list(_sections(found, solved, i)), partial(picture.draw, found, [rotor]))
        yield Sheet(title, [Section("How it was found", _found(found, solved, i))])
    if len(found.runs.rotors) > MOST:
        yield Sheet("", [Section("Further rotors", [f"{len(found.runs.rotors) - MOST} are not shown here."])])


def _sections(found: FieldBalancing, solved: Solved, i: int) -> Iterator[Section]:
    last = last_run(found, solved, i)
    from_here = found.request.from_here and bool(solved.standing[i].any())
    before, said = first_reading(found, solved, i), [_convention(found)]
    if before is None:
        said.append("Before: as fitted to all runs, of which none was without masses.")
    states = {"before": solved.initial[i] if before is None else before}
    if last is not None:
        states[f"run {last.run}"] = last.vibration
        said.append(f"Run {last.run}: with {_masses(found, solved, last.on)} on the rotor.")
    states["predicted"] = solved.residual[i]
    yield Section("Vibration", [_vibration(found, solved, states), *said])
    state = (
        "as it stands, with the trial masses left on"
        if from_here
        else "in its initial state, all trial masses off"
    )
    amounts = _amounts(found, solved, i, solved.corrections[i])
    told = f"To ADD to the rotor {state}; or to REMOVE the same amounts opposite (+180°)."
    title = "Trim: what to add now" if from_here else "Corrections"
    yield Section(title, [amounts, *words.split_lines(found, solved, i), told])
    if last is not None and not from_here:
        told = f"To ADD to what was on the rotor in run {last.run}: together they are the corrections above."
        yield Section(
            "Trim: what to add now", [_amounts(found, solved, None, solved.total[i] - last.on), told]
        )
    yield Section("Verdict", _verdict(found, solved, i, last))
    if found.runs.fitted and (lines := fit_words.expected(found, solved, i)):
        yield Section("What to expect", ["\n".join(lines)])


def _amounts(found: FieldBalancing, solved: Solved, i: int | None, masses: Complex) -> Table:
    """Masses in their planes; with `i` the uncertainties of that rotor's corrections."""
    table = [
        Column("plane", "", solved.planes),
        Column(found.runs.per, found.runs.mass_unit, found.amount(np.abs(masses))),
        Column("angle", "deg", [degrees(w) if w else None for w in masses.tolist()]),
    ]
    if i is not None and solved.covariance is not None:
        along, across = (spread[i] for spread in solved.uncertainty)
        table += [
            Column("± ", found.runs.mass_unit, found.amount(along)),
            Column("± angle", "deg", across),
        ]
    return Table(table, keys=("plane",))


def _vibration(found: FieldBalancing, solved: Solved, states: dict[str, Complex]) -> Table:
    """Vibration in several states, as the instrument shows it."""
    unit, table = found.runs.amplitude_unit, columns.channels(found, solved.group.channels)
    keys = [column.header for column in table]
    for name, vibration in states.items():
        table.append(Column(name, unit, _four_digits(np.abs(vibration))))
        if not found.request.four_run:
            table.append(Column("phase", "deg", _phases(found, vibration)))
    return Table(table, keys=keys)


def _four_digits(values: Real) -> list[float]:
    return [float(f"{value:.4g}") for value in values.tolist()]


def _phases(found: FieldBalancing, vibration: Complex) -> list[float | None]:
    """Phases in the instrument's own sense, to a hundredth of a degree; none where nothing moves."""
    shown = vibration.conj() if found.against else vibration
    return [round(float(degrees(v)), 2) % 360 if abs(v) > 0 else None for v in shown.tolist()]


def _convention(found: FieldBalancing) -> str:
    if found.request.four_run:
        return words.sense(found)
    if not found.against:
        return (
            "Phases as the instrument shows them; they and the mass angles are counted in one common sense, from one mark "
            "on the rotor."
        )
    return (
        "Phases as the instrument shows them, counted against the sense of the mass angles; those of the influence "
        "coefficients and of the picture are counted in the sense of the mass angles."
    )


def _masses(found: FieldBalancing, solved: Solved, masses: Complex) -> str:
    said = words.masses_said(found, solved.planes, masses, ".6g")
    return " and ".join(text for text, w in zip(said, masses, strict=True) if w)


def _verdict(found: FieldBalancing, solved: Solved, i: int, last: LastRun | None) -> list[str | Table]:
    """The residual against what is permissible: measured where there is a run with the corrections, else predicted."""
    read = first_reading(found, solved, i)
    before = float(np.nanmax(np.abs(solved.initial[i] if read is None else read)))
    after = np.abs(solved.residual[i] if last is None else last.vibration)
    largest, unit = float(np.nanmax(after)), words.amplitude_unit(found)
    how = "as predicted" if last is None else f"as measured in run {last.run}"
    change = f", {100 * (largest - before) / before:+.1f} %" if before else ""
    parts: list[str | Table] = [
        f"Largest vibration {how}: {largest:.4g} {unit} (before: {before:.4g} {unit}{change})."
    ]
    ceiling = found.ceiling
    if ceiling is not None:
        verdict = "within" if largest <= ceiling * (1 + 1e-9) else "beyond"
        limit = [Column("largest", found.runs.amplitude_unit, [largest]), Column("permissible", found.runs.amplitude_unit, [ceiling])]  # fmt: skip
        parts.append(Table([*limit, Column("verdict", "", [verdict])]))
    tolerance = found.request.tolerance
    if tolerance is not None:
        whole = from_si(tolerance.permissible, "unbalance", "g_mm")
        grade = f" {tolerance.grade}" if tolerance.grade else ""
        planes = verdicts(found, solved, i) if last is None else measured_verdicts(found, solved, i, last)
        parts += [
            f"Residual unbalance {how}; tolerance{grade}: {whole:.6g} g·mm, shared equally.",
            Table(verdict_columns(planes, "g_mm"), keys=("plane",)),
        ]
    if last is None:
        parts.append(
            "No run with the corrections on is among these: measure one, add it to the table, and the verdict is on what was "
            "measured."
        )
    return parts


def _found(found: FieldBalancing, solved: Solved, i: int) -> list[str | Table]:
    """Readings, coefficients, figures of merit."""
    group = solved.group
    parts: list[str | Table] = []
    if found.runs.fitted:
        parts += [fit_words.summary(found, solved, i), _history(found, solved, i)]
    for j, trial in enumerate(group.trials):
        on = _masses(found, solved, group.on[i, j])
        parts += [f"Run {trial.run}{': ' + on if on else ''}{', kept' if trial.kept else ''}", _vibration(found, solved, {"amplitude": group.runs[i, j]})]  # fmt: skip
    influence = words.influence_table(found, solved, i)
    parts += ["Influence coefficients:", Table([Column(name, "", values) for name, values in influence.items()], keys=("sensor",))]  # fmt: skip
    return [*parts, "\n".join(words.summary(found, solved, i)[1:])]


def _history(found: FieldBalancing, solved: Solved, i: int) -> Table:
    rows = fit_words.history(found, solved, i)
    if found.against:
        rows["phase°"] = [round(-float(v or 0) % 360, 2) for v in rows["phase°"]]
    return Table([Column(name, "", values) for name, values in rows.items()], keys=("run", "sensor"))
