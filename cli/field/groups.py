"""Rotors that were measured in the same way, side by side, and what is fitted to their runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from balancing import (
    AmplitudeFit,
    DependentTrials,
    JointFit,
    Undetermined,
    determined,
    fit_with_prior,
    influence_from_amplitudes,
    joint_fit,
    phase_sense,
)
from cli.field.request import Request
from cli.read import options
from cli.read.runs.reading import Measured, read_measured
from cli.read.runs.runs import SHOWN, Before, Complex, Group, Rows, Runs
from cli.read.runs.stored import Stored, read_runout
from dalembert.angles import degrees
from dalembert.errors import DataError, quote

Flags = NDArray[np.bool_]


def measured_groups(
    path: str, request: Request, influence: Sequence[str] = (), runout: str | None = None
) -> tuple[Runs, Stored | None]:
    """Read the runs and fit them; return them, and the stored coefficients that stand for trial runs."""
    requests = {name: getattr(request, name) for name in ("fit", "exclude", "predict", "suggest", "robust")}
    if request.four_run:
        options.refuse("fits all runs: it does not go with --method four-run", **requests)
    measured = read_measured(
        path,
        influence,
        fit=any(requests.values()),
        exclude=request.exclude,
        four_run=request.four_run,
        against=request.against,
    )
    runs, stored = measured.rows.rows.of, measured.stored
    _Groups(measured, request).read()
    runs.warnings = [*runs.table.warnings, *runs.warnings, *measured.warnings]
    lags = request.against or runs.lags
    if runout is not None:
        runs.runout = read_runout(runout, runs, lagging=lags)
    elif lags:
        runs.runout = {sensor: vector.conjugate() for sensor, vector in runs.runout.items()}
    return runs, stored


def _sense(
    runs: Runs, rotors: Rows, fit: JointFit, lagging: bool | None, again: Callable[[Complex], JointFit]
) -> tuple[JointFit, list[str | None]]:
    """Determine the sense of the phase, and fit again where the runs show another one and no option states it."""
    certain, taken, other = phase_sense(fit.alone)
    turn = -1 if lagging else 1
    against = np.flatnonzero(certain < 0)
    nu = np.maximum(fit.degrees_of_freedom, 1)
    for i in against[:SHOWN].tolist():
        sds = [float(np.sqrt(square[i] / nu[i])) for square in (taken, other)]
        word = "lags" if turn > 0 else "leads"
        message = (
            f"{runs.of(rotors[i])}the runs say that the instrument's phase {word}: residuals of {sds[1]:.4g} {runs.amplitude_unit} (standard "
            f"deviation), in the other sense {sds[0]:.4g}"
        )
        runs.warnings.append(
            f"{message}: it was turned round"
            if lagging is None
            else f"{message}; the option says otherwise, and was obeyed"
        )
    if lagging is None and len(against):
        fit = again(np.where((certain < 0)[:, None, None], fit.readings.conj(), fit.readings))
        runs.lags = True
    words = {1: "lead", -1: "lag", 0: None}
    return fit, [words[int(turn * sense)] for sense in certain.tolist()]


class _Groups:
    """The rotors of a table; those of like shape and names become a group."""

    def __init__(self, measured: Measured, request: Request) -> None:
        self.sorted, self.sisters, self.stored = measured.rows, measured.sisters, measured.stored
        self.runs, self.request = measured.rows.rows.of, request
        self.lost = 0

    def read(self) -> None:
        """Make groups of the rotors, and fit their runs; with stored coefficients the initial run stands alone."""
        sisters = self.sisters
        named = None if sisters is None else [sisters.key(name) for name in self.runs.rotors]
        for group in self.sorted.parts(named, self.stored is not None):
            for part in self._determined(group):
                self._fit(part)
        self.runs.warnings += self.sorted.warnings
        if self.lost > SHOWN:
            self.runs.warnings.append(
                f"… and {self.lost - SHOWN} further channels that the runs do not determine"
            )

    # -- which of them the runs determine ---------------------------------------------------------------------

    def _determined(self, group: Group) -> list[Group]:
        """Part a group into those whose runs determine the same channels; what they do not determine is left out."""
        if group.trials:
            # with nothing to spare nothing can be left out
            self._complete(group)
            self._means(group)
            return [group]
        if self.sisters is not None:
            return [self._in_known_planes(group)]
        present = np.isfinite(group.readings)
        keep = determined(group.masses, present)
        if keep.all():
            return [group]
        self._undetermined(group, keep)
        # without channels that the runs do not determine, and without runs in which no other was read
        left = (present & keep[:, None, :]).any(axis=2)
        kinds, kind = np.unique(np.concatenate([keep, left], axis=1), axis=0, return_inverse=True)
        order = np.argsort([np.argmax(kind == k) for k in range(len(kinds))]).tolist()
        split = [(k, *np.split(kinds[k], [keep.shape[1]])) for k in order]
        return [
            group.only(*(np.flatnonzero(of) for of in (kind == k, lines, channels)))
            for k, channels, lines in split
        ]

    def _means(self, group: Group) -> None:
        """Warn of sensors that were read more than once in a run."""
        of = self.runs.of(group.rotors[0])
        for trial in group.trials:
            many = np.isfinite(group.readings[0, trial.lines]).sum(axis=0).tolist()
            self.runs.warnings += [
                f"{of}sensor {channel.sensor} was read {n} times in one run: the mean is taken (as vectors)"
                for channel, n in zip(group.channels, many, strict=True)
                if n > 1
            ]

    def _complete(self, group: Group) -> None:
        """Refuse a trial run that lacks a channel of the initial one."""
        first = group.trials[0]
        for trial in group.trials:
            lacking = ~np.isfinite(group.readings[:, trial.lines]).any(axis=1)
            if lacking.any():
                i, s = np.argwhere(lacking)[0].tolist()
                raise DataError(
                    f"{self.runs.table.file}: {self.runs.of(group.rotors[i])}run {quote(trial.run)} has no reading of sensor "
                    f"{group.channels[s]}, which the initial run {quote(first.run)} has"
                )

    def _unused(self, group: Group) -> None:
        """Warn that stored coefficients take the place of the trial runs."""
        ordered, rotor = self.sorted, int(group.rotors[0])
        start = ordered.runs.start[rotor]
        if not ordered.tried[start : start + ordered.runs.count[rotor]].any():
            return
        of, stated = self.runs.of(rotor), ordered.rows.masses.stated
        self.runs.warnings.append(f"{of}--influence gives the coefficients: the trial runs are not used")
        if stated.size and not stated.any():
            self.runs.warnings.append(
                f"{of}the stored coefficients are per {self.runs.per}, and the runs have other masses: what is on the "
                "rotor in its last run is not known, and the trim leaves it out"
            )

    def _contradictions(self, group: Group) -> None:
        """Warn of repeats that contradict each other, with their figures."""
        repeats = group.repeats
        if not repeats.degrees_of_freedom:
            return
        contradictory = np.argwhere(repeats.contradictory & (repeats.counts > 1))
        unit, against = self.runs.amplitude_unit, self.request.against
        for i, j, s in contradictory[:SHOWN].tolist():
            trial = group.trials[j]
            read = group.readings[i, trial.lines, s]
            read = read[np.isfinite(read)]
            figures = [
                f"{abs(v):.6g} {unit}"
                if self.request.four_run
                else f"{abs(v):.6g} {unit} at {float(degrees(v.conjugate() if against else v)):.6g}°"
                for v in read[:SHOWN].tolist()
            ]
            more = f" and {len(read) - SHOWN} more" if len(read) > SHOWN else ""
            self.runs.warnings.append(
                f"{self.runs.of(group.rotors[i])}run {trial.run}: sensor {group.channels[s]} was read {len(read)} times, and the "
                f"readings contradict each other: {', '.join(figures)}{more}; their mean has the size "
                f"{abs(group.means[i, j, s]):.4g}: read again, or leave out what is wrong"
            )
        if len(contradictory) > SHOWN:
            self.runs.warnings.append(
                f"… and {len(contradictory) - SHOWN} further readings that contradict each other"
            )

    # -- the fit ---------------------------------------------------------------------------------------------

    def _fit(self, group: Group) -> None:
        """Fit a group, in the sense of the phase that its runs show; none where the coefficients come from elsewhere."""
        self.runs.groups.append(group)
        if self.stored:
            self._unused(group)
        elif not self.request.four_run:
            self._fit_runs(group)
        self._contradictions(group)

    def _fit_runs(self, group: Group) -> None:
        """Fit initial vibration and coefficients to the runs of a group."""
        readings, masses, prior = group.readings, group.masses, None
        if self.sisters is not None:
            prior = self.sisters.before(self.runs.rotors[group.rotors[0]], group.channels, self.runs)
        try:
            fit = self._fitted(readings, masses, prior)
        except (DependentTrials, Undetermined) as error:
            of = self.runs.of(group.rotors[error.case[0]])
            raise DataError(f"{of}{_dependent(group, error)}") from None
        # with nothing to spare the runs fit in either sense
        if not group.trials and (prior is None or determined(masses, np.isfinite(readings)).all()):
            fit, group.lines.senses = _sense(
                self.runs,
                group.rotors,
                fit,
                self.request.lagging,
                lambda turned: self._fitted(turned, masses, prior),
            )
        turned = (np.nan_to_num(fit.readings) != np.nan_to_num(readings)).any(axis=(1, 2))
        if turned.any():
            before = group.exact
            group.exact = lambda: before().turned(turned)
        group.readings, group.fit, group.before = fit.readings, fit, prior

    def _fitted(self, readings: Complex, masses: Complex, prior: Before | None) -> JointFit:
        """Fit runs, with coefficients that are stored from earlier ones."""
        if prior is None:
            return joint_fit(readings, masses)
        if self.request.reading_error is not None:
            size = np.abs(np.where(np.isfinite(readings), readings, 0.0))
            return fit_with_prior(
                readings, masses, prior.prior, float(np.hypot(*self.request.reading_error)) * size
            )
        fit = fit_with_prior(readings, masses, prior.prior)
        if prior.reading is not None and (fit.degrees_of_freedom == 0).any():
            sd = np.where(fit.degrees_of_freedom > 0, fit.residual_sd, prior.reading[0])
            fit = fit_with_prior(readings, masses, prior.prior, sd[:, None, None])
        return fit

    def _in_known_planes(self, group: Group) -> Group:
        """Return rotors with the planes whose coefficients are stored; a log that names none has the only one."""
        assert self.sisters is not None
        covered = self.sisters.planes(self.runs.rotors[group.rotors[0]])
        planes = group.planes
        if len(covered) == 1 and "trial_plane" not in self.runs.table.texts:
            planes = covered[: len(planes)]
        for plane in planes:
            if plane not in covered:
                raise DataError(
                    f"{self.runs.table.file}: {self.runs.of(group.rotors[0])}a mass in plane {plane}, of which no coefficient is stored: "
                    f"expected {', '.join(covered)}"
                )
        at = [covered.index(plane) for plane in planes]
        masses, standing = (
            np.zeros((*of.shape[:-1], len(covered)), dtype=of.dtype) for of in (group.masses, group.standing)
        )
        masses[..., at], standing[..., at] = group.masses, group.standing
        return replace(
            group,
            planes=covered,
            masses=masses,
            standing=standing,
            exact=lambda: group.exact().with_planes(at, len(covered)),
        )

    def _undetermined(self, group: Group, keep: Flags) -> None:
        """Warn of channels (g, s) that the runs do not determine; refuse a rotor without others."""
        some = keep.any(axis=1)
        if not some.all():
            i = int(np.argmin(some))
            raise DataError(f"{self.runs.table.file}: {self._lost(group, i, 0)}")
        for i, s in np.argwhere(~keep).tolist():
            self.lost += 1
            if self.lost <= SHOWN:
                self.runs.warnings.append(f"{self._lost(group, i, s)}; it takes no part in the fit")

    def _lost(self, group: Group, i: int, s: int) -> str:
        """Write why a channel of a rotor is not determined, and which run would determine it."""
        read = np.flatnonzero(np.isfinite(group.readings[i, :, s]))
        masses, lines = group.masses[i, read], group.lines.of(i)
        runs = [lines[j] for j in read]
        clause = "its vibration without masses is known, " if not masses.any() else ""
        times = "once" if len(read) == 1 else f"{len(read)} times"
        return (
            f"{self.runs.of(group.rotors[i])}sensor {group.channels[s]} was read {times} (run{'s' * (len(runs) > 1)} {', '.join(runs)}), which "
            f"does not determine {1 + len(group.planes)} unknowns: {clause}{_missing(group.planes, masses)}"
        )


def _missing(planes: list[str], masses: Complex) -> str:
    """Write what the runs do not determine, and which run would."""
    if masses.all(axis=0).any() and len(masses):
        return (
            "every run has a trial mass, and what it does is not told from the vibration without it; a run without, or "
            "with another mass there, would tell"
        )
    dark = [
        plane for plane, on in zip(planes, masses.T, strict=True) if np.ptp(on.real) == np.ptp(on.imag) == 0
    ]
    if dark:
        named = f"plane{'s' * (len(dark) > 1)} {' and '.join(dark)}"
        return f"what a mass in {named} does is not; a run with another mass there would tell"
    return "the masses of these runs do not tell the planes apart; a run with one plane's mass alone changed would"


def _dependent(group: Group, error: DependentTrials | Undetermined) -> str:
    """Write which planes the trial runs do not separate."""
    runs = len(group.trials) - 1
    if runs < len(group.planes):
        return (
            f"{len(group.planes)} planes ({', '.join(group.planes)}) and {runs} trial run{'s' * (runs != 1)}: expected a trial run "
            "for every plane"
        )
    shares = error.combination[-len(group.planes) :]
    unseen = [name for name, share in zip(group.planes, shares, strict=True) if abs(share) > 1e-6]
    return (
        f"the trial runs do not tell the planes {' and '.join(unseen)} apart: expected each plane tried by itself, or in "
        "different proportions"
    )


def by_amplitudes(group: Group, runs: Runs, warnings: list[str]) -> list[list[AmplitudeFit]]:
    """The four-run method, rotor by rotor, plane by plane: each run with masses has them in one plane.

    Several planes (Everett, J. Vib. Acoust. 109 (1987) 162-167): at each sensor the phases of all coefficients count from
    that sensor's own initial vibration, so that O + Σ α w = 0 is one linear system whatever these phases are.
    """
    several = np.flatnonzero((group.on[:, 1:] != 0).sum(axis=2).max(axis=0, initial=0) > 1)
    if len(several):
        raise DataError(
            f"{runs.of(group.rotors[0])}run {group.trials[1 + several[0]].run}: masses in several planes: without phase each trial run "
            "has a mass in one plane, the others empty: four runs for the first plane, then three for each other one"
        )
    return [
        [_of_plane(group, i, p, runs, warnings) for p in range(len(group.planes))]
        for i in range(len(group.rotors))
    ]


def _of_plane(group: Group, i: int, p: int, runs: Runs, warnings: list[str]) -> AmplitudeFit:
    """Fit one plane's coefficients to the amplitudes of its trial runs."""
    named = f" plane {group.planes[p]}:" if len(group.planes) > 1 else ""
    first, *read = group.means[i].real
    tried = np.flatnonzero(group.on[i, 1:, p] != 0)
    try:
        fit = influence_from_amplitudes(first, np.array(read)[tried], group.on[i, 1 + tried, p])
    except ValueError as error:
        raise DataError(
            f"{runs.table.file}: {runs.of(group.rotors[i])}{named.lstrip()}{' ' * bool(named)}{error}"
        ) from None
    unit = runs.amplitude_unit
    for channel, misfit, size in zip(group.channels, fit.misfit, first, strict=True):
        text = (
            f"{runs.of(group.rotors[i])}sensor {channel}:{named} the readings are inconsistent: no influence coefficient fits them "
            f"better than {misfit:.3g} {unit} (r.m.s.), {misfit / size:.0%} of the initial reading"
        )
        if misfit > 0.25 * size:
            raise DataError(f"{runs.table.file}: {text}: expected four readings that fit one plane's effect")
        if misfit > 0.05 * size:
            warnings.append(text)
    if named and not np.isnan(fit.other).all():
        raise DataError(
            f"{runs.table.file}: {runs.of(group.rotors[i])}two coefficients of plane {group.planes[p]} fit the amplitudes: expected "
            "a third trial run in this plane, at an angle off the line of the others"
        )
    return fit
