"""From a balancing log as people keep it to arrays: runs told apart, masses as they were on the rotor, states, repeats."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cli.errors import DataError, quote
from cli.field.dates import YEAR, years
from cli.field.layouts import log_table
from cli.field.log_groups import LogRows, Logs
from cli.field.read import NEAR_SPEED
from cli.field.runs import Channel, Rows, Runs
from cli.field.sisters import Sisters
from cli.read.options import bad
from cli.read.rounding import vector_error
from cli.read.tables import Cells, Table, number_names
from cli.read.units import UNITS, phasor, to_si


def read_log(
    path: str,
    *,
    lagging: bool | None,
    exclude: Sequence[str] = (),
    sisters: Sisters | None = None,
    reading_error: tuple[float, float] | None = None,
) -> Runs:
    """Read a log whose runs are all to be fitted together; `lagging` None: in the sense of the phase that fits better.

    `sisters` is what is known of the coefficients; `reading_error` the errors with which its weight is found.
    """
    layout = log_table(path)
    table = layout.table
    amplitude, phase = table.require("amplitude", "amplitude"), table.require("phase", "angle")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    vibration = phasor(amplitude.values, -phase.values if lagging else phase.values, phase.unit)
    both = [name for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if len(both) > 1 or not (both or sisters):
        found = f"both {' and '.join(both)}" if both else f"none (the header is: {', '.join(table.header)})"
        raise DataError(f"{table.file}: expected one column of masses, found {found}")
    size = table.cells[both[0]] if both else Cells("", sisters.unit if sisters else "kg", [""] * table.rows)
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
        max_mass=layout.max_mass,
        runout=layout.runout,
    )
    if sisters is not None and sisters.unit not in UNITS[runs.per]:
        raise DataError(
            f"{table.file}: the runs have a {runs.per}, the stored coefficients are per {sisters.unit}"
        )
    masses, mass_share = _masses(table, size, runs.per)
    if "ref" in table.texts:
        masses = _on_top(table, rotor, masses)
    if "use" in table.texts:
        table.warnings.append(
            f"{table.file}: the column use is the keeper's own mark: every row takes part in the fit"
        )
    rows = LogRows(
        table,
        rotor,
        names,
        list(vibration.tolist()),
        _channels(table, rotor),
        masses,
        table.texts.get("run") or [],
        years(table),
        float(vector_error(np.ones(table.rows), phase.values, phase.unit).max()),
        mass_share,
    )
    if not rows.run:
        rows.run = _run_names(rows)
    for name in exclude:
        if name not in rows.run:
            raise bad("--exclude", f"no run {quote(name)} in {table.file}")
    by_rotor: list[list[int]] = [[] for _ in names]
    for i, r in enumerate(rotor.tolist()):
        by_rotor[r].append(i)
    Logs(rows, runs, lagging, set(exclude), sisters, reading_error).read(by_rotor)
    runs.warnings = [*table.warnings, *runs.warnings]
    return runs


def _masses(table: Table, size: Cells, per: str) -> tuple[list[dict[str, complex] | None], float]:
    """Read the masses of each row, several joined by ';', and by what share of it one may be off as it is rounded."""
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
    return out, float(vector_error(np.ones(len(angles)), angles, unit).max(initial=0.0))


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


def _run_names(rows: LogRows) -> list[str]:
    """Tell runs apart where no column does: a new one begins where masses or day change, or a channel comes again."""
    out: list[str] = []
    count: dict[int, int] = {}
    before: tuple[int, float, dict[str, complex]] | None = None
    seen: set[Channel] = set()
    none = [np.nan] * rows.table.rows
    days = none if rows.years is None else np.floor(rows.years * YEAR + 1e-6).tolist()
    for r, channel, day, masses in zip(rows.rotor.tolist(), rows.channel, days, rows.masses, strict=True):
        # of an unknown day: that of the row before
        on_day = day if day == day or before is None else before[1]
        on = (r, on_day, {plane: mass for plane, mass in (masses or {}).items() if mass})
        if on != before or channel in seen:
            count[r] = count.get(r, 0) + 1
            before, seen = on, set()
        seen.add(channel)
        out.append(str(count[r]))
    return out
