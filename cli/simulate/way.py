"""The worked solution of `dalembert simulate`: the equation of motion at the start, and the balance of energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from virtualwork.describe.parts import Input
    from virtualwork.intime.run import Run


def way(run: Run, inputs: Sequence[Input]) -> list[Topic]:
    """The topics."""
    q, v, a = (np.asarray(each, dtype=float) for each in (run.angle[0], run.speed[0], run.acceleration[0]))
    law = [
        "The inputs are free: by d'Alembert's principle M(q)·q̈ + h(q, q̇, t) = 0, the effort at every input being nothing "
        "(Riul, unit II, eq. 5, solved for the accelerations).",
    ]
    for entry, place, speed, rate in zip(inputs, q.tolist(), v.tolist(), a.tolist(), strict=True):
        unit = "m" if entry.is_slide else "rad"
        law.append(
            f"  at t = {figures(float(run.t[0]))} s: {entry.name} = {figures(place)} {unit}, speed {figures(speed)} {unit}/s, "
            f"acceleration {figures(rate)} {unit}/s²"
        )
    energy = np.asarray(run.energy, dtype=float)
    first, last = float(energy[0]), float(energy[-1])
    drift = float(np.abs(run.energy_drift).max())
    balance = [
        f"E = T + V (gravity, springs): {figures(first)} J at t = {figures(float(run.t[0]))} s, "
        f"{figures(last)} J at t = {figures(float(run.t[-1]))} s",
        f"  E_end − E_start = {figures(last - first)} J is the work of applied loads, dampers and friction; unexplained {figures(drift)} J",
    ]
    start = {"angle": q.tolist(), "speed": v.tolist(), "acceleration": a.tolist()}
    head = {"start_J": first, "end_J": last, "energy_drift_J": drift}
    return [Topic("start", law, "Equation of motion", start), Topic("energy", balance, "Energy", head)]
