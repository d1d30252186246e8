"""The worked solution of `dalembert signal`: one turn's Fourier coefficient at the speed, the mean over turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dalembert.angles import degrees
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from cli.signal.recording import Recording


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
