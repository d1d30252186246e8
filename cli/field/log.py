"""From a balancing log as people keep it to arrays: runs told apart, masses as they were on the rotor, states, repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from balancing import JointFit, determined, joint_fit, phase_sense
from cli.errors import DataError, quote
from cli.field.layouts import log_table
from cli.field.read import NEAR_SPEED, NO, SHOWN, YES
from cli.field.runs import Channel, Complex, Group, Log, Real, Rows, Runs
from cli.read.options import bad
from cli.read.tables import Cells, Table, number_names
from cli.read.units import UNITS, phasor, to_si


@dataclass
class _Rows:
    """What each row of the table says, by row."""

    table: Table
    rotor: Rows
    rotors: list[str]
    vibration: Complex
    channel: list[Channel]
    """The sensor, state and speed of each row."""
    masses: list[dict[str, complex] | None]
    """Plane -> what this row puts on, SI; None where the row says nothing of masses."""
    run: list[str]


def read_log(path: str, *, lagging: bool | None, exclude: Sequence[str] = ()) -> Runs:
    """Read a log whose runs are all to be fitted together; `lagging` None: in the sense of the phase that fits better."""
    table, max_mass = log_table(path)
    amplitude, phase = table.require("amplitude", "amplitude"), table.require("phase", "angle")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    vibration = phasor(amplitude.values, -phase.values if lagging else phase.values, phase.unit)
    both = [name for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if len(both) != 1:
        found = f"both {' and '.join(both)}" if both else f"none (the header is: {', '.join(table.header)})"
        raise DataError(f"{table.file}: expected one column of masses, found {found}")
    size = table.cells[both[0]]
    names, rotor = number_names(table.texts.get("rotor") or ["1"] * table.rows)
    speed = table.numbers.get("speed")
    runs = Runs(
        table,
        names,
        [],
        amplitude.unit,
        "mass" if size.unit in UNITS["mass"] else "unbalance",
        size.unit,
        speed.unit if speed is not None else "rpm",
        max_mass=max_mass,
    )
    masses = _masses(table, size, runs.per)
    if "ref" in table.texts:
        masses = _on_top(table, rotor, masses)
    if "use" in table.texts:
        table.warnings.append(
            f"{table.file}: the column use is the keeper's own mark: every row takes part in the fit"
        )
    rows = _Rows(
        table, rotor, names, vibration, _channels(table, rotor), masses, table.texts.get("run") or []
    )
    if not rows.run:
        rows.run = _run_names(rows)
    for name in exclude:
        if name not in rows.run:
            raise bad("--exclude", f"no run {quote(name)} in {table.file}")
    by_rotor: list[list[int]] = [[] for _ in names]
    left_out = set(exclude)
    for i, (r, run) in enumerate(zip(rotor.tolist(), rows.run, strict=True)):
        if run not in left_out:
            by_rotor[r].append(i)
    _Logs(rows, runs, lagging).read(by_rotor)
    runs.warnings = [*table.warnings, *runs.warnings]
    return runs


def _masses(table: Table, size: Cells, per: str) -> list[dict[str, complex] | None]:
    """Read the masses of each row; several are joined by ';'."""
    angle = table.cells.get("trial_angle")
    plane = table.texts.get("trial_plane") or [""] * table.rows
    turns = angle.values if angle is not None else [""] * table.rows
    sizes: list[float] = []
    angles: list[float] = []
    where: list[tuple[int, str]] = []
    out: list[dict[str, complex] | None] = [None] * table.rows
    for i, (name, cell, turn) in enumerate(zip(plane, size.values, turns, strict=True)):
        if not cell:
            if name:
                raise table.error(i, size.header, cell, f"the mass in plane {name}")
            continue
        names = [part.strip() for part in name.split(";")] if name else ["1"]
        parts, around = cell.split(";"), turn.split(";") if turn else [""] * len(names)
        if not len(parts) == len(around) == len(names):
            raise table.error(
                i, size.header, cell, f"{len(names)} masses and angles joined by ';', as the planes"
            )
        out[i] = {}
        for one, part, at in zip(names, parts, around, strict=True):
            where.append((i, one))
            sizes.append(_number(table, size, i, part, "a mass"))
            if sizes[-1] < 0:
                raise table.error(i, size.header, cell, "a mass that is not negative")
            if not at.strip() and sizes[-1]:
                header = angle.header if angle is not None else "trial_angle_deg"
                raise table.error(i, header, turn, "the angle of the mass")
            angles.append(
                _number(table, angle, i, at, "the angle of the mass") if at.strip() and angle else 0.0
            )
    unit = angle.unit if angle is not None else "deg"
    on = phasor(np.asarray(to_si(np.array(sizes), per, size.unit)), np.array(angles), unit)
    for (i, name), mass in zip(where, on.tolist(), strict=True):
        mine = out[i]
        assert mine is not None
        mine[name] = mine.get(name, 0) + mass
    return out


def _number(table: Table, cells: Cells, row: int, text: str, expected: str) -> float:
    try:
        return cells.number(text)
    except ValueError:
        more = ", with a decimal comma as elsewhere in the file" if cells.decimal_comma else ""
        raise table.error(row, cells.header, text, expected + more) from None


def _on_top(
    table: Table, rotor: Rows, masses: list[dict[str, complex] | None]
) -> list[dict[str, complex] | None]:
    """Add what is below each mass: `ref` numbers the run, within its state, on top of which it stands; -1 for none.

    Its angle counts from the angle written in that run's row.
    """
    angle = table.cells.get("trial_angle")
    state = table.texts.get("state") or [""] * table.rows
    sensor = table.texts.get("sensor") or ["1"] * table.rows
    seen: dict[tuple[int, str, str], list[int]] = {}
    out: list[dict[str, complex] | None] = []
    for i, text in enumerate(table.texts["ref"]):
        before = seen.setdefault((int(rotor[i]), state[i], sensor[i]), [])
        try:
            below = int(float(text.replace(",", "."))) if text else -1
        except ValueError:
            below = 0
        own = len(before) + 1
        if below != -1 and not 1 <= below < own and not below == own == 1:
            raise table.error(i, "ref", text, "-1, or the number of an earlier run in this state")
        mine = dict(masses[i] or {})
        if 1 <= below < own:
            base = before[below - 1]
            written = angle.values[base] if angle is not None else ""
            turn = 1 + 0j
            if written and angle is not None:
                turn = complex(phasor(np.ones(1), np.array([angle.number(written)]), angle.unit)[0])
            mine = {plane: mass * turn for plane, mass in mine.items()}
            for plane, mass in (out[base] or {}).items():
                mine[plane] = mine.get(plane, 0) + mass
        before.append(i)
        out.append(mine)
    return out


def _channels(table: Table, rotor: Rows) -> list[Channel]:
    """Return the channel of each row; speeds within 5 % of the slowest of their kind are one."""
    sensor = table.texts.get("sensor") or ["1"] * table.rows
    state: Sequence[str | None] = table.texts.get("state") or [None] * table.rows
    speed = table.numbers.get("speed")
    if speed is None:
        known: dict[tuple[str, str | None], Channel] = {}
        return [
            known.setdefault(key, Channel(key[0], None, state=key[1]))
            for key in zip(sensor, state, strict=True)
        ]
    si = to_si(speed.values, "speed", speed.unit)
    out = [Channel("", None)] * table.rows
    order = sorted(range(table.rows), key=lambda i: (rotor[i], sensor[i], state[i] or "", speed.values[i]))
    members: list[int] = []

    def close() -> None:
        given, in_si = speed.values[members], si[members]
        same = given[0] == given[-1] or given[0] != given[0]
        mean = (given[0], in_si[0]) if same else (float(given.mean()), float(in_si.mean()))
        first = members[0]
        none = given[0] != given[0]
        channel = Channel(
            sensor[first],
            None if none else float(mean[1]),
            None if none else float(mean[0]),
            state=state[first],
        )
        for i in members:
            out[i] = channel

    for i in order:
        if members:
            first = members[0]
            kind = (rotor[first], sensor[first], state[first]) == (rotor[i], sensor[i], state[i])
            fast = speed.values[i] > speed.values[first] * (1 + NEAR_SPEED)
            blank = (speed.values[i] != speed.values[i]) != (speed.values[first] != speed.values[first])
            if not kind or fast or blank:
                close()
                members = []
        members.append(i)
    if members:
        close()
    return out


def _run_names(rows: _Rows) -> list[str]:
    """Tell runs apart where no column does: a new one begins where the masses change, or a channel comes again."""
    out: list[str] = []
    count: dict[int, int] = {}
    before: tuple[int, dict[str, complex]] | None = None
    seen: set[Channel] = set()
    for r, channel, masses in zip(rows.rotor.tolist(), rows.channel, rows.masses, strict=True):
        on = (r, {plane: mass for plane, mass in (masses or {}).items() if mass})
        if on != before or channel in seen:
            count[r] = count.get(r, 0) + 1
            before, seen = on, set()
        seen.add(channel)
        out.append(str(count[r]))
    return out


class _Rotor(NamedTuple):
    """A rotor's part of the table."""

    rotor: int
    rows: list[tuple[str, int]]
    """Of each row of readings the run, and which of its repeats it holds."""
    channels: list[Channel]
    planes: list[str]
    readings: Complex
    """(r, s)."""
    masses: Complex
    """(r, p)."""
    kept: Complex
    """What stays on after the last run, (p,)."""
    weights: Real
    """(s,)."""


