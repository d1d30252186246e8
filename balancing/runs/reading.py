"""Measured runs as people keep them: a table, a wide sheet or a log, to rows with what was on and what each row reads."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from balancing.runs.layouts import runs_layout
from balancing.runs.rows import YES, LogRows, Masses, Sorted
from balancing.runs.runs import YEAR, Complex, Real, Rows, Runs, channels_of, years
from balancing.runs.stored import Sisters, Stored, read_stored, stored_alpha
from balancing.runs.vectors import Layout
from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.table import Cells, Numbers, Table, numbered
from dalembert.units import LARGEST, SMALLEST, UNITS, to_si

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import Vectors

T = TypeVar("T", complex, "Vectors")
Flags = NDArray[np.bool_]


class Measured(NamedTuple):
    """The rows of a table or a log, and the coefficients that were stored before."""

    rows: Sorted
    stored: Stored | None
    """Those that stand for trial runs."""
    sisters: Sisters | None
    """Those that take part in a fit."""
    warnings: list[str]
    """Those of the files of coefficients."""
    fit: bool
    """Whether the fit is shown even with nothing to spare: of a log, and of stored coefficients that take part in it."""


def read_measured(
    path: str,
    influence: Sequence[str],
    *,
    fit: bool,
    exclude: Collection[str],
    four_run: bool,
    against: bool,
) -> Measured:
    """Read the runs.

    Parameters
    ----------
    path, influence
        The runs, and the files of stored coefficients.
    fit
        Whether an option needs a fit of all runs: stored coefficients take part in it.
    exclude
        Runs that take no part in it.
    four_run
        Whether amplitudes alone are read.
    against
        Whether phases are counted against the sense of the mass angles.
    """
    layout = runs_layout(path)
    files = [read_stored(file) for file in influence]
    if not files and not four_run and layout.alpha is not None:
        files = [stored_alpha(layout.alpha)]
    return _Reading(layout, files, fit, exclude, four_run, against).measured()


class _Reading:
    """The rows of a table of runs, and the coefficients that are stored of its machines."""

    def __init__(
        self,
        layout: Layout,
        files: Sequence[Stored],
        fit: bool,
        exclude: Collection[str],
        four_run: bool,
        against: bool,
    ) -> None:
        self.layout, self.table, self.files, self.exclude = layout, layout.table, files, exclude
        self.four_run, self.against = four_run, against
        self.together = fit or layout.is_log or len(files) > 1 or any(one.along is not None for one in files)
        """Whether all runs are fitted together, with the stored coefficients: on request, of a log, of coefficients with errors."""
        table = self.table
        self.amplitude = table.require("amplitude", "amplitude")
        sizes = [table.cells[name] for name in ("trial_mass", "trial_unbalance") if name in table.cells]
        if len(sizes) > 1:
            raise DataError(
                f"{table.file}: mixed columns {' and '.join(size.header for size in sizes)}: expected one"
            )
        if not sizes and not files:
            raise DataError(
                f"{table.file}: no column trial_mass_kg (or trial_mass_g, trial_unbalance_g_mm …): expected trial masses, "
                f"or stored influence coefficients {table.hint}"
            )
        size = sizes[0] if sizes else Cells("", files[0].unit, [""] * table.rows)
        names, rotor = table.numbered("rotor", "1")
        self.runs = Runs(table, names, size.unit, max_mass=layout.max_mass, runout=layout.runout)
        self.masses = MassColumns(table, size, self.runs.per, rotor)

    def measured(self) -> Measured:
        """Read the rows, sorted by rotor."""
        ordered, files, runs = Sorted(self._rows(), self.exclude), self.files, self.runs
        if not files:
            return Measured(ordered, None, None, [], self.together)
        unit, warnings = files[0].unit, [warning for one in files for warning in one.table.warnings]
        runs.other_masses = unit not in UNITS[runs.per]
        runs.stored_lags = {one.table.file: one.lags for one in files}
        # stored coefficients stand for trial runs; without an initial run, or with several, all runs are fitted with them
        if not self.together and ordered.leave_out_loaded():
            runs.mass_unit = unit
            return Measured(ordered, files[0], None, warnings, False)
        if runs.other_masses:
            raise DataError(
                f"{self.table.file}: the runs have a {runs.per}, the stored coefficients are per {unit}"
            )
        return Measured(ordered, None, Sisters(files), warnings, True)

    def _rows(self) -> LogRows:
        table, rotor, of_log = self.table, self.masses.rotor, self.layout.is_log
        vibration, when = self._vibration(), years(table)
        if "use" in table.texts:
            table.warnings.append(f"{table.file}: the column use is ignored: every row is used in the fit")
        if "run" not in table.texts and not (of_log or self.files):
            raise DataError(f"{table.file}: no column run {table.hint}")
        run_names, run = table.numbered("run", "initial")
        if "run" in table.texts or not of_log:
            self.masses.check_runs(run_names, run)
        masses = self.masses.masses()
        if "ref" in table.texts:
            alone = masses
            masses = Masses.of(
                on_top(table, rotor, alone.by_row(), turned),
                lambda: on_top(table, rotor, alone.exact_by_row(), turned_exactly),
            )
        channels, channel = channels_of(table, rotor)
        if "run" not in table.texts and of_log:
            run_names, run = _run_names(rotor, channel, when, masses)
        return LogRows(
            self.runs, rotor, vibration, masses, run, run_names, self._exact, when, channels, channel
        )

    def _exact(self) -> Vectors:
        """Return what each row reads in 32 digits, of the decimals as they are written; 0 where it is blank."""
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_operations import doubled_array
        from dalembert.tables.exact import vectors

        numbers = self.table.numbers
        columns = [self.amplitude] if self.four_run else [self.amplitude, numbers["phase"]]
        read = np.isfinite([column.values for column in columns]).all(axis=0)
        size, *phase = (replace(column, values=np.where(read, column.values, 0.0)) for column in columns)
        if self.four_run:
            exact = doubled_array(size.decimals, size.values.shape)
            return Vectors(exact, exact * 0.0)
        result = vectors(size.decimals, phase[0])
        return result.conj() if self.against else result

    def _vibration(self) -> Complex:
        """Return what each row reads, NaN where it is blank."""
        table, amplitude = self.table, self.amplitude
        table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
        tiny = (amplitude.values > 0) & (amplitude.values < SMALLEST)
        table.reject(tiny, "amplitude", f"0, or an amplitude of {SMALLEST:g} at least")
        unread = np.isnan(amplitude.values)
        if "weight" in table.numbers:
            table.reject(table.numbers["weight"].values < 0, "weight", "a weight that is not negative")
        if self.four_run:
            table.reject(unread, "amplitude", "a number")
            return amplitude.values.astype(complex)
        try:
            phase = table.require("phase", "angle")
        except DataError as error:
            raise DataError(f"{error}; amplitudes alone are for the four-run method") from None
        # a sensor that a run lacks may be a row with blank cells
        unread = unread & np.isnan(phase.values)
        expected = "a number, or amplitude and phase both blank"
        for numbers, name in ((amplitude, "amplitude"), (phase, "phase")):
            table.reject(np.isnan(numbers.values) & ~unread, name, expected)
        turn = np.where(unread, 0.0, -phase.values if self.against else phase.values)
        return np.where(unread, complex(np.nan), phasor(amplitude.values, turn, phase.unit))


def _run_names(rotor: Rows, channel: Rows, when: Real | None, masses: Masses) -> tuple[list[str], Rows]:
    """Number runs that no column names: a new one begins where masses or day change, or a channel comes again."""
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


# -- what was on the rotor ------------------------------------------------------------------------------------


@dataclass(eq=False, repr=False)
class MassColumns:
    """The columns that state what was on the rotor."""

    table: Table
    size: Cells
    """Masses or unbalances."""
    per: str
    """`mass` or `unbalance`."""
    rotor: Rows
    """The rotor of each row."""

    @cached_property
    def stated(self) -> Flags:
        """Which rows state a mass, (n,)."""
        return np.array([bool(cell) for cell in self.size.values])

    @cached_property
    def named(self) -> Flags:
        """Which rows name a plane, (n,)."""
        planes, plane = self.table.numbered("trial_plane")
        return np.array([bool(name) for name in planes])[plane]

    def check_runs(self, run_names: list[str], run: Rows) -> None:
        """Refuse rows that contradict those of their run: another plane, or a plane, a mark that it is kept, and no mass."""
        of_run = numbered(self.rotor * len(run_names) + run)[0]
        states = first_of_run(of_run, self.stated)
        for i in np.flatnonzero(self.named & (states < 0))[:1].tolist():
            raise self._wrong(i, self.size.header, "", "a trial mass")
        names, plane = self.table.numbered("trial_plane")
        for i in np.flatnonzero(self.named & (plane != plane[states]) & self.named[states])[:1].tolist():
            one, other = names[plane[states[i]]], names[plane[i]]
            raise self._wrong(
                i,
                "trial_plane",
                other,
                f"{quote(one)} as elsewhere in run {run_names[run[i]]}; several masses in one run are joined by ';' "
                f"({one};{other})",
            )
        words, code = self.table.numbered("trial_kept")
        kept = np.array([word.lower() in YES for word in words])[code]
        for i in np.flatnonzero(kept & (states < 0))[:1].tolist():
            expected = f"the trial mass that is kept after run {run_names[run[i]]}"
            raise self._wrong(i, "trial_plane", "", expected)

    def _wrong(self, row: int, column: str, value: str, expected: str) -> DataError:
        return self.table.error(row, column, value, expected)

    def masses(self) -> Masses:
        """Read the masses of each row, several joined by ';'; a mass of zero is none."""
        table, size, per = self.table, self.size, self.per
        if not self.stated.any():
            return Masses.of([None] * table.rows)
        angle = table.cells.get("trial_angle")
        names, code = table.numbered("trial_plane")
        planes: dict[str, int] = {}
        for name in names:
            for part in (name or "1").split(";"):
                planes.setdefault(part.strip(), len(planes))
        plane = np.array([planes.get(name or "1", -1) for name in names])[code]
        # one mass in a row, its numbers in order: all these rows together, and the others one by one
        plain = self.stated & np.array([";" not in name for name in names])[code]
        if "trial_plane" in table.texts:
            plain &= self.named
        sizes, angles = size.parsed, None if angle is None else angle.parsed
        if sizes is None or angles is None:
            plain[:] = False
            sizes = angles = np.zeros(table.rows)
        plain &= (sizes >= 0) & (sizes <= LARGEST) & (np.abs(angles) <= LARGEST)
        others = [
            (i, planes[name], mass, turn)
            for i in np.flatnonzero(self.stated & ~plain).tolist()
            for name, mass, turn in self._of_row(i, names[code[i]], angle)
        ]
        row, where, more, turns = (
            np.array(part) for part in (zip(*others, strict=True) if others else ((), (), (), ()))
        )
        row = np.concatenate([np.flatnonzero(plain), row.astype(np.intp)])
        where = np.concatenate([plane[plain], where.astype(np.intp)])
        around = np.concatenate([angles[plain], turns])
        unit = angle.unit if angle is not None else "deg"
        amounts = np.concatenate([sizes[plain], more])
        on = phasor(np.asarray(to_si(amounts, per, size.unit)), around, unit)
        # several in one plane of a run are one
        _, first, entry = np.unique(row * max(len(planes), 1) + where, return_index=True, return_inverse=True)
        value = np.zeros(len(first), dtype=complex)
        np.add.at(value, entry, on)

        def exact() -> Vectors:
            from dalembert.tables.exact import vectors

            each = vectors(Numbers("", size.unit, amounts, per).exact, Numbers("", unit, around, "angle"))
            return _added(each, entry, len(first))

        return Masses(list(planes), row[first], where[first], value, self.stated, exact)

    def _of_row(self, i: int, name: str, angle: Cells | None) -> Iterator[tuple[str, float, float]]:
        """Yield plane, size and angle of each mass of a row, as the file has them."""
        size = self.size
        cell, turn = size.values[i], "" if angle is None else angle.values[i]
        names = [part.strip() for part in name.split(";")] if name else ["1"]
        if "" in names:
            raise self._wrong(i, "trial_plane", name, "a plane's name before and after each ';'")
        parts, around = cell.split(";"), turn.split(";") if turn else [""] * len(names)
        for cells, target in ((size, parts), (angle or size, around)):
            if len(target) != len(names):
                expected = f"{len(names)} joined by ';'" if len(names) > 1 else "one"
                raise self._wrong(i, cells.header, cells.values[i], f"{expected}, as trial_plane has planes")
        for one, part, at in zip(names, parts, around, strict=True):
            mass = self._number(size, i, part, "a trial mass")
            if mass < 0 or 0 < mass < SMALLEST:
                raise self._wrong(i, size.header, cell, "a positive trial mass, or 0 where none is on")
            if not at.strip() and mass:
                header = angle.header if angle is not None else "trial_angle_deg"
                raise self._wrong(i, header, turn, "the angle of the trial mass")
            if not name and "trial_plane" in self.table.texts:
                if not mass:
                    continue
                raise self._wrong(i, "trial_plane", "", "the plane of the trial mass")
            turned_by = (
                0.0
                if angle is None or not at.strip()
                else self._number(angle, i, at, "the angle of the trial mass")
            )
            yield one, mass, turned_by

    def _number(self, cells: Cells, row: int, text: str, expected: str) -> float:
        try:
            return cells.number(text)
        except ValueError:
            more = ", with a decimal comma as elsewhere in the file" if cells.decimal_comma else ""
            raise self._wrong(row, cells.header, cells.values[row], expected + more) from None


def first_of_run(of_run: Rows, rows: Flags) -> Rows:
    """Return for each row the first of its run among some rows, -1 where there is none."""
    first = np.full(int(of_run.max(initial=0)) + 1, -1)
    at = np.flatnonzero(rows)[::-1]
    first[of_run[at]] = at
    return first[of_run]


def _added(each: Vectors, entry: Rows, count: int) -> Vectors:
    """Add up vectors (k,) of like entries."""
    from dalembert.arithmetic.doubled_arrays import Vectors

    total = Vectors.of(np.zeros(count))
    order = np.argsort(entry, kind="stable")
    starts = np.searchsorted(entry[order], np.arange(count))
    rank = np.arange(len(entry)) - starts[entry[order]]
    for k in range(int(rank.max(initial=-1)) + 1):
        mine = order[rank == k]
        total[entry[mine]] = total[entry[mine]] + each[mine]
    return total


def turned(angle: float, unit: str) -> complex:
    """e^{iφ} of an angle."""
    return complex(phasor(np.ones(1), np.array([angle]), unit)[0])


def turned_exactly(angle: float, unit: str) -> Vectors:
    """e^{iφ} of an angle in 32 digits."""
    from dalembert.tables.exact import turns

    return turns(Numbers("", unit, np.array([angle]), "angle"))[0]


def on_top(
    table: Table,
    rotor: Rows,
    masses: list[dict[str, T] | None],
    turn_of: Callable[[float, str], T],
) -> list[dict[str, T] | None]:
    """Add what is below each mass: `ref` numbers the run, within its state, on top of which it stands; -1 for none.

    Its angle counts from the angle written in that run's row; `turn_of` makes a vector of an angle in a unit.
    """
    angle = table.cells.get("trial_angle")
    state = table.named("state", "")
    sensor = table.named("sensor")
    seen: dict[tuple[int, str, str], list[int]] = {}
    out: list[dict[str, T] | None] = []
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
            if written and angle is not None:
                turn = turn_of(angle.number(written), angle.unit)
                mine = {plane: mass * turn for plane, mass in mine.items()}
            for plane, mass in (out[base] or {}).items():
                mine[plane] = mine[plane] + mass if plane in mine else mass
        before.append(i)
        out.append(mine)
    return out
