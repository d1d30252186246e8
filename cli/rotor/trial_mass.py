"""A trial mass for the first run in the field: its table and worked solution."""

from __future__ import annotations

from types import SimpleNamespace

from balancing import trial_unbalance
from balancing.trial import load_rule
from dalembert.arithmetic.doubled import Doubled
from dalembert.results.columns import Table, names, number
from dalembert.results.way import Topic, figures
from dalembert.tables.exact import quantity, written
from dalembert.units import G0

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


def way(mass: float, omega: float, arm: float, planes: int) -> list[Topic]:
    """The worked solution: one topic, in SI."""
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
