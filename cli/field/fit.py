"""What is asked of a fit of all runs beside the corrections: a prediction, the next run, a robust fit, doubt."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np

from balancing import (
    Drift,
    JointFit,
    LogBalance,
    NextRun,
    drift,
    least_squares,
    repeats,
    robust_fit,
    suggest_run,
)
from balancing.doubt import LEVEL
from cli.field.runs import SHOWN, Channel, Complex, Group, Real
from cli.field.solve import FieldBalancing, Solved
from cli.read.options import bad
from cli.read.units import degrees


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


def rows(group: Group, i: int) -> Iterator[Row]:
    """Yield the readings of a rotor."""
    fit, log = group.fit, group.logs[i]
    assert fit is not None
    for j, s in np.argwhere(fit.present[i]).tolist():
        each = (fit.readings, fit.residuals, fit.standardized, group.chance)
        yield Row(log.rows[j][0], group.channels[s], *(of[i, j, s].item() for of in each))


def check(found: FieldBalancing) -> None:
    """Refuse a prediction for planes that there are not, and a next run without limits."""
    for solved in found.solved:
        run_to_predict(found, solved.planes)
    if found.request.suggest and not found.max_mass:
        raise bad("--suggest", "needs --max-mass, the largest mass of the next run")


def run_to_predict(found: FieldBalancing, planes: list[str]) -> Complex:
    """Return the masses of the run to be predicted, (p,)."""
    given = dict(found.predict or {})
    if "" in given and len(planes) == 1 and planes[0] not in given:
        given[planes[0]] = given.pop("")
    for name in given:
        if name not in planes:
            said = f"no plane {name}" if name else "several planes"
            raise bad("--predict", f"{said}: expected PLANE=MASS@ANGLE with one of {', '.join(planes)}")
    return np.array([given.get(plane, 0) for plane in planes], dtype=complex)


def predicted(found: FieldBalancing, solved: Solved) -> tuple[Complex, Real]:
    """What every channel should read in the run to be predicted, and one standard deviation, (g, s) each."""
    assert solved.balance is not None
    on = np.broadcast_to(run_to_predict(found, solved.planes), solved.corrections.shape)
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


def robust(found: FieldBalancing, solved: Solved) -> tuple[JointFit, Complex]:
    """The robust fits of a group, and their corrections by least squares, (g, p), from where the others start."""
    assert solved.balance is not None
    assert solved.group.fit is not None
    fit, before, readings = solved.balance.fit, solved.group.before, solved.group.fit.readings
    if before is None:
        fit = robust_fit(fit)
    else:
        # where the runs leave nothing over, the readings scatter as those of the sisters did
        known = 0.0 if before.reading is None else before.reading[0]
        deviation = np.where(fit.degrees_of_freedom > 0, np.nan, known)[:, None, None]
        if (error := found.request.reading_error) is not None:
            deviation = float(np.hypot(*error)) * np.abs(np.where(fit.present, readings, 0.0))
        fit = robust_fit(fit, before.prior, deviation)
    here = fit.initial + np.matvec(fit.influence, solved.standing)
    ridge = found.request.ridge
    return fit, least_squares(fit.influence, here, solved.group.weights, ridge=ridge).corrections


def drifts(group: Group) -> Drift | None:
    """How the vibration of each rotor changes in a year, and how often so much by chance; None without dates."""
    assert group.fit is not None
    if not group.logs or group.logs[0].years is None:
        return None
    return drift(group.fit, np.array([log.years for log in group.logs]))


def remarks(found: FieldBalancing) -> Iterator[str]:
    """What is to be said of the fits."""
    unit = found.runs.amplitude_unit
    for solved in found.solved:
        group, fit = solved.group, solved.group.fit
        if fit is None or solved.balance is None:
            continue
        bare = np.flatnonzero(fit.degrees_of_freedom == 0)
        known = group.before is not None and group.before.reading is not None
        if len(bare) and found.request.reading_error is None and not known:
            yield (
                f"{found.of(group, int(bare[0]))}as many readings as unknowns: nothing is left over to show their scatter; expected "
                "a further run, or --reading-error, for uncertainties"
            )
        with_outliers = np.flatnonzero((group.chance < LEVEL).any(axis=(1, 2))).tolist()
        outliers = ((i, row) for i in with_outliers for row in rows(group, i) if row.outlier)
        for i, one in islice(outliers, SHOWN):
            yield (
                f"{found.of(group, i)}run {one.run}, sensor {one.channel}: the reading lies {abs(one.residual):.4g} {unit} from the "
                f"fitted one (standardised {one.standardized:.3g}; by chance in {one.chance:.2g} of logs): an outlier; it "
                f"takes part, --exclude {one.run} leaves the run out"
            )
        if next(outliers, None) is not None:
            yield "… and further outliers: they are marked in --json"
        for i in range(min(len(group.logs), SHOWN)):
            yield from _repeats(found, solved, i)
        yield from _drifts(found, group)
        if found.request.reading_error is not None:
            yield from _more_scatter(found, solved)


def _repeats(found: FieldBalancing, solved: Solved, i: int) -> Iterator[str]:
    """Repeats with the same masses that contradict each other: by the test, or by 30 % of the vibration."""
    assert solved.balance is not None
    group, one = solved.group, solved.balance.machine(i)
    fit = one.fit
    largest = np.abs(np.where(fit.present, fit.readings, 0.0)).max(axis=0)
    said = 0
    for pair in repeats(fit, one.errors):
        far = pair.difference > 0.3 * largest[pair.channel]
        if (pair.probability < LEVEL or far) and said < SHOWN:
            said += 1
            runs = [group.logs[i].rows[j][0] for j in pair.runs]
            where = f"runs {runs[0]} and {runs[1]}" if runs[0] != runs[1] else f"run {runs[0]}"
            figures = [
                f"{abs(fit.readings[j, pair.channel]):.4g} at {degrees(fit.readings[j, pair.channel]):.4g}°"
                for j in pair.runs
            ]
            yield (
                f"{found.of(group, i)}{where}, sensor {group.channels[pair.channel]}: with the same masses on it was read {figures[0]} "
                f"and {figures[1]}: the readings contradict each other by {pair.difference:.4g} {found.runs.amplitude_unit}"
            )


def _drifts(found: FieldBalancing, group: Group) -> Iterator[str]:
    """Say where the vibration without masses drifts with time."""
    of_time = drifts(group)
    if of_time is None:
        return
    for i in np.flatnonzero(of_time.probability < LEVEL)[:SHOWN].tolist():
        told = [
            f"sensor {channel} by {abs(rate):.4g} {found.runs.amplitude_unit} at {degrees(rate):.4g}°"
            for channel, rate in zip(group.channels, of_time.rate[i].tolist(), strict=True)
            if rate == rate
        ]
        yield (
            f"{found.of(group, i)}the vibration drifts with time, in a year {', '.join(told)}: by chance in "
            f"{of_time.probability[i]:.2g} of logs (F test at {LEVEL:.0%}); all runs count alike, --exclude leaves out those of "
            "another time"
        )


def _more_scatter(found: FieldBalancing, solved: Solved) -> Iterator[str]:
    """Say where the residuals are larger than the errors stated, by χ²."""
    from scipy.special import gammaincc

    assert solved.balance is not None
    fit, errors = solved.balance.fit, solved.balance.errors
    square = np.where(fit.present, np.square(errors.along) + np.square(errors.across), 0.0)
    mean = square.sum(axis=(1, 2)) / fit.present.sum(axis=(1, 2))
    nu = fit.degrees_of_freedom
    ratio = fit.sum_of_squares / np.where(mean > 0, mean, np.inf)
    wide = np.flatnonzero((nu > 0) & (gammaincc(np.maximum(nu, 1), ratio) < LEVEL))
    for i in wide[:SHOWN].tolist():
        yield (
            f"{found.of(solved.group, i)}the residuals scatter by {fit.residual_sd[i]:.4g} {found.runs.amplitude_unit} (standard "
            f"deviation), more than --reading-error says ({np.sqrt(mean[i]):.4g}): uncertainties are too small"
        )
