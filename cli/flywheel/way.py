"""The worked solution of `dalembert flywheel`: mean torque, energy above it row by row, moment of inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dalembert.results.columns import Table, number
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from cli.flywheel.turns import Flywheel


def way(wheel: Flywheel) -> list[Topic]:
    """The topics."""
    cycle = wheel.cycle
    span = float(np.radians(wheel.angle[-1] - wheel.angle[0]))
    mean = [
        f"W = ∫ T dθ = {figures(cycle.work)} J over {figures(span)} rad (between rows T is a straight line)",
        f"T̄ = W/θ = {figures(cycle.work)}/{figures(span)} = {figures(cycle.mean)} N·m",
    ]
    rows = Table(
        [
            number("angle", "angle", wheel.angle),
            number("torque", "torque", wheel.torque),
            number("excess", "torque", wheel.torque - cycle.mean),
            number("energy", "energy", cycle.energy),
        ],
        ("angle_deg",),
        "rows[]",
    )
    fast, slow = np.degrees([cycle.fastest, cycle.slowest]).tolist()
    energy: list[str | Table] = [
        "E(θ) = ∫ (T − T̄) dθ: what the flywheel takes up (Norton, Design of Machinery, §11.11)",
        rows,
        f"ΔE = E_max − E_min = {figures(cycle.fluctuation)} J, from {figures(slow)}° (slowest) to {figures(fast)}° (fastest)",
    ]
    inertia = [
        f"I = ΔE/(C·ω²) = {figures(cycle.fluctuation)}/({figures(wheel.coefficient)}·{figures(wheel.speed)}²) = {figures(wheel.inertia)} kg·m²"
    ]
    return [
        Topic("mean torque", mean, "Mean torque", {"work_J": cycle.work, "span_rad": span, "mean_torque_N_m": cycle.mean}),
        Topic("energy", energy, "Energy above the mean", {"energy_fluctuation_J": cycle.fluctuation}),
        Topic("inertia", inertia, "Moment of inertia", {"flywheel_inertia_kg_m2": wheel.inertia}),
    ]  # fmt: skip
