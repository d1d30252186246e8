"""What precedes balancing in the field: a trial mass for the first run, and the readings of a recorded vibration."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from balancing import trial_unbalance
from balancing.trial import load_rule
from dalembert.angles import degrees
from dalembert.arithmetic.doubled import Doubled
from dalembert.results.columns import Column, Table, apart, names, number
from dalembert.results.way import Topic, figures
from dalembert.tables.exact import quantity, written
from dalembert.units import G0
from dalembert.units import written as unit_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from balancing.runs.recording import Recording

RULE = "centrifugal force a tenth of the static load of each plane: m r ω² = 0.1 (M/planes) g"


def suggestion(mass: float, omega: float, arm: float, options: SimpleNamespace) -> Table:
    """The table: mass and unbalance for each plane; their errors from the options as they are written."""

    def exact() -> Doubled:
        numbers = (
            quantity(options.rotor_mass, "mass"),
            quantity(options.speed, "speed"),
            float(options.planes),
        )
        result: Doubled = load_rule(*numbers, *(Doubled.of(written(x)) for x in (0.1, G0)))
        return result

    unbalance = float(trial_unbalance(mass, omega, options.planes))
    return Table(
        [
            number(
                "mass",
                "mass",
                [unbalance / arm],
                "g",
                exact=lambda: exact() / quantity(options.radius, "length"),
            ),
            number("radius", "length", [arm], "mm"),
            number("unbalance", "unbalance", [unbalance], "g_mm", exact=exact),
        ],
        place="trial",
        above="trial mass for each plane",
        below=f"rule: {RULE}",
        documented=[names("planes", [options.planes]), names("rule", [RULE])],
    )


def way_of_trial(mass: float, omega: float, arm: float, planes: int) -> list[Topic]:
    """The worked solution of a trial mass: one topic, in SI."""
    unbalance = float(trial_unbalance(mass, omega, planes))
    load = mass / planes * G0
    text = [
        "A tenth of the static load of each plane as centrifugal force: m·r·ω² = 0.1·(M/planes)·g",
        f"  (M/planes)·g = {figures(mass)}/{planes}·{figures(G0)} = {figures(load)} N",
        f"  m·r = 0.1·{figures(load)}/{figures(omega)}² = {figures(unbalance)} kg·m",
        f"  m = {figures(unbalance)}/{figures(arm)} = {figures(unbalance / arm)} kg",
    ]
    head = {
        "static_load_N": load,
        "force_N": unbalance * omega**2,
        "unbalance_kg_m": unbalance,
        "mass_kg": unbalance / arm,
    }
    return [Topic("trial mass", text, "Trial mass", head)]


def vectors(recording: Recording) -> Table:
    """A row for each sensor."""
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


def way_of_recording(recording: Recording) -> list[Topic]:
    """The worked solution of a recording: one topic."""
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
            f"  {sensor}: ({figures(v.real)}, {figures(v.imag)}) = {figures(abs(v))} ∠ {figures(angle)}° {unit_text(recording.unit)}"
        )
        entries.append({"sensor": sensor, "x": v.real, "y": v.imag, "amplitude": abs(v), "phase_deg": angle})
    head = {"turns": int(of.turns), "speed_rad_s": float(of.speed), "sensors": entries}
    return [Topic("vectors", text, "Vectors once per turn", head)]
