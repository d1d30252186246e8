"""The rotors of a log fitted: those of like shape and names side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from balancing import JointFit, Undetermined, determined, fit_with_prior, joint_fit, phase_sense
from cli.errors import DataError
from cli.field.read import NO, SHOWN, YES
from cli.field.runs import Before, Channel, Complex, Group, Log, Real, Rows, Runs
from cli.field.sisters import Sisters
from cli.read.tables import Table


@dataclass
class LogRows:
    """What each row of the table says, by row."""

    table: Table
    rotor: Rows
    rotors: list[str]
    vibration: list[complex]
    channel: list[Channel]
    """The sensor, state and speed of each row."""
    masses: list[dict[str, complex] | None]
    """Plane -> what this row puts on, SI; None where the row says nothing of masses."""
    run: list[str]
    """Its name, in each row."""
    years: Real | None = None
    """When it was read; NaN where the row does not say."""
    reading_share: float = 0.0
    """By what share of it a reading may be off from its decimals."""
    mass_share: float = 0.0


class _Rotor(NamedTuple):
    """A rotor's part of the table, in plain lists: there may be many rotors."""

    rotor: int
    rows: list[tuple[str, int]]
    """Of each row of readings the run, and which of its repeats it holds."""
    channels: list[Channel]
    planes: list[str]
    readings: list[list[complex]]
    """(r, s)."""
    masses: list[list[complex]]
    """(r, p)."""
    kept: list[complex]
    """What stays on after the last run, (p,)."""
    weights: list[float]
    """(s,)."""
    years: list[float] | None
    """When each row of readings was read, (r,)."""


def fit_groups(runs: Runs, lagging: bool | None) -> bool:
    """Fit the rotors of a table of runs that is read already; False where a run's rows are not told by it one by one.

    That is where a sensor was read several times in a run, or where speeds or dates count.
    """
    header = {name.lower() for name in runs.table.header}
    if "speed" in runs.table.numbers or "date" in header:
        return False
    if any((group.counts > 1).any() for group in runs.groups):
        return False
    try:
        runs.groups = [_whole(runs, group, lagging) for group in runs.groups]
    except Undetermined:
        # which run would tell is known to those that read them one by one
        return False
    return True


def _whole(runs: Runs, group: Group, lagging: bool | None) -> Group:
    """Return a group with its initial and trial runs fitted together."""
    readings = np.concatenate([group.initial[:, None], group.runs], axis=1)
    masses = np.concatenate([np.zeros_like(group.on[:, :1]), group.on], axis=1)
    errors = group.errors

    def of_fit() -> tuple[Real, Real, Real]:
        of_initial, of_runs, of_masses = errors()
        return (
            np.zeros(group.initial.shape),
            np.concatenate([of_initial[:, None], of_runs], axis=1),
            np.concatenate([np.zeros_like(of_masses[:, :1]), of_masses], axis=1),
        )

    fit = joint_fit(readings, masses)
    fit, senses = _sense(runs, group.rotors, fit, lagging, lambda turned: joint_fit(turned, masses))
    rows = [(run, 0) for run in (group.first, *(trial.run for trial in group.trials))]
    logs = {sense: Log(rows, sense) for sense in set(senses)}
    return replace(
        group,
        trials=[],
        initial=fit.initial,
        runs=group.runs[:, :0],
        on=group.on[:, :0],
        added=group.added[:, :0],
        base=[],
        counts=group.counts[:1],
        scatter=group.scatter[:, :1],
        errors=of_fit,
        fit=fit,
        logs=[logs[sense] for sense in senses],
    )


