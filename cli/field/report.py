"""The report of a balancing in the field, two pages for each rotor, and its pictures: dials; of a fitted log its history."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from balancing.picture import Vibration, vibration
from balancing.runs.runs import Complex
from cli.field.field_balancing import FieldBalancing
from cli.field.fit_tables import predicted, reverse, spread, suggested
from cli.field.remarks import instrument, sense
from cli.field.rotor import Rotor, each
from cli.field.tables import Rows, Tables, amplitude_unit, masses_text
from cli.read.options import bad
from cli.read.rotor_options import verdict_table
from dalembert.angles import degrees
from dalembert.drawing.sheet import blank
from dalembert.results.bars import Bar, Bars
from dalembert.results.columns import Column, Table
from dalembert.results.result import Section, Sheet
from dalembert.results.text import with_uncertainty

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing.log_picture import History
    from dalembert.page import Page

MOST = 24  # rotors of one report
BARS = 6  # sensors of one page
FEW = 4  # sensors whose phases stand on the first page
COEFFICIENTS = 16  # on that page
READINGS = 8  # of a log, on the page of how it was computed


def sheets(b: FieldBalancing, tables: Tables) -> Iterator[Sheet]:
    """Yield for each rotor a page with what to do and what it does, and one with how that was computed."""
    made = {name: table() for name, table in tables.items()}
    for rotor in each(b, MOST):
        title = f"Rotor {rotor.heading}" if rotor.heading else ""
        of = _Pages(rotor, made)
        history = partial(draw, b, [rotor]) if b.runs.fitted else None
        yield Sheet(title, list(of.sections()), partial(dials, b, [rotor], trims=of.trims))
        yield Sheet(title, list(of.method()), history, dense=True)
    if len(b.runs.rotors) > MOST:
        yield Sheet("", [Section("Further rotors", [f"{len(b.runs.rotors) - MOST} are not shown here."])])


def _rows_of(table: Table, rows: list[int] | slice) -> Table:
    """Return some rows of a table, without the column of rotors."""
    take = rows if isinstance(rows, list) else range(table.length)[rows]
    columns = [
        replace(c, values=[c.values[k] for k in take], error=None) for c in table.columns if c.name != "rotor"
    ]
    return replace(table, columns=columns, documented=())


def _of_rotor(table: Table, rotor: str) -> Table:
    """Return the rows of a rotor, without its name."""
    named = next(c for c in (*table.columns, *table.documented) if c.name == "rotor")
    return _rows_of(table, [k for k, name in enumerate(named.values) if name == rotor])


class _Pages:
    """The pages of a rotor."""

    def __init__(self, rotor: Rotor, made: Mapping[str, Table]) -> None:
        self.rotor, self.b, self.solved, self.i, self.last = rotor, rotor.b, rotor.solved, rotor.i, rotor.last
        self.tables = {name: _of_rotor(table, rotor.name) for name, table in made.items() if table.columns}
        self.unit, self.against = rotor.b.runs.amplitude_unit, rotor.against
        if self.against and "predict" in self.tables:
            reverse(self.tables["predict"])

    def parts(self, *of: str) -> list[str | Table]:
        """Return tables of the result, where there are such, between the sentences above and below them."""
        tables = [self.tables[name] for name in of if name in self.tables]
        return [part for table in tables for part in (table.above, table, table.below)]

    # -- what to do, and what it does ------------------------------------------------------------------------

    def sections(self) -> Iterator[Section]:
        """Yield the verdict, what to do, and what it does."""
        why = sorted(set(self.rotor.reasons)) if self.rotor.standing.any() else [""]
        done = [] if "" in why else [f"Nothing to add: {' and '.join(why)}."]
        yield Section("Verdict", [*done, *self._verdict(), *self.parts("zones")])
        yield Section("Vibration", [self._bars()])
        yield Section("What to add now", list(self._add()))
        if expected := self.parts("predict", "suggest", "suggest_gain"):
            yield Section("What to expect", expected)
        if self.few:
            yield self._phases()

    @property
    def few(self) -> bool:
        """Whether the first page has room for the phases of its sensors."""
        more = self.parts("predict", "suggest", "suggest_gain", "zones", "split", "trim_split")
        return len(self.rotor.channels) <= FEW and not more

    @property
    def trims(self) -> bool:
        """Whether the rotor runs with corrections on, so that only what to add to these counts."""
        return bool(self.rotor.standing.any()) and (self.last is not None or self.b.request.from_here)

    def _verdict(self) -> Iterator[str | Table]:
        """Yield the residual against what is permissible: measured where there is a run with the corrections, else predicted."""
        b, last, read = self.b, self.last, self.rotor.first_reading
        before = float(np.nanmax(np.abs(self.solved.initial[self.i] if read is None else read)))
        after = np.abs(self.solved.residual[self.i] if last is None else last.vibration)
        largest, unit = float(np.nanmax(after)), amplitude_unit(b)
        how = "as predicted" if last is None else f"as measured in run {last.run}"
        change = f", {100 * (largest - before) / before:+.1f} %" if before else ""
        yield f"Largest vibration {how}: {largest:.4g} {unit} (before: {before:.4g} {unit}{change})."
        if b.ceiling is not None:
            verdict = "within" if largest <= b.ceiling * (1 + 1e-9) else "beyond"
            limits = {"largest": largest, "permissible": b.ceiling}
            columns = [Column(name, self.unit, [value]) for name, value in limits.items()]
            yield Table([*columns, Column("verdict", "", [verdict])])
        tolerance = b.request.tolerance
        if tolerance is not None:
            whole = tolerance.text(b.runs.unbalance_unit)
            grade = f" {tolerance.grade}" if tolerance.grade else ""
            planes = self.rotor.verdicts(measured=last is not None)
            yield f"Residual unbalance {how}; tolerance{grade}: {whole}, {tolerance.sharing}."
            yield _rows_of(verdict_table([("", v) for v in planes], b.runs.unbalance_unit), slice(None))
        if last is None:
            yield (
                "No run with the corrections on is among these: measure one, add it to the table, and the verdict is on what was "
                "measured."
            )

    def _bars(self) -> Bars:
        """Each sensor's vibration before and after as bars, with the limit where there is one."""
        unit, rows, channels = amplitude_unit(self.b), [], self.rotor.channels
        for s, channel in enumerate(channels[:BARS]):
            for name, vectors in self.states().items():
                size = float(np.abs(vectors[s]))
                if size == size:
                    label = f"{channel} {name}" if len(channels) > 1 else name
                    rows.append(Bar(label, size, f"{size:.3g} {unit}", name != "before"))
        ceiling, more = self.b.ceiling, len(channels) - BARS
        captions = [] if ceiling is None else [f"Limit: {ceiling:.4g} {unit}."]
        captions += [f"{more} further readings stand on the next page."] if more > 0 else []
        return Bars(rows, ceiling, " ".join(captions))

    def _add(self) -> Iterator[str | Table]:
        """Yield what to add, as people write it: to the bare rotor, and to the rotor as it stands."""
        on = masses_text(self.b, self.rotor.planes, self.rotor.standing, ".6g")
        if not self.trims:
            yield "With all trial masses off, ADD (or REMOVE the same amounts opposite, +180°):"
            yield self._people(self.solved.corrections)
            yield from self.parts("split")
        if on:
            leave = "Leave" if self.trims else "Or leave"
            needed = "" in self.rotor.reasons
            add = "and ADD:" if needed else "and add nothing; the trim would be:"
            yield f"{leave} {on} on the rotor, as in its last run, {add}"
            yield self._people(self.solved.trim, self.rotor.reasons)
            yield from self.parts("trim_split")

    def _people(self, masses: Complex, reasons: list[str] | None = None) -> Table:
        """The mass to add in each plane, as people write it: 95.1 ± 0.9."""
        b, i = self.b, self.i
        along, across = (of[i].tolist() for of in self.solved.uncertainty(masses))
        sizes = zip(np.abs(masses[i]).tolist(), along, strict=True)
        turns = zip(masses[i].tolist(), degrees(masses[i]).tolist(), across, strict=True)
        amounts = [with_uncertainty(float(b.amount(w)), float(b.amount(sd))) for w, sd in sizes]
        angles = [
            "" if w == 0 else with_uncertainty(turn, sd) if sd == sd else f"{turn:.1f}"
            for w, turn, sd in turns
        ]
        columns = [
            Column("plane", "", self.rotor.planes),
            Column(b.runs.per, b.runs.mass_unit, amounts),
            Column("angle", "deg", angles),
        ]
        if reasons is not None:
            columns.append(Column("needed", "", ["no" if why else "yes" for why in reasons]))
        return Table(columns, ("plane",))

    def states(self) -> dict[str, Complex]:
        """Return the vibration before, in the last run with corrections, and as predicted."""
        before = self.rotor.first_reading
        states = {"before": self.solved.initial[self.i] if before is None else before}
        if self.last is not None:
            states[f"run {self.last.run}"] = self.last.vibration
        states["predicted"] = self.solved.residual[self.i]
        return states

    # -- how it was computed ---------------------------------------------------------------------------------

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
        sentences, last = [instrument(self.rotor)], self.last
        if self.rotor.first_reading is None:
            sentences.append("Before: as fitted to all runs, of which none was without masses.")
        if last is not None:
            on = masses_text(self.b, self.rotor.planes, last.on, ".6g")
            sentences.append(f"Run {last.run}: with {on} on the rotor.")
        return Section("Vibration and phase", [self._vibration(self.states()), *sentences])

    def _vibration(self, states: dict[str, Complex]) -> Table:
        """Vibration in several states, to four digits; phases as the instrument shows them, none where nothing moves."""
        columns = Rows.of(self.b, ()).read(self.b, self.rotor.channels).shown
        columns = [column for column in columns if column.name != "rotor"]
        keys = [column.header for column in columns]
        for name, vectors in states.items():
            sizes = [float(f"{value:.4g}") for value in np.abs(vectors).tolist()]
            columns.append(Column(name, self.unit, sizes))
            if not self.b.request.four_run:
                shown = vectors.conj() if self.against else vectors
                phases = [round(float(degrees(v)), 2) % 360 if abs(v) > 0 else None for v in shown.tolist()]
                columns.append(Column("phase", "deg", phases))
        return Table(columns, keys=keys)

    def _computed(self) -> list[str | Table]:
        """Return readings, coefficients, figures of merit."""
        group, parts, runs = self.rotor.group, list[str | Table](), {}
        if self.b.runs.fitted:
            fit = self.tables["fit"]
            parts += [fit, fit.below, *self._as_read(self.tables["residuals"])]
        else:
            for j, run in enumerate(group.lines.runs(self.i)):
                if not group.bare[self.i, j]:
                    on = masses_text(self.b, self.rotor.planes, group.on[self.i, j], ".6g")
                    parts.append(f"Run {run}: {on}")
                    runs[f"run {run}"] = group.means[self.i, j]
        if runs:
            parts.append(self._vibration(runs))
        if not self.b.stored:
            parts += ["Influence coefficients:", *self._coefficients()]
        figures = self.tables["rotors"]
        return [*parts, "Figures of merit:", figures, figures.below, *self.parts("misfit", "alternatives")]

    def _coefficients(self) -> list[str | Table]:
        """Return the coefficients, of many the first."""
        influence = self.tables["influence"]
        table = _rows_of(influence, slice(COEFFICIENTS))
        columns = [
            c
            for c in table.columns
            if c.name not in ("correlation", "amplitude_unit", "phase_sense")
            and any(v == v and v is not None for v in c.values)
        ]
        left = influence.length - COEFFICIENTS
        return [replace(table, columns=columns), f"… and {left} more (--json has all)" if left > 0 else ""]

    def _as_read(self, residuals: Table) -> list[str | Table]:
        """Return the readings of a fit with phases as the instrument shows them; of a long log those that fit worst."""
        far = next(c for c in residuals.columns if c.name == "standardized").values
        worst = sorted(range(len(far)), key=lambda k: -float(far[k] or 0))[:READINGS]
        table = _rows_of(residuals, sorted(worst))
        if self.against:
            reverse(table)
        for column in table.columns:
            if column.name in ("residual", "residual_phase", "standardized"):
                column.values = [v if v is None else float(f"{float(v):.3g}") for v in column.values]
        left = len(far) - len(worst)
        rest = f"{left} further readings lie nearer to the fit than these (--json has all)." if left else ""
        return [table, rest]


