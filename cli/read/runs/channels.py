"""Channels: a sensor at a speed or in an operating state, and which of them a row reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cli.read.runs.runs import NEAR_SPEED, Channel, Rows, Runs, apart
from dalembert.errors import DataError
from dalembert.tables.table import Table, numbered

Flags = NDArray[np.bool_]


def near_speeds(table: Table, rotor: Rows) -> tuple[list[Channel], Rows]:
    """Return the channels, and that of each row; speeds within 5 % of the slowest of their kind are one."""
    sensors, sensor = table.numbered("sensor", "1")
    states, state = table.numbered("state")
    kind, first = numbered(sensor * len(states) + state)
    named = "state" in table.texts
    kinds = [(sensors[sensor[i]], states[state[i]] if named else None) for i in first.tolist()]
    speed = table.numbers.get("speed")
    if speed is None:
        return [Channel(one, None, state=of) for one, of in kinds], kind
    written, si = speed.values, speed.si
    of_rotor = numbered(rotor * len(kinds) + kind)[0]
    value = np.where(np.isnan(written), -np.inf, written)
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
    means = [np.bincount(number, of) / count for of in (written, np.asarray(si))]
    alike = np.ones(len(first), dtype=bool)
    np.logical_and.at(alike, number, value == value[first[number]])
    out: dict[Channel, int] = {}
    code = []
    for k, i in enumerate(first.tolist()):
        one, of = kinds[kind[i]]
        mean = (written[i], si[i]) if alike[k] else (means[0][k], means[1][k])
        none = written[i] != written[i]
        channel = Channel(one, None if none else float(mean[1]), None if none else float(mean[0]), state=of)
        code.append(out.setdefault(channel, len(out)))
    return list(out), np.array(code)[number]


class OfInitialRun:
    """The channels of the initial runs, which the trial runs read again."""

    def __init__(self, table: Table, rotor: Rows, runs: Runs, initial: Flags) -> None:
        self.table, self.rotor, self.runs, self.initial = table, rotor, runs, initial

    def channels(self) -> tuple[list[Channel], Rows]:
        """Return the sensors and speeds of the initial runs, and that of each row; the nearest speed is meant."""
        table = self.table
        sensors, sensor = table.numbered("sensor", "1")
        speed = table.numbers.get("speed")
        of_sensor = self.rotor * len(sensors) + sensor
        initial = self.initial
        if speed is None:
            missing = ~np.isin(of_sensor, of_sensor[initial])
            channels = [Channel(name, None) for name in sensors]
            if missing.any():
                raise self._not_there(int(np.argmax(missing)), sensors, sensor, initial, channels, sensor)
            return channels, sensor
        written, si = speed.values, np.asarray(speed.si)
        out: dict[Channel, int] = {}
        exact: dict[tuple[int, float | None], int] = {}
        of: dict[int, list[int]] = {}
        code = np.full(table.rows, -1)
        for i in np.flatnonzero(initial).tolist():
            value = None if written[i] != written[i] else float(written[i])
            channel = Channel(sensors[sensor[i]], None if value is None else float(si[i]), value)
            code[i] = out.setdefault(channel, len(out))
            if exact.setdefault((int(of_sensor[i]), value), code[i]) == code[i]:
                mine = of.setdefault(int(of_sensor[i]), [])
                mine += [] if code[i] in mine else [int(code[i])]
        channels = list(out)
        for i in np.flatnonzero(~initial).tolist():
            value = None if written[i] != written[i] else float(written[i])
            match = exact.get((int(of_sensor[i]), value))
            if match is None:
                match = self._nearest(
                    i, written[i], [(c, channels[c]) for c in of.get(int(of_sensor[i]), ())]
                )
            if match is None:
                raise self._not_there(i, sensors, sensor, initial, channels, code)
            code[i] = match
        return channels, code

    def _nearest(self, row: int, speed: float, same: list[tuple[int, Channel]]) -> int | None:
        """Return the channel that is meant: the speed of a run is never quite that of another."""
        off = [apart(channel.speed_written, speed) for _, channel in same]
        nearest = min(range(len(same)), key=off.__getitem__, default=None)
        if nearest is None or (off[nearest] > NEAR_SPEED and len(same) > 1):
            return None
        if off[nearest] > 0.01:
            self.runs.warnings.append(
                f"{self.runs.of(int(self.rotor[row]))}run {self.table.texts['run'][row]} ran at {speed:g}, the initial run at "
                f"{same[nearest][1].speed_written or 0:g}: coefficients hold at one speed"
            )
        return same[nearest][0]

    def _not_there(
        self, row: int, sensors: list[str], sensor: Rows, initial: Flags, channels: list[Channel], code: Rows
    ) -> DataError:
        mine = np.flatnonzero(initial & (self.rotor == self.rotor[row]))
        present = ", ".join(dict.fromkeys(str(channels[code[i]]) for i in mine.tolist()))
        speed = self.table.numbers.get("speed")
        name = sensors[sensor[row]]
        at = np.nan if speed is None else speed.values[row]
        what = name if at != at else f"{name} at {at:g}"
        return self.table.error(row, "sensor", what, f"a sensor and speed of the initial run ({present})")
