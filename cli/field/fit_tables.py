"""The tables of what was read: vibration before and after, coefficients; the fit of a log, a predicted run, the next run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing import (
    LogBalance,
    NextRun,
    least_squares,
    robust_fit,
    suggest_run,
)
from balancing.doubt import LEVEL
from balancing.log_balance import CoefficientSpread
from balancing.runs.runs import Before, Complex, Real
from cli.field.field_balancing import FieldBalancing, Solved
from cli.field.rotor import Rotor, each
from cli.field.tables import READINGS, Rows, amplitude, masses, masses_text, vibration
from cli.read.options import bad
from dalembert.angles import degrees
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.units import amplitude_kind, from_si, to_si


def predicted(b: FieldBalancing, solved: Solved) -> tuple[Complex, Real]:
    """The predicted readings of every channel, and their standard deviations, (g, s) each."""
    balance = solved.fitted
    on = np.broadcast_to(b.run_to_predict(solved.planes), solved.corrections.shape)
    return balance.fit.fitted(on[:, None])[:, 0], balance.vibration_deviation(on, reading=True)


def suggested(rotor: Rotor) -> NextRun | None:
    """The next run of a rotor; None where the uncertainty of its corrections is not known, or its planes are dependent."""
    limit = rotor.solved.objective.max_mass
    if limit is None or not np.isfinite(limit).all():
        raise bad("--suggest", f"needs a --max-mass for every plane: {', '.join(rotor.planes)}")
    one = rotor.solved.fitted.machine(rotor.i)
    if not (np.isfinite(rotor.solved.condition[rotor.i]) and np.isfinite(one.covariance).all()):
        return None
    free = least_squares(one.fit.influence, one.fit.initial, one.weights).corrections
    return suggest_run(LogBalance(one.fit, free, one.errors, one.weights), limit)


def robust(b: FieldBalancing, solved: Solved) -> tuple[Complex, Complex]:
    """The initial vibration of the robust fits of a group, (g, s), and their corrections by least squares, (g, p)."""
    fit, before, readings = solved.fitted.fit, solved.group.before, solved.group.fit.readings
    if before is None:
        fit = robust_fit(fit)
    else:
        # where the runs leave nothing over, the readings scatter as those of the sisters did
        scatter = 0.0 if before.reading is None else before.reading[0]
        deviation = np.where(fit.degrees_of_freedom > 0, np.nan, scatter)[:, None, None]
        if (error := b.request.reading_error) is not None:
            deviation = float(np.hypot(*error)) * np.abs(np.where(fit.present, readings, 0.0))
        fit = robust_fit(fit, before.prior, deviation)
    here = fit.initial + np.matvec(fit.influence, solved.start)
    with b.named(solved):
        fix = least_squares(fit.influence, here, solved.group.weights, ridge=b.request.ridge)
    return fit.initial, fix.corrections


# -- before and after ----------------------------------------------------------------------------------------

RMS = {"": 1.0, "_rms": 1.0, "_pk": 0.5**0.5, "_pp": 0.5 * 0.5**0.5}
"""The r.m.s. value of a vibration whose amplitude is read in one of these ways is 1."""


def prediction(b: FieldBalancing) -> Table:
    """The vibration before, and as predicted with the corrections: a row for each rotor and sensor."""
    rows = Rows.sensors(b)
    before, after = rows.several(lambda s: (s.initial, s.residual))

    def phase(name: str, values: Complex, place: str | None = None) -> Column:
        # none is shown where nothing moves; JSON has 0
        column = number(name, "angle", np.where(values == 0, np.nan, degrees(values)), place=place)
        column.stored = degrees(values)
        return column

    phases = [
        number("before_phase", "angle", degrees(before), place=None),
        phase("predicted_phase", after, "phase"),
    ]
    sizes = [
        amplitude(b, "before_amplitude", np.abs(before), None),
        amplitude(b, "predicted_amplitude", np.abs(after), "amplitude"),
    ]
    columns, hidden = [column for pair in zip(sizes, phases, strict=True) for column in pair], list[Column]()
    if b.request.four_run:
        columns, hidden = sizes, [Column("phase", "deg", [None] * len(after), None, "phase_deg")]
    if b.runs.fitted:
        deviation = rows.numbers(lambda s: s.fitted.vibration_deviation(s.total))
        spread = [amplitude(b, "amplitude_uncertainty", deviation)]
        ceiling = b.ceiling
        if ceiling is not None:
            chance = rows.numbers(lambda s: s.fitted.probability_within(ceiling))
            spread.append(number("probability_within", "number", chance))
        (columns if np.isfinite(deviation).any() else hidden).extend(spread)
    above = "vibration before, and as predicted with the corrections"
    return rows.table(columns, READINGS, "residual[]", above, hidden=hidden)


def zones(b: FieldBalancing) -> Table:
    """One row per rotor and sensor: the zone of its vibration velocity before, in the last run with corrections, as predicted."""
    from balancing import ZONE_BOUNDARIES, severity_zone

    machine, (_, tag) = b.request.zone_class or "", amplitude_kind(b.runs.amplitude_unit)
    unit = b.runs.amplitude_unit.removesuffix(tag)

    def zone(vibration: Complex) -> list[str | None]:
        size = to_si(np.abs(vibration), "amplitude", unit)
        speed = RMS[tag] * np.asarray(size) / to_si(1.0, "amplitude", "m_s")
        return [str(severity_zone(v, machine)) if v == v else None for v in speed.tolist()]

    def measured(solved: Solved) -> Complex:
        runs = [Rotor(b, solved, i).last for i in range(len(solved.initial))]
        unread = np.full(solved.initial.shape[1], np.nan)
        return np.array([unread if run is None else run.vibration for run in runs])

    rows = Rows.sensors(b)
    before, last, after = map(zone, rows.several(lambda s: (s.initial, measured(s), s.residual)))
    columns = [
        names("before_zone", before),
        *([names("measured_zone", last)] if any(last) else []),
        names("predicted_zone", after),
    ]
    a, bb, c = (f"{1e3 * bound:g}" for bound in ZONE_BOUNDARIES[machine])
    meant = "" if tag else ", taken as r.m.s."
    above = f"zones of ISO 10816-3, {machine}: A to {a}, B to {bb}, C to {c} mm/s r.m.s.; of the once-per-turn vibration{meant}"
    return rows.table(columns, READINGS, "zones[]", above)


def misfit(b: FieldBalancing) -> Table:
    """How far the amplitudes of each sensor are from any vector's, by the four-run method."""
    rows = Rows.each(b, lambda solved: len(solved.group.channels) * len(solved.planes))
    off = rows.numbers(lambda solved: [[fit.misfit for fit in one] for one in solved.group.amplitude_fits])
    plane = names("plane", rows.cells(lambda s: [name for name in s.planes for _ in s.group.channels]))
    columns = [
        names("sensor", rows.cells(lambda s: [c.sensor for c in s.group.channels] * len(s.planes))),
        *([plane] if any(len(solved.planes) > 1 for solved in b.solved) else []),
    ]
    keys = ("rotor", *(column.name for column in columns))
    above = "r.m.s. misfit of the amplitudes"
    return rows.table([*columns, amplitude(b, "amplitude", off)], keys, "misfit[]", above)


