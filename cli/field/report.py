"""The report of a balancing in the field: before, after, what to trim, the verdict; a page for each rotor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from cli.field import picture
from cli.field.field_balancing import FieldBalancing
from cli.field.runs import Complex, Real
from cli.field.solution import Solved
from cli.field.tables import Tables, amplitude_unit, channels, masses_text, sense
from cli.field.trim import LastRun, Trim, first_reading, last_run, measured_verdicts, verdicts
from cli.read.tolerance import verdict_table
from cli.show.bars import Bar, Bars
from cli.show.result import Section, Sheet
from dalembert.angles import degrees
from dalembert.results.columns import Column, Table
from dalembert.results.text import with_uncertainty
from dalembert.units import from_si

MOST = 24  # rotors of one report
BARS = 6  # sensors of one page
FEW = 4  # sensors whose phases stand on the first page
COEFFICIENTS = 16  # on that page
READINGS = 8  # of a log, on the page of how it was computed


def sheets(b: FieldBalancing, tables: Tables) -> Iterator[Sheet]:
    """Yield for each rotor a page with what to do and what it does, and one with how that was computed."""
    made = {name: table() for name, table in tables.items()}
    for rotor, (name, solved, i) in enumerate(b.each(MOST)):
        title = f"Rotor {name}" if name else ""
        of = _Rotor(b, made, b.runs.rotors[rotor], solved, i)
        history = partial(picture.draw, b, [rotor]) if b.runs.fitted else None
        yield Sheet(title, list(of.sections()), partial(picture.dials, b, [rotor], trims=of.trims))
        yield Sheet(title, list(of.method()), history, dense=True)
    if len(b.runs.rotors) > MOST:
        yield Sheet("", [Section("Further rotors", [f"{len(b.runs.rotors) - MOST} are not shown here."])])


def _of_rotor(table: Table, rotor: str) -> Table:
    """Return the rows of a rotor, without its name."""
    named = next(c for c in (*table.columns, *table.documented) if c.name == "rotor")
    rows = [k for k, name in enumerate(named.values) if name == rotor]
    columns = [
        replace(c, values=[c.values[k] for k in rows], error=None) for c in table.columns if c.name != "rotor"
    ]
    return replace(table, columns=columns, documented=())


class _Rotor:
    """The pages of a rotor."""

    def __init__(
        self, b: FieldBalancing, made: Mapping[str, Table], rotor: str, solved: Solved, i: int
    ) -> None:
        self.b, self.solved, self.i = b, solved, i
        self.tables = {name: _of_rotor(table, rotor) for name, table in made.items() if table.columns}
        self.last = last_run(b, solved, i)

    def parts(self, *of: str) -> list[str | Table]:
        """Return tables of the result, where there are such, between the sentences above and below them."""
        tables = [self.tables[name] for name in of if name in self.tables]
        return [part for table in tables for part in (table.above, table, table.below)]

    def sections(self) -> Iterator[Section]:
        """Yield the verdict, what to do, and what it does."""
        b, solved, i, last = self.b, self.solved, self.i, self.last
        why = sorted(set(Trim(b, solved).reasons[i])) if solved.standing[i].any() else [""]
        done = [] if "" in why else [f"Nothing to add: {' and '.join(why)}."]
        yield Section("Verdict", [*done, *_verdict(b, solved, i, last), *self.parts("zones")])
        yield Section("Vibration", [_bars(b, solved, self.states())])
        yield Section("What to add now", list(self._add()))
        if expected := self.parts("predict", "suggest", "suggest_gain"):
            yield Section("What to expect", expected)
        if self.few:
            yield self._phases()

    @property
    def few(self) -> bool:
        """Whether the first page has room for the phases of its sensors."""
        more = self.parts("predict", "suggest", "suggest_gain", "zones", "split", "trim_split")
        return len(self.solved.group.channels) <= FEW and not more

    @property
    def trims(self) -> bool:
        """Whether the rotor runs with corrections on, so that only what to add to these counts."""
        return bool(self.solved.standing[self.i].any()) and (
            self.last is not None or self.b.request.from_here
        )

    def _add(self) -> Iterator[str | Table]:
        """Yield what to add, as people write it: to the bare rotor, and to the rotor as it stands."""
        b, solved, i = self.b, self.solved, self.i
        on = masses_text(b, solved.planes, solved.standing[i], ".6g")
        if not self.trims:
            yield "With all trial masses off, ADD (or REMOVE the same amounts opposite, +180°):"
            yield _people(b, solved, i, here=False)
            yield from self.parts("split")
        if on:
            needed = "" in Trim(b, solved).reasons[i]
            leave = "Leave" if self.trims else "Or leave"
            add = "and ADD:" if needed else "and add nothing; the trim would be:"
            yield f"{leave} {on} on the rotor, as in its last run, {add}"
            yield _people(b, solved, i, here=True)
            yield from self.parts("trim_split")

    def states(self) -> dict[str, Complex]:
        """Return the vibration before, in the last run with corrections, and as predicted."""
        b, solved, i, last = self.b, self.solved, self.i, self.last
        before = first_reading(b, solved, i)
        states = {"before": solved.initial[i] if before is None else before}
        if last is not None:
            states[f"run {last.run}"] = last.vibration
        states["predicted"] = solved.residual[i]
        return states

    def method(self) -> Iterator[Section]:
        """Yield the vibration with its phases, the corrections in full, and how they were computed."""
        if not self.few:
            yield self._phases()
        fix = self.tables["corrections"]
        amounts = replace(fix, columns=[c for c in fix.columns if not c.name.startswith("trim_")])
        state = (
            "as it stands in its last run"
            if self.b.request.from_here
            else "in its initial state, all trial masses off"
        )
        parts = [amounts, f"To ADD to the rotor {state}.", *self.parts("static", "couple", "robust", "trim")]
        yield Section("Corrections in full", parts)
        yield Section("How it was computed", self._computed())

    def _phases(self) -> Section:
        """Return the vibration with its phases, as the instrument shows them."""
        b, solved, i, last = self.b, self.solved, self.i, self.last
        sentences = [_convention(b)]
        if first_reading(b, solved, i) is None:
            sentences.append("Before: as fitted to all runs, of which none was without masses.")
        if last is not None:
            sentences.append(
                f"Run {last.run}: with {masses_text(b, solved.planes, last.on, '.6g')} on the rotor."
            )
        return Section("Vibration and phase", [_vibration(b, solved, self.states()), *sentences])

    def _computed(self) -> list[str | Table]:
        """Return readings, coefficients, figures of merit."""
        b, solved, i = self.b, self.solved, self.i
        group, parts = solved.group, list[str | Table]()
        if b.runs.fitted:
            fit, residuals = self.tables["fit"], self.tables["residuals"]
            parts += [fit, fit.below, *self._as_read(residuals)]
        runs = {}
        for j, trial in enumerate(group.trials[1:], 1):
            on = masses_text(b, solved.planes, group.on[i, j], ".6g")
            parts.append(f"Run {trial.run}{': ' + on if on else ''}{', kept' if trial.kept else ''}")
            runs[f"run {trial.run}"] = group.means[i, j]
        if runs:
            parts.append(_vibration(b, solved, runs))
        if not b.stored:
            parts += ["Influence coefficients:", *self._coefficients()]
        figures = self.tables["rotors"]
        return [
            *parts,
            "Figures of merit:",
            figures,
            figures.below,
            *self.parts("misfit", "alternatives"),
        ]

    def _coefficients(self) -> list[str | Table]:
        """Return the coefficients, of many the first."""
        influence = self.tables["influence"]
        shown = [c for c in influence.columns if c.name not in ("correlation", "amplitude_unit")]
        columns = [
            replace(c, values=c.values[:COEFFICIENTS], error=None)
            for c in shown
            if any(v == v and v is not None for v in c.values)
        ]
        left = len(shown[0].values) - COEFFICIENTS
        return [
            replace(influence, columns=columns),
            f"… and {left} more (--json has all)" if left > 0 else "",
        ]

    def _as_read(self, residuals: Table) -> list[str | Table]:
        """Return the readings of a fit with phases as the instrument shows them; of a long log those that fit worst."""
        far = next(c for c in residuals.columns if c.name == "standardized").values
        worst = sorted(range(len(far)), key=lambda k: -float(far[k] or 0))[:READINGS]
        rows, columns = sorted(worst), []
        for column in residuals.columns:
            values = [column.values[k] for k in rows]
            if column.name == "phase" and self.b.against:
                values = [round(-float(v or 0) % 360, 2) for v in values]
            elif column.name in ("residual", "residual_phase", "standardized"):
                values = [v if v is None else float(f"{float(v):.3g}") for v in values]
            columns.append(replace(column, values=values, error=None))
        left = len(far) - len(rows)
        rest = f"{left} further readings lie nearer to the fit than these (--json has all)." if left else ""
        return [replace(residuals, columns=columns), rest]


def _bars(b: FieldBalancing, solved: Solved, states: dict[str, Complex]) -> Bars:
    """Each sensor's vibration before and after as bars, with the limit where there is one."""
    unit, rows = amplitude_unit(b), []
    few = solved.group.channels[:BARS]
    for s, channel in enumerate(few):
        for name, vibration in states.items():
            size = float(np.abs(vibration[s]))
            if size == size:
                label = f"{channel} {name}" if len(solved.group.channels) > 1 else name
                rows.append(Bar(label, size, f"{size:.3g} {unit}", name != "before"))
    ceiling, more = b.ceiling, len(solved.group.channels) - len(few)
    captions = [] if ceiling is None else [f"Limit: {ceiling:.4g} {unit}."]
    captions += [f"{more} further readings stand on the next page."] if more > 0 else []
    return Bars(rows, ceiling, " ".join(captions))


