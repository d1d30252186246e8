"""From a recorded vibration to its vectors once per turn; the worked solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from balancing.synchronous import OncePerTurn, once_per_turn
from cli.read.options import bad
from dalembert.angles import degrees
from dalembert.errors import DataError
from dalembert.results.way import Topic, figures
from dalembert.tables.sources import open_source
from dalembert.tables.table import read
from dalembert.units import amplitude_kind, find_unit

MARKS = ("mark", "tacho", "keyphasor", "pulse", "trigger")


@dataclass(frozen=True)
class Recording:
    """The sensors of a recording and their vectors."""

    sensors: list[str]
    unit: str
    vectors: OncePerTurn
    warnings: list[str]
    exact: Callable[[], tuple[Any, ...]]
    """The recording in 32 digits, of the decimals as they are written."""

    @cached_property
    def second(self) -> Any:
        """The vectors in 32 digits."""
        return self.vectors.second_run(self.exact())


def read_signal(path: str, pulses: int) -> Recording:
    """Read `t_s`, a mark, if wanted a tacho, and columns of vibration such as `A_um`, and compute the vectors."""
    header = [each.name for each in open_source(path, {}, None).headings]
    marking = sorted((name.lower() for name in header if name.lower() in MARKS), key=MARKS.index)
    if not marking:
        raise DataError(
            f"{path}: no column mark (or {', '.join(MARKS[1:])}); the header is: {', '.join(header)}"
        )
    mark, *more = marking
    if len(more) > 1:
        raise DataError(f"{path}: the columns {', '.join(marking)}: expected a mark and one tacho")
    if more and pulses > 1:
        raise bad("--pulses", f"{path} has a mark and a tacho: the pulses of a turn are counted")
    time = "time" if any(name.lower().startswith("time_") for name in header) else "t"
    units: dict[str, str] = {}
    for name in header:
        parts = name.split("_")
        for k in range(1, len(parts)):
            unit = find_unit("amplitude", "_".join(parts[k:]))
            if unit and parts[0].lower() not in (time, *marking):
                units["_".join(parts[:k]).lower()] = unit
                break
    if not units:
        raise DataError(
            f"{path}: no column of vibration, such as A_um or acceleration_g; the header is: {', '.join(header)}"
        )
    if len(set(units.values())) > 1:
        raise DataError(
            f"{path}: the vibration is in {', '.join(sorted(set(units.values())))}: expected one unit"
        )
    tag = amplitude_kind(next(iter(units.values())))[1]
    if tag in ("_pp", "_rms"):
        raise DataError(
            f"{path}: the vibration is in {next(iter(units.values()))}: samples are values of an instant, and the amplitude "
            f"that comes out is a peak: expected a unit without {tag}"
        )
    table = read(
        path, numbers={time: "time", **dict.fromkeys(marking, "number"), **dict.fromkeys(units, "amplitude")}
    )
    t = table.require(time, "time")
    signal = np.stack([table.numbers[name].values for name in units], axis=1)
    try:
        tacho = table.numbers[more[0]].values if more else None
        vectors = once_per_turn(t.si, signal, table.numbers[mark].values, pulses, tacho)
    except ValueError as error:
        raise DataError(f"{table.file}: {error}") from None
    written = {name.lower(): name for name in header}
    sensors = [
        "1" if name == "amplitude" else written[f"{name}_{unit.lower()}"][: len(name)]
        for name, unit in units.items()
    ]
    if pulses > 1:
        table.warnings.append(
            f"{table.file}: phases count from the first of {pulses} pulses in the recording, which may be another one each time: "
            "a column mark, once in a turn, in addition to the tacho makes them certain"
        )
    if vectors.phase_resolution:
        table.warnings.append(
            f"{table.file}: the mark rises between two samples, in the middle as taken: phases hold to "
            f"± {np.degrees(vectors.phase_resolution):.2g}°; more samples in a turn makes them more exact"
        )

    def exact() -> tuple[Any, ...]:
        from cli.read.exact import long_column
        from dalembert.units import UNITS

        above, below = UNITS["time"][t.unit]
        level, tacho = (
            long_column(table.numbers[name]) if name else None for name in (mark, (more or [""])[0])
        )
        signals: Any = np.stack([long_column(table.numbers[name]) for name in units], axis=1)
        return long_column(t) * float(above) / float(below), signals, level, pulses, tacho

    return Recording(sensors, next(iter(units.values())), vectors, table.warnings, exact)


def way(recording: Recording) -> list[Topic]:
    """The one topic."""
    of = recording.vectors
    text = [
        f"Turns between marks: {of.turns}; ω = 2π/T = {figures(float(of.speed))} rad/s.",
        "In each turn a·cos(ωt + phase) is fitted: x = a·cos(phase) = (2/T)∫ s·cos ωt dt, y = a·sin(phase) = −(2/T)∫ s·sin ωt dt; "
        "the vectors of all turns are averaged.",
    ]
    entries = []
    for sensor, v in zip(recording.sensors, of.vector.tolist(), strict=True):
        angle = float(degrees(np.array([v]))[0])
        text.append(
            f"  {sensor}: ({figures(v.real)}, {figures(v.imag)}) = {figures(abs(v))} ∠ {figures(angle)}° {recording.unit}"
        )
        entries.append({"sensor": sensor, "x": v.real, "y": v.imag, "amplitude": abs(v), "phase_deg": angle})
    head = {"turns": int(of.turns), "speed_rad_s": float(of.speed), "sensors": entries}
    return [Topic("vectors", text, "Vectors once per turn", head)]
