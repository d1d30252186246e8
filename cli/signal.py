"""`dalembert signal`: amplitude and phase of a recorded vibration, a row for each sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from cli.read.options import bad
from cli.show.output import command
from dalembert.angles import degrees
from dalembert.errors import DataError
from dalembert.units import AMPLITUDES, UNITS, amplitude_kind, find_unit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from balancing.synchronous import OncePerTurn
    from cli.show.commands import ShowOptions
    from cli.show.result import Result
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.results.columns import Table
    from dalembert.results.way import Topic
    from dalembert.tables.table import Table as ReadTable

OPTIONS = """
Arguments:
  recording FILE  CSV of a recording: t_s, mark (or tacho), A_um …; - is standard input.
What:
  pulses N(1-10000)=1  Number of pulses of the mark in one turn.
"""
FINE = 1e-4
"""Phases that hold to this, rad, come without a warning."""
STEADY = 0.02
"""Turns whose speeds have a larger standard deviation, relatively, come with a warning."""
DRIFT = 0.01
"""Drifts that may change an amplitude by a larger share come with a warning."""
MARKS = ("mark", "tacho", "keyphasor", "pulse", "trigger")


@command(OPTIONS, without=("plot",))
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Compute amplitude and phase of a recorded vibration, once per turn.

    FILE has the columns t_*, mark (once per turn; tacho, keyphasor, pulse and trigger are other names) and a column of
    vibration for each sensor: A_um, B_um, acceleration_m_s2. The rows of the result are readings for dalembert field.
    """
    from cli.show.result import Result

    read = read_recording(options.recording, options.pulses)

    return Result(
        way=partial(way, read),
        tables={"signal": lambda: vectors(read)},
        head={"amplitude_unit": read.unit},
        about={"title": "Vibration once per turn"},
        warnings=read.warnings,
    )


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


def read_recording(path: str, pulses: int) -> Recording:
    """Read the time, a mark, perhaps a tacho, and the vibration of each sensor; compute the vibration once per turn.

    Raises
    ------
    DataError
        A missing column, vibration in several units or in peak-to-peak values, no whole turn.
    """
    import numpy as np

    from balancing.synchronous import once_per_turn
    from dalembert.tables.sources import open_source
    from dalembert.tables.table import read

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
        raise bad("--pulses", f"{file} has a mark and a tacho: the pulses of a turn are counted")
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
        k, change = sensors.index(sensor), _drift(t.si, samples, result) / np.pi
        # what scatters from turn to turn is in the uncertainty
        if change > max(DRIFT * abs(result.vector[k]), 3 * result.deviation[k]):
            table.warnings.append(
                f"{table.file}: the level of {sensor} drifts: the amplitude may be off by {change:.2g} {unit} for it; record without the "
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

    >>> import numpy as np
    >>> sine = np.cos(np.arange(1000) / 9)
    >>> _clipped(sine), round(_clipped(np.clip(sine, -0.8, 1)), 2), _clipped(sine.round(1))
    (0.0, 0.21, 0.0)
    """
    import numpy as np

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
    table: ReadTable, names: tuple[str, str, str | None], sensors: list[str], pulses: int
) -> tuple[Any, ...]:
    """The recording in 32 digits, as `OncePerTurn.second_run` takes it; `names` of time, mark and tacho."""
    import numpy as np

    from dalembert.tables.exact import long_column

    t, mark, tacho = (None if name is None else table.numbers[name] for name in names)
    assert t is not None
    above, below = UNITS["time"][t.unit]
    level, other = (None if column is None else long_column(column) for column in (mark, tacho))
    signals: Any = np.stack([long_column(table.numbers[name]) for name in sensors], axis=1)
    return long_column(t) * float(above) / float(below), signals, level, pulses, other


def vectors(recording: Recording) -> Table:
    """A row for each sensor."""
    import numpy as np

    from dalembert.results.columns import Column, Table, apart, names, number

    of, unit = recording.vectors, recording.unit
    rows = len(recording.sensors)

    def column(name: str, values: NDArray[np.float64], exact: Callable[[], Doubled]) -> Column:
        return Column(name, unit, values, apart(values, "number", "", exact), name, values)

    return Table(
        [
            names("sensor", recording.sensors),
            number("speed", "speed", [of.speed] * rows, "rpm", exact=lambda: recording.second.speed.doubled),
            column("amplitude", np.abs(of.vector), lambda: recording.second.vector.size),
            number("phase", "angle", degrees(of.vector), exact=lambda: recording.second.vector.degrees),
            column("amplitude_uncertainty", of.deviation, lambda: recording.second.deviation.doubled),
            names("turns", [of.turns] * rows),
        ],
        keys=("sensor",),
        place="signal[]",
        above="amplitude of a·cos(ωt + phase), t = 0 at the mark; the mean of single turns",
        documented=[
            number("phase_resolution", "angle", [float(np.degrees(of.phase_resolution))] * rows),
            number("speed_sd", "speed", [of.speed_deviation] * rows),
        ],
    )


def way(recording: Recording) -> list[Topic]:
    """The worked solution: one topic."""

    from dalembert.results.way import Topic, figures
    from dalembert.units import written

    of = recording.vectors
    text = [
        f"Turns between marks: {of.turns}; ω = 2π/T = {figures(float(of.speed))} rad/s.",
        "In each turn a·cos(ωt + phase) is fitted: x = a·cos(phase) = (2/T)∫ s·cos ωt dt, y = a·sin(phase) = −(2/T)∫ s·sin ωt dt; "
        "the vectors of all turns are averaged.",
    ]
    entries = []
    for sensor, v in zip(recording.sensors, of.vector.tolist(), strict=True):
        angle = degrees(v)
        text.append(
            f"  {sensor}: ({figures(v.real)}, {figures(v.imag)}) = {figures(abs(v))} ∠ {figures(angle)}° {written(recording.unit)}"
        )
        entries.append({"sensor": sensor, "x": v.real, "y": v.imag, "amplitude": abs(v), "phase_deg": angle})
    head = {"turns": int(of.turns), "speed_rad_s": float(of.speed), "sensors": entries}
    return [Topic("vectors", text, "Vectors once per turn", head)]
