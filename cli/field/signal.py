"""`--signal`: the once-per-turn vectors of a recorded vibration, a row for the log each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from balancing.synchronous import OncePerTurn, once_per_turn
from cli.errors import DataError
from cli.read.options import bad
from cli.read.sources import open_source
from cli.read.tables import read
from cli.read.units import degrees, find_unit, from_si
from cli.show.columns import Column, Result, Table, finite

MARKS = ("mark", "tacho", "keyphasor", "pulse", "trigger")


@dataclass(frozen=True)
class Recorded:
    """What was found in a recording."""

    sensors: list[str]
    unit: str
    found: OncePerTurn
    warnings: list[str]


def read_signal(path: str, pulses: int) -> Recorded:
    """Read `t_s`, a mark, if wanted a tacho, and columns of vibration such as `A_um`, and find the vectors."""
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
    table = read(
        path, numbers={time: "time", **dict.fromkeys(marking, "number"), **dict.fromkeys(units, "amplitude")}
    )
    t = table.require(time, "time")
    signal = np.stack([table.numbers[name].values for name in units], axis=1)
    try:
        tacho = table.numbers[more[0]].values if more else None
        found = once_per_turn(t.si, signal, table.numbers[mark].values, pulses, tacho)
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
            "a column mark, once in a turn, beside the tacho would tell"
        )
    return Recorded(sensors, next(iter(units.values())), found, table.warnings)


def signal(path: str, pulses: int) -> Result:
    """Return the vectors of a recording in every form."""
    recorded = read_signal(path, pulses)
    found = recorded.found
    size, turn, deviation = np.abs(found.vector), degrees(found.vector), found.deviation
    rows = len(recorded.sensors)

    def table() -> Table:
        rpm = from_si(found.speed, "speed", "rpm")
        return Table(
            [
                Column("sensor", "", recorded.sensors),
                Column("speed", "rpm", [rpm] * rows),
                Column("amplitude", recorded.unit, size),
                Column("phase", "deg", turn),
                Column("amplitude_uncertainty", recorded.unit, deviation),
                Column("turns", "", [found.turns] * rows),
            ],
            keys=("sensor",),
        )

    def document() -> dict[str, object]:
        return {
            "signal": [
                {
                    "sensor": sensor,
                    "amplitude": float(size[s]),
                    "phase_deg": float(turn[s]),
                    "amplitude_uncertainty": finite(deviation[s]),
                    "speed_rad_s": found.speed,
                    "speed_sd_rad_s": finite(found.speed_deviation),
                    "turns": found.turns,
                }
                for s, sensor in enumerate(recorded.sensors)
            ],
            "amplitude_unit": recorded.unit,
        }

    return Result(
        document=document,  # type: ignore[arg-type]
        tables={"signal": table},
        notes=lambda: "amplitude of a·cos(ωt + phase), t = 0 at the mark; the mean of single turns",
        warnings=recorded.warnings,
    )
