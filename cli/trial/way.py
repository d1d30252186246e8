"""The worked solution of `dalembert trial`: the rule with its numbers."""

from __future__ import annotations

from dalembert.results.way import Topic, figures
from dalembert.units import G0


def way(mass: float, omega: float, arm: float, planes: int, unbalance: float) -> list[Topic]:
    """The one topic; all in SI."""
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