def _sense(
    runs: Runs, rotors: Rows, fit: JointFit, lagging: bool | None, again: Callable[[Complex], JointFit]
) -> tuple[JointFit, list[str | None]]:
    """Tell the sense of the phase, and fit again where the runs tell another than was taken and no option says it."""
    told, taken, other = phase_sense(fit.alone)
    turn = -1 if lagging else 1
    against = np.flatnonzero(told < 0)
    nu = np.maximum(fit.degrees_of_freedom, 1)
    for i in against[:SHOWN].tolist():
        of = f"rotor {runs.rotors[rotors[i]]}: " if len(runs.rotors) > 1 else ""
        sds = [float(np.sqrt(square[i] / nu[i])) for square in (taken, other)]
        word = "lags" if turn > 0 else "leads"
        said = (
            f"{of}the runs say that the instrument's phase {word}: residuals of {sds[1]:.4g} {runs.amplitude_unit} (standard "
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

    def __init__(
        self,
        rows: LogRows,
        runs: Runs,
        lagging: bool | None,
        exclude: set[str],
        sisters: Sisters | None,
        reading_error: tuple[float, float] | None,
    ) -> None:
        self.rows, self.runs, self.lagging, self.exclude = rows, runs, lagging, exclude
        self.sisters, self.reading_error = sisters, reading_error
        self.several = len(rows.rotors) > 1
        self.lost = 0

    def read(self, by_rotor: list[list[int]]) -> None:
        """Read and fit the rotors whose rows are given."""
        self._fit([self._rotor(r, members) for r, members in enumerate(by_rotor)])
        if self.lost > SHOWN:
            self.runs.warnings.append(
                f"… and {self.lost - SHOWN} further channels that the runs do not determine"
            )

    def _fit(self, rotors: list[_Rotor]) -> None:
        alike: dict[tuple[object, ...], list[_Rotor]] = {}
        for one in rotors:
            kind = (*one.channels, len(one.channels), *one.planes, len(one.masses), self._named(one))
            alike.setdefault(kind, []).append(one)
        less = []
        for mine in alike.values():
            readings, masses = (
                np.array([one.readings for one in mine]),
                np.array([one.masses for one in mine]),
            )
            if self.sisters is not None:
                self._group(mine, readings, masses)
                continue
            keep = determined(masses, np.isfinite(readings))
            whole = np.asarray(keep.all(axis=1))
            less += [self._without(mine[i], keep[i]) for i in np.flatnonzero(~whole).tolist()]
            if whole.any():
                self._group(
                    [one for one, yes in zip(mine, whole, strict=True) if yes], readings[whole], masses[whole]
                )
        if less:
            self._fit(less)

    def _group(self, mine: list[_Rotor], readings: Complex, masses: Complex) -> None:
        rotors = np.array([one.rotor for one in mine])
        channels, planes = mine[0].channels, mine[0].planes
        known = None
        if self.sisters is not None:
            known = self.sisters.known(self.rows.rotors[mine[0].rotor], channels, self.runs)
        fit = self._fitted(readings, masses, known)
        senses: list[str | None] = [None] * len(mine)
        if known is None or determined(masses, np.isfinite(readings)).all():
            fit, senses = _sense(
                self.runs, rotors, fit, self.lagging, lambda turned: self._fitted(turned, masses, known)
            )
        g, s, p = len(mine), len(channels), len(planes)
        none = np.zeros((g, 0, p), dtype=complex)
        self.runs.groups.append(
            Group(
                rotors,
                channels,
                planes,
                [],
                fit.initial,
                np.zeros((g, 0, s), dtype=complex),
                none,
                none,
                np.array([one.kept for one in mine]),
                [],
                np.array([one.weights for one in mine]) if "weight" in self.rows.table.numbers else None,
                np.ones((1, s), dtype=np.intp),
                np.zeros((g, 1, s)),
                lambda: self._errors(fit),
                fit=fit,
                logs=[Log(one.rows, sense, one.years) for one, sense in zip(mine, senses, strict=True)],
                before=known,
            )
        )

    def _errors(self, fit: JointFit) -> tuple[Real, Real, Real]:
        """Bound the errors of the readings (g, r, s) and masses (g, r, p) of a fit against the decimals of the table."""
        size = np.abs(fit.masses)
        if {"ref", "trial_kept"} & set(self.rows.table.texts):
            # each may be a sum of all that went before
            size = 2 * size.sum(axis=1, keepdims=True) + 0 * size
        readings = np.abs(np.where(fit.present, fit.readings, 0.0))
        return (
            np.zeros(fit.initial.shape),
            self.rows.reading_share * readings,
            self.rows.mass_share * size,
        )

    def _named(self, one: _Rotor) -> str | None:
        """Return the name under which a rotor's own coefficients are known before; None where it shares those of others."""
        return None if self.sisters is None else self.sisters.key(self.rows.rotors[one.rotor])

    def _fitted(self, readings: Complex, masses: Complex, known: Before | None) -> JointFit:
        """Fit runs, with what is known before."""
        if known is None:
            return joint_fit(readings, masses)
        if self.reading_error is not None:
            size = np.abs(np.where(np.isfinite(readings), readings, 0.0))
            return fit_with_prior(readings, masses, known.prior, float(np.hypot(*self.reading_error)) * size)
        fit = fit_with_prior(readings, masses, known.prior)
        if known.reading is not None and (fit.degrees_of_freedom == 0).any():
            sd = np.where(fit.degrees_of_freedom > 0, fit.residual_sd, known.reading[0])
            fit = fit_with_prior(readings, masses, known.prior, sd[:, None, None])
        return fit

    def _rotor(self, r: int, members: list[int]) -> _Rotor:
        rows = self.rows
        of = f"rotor {rows.rotors[r]}: " if self.several else ""
        # what a run that is left out has put on stays on all the same
        standing, on = self._on(members)
        if self.exclude:
            members = [i for i in members if rows.run[i] not in self.exclude]
            on = {run: masses for run, masses in on.items() if run not in self.exclude}
        if not members:
            raise DataError(f"{rows.table.file}: {of}every run is excluded: expected runs to fit")
        planes = list(dict.fromkeys(plane for masses in on.values() for plane in masses))
        if self.sisters is not None:
            planes = self._known_planes(rows.rotors[r], of, planes, on)
        elif not any(mass for masses in on.values() for mass in masses.values()):
            raise DataError(
                f"{rows.table.file}: {of}no mass ever changed: what a mass does to the vibration is not known; expected a "
                "run with a mass on the rotor"
            )
        first: dict[Channel, int] = {}
        lines: dict[tuple[str, int], list[complex]] = {}
        again: dict[tuple[str, Channel], int] = {}
        for i in members:
            first.setdefault(rows.channel[i], i)
        place = {channel: s for s, channel in enumerate(first)}
        nothing = [complex(np.nan)] * len(place)
        for i in members:
            run, channel = rows.run[i], rows.channel[i]
            k = again[run, channel] = again.get((run, channel), -1) + 1
            lines.setdefault((run, k), nothing.copy())[place[channel]] = rows.vibration[i]
        masses = [[on[run].get(plane, 0j) for plane in planes] for run, _ in lines]
        weights = [1.0] * len(first)
        if "weight" in rows.table.numbers:
            given = rows.table.numbers["weight"].values[list(first.values())]
            weights = np.where(np.isnan(given), 1.0, given).tolist()
            if not any(weights) or min(weights) < 0:
                raise DataError(
                    f"{rows.table.file}: {of}the weights are zero or negative: expected one that is positive"
                )
        last = [standing.get(plane, 0j) for plane in planes]
        when = None if rows.years is None else self._years(members, list(lines))
        return _Rotor(r, list(lines), list(first), planes, list(lines.values()), masses, last, weights, when)

    def _known_planes(
        self, rotor: str, of: str, planes: list[str], on: dict[str, dict[str, complex]]
    ) -> list[str]:
        """Return the planes whose coefficients are known before; a log that names none has the only one."""
        assert self.sisters is not None
        known = self.sisters.planes(rotor)
        if len(known) == 1 and "trial_plane" not in self.rows.table.texts:
            for run, masses in on.items():
                on[run] = dict(zip(known, masses.values(), strict=False))
            return known
        for plane in planes:
            if plane not in known:
                raise DataError(
                    f"{self.rows.table.file}: {of}a mass in plane {plane}, of which no coefficient is stored: expected "
                    f"{', '.join(known)}"
                )
        return known

    def _years(self, members: list[int], lines: list[tuple[str, int]]) -> list[float]:
        """Return when each row of readings was read: each says it itself, or its run does once."""
        rows = self.rows
        assert rows.years is not None
        of_run: dict[str, float] = {}
        of_line: dict[tuple[str, int], float] = {}
        again: dict[tuple[str, Channel], int] = {}
        for i in members:
            run, channel, at = rows.run[i], rows.channel[i], float(rows.years[i])
            k = again[run, channel] = again.get((run, channel), -1) + 1
            if at == at:
                of_run.setdefault(run, at)
                of_line.setdefault((run, k), at)
        found = [of_line.get(line, of_run.get(line[0], np.nan)) for line in lines]
        if not np.isfinite(found).all():
            of = f"rotor {rows.rotors[rows.rotor[members[0]]]}: " if self.several else ""
            lacking = dict.fromkeys(run for (run, _), at in zip(lines, found, strict=True) if at != at)
            self.runs.warnings.append(
                f"{of}no date in run{'s' * (len(lacking) > 1)} {', '.join(lacking)}: drift over time is not tested"
            )
        return found

    def _on(self, members: list[int]) -> tuple[dict[str, complex], dict[str, dict[str, complex]]]:
        """Return what stays on after the last run, and what was on in each run."""
        rows = self.rows
        kept = rows.table.texts.get("trial_kept")
        on: dict[str, dict[str, complex]] = {}
        told: dict[str, int] = {}
        stays: set[str] = set()
        for i in members:
            run, masses = rows.run[i], rows.masses[i]
            on.setdefault(run, {})
            if kept is not None:
                word = kept[i].lower()
                if word not in (*YES, *NO):
                    raise rows.table.error(i, "trial_kept", kept[i], "yes or no")
                if word in YES:
                    stays.add(run)
            if masses is None:
                continue
            if run in told and masses != rows.masses[told[run]]:
                size = next(iter(rows.table.cells.values()))
                raise rows.table.error(
                    i, size.header, size.values[i], f"the masses as elsewhere in run {run}"
                )
            told.setdefault(run, i)
            on[run] = masses
        if not stays:
            # masses written as on the rotor: where runs are told apart by them the last ones are still on
            last = {} if "run" in rows.table.texts else on[rows.run[members[-1]]]
            return last, on
        standing: dict[str, complex] = {}
        for run, masses in on.items():
            total = dict(standing)
            for plane, mass in masses.items():
                total[plane] = total.get(plane, 0) + mass
            on[run] = total
            if run in stays:
                standing = total
        return standing, on

    def _without(self, one: _Rotor, keep: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> _Rotor:
        """Return a rotor without the channels that its runs do not determine: they are said, and what would help them."""
        of = f"rotor {self.rows.rotors[one.rotor]}: " if self.several else ""
        planes, readings = one.planes, np.array(one.readings)
        present, masses = np.isfinite(readings), np.array(one.masses)
        said = []
        for s in np.flatnonzero(~keep).tolist():
            read = np.flatnonzero(present[:, s])
            runs = [one.rows[j][0] for j in read]
            known = "its vibration without masses is known, " if not masses[read].any() else ""
            missing = self._missing(planes, masses[read])
            times = "once" if len(read) == 1 else f"{len(read)} times"
            said.append(
                f"{of}sensor {one.channels[s]} was read {times} (run{'s' * (len(runs) > 1)} {', '.join(runs)}), which does not determine {1 + len(planes)} "
                f"unknowns: {known}{missing}"
            )
        if not keep.any():
            raise DataError(f"{self.rows.table.file}: {said[0]}")
        for text in said:
            self.lost += 1
            if self.lost <= SHOWN:
                self.runs.warnings.append(f"{text}; it takes no part in the fit")
        left = present[:, keep].any(axis=1)

        def of_rows(values: list[Any]) -> list[Any]:
            return [value for value, yes in zip(values, left, strict=True) if yes]

        def of_channels(values: list[Any]) -> list[Any]:
            return [value for value, yes in zip(values, keep, strict=True) if yes]

        return one._replace(
            rows=of_rows(one.rows),
            channels=of_channels(one.channels),
            readings=of_rows([of_channels(row) for row in one.readings]),
            masses=of_rows(one.masses),
            weights=of_channels(one.weights),
            years=None if one.years is None else of_rows(one.years),
        )

    def _missing(self, planes: list[str], masses: Complex) -> str:
        """Say what is not known, and which run would tell it."""
        if masses.all(axis=0).any() and len(masses):
            return (
                "every run has a trial mass, and what it does is not told from the vibration without it; a run without, or "
                "with another mass there, would tell"
            )
        dark = [
            plane
            for plane, on in zip(planes, masses.T, strict=True)
            if np.ptp(on.real) == np.ptp(on.imag) == 0
        ]
        if dark:
            named = f"plane{'s' * (len(dark) > 1)} {' and '.join(dark)}"
            return f"what a mass in {named} does is not; a run with another mass there would tell"
        return "the masses of these runs do not tell the planes apart; a run with one plane's mass alone changed would"
