"""A recorded vibration once per turn: time, mark and sensors of a table, amplitude and phase of each sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.synchronous import OncePerTurn, once_per_turn
from dalembert.errors import DataError
from dalembert.tables.sources import open_source
from dalembert.tables.table import read
from dalembert.units import AMPLITUDES, UNITS, amplitude_kind, find_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.tables.table import Table

FINE = 1e-4
"""Phases that hold to this, rad, come without a warning."""
STEADY = 0.02
"""Turns whose speeds have a larger standard deviation, relatively, come with a warning."""
DRIFT = 0.01
"""Drifts that may change an amplitude by a larger share come with a warning."""
MARKS = ("mark", "tacho", "keyphasor", "pulse", "trigger")


@dataclass(frozen=True)
class Recording:
    """The sensors of a recording, and their vibration once per turn."""

    sensors: list[str]
    unit: str
    vectors: OncePerTurn
    warnings: list[str]
    exact: Callable[[], tuple[Any, ...]]
    """The recording in 32 digits, with the decimals of the file exact."""

    @cached_property
    def second(self) -> Any:
        """The vibration once per turn in 32 digits."""
        return self.vectors.second_run(self.exact())


def read_recording(path: str, pulses: int = 1) -> Recording:
    """Read the time, a mark, perhaps a tacho, and the vibration of each sensor; compute the vibration once per turn.

    Parameters
    ----------
    path : str
        CSV or workbook with `t_*`, `mark` (or tacho, keyphasor, pulse, trigger) and a column for each sensor: `A_um`.
    pulses : int
        Pulses of the mark in one turn.

    Raises
    ------
    DataError
        A missing column, vibration in several units or in peak-to-peak values, no whole turn.
    ValueError
        Several pulses in a turn, and a mark beside a tacho, which count them.

    Examples
    --------
    Ten turns at 20 ms of 30·cos(ωt + 60°) µm, with a mark that rises at the start of each:

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> t = np.arange(2000) / 10_000
    >>> turns = 50 * t % 1
    >>> samples = 30 * np.cos(2 * np.pi * turns + np.pi / 3)
    >>> rows = zip(t.tolist(), (turns < 0.5).astype(int).tolist(), samples.tolist())
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "recording.csv")
    ...     _ = table.write_text("t_s,mark,A_um\\n" + "\\n".join(f"{t},{m},{s}" for t, m, s in rows))
    ...     recording = read_recording(str(table))
    >>> recording.sensors, recording.unit, np.abs(recording.vectors.vector).round(1)
    (['A'], 'um', array([30.]))
    """
    # below lines of a title the header is the line with these
    expected = {"t": "time", "time": "time", **dict.fromkeys(MARKS, "number")}
    source = open_source(path, expected, ())
    file, header = source.file, _without_volts([each.name for each in source.headings])
    marks = sorted((name.lower() for name in header if name.lower() in MARKS), key=MARKS.index)
    if not marks:
        raise DataError(
            f"{file}: no column mark (or {', '.join(MARKS[1:])}); the header is: {', '.join(header)}"
        )
    mark, *others = marks
    if len(others) > 1:
        raise DataError(f"{file}: the columns {', '.join(marks)}: expected a mark and one tacho")
    if others and pulses > 1:
        raise ValueError(f"{file} has a mark and a tacho: the pulses of a turn are counted")
    time = "t" if any(name.lower().startswith("t_") for name in header) else "time"
    units = _vibration(file, header, (time, *marks))
    unit = next(iter(units.values()))
    numbers = {time: "time", **dict.fromkeys(marks, "number"), **dict.fromkeys(units, "amplitude")}
    table = read(path, numbers=numbers, needed=[(time,)], headers=_without_volts)
    t = table.require(time, "time")
    signal = np.stack([table.numbers[name].values for name in units], axis=1)
    tacho = others[0] if others else None
    try:
        result = once_per_turn(
            t.si, signal, table.numbers[mark].values, pulses, table.numbers[tacho].values if tacho else None
        )
    except ValueError as error:
        raise DataError(f"{table.file}: {error}") from None
    written = {name.lower(): name for name in header}
    sensors = [
        "1" if name == "amplitude" else written[f"{name}_{of.lower()}"][: len(name)]
        for name, of in units.items()
    ]
    if pulses > 1:
        table.warnings.append(
            f"{table.file}: phases count from the first of {pulses} pulses in the recording, and another recording may begin at "
            "another one: add a column mark, once in a turn, in addition to the tacho"
        )
    if result.phase_resolution > FINE:
        table.warnings.append(
            f"{table.file}: the mark rises between two samples: phases hold to "
            f"± {np.degrees(result.phase_resolution):.2g}°; more samples in each turn reduce this"
        )
    if result.speed_deviation > STEADY * result.speed:
        table.warnings.append(
            f"{table.file}: the speed varies (standard deviation {100 * result.speed_deviation / result.speed:.2g} %), and the "
            "vectors are means over it: near a resonance record at a steady speed"
        )
    for sensor, samples in zip(sensors, signal.T, strict=True):
        if share := _clipped(samples):
            table.warnings.append(
                f"{table.file}: {share:.0%} of the samples of {sensor} have its largest or smallest value: the recording is "
                "clipped, and the amplitude too small; record with a larger range"
            )
        k, shift = sensors.index(sensor), _drift(t.si, samples, result) / np.pi
        # what scatters from turn to turn is in the uncertainty
        if shift > max(DRIFT * abs(result.vector[k]), 3 * result.deviation[k]):
            table.warnings.append(
                f"{table.file}: the level of {sensor} drifts: the amplitude may be off by {shift:.2g} {unit} for it; record without the "
                "offset (AC coupling, a high-pass filter)"
            )
    exact = partial(_exact, table, (time, mark, tacho), list(units), pulses)
    return Recording(sensors, unit, result, table.warnings, exact)


def _drift(t: NDArray[np.float64], samples: NDArray[np.float64], of: OncePerTurn) -> float:
    """Return how far the level of a signal drifts in a turn, by the means of two equal numbers of turns; a ramp of this size adds
    1/π of it to the first order.

    >>> import numpy as np
    >>> from balancing import once_per_turn
    >>> t = np.arange(0, 1, 0.001)
    >>> turns = once_per_turn(t, np.cos(40 * np.pi * t)[:, None], np.sin(40 * np.pi * t))
    >>> round(_drift(t, np.cos(40 * np.pi * t) + 2 * t, turns), 3)
    0.1
    """
    import numpy as np

    half = of.turns // 2
    if not half:
        return 0.0
    begin, middle, end = np.searchsorted(t, t[0] + 2 * np.pi / of.speed * half * np.arange(3))
    return abs(float(samples[middle:end].mean() - samples[begin:middle].mean())) / half


def _clipped(samples: NDArray[np.float64]) -> float:
    """Return the share of samples at the largest or the smallest value; 0 where a sine in steps as fine has a third as many.

    >>> sine = np.cos(np.arange(1000) / 9)
    >>> _clipped(sine), round(_clipped(np.clip(sine, -0.8, 1)), 2), _clipped(sine.round(1))
    (0.0, 0.21, 0.0)
    """
    values, counts = np.unique(samples, return_counts=True)
    if len(values) < 3:
        return 0.0
    steps = np.array([values[1] - values[0], values[-1] - values[-2]]) / (values[-1] - values[0])
    expected, shares = np.arccos(1 - 2 * steps) / np.pi, counts[[0, -1]] / len(samples)
    return float(shares[shares > np.maximum(3 * expected, 0.01)].sum())


def _without_volts(header: list[str]) -> list[str]:
    """Return a header in which a mark has no unit: `keyphasor_V` is keyphasor.

    >>> _without_volts(["t_s", "keyphasor_V", "A_mV"])
    ['t_s', 'keyphasor', 'A_mV']
    """
    parts = [(name, *name.rpartition("_")[::2]) for name in header]
    return [
        mark if mark.lower() in MARKS and find_unit("amplitude", unit) in AMPLITUDES["voltage"] else name
        for name, mark, unit in parts
    ]


def _vibration(file: str, header: list[str], others: tuple[str, ...]) -> dict[str, str]:
    """The columns of vibration: name -> unit, one unit for all."""
    units: dict[str, str] = {}
    for name in header:
        parts = name.split("_")
        for k in range(1, len(parts)):
            unit = find_unit("amplitude", "_".join(parts[k:]))
            if unit and parts[0].lower() not in others:
                units["_".join(parts[:k]).lower()] = unit
                break
    if not units:
        raise DataError(
            f"{file}: no column of vibration, such as A_um or acceleration_g; the header is: {', '.join(header)}"
        )
    if len(set(units.values())) > 1:
        raise DataError(
            f"{file}: the vibration is in {', '.join(sorted(set(units.values())))}: expected one unit"
        )
    unit = next(iter(units.values()))
    tag = amplitude_kind(unit)[1]
    if tag in ("_pp", "_rms"):
        raise DataError(
            f"{file}: the vibration is in {unit}: samples are values of an instant, and the amplitude "
            f"that comes out is a peak: expected a unit without {tag}"
        )
    return units


def _exact(
    table: Table, names: tuple[str, str, str | None], sensors: list[str], pulses: int
) -> tuple[Any, ...]:
    """The recording in 32 digits, as `OncePerTurn.second_run` takes it; `names` of time, mark and tacho."""
    from dalembert.tables.exact import long_column

    t, mark, tacho = (None if name is None else table.numbers[name] for name in names)
    assert t is not None
    above, below = UNITS["time"][t.unit]
    level, other = (None if column is None else long_column(column) for column in (mark, tacho))
    signals: Any = np.stack([long_column(table.numbers[name]) for name in sensors], axis=1)
    return long_column(t) * float(above) / float(below), signals, level, pulses, other
