"""`dalembert signal`: amplitude and phase of a recorded vibration, a row for the log of each sensor."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.result import Result
    from cli.signal.recording import Recording
    from dalembert.results.columns import Table

OPTIONS = """
Arguments:
  recording FILE  CSV of a recording: t_s, mark (or tacho), A_um …; - is standard input.
What:
  pulses N  Number of pulses of the mark in one turn.
"""


@command(OPTIONS)
def run(
    recording: str,
    pulses: Annotated[int, typer.Option(min=1, max=10000)] = 1,
) -> Result:
    """Compute amplitude and phase of a recorded vibration, once per turn.

    FILE has the columns t_*, mark (once per turn; tacho, keyphasor, pulse and trigger are other names) and a column of
    vibration for each sensor: A_um, B_um, acceleration_m_s2. The rows of the result are readings for dalembert field.
    """
    from cli.show.result import Result
    from cli.signal.recording import read_signal, way

    read = read_signal(recording, pulses)

    return Result(
        way=partial(way, read),
        tables={"signal": lambda: vectors(read)},
        head={"amplitude_unit": read.unit},
        about={"title": "Vibration once per turn"},
        warnings=read.warnings,
    )


def vectors(recording: Recording) -> Table:
    """One row per sensor."""
    import numpy as np

    from dalembert.angles import degrees
    from dalembert.arithmetic.doubled_vectors import off
    from dalembert.results.columns import Column, Table, names, number

    of, unit = recording.vectors, recording.unit
    rows = len(recording.sensors)
    size = np.abs(of.vector)

    def sizes() -> Any:
        return off(size, recording.second.vector.vectors.size)

    def deviations() -> Any:
        return off(of.deviation, recording.second.deviation.doubled)

    return Table(
        [
            names("sensor", recording.sensors),
            number("speed", "speed", [of.speed] * rows, "rpm", exact=lambda: recording.second.speed.doubled),
            Column("amplitude", unit, size, sizes, "amplitude", size),
            number(
                "phase", "angle", degrees(of.vector), exact=lambda: recording.second.vector.vectors.degrees
            ),
            Column(
                "amplitude_uncertainty", unit, of.deviation, deviations, "amplitude_uncertainty", of.deviation
            ),
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
