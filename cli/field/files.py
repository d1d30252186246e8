"""The files beside a table of runs: run-out vectors and stored influence coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cli.errors import DataError, quote
from cli.field.runs import Channel, Runs, apart
from cli.read.tables import Table, read
from cli.read.units import UNITS, amplitude_kind, from_si, phasor, to_si

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def convert_amplitude(value: Real, unit: str, wanted: str, what: str) -> Real:
    """Convert amplitudes between units of one kind and tag; DataError where they are different quantities."""
    if amplitude_kind(unit) != amplitude_kind(wanted):
        raise DataError(
            f"{what} is in {unit}, the runs in {wanted}: displacement, velocity, acceleration, voltage, counts, peak "
            "(_pk), peak to peak (_pp) and r.m.s. (_rms) do not mix"
        )
    if unit == wanted:
        return value
    return np.asarray(from_si(to_si(value, "amplitude", unit), "amplitude", wanted))


def read_runout(path: str, runs: Runs, *, lagging: bool) -> dict[str, complex]:
    """Read the run-out vector of each sensor, in the runs' amplitude unit."""
    table = read(path, numbers={"amplitude": "amplitude", "phase": "angle"}, texts=["sensor"])
    amplitude, phase = table.require("amplitude", "amplitude"), table.require("phase", "angle")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    size = convert_amplitude(
        amplitude.values, amplitude.unit, runs.amplitude_unit, f"{table.file}: the run-out"
    )
    vectors = phasor(size, -phase.values if lagging else phase.values, phase.unit).tolist()
    sensors = table.texts.get("sensor") or ["1"] * table.rows
    known = {channel.sensor for group in runs.groups for channel in group.channels}
    out: dict[str, complex] = {}
    for i, (sensor, vector) in enumerate(zip(sensors, vectors, strict=True)):
        if sensor in out:
            raise table.error(i, "sensor", sensor, "each sensor once")
        if sensor not in known:
            raise table.error(i, "sensor", sensor, f"a sensor of the runs ({', '.join(sorted(known))})")
        out[sensor] = vector
    runs.warnings += table.warnings
    for sensor in sorted(known - set(out)):
        runs.warnings.append(f"{table.file}: no run-out of sensor {sensor}: taken as zero")
    return out


@dataclass(frozen=True)
class Stored:
    """Stored influence coefficients."""

    table: Table
    unit: str
    values: Complex
    """Amplitude (of `amplitude_unit`, or of the runs) per kg or kg·m."""
    speed: Real
    amplitude_unit: str | None

    def matrix(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> tuple[list[str], Complex]:
        """Return the planes and α (s, p) of a rotor."""
        texts = self.table.texts
        mine = range(self.table.rows)
        if "rotor" in texts:
            mine = [i for i in mine if texts["rotor"][i] == rotor]  # type: ignore[assignment]
            if not mine:
                raise DataError(f"{self.table.file}: no coefficients of rotor {quote(rotor)}")
        sensor = texts.get("sensor") or ["1"] * self.table.rows
        plane = texts.get("plane") or ["1"] * self.table.rows
        planes = list(dict.fromkeys(plane[i] for i in mine))
        speeds = {channel.speed for channel in channels}
        if len(speeds) > 1 and np.isnan(self.speed[list(mine)]).any():
            text = f"{self.table.file}: coefficients without a speed are used at each of {len(speeds)} speeds"
            if text not in runs.warnings:
                runs.warnings.append(text)
        alpha = np.full((len(channels), len(planes)), np.nan, dtype=complex)
        for s, channel in enumerate(channels):
            for p, name in enumerate(planes):
                rows = [i for i in mine if sensor[i] == channel.sensor and plane[i] == name]
                off = [0.0 if channel.speed is None else apart(channel.speed, self.speed[i]) for i in rows]
                least = min(off, default=np.inf)
                best = [i for i, far in zip(rows, off, strict=True) if far == least and far <= 0.01]
                if not best:
                    raise DataError(f"{self.table.file}: no coefficient of sensor {channel} for plane {name}")
                if len(best) > 1:
                    raise self.table.error(
                        best[1],
                        "sensor",
                        sensor[best[1]],
                        f"one coefficient for sensor {channel} and plane {name}",
                    )
                alpha[s, p] = self.values[best[0]]
        if self.amplitude_unit:
            one = np.ones(1)
            factor = convert_amplitude(one, self.amplitude_unit, runs.amplitude_unit, f"{self.table.file}")[0]
            alpha = alpha * factor
        return planes, alpha


def read_stored(path: str) -> Stored:
    """Read stored coefficients: sensor, speed_*, plane, magnitude_per_*, phase_deg."""
    table = read(
        path,
        numbers={"speed": "speed", "magnitude_per": "per", "phase": "angle"},
        texts=["rotor", "sensor", "plane", "amplitude_unit"],
        blank=["speed"],
    )
    size, phase = table.require("magnitude_per", "per"), table.require("phase", "angle")
    table.reject(size.values < 0, "magnitude_per", "a magnitude that is not negative")
    speed = table.numbers.get("speed")
    units = set(table.texts.get("amplitude_unit", [])) - {""}
    if len(units) > 1 or not units <= set(UNITS["amplitude"]):
        raise DataError(f"{table.file}: amplitude_unit {', '.join(sorted(units))}: expected one known unit")
    return Stored(
        table,
        size.unit,
        phasor(from_si(size.values, "per", size.unit), phase.values, phase.unit),
        to_si(speed.values, "speed", speed.unit) if speed is not None else np.full(table.rows, np.nan),
        units.pop() if units else None,
    )
