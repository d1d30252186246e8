"""The rotors of a log fitted: those of like shape and names side by side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from balancing import JointFit, determined, fit_with_prior, joint_fit, phase_sense
from cli.field.log_rows import LogRows, Part, Sorted
from cli.field.request import Request
from cli.field.runs import SHOWN, Before, Complex, Group, Real, Rows, Runs
from cli.field.sisters import Sisters
from dalembert.errors import DataError

Flags = NDArray[np.bool_]


def _sense(
    runs: Runs, rotors: Rows, fit: JointFit, lagging: bool | None, again: Callable[[Complex], JointFit]
) -> tuple[JointFit, list[str | None]]:
    """Tell the sense of the phase, and fit again where the runs tell another than was taken and no option says it."""
    told, taken, other = phase_sense(fit.alone)
    turn = -1 if lagging else 1
    against = np.flatnonzero(told < 0)
    nu = np.maximum(fit.degrees_of_freedom, 1)
    for i in against[:SHOWN].tolist():
        sds = [float(np.sqrt(square[i] / nu[i])) for square in (taken, other)]
        word = "lags" if turn > 0 else "leads"
        said = (
            f"{runs.of(rotors[i])}the runs say that the instrument's phase {word}: residuals of {sds[1]:.4g} {runs.amplitude_unit} (standard "
            f"deviation), in the other sense {sds[0]:.4g}"
        )
        runs.warnings.append(
            f"{said}: it was turned round"
            if lagging is None
            else f"{said}; the option says otherwise, and was obeyed"
        )
    if lagging is None and len(against):
        fit = again(np.where((told < 0)[:, None, None], fit.readings.conj(), fit.readings))
        runs.lags = True
    words = {1: "lead", -1: "lag", 0: None}
    return fit, [words[int(turn * sense)] for sense in told.tolist()]


class Logs:
    """The logs of all rotors; those of like shape and names become a group."""

    def __init__(self, rows: LogRows, request: Request, sisters: Sisters | None) -> None:
        self.rows, self.runs, self.request, self.sisters = rows, rows.of, request, sisters
        self.lost = 0

    def read(self) -> None:
        """Read and fit all rotors."""
        rows = Sorted(self.rows, self.request.exclude)
        named = None if self.sisters is None else [self.sisters.key(name) for name in self.runs.rotors]
        for part in rows.parts(named):
            self._fit(part)
        self.runs.warnings += rows.warnings
        if self.lost > SHOWN:
            self.runs.warnings.append(
                f"… and {self.lost - SHOWN} further channels that the runs do not determine"
            )

    def _fit(self, part: Part) -> None:
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
        channels, planes, readings, masses = part.channels, part.planes, part.readings, part.masses
        known = None
        if self.sisters is not None:
            known = self.sisters.known(self.runs.rotors[part.rotors[0]], channels, self.runs)
        fit = self._fitted(readings, masses, known)
        if known is None or determined(masses, np.isfinite(readings)).all():
            fit, part.lines.senses = _sense(
                self.runs,
                part.rotors,
                fit,
                self.request.lagging,
                lambda turned: self._fitted(turned, masses, known),
            )
        g, s, p = len(part.rotors), len(channels), len(planes)
        none = np.zeros((g, 0, p), dtype=complex)
        self.runs.groups.append(
            Group(
                part.rotors,
                channels,
                planes,
                [],
                fit.initial,
                np.zeros((g, 0, s), dtype=complex),
                none,
                part.standing,
                part.last,
                part.weights,
                np.ones((1, s), dtype=np.intp),
                np.zeros((g, 1, s)),
                lambda: self._errors(fit),
                fit=fit,
                logs=part.lines,
                before=known,
            )
        )

    def _errors(self, fit: JointFit) -> tuple[Real, Real, Real]:
        """Bound the errors of the readings (g, r, s) and masses (g, r, p) of a fit against the decimals of the table."""
        size = np.abs(fit.masses)
        if {"ref", "trial_kept"} & set(self.runs.table.texts):
            # each may be a sum of all that went before
            size = 2 * size.sum(axis=1, keepdims=True) + 0 * size
        readings = np.abs(np.where(fit.present, fit.readings, 0.0))
        return (np.zeros(fit.initial.shape), self.rows.reading_share * readings, self.rows.mass_share * size)

    def _fitted(self, readings: Complex, masses: Complex, known: Before | None) -> JointFit:
        """Fit runs, with what is known before."""
        if known is None:
            return joint_fit(readings, masses)
        if self.request.reading_error is not None:
            size = np.abs(np.where(np.isfinite(readings), readings, 0.0))
            return fit_with_prior(
                readings, masses, known.prior, float(np.hypot(*self.request.reading_error)) * size
            )
        fit = fit_with_prior(readings, masses, known.prior)
        if known.reading is not None and (fit.degrees_of_freedom == 0).any():
            sd = np.where(fit.degrees_of_freedom > 0, fit.residual_sd, known.reading[0])
            fit = fit_with_prior(readings, masses, known.prior, sd[:, None, None])
        return fit

    def _in_known_planes(self, part: Part) -> Part:
        """Return rotors with the planes whose coefficients are known before; a log that names none has the only one."""
        assert self.sisters is not None
        known = self.sisters.planes(self.runs.rotors[part.rotors[0]])
        planes = part.planes
        if len(known) == 1 and "trial_plane" not in self.runs.table.texts:
            planes = known[: len(planes)]
        for plane in planes:
            if plane not in known:
                raise DataError(
                    f"{self.runs.table.file}: {self.runs.of(part.rotors[0])}a mass in plane {plane}, of which no coefficient is stored: "
                    f"expected {', '.join(known)}"
                )
        at = [known.index(plane) for plane in planes]
        masses, standing = (
            np.zeros((*of.shape[:-1], len(known)), dtype=complex) for of in (part.masses, part.standing)
        )
        masses[..., at], standing[..., at] = part.masses, part.standing
        return part._replace(planes=known, masses=masses, standing=standing)

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
        known = "its vibration without masses is known, " if not masses.any() else ""
        times = "once" if len(read) == 1 else f"{len(read)} times"
        return (
            f"{self.runs.of(part.rotors[i])}sensor {part.channels[s]} was read {times} (run{'s' * (len(runs) > 1)} {', '.join(runs)}), which "
            f"does not determine {1 + len(part.planes)} unknowns: {known}{_missing(part.planes, masses)}"
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