# -- pictures --------------------------------------------------------------------------------------------------
def draw(b: FieldBalancing, rotors: Sequence[Rotor]) -> Figure:
    """Draw for each rotor the vibration before and after, and the corrections; of a fit its history too."""
    if not b.runs.fitted:
        return dials(b, rotors)
    from balancing.log_picture import log_history

    return log_history([_history(b, rotor) for rotor in rotors], amplitude_unit(b), b.unit, blank())


def dials(b: FieldBalancing, rotors: Sequence[Rotor], *, trims: bool = False) -> Figure:
    """Draw for each rotor the vibration before and after, and the corrections, as dials; or what to add as it stands."""
    figure = blank()
    vibration([_rotor(b, rotor, trims) for rotor in rotors], amplitude_unit(b), b.unit, figure=figure)
    return figure


def _rotor(b: FieldBalancing, rotor: Rotor, trims: bool) -> Vibration:
    solved, i = rotor.solved, rotor.i
    fix, start = (solved.trim, 0 * solved.standing) if trims else (solved.corrections, solved.start)
    places = b.request.places or ()
    return Vibration(
        rotor.heading,
        [str(channel) for channel in rotor.channels],
        solved.initial[i],
        solved.residual[i],
        solved.planes,
        b.amount(fix[i]),
        b.amount(start[i]),
        places=np.radians(places).tolist(),
        split=[_on_places(b, w) for w in fix[i].tolist()] if places else [],
    )


