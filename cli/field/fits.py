"""What a fit of all runs gives in addition to the corrections: its residuals, a prediction, the next run, a robust fit, drift."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from balancing import (
    Drift,
    JointFit,
    LogBalance,
    NextRun,
    drift,
    least_squares,
    robust_fit,
    suggest_run,
)
from balancing.doubt import LEVEL
from cli.field.field_balancing import FieldBalancing
from cli.field.runs import Before, Channel, Complex, Group, Real
from cli.field.solution import Solved
from cli.field.tables import (
    READINGS,
    Rows,
    Tables,
    amplitude,
    channels,
    masses,
    masses_text,
    of_channels,
    of_planes,
)
from cli.read.options import bad
from dalembert.angles import degrees
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.results.text import printed


class Row(NamedTuple):
    """A reading, fitted."""

    run: str
    channel: Channel
    value: complex
    residual: complex
    standardized: float
    chance: float
    """How often by chance a residual is as large."""

    @property
    def outlier(self) -> bool:
        """Whether it does not go with the others."""
        return self.chance < LEVEL


def fit_of(group: Group) -> JointFit:
    """Return the fit of a group's runs."""
    assert group.fit is not None
    return group.fit


def rows(group: Group, i: int) -> Iterator[Row]:
    """Yield the readings of a rotor."""
    fit, log = group.fit, group.logs[i]
    assert fit is not None
    for j, s in np.argwhere(fit.present[i]).tolist():
        each = (fit.readings, fit.residuals, fit.standardized, group.chance)
        yield Row(log.rows[j][0], group.channels[s], *(of[i, j, s].item() for of in each))


def check(b: FieldBalancing) -> None:
    """Refuse a prediction for planes that there are not, and a next run without limits."""
    for solved in b.solved:
        run_to_predict(b, solved.planes)
    if b.request.suggest and not b.max_mass:
        raise bad("--suggest", "needs --max-mass, the largest mass of the next run")


def run_to_predict(b: FieldBalancing, planes: list[str]) -> Complex:
    """Return the masses of the run to be predicted, (p,)."""
    masses = dict(b.predict or {})
    if "" in masses and len(planes) == 1 and planes[0] not in masses:
        masses[planes[0]] = masses.pop("")
    for name in masses:
        if name not in planes:
            wrong = f"no plane {name}" if name else "several planes"
            raise bad("--predict", f"{wrong}: expected PLANE=MASS@ANGLE with one of {', '.join(planes)}")
    return np.array([masses.get(plane, 0) for plane in planes], dtype=complex)


def predicted(b: FieldBalancing, solved: Solved) -> tuple[Complex, Real]:
    """What every channel should read in the run to be predicted, and one standard deviation, (g, s) each."""
    assert solved.balance is not None
    on = np.broadcast_to(run_to_predict(b, solved.planes), solved.corrections.shape)
    value = solved.balance.fit.fitted(on[:, None])[:, 0]
    return value, solved.balance.vibration_deviation(on, reading=True)


def suggested(solved: Solved, i: int) -> NextRun | None:
    """The next run of a rotor; None where nothing tells how sure its corrections are."""
    assert solved.balance is not None
    if solved.limit is None or not np.isfinite(solved.limit).all():
        raise bad("--suggest", f"needs a --max-mass for every plane: {', '.join(solved.planes)}")
    one = solved.balance.machine(i)
    if not np.isfinite(one.covariance).all():
        return None
    free = least_squares(one.fit.influence, one.fit.initial, one.weights).corrections
    return suggest_run(LogBalance(one.fit, free, one.errors, one.weights), solved.limit)


def robust(b: FieldBalancing, solved: Solved) -> tuple[JointFit, Complex]:
    """The robust fits of a group, and their corrections by least squares, (g, p), from where the others start."""
    assert solved.balance is not None
    assert solved.group.fit is not None
    fit, before, readings = solved.balance.fit, solved.group.before, solved.group.fit.readings
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
    ridge = b.request.ridge
    return fit, least_squares(fit.influence, here, solved.group.weights, ridge=ridge).corrections


def drifts(group: Group) -> Drift | None:
    """How the vibration of each rotor changes in a year, and how often so much by chance; None without dates."""
    assert group.fit is not None
    if not group.logs or group.logs[0].years is None:
        return None
    return drift(group.fit, np.array([log.years for log in group.logs]))


def tables(b: FieldBalancing) -> Tables:
    """The tables of a fit."""
    made: Tables = {
        "residuals": lambda: residuals(b),
        "fit": lambda: of_fit(b),
        "fit_initial": lambda: initial(b),
    }
    if any(drifts(solved.group) is not None for solved in b.solved):
        made["drift"] = lambda: drift_rates(b)
    if b.predict is not None:
        made["predict"] = lambda: predicted_run(b)
    if b.request.suggest:
        made |= {"suggest": lambda: suggested_run(b), "suggest_gain": lambda: suggested_gain(b)}
    if b.request.robust:
        both = cache(lambda: robust_tables(b))
        made |= {"robust": lambda: both()[0], "robust_initial": lambda: both()[1]}
    return made