def _people(b: FieldBalancing, solved: Solved, i: int, here: bool) -> Table:
    """What to add in each plane, as people write it: 95.1 ± 0.9."""
    masses = solved.trim if here else solved.corrections
    along, across = solved.uncertainty_of(masses)
    sizes = zip(np.abs(masses[i]).tolist(), along[i].tolist(), strict=True)
    turns = zip(degrees(masses[i]).tolist(), across[i].tolist(), strict=True)
    amounts = [with_uncertainty(float(b.amount(w)), float(b.amount(sd))) for w, sd in sizes]
    angles = [with_uncertainty(turn, sd) if sd == sd else f"{turn:.1f}" for turn, sd in turns]
    angles = ["" if w == 0 else angle for w, angle in zip(masses[i].tolist(), angles, strict=True)]
    columns = [
        Column("plane", "", solved.planes),
        Column(b.runs.per, b.runs.mass_unit, amounts),
        Column("angle", "deg", angles),
    ]
    if here:
        needed = [not why for why in Trim(b, solved).reasons[i]]
        columns.append(Column("needed", "", ["yes" if one else "no" for one in needed]))
    return Table(columns, ("plane",))


def _vibration(b: FieldBalancing, solved: Solved, states: dict[str, Complex]) -> Table:
    """Vibration in several states, as the instrument shows it."""
    unit, (table, _) = b.runs.amplitude_unit, channels(b, solved.group.channels)
    keys = [column.header for column in table]
    for name, vibration in states.items():
        table.append(Column(name, unit, _four_digits(np.abs(vibration))))
        if not b.request.four_run:
            table.append(Column("phase", "deg", _phases(b, vibration)))
    return Table(table, keys=keys)