def alternatives(b: FieldBalancing) -> Table:
    """The other corrections that fit the amplitudes as well, by the four-run method."""
    of = [
        (rotor.name, rotor.planes[0], -v / a)
        for rotor in each(b)
        for v, a in zip(
            rotor.group.fit.initial[rotor.i], rotor.solved.group.amplitude_fits[rotor.i][0].other, strict=True
        )
        if a == a
    ]
    fix = masses(b, np.array([w for *_, w in of], dtype=complex))
    columns = [names("plane", [plane for _, plane, _ in of]), *fix]
    return Rows.of(b, [name for name, *_ in of]).table(columns, ("rotor", "plane"), "alternatives[]")


def residuals(b: FieldBalancing) -> Table:
    """One row per reading of a fit: what was read, and how far it lies from the fitted vibration."""
    every = [
        (rotor, row)
        for solved in b.solved
        for rotor in (Rotor(b, solved, i) for i in range(len(solved.corrections)))
        for row in rotor.readings()
    ]
    of = [row for _, row in every]
    read, left = np.array([row.value for row in of]), np.array([row.residual for row in of])
    rows = Rows.of(b, [rotor.name for rotor, _ in every])
    rows.shown, rows.hidden = [rows.rotor, names("run", [row.run for row in of])], []
    rows.read(b, [row.channel for row in of])
    # speeds, and empty states, are of the document alone
    unseen = [c for c in rows.shown if c.name == "speed" or (c.name == "state" and not any(c.values))]
    rows.shown = [column for column in rows.shown if column not in unseen]
    rows.hidden += unseen
    for column in rows.shown:
        if column.name == "state":
            column.values = [value or "" for value in column.values]
    outlier = [row.outlier for row in of]
    columns = [
        amplitude(b, "amplitude", np.abs(read), None),
        number("phase", "angle", degrees(read), place=None),
        amplitude(b, "residual", np.abs(left), "amplitude"),
        number("residual_phase", "angle", degrees(left), place="phase"),
        Column("standardized", "", [row.standardized for row in of], None, "standardized"),
        Column("outlier", "", ["yes" if one else "" for one in outlier], None, "outlier", outlier),
    ]
    return rows.table(columns, ("rotor", "run", "sensor"), "fit.residuals[]")