def residuals(b: FieldBalancing) -> Table:
    """One row per reading of a fit: what was read, and how far it lies from the fitted vibration."""
    each = [
        (rotor, row)
        for solved in b.solved
        for i, rotor in enumerate(solved.group.rotors.tolist())
        for row in rows(solved.group, i)
    ]
    of = [row for _, row in each]
    read, left = (np.array([getattr(row, name) for row in of]) for name in ("value", "residual"))
    columns, hidden = channels(b, [row.channel for row in of])
    sensor = columns[0]
    states = [column for column in columns if column.name == "state" and any(column.values)]
    hidden += [column for column in columns[1:] if column not in states]
    outlier = [row.outlier for row in of]
    columns = [
        names("rotor", [b.runs.rotors[r] for r, _ in each]),
        names("run", [row.run for row in of]),
        sensor,
        *(Column("state", "", [v or "" for v in s.values], None, "state", s.stored) for s in states),
        amplitude(b, "amplitude", np.abs(read), None),
        number("phase", "angle", degrees(read), place=None),
        amplitude(b, "residual", np.abs(left), "amplitude"),
        number("residual_phase", "angle", degrees(left), place="phase"),
        Column("standardized", "", [row.standardized for row in of], None, "standardized"),
        Column("outlier", "", ["yes" if one else "" for one in outlier], None, "outlier", outlier),
    ]
    return Table(columns, ("rotor", "run", "sensor"), "rotors[].fit.residuals[]", documented=hidden)


def of_fit(b: FieldBalancing) -> Table:
    """One row per rotor: how many runs and readings were fitted, how well, and what the runs say of drift and phase."""
    lines = Rows(b)
    rotors = [(solved, i) for _, solved, i in b.each()]
    freedom = lines.numbers(lambda s: fit_of(s.group).degrees_of_freedom)
    senses = [s.group.logs[i].sense for s, i in rotors]
    columns = [
        *lines.shown,
        names("runs", [len(s.group.logs[i].runs) for s, i in rotors]),
        names("readings", [int(fit_of(s.group).present[i].sum()) for s, i in rotors]),
        names("degrees_of_freedom", [int(n) for n in freedom]),
        amplitude(b, "residual_sd", lines.numbers(lambda s: fit_of(s.group).residual_sd)),
        Column(
            "phase_sense", "", [sense or "not determined" for sense in senses], None, "phase_sense", senses
        ),
    ]
    priors = [s.group.before for s, _ in rotors]

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
    drifting = {id(s): drifts(s.group) for s in b.solved}
    hidden = list(lines.hidden)
    if any(of is not None for of in drifting.values()):
        chance, stored = lines.some(lambda s: of.probability if (of := drifting[id(s)]) is not None else None)
        verdict = [v if v is ABSENT else None if v != v else v < LEVEL for v in stored]
        columns.append(Column("drift_probability", "", chance, None, "drift.probability", stored))
        words = ["yes" if v is True else "no" if v is False else "" for v in verdict]
        columns.append(Column("drifts", "", words, None, "drift.drifts", verdict))
        hidden.append(
            Column(
                "level",
                "",
                [None] * len(stored),
                None,
                "drift.level",
                [v if v is ABSENT else LEVEL for v in stored],
            )
        )
        below.append(f"drift_probability: by chance in so many logs (F test at {LEVEL:.0%})")
    return Table(columns, ("rotor",), "rotors[].fit", below="\n".join(below), documented=hidden)


def initial(b: FieldBalancing) -> Table:
    """The vibration without masses as fitted, and its uncertainty."""
    lines, shown, hidden = of_channels(b)
    value = lines.numbers(lambda s: fit_of(s.group).initial)
    deviation = lines.numbers(lambda s: s.fitted.vibration_deviation(np.zeros_like(s.total)))
    columns = [*shown, *vibration(b, value), amplitude(b, "amplitude_uncertainty", deviation)]
    above = "vibration without masses, as fitted"
    return Table(columns, READINGS, "rotors[].fit.initial[]", above, documented=hidden)


def drift_rates(b: FieldBalancing) -> Table:
    """How the vibration without masses changes in a year: a row for each rotor and sensor."""
    each = [
        (rotor, channel, *rest)
        for rotor, (_, solved, i) in zip(b.runs.rotors, b.each(), strict=True)
        if (of := drifts(solved.group)) is not None
        for channel, *rest in zip(
            solved.group.channels, of.rate[i].tolist(), of.deviation[i].tolist(), strict=True
        )
    ]
    shown, hidden = channels(b, [row[1] for row in each])
    rotor = names("rotor", [row[0] for row in each])
    rate, deviation = np.array([row[2] for row in each]), [row[3] for row in each]
    phase = np.where(np.isfinite(rate), degrees(rate), np.nan)
    columns = [
        *([rotor] if b.runs.several else []),
        *shown,
        amplitude(b, "amplitude_per_year", np.abs(rate)),
        number("phase", "angle", phase),
        amplitude(b, "amplitude_per_year_uncertainty", deviation),
    ]
    hidden += [] if b.runs.several else [rotor]
    return Table(columns, READINGS, "rotors[].fit.drift.rates[]", documented=hidden)


