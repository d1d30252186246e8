"""Results of a flywheel: one row of results, and the energy along the turns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cli.flywheel.turns import Flywheel
from dalembert.results.columns import Table, names, number

METHOD = (
    "The load is constant, the mean torque T̄. E(θ) = ∫ (T − T̄) dθ with T linear between rows; the flywheel's moment of "
    "inertia is I = (E_max − E_min)/(C·ω²), C = (ω_max − ω_min)/ω (R. L. Norton, Design of Machinery, §11.11)."
)


def tables(wheel: Flywheel) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    return {"flywheel": lambda: results(wheel), "energy": lambda: energy(wheel)}


def results(wheel: Flywheel) -> Table:
    """One row."""
    c, unit = wheel.cycle, wheel.torque_unit
    peak = int(np.argmax(np.abs(wheel.torque)))
    turn = 2 * np.pi * wheel.turns

    def one(name: str, dimension: str, value: float, error: float, shown: str = ""):  # type: ignore[no-untyped-def]
        return number(name, dimension, [value], shown, lambda: np.array([error]))

    columns = [
        one("mean_torque", "torque", c.mean, c.rounding / turn, unit),
        one("work", "energy", c.work, c.rounding),
        one("energy_fluctuation", "energy", c.fluctuation, 2 * c.rounding),
        one(
            "flywheel_inertia",
            "inertia",
            wheel.inertia,
            2 * c.rounding / (wheel.coefficient * wheel.speed**2),
        ),
        number("peak_torque", "torque", wheel.torque[[peak]], unit),
        number("peak_torque_angle", "angle", wheel.angle[[peak]]),
        number("mean_power", "power", [c.mean * wheel.speed]),
    ]
    if not wheel.constant:
        columns += [
            number("fastest_angle", "angle", [np.degrees(c.fastest)]),
            number("slowest_angle", "angle", [np.degrees(c.slowest)]),
        ]
    turns = "one turn" if wheel.turns == 1 else f"{wheel.turns} turns"
    return Table(columns, place="", above=f"over {turns} of the shaft, against a constant load:", documented=[names("turns", [wheel.turns])])  # fmt: skip


def energy(wheel: Flywheel) -> Table:
    """A row for each row of the table: E, from zero at the first."""
    E = wheel.cycle.energy
    columns = [
        number("angle", "angle", wheel.angle),
        number("torque", "torque", wheel.torque, wheel.torque_unit),
        number("energy", "energy", np.where(np.abs(E) > wheel.cycle.rounding, E, 0.0)),
    ]
    return Table(columns, ("angle_deg",), "cycle[]", "of the flywheel, from zero in the first row")


def warnings(wheel: Flywheel) -> list[str]:
    """What a reader of the result has to know."""
    lines = []
    if wheel.constant:
        lines.append("the torque does not vary: there is nothing for a flywheel to store")
    first, last = float(wheel.torque[0]), float(wheel.torque[-1])
    if abs(first - last) > 1e-6 * float(np.abs(wheel.torque).max()):
        lines.append(
            f"the torque of the last row ({last:g} N·m) is not that of the first ({first:g} N·m): a step between one cycle "
            "and the next"
        )
    return lines