def of_fit(b: FieldBalancing) -> Table:
    """One row per rotor: numbers of runs and readings, scatter, drift, and the sense of the phase."""
    rows, rotors = Rows.each(b), list(each(b))
    senses = [rotor.group.lines.senses[rotor.i] for rotor in rotors]
    named = [sense or "not determined" for sense in senses]
    freedom, sd = rows.several(lambda s: (s.group.fit.degrees_of_freedom, s.group.fit.residual_sd))
    columns = [
        names("runs", [len(rotor.group.lines.runs(rotor.i)) for rotor in rotors]),
        names("readings", [int(rotor.group.fit.present[rotor.i].sum()) for rotor in rotors]),
        names("degrees_of_freedom", [int(n) for n in freedom]),
        amplitude(b, "residual_sd", sd),
        Column("phase_sense", "", named, None, "phase_sense", senses),
    ]
    priors, hidden = [rotor.group.before for rotor in rotors], list[Column]()

    def prior(name: str, unit: str, of: Callable[[Before], float | None]) -> None:
        stored = [ABSENT if before is None else of(before) for before in priors]
        cells = [None if cell is ABSENT else cell for cell in stored]
        columns.append(Column(f"prior_{name}", unit, cells, None, f"prior.{name}", stored))

    if any(before is not None for before in priors):
        prior("machines", "", lambda before: before.machines)
        prior("scatter_between_machines", "", lambda before: before.scatter)
        prior("reading_sd", b.runs.amplitude_unit, lambda before: before.reading and before.reading[0])
    below = ["runs and readings fitted together; residual_sd: standard deviation of one reading as a vector"]
    if None in senses:
        below.append(
            "the sense of the phase cannot be determined: add a run with a mass at an angle off the line of the others"
        )

    def probability(solved: Solved) -> Real | None:
        of = solved.group.drift
        return None if of is None else of.probability

    chance, stored = rows.some(probability)
    if any(v is not ABSENT for v in stored):
        verdict = [v if v is ABSENT else None if v != v else v < LEVEL for v in stored]
        words = ["yes" if v is True else "no" if v is False else "" for v in verdict]
        level = [v if v is ABSENT else LEVEL for v in stored]
        columns.append(Column("drift_probability", "", chance, None, "drift.probability", stored))
        columns.append(Column("drifts", "", words, None, "drift.drifts", verdict))
        hidden.append(Column("level", "", [None] * len(stored), None, "drift.level", level))
        below.append(f"drift_probability: by chance in so many logs (F test at {LEVEL:.0%})")
    return rows.table(columns, ("rotor",), "fit", below="\n".join(below), hidden=hidden)


def initial(b: FieldBalancing) -> Table:
    """The vibration without masses as fitted, and its uncertainty."""
    rows = Rows.sensors(b)
    value = rows.numbers(lambda s: s.group.fit.initial)
    deviation = rows.numbers(lambda s: s.fitted.vibration_deviation(np.zeros_like(s.total)))
    columns = [*vibration(b, value), amplitude(b, "amplitude_uncertainty", deviation)]
    return rows.table(columns, READINGS, "fit.initial[]", "vibration without masses, as fitted")


