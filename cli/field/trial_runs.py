"""From a table of runs, an initial one and one for each trial, to arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from cli.field.request import Request
from cli.field.runs import SHOWN, Channel, Complex, Group, Real, Rows, Runs, Trial, Value, alike, apart
from cli.field.wide import long_form
from cli.read.rounding import EPS, vector_error
from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.tables.table import Cells, Table, read
from dalembert.units import LARGEST, SMALLEST, UNITS, to_si

YES = ("yes", "y", "true", "1", "kept", "on", "ja", "j", "bleibt")
NO = ("no", "n", "false", "0", "", "removed", "off", "nein")
NEAR_SPEED = 0.05  # among several speeds one is recognised within this share
OF_LOGS = ("date", "ref", "use")  # columns that count where all runs are fitted


def runs_table(
    path: str,
    texts: Sequence[str] = ("rotor", "run", "sensor", "trial_plane", "trial_kept", *OF_LOGS),
    headers: Callable[[list[str]], list[str]] | None = None,
) -> Table:
    """Read a file as a table of runs."""
    return read(
        path,
        numbers={"speed": "speed", "amplitude": "amplitude", "phase": "angle", "weight": "number"},
        texts=texts,
        cells={"trial_mass": "mass", "trial_unbalance": "unbalance", "trial_angle": "angle"},
        blank=["speed", "weight", "amplitude", "phase"],
        headers=headers,
        layout=long_form,
    )


def read_runs(table: Table, request: Request, stored_unit: str | None = None) -> Runs:
    """Read a table of runs; `stored_unit` is the unit of stored coefficients that stand for the trials."""
    for name in OF_LOGS:
        if name in table.texts:
            table.warnings.append(f"{table.file}: ignored the column {name}")
    amplitude = table.require("amplitude", "amplitude")
    table.reject(np.isnan(amplitude.values), "amplitude", "a number")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    if request.four_run:
        vibration = amplitude.values.astype(complex)
    else:
        phase = table.require("phase", "angle")
        table.reject(np.isnan(phase.values), "phase", "a number")
        vibration = phasor(amplitude.values, -phase.values if request.against else phase.values, phase.unit)
    if "weight" in table.numbers:
        table.reject(table.numbers["weight"].values < 0, "weight", "a weight that is not negative")
    sizes = [table.cells[name] for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if len(sizes) > 1:
        raise DataError(
            f"{table.file}: mixed columns {' and '.join(size.header for size in sizes)}: expected one"
        )
    if not sizes and stored_unit is None:
        raise DataError(
            f"{table.file}: no column trial_mass_kg (or trial_mass_g, trial_unbalance_g_mm …): expected trial masses, "
            f"or stored coefficients by --influence {table.told}"
        )
    names, rotor = table.numbered("rotor", "1")
    runs = Runs(table, names, stored_unit or sizes[0].unit, warnings=list(table.warnings))
    columns = _Columns(runs, vibration, sizes, stored_unit is not None)
    for rotors, rows in alike(table, rotor):
        runs.groups.append(_Alike(columns, rotors, rows).group())
    return runs


class NotOneInitialRun(DataError):
    """A table of runs with no initial run, with several, or with readings that lack: all runs have to be fitted together."""


class _Columns:
    """The columns of the table, those that it may lack with what is meant then."""

    def __init__(self, runs: Runs, vibration: Complex, sizes: Sequence[Cells], stored: bool) -> None:
        self.runs, self.table, self.vibration, self.stored = runs, runs.table, vibration, stored
        # what stored coefficients of masses are for is no unbalance
        self.size = sizes[0] if sizes and sizes[0].unit in UNITS[runs.per] else None
        blank = [""] * self.table.rows
        self.texts = {
            "sensor": ["1"] * self.table.rows,
            "trial_plane": ["1" if cell else "" for cell in sizes[0].values] if sizes else blank,
            "trial_kept": blank,
        }
        if stored:
            self.texts["run"] = ["initial"] * self.table.rows
        self.texts |= self.table.texts
        if "run" not in self.texts:
            raise DataError(f"{self.table.file}: no column run {self.table.told}")
        speed = self.table.numbers.get("speed")
        self.speed_given = speed.values if speed is not None else np.full(self.table.rows, np.nan)
        self.speed = to_si(self.speed_given, "speed", speed.unit) if speed is not None else self.speed_given


class _Alike:
    """Rotors whose rows (g, n) are laid out alike; the first of them tells how it was measured."""

    def __init__(self, columns: _Columns, rotors: Rows, rows: Rows) -> None:
        self.columns, self.table, self.runs = columns, columns.table, columns.runs
        self.rotors, self.rows, self.first = rotors, rows, rows[0].tolist()
        self.of = self.runs.of(rotors[0])
        texts = {name: [text[row] for row in self.first] for name, text in columns.texts.items()}
        self.run, self.sensor = texts["run"], texts["sensor"]
        self.plane, self.kept = texts["trial_plane"], texts["trial_kept"]
        self.planes: list[str] = []
        self.unused: list[Trial] = []
        """Trial runs that stored coefficients stand for: what they leave on the rotor counts."""

    def group(self) -> Group:
        """Read them; a reading is named by its place in the layout."""
        by_run: dict[str, list[int]] = {}
        for i, run in enumerate(self.run):
            by_run.setdefault(run, []).append(i)
        # with runs to spare all of them are fitted together
        initial, trials, lacking = self._initial_and_trials(by_run)
        channels, cells = self._channels(by_run[initial])
        readings = [cells]
        for trial in trials:
            try:
                readings.append(self._match(trial.run, initial, by_run[trial.run], channels))
            except DataError as error:
                raise lacking(str(error)) from None
        means = self._means(self.columns.vibration, readings)
        on = self._on(trials, phasor)
        last = list(by_run)[-1]
        put = self._on(self.unused, phasor) if self.unused else on
        if last == initial:
            put = put[:, :0]

        def errors() -> tuple[Real, Real, Real]:
            of_means = self._means(self._reading_errors(), readings)
            return of_means[:, 0], of_means[:, 1:], self._on(trials, vector_error).real

        group = Group(
            self.rotors,
            channels,
            self.planes,
            trials,
            means[:, 0].copy(),
            means[:, 1:].copy(),
            on,
            put[:, -1] if put.shape[1] else np.zeros((len(self.rotors), len(self.planes)), dtype=complex),
            [last] * len(self.rotors),
            self._weights(cells),
            np.array([[len(members) for members in of_run] for of_run in readings]),
            self._scatter(means, readings),
            errors,
        )
        self._contradictions(group, readings)
        return group

    def _initial_and_trials(self, by_run: dict[str, list[int]]) -> tuple[str, list[Trial], type[DataError]]:
        """Tell the initial run from those with trial masses; and what a run is that lacks, or is one too many."""
        stored, file = self.columns.stored, self.table.file
        trials: list[Trial] = []
        initial: str | None = None
        standing = False
        again: DataError | None = None
        for run, members in by_run.items():
            trial = self._trial(run, members)
            if trial is not None:
                trials.append(trial)
                standing = standing or trial.kept
            elif standing:
                trials.append(Trial(run, [], False))
            elif initial is None:
                initial = run
            elif stored:
                raise DataError(
                    f"{file}: {self.of}runs {quote(initial)} and {quote(run)} both have no trial mass: "
                    "expected one run, for --influence gives the coefficients"
                )
            else:
                expected = f"a trial mass in run {run}, for run {initial} is the initial one already"
                again = again or self._wrong(members[0], "trial_plane", "", expected)
        lacking = NotOneInitialRun if len(by_run) > 1 + len(self.planes) > 1 else DataError
        if again is not None:
            raise lacking(str(again))
        if initial is None:
            raise NotOneInitialRun(
                f"{file}: {self.of}every run has a trial mass: expected an initial run with trial_plane, "
                "trial_mass and trial_angle empty"
            )
        if stored and trials:
            self.runs.warnings.append(
                f"{self.of}--influence gives the coefficients: the trial runs are not used"
            )
            if self.columns.size is None:
                self.runs.warnings.append(
                    f"{self.of}the stored coefficients are per {self.runs.per}, and the runs have other masses: what is on the "
                    "rotor in its last run is not known, and the trim leaves it out"
                )
            self.unused, trials = trials, []
        elif not trials and not stored:
            raise DataError(
                f"{file}: {self.of}no trial run: expected a run with a trial mass for every plane, "
                "or stored coefficients by --influence"
            )
        return initial, trials, lacking

    def _wrong(self, member: int, column: str, found: str, expected: str) -> DataError:
        return self.table.error(self.first[member], column, found, expected)

    def _trial(self, run: str, members: Sequence[int]) -> Trial | None:
        """Return the run's trial masses, None for a run without."""
        size = self.columns.size
        for i in members:
            if self.kept[i].lower() not in (*YES, *NO):
                raise self._wrong(i, "trial_kept", self.kept[i], "yes or no")
        kept = any(self.kept[i].lower() in YES for i in members)
        told = [i for i in members if self.plane[i]]
        if not told:
            if size is not None and (on := [i for i in members if size.values[self.first[i]]]):
                raise self._wrong(on[0], "trial_plane", "", "the plane of the trial mass")
            if kept:
                expected = f"the trial mass that is kept after run {run}"
                raise self._wrong(members[0], "trial_plane", "", expected)
            return None
        plane = self.plane[told[0]]
        for i in told:
            if self.plane[i] != plane:
                raise self._wrong(
                    i,
                    "trial_plane",
                    self.plane[i],
                    f"{quote(plane)} as elsewhere in run {run}; several masses in one run are "
                    f"joined by ';' ({plane};{self.plane[i]})",
                )
        if size is None:
            return Trial(run, [], kept)
        names = [name.strip() for name in plane.split(";")]
        if "" in names:
            raise self._wrong(told[0], "trial_plane", plane, "a plane's name before and after each ';'")
        # the row that states the mass: the others may leave it out
        stated = next((i for i in told if size.values[self.first[i]]), told[0])
        for i in told:
            for cells in (size, self.table.cells.get("trial_angle")):
                if cells is not None:
                    cell, other = (cells.values[self.first[k]] for k in (stated, i))
                    if other not in ("", cell):
                        raise self._wrong(i, cells.header, other, f"{quote(cell)} as elsewhere in run {run}")
        self.planes += [name for name in dict.fromkeys(names) if name not in self.planes]
        masses = [(self.planes.index(name), stated, place) for place, name in enumerate(names)]
        return Trial(run, masses, kept)

    def _channels(self, members: Sequence[int]) -> tuple[list[Channel], list[list[int]]]:
        """Return the channels of the initial run, and the readings of each."""
        places: dict[tuple[str, float | None], list[int]] = {}
        for i in members:
            speed = float(self.columns.speed_given[self.first[i]])
            places.setdefault((self.sensor[i], None if speed != speed else speed), []).append(i)
        channels = [
            Channel(sensor, None if given is None else float(self.columns.speed[self.first[mine[0]]]), given)
            for (sensor, given), mine in places.items()
        ]
        cells = list(places.values())
        self._say_repeated(channels, cells)
        return channels, cells

    def _match(
        self, run: str, initial: str, members: Sequence[int], channels: Sequence[Channel]
    ) -> list[list[int]]:
        """Return the readings of a trial run that belong to each channel of the initial run."""
        found: list[list[int]] = [[] for _ in channels]
        for i in members:
            name, speed = self.sensor[i], float(self.columns.speed_given[self.first[i]])
            same = [s for s, channel in enumerate(channels) if channel.sensor == name]
            # the speed of a run is never quite that of another: the nearest is meant
            off = [apart(channels[s].speed_given, speed) for s in same]
            nearest = min(range(len(same)), key=off.__getitem__, default=None)
            if nearest is None or (off[nearest] > NEAR_SPEED and len(same) > 1):
                what = name if speed != speed else f"{name} at {speed:g}"
                known = ", ".join(map(str, channels))
                raise self._wrong(i, "sensor", what, f"a sensor and speed of the initial run ({known})")
            found[same[nearest]].append(i)
            if off[nearest] > 0.01:
                self.runs.warnings.append(
                    f"{self.of}run {run} ran at {speed:g}, the initial run at {channels[same[nearest]].speed_given or 0:g}: "
                    "coefficients hold at one speed"
                )
        if not all(found):
            lacking = channels[found.index([])]
            raise DataError(
                f"{self.table.file}: {self.of}run {quote(run)} has no reading of sensor {lacking}, which the initial run "
                f"{quote(initial)} has"
            )
        self._say_repeated(channels, found)
        return found

    def _say_repeated(self, channels: Sequence[Channel], cells: Sequence[Sequence[int]]) -> None:
        self.runs.warnings += [
            f"{self.of}sensor {channel.sensor} was read {len(mine)} times in one run: the mean is taken (as vectors)"
            for channel, mine in zip(channels, cells, strict=True)
            if len(mine) > 1
        ]

    def _means(self, of_rows: NDArray[Value], readings: Sequence[Sequence[list[int]]]) -> NDArray[Value]:
        """Return the means over repeats of what each row has, (g, 1 + r, s)."""
        means = np.empty((len(self.rotors), len(readings), len(readings[0])), dtype=of_rows.dtype)
        for j, s, members in _each(readings):
            means[:, j, s] = of_rows[self.rows[:, members]].mean(axis=1)
        return means

    def _scatter(self, means: Complex, readings: Sequence[Sequence[list[int]]]) -> Real:
        """Return Σ|reading - mean|² of the repeats, (g, 1 + r, s)."""
        scatter = np.zeros(means.shape)
        for j, s, members in _each(readings):
            off = np.abs(self.columns.vibration[self.rows[:, members]] - means[:, j, s, None])
            scatter[:, j, s] = np.square(off).sum(axis=1)
        return scatter

    def _weights(self, cells: Sequence[list[int]]) -> Real | None:
        """Return the weights of the channels, (g, s): those that stand in their first rows."""
        given = self.table.numbers.get("weight")
        if given is None:
            return None
        weights = given.values[self.rows[:, [members[0] for members in cells]]]
        weights = np.where(np.isnan(weights), 1.0, weights)
        if not (weights > 0).any(axis=1).all():
            raise DataError(
                f"{self.table.file}: {self.of}all weights are zero: expected one that is positive"
            )
        return weights

    def _reading_errors(self) -> Real:
        """Bound the error of each row's reading, and of its share in a mean."""
        size = self.table.numbers["amplitude"].values
        phase = self.table.numbers.get("phase")
        error = vector_error(size, phase.values, phase.unit) if phase is not None else EPS * size
        return np.asarray(error + self.rows.shape[1] * EPS / 2 * size)

    def _contradictions(self, group: Group, readings: Sequence[Sequence[list[int]]]) -> None:
        """Say which repeats contradict each other, with their figures."""
        found = np.argwhere(group.contradictory & (group.counts > 1))
        size, phase = self.table.numbers["amplitude"], self.table.numbers.get("phase")
        for i, j, s in found[:SHOWN].tolist():
            members = self.rows[i, readings[j][s]].tolist()
            figures = [f"{size.values[row]:g} {size.unit}" for row in members[:SHOWN]]
            if phase is not None:
                angle = "°" if phase.unit == "deg" else " rad"
                figures = [
                    f"{figure} at {phase.values[row]:g}{angle}"
                    for figure, row in zip(figures, members, strict=False)
                ]
            more = f" and {len(members) - SHOWN} more" if len(members) > SHOWN else ""
            mean = group.initial[i, s] if j == 0 else group.runs[i, j - 1, s]
            self.runs.warnings.append(
                f"{self.runs.of(group.rotors[i])}run {self.columns.texts['run'][members[0]]}: sensor {group.channels[s]} was read "
                f"{len(members)} times, and the readings contradict each other: {', '.join(figures)}{more}; their mean "
                f"has the size {abs(mean):.4g}: read again, or leave out what is wrong"
            )
        if len(found) > SHOWN:
            self.runs.warnings.append(
                f"… and {len(found) - SHOWN} further readings that contradict each other"
            )

    def _on(self, trials: Sequence[Trial], of: Callable[[Real, Real, str], Real | Complex]) -> Complex:
        """Return what was on the rotor in each run, (g, r, p): the vectors, SI, or their errors."""
        on = np.zeros((len(self.rotors), len(trials), len(self.planes)), dtype=complex)
        standing = np.zeros((len(self.rotors), len(self.planes)), dtype=complex)
        for j, trial in enumerate(trials):
            for plane, member, place in trial.masses:
                on[:, j, plane] += of(*self._mass(self.rows[:, member], place))
            on[:, j] += standing
            if trial.kept:
                standing = on[:, j].copy()
        return on

    def _mass(self, rows: Rows, place: int) -> tuple[Real, Real, str]:
        """Return the sizes (g,), SI, and the angles with their unit of the masses at one place of the cells in these rows."""
        size, angle = self.columns.size, self.table.cells.get("trial_angle")
        assert size is not None
        if angle is None:
            raise DataError(f"{self.table.file}: no column trial_angle_deg {self.table.told}")
        sizes = self._numbers(size, rows, place, "a trial mass, positive")
        turn = self._numbers(angle, rows, place, "the angle of the trial mass")
        if not (sizes >= SMALLEST).all():
            row = int(rows[int(np.argmin(sizes >= SMALLEST))])
            raise self.table.error(row, size.header, size.values[row], "a positive trial mass")
        return np.asarray(to_si(sizes, self.runs.per, size.unit)), turn, angle.unit

    def _numbers(self, cells: Cells, rows: Rows, place: int, expected: str) -> Real:
        """Return the numbers that stand at one place of these cells; planes are named alike in all these rows."""
        names = self.columns.texts["trial_plane"][rows[0]].count(";") + 1
        if names == 1 and cells.parsed is not None:
            whole = cells.parsed[rows]
            if (np.abs(whole) <= LARGEST).all():
                return whole
        values = np.empty(len(rows))
        for i, row in enumerate(rows.tolist()):
            text = cells.values[row]
            parts = text.split(";") if ";" in text or place else [text]
            try:
                if len(parts) != names:
                    raise ValueError
                values[i] = cells.number(parts[place])
            except ValueError:
                many = f", {names} joined by ';' as in trial_plane" if names > 1 else ""
                many += ", with a decimal comma as elsewhere in the file" if cells.decimal_comma else ""
                raise self.table.error(row, cells.header, text, expected + many) from None
        return values


def _each(readings: Sequence[Sequence[list[int]]]) -> Iterator[tuple[int, int, list[int]]]:
    """Yield of each run and channel its number and the readings."""
    return ((j, s, members) for j, cells in enumerate(readings) for s, members in enumerate(cells))