def _four_digits(values: Real) -> list[float]:
    return [float(f"{value:.4g}") for value in values.tolist()]


def _phases(b: FieldBalancing, vibration: Complex) -> list[float | None]:
    """Phases in the instrument's own sense, to a hundredth of a degree; none where nothing moves."""
    shown = vibration.conj() if b.against else vibration
    return [round(float(degrees(v)), 2) % 360 if abs(v) > 0 else None for v in shown.tolist()]


def _convention(b: FieldBalancing) -> str:
    if b.request.four_run:
        return sense(b)
    if not b.against:
        return (
            "Phases as the instrument shows them; they and the mass angles are counted in one common sense, from one mark "
            "on the rotor."
        )
    return (
        "Phases as the instrument shows them, counted against the sense of the mass angles; those of the influence "
        "coefficients and of the picture are counted in the sense of the mass angles."
    )


def _verdict(b: FieldBalancing, solved: Solved, i: int, last: LastRun | None) -> list[str | Table]:
    """The residual against what is permissible: measured where there is a run with the corrections, else predicted."""
    read = first_reading(b, solved, i)
    before = float(np.nanmax(np.abs(solved.initial[i] if read is None else read)))
    after = np.abs(solved.residual[i] if last is None else last.vibration)
    largest, unit = float(np.nanmax(after)), amplitude_unit(b)
    how = "as predicted" if last is None else f"as measured in run {last.run}"
    change = f", {100 * (largest - before) / before:+.1f} %" if before else ""
    parts: list[str | Table] = [
        f"Largest vibration {how}: {largest:.4g} {unit} (before: {before:.4g} {unit}{change})."
    ]
    ceiling = b.ceiling
    if ceiling is not None:
        verdict = "within" if largest <= ceiling * (1 + 1e-9) else "beyond"
        limit = [Column("largest", b.runs.amplitude_unit, [largest]), Column("permissible", b.runs.amplitude_unit, [ceiling])]  # fmt: skip
        parts.append(Table([*limit, Column("verdict", "", [verdict])]))
    tolerance = b.request.tolerance
    if tolerance is not None:
        whole = from_si(tolerance.permissible, "unbalance", "g_mm")
        grade = f" {tolerance.grade}" if tolerance.grade else ""
        planes = verdicts(b, solved, i) if last is None else measured_verdicts(b, solved, i, last)
        parts += [
            f"Residual unbalance {how}; tolerance{grade}: {whole:.6g} g·mm, {tolerance.sharing}.",
            _of_rotor(verdict_table([("", v) for v in planes], "g_mm"), ""),
        ]
    if last is None:
        parts.append(
            "No run with the corrections on is among these: measure one, add it to the table, and the verdict is on what was "
            "measured."
        )
    return parts