def drift_rates(b: FieldBalancing) -> Table:
    """How the vibration without masses changes in a year: a row for each rotor and sensor."""
    every = [
        (rotor.name, *row)
        for rotor in each(b)
        if (of := rotor.group.drift) is not None
        for row in zip(rotor.channels, of.rate[rotor.i].tolist(), of.deviation[rotor.i].tolist(), strict=True)
    ]
    rows = Rows.of(b, [name for name, *_ in every]).read(b, [channel for _, channel, *_ in every])
    rate, deviation = np.array([row[2] for row in every]), [row[3] for row in every]
    columns = [
        amplitude(b, "amplitude_per_year", np.abs(rate)),
        number("phase", "angle", np.where(np.isfinite(rate), degrees(rate), np.nan)),
        amplitude(b, "amplitude_per_year_uncertainty", deviation),
    ]
    return rows.table(columns, READINGS, "fit.drift.rates[]")


def predicted_run(b: FieldBalancing) -> Table:
    """Return the predicted readings of a run with the masses that --predict names: a row for each rotor and sensor."""
    rows = Rows.sensors(b)
    value, deviation = rows.several(lambda solved: predicted(b, solved))
    columns = [*vibration(b, value), amplitude(b, "amplitude_uncertainty", deviation)]
    planes = b.solved[0].planes
    above = f"a run with {masses_text(b, planes, b.run_to_predict(planes)) or 'no masses'} should read"
    against = any(b.against(solved.group).any() for solved in b.solved)
    below = (
        "phases in the sense of the mass angles: the instrument shows them with the other sign"
        if against
        else ""
    )
    return rows.table(columns, READINGS, "predict[]", above, below)


def reverse(table: Table) -> None:
    """Count the phases of a report's table as an instrument whose phases were reversed shows them."""
    table.below = ""
    for column in table.columns:
        if column.name == "phase":
            column.values = [v if v is None else round(-float(v) % 360, 2) for v in column.values]


def _suggestions(b: FieldBalancing) -> Iterator[tuple[Rotor, NextRun]]:
    """Yield the rotors of which a run is suggested, and that run."""
    for rotor in each(b):
        run = suggested(rotor)
        if run is not None:
            yield rotor, run


def unsuggested(b: FieldBalancing) -> Column:
    """Return the column of JSON that is null where no run is suggested."""
    stored = [ABSENT if suggested(rotor) is not None else None for rotor in each(b)]
    return Column("suggest", "", [None] * len(stored), None, "suggest", stored)


def suggested_run(b: FieldBalancing) -> Table:
    """The masses of the most informative next run: a row for each rotor and plane."""
    every = [
        (rotor.name, *row)
        for rotor, run in _suggestions(b)
        for row in zip(rotor.planes, run.masses.tolist(), strict=True)
    ]
    on = masses(b, np.array([w for *_, w in every], dtype=complex))
    above = (
        "the most informative next run (A-optimal) has these masses"
        if every
        else "no run is suggested: the uncertainty of the corrections is not known"
    )
    rows = Rows.of(b, [name for name, *_ in every])
    columns = [names("plane", [plane for _, plane, _ in every]), *on]
    return rows.table(columns, ("rotor", "plane"), "suggest.masses[]", above)


def suggested_gain(b: FieldBalancing) -> Table:
    """How the next run changes the uncertainty of the corrections."""
    every = list(_suggestions(b))
    per, unit = b.runs.per, b.runs.mass_unit
    columns = [
        number("uncertainty_before", per, [run.before for _, run in every], unit),
        number("uncertainty_after", per, [run.after for _, run in every], unit),
    ]
    above = "uncertainty of the corrections before and after the next run"
    return Rows.of(b, [rotor.name for rotor, _ in every]).table(columns, ("rotor",), "suggest", above)


RobustFits = Callable[[Solved], tuple[Complex, Complex]]


def robust_corrections(b: FieldBalancing, of: RobustFits) -> Table:
    """The corrections of a robust fit."""
    rows = Rows.planes(b)
    fix, above = rows.numbers(lambda s: of(s)[1]), "corrections of a robust fit (Huber)"
    return rows.table(masses(b, fix), ("rotor", "plane"), "robust.corrections[]", above)


def robust_initial(b: FieldBalancing, of: RobustFits) -> Table:
    """The vibration without masses as a robust fit has it."""
    rows = Rows.sensors(b)
    value, above = rows.numbers(lambda s: of(s)[0]), "vibration without masses of a robust fit"
    return rows.table(vibration(b, value), READINGS, "robust.initial[]", above)


def spread(b: FieldBalancing, solved: Solved) -> CoefficientSpread | None:
    """Return the uncertainty of a group's coefficients, from its fit or from stated errors; None where it is not known."""
    if b.stored is not None or not (b.runs.fitted or b.request.reading_error) or solved.balance is None:
        return None
    return solved.balance.coefficients


