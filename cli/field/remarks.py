"""The sentences about a balancing in the field: warnings, and how angles and phases are counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from balancing import plane_significance, trial_effect
from balancing.doubt import LEVEL
from balancing.runs.runs import SHOWN
from balancing.weights import ENOUGH
from cli.field.field_balancing import FieldBalancing, Solved
from cli.field.rotor import Rotor
from dalembert.angles import degrees
from dalembert.errors import quote
from dalembert.tables.headers import plain_word

LAGS = {"lag", "lags", "lagging", "nacheilend", "nacheilung"}
"""Words of a header of phases that lag."""
NEARLY = 0.1  # a plane whose effect others bring about but for this share counts as nearly dependent


def warnings(b: FieldBalancing) -> list[str]:
    """Sentences about assumptions and doubts that a reader might not expect, each once."""
    groups = [_Group(b, solved) for solved in b.solved]
    sentences = (sentence for group in groups for sentence in group.warnings())
    fits = (sentence for group in groups for sentence in group.of_fit()) if b.runs.fitted else ()
    return [
        *dict.fromkeys(
            [
                *b.runs.warnings,
                *_not_turned(b),
                *_other_sense(b),
                *b.warnings,
                *_without_trials(groups),
                *sentences,
            ]
        ),
        *fits,
    ]


def _not_turned(b: FieldBalancing) -> Iterator[str]:
    """Name the rotors whose runs do not show the sense of the phase, where those of others show that it lags."""
    groups = [solved.group for solved in b.solved] if b.runs.lags else []
    others = sorted(
        r for of in groups for r, sense in zip(of.rotors, of.lines.senses, strict=True) if sense is None
    )
    if others:
        named = ", ".join(b.runs.rotors[r] for r in others[:SHOWN]) + (" …" if len(others) > SHOWN else "")
        yield (
            f"the phases of {len(others)} rotor{'s' * (len(others) > 1)} ({named}) were not reversed: their runs do not "
            "determine the sense; if one instrument read all rotors, add --phase-lag"
        )


def _other_sense(b: FieldBalancing) -> Iterator[str]:
    """Name the headers and stored coefficients of a phase that lags where the phases of the runs were not reversed, and the other way round."""
    leads = b.request.lagging is None and not all(b.against(solved.group).all() for solved in b.solved)
    phase = b.runs.table.numbers.get("phase")
    if leads and phase is not None and LAGS.intersection(plain_word(phase.header).split("_")):
        yield (
            f"{b.runs.table.file}: the header {quote(phase.header)} says that the phase lags, and the phases were not reversed: add "
            "--phase-lag, or the angles are wrong; if the phase of this instrument leads, add --rotation ccw"
        )
    for file, lagged in b.runs.stored_lags.items():
        if lagged and leads:
            yield (
                f"{file}: the coefficients were measured with a phase that lags, and the phases of the runs were not reversed: with "
                "the same instrument add --phase-lag, or the angles are wrong; if the phase of this instrument leads, add --rotation ccw"
            )
        if b.request.lagging and not lagged:
            yield (
                f"{file}: the phases of the runs were reversed, but the file does not say how the phase was counted when its "
                "coefficients were measured, and the angles may be wrong: if the phase lagged then too, add a column phase_sense "
                "with the word lag to the file; if the phase of this instrument leads, leave out --phase-lag"
            )


def _without_trials(groups: list[_Group]) -> Iterator[str]:
    """Warn of rotors without a trial run in a plane where a rotor with the same other planes has one."""
    for group in groups:
        own = set(group.planes)
        others = {plane: None for other in groups if own < set(other.planes) for plane in other.planes}
        missing = [plane for plane in others if plane not in own]
        named = f"plane{'s' * (len(missing) > 1)} {' and '.join(missing)}"
        yield from group.each(
            np.full(len(group.group.rotors), bool(missing)),
            lambda _, named=named: (  # type: ignore[misc]
                f"no trial run in {named}, where other rotors have one: the corrections are for its other planes alone"
            ),
            f"no trial run in {named}",
        )


class _Group:
    """The warnings about a group of rotors."""

    def __init__(self, b: FieldBalancing, solved: Solved) -> None:
        self.b, self.solved, self.group, self.planes = b, solved, solved.group, solved.planes
        self.unit = b.runs.amplitude_unit

    def each(self, where: ArrayLike, sentence: Callable[[int], str], more: str = "") -> Iterator[str]:
        """Yield a sentence about each rotor where something holds, of the first ones; `more` of so many others."""
        rotors = np.flatnonzero(where)
        for i in rotors[:SHOWN].tolist():
            yield f"{self.b.of(self.group, i)}{sentence(i)}"
        if more and len(rotors) > SHOWN:
            yield f"… and the same of {len(rotors) - SHOWN} further rotors: {more}"

    def warnings(self) -> Iterator[str]:
        """Yield those about the corrections."""
        b, solved, request = self.b, self.solved, self.b.request
        yield from self.each(
            ~np.abs(solved.initial).any(axis=1),
            lambda _: "no vibration in the initial run: nothing to correct",
            "no vibration in the initial run",
        )
        if len(self.planes) > 1:
            yield from self._dependent()
        if not request.four_run:
            yield from self._thirty()
        yield from self._alternatives()
        if request.tolerance is not None and solved.unbalance is not None:
            unknown = np.isnan(solved.unbalance)
            yield from self.each(
                unknown.any(axis=1),
                lambda i: self._undetermined(
                    [p for p, no in zip(self.planes, unknown[i], strict=True) if no]
                ),
                "the initial unbalance is not determined in every plane",
            )
            # from here on means with the trial masses that were left on the rotor
            size = b.in_kg_m(solved.unbalance + solved.start)
            yield from self.each(
                (size <= request.tolerance.shares(len(self.planes))).all(axis=1),
                lambda _: (
                    "already within the permissible residual unbalance in every plane: stop, no correction is needed"
                ),
                "already within the permissible residual unbalance",
            )
        if b.ceiling is not None:
            yield from self.each(
                (np.abs(solved.initial) <= b.ceiling).all(axis=1),
                lambda _: "the initial vibration is within --max-residual already",
                "initial vibration within --max-residual already",
            )
        if request.places is not None:
            for w in solved.corrections[:SHOWN].ravel().tolist():
                missed = abs(b.placed(w).error) if w else 0.0
                if request.stock is not None and missed > ENOUGH * abs(w):
                    yield (
                        f"the weights in stock miss the correction at {degrees(w):.4g}° by {b.amount(missed):.4g} {b.unit} "
                        f"({missed / abs(w):.2%}): dalembert place has --max-pieces and --pieces"
                    )
                elif request.stock is None and missed > 1e-9 * abs(w):
                    yield f"a correction at {degrees(w):.4g}° cannot be reached from these places"

    def _dependent(self) -> Iterator[str]:
        """Yield which planes are nearly dependent."""
        solved, weights = self.solved, self.group.weights
        doubtful = np.flatnonzero(~(solved.condition < 5))
        if not len(doubtful):
            return
        share = np.ones(solved.corrections.shape)
        share[doubtful] = plane_significance(
            solved.alpha[doubtful], None if weights is None else weights[doubtful]
        )
        weak = share < NEARLY

        def sentence(i: int) -> str:
            named = [f"{self.planes[p]} ({share[i, p]:.2g})" for p in np.flatnonzero(weak[i])]
            return (
                f"planes nearly dependent: {', '.join(named)} (in brackets the share of the effect that no other planes "
                f"produce); errors grow by the condition number, {solved.condition[i]:.3g}: leave one plane out, or damp with --ridge"
            )

        yield from self.each(weak.any(axis=1), sentence, "planes nearly dependent")

    def _alternatives(self) -> Iterator[str]:
        """Yield the other corrections that fit amplitudes as well."""
        b = self.b
        for i, (fit, *_) in enumerate(self.solved.group.amplitude_fits):
            for s, (first, rival) in enumerate(zip(self.group.fit.initial[i], fit.other, strict=True)):
                if rival == rival:
                    other = -first / rival
                    yield (
                        f"{b.of(self.group, i)}sensor {self.group.channels[s]}: two corrections fit the amplitudes; the other one is "
                        f"{b.amount(abs(other)):.6g} {b.unit} at {float(degrees(other)):.2f}°: add a trial run at "
                        "another angle"
                    )

    def _undetermined(self, planes: list[str]) -> str:
        """Write why the readings do not determine the unbalance in these planes."""
        if len(self.group.channels) < len(self.planes):
            why = f"{len(self.group.channels)} readings for {len(self.planes)} planes"
        else:
            why = "no reading responds to it" if len(planes) == 1 else "the readings cannot distinguish them"
        return (
            f"the initial unbalance is not determined in plane{'s' * (len(planes) > 1)} "
            f"{' and '.join(planes)}: {why}; whether it is within the tolerance is not known"
        )

    def _thirty(self) -> Iterator[str]:
        """The 30/30 rule, where no spare reading shows how exact the coefficients are."""
        group, means, rotors = self.group, self.group.means, np.arange(len(self.group.rotors))
        bare = (group.fit.degrees_of_freedom == 0) & (group.before is None)
        for j in range(means.shape[1]):
            before = group.before_run(j)
            effect = trial_effect(means[rotors, before], means[:, j])
            most, turn = np.max(effect.amplitude, axis=1), np.degrees(np.max(effect.phase, axis=1))
            little = ~((effect.amplitude >= 0.3) | (effect.phase >= np.radians(30))).any(axis=1)
            run = group.lines.runs(0)[j]
            yield from self.each(
                bare & (before >= 0) & little,
                lambda i, j=j, most=most, turn=turn: (  # type: ignore[misc]
                    f"run {group.lines.runs(i)[j]}: the trial mass changed the vibration by {most[i]:.0%} and {turn[i]:.0f}° "
                    "at most: less than 30 % and 30°, its coefficients may be noise; expected a larger trial mass"
                ),
                f"run {run} changed the vibration by less than 30 % and 30°",
            )

    # -- about the fit ---------------------------------------------------------------------------------------

    def of_fit(self) -> Iterator[str]:
        """Yield those about the fit."""
        b, group, error = self.b, self.group, self.b.request.reading_error
        fit = group.fit
        uncertain = group.before is not None and group.before.reading is not None
        if error is None and not uncertain:
            bare = np.flatnonzero(fit.degrees_of_freedom == 0)[:1]
            for i in bare.tolist():
                yield (
                    f"{b.of(group, i)}as many readings as unknowns: no readings remain to show their scatter; expected "
                    "a further run, or --reading-error, for uncertainties"
                )
        with_outliers = np.flatnonzero((group.chance < LEVEL).any(axis=(1, 2))).tolist()
        rotors = (Rotor(b, self.solved, i) for i in with_outliers)
        outliers = ((rotor.i, row) for rotor in rotors for row in rotor.readings() if row.outlier)
        for i, one in islice(outliers, SHOWN):
            yield (
                f"{b.of(group, i)}run {one.run}, sensor {one.channel}: the reading lies {abs(one.residual):.4g} {self.unit} from the "
                f"fitted one (standardised {one.standardized:.3g}; by chance in {one.chance:.2g} of logs): an outlier, "
                f"but used; --exclude {one.run} leaves the run out"
            )
        if next(outliers, None) is not None:
            yield "… and further outliers: they are marked in --json"
        for i in range(min(len(group.rotors), SHOWN)):
            yield from self._repeats(i)
        yield from self._drifts()
        if error is not None:
            yield from self._scatter()

    def _repeats(self, i: int) -> Iterator[str]:
        """Repeats with the same masses that contradict each other: by the test, or by 30 % of the vibration."""
        from balancing import repeats

        group, one, unit = self.group, self.solved.fitted.machine(i), self.unit
        fit, lines = one.fit, self.group.lines.of(i)
        largest = np.abs(np.where(fit.present, fit.readings, 0.0)).max(axis=0)
        pairs = (
            pair
            for pair in repeats(fit, one.errors)
            if pair.probability < LEVEL or pair.difference > 0.3 * largest[pair.channel]
        )
        for pair in islice(pairs, SHOWN):
            runs = list(dict.fromkeys(lines[j] for j in pair.runs))
            read = group.readings[i, list(pair.runs), pair.channel]
            shown = read.conj() if self.b.against(group)[i] else read
            first, second = (f"{abs(v):.6g} {unit} at {degrees(v):.6g}°" for v in shown)
            yield (
                f"{self.b.of(group, i)}run{'s' * (len(runs) > 1)} {' and '.join(runs)}, sensor {group.channels[pair.channel]}: "
                f"{first} and {second} with the same masses: the readings contradict each other by "
                f"{pair.difference:.4g} {unit}, and their mean has the size {abs(read.mean()):.4g}: read again, or leave out what is "
                "wrong"
            )

    def _drifts(self) -> Iterator[str]:
        """Where the vibration without masses drifts with time."""
        of_time = self.group.drift
        if of_time is None:
            return

        def sentence(i: int) -> str:
            drifting = [
                f"sensor {channel} by {abs(rate):.4g} {self.unit} at {degrees(rate):.4g}°"
                for channel, rate in zip(self.group.channels, of_time.rate[i].tolist(), strict=True)
                if rate == rate
            ]
            return (
                f"the vibration drifts with time, in a year {', '.join(drifting)}: by chance in "
                f"{of_time.probability[i]:.2g} of logs (F test at {LEVEL:.0%}); all runs count alike, --exclude leaves out those of "
                "another time"
            )

        yield from self.each(of_time.probability < LEVEL, sentence)

    def _scatter(self) -> Iterator[str]:
        """Where the residuals are larger than the errors stated, by χ²."""
        from scipy.special import gammaincc

        fit, errors = self.solved.fitted.fit, self.solved.fitted.errors
        square = np.where(fit.present, np.square(errors.along) + np.square(errors.across), 0.0)
        mean = square.sum(axis=(1, 2)) / fit.present.sum(axis=(1, 2))
        nu = fit.degrees_of_freedom
        ratio = fit.sum_of_squares / np.where(mean > 0, mean, np.inf)
        yield from self.each(
            (nu > 0) & (gammaincc(np.maximum(nu, 1), ratio) < LEVEL),
            lambda i: (
                f"the residuals scatter by {fit.residual_sd[i]:.4g} {self.unit} (standard "
                f"deviation), more than --reading-error states ({np.sqrt(mean[i]):.4g}): uncertainties are too small"
            ),
        )


def sense(b: FieldBalancing) -> str:
    """Return how phases and mass angles are counted, as a sentence."""
    request = b.request
    lags = request.phase_lag or b.runs.lags
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
        f"The instrument's phases {'lag' if lags else 'lead'} ({turning}); all phases given out are counted in the sense of "
        "the mass angles."
    )


def instrument(rotor: Rotor) -> str:
    """Return how the phases of a rotor's report are counted, which are as the instrument shows them."""
    b = rotor.b
    if b.request.four_run:
        return sense(b)
    if not rotor.against:
        return (
            "Phases as the instrument shows them; they and the mass angles are counted in one common sense, from one mark "
            "on the rotor."
        )
    return (
        "Phases as the instrument shows them, counted against the sense of the mass angles; those of the influence "
        "coefficients and of the picture are counted in the sense of the mass angles."
    )


def conventions(b: FieldBalancing) -> str:
    """Return how angles and phases are counted and what the corrections mean, as sentences."""
    amounts = f"{b.runs.per}{'es' if b.runs.per == 'mass' else 's'}"
    radius = "at the radius of the trial masses"
    if b.request.from_here:
        return f"{sense(b)}\nTrim: {amounts} to ADD to the rotor as it stands in its last run, {radius}."
    return (
        f"{sense(b)}\nCorrections: {amounts} to ADD to the rotor in its initial state, all trial masses off, {radius}. "
        "Trim: what to ADD to the rotor as it stands in its last run."
    )
