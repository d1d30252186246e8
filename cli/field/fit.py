"""What is asked of a fit of all runs beside the corrections: a prediction, the next run, a robust fit, doubt."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from balancing import (
    Drift,
    JointFit,
    LogBalance,
    NextRun,
    drift,
    least_squares,
    outlier_probability,
    repeats,
    robust_fit,
    suggest_run,
)
from balancing.doubt import LEVEL
from cli.field.runs import Channel, Complex, Group, Real, Runs
from cli.field.solve import SHOWN, FieldBalancing, Solved
from cli.read import options
from cli.read.units import degrees, parse_number, parse_quantity, phasor, to_si


@dataclass(frozen=True)
class Asked:
    """What the options ask of the fit."""

    predict: dict[str, complex] | None = None
    """Plane -> mass, SI; the key "" is the only plane."""
    suggest: bool = False
    robust: bool = False


def masses_at(text: str | None, runs: Runs) -> dict[str, complex] | None:
    """Read `10kg@-90deg`, or `A=10kg@-90deg,B=5kg@20deg`; a bare angle is in degrees."""
    if text is None:
        return None
    out: dict[str, complex] = {}
    for part in text.split(","):
        plane, _, value = part.strip().rpartition("=")
        size, mark, turn = value.partition("@")
        try:
            if not mark:
                raise ValueError(f"'{part}': expected MASS@ANGLE, such as 10kg@-90deg")
            number, unit = parse_quantity(size, runs.per)
            if number < 0:
                raise ValueError(f"'{part}': expected a mass that is not negative")
            try:
                angle, of_angle = parse_number(turn), "deg"
            except ValueError:
                angle, of_angle = parse_quantity(turn.replace("°", "deg"), "angle")
        except ValueError as error:
            raise options.bad("--predict", error) from None
        if plane.strip() in out:
            raise options.bad("--predict", f"'{part}': this plane is given twice")
        on = np.array([float(to_si(number, runs.per, unit))])
        out[plane.strip()] = complex(phasor(on, np.array([angle]), of_angle)[0])
    return out


class LogFits:
    """The fits of a log, group by group, and what is asked of them."""

    def __init__(self, found: FieldBalancing, asked: Asked) -> None:
        self.found, self.asked = found, asked
        for solved in found.solved:
            if asked.predict is not None:
                self.masses(solved.planes)
        if asked.suggest and not found.request.max_mass:
            raise options.bad("--suggest", "needs --max-mass, the largest mass of the next run")

    def masses(self, planes: list[str]) -> Complex:
        """Return the masses to predict for, (p,)."""
        given = dict(self.asked.predict or {})
        if "" in given and len(planes) == 1 and planes[0] not in given:
            given[planes[0]] = given.pop("")
        for name in given:
            if name not in planes:
                said = f"no plane {name}" if name else "several planes"
                raise options.bad(
                    "--predict", f"{said}: expected PLANE=MASS@ANGLE with one of {', '.join(planes)}"
                )
        return np.array([given.get(plane, 0) for plane in planes], dtype=complex)

    def predicted(self, solved: Solved) -> tuple[Complex, Real]:
        """What every channel should read with these masses on, and one standard deviation, (g, s) each."""
        assert solved.balance is not None
        on = np.broadcast_to(self.masses(solved.planes), solved.corrections.shape)
        value = solved.balance.fit.fitted(on[:, None])[:, 0]
        return value, solved.balance.vibration_deviation(on, reading=True)

    def suggested(self, solved: Solved, i: int) -> NextRun | None:
        """The next run of a rotor; None where nothing tells how sure its corrections are."""
        assert solved.balance is not None
        limit = self.found.limits(solved.planes)
        if limit is None or not np.isfinite(limit).all():
            raise options.bad("--suggest", f"needs a --max-mass for every plane: {', '.join(solved.planes)}")
        one = solved.balance.machine(i)
        if not np.isfinite(one.covariance).all():
            return None
        free = least_squares(one.fit.influence, one.fit.initial, one.weights).corrections
        return suggest_run(LogBalance(one.fit, free, one.errors, one.weights), limit)

    def robust(self, solved: Solved) -> tuple[JointFit, Complex]:
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
            if (error := self.found.request.reading_error) is not None:
                deviation = float(np.hypot(*error)) * np.abs(np.where(fit.present, readings, 0.0))
            fit = robust_fit(fit, before.prior, deviation)
        here = fit.initial + np.matvec(fit.influence, solved.standing)
        return fit, least_squares(
            fit.influence, here, solved.group.weights, ridge=self.found.request.ridge
        ).corrections


def drifts(group: Group) -> Drift | None:
    """How the vibration of each rotor changes in a year, and how often so much by chance; None without dates."""
    assert group.fit is not None
    if not group.logs or group.logs[0].years is None:
        return None
    return drift(group.fit, np.array([log.years for log in group.logs]))


def outliers(group: Group) -> Real:
    """By chance how often, (g, r, s)."""
    assert group.fit is not None
    return outlier_probability(group.fit)


@dataclass(frozen=True)
class Doubtful:
    """A reading that does not go with the others."""

    rotor: int
    """Its place in the group."""
    run: str
    channel: Channel
    apart: float
    standardized: float
    probability: float


def doubtful(group: Group) -> Iterator[Doubtful]:
    """Yield the outliers of a group."""
    assert group.fit is not None
    chance = outliers(group)
    for i, j, s in np.argwhere(chance < LEVEL).tolist():
        yield Doubtful(
            i,
            group.logs[i].rows[j][0],
            group.channels[s],
            float(abs(group.fit.residuals[i, j, s])),
            float(group.fit.standardized[i, j, s]),
            float(chance[i, j, s]),
        )


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
        for k, one in enumerate(doubtful(group)):
            if k == SHOWN:
                yield "… and further outliers: they are marked in --json"
                break
            yield (
                f"{found.of(group, one.rotor)}run {one.run}, sensor {one.channel}: the reading lies {one.apart:.4g} {unit} from the "
                f"fitted one (standardised {one.standardized:.3g}; by chance in {one.probability:.2g} of logs): an outlier; it "
                f"takes part, --exclude {one.run} leaves the run out"
            )
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


def polar(value: complex) -> dict[str, float | None]:
    """Return amplitude and phase as the JSON has them."""
    return {"amplitude": abs(value), "phase_deg": float(degrees(complex(value)))}


@dataclass(frozen=True)
class Row:
    """A reading, fitted."""

    run: str
    channel: Channel
    value: complex
    residual: complex
    standardized: float
    outlier: bool


class Fitted:
    """The readings of a group's rotors beside their fit."""

    def __init__(self, group: Group) -> None:
        assert group.fit is not None
        self.group, self.fit = group, group.fit

    @cached_property
    def chance(self) -> Real:
        """By chance how often a residual is as large, (g, r, s)."""
        return outliers(self.group)

    def rows(self, i: int) -> Iterator[Row]:
        """Yield the readings of a rotor."""
        fit = self.fit
        for j, s in np.argwhere(fit.present[i]).tolist():
            yield Row(
                self.group.logs[i].rows[j][0],
                self.group.channels[s],
                complex(fit.readings[i, j, s]),
                complex(fit.residuals[i, j, s]),
                float(fit.standardized[i, j, s]),
                bool(self.chance[i, j, s] < LEVEL),
            )
