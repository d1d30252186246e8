"""Warnings about a balancing in the field."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

import balancing
from balancing import plane_significance, trial_effect
from balancing.doubt import LEVEL
from cli.field.field_balancing import FieldBalancing
from cli.field.runs import SHOWN, Group
from cli.field.solution import Solved
from dalembert.angles import degrees

NEARLY = 0.1  # a plane whose effect others bring about but for this share counts as nearly dependent


def warnings(balancing: FieldBalancing) -> list[str]:
    """What was done otherwise than a reader might think, each once."""
    sentences = (sentence for solved in balancing.solved for sentence in _remarks(balancing, solved))
    fits = _fits(balancing) if balancing.runs.fitted else ()
    return [*dict.fromkeys([*balancing.runs.warnings, *balancing.warnings, *sentences]), *fits]


def _remarks(found: FieldBalancing, solved: Solved) -> Iterator[str]:
    group, planes = solved.group, solved.planes
    still = np.flatnonzero(~np.abs(solved.initial).any(axis=1))
    for i in still[:SHOWN]:
        yield (f"{found.of(group, int(i))}no vibration in the initial run: nothing to correct")
    yield from _more(len(still), "no vibration in the initial run")
    doubtful = np.flatnonzero(~(solved.condition < 5)) if len(planes) > 1 else np.zeros(0, dtype=int)
    if len(doubtful):
        weights = None if group.weights is None else group.weights[doubtful]
        share = plane_significance(solved.alpha[doubtful], weights)
        weak = share < NEARLY
        rows = np.flatnonzero(weak.any(axis=1))
        for k in rows[:SHOWN]:
            named = [f"{planes[p]} ({share[k, p]:.2g})" for p in np.flatnonzero(weak[k])]
            i = int(doubtful[k])
            yield (
                f"{found.of(group, i)}planes nearly dependent: others bring about what these do but for the share in "
                f"brackets: {', '.join(named)}; condition number {solved.condition[i]:.3g}, errors grow by as much: leave "
                "one out, or damp with --ridge"
            )
        yield from _more(len(rows), "planes nearly dependent")
    if not found.request.four_run:
        yield from _thirty(found, group)
    for i, (fit, *_) in enumerate(solved.fits):
        for s, (first, rival) in enumerate(zip(group.initial[i], fit.other, strict=True)):
            if rival == rival:
                other = -first / rival
                yield (
                    f"{found.of(group, i)}sensor {group.channels[s]}: two corrections fit the amplitudes; the other one is "
                    f"{found.amount(abs(other)):.6g} {found.unit} at {float(degrees(other)):.2f}°: a further trial run at "
                    "another angle decides"
                )
    if found.request.tolerance is not None and solved.unbalance is not None:
        unknown = np.isnan(solved.unbalance)
        lost = np.flatnonzero(unknown.any(axis=1))
        for i in lost[:SHOWN]:
            uncertain = [planes[p] for p in np.flatnonzero(unknown[i])]
            yield (
                f"{found.of(group, int(i))}the initial unbalance is not determined in plane{'s' * (len(uncertain) > 1)} "
                f"{' and '.join(uncertain)}: {_why(group, planes, uncertain)}; whether it is within the tolerance is not known"
            )
        yield from _more(len(lost), "the initial unbalance is not determined in every plane")
        # from here on means with the trial masses that were left on the rotor
        size = found.in_kg_m(solved.unbalance + solved.start)
        good = np.flatnonzero((size <= found.request.tolerance.shares(len(planes))).all(axis=1))
        for i in good[:SHOWN]:
            yield (
                f"{found.of(group, int(i))}already within the permissible residual unbalance in every plane: stop, no "
                "correction is needed"
            )
        yield from _more(len(good), "already within the permissible residual unbalance")
    if found.ceiling is not None:
        fine = (np.abs(solved.initial) <= found.ceiling).all(axis=1)
        for i in np.flatnonzero(fine)[:SHOWN]:
            yield (f"{found.of(group, int(i))}the initial vibration is within --max-residual already")
        yield from _more(int(fine.sum()), "initial vibration within --max-residual already")
    for w in solved.corrections[:SHOWN].ravel():
        if found.request.places is not None and w != 0:
            missed = balancing.place(complex(w), np.radians(found.request.places)).error
            if abs(missed) > 1e-9 * abs(w):
                yield f"a correction at {degrees(w):.4g}° cannot be reached from the places given"


def _thirty(balancing: FieldBalancing, group: Group) -> Iterator[str]:
    """The 30/30 rule."""
    standing = group.initial
    for j, trial in enumerate(group.trials):
        before, standing = standing, group.means[:, j] if trial.kept else standing
        if not trial.tried:
            continue
        effect = trial_effect(before, group.means[:, j])
        little = ~((effect.amplitude >= 0.3) | (effect.phase >= np.radians(30))).any(axis=1)
        for i in np.flatnonzero(little)[:SHOWN]:
            most = np.max(effect.amplitude[i])
            turn = np.degrees(np.max(effect.phase[i]))
            yield (
                f"{balancing.of(group, int(i))}run {trial.run}: the trial mass changed the vibration by {most:.0%} and {turn:.0f}° "
                "at most: less than 30 % and 30°, its coefficients may be noise; expected a larger trial mass"
            )
        yield from _more(
            int(little.sum()), f"run {trial.run} changed the vibration by less than 30 % and 30°"
        )


def _more(count: int, what: str) -> Iterator[str]:
    if count > SHOWN:
        yield f"… and the same of {count - SHOWN} further rotors: {what}"


def _why(group: Group, planes: list[str], doubtful: list[str]) -> str:
    """Why the readings do not determine the unbalance in the planes `doubtful`."""
    if len(group.channels) < len(planes):
        return f"{len(group.channels)} readings for {len(planes)} planes"
    return "no reading responds to it" if len(doubtful) == 1 else "the readings cannot tell them apart"


def _fits(b: FieldBalancing) -> Iterator[str]:
    """What is to be said of the fits."""
    from cli.field.fits import rows

    unit = b.runs.amplitude_unit
    for solved in b.solved:
        group, fit = solved.group, solved.group.fit
        if fit is None or solved.balance is None:
            continue
        bare = np.flatnonzero(fit.degrees_of_freedom == 0)
        uncertain = group.before is not None and group.before.reading is not None
        if len(bare) and b.request.reading_error is None and not uncertain:
            yield (
                f"{b.of(group, int(bare[0]))}as many readings as unknowns: no readings remain to show their scatter; expected "
                "a further run, or --reading-error, for uncertainties"
            )
        with_outliers = np.flatnonzero((group.chance < LEVEL).any(axis=(1, 2))).tolist()
        outliers = ((i, row) for i in with_outliers for row in rows(group, i) if row.outlier)
        for i, one in islice(outliers, SHOWN):
            yield (
                f"{b.of(group, i)}run {one.run}, sensor {one.channel}: the reading lies {abs(one.residual):.4g} {unit} from the "
                f"fitted one (standardised {one.standardized:.3g}; by chance in {one.chance:.2g} of logs): an outlier; it "
                f"takes part, --exclude {one.run} leaves the run out"
            )
        if next(outliers, None) is not None:
            yield "… and further outliers: they are marked in --json"
        for i in range(min(len(group.logs), SHOWN)):
            yield from _repeats(b, solved, i)
        yield from _drifts(b, group)
        if b.request.reading_error is not None:
            yield from _more_scatter(b, solved)


def _repeats(b: FieldBalancing, solved: Solved, i: int) -> Iterator[str]:
    """Repeats with the same masses that contradict each other: by the test, or by 30 % of the vibration."""
    from balancing import repeats

    assert solved.balance is not None
    group, one = solved.group, solved.balance.machine(i)
    fit = one.fit
    largest = np.abs(np.where(fit.present, fit.readings, 0.0)).max(axis=0)
    count = 0
    for pair in repeats(fit, one.errors):
        far = pair.difference > 0.3 * largest[pair.channel]
        if (pair.probability < LEVEL or far) and count < SHOWN:
            count += 1
            runs = [group.logs[i].rows[j][0] for j in pair.runs]
            where = f"runs {runs[0]} and {runs[1]}" if runs[0] != runs[1] else f"run {runs[0]}"
            figures = [
                f"{abs(fit.readings[j, pair.channel]):.4g} at {degrees(fit.readings[j, pair.channel]):.4g}°"
                for j in pair.runs
            ]
            yield (
                f"{b.of(group, i)}{where}, sensor {group.channels[pair.channel]}: with the same masses on it was read {figures[0]} "
                f"and {figures[1]}: the readings contradict each other by {pair.difference:.4g} {b.runs.amplitude_unit}"
            )


def _drifts(b: FieldBalancing, group: Group) -> Iterator[str]:
    """Say where the vibration without masses drifts with time."""
    from cli.field.fits import drifts

    of_time = drifts(group)
    if of_time is None:
        return
    for i in np.flatnonzero(of_time.probability < LEVEL)[:SHOWN].tolist():
        drifting = [
            f"sensor {channel} by {abs(rate):.4g} {b.runs.amplitude_unit} at {degrees(rate):.4g}°"
            for channel, rate in zip(group.channels, of_time.rate[i].tolist(), strict=True)
            if rate == rate
        ]
        yield (
            f"{b.of(group, i)}the vibration drifts with time, in a year {', '.join(drifting)}: by chance in "
            f"{of_time.probability[i]:.2g} of logs (F test at {LEVEL:.0%}); all runs count alike, --exclude leaves out those of "
            "another time"
        )


def _more_scatter(b: FieldBalancing, solved: Solved) -> Iterator[str]:
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
            f"{b.of(solved.group, i)}the residuals scatter by {fit.residual_sd[i]:.4g} {b.runs.amplitude_unit} (standard "
            f"deviation), more than --reading-error says ({np.sqrt(mean[i]):.4g}): uncertainties are too small"
        )