class _Logs:
    """The logs of all rotors; those of like shape and names become a group."""

    def __init__(self, rows: _Rows, runs: Runs, lagging: bool | None) -> None:
        self.rows, self.runs, self.lagging = rows, runs, lagging
        self.several = len(rows.rotors) > 1
        self.lost = 0

    def read(self, by_rotor: list[list[int]]) -> None:
        alike: dict[tuple[object, ...], list[_Rotor]] = {}
        for r, members in enumerate(by_rotor):
            one = self._rotor(r, members)
            alike.setdefault((tuple(one.channels), tuple(one.planes), len(one.masses)), []).append(one)
        for mine in alike.values():
            self._group(mine)
        if self.lost > SHOWN:
            self.runs.warnings.append(
                f"… and {self.lost - SHOWN} further channels that the runs do not determine"
            )

    def _group(self, mine: list[_Rotor]) -> None:
        rotors = np.array([one.rotor for one in mine])
        channels, planes = mine[0].channels, mine[0].planes
        fit = joint_fit(np.stack([one.readings for one in mine]), np.stack([one.masses for one in mine]))
        fit, senses = self._sense(rotors, fit)
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
                np.stack([one.kept for one in mine]),
                [],
                np.stack([one.weights for one in mine]) if "weight" in self.rows.table.numbers else None,
                np.ones((1, s), dtype=np.intp),
                np.zeros((g, 1, s)),
                lambda: (np.zeros((g, s)), np.zeros((g, 0, s)), np.zeros((g, 0, p))),
                fit=fit,
                logs=[Log(one.rows, sense) for one, sense in zip(mine, senses, strict=True)],
            )
        )

    def _sense(self, rotors: Rows, fit: JointFit) -> tuple[JointFit, list[str | None]]:
        """Tell the sense of the phase, and fit again where the runs tell another than was taken and no option says it."""
        told, taken, other = phase_sense(fit)
        turn = -1 if self.lagging else 1
        against = np.flatnonzero(told < 0)
        nu = np.maximum(fit.degrees_of_freedom, 1)
        for i in against[:SHOWN].tolist():
            of = f"rotor {self.rows.rotors[rotors[i]]}: " if self.several else ""
            sds = [float(np.sqrt(square[i] / nu[i])) for square in (taken, other)]
            word = "lags" if turn > 0 else "leads"
            said = (
                f"{of}the runs say that the instrument's phase {word}: residuals of {sds[1]:.4g} {self.runs.amplitude_unit} (standard "
                f"deviation), in the other sense {sds[0]:.4g}"
            )
            self.runs.warnings.append(
                f"{said}: it was turned round"
                if self.lagging is None
                else f"{said}; the option says otherwise, and was obeyed"
            )
        if self.lagging is None and len(against):
            turned = np.where((told < 0)[:, None, None], fit.readings.conj(), fit.readings)
            fit = joint_fit(turned, fit.masses)
            self.runs.lags = True
        words = {1: "lead", -1: "lag", 0: None}
        return fit, [words[int(turn * sense)] for sense in told.tolist()]

    def _rotor(self, r: int, members: list[int]) -> _Rotor:
        rows = self.rows
        of = f"rotor {rows.rotors[r]}: " if self.several else ""
        if not members:
            raise DataError(f"{rows.table.file}: {of}every run is excluded: expected runs to fit")
        standing, on = self._on(members)
        planes = list(dict.fromkeys(plane for masses in on.values() for plane in masses))
        channels = list(dict.fromkeys(rows.channel[i] for i in members))
        place = {channel: s for s, channel in enumerate(channels)}
        again: dict[tuple[str, Channel], int] = {}
        lines: dict[tuple[str, int], int] = {}
        cells: list[tuple[int, int, int]] = []
        for i in members:
            run, channel = rows.run[i], rows.channel[i]
            k = again[run, channel] = again.get((run, channel), -1) + 1
            cells.append((lines.setdefault((run, k), len(lines)), place[channel], i))
        readings = np.full((len(lines), len(channels)), np.nan, dtype=complex)
        for line, s, i in cells:
            readings[line, s] = rows.vibration[i]
        masses = np.array([[on[run].get(plane, 0) for plane in planes] for run, _ in lines], dtype=complex)
        masses = masses.reshape(len(lines), len(planes))
        if not masses.any() or not planes:
            raise DataError(
                f"{rows.table.file}: {of}no mass ever changed: what a mass does to the vibration is not known; expected a "
                "run with a mass on the rotor"
            )
        keep = self._determined(of, channels, planes, readings, masses, list(lines))
        first = {channel: i for i, channel in reversed([(i, rows.channel[i]) for i in members])}
        weights = np.ones(len(channels))
        if "weight" in rows.table.numbers:
            given = rows.table.numbers["weight"].values[[first[channel] for channel in channels]]
            weights = np.where(np.isnan(given), 1.0, given)
            if not (weights[keep] > 0).any() or (weights < 0).any():
                raise DataError(
                    f"{rows.table.file}: {of}the weights are zero or negative: expected one that is positive"
                )
        last = np.array([standing.get(plane, 0) for plane in planes], dtype=complex)
        left = readings[:, keep]
        told = np.isfinite(left).any(axis=1)
        names = [line for line, yes in zip(lines, told, strict=True) if yes]
        channels = [channel for channel, yes in zip(channels, keep, strict=True) if yes]
        return _Rotor(r, names, channels, planes, left[told], masses[told], last, weights[keep])

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

    def _determined(
        self,
        of: str,
        channels: list[Channel],
        planes: list[str],
        readings: Complex,
        masses: Complex,
        lines: list[tuple[str, int]],
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Tell which channels the runs determine; the others are said, and what would help them."""
        present = np.isfinite(readings)
        keep = determined(masses, present)
        said = []
        for s in np.flatnonzero(~keep).tolist():
            read = np.flatnonzero(present[:, s])
            runs = [lines[j][0] for j in read]
            known = "its vibration without masses is known, " if not masses[read].any() else ""
            missing = self._missing(planes, masses[read])
            times = "once" if len(read) == 1 else f"{len(read)} times"
            said.append(
                f"{of}sensor {channels[s]} was read {times} (run{'s' * (len(runs) > 1)} {', '.join(runs)}), which does not determine {1 + len(planes)} "
                f"unknowns: {known}{missing}"
            )
        if not keep.any():
            raise DataError(f"{self.rows.table.file}: {said[0]}")
        for text in said:
            self.lost += 1
            if self.lost <= SHOWN:
                self.runs.warnings.append(f"{text}; it takes no part in the fit")
        return keep

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