def _on_places(b: FieldBalancing, w: complex) -> list[float]:
    """Return what of a correction goes on each of the places, in the unit of the trial masses."""
    masses = [0.0] * len(b.request.places or ())
    for name, _, mass in b.split(w):
        masses[int(name) - 1] = float(b.amount(mass))
    return masses


def _history(b: FieldBalancing, rotor: Rotor) -> History:
    from balancing import region_factor
    from balancing.log_picture import History

    solved, i, balance = rotor.solved, rotor.i, rotor.solved.fitted
    spreads, prediction, masses = [], None, None
    if solved.covariance is not None:
        # corrections of dependent planes, under limits, are drawn: to first order they are not determined
        known = np.isfinite(solved.condition[i]) or b.request.ridge
        freedom = (
            balance.degrees_of_freedom[i]
            if known
            else balance.errors.degrees_of_freedom[[i] * len(solved.planes)]
        )
        factors = region_factor(0.95, freedom).tolist()
        covariances = solved.covariance[i] * b.amount(1.0) ** 2
        spreads = list(zip(covariances, factors, strict=True))
    if b.predict is not None:
        on = np.broadcast_to(b.run_to_predict(solved.planes), solved.corrections.shape)
        prediction = predicted(b, solved)[0][i], balance.vibration_spread(on, reading=True)
    if b.request.suggest and (run := suggested(rotor)) is not None:
        masses = np.asarray(b.amount(run.masses))
    places = b.request.places or ()
    return History(
        rotor.heading,
        i,
        [str(channel) for channel in rotor.channels],
        rotor.group.lines.of(i),
        balance.fit,
        rotor.group.chance[i],
        solved.initial[i],
        solved.residual[i],
        balance.vibration_spread(solved.total),
        solved.planes,
        np.asarray(b.amount(solved.corrections[i])),
        spreads,
        prediction,
        masses,
        places,
        [_on_places(b, complex(w)) for w in solved.corrections[i]] if places else [],
    )


