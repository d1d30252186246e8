"""Measured runs as people keep them: a table or a log to rows, with the masses that were on and what each row reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from cli.field.channels import OfInitialRun, near_speeds
from cli.field.groups import read_groups
from cli.field.layouts import Layout, alpha_of, is_log, log_table, runs_table
from cli.field.request import Request
from cli.field.rows import YEAR, NoInitialRun, Sorted, numbered, years
from cli.field.runs import YES, LogRows, Masses, Real, Rows, Runs
from cli.field.stored import Sisters, Stored, read_runout, read_stored, stored_alpha
from cli.read import options
from cli.read.rounding import EPS, vector_error
from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.table import Cells, Table
from dalembert.units import LARGEST, SMALLEST, UNITS, to_si

Flags = NDArray[np.bool_]

OF_LOGS = ("date", "ref", "use")  # columns that count where all runs are fitted


def read_measured(
    path: str, request: Request, influence: Sequence[str], runout: str | None
) -> tuple[Runs, Stored | None]:
    """Read the runs, and the stored coefficients that stand for trial runs."""
    files = [read_stored(file) for file in influence]
    requests = {name: getattr(request, name) for name in ("fit", "exclude", "predict", "suggest", "robust")}
    if request.four_run:
        options.refuse("fits all runs: it does not go with --method four-run", **requests)
    log = not request.four_run and is_log(path)
    fitted = log or any(requests.values()) or len(files) > 1 or any(one.along is not None for one in files)
    fitted = fitted and not request.four_run
    if fitted and not files and (own := alpha_of(path)) is not None and not own.trials:
        files = [stored_alpha(own)]
    layout = log_table(path) if fitted else Layout(runs_table(path))
    fitted = fitted or (not (files or request.four_run) and more_than_unknowns(layout.table))
    try:
        runs = _Reading(layout, request, files, fitted).runs()
    except NoInitialRun:
        if files or request.four_run:
            raise
        # none of the runs is the initial one: its vibration is an unknown of the fit
        fitted = True
        runs = _Reading(layout, request, files, fitted).runs()
    for one in files:
        runs.warnings += one.table.warnings
    lags = request.against or runs.lags
    if runout is not None:
        runs.runout = read_runout(runout, runs, lagging=lags)
    elif lags:
        runs.runout = {sensor: vector.conjugate() for sensor, vector in runs.runout.items()}
    return runs, None if fitted or not files else files[0]


def more_than_unknowns(table: Table) -> bool:
    """Tell whether a rotor has more runs than unknowns: the initial vibration and a coefficient of each plane."""
    sizes = [table.cells[name] for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if "run" not in table.texts or len(sizes) != 1:
        return False
    _, rotor = table.numbered("rotor", "1")
    _, run = table.numbered("run")
    names, plane = table.numbered("trial_plane")
    if "trial_plane" not in table.texts:
        names, plane = ["", "1"], np.array([bool(cell) for cell in sizes[0].values]).astype(np.intp)
    planes: dict[str, int] = {}
    each = [
        [planes.setdefault(part.strip(), len(planes)) for part in name.split(";") if part.strip()]
        for name in names
    ]

    def count(codes: Rows, of: Rows) -> Rows:
        """Count what differs, rotor by rotor."""
        many = int(codes.max(initial=0)) + 1
        # with indices: without them numpy loads its masked arrays, which takes longer than a small table
        each, _ = np.unique(of * many + codes, return_index=True)
        return np.bincount(each // many, minlength=int(rotor.max()) + 1)

    most = max(map(len, each))
    several = np.array([one + one[-1:] * (most - len(one)) if one else [-1] * most for one in each])[plane]
    loaded = several[:, 0] >= 0 if most else np.zeros(table.rows, dtype=bool)
    if not loaded.any():
        return False
    unknowns = count(several[loaded].ravel(), np.repeat(rotor[loaded], most))
    return bool(((count(run, rotor) > 1 + unknowns) & (unknowns > 0)).any())


class _Reading:
    """The rows of a table of runs: of a log that is fitted, or of an initial run and trial runs."""

    def __init__(self, layout: Layout, request: Request, files: Sequence[Stored], fitted: bool) -> None:
        self.layout, self.table, self.request, self.fitted = layout, layout.table, request, fitted
        self.amplitude = self.table.require("amplitude", "amplitude")
        self.stored = files[0] if files and not fitted else None
        self.sisters = Sisters(files) if files and fitted else None
        sizes = [
            self.table.cells[name] for name in ("trial_mass", "trial_unbalance") if name in self.table.cells
        ]
        if len(sizes) > 1:
            raise DataError(
                f"{self.table.file}: mixed columns {' and '.join(size.header for size in sizes)}: expected one"
            )
        if not sizes and not files:
            raise DataError(
                f"{self.table.file}: no column trial_mass_kg (or trial_mass_g, trial_unbalance_g_mm …): expected trial masses, "
                f"or stored coefficients by --influence {self.table.told}"
            )
        known = self.stored.unit if self.stored else self.sisters.unit if self.sisters else "kg"
        self.size = sizes[0] if sizes else Cells("", known, [""] * self.table.rows)
        self.names, self.rotor = self.table.numbered("rotor", "1")
        unit = known if self.stored else self.size.unit
        self.read = Runs(self.table, self.names, unit, fitted, max_mass=layout.max_mass, runout=layout.runout)
        if self.sisters is not None and self.sisters.unit not in UNITS[self.read.per]:
            raise DataError(
                f"{self.table.file}: the runs have a {self.read.per}, the stored coefficients are per {self.sisters.unit}"
            )

    def runs(self) -> Runs:
        """Read the rows, and lay rotors of like shape side by side."""
        table, request, runs = self.table, self.request, self.read
        vibration, share = self._vibration()
        when = None
        if self.fitted:
            when = years(table)
            if "use" in table.texts:
                table.warnings.append(
                    f"{table.file}: the column use is the keeper's own mark: every row takes part in the fit"
                )
        else:
            for name in OF_LOGS:
                if name in table.texts:
                    table.warnings.append(f"{table.file}: ignored the column {name}")
        run_names, run = table.numbered("run", "initial")
        named, loaded = self._told(run_names, run)
        masses, mass_share = self._masses(loaded)
        if self.fitted:
            if "ref" in table.texts:
                masses = Masses.of(_on_top(table, self.rotor, masses.by_row()))
            channels, channel = near_speeds(table, self.rotor)
            if "run" not in table.texts:
                run_names, run = _run_names(self.rotor, channel, when, masses)
            for name in request.exclude:
                if name not in run_names:
                    raise options.bad("--exclude", f"no run {quote(name)} in {table.file}")
        rows = LogRows(runs, self.rotor, vibration, masses, named, run, run_names, when, share, mass_share)
        rows_of = Sorted(rows, request.exclude)
        if not self.fitted:
            rows_of.find_initial(self.stored is not None)
            channels, channel = OfInitialRun(table, self.rotor, runs, rows_of.is_initial).channels()
        rows.channels, rows.channel = channels, channel
        read_groups(rows_of, request, self.sisters, self.stored is not None)
        runs.warnings = [*table.warnings, *runs.warnings]
        return runs

    def _vibration(self) -> tuple[NDArray[np.complex128], float]:
        """Return what each row reads, NaN where it is blank, and by what share of it that may be off from its decimals."""
        table, request, amplitude = self.table, self.request, self.amplitude
        table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
        unread = np.isnan(amplitude.values)
        if "weight" in table.numbers:
            table.reject(table.numbers["weight"].values < 0, "weight", "a weight that is not negative")
        if request.four_run:
            table.reject(unread, "amplitude", "a number")
            return amplitude.values.astype(complex), EPS
        phase = table.require("phase", "angle")
        expected = "a number"
        if self.fitted:
            # a state that a run lacks may be a row with blank cells
            unread, expected = unread & np.isnan(phase.values), "a number, or amplitude and phase both blank"
        else:
            unread = np.zeros(table.rows, dtype=bool)
        for numbers, name in ((amplitude, "amplitude"), (phase, "phase")):
            table.reject(np.isnan(numbers.values) & ~unread, name, expected)
        turn = np.where(unread, 0.0, -phase.values if request.against else phase.values)
        vibration = np.where(unread, complex(np.nan), phasor(amplitude.values, turn, phase.unit))
        return vibration, float(vector_error(np.ones(table.rows), turn, phase.unit).max())

    # -- masses ----------------------------------------------------------------------------------------------

    def _told(self, run_names: list[str], run: Rows) -> tuple[Flags, Flags]:
        """Tell which rows name a plane, or a mass where there is but one; and which are to be read for their masses."""
        table, size = self.table, self.size
        loaded = np.array([bool(cell) for cell in size.values])
        planes, plane = table.numbered("trial_plane")
        if self.fitted:
            return loaded, loaded | np.array([bool(name) for name in planes])[plane]
        if "run" not in table.texts and self.stored is None:
            raise DataError(f"{table.file}: no column run {table.told}")
        named = np.array([bool(name) for name in planes])[plane] if "trial_plane" in table.texts else loaded
        of_run = numbered(self.rotor * len(run_names) + run)[0]
        self._kept(named, of_run, run_names, run)
        tried = np.isin(of_run, of_run[named])
        if (loose := loaded & ~tried).any():
            raise self._wrong(int(np.argmax(loose)), "trial_plane", "", "the plane of the trial mass")
        if size.unit not in UNITS[self.read.per]:
            # what stored coefficients of masses are for is no unbalance
            return named, np.zeros(table.rows, dtype=bool)
        first = _first_of_run(of_run, named)
        for i in np.flatnonzero(named & (plane != plane[first]))[:1].tolist():
            one = planes[plane[first[i]]]
            raise self._wrong(
                i,
                "trial_plane",
                planes[plane[i]],
                f"{quote(one)} as elsewhere in run {run_names[run[i]]}; several masses in one run are "
                f"joined by ';' ({one};{planes[plane[i]]})",
            )
        # the row that states the mass: the others may leave it out
        stated = _first_of_run(of_run, named & loaded)
        bare = named & (stated < 0)
        if bare.any():
            raise self._wrong(int(np.argmax(bare)), size.header, "", "a trial mass, positive")
        for cells in (size, table.cells.get("trial_angle")):
            if cells is None:
                continue
            code = _codes(cells.values)
            for i in np.flatnonzero(named & (code > 0) & (code != code[stated]))[:1].tolist():
                expected = f"{quote(cells.values[stated[i]])} as elsewhere in run {run_names[run[i]]}"
                raise self._wrong(i, cells.header, cells.values[i], expected)
        return named, named & (stated == np.arange(table.rows))

    def _kept(self, named: Flags, of_run: Rows, run_names: list[str], run: Rows) -> None:
        """Refuse a mark that a mass is kept where none was put on."""
        words, code = self.table.numbered("trial_kept")
        kept = np.array([word.lower() in YES for word in words])[code]
        for i in np.flatnonzero(kept & ~np.isin(of_run, of_run[named]))[:1].tolist():
            expected = f"the trial mass that is kept after run {run_names[run[i]]}"
            raise self._wrong(i, "trial_plane", "", expected)

    def _wrong(self, row: int, column: str, value: str, expected: str) -> DataError:
        return self.table.error(row, column, value, expected)

    def _masses(self, loaded: Flags) -> tuple[Masses, float]:
        """Read the masses of each row, several joined by ';', and by what share of it one may be off as it is rounded."""
        table, size, per = self.table, self.size, self.read.per
        angle = table.cells.get("trial_angle")
        if angle is None and not self.fitted and loaded.any():
            raise DataError(f"{table.file}: no column trial_angle_deg {table.told}")
        if not loaded.any():
            return Masses.of([None] * table.rows), 0.0
        names, code = table.numbered("trial_plane")
        planes: dict[str, int] = {}
        for name in names:
            for part in (name or "1").split(";"):
                planes.setdefault(part.strip(), len(planes))
        plane = np.array([planes.get(name or "1", -1) for name in names])[code]
        # one mass in a row, its numbers in order: all these rows together, and the others one by one
        plain = loaded & np.array([bool(cell) for cell in size.values])
        plain &= np.array([";" not in name for name in names])[code]
        sizes, angles = size.parsed, None if angle is None else angle.parsed
        if sizes is None or angles is None:
            plain[:] = False
            sizes = angles = np.zeros(table.rows)
        plain &= (
            (sizes >= (0 if self.fitted else SMALLEST)) & (sizes <= LARGEST) & (np.abs(angles) <= LARGEST)
        )
        others = [
            (i, planes[name], mass, turn)
            for i in np.flatnonzero(loaded & ~plain).tolist()
            for name, mass, turn in self._of_row(i, names[code[i]], angle)
        ]
        row, where, more, turns = (
            np.array(part) for part in (zip(*others, strict=True) if others else ((), (), (), ()))
        )
        row = np.concatenate([np.flatnonzero(plain), row.astype(np.intp)])
        where = np.concatenate([plane[plain], where.astype(np.intp)])
        around = np.concatenate([angles[plain], turns])
        unit = angle.unit if angle is not None else "deg"
        on = phasor(np.asarray(to_si(np.concatenate([sizes[plain], more]), per, size.unit)), around, unit)
        # several in one plane of a run are one
        _, first, entry = np.unique(row * max(len(planes), 1) + where, return_index=True, return_inverse=True)
        value = np.zeros(len(first), dtype=complex)
        np.add.at(value, entry, on)
        share = float(vector_error(np.ones(len(around)), around, unit).max(initial=0.0))
        says = np.array([bool(cell) for cell in size.values]) if self.fitted else loaded
        return Masses(list(planes), row[first], where[first], value, says), share

    def _of_row(self, i: int, name: str, angle: Cells | None) -> Iterator[tuple[str, float, float]]:
        """Yield plane, size and angle of each mass of a row, as the file has them."""
        size = self.size
        what = "mass" if self.fitted else "trial mass"
        cell, turn = size.values[i], "" if angle is None else angle.values[i]
        if not cell:
            raise self._wrong(i, size.header, cell, f"the mass in plane {name}")
        names = [part.strip() for part in name.split(";")] if name else ["1"]
        if "" in names:
            raise self._wrong(i, "trial_plane", name, "a plane's name before and after each ';'")
        parts, around = cell.split(";"), turn.split(";") if turn else [""] * len(names)
        for cells, target in ((size, parts), (angle or size, around)):
            if len(target) != len(names):
                joined = f"{len(names)} joined by ';' as in trial_plane"
                raise self._wrong(i, cells.header, cells.values[i], f"masses and angles, {joined}")
        for one, part, at in zip(names, parts, around, strict=True):
            mass = self._number(size, i, part, f"a {what}" if self.fitted else f"a {what}, positive")
            if not self.fitted and not mass >= SMALLEST:
                raise self._wrong(i, size.header, cell, f"a positive {what}")
            if mass < 0:
                raise self._wrong(i, size.header, cell, f"a {what} that is not negative")
            if not at.strip() and mass:
                header = angle.header if angle is not None else "trial_angle_deg"
                raise self._wrong(i, header, turn, f"the angle of the {what}")
            angled = at.strip() and angle is not None
            yield (
                one,
                mass,
                self._number(angle, i, at, f"the angle of the {what}") if angled and angle else 0.0,
            )

    def _number(self, cells: Cells, row: int, text: str, expected: str) -> float:
        try:
            return cells.number(text)
        except ValueError:
            more = ", with a decimal comma as elsewhere in the file" if cells.decimal_comma else ""
            raise self._wrong(row, cells.header, cells.values[row], expected + more) from None


def _codes(values: Sequence[str]) -> Rows:
    """Number texts, 0 for a blank."""
    first = {"": 0}
    return np.array([first.setdefault(text, len(first)) for text in values])


def _first_of_run(of_run: Rows, rows: Flags) -> Rows:
    """Return for each row the first of its run among some rows, -1 where there is none."""
    first = np.full(int(of_run.max(initial=0)) + 1, -1)
    at = np.flatnonzero(rows)[::-1]
    first[of_run[at]] = at
    return first[of_run]


def _on_top(
    table: Table, rotor: Rows, masses: list[dict[str, complex] | None]
) -> list[dict[str, complex] | None]:
    """Add what is below each mass: `ref` numbers the run, within its state, on top of which it stands; -1 for none.

    Its angle counts from the angle written in that run's row.
    """
    angle = table.cells.get("trial_angle")
    state = table.named("state", "")
    sensor = table.named("sensor")
    seen: dict[tuple[int, str, str], list[int]] = {}
    out: list[dict[str, complex] | None] = []
    for i, text in enumerate(table.texts["ref"]):
        before = seen.setdefault((int(rotor[i]), state[i], sensor[i]), [])
        try:
            number = parse_number(text.replace(",", ".")) if text else -1
            below = int(number) if number == int(number) else 0
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


def _run_names(rotor: Rows, channel: Rows, when: Real | None, masses: Masses) -> tuple[list[str], Rows]:
    """Tell runs apart where no column does: a new one begins where masses or day change, or a channel comes again."""
    out: list[int] = []
    count: dict[int, int] = {}
    before: tuple[int, float, dict[str, complex]] | None = None
    seen: set[int] = set()
    days = [np.nan] * len(rotor) if when is None else np.floor(when * YEAR + 1e-6).tolist()
    for r, of, day, put in zip(rotor.tolist(), channel.tolist(), days, masses.by_row(), strict=True):
        # of an unknown day: that of the row before
        on_day = day if day == day or before is None else before[1]
        on = (r, on_day, {plane: mass for plane, mass in (put or {}).items() if mass})
        if on != before or of in seen:
            count[r] = count.get(r, 0) + 1
            before, seen = on, set()
        seen.add(of)
        out.append(count[r] - 1)
    return [str(k + 1) for k in range(max(out) + 1)], np.array(out)