def influence(b: FieldBalancing) -> Table:
    """The influence coefficients, as --save-influence stores them."""
    per, unit = b.runs.per, b.runs.mass_unit
    rows = Rows.each(b, lambda solved: len(solved.group.channels) * len(solved.planes))
    channels = rows.cells(lambda s: [c for c in s.group.channels for _ in s.planes])
    alpha = rows.numbers(lambda solved: solved.alpha)
    size = np.abs(alpha)
    states = [channel.state for channel in channels]
    rpm = b.runs.speed_unit == "rpm"
    speeds = [
        None if c.speed is None else c.speed_written if rpm else from_si(c.speed, "speed", "rpm")
        for c in channels
    ]
    stored = [ABSENT if c.state is not None and c.speed is None else c.speed for c in channels]
    in_json = [ABSENT if of is None else of for of in states]
    against = rows.numbers(lambda s: np.broadcast_to(b.against(s.group)[:, None, None], s.alpha.shape))
    lags = ["lag" if of else "lead" for of in against.tolist()] if against.any() else []
    state = Column("state", "", [of or "" for of in states], None, "state", in_json)
    columns = [
        names("sensor", [channel.sensor for channel in channels]),
        *([state] if any(states) else []),
        Column("speed", "rpm", speeds, None, "speed_rad_s", stored),
        names("plane", rows.cells(lambda s: s.planes * len(s.group.channels))),
        Column("magnitude_per", unit, to_si(size, per, unit), None, f"magnitude_per_{b.runs.per_si}", size),
        number("phase", "angle", degrees(alpha)),
        names("amplitude_unit", [b.runs.amplitude_unit] * len(size), place=None),
        *([names("phase_sense", lags, place=None)] if lags else []),
        *_errors(b, rows, size),
    ]
    return rows.table(columns, (), "influence[]", hidden=[] if any(states) else [state])


def _errors(b: FieldBalancing, rows: Rows, size: Real) -> list[Column]:
    """Return the columns of the coefficients' uncertainty; none where it is not known."""
    spreads = {id(solved): spread(b, solved) for solved in b.solved}
    if not any(of is not None for of in spreads.values()):
        return []

    def cells(of: Callable[[CoefficientSpread], ArrayLike]) -> Any:
        def of_group(solved: Solved) -> ArrayLike:
            one = spreads[id(solved)]
            empty = np.full(solved.alpha.shape, None, dtype=object)
            return empty if one is None else np.broadcast_to(np.asarray(of(one)), solved.alpha.shape)

        return rows.numbers(of_group)

    def of_rotor(of: Callable[[CoefficientSpread], Real]) -> Real:
        return np.asarray(cells(lambda one: of(one)[:, None, None]).astype(float))

    along, across = cells(lambda one: one.along).astype(float), cells(lambda one: one.across).astype(float)
    per, unit = b.runs.per, b.runs.mass_unit
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.degrees(across / size)
    columns = [
        Column("magnitude_uncertainty_per", unit, to_si(along, per, unit)),
        Column("phase_uncertainty", "deg", np.where(size > 0, turn, np.nan)),
    ]
    if any(len(solved.planes) > 1 for solved in b.solved):
        columns.append(names("correlation", cells(_correlations).tolist(), place=None))
    freedom = of_rotor(lambda one: one.degrees_of_freedom)
    return [
        *columns,
        Column("reading_sd", b.runs.amplitude_unit, of_rotor(lambda one: one.reading_sd)),
        Column("degrees_of_freedom", "", [_count(x) for x in freedom.tolist()]),
    ]


def _count(x: float) -> float | None:
    """Return a count as a whole number; of an infinite one the cell is empty."""
    return int(x) if x.is_integer() else x if np.isfinite(x) else None


def _correlations(one: CoefficientSpread) -> NDArray[np.object_]:
    """Return for each coefficient the correlations of its error with those of the planes before it, as text."""
    made = np.full(one.along.shape, None, dtype=object)
    if one.along.shape[-1] > 1:
        for at in np.ndindex(*made.shape):
            before = one.correlation[at][: at[-1]].tolist()
            made[at] = ";".join(f"{abs(z)!r}@{float(degrees(z))!r}" for z in before)
    return made
