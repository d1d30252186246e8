"""Rotors of like shape and names side by side, and what is fitted to their runs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from balancing import (
    DependentTrials,
    JointFit,
    Undetermined,
    determined,
    fit_with_prior,
    joint_fit,
    phase_sense,
)
from cli.field.request import Request
from cli.field.rows import Sorted
from cli.field.runs import SHOWN, Before, Complex, Group, Part, Real, Rows, Runs
from cli.field.stored import Sisters
from dalembert.angles import degrees
from dalembert.errors import DataError, quote

Flags = NDArray[np.bool_]


def _sense(
    runs: Runs, rotors: Rows, fit: JointFit, lagging: bool | None, again: Callable[[Complex], JointFit]
) -> tuple[JointFit, list[str | None]]:
    """Tell the sense of the phase, and fit again where the runs tell another than was taken and no option says it."""
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


def read_groups(rows: Sorted, request: Request, sisters: Sisters | None, stored: bool) -> None:
    """Make groups of the rotors, and fit their runs; with `stored` coefficients the initial run stands alone."""
    groups = _Groups(rows, request, sisters, stored)
    named = None if sisters is None else [sisters.key(name) for name in groups.runs.rotors]
    for part in rows.parts(named, stored):
        if groups.runs.fitted:
            groups.fit(part)
        else:
            groups.tried(part)
    groups.runs.warnings += rows.warnings
    if groups.lost > SHOWN:
        groups.runs.warnings.append(
            f"… and {groups.lost - SHOWN} further channels that the runs do not determine"
        )


class _Groups:
    """The rotors of a table; those of like shape and names become a group."""

    def __init__(self, rows: Sorted, request: Request, sisters: Sisters | None, stored: bool) -> None:
        self.sorted, self.rows, self.runs = rows, rows.rows, rows.rows.of
        self.request, self.sisters, self.stored = request, sisters, stored
        self.lost = 0

    def tried(self, part: Part) -> None:
        """Take an initial run with trial runs: a fit with nothing to spare, but for repeated readings."""
        self._complete(part)
        for trial in part.trials:
            many = np.isfinite(part.readings[0, trial.lines]).sum(axis=0).tolist()
            self.runs.warnings += [
                f"{self.runs.of(part.rotors[0])}sensor {channel.sensor} was read {n} times in one run: the mean is taken (as vectors)"
                for channel, n in zip(part.channels, many, strict=True)
                if n > 1
            ]
        group = self._made(part, None)
        if self.stored:
            self._unused(part)
        elif not self.request.four_run:
            try:
                group.fit = joint_fit(part.readings, part.masses)
            except (DependentTrials, Undetermined) as error:
                raise DataError(
                    f"{self.runs.of(part.rotors[error.case[0]])}{_not_told(part, error)}"
                ) from None
        self._contradictions(group)

    def _complete(self, part: Part) -> None:
        """Refuse a trial run that lacks a channel of the initial one."""
        first = part.trials[0]
        for trial in part.trials:
            lacking = ~np.isfinite(part.readings[:, trial.lines]).any(axis=1)
            if lacking.any():
                i, s = np.argwhere(lacking)[0].tolist()
                raise DataError(
                    f"{self.runs.table.file}: {self.runs.of(part.rotors[i])}run {quote(trial.run)} has no reading of sensor "
                    f"{part.channels[s]}, which the initial run {quote(first.run)} has"
                )

    def _unused(self, part: Part) -> None:
        """Say that stored coefficients stand for the trial runs."""
        rows, rotor = self.sorted, int(part.rotors[0])
        start = rows.runs.start[rotor]
        if not rows.tried[start : start + rows.runs.count[rotor]].any():
            return
        of = self.runs.of(rotor)
        self.runs.warnings.append(f"{of}--influence gives the coefficients: the trial runs are not used")
        if rows.rows.masses.told.size and not rows.rows.masses.told.any():
            self.runs.warnings.append(
                f"{of}the stored coefficients are per {self.runs.per}, and the runs have other masses: what is on the "
                "rotor in its last run is not known, and the trim leaves it out"
            )

    def _contradictions(self, group: Group) -> None:
        """Say which repeats contradict each other, with their figures."""
        if not group.repeats:
            return
        contradictory = np.argwhere(group.contradictory & (group.counts > 1))
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

    def fit(self, part: Part) -> None:
        """Fit the runs of a log all at once."""
        if self.sisters is not None:
            self._group(self._in_known_planes(part))
            return
        present = np.isfinite(part.readings)
        keep = determined(part.masses, present)
        if keep.all():
            self._group(part)
            return
        self._say_lost(part, keep)
        # without channels that the runs do not determine, and without runs in which no other was read
        left = (present & keep[:, None, :]).any(axis=2)
        kinds, kind = np.unique(np.concatenate([keep, left], axis=1), axis=0, return_inverse=True)
        for k in np.argsort([np.argmax(kind == k) for k in range(len(kinds))]).tolist():
            channels, lines = np.split(kinds[k], [keep.shape[1]])
            self._group(part.only(*(np.flatnonzero(of) for of in (kind == k, lines, channels))))

    def _group(self, part: Part) -> None:
        channels, readings, masses = part.channels, part.readings, part.masses
        prior = None
        if self.sisters is not None:
            prior = self.sisters.known(self.runs.rotors[part.rotors[0]], channels, self.runs)
        fit = self._fitted(readings, masses, prior)
        if prior is None or determined(masses, np.isfinite(readings)).all():
            fit, part.lines.senses = _sense(
                self.runs,
                part.rotors,
                fit,
                self.request.lagging,
                lambda turned: self._fitted(turned, masses, prior),
            )
        self._made(part, fit).before = prior

    def _made(self, part: Part, fit: JointFit | None) -> Group:
        """Add a group."""
        share = self.rows.reading_share, self.rows.mass_share
        if "ref" in self.runs.table.texts:
            # each may be a sum of all that went before
            part = part._replace(sizes=2 * part.sizes.sum(axis=1, keepdims=True) + 0 * part.sizes)
        readings = part.readings if fit is None else fit.readings

        def errors() -> tuple[Real, Real]:
            return share[0] * np.nan_to_num(np.abs(readings)), share[1] * part.sizes

        shape = (part.rotors, part.channels, part.planes, part.lines, readings, part.masses)
        group = Group(*shape, part.standing, part.last, part.weights, errors, fit, part.trials)
        self.runs.groups.append(group)
        return group

    def _fitted(self, readings: Complex, masses: Complex, prior: Before | None) -> JointFit:
        """Fit runs, with what is known before."""
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

    def _in_known_planes(self, part: Part) -> Part:
        """Return rotors with the planes whose coefficients are known before; a log that names none has the only one."""
        assert self.sisters is not None
        covered = self.sisters.planes(self.runs.rotors[part.rotors[0]])
        planes = part.planes
        if len(covered) == 1 and "trial_plane" not in self.runs.table.texts:
            planes = covered[: len(planes)]
        for plane in planes:
            if plane not in covered:
                raise DataError(
                    f"{self.runs.table.file}: {self.runs.of(part.rotors[0])}a mass in plane {plane}, of which no coefficient is stored: "
                    f"expected {', '.join(covered)}"
                )
        at = [covered.index(plane) for plane in planes]
        masses, sizes, standing = (
            np.zeros((*of.shape[:-1], len(covered)), dtype=of.dtype)
            for of in (part.masses, part.sizes, part.standing)
        )
        masses[..., at], sizes[..., at], standing[..., at] = part.masses, part.sizes, part.standing
        return part._replace(planes=covered, masses=masses, sizes=sizes, standing=standing)

    def _say_lost(self, part: Part, keep: Flags) -> None:
        """Say which channels (g, s) the runs do not determine, and which run would; refuse a rotor without others."""
        some = keep.any(axis=1)
        if not some.all():
            i = int(np.argmin(some))
            raise DataError(f"{self.runs.table.file}: {self._lost(part, i, 0)}")
        for i, s in np.argwhere(~keep).tolist():
            self.lost += 1
            if self.lost <= SHOWN:
                self.runs.warnings.append(f"{self._lost(part, i, s)}; it takes no part in the fit")

    def _lost(self, part: Part, i: int, s: int) -> str:
        """Say why a channel of a rotor is not determined."""
        read = np.flatnonzero(np.isfinite(part.readings[i, :, s]))
        masses = part.masses[i, read]
        rows = part.lines[i].rows
        runs = [rows[j][0] for j in read]
        clause = "its vibration without masses is known, " if not masses.any() else ""
        times = "once" if len(read) == 1 else f"{len(read)} times"
        return (
            f"{self.runs.of(part.rotors[i])}sensor {part.channels[s]} was read {times} (run{'s' * (len(runs) > 1)} {', '.join(runs)}), which "
            f"does not determine {1 + len(part.planes)} unknowns: {clause}{_missing(part.planes, masses)}"
        )


def _missing(planes: list[str], masses: Complex) -> str:
    """Say what is not known, and which run would tell it."""
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


def _not_told(part: Part, error: DependentTrials | Undetermined) -> str:
    """Say which planes the trial runs do not tell apart."""
    runs = len(part.trials) - 1
    if runs < len(part.planes):
        return (
            f"{len(part.planes)} planes ({', '.join(part.planes)}) and {runs} trial run{'s' * (runs != 1)}: expected a trial run "
            "for every plane"
        )
    shares = error.combination[-len(part.planes) :]
    unseen = [name for name, share in zip(part.planes, shares, strict=True) if abs(share) > 1e-6]
    return (
        f"the trial runs do not tell the planes {' and '.join(unseen)} apart: expected each plane tried by itself, or in "
        "different proportions"
    )