# -- the page that computes ------------------------------------------------------------------------------------

LEAST_SQUARES = (
    "this sheet computes least squares without limits; where a mass is beyond its limit, or the least maximum is wanted, "
    "dalembert field solves the problem with limits from the rows of this sheet"
)


def machine_page(b: FieldBalancing) -> Page:
    """The page of one machine.

    Raises
    ------
    typer.BadParameter
        Where no phases are read, or there are several machines.
    """
    from balancing import initial_unbalance
    from balancing.sheet import machine_sheet

    runs, request = b.runs, b.request
    if len(runs.rotors) > 1:
        raise bad("--page", f"a sheet is of one machine, found {len(runs.rotors)}")
    if request.four_run:
        raise bad("--page", "a sheet computes from amplitudes with phases")
    solved = b.solved[0]
    # a ridge makes up for dependent planes, not for one without any effect
    if not (solved.alpha[0].any(axis=0).all() if request.ridge else np.isfinite(solved.condition[0])):
        raise bad(
            "--page",
            "a sheet computes without limits, and the readings cannot distinguish the planes: leave one out",
        )
    group = solved.group
    spreads = spread(b, solved)
    covariance, deviations = None, None
    if spreads is not None:
        deviations = spreads.along[0], spreads.across[0]
        size = np.sqrt(np.square(spreads.along[0]) + np.square(spreads.across[0]))
        covariance = size[:, :, None] * size[:, None, :] * spreads.correlation[0]
    elif b.stored is not None:
        stored = b.stored.coefficients(runs.rotors[0], group.channels, list(solved.planes), runs)
        covariance = stored.covariance
        if covariance is not None:
            # in any direction alike
            each = np.sqrt(np.einsum("spp->sp", covariance).real / 2)
            deviations = each, each
    weights = group.own_weights(0)
    permissible, unbalance = None, None
    if request.tolerance is not None:
        of_one = b.in_kg_m(np.ones(1, dtype=complex))
        permissible = (request.tolerance.shares(len(solved.planes)) / of_one).tolist()
        readings = np.eye(len(group.channels))
        unbalance = np.stack([initial_unbalance(solved.alpha[0], one, weights) for one in readings])
    return machine_sheet(
        np.asarray(solved.alpha[0]),
        np.asarray(group.fit.initial[0]),
        [str(channel) for channel in group.channels],
        solved.planes,
        weights=None if weights is None else np.asarray(weights),
        ridge=request.ridge,
        errors=request.reading_error,
        covariance=covariance,
        runout=b.runout(group)[0],
        against=bool(b.against(group)[0]),
        amplitude_unit=runs.amplitude_unit,
        mass=(runs.per, runs.mass_unit),
        channels=[(channel.sensor, channel.speed_written) for channel in group.channels],
        speed_unit=runs.speed_unit,
        spread=deviations,
        limits=[b.max_mass.get(plane, b.max_mass.get("")) for plane in solved.planes] if b.max_mass else (),
        ceiling=b.ceiling,
        permissible=permissible,
        unbalance=unbalance,
        facts=[("Convention", sense(b)), *([("Objective", LEAST_SQUARES)] if b.limited else [])],
        places=None
        if request.places is None
        else [(str(k), float(np.radians(x))) for k, x in enumerate(request.places, 1)],
    )
