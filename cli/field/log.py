"""From a balancing log as people keep it to arrays: runs told apart, masses as they were on the rotor, states, repeats."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import datetime

import numpy as np

from cli.field.layouts import Layout, log_table
from cli.field.log_groups import Logs
from cli.field.log_rows import LogRows, Masses, numbered
from cli.field.request import Request
from cli.field.runs import Channel, Real, Rows, Runs
from cli.field.sisters import Sisters
from cli.field.trial_runs import NEAR_SPEED
from cli.read.options import bad
from cli.read.rounding import vector_error
from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.table import Cells, Table
from dalembert.units import LARGEST, UNITS, to_si

_ISO = re.compile(
    r"(\d{4})[-/](\d{1,2})(?:[-/](\d{1,2}))?(?:[T ]+(\d{1,2}):(\d{2})(?::(\d{2})(?:\.\d+)?)?Z?)?"
)
_POINTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(?:,?\s+(\d{1,2}):(\d{2})(?::(\d{2}))?)?")
DATE = "a date such as 2019-03-14, 2019-03-14 08:30 or 14.03.2019"
YEAR = 365.25


def read_log(path: str, request: Request, table: Table | None = None, sisters: Sisters | None = None) -> Runs:
    """Read a log whose runs are all to be fitted together.

    `table` is the file where it is a table of runs that is read already; `sisters` is what is known of the coefficients.
    """
    layout = log_table(path) if table is None else Layout(table)
    table = layout.table
    amplitude, phase = table.require("amplitude", "amplitude"), table.require("phase", "angle")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    # a state that a run lacks may be a row with blank cells
    unread = np.isnan(amplitude.values) & np.isnan(phase.values)
    for numbers, name in ((amplitude, "amplitude"), (phase, "phase")):
        table.reject(np.isnan(numbers.values) & ~unread, name, "a number, or amplitude and phase both blank")
    turn = np.where(unread, 0.0, -phase.values if request.lagging else phase.values)
    vibration = np.where(unread, complex(np.nan), phasor(amplitude.values, turn, phase.unit))
    both = [name for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if len(both) > 1 or not (both or sisters):
        found = f"both {' and '.join(both)}" if both else f"none (the header is: {', '.join(table.header)})"
        raise DataError(f"{table.file}: expected one column of masses, found {found}")
    size = table.cells[both[0]] if both else Cells("", sisters.unit if sisters else "kg", [""] * table.rows)
    names, rotor = table.numbered("rotor", "1")
    runs = Runs(table, names, size.unit, max_mass=layout.max_mass, runout=layout.runout)
    if sisters is not None and sisters.unit not in UNITS[runs.per]:
        raise DataError(
            f"{table.file}: the runs have a {runs.per}, the stored coefficients are per {sisters.unit}"
        )
    masses, mass_share = _masses(table, size, runs.per)
    if "ref" in table.texts:
        masses = Masses.of(_on_top(table, rotor, masses.by_row()))
    if "use" in table.texts:
        table.warnings.append(
            f"{table.file}: the column use is the keeper's own mark: every row takes part in the fit"
        )
    channels, channel = _channels(table, rotor)
    when = _years(table)
    if "run" in table.texts:
        run_names, run = table.numbered("run")
    else:
        run_names, run = _run_names(rotor, channel, when, masses)
    for name in request.exclude:
        if name not in run_names:
            raise bad("--exclude", f"no run {quote(name)} in {table.file}")
    share = float(vector_error(np.ones(table.rows), turn, phase.unit).max())
    rows = LogRows(runs, rotor, vibration, channel, channels, masses, run, run_names, when, share, mass_share)
    Logs(rows, request, sisters).read()
    runs.warnings = [*table.warnings, *runs.warnings]
    return runs


def _masses(table: Table, size: Cells, per: str) -> tuple[Masses, float]:
    """Read the masses of each row, several joined by ';', and by what share of it one may be off as it is rounded."""
    angle = table.cells.get("trial_angle")
    names, code = table.numbered("trial_plane")
    planes: dict[str, int] = {}
    plane = np.array([planes.setdefault(name or "1", len(planes)) for name in names])[code]
    told = np.array([bool(cell) for cell in size.values])
    # one mass in a row, its numbers in order: all these rows together, and the others one by one
    plain = told & np.array([";" not in name for name in names])[code]
    sizes, angles = size.parsed, None if angle is None else angle.parsed
    if sizes is None or angles is None:
        plain[:] = False
        sizes = angles = np.zeros(table.rows)
    plain &= (sizes >= 0) & (sizes <= LARGEST) & (np.abs(angles) <= LARGEST)
    named = np.array([bool(name) for name in names])[code]
    others = [
        (i, planes.setdefault(name, len(planes)), mass, turn)
        for i in np.flatnonzero(~plain & (told | named)).tolist()
        for name, mass, turn in _of_row(table, i, names[code[i]], size, angle)
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
    return Masses(list(planes), row[first], where[first], value, told), share


def _of_row(
    table: Table, i: int, name: str, size: Cells, angle: Cells | None
) -> Iterator[tuple[str, float, float]]:
    """Yield plane, size and angle of each mass of a row, as the file has them."""
    cell, turn = size.values[i], "" if angle is None else angle.values[i]
    if not cell:
        raise table.error(i, size.header, cell, f"the mass in plane {name}")
    names = [part.strip() for part in name.split(";")] if name else ["1"]
    parts, around = cell.split(";"), turn.split(";") if turn else [""] * len(names)
    if not len(parts) == len(around) == len(names):
        raise table.error(
            i, size.header, cell, f"{len(names)} masses and angles joined by ';', as the planes"
        )
    for one, part, at in zip(names, parts, around, strict=True):
        mass = _number(table, size, i, part, "a mass")
        if mass < 0:
            raise table.error(i, size.header, cell, "a mass that is not negative")
        if not at.strip() and mass:
            header = angle.header if angle is not None else "trial_angle_deg"
            raise table.error(i, header, turn, "the angle of the mass")
        given = at.strip() and angle is not None
        yield one, mass, _number(table, angle, i, at, "the angle of the mass") if given and angle else 0.0


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


def _channels(table: Table, rotor: Rows) -> tuple[list[Channel], Rows]:
    """Return the channels, and that of each row; speeds within 5 % of the slowest of their kind are one."""
    sensors, sensor = table.numbered("sensor", "1")
    states, state = table.numbered("state")
    kind, first = numbered(sensor * len(states) + state)
    named = "state" in table.texts
    kinds = [(sensors[sensor[i]], states[state[i]] if named else None) for i in first.tolist()]
    speed = table.numbers.get("speed")
    if speed is None:
        return [Channel(one, None, state=of) for one, of in kinds], kind
    given, si = speed.values, speed.si
    of_rotor = numbered(rotor * len(kinds) + kind)[0]
    value = np.where(np.isnan(given), -np.inf, given)
    near, left, many = np.zeros(table.rows, dtype=np.intp), np.arange(table.rows), int(of_rotor.max()) + 1
    while len(left):
        slowest = np.full(many, np.inf)
        np.minimum.at(slowest, of_rotor[left], value[left])
        slowest = np.maximum(slowest, slowest * (1 + NEAR_SPEED))
        inside = value[left] <= slowest[of_rotor[left]]
        near[left[~inside]] += many
        left = left[~inside]
    number, first = numbered(near + of_rotor)
    count = np.bincount(number)
    means = [np.bincount(number, of) / count for of in (given, np.asarray(si))]
    alike = np.ones(len(first), dtype=bool)
    np.logical_and.at(alike, number, value == value[first[number]])
    out: dict[Channel, int] = {}
    code = []
    for k, i in enumerate(first.tolist()):
        one, of = kinds[kind[i]]
        mean = (given[i], si[i]) if alike[k] else (means[0][k], means[1][k])
        none = given[i] != given[i]
        channel = Channel(one, None if none else float(mean[1]), None if none else float(mean[0]), state=of)
        code.append(out.setdefault(channel, len(out)))
    return list(out), np.array(code)[number]


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


def _years(table: Table) -> Real | None:
    """Return the date of each row in years, from any origin; NaN where there is none, None without a column of dates."""
    written = table.texts.get("date")
    if written is None or not any(written):
        return None
    return np.array([_year(table, i, text) if text else np.nan for i, text in enumerate(written)])


def _year(table: Table, row: int, text: str) -> float:
    iso, points = _ISO.fullmatch(text), _POINTS.fullmatch(text)
    found = iso or points
    if found is None:
        raise table.error(row, "date", text, DATE)
    first, month, last, *clock = found.groups()
    year, day = (first, last or "1") if iso else (last, first)
    try:
        hour, minute, second = (int(part or 0) for part in clock)
        at = datetime(int(year), int(month), int(day), hour, minute, second)
    except ValueError:
        raise table.error(row, "date", text, DATE) from None
    # in days first, so that no digit is lost
    return (at - datetime(2000, 1, 1)).total_seconds() / 86400 / YEAR
