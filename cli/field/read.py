"""From a table of runs to arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cli.errors import DataError, quote
from cli.field.runs import Channel, Complex, Group, Real, Rows, Runs, Trial, alike, apart
from cli.read.tables import Cells, Table, read
from cli.read.units import LARGEST, SMALLEST, UNITS, phasor, to_si

YES = ("yes", "y", "true", "1", "kept", "on")
SHOWN = 5  # of so many contradictions the figures are shown
NEAR_SPEED = 0.05  # among several speeds one is recognised within this share
OF_LOGS = ("date", "ref", "use")  # columns that count where all runs are fitted
NO = ("no", "n", "false", "0", "", "removed", "off")


def runs_table(path: str) -> Table:
    """Read a file as a table of runs."""
    return read(
        path,
        numbers={"speed": "speed", "amplitude": "amplitude", "phase": "angle", "weight": "number"},
        texts=["rotor", "run", "sensor", "trial_plane", "trial_kept", *OF_LOGS],
        cells={"trial_mass": "mass", "trial_unbalance": "unbalance", "trial_angle": "angle"},
        blank=["speed", "weight", "amplitude", "phase"],
    )


def read_runs(table: Table, *, lagging: bool, phaseless: bool, stored_unit: str | None) -> Runs:
    """Read a table of runs; `stored_unit` is the unit of stored coefficients that stand for the trials."""
    for name in OF_LOGS:
        if name in table.texts:
            table.warnings.append(f"{table.file}: ignored the column {name}")
    amplitude = table.require("amplitude", "amplitude")
    table.reject(np.isnan(amplitude.values), "amplitude", "a number")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    if phaseless:
        vibration = amplitude.values.astype(complex)
    else:
        phase = table.require("phase", "angle")
        table.reject(np.isnan(phase.values), "phase", "a number")
        vibration = phasor(amplitude.values, -phase.values if lagging else phase.values, phase.unit)
    if "weight" in table.numbers:
        table.reject(table.numbers["weight"].values < 0, "weight", "a weight that is not negative")
    both = [name for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if len(both) > 1:
        raise DataError(
            f"{table.file}: mixed columns {' and '.join(table.cells[n].header for n in both)}: expected one"
        )
    if not both and stored_unit is None:
        raise DataError(
            f"{table.file}: no column trial_mass_kg (or trial_mass_g, trial_unbalance_g_mm …): expected trial masses, "
            f"or stored coefficients by --influence {table.told}"
        )
    size = table.cells[both[0]] if both else None
    names, rotor = table.numbered("rotor", "1")
    unit = stored_unit or (size.unit if size else "kg")
    runs = Runs(
        table,
        names,
        [],
        amplitude.unit,
        "mass" if unit in UNITS["mass"] else "unbalance",
        unit,
        table.numbers["speed"].unit if "speed" in table.numbers else "rpm",
    )
    reader = _Reader(runs, vibration, None if stored_unit else size)
    for rotors, rows in alike(table, rotor):
        runs.groups.append(reader.group(rotors, rows))
    runs.warnings = [*table.warnings, *reader.warnings]
    return runs


class NotOneInitialRun(DataError):
    """A table of runs with no initial run, with several, or with readings that lack: all runs have to be fitted together."""


class _Reader:
    """Reads the groups; the first rotor of each tells how it was measured."""

    def __init__(self, runs: Runs, vibration: Complex, size: Cells | None) -> None:
        self.runs, self.table, self.vibration, self.size = runs, runs.table, vibration, size
        self.warnings: list[str] = []
        self.stored = size is None
        texts = self.table.texts
        blank = [""] * self.table.rows
        if "sensor" not in texts:
            texts["sensor"] = ["1"] * self.table.rows
        self.sensor = texts["sensor"]
        self.run = texts.get("run") or []
        if not self.run and self.stored:
            self.run = ["initial"] * self.table.rows
        if not self.run:
            raise DataError(f"{self.table.file}: no column run {self.table.told}")
        masses = next(
            (self.table.cells[n] for n in ("trial_mass", "trial_unbalance") if n in self.table.cells), None
        )
        self.plane = texts.get("trial_plane") or (
            ["1" if cell else "" for cell in masses.values] if masses is not None else blank
        )
        self.kept = texts.get("trial_kept") or blank
        speed = self.table.numbers.get("speed")
        self.speed_given = speed.values if speed is not None else np.full(self.table.rows, np.nan)
        self.speed = to_si(self.speed_given, "speed", speed.unit) if speed is not None else self.speed_given

    def _of(self, rotors: Rows) -> str:
        return f"rotor {self.runs.rotors[rotors[0]]}: " if len(self.runs.rotors) > 1 else ""

    def group(self, rotors: Rows, rows: Rows) -> Group:
        """Read rotors whose rows (g, n) are laid out alike."""
        first = rows[0].tolist()
        of = self._of(rotors)
        by_run: dict[str, list[int]] = {}
        for i, row in enumerate(first):
            by_run.setdefault(self.run[row], []).append(i)
        planes: list[str] = []
        trials: list[Trial] = []
        initial: str | None = None
        standing = False
        again: DataError | None = None
        for run, members in by_run.items():
            trial = self._trial(run, members, first, planes)
            if trial is None and initial is None and not standing:
                initial = run
            elif trial is None and standing:
                trials.append(Trial(run, [], False))
            elif trial is None:
                if self.stored:
                    raise DataError(
                        f"{self.table.file}: {of}runs {quote(initial or '')} and {quote(run)} both have no trial mass: "
                        "expected one run, for --influence gives the coefficients"
                    )
                again = again or self.table.error(
                    first[members[0]],
                    "trial_plane",
                    "",
                    f"a trial mass in run {run}, for run {initial} is the initial one already",
                )
            else:
                trials.append(trial)
                standing = standing or trial.kept
        # with runs to spare all of them are fitted together
        lacking = NotOneInitialRun if len(by_run) > 1 + len(planes) > 1 else DataError
        if again is not None:
            raise lacking(str(again))
        if initial is None:
            raise NotOneInitialRun(
                f"{self.table.file}: {of}every run has a trial mass: expected an initial run with trial_plane, "
                "trial_mass and trial_angle empty"
            )
        if self.stored and trials:
            self._warn(f"{of}--influence gives the coefficients: the trial runs are not used")
            trials = []
        elif not trials and not self.stored:
            raise DataError(
                f"{self.table.file}: {of}no trial run: expected a run with a trial mass for every plane, "
                "or stored coefficients by --influence"
            )
        channels, places = self._channels(by_run[initial], first, of)
        matches = []
        runs = np.empty((len(rotors), len(trials), len(channels)), dtype=complex)
        for j, trial in enumerate(trials):
            try:
                mine = self._match(trial.run, initial, by_run[trial.run], first, channels, of)
            except DataError as error:
                raise lacking(str(error)) from None
            matches.append(mine)
            for s, members in enumerate(mine):
                runs[:, j, s] = self.vibration[rows[:, members]].mean(axis=1)
        vibration = np.empty((len(rotors), len(channels)), dtype=complex)
        for s, members in enumerate(places):
            vibration[:, s] = self.vibration[rows[:, members]].mean(axis=1)
        added = np.zeros((len(rotors), len(trials), len(planes)), dtype=complex)
        on = added.copy()
        standing_masses = np.zeros((len(rotors), len(planes)), dtype=complex)
        base, last = [], -1
        for j, trial in enumerate(trials):
            for plane, member, place in trial.masses:
                added[:, j, plane] += self._masses(rows[:, member], place)
            on[:, j] = standing_masses + added[:, j]
            base.append(last)
            if trial.kept:
                standing_masses, last = on[:, j].copy(), j
        weights = None
        if "weight" in self.table.numbers:
            given = np.stack(
                [self.table.numbers["weight"].values[rows[:, members[0]]] for members in places], axis=1
            )
            weights = np.where(np.isnan(given), 1.0, given)
            if not (weights > 0).any(axis=1).all():
                raise DataError(f"{self.table.file}: {of}all weights are zero: expected one that is positive")

        def errors() -> tuple[Real, Real, Real]:
            of_rows = self._vibration_error(rows)
            of_runs = np.zeros(runs.shape)
            for j, mine in enumerate(matches):
                of_runs[:, j] = np.stack([of_rows[:, members].mean(axis=1) for members in mine], axis=1)
            of_initial = np.stack([of_rows[:, members].mean(axis=1) for members in places], axis=1)
            return of_initial, of_runs, self._mass_error(rows, trials, on.shape)

        scatter = np.zeros((len(rotors), 1 + len(trials), len(channels)))
        for j, cells in enumerate((places, *matches)):
            means = vibration if j == 0 else runs[:, j - 1]
            for s, members in enumerate(cells):
                apart_by = np.abs(self.vibration[rows[:, members]] - means[:, s, None])
                scatter[:, j, s] = np.square(apart_by).sum(axis=1)
        group = Group(
            rotors,
            channels,
            planes,
            trials,
            vibration,
            runs,
            on,
            added,
            standing_masses,
            base,
            weights,
            np.array([[len(members) for members in cells] for cells in (places, *matches)]),
            scatter,
            errors,
            initial,
        )
        self._contradictions(group, rows, (places, *matches))
        return group

    def _contradictions(self, group: Group, rows: Rows, cells: Sequence[list[list[int]]]) -> None:
        """Say which repeats contradict each other, with their figures."""
        found = np.argwhere(group.contradictory & (group.counts > 1))
        size, phase = self.table.numbers["amplitude"], self.table.numbers.get("phase")
        for i, j, s in found[:SHOWN].tolist():
            members = rows[i, cells[j][s]].tolist()
            figures = [f"{size.values[row]:g} {size.unit}" for row in members]
            if phase is not None:
                angle = "°" if phase.unit == "deg" else " rad"
                figures = [
                    f"{figure} at {phase.values[row]:g}{angle}"
                    for figure, row in zip(figures, members, strict=True)
                ]
            more = f" and {len(figures) - SHOWN} more" if len(figures) > SHOWN else ""
            mean = group.initial[i, s] if j == 0 else group.runs[i, j - 1, s]
            self._warn(
                f"{self._of(group.rotors[i:])}run {self.run[members[0]]}: sensor {group.channels[s]} was read {len(members)} "
                f"times, and the readings contradict each other: {', '.join(figures[:SHOWN])}{more}; their mean "
                f"has the size {abs(mean):.4g}: read again, or leave out what is wrong"
            )
        if len(found) > SHOWN:
            self._warn(f"… and {len(found) - SHOWN} further readings that contradict each other")

    def _vibration_error(self, rows: Rows) -> Real:
        """Bound the errors of readings and of their share in a mean, (g, n)."""
        from cli.read.rounding import EPS, vector_error

        size = self.table.numbers["amplitude"].values
        phase = self.table.numbers.get("phase")
        error = vector_error(size, phase.values, phase.unit) if phase is not None else EPS * size
        return np.asarray((error + rows.shape[1] * EPS / 2 * size)[rows])

    def _mass_error(self, rows: Rows, trials: list[Trial], shape: tuple[int, ...]) -> Real:
        """Bound the errors of what was on the rotor in each run, (g, r, p)."""
        from cli.read.rounding import vector_error

        error = np.zeros(shape)
        standing = np.zeros((shape[0], shape[2]))
        for j, trial in enumerate(trials):
            error[:, j] = standing
            for plane, member, place in trial.masses:
                size, turn, unit = self._mass(rows[:, member], place)
                error[:, j, plane] += vector_error(size, turn, unit)
            if trial.kept:
                standing = error[:, j].copy()
        return error

    def _warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)

    def _trial(
        self, run: str, members: Sequence[int], rows: Sequence[int], planes: list[str]
    ) -> Trial | None:
        """Return the run's trial masses, None for a run without."""
        told = [i for i in members if self.plane[rows[i]]]
        kept = [self.kept[rows[i]].lower() for i in members]
        for i, word in zip(members, kept, strict=True):
            if word not in (*YES, *NO):
                raise self.table.error(rows[i], "trial_kept", self.kept[rows[i]], "yes or no")
        is_kept = any(word in YES for word in kept)
        if not told:
            if self.size is not None:
                for i in members:
                    if self.size.values[rows[i]]:
                        raise self.table.error(rows[i], "trial_plane", "", "the plane of the trial mass")
            if is_kept:
                raise self.table.error(
                    rows[members[0]], "trial_plane", "", f"the trial mass that is kept after run {run}"
                )
            return None
        for i in told:
            if self.plane[rows[i]] != self.plane[rows[told[0]]]:
                raise self.table.error(
                    rows[i],
                    "trial_plane",
                    self.plane[rows[i]],
                    f"{quote(self.plane[rows[told[0]]])} as elsewhere in run {run}; several masses in one run are "
                    f"joined by ';' ({self.plane[rows[told[0]]]};{self.plane[rows[i]]})",
                )
        if self.stored:
            return Trial(run, [], is_kept)
        assert self.size is not None
        i = next((i for i in told if self.size.values[rows[i]]), told[0])
        names = [name.strip() for name in self.plane[rows[i]].split(";")]
        if "" in names:
            raise self.table.error(
                rows[i], "trial_plane", self.plane[rows[i]], "a plane's name before and after each ';'"
            )
        for other in told:
            for cells in (self.size, self.table.cells.get("trial_angle")):
                if cells is not None and cells.values[rows[other]] not in ("", cells.values[rows[i]]):
                    raise self.table.error(
                        rows[other],
                        cells.header,
                        cells.values[rows[other]],
                        f"{quote(cells.values[rows[i]])} as elsewhere in run {run}",
                    )
        masses = []
        for place, name in enumerate(names):
            if name not in planes:
                planes.append(name)
            masses.append((planes.index(name), i, place))
        return Trial(run, masses, is_kept)

    def _masses(self, rows: Rows, place: int) -> Complex:
        """Return the masses (g,) that stand at one place of the cells in these rows, SI."""
        return phasor(*self._mass(rows, place))

    def _mass(self, rows: Rows, place: int) -> tuple[Real, Real, str]:
        """Return the sizes (g,), SI, and the angles of these masses with their unit."""
        assert self.size is not None
        angle = self.table.cells.get("trial_angle")
        if angle is None:
            raise DataError(f"{self.table.file}: no column trial_angle_deg {self.table.told}")
        size = self._numbers(self.size, rows, place, "a trial mass, positive")
        turn = self._numbers(angle, rows, place, "the angle of the trial mass")
        if not (size >= SMALLEST).all():
            row = int(rows[int(np.argmin(size >= SMALLEST))])
            raise self.table.error(row, self.size.header, self.size.values[row], "a positive trial mass")
        return np.asarray(to_si(size, self.runs.per, self.size.unit)), turn, angle.unit

    def _numbers(self, cells: Cells, rows: Rows, place: int, expected: str) -> Real:
        # planes are named alike in all these rows
        names = self.plane[rows[0]].count(";") + 1
        if names == 1 and cells.parsed is not None:
            whole = cells.parsed[rows]
            if (np.abs(whole) <= LARGEST).all():
                return whole
        texts = [cells.values[row] for row in rows.tolist()]
        values = np.empty(len(rows))
        for i, (row, text) in enumerate(zip(rows.tolist(), texts, strict=True)):
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

    def _channels(
        self, members: Sequence[int], rows: Sequence[int], of: str
    ) -> tuple[list[Channel], list[list[int]]]:
        places: dict[tuple[str, float | None], list[int]] = {}
        for i in members:
            speed = float(self.speed_given[rows[i]])
            places.setdefault((self.sensor[rows[i]], None if speed != speed else speed), []).append(i)
        channels = []
        for (sensor, given), mine in places.items():
            channels.append(
                Channel(sensor, None if given is None else float(self.speed[rows[mine[0]]]), given)
            )
            if len(mine) > 1:
                self._warn(
                    f"{of}sensor {sensor} was read {len(mine)} times in one run: the mean is taken (as vectors)"
                )
        return channels, list(places.values())

    def _match(
        self,
        run: str,
        initial: str,
        members: Sequence[int],
        rows: Sequence[int],
        channels: list[Channel],
        of: str,
    ) -> list[list[int]]:
        """Return the rows of a trial run that belong to each channel of the initial run."""
        found: list[list[int]] = [[] for _ in channels]
        for i in members:
            name, speed = self.sensor[rows[i]], float(self.speed_given[rows[i]])
            same = [s for s, channel in enumerate(channels) if channel.sensor == name]
            # the speed of a run is never quite that of another: the nearest is meant
            off = [apart(channels[s].speed_given, speed) for s in same]
            nearest = min(range(len(same)), key=off.__getitem__, default=None)
            if nearest is None or (off[nearest] > NEAR_SPEED and len(same) > 1):
                what = name if speed != speed else f"{name} at {speed:g}"
                raise self.table.error(
                    rows[i],
                    "sensor",
                    what,
                    f"a sensor and speed of the initial run ({', '.join(map(str, channels))})",
                )
            found[same[nearest]].append(i)
            if off[nearest] > 0.01:
                self._warn(
                    f"{of}run {run} ran at {speed:g}, the initial run at {channels[same[nearest]].speed_given or 0:g}: "
                    "coefficients hold at one speed"
                )
        for channel, mine in zip(channels, found, strict=True):
            if not mine:
                raise DataError(
                    f"{self.table.file}: {of}run {quote(run)} has no reading of sensor {channel}, which the initial run "
                    f"{quote(initial)} has"
                )
            if len(mine) > 1:
                self._warn(
                    f"{of}sensor {channel.sensor} was read {len(mine)} times in one run: the mean is taken (as vectors)"
                )
        return found