def predicted_run(b: FieldBalancing) -> Table:
    """What the run with the masses of --predict should read: a row for each rotor and sensor."""
    lines, shown, hidden = of_channels(b)
    of = {id(solved): predicted(b, solved) for solved in b.solved}
    value, deviation = (lines.numbers(lambda s, k=k: of[id(s)][k]) for k in (0, 1))  # type: ignore[misc]
    columns = [*shown, *vibration(b, value), amplitude(b, "amplitude_uncertainty", deviation)]
    planes = b.solved[0].planes
    above = f"a run with {masses_text(b, planes, run_to_predict(b, planes)) or 'no masses'} should read"
    return Table(columns, READINGS, "rotors[].predict[]", above, documented=hidden)


def prediction_lines(b: FieldBalancing) -> list[str]:
    """The predicted readings as sentences, for standard error where a pipe takes the corrections."""
    table = predicted_run(b)
    cells = {header: printed(header, values) for header, values in table.cells.items()}
    rows = zip(*cells.values(), strict=True)
    return [f"{table.above}: {', '.join(map(' '.join, zip(cells, row, strict=True)))}" for row in rows]


def _suggestions(b: FieldBalancing) -> Iterator[tuple[str, list[str], NextRun]]:
    """Yield the rotors of which a run is suggested, their planes, and that run."""
    for rotor, (_, solved, i) in zip(b.runs.rotors, b.each(), strict=True):
        run = suggested(solved, i)
        if run is not None:
            yield rotor, solved.planes, run


def unsuggested(b: FieldBalancing) -> Column:
    """Return the column of JSON that is null where no run is suggested."""
    stored = [ABSENT if suggested(solved, i) is not None else None for _, solved, i in b.each()]
    return Column("suggest", "", [None] * len(stored), None, "suggest", stored)


def suggested_run(b: FieldBalancing) -> Table:
    """The masses of the next run that tells most: a row for each rotor and plane."""
    each = [
        (rotor, plane, w)
        for rotor, planes, run in _suggestions(b)
        for plane, w in zip(planes, run.masses.tolist(), strict=True)
    ]
    rotor = [names("rotor", [row[0] for row in each])]
    columns = [
        *(rotor if b.runs.several else []),
        names("plane", [row[1] for row in each]),
        *masses(b, np.array([row[2] for row in each], dtype=complex)),
    ]
    above = (
        "the next run that tells most (A-optimal) has these masses"
        if each
        else "no run is suggested: nothing tells how sure the corrections are"
    )
    hidden = [] if b.runs.several else rotor
    return Table(columns, ("rotor", "plane"), "rotors[].suggest.masses[]", above, documented=hidden)


def suggested_gain(b: FieldBalancing) -> Table:
    """How the next run changes the uncertainty of the corrections."""
    each = list(_suggestions(b))
    per, unit = b.runs.per, b.runs.mass_unit
    rotor = [names("rotor", [rotor for rotor, _, _ in each])]
    columns = [
        *(rotor if b.runs.several else []),
        number("uncertainty_before", per, [run.before for _, _, run in each], unit),
        number("uncertainty_after", per, [run.after for _, _, run in each], unit),
    ]
    above = "uncertainty of the corrections before and after the next run"
    return Table(columns, ("rotor",), "rotors[].suggest", above, documented=[] if b.runs.several else rotor)


def robust_tables(b: FieldBalancing) -> tuple[Table, Table]:
    """The corrections of a robust fit, and the vibration without masses as it fits it."""
    of = {id(solved): robust(b, solved) for solved in b.solved}
    planes, plane = of_planes(b)
    fix = masses(b, planes.numbers(lambda s: of[id(s)][1]))
    keys = ("rotor", "plane")
    above = "corrections of a robust fit (Huber)"
    columns = [*planes.shown, plane, *fix]
    first = Table(columns, keys, "rotors[].robust.corrections[]", above, documented=planes.hidden)
    lines, shown, hidden = of_channels(b)
    columns = [*shown, *vibration(b, lines.numbers(lambda s: of[id(s)][0].initial))]
    above = "vibration without masses of a robust fit"
    return first, Table(columns, READINGS, "rotors[].robust.initial[]", above, documented=hidden)


def vibration(b: FieldBalancing, value: Complex) -> list[Column]:
    """Return amplitude and phase."""
    return [amplitude(b, "amplitude", np.abs(value)), number("phase", "angle", degrees(value))]
