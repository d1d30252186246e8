"""`dalembert trial`: a trial mass for the first run."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import needed
from cli.show.output import command
from dalembert.results.columns import Table, names, number
from dalembert.results.way import Topic, figures
from dalembert.units import G0

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.results.columns import Table
    from dalembert.results.result import Result


RULE = "centrifugal force a tenth of the static load of each plane: m r ω² = 0.1 (M/planes) g"
OPTIONS = """
What:
  rotor_mass MASS  Mass of the rotor, such as 120kg. [required]
  speed SPEED  Speed of the run, such as 3000rpm. [required]
  radius LENGTH  Radius of the trial mass, such as 200mm. [required]
  planes N=1  Number of correction planes.
"""


@command(OPTIONS, without=("column", "plot"))
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Suggest a trial mass for the first run: large enough to change the vibration, small enough to be safe.

    Its centrifugal force is a tenth of the static load of each plane.
    """
    from dalembert.results.result import Result

    mass = needed("--rotor-mass", options.rotor_mass, "mass", positive=True)
    omega = needed("--speed", options.speed, "speed", positive=True)
    arm = needed("--radius", options.radius, "length", positive=True)

    def suggestion() -> Table:
        from balancing import trial_unbalance
        from balancing.trial import load_rule

        def exact() -> Doubled:
            from dalembert.arithmetic.doubled import Doubled
            from dalembert.tables.exact import quantity, written

            numbers = (
                quantity(options.rotor_mass, "mass"),
                quantity(options.speed, "speed"),
                float(options.planes),
            )
            result: Doubled = load_rule(*numbers, *(Doubled.of(written(x)) for x in (0.1, G0)))
            return result

        def mass_exact() -> Doubled:
            from dalembert.tables.exact import quantity

            return exact() / quantity(options.radius, "length")

        unbalance = float(trial_unbalance(mass, omega, options.planes))
        return Table(
            [
                number("mass", "mass", [unbalance / arm], "g", exact=mass_exact),
                number("radius", "length", [arm], "mm"),
                number("unbalance", "unbalance", [unbalance], "g_mm", exact=exact),
            ],
            place="trial",
            above="trial mass for each plane",
            below=f"rule: {RULE}",
            documented=[names("planes", [options.planes]), names("rule", [RULE])],
        )

    def steps() -> list[Topic]:
        from balancing import trial_unbalance

        return way(mass, omega, arm, options.planes, float(trial_unbalance(mass, omega, options.planes)))

    return Result(
        tables={"trial": suggestion}, way=steps, about={"title": "Trial mass"}, method=f"Rule: {RULE}."
    )


def way(mass: float, omega: float, arm: float, planes: int, unbalance: float) -> list[Topic]:
    """The worked solution: one topic, in SI."""
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
