"""Measured runs as people keep them: a table, a wide sheet or a log, to rows with what was on and what each row reads."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cli.read import options
from cli.read.runs.layouts import runs_layout
from cli.read.runs.masses import MassColumns, Masses, on_top, turned, turned_exactly
from cli.read.runs.rows import LogRows, Sorted
from cli.read.runs.runs import Complex, Real, Rows, Runs, channels_of
from cli.read.runs.vectors import Layout
from cli.read.stored import Sisters, Stored, read_stored, stored_alpha
from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.tables.table import Cells, Table
from dalembert.units import UNITS

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_vectors import Vectors


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
    """Whether the fit is shown whatever it leaves over: a log asks for it, and so do stored coefficients that take part in it."""


def read_measured(
    path: str,
    influence: Sequence[str] = (),
    *,
    fit: bool = False,
    exclude: Collection[str] = (),
    four_run: bool = False,
    against: bool = False,
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
                f"or stored coefficients by --influence {table.told}"
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
            table.warnings.append(
                f"{table.file}: the column use is the keeper's own mark: every row takes part in the fit"
            )
        if "run" not in table.texts and not (of_log or self.files):
            raise DataError(f"{table.file}: no column run {table.told}")
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
        for name in self.exclude:
            if name not in run_names:
                raise options.bad("--exclude", f"no run {quote(name)} in {table.file}")
        return LogRows(
            self.runs, rotor, vibration, masses, run, run_names, self._exact, when, channels, channel
        )

    def _exact(self) -> Vectors:
        """Return what each row reads in 32 digits, of the decimals as they are written; 0 where it is blank."""
        from cli.read.exact import vectors
        from dalembert.arithmetic.doubled_vectors import Vectors, doubled_array

        numbers = self.table.numbers
        columns = [self.amplitude] if self.four_run else [self.amplitude, numbers["phase"]]
        read = np.isfinite([column.values for column in columns]).all(axis=0)
        size, *phase = (replace(column, values=np.where(read, column.values, 0.0)) for column in columns)
        if self.four_run:
            exact = doubled_array(size.decimals, size.values.shape)
            return Vectors(exact, exact * 0.0)
        result = vectors(size.decimals, phase[0])
        return result.conj if self.against else result

    def _vibration(self) -> Complex:
        """Return what each row reads, NaN where it is blank."""
        table, amplitude = self.table, self.amplitude
        table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
        unread = np.isnan(amplitude.values)
        if "weight" in table.numbers:
            table.reject(table.numbers["weight"].values < 0, "weight", "a weight that is not negative")
        if self.four_run:
            table.reject(unread, "amplitude", "a number")
            return amplitude.values.astype(complex)
        phase = table.require("phase", "angle")
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


_ISO = re.compile(
    r"(\d{4})[-/](\d{1,2})(?:[-/](\d{1,2}))?(?:[T ]+(\d{1,2}):(\d{2})(?::(\d{2})(?:\.\d+)?)?Z?)?"
)
_POINTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(?:,?\s+(\d{1,2}):(\d{2})(?::(\d{2}))?)?")
DATE = "a date such as 2019-03-14, 2019-03-14 08:30 or 14.03.2019"
YEAR = 365.25


def years(table: Table) -> Real | None:
    """Return the date of each row in years, from any origin; NaN where there is none, None without a column of dates."""
    written = table.texts.get("date")
    if written is None or not any(written):
        return None
    return np.array([_year(table, i, text) if text else np.nan for i, text in enumerate(written)])


def _year(table: Table, row: int, text: str) -> float:
    iso, points = _ISO.fullmatch(text), _POINTS.fullmatch(text)
    match = iso or points
    if match is None:
        raise table.error(row, "date", text, DATE)
    first, month, last, *clock = match.groups()
    year, day = (first, last or "1") if iso else (last, first)
    try:
        hour, minute, second = (int(part or 0) for part in clock)
        at = datetime(int(year), int(month), int(day), hour, minute, second)
    except ValueError:
        raise table.error(row, "date", text, DATE) from None
    # in days first, so that no digit is lost
    return (at - datetime(2000, 1, 1)).total_seconds() / 86400 / YEAR


def latest(table: Table) -> str | None:
    """Return the last date of a table, as 2019-03-14; None where none can be read."""
    matches = [
        _ISO.fullmatch(text) or _POINTS.fullmatch(text) for text in table.texts.get("date", ()) if text
    ]
    days = []
    for match in filter(None, matches):
        first, month, last = match.groups()[:3]
        year, day = (first, last or "01") if match.re is _ISO else (last, first)
        days.append(f"{year}-{int(month):02}-{int(day):02}")
    return max(days, default=None)
