"""From a table of torque over whole turns to the flywheel, in SI; its tables, picture and worked solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, floor, pi
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing.flywheel import TorqueCycle, torque_cycle
from dalembert.arithmetic.shapes import is_doubled
from dalembert.drawing.curves import Curve, panel, spread
from dalembert.drawing.sheet import blank, sheet
from dalembert.errors import DataError
from dalembert.figures import last_place
from dalembert.results.columns import Table, computed, names, number
from dalembert.results.way import Topic, figures
from dalembert.tables.table import Numbers, read
from dalembert.tables.table import Table as ReadTable
from dalembert.units import to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Real = NDArray[np.float64]

WHOLE = 1e-9
"""Degrees miss a whole number of turns by no more than this share."""


@dataclass(eq=False, repr=False)
class Flywheel:
    """A torque over whole turns, the speed of the shaft and its fluctuation."""

    table: ReadTable
    angle: Real
    """As the table has it, degrees."""
    turns: int
    torque: Real
    torque_unit: str
    speed: float
    coefficient: float

    @cached_property
    def second(self) -> Flywheel:
        """The flywheel in 32 digits, with the decimals of the table and of the options exact."""
        from dalembert.tables.exact import array, as_written, rates

        angle, torque = (self.table.numbers[name] for name in ("angle", "torque"))
        exact: dict[str, Any] = {
            "angle": _in_degrees(as_written(angle), angle.unit, self.turns),
            "torque": as_written(torque),
            "speed": rates(self.speed),
            "coefficient": array(self.coefficient),
        }
        return replace(self, **exact)

    @cached_property
    def cycle(self) -> TorqueCycle:
        """Work, fluctuation of energy."""
        return torque_cycle(
            self.angle * pi / 180.0 if is_doubled(self.angle) else np.radians(self.angle), self.torque
        )

    @property
    def inertia(self) -> float:
        """Moment of inertia of the flywheel, kg·m²."""
        return self.cycle.inertia(self.speed, self.coefficient)

    @property
    def constant(self) -> bool:
        """Whether the torque does not vary."""
        return float(np.ptp(self.torque)) == 0.0


def read_torque(path: str, speed: float, coefficient: float) -> Flywheel:
    """Read angle_* and torque_*.

    Raises
    ------
    DataError
        Angles that fall, or that do not span whole turns: the message says what would be whole.
    """
    table = read(path, numbers={"angle": "angle", "torque": "torque"}, needed=[("angle",), ("torque",)])
    angle, torque = table.require("angle", "angle"), table.require("torque", "torque")
    falls = np.concatenate([[False], np.diff(angle.values) < 0])
    table.reject(falls, "angle", "an angle that is not less than that of the row before")
    turns = _whole_turns(table, angle)
    shown = angle.values if angle.unit == "deg" else np.degrees(angle.si)
    degrees = _in_degrees(shown, angle.unit, turns)
    return Flywheel(table, degrees, turns, torque.si, torque.unit, speed, coefficient)


def _in_degrees(angle: Any, unit: str, turns: int) -> Any:
    """Return angles in degrees whose ends are whole turns apart: radians are written rounded."""
    if unit == "deg":
        return angle
    share = (angle - angle[0]) / (angle[-1] - angle[0])
    return angle[0] + 360.0 * turns * share


def _whole_turns(table: ReadTable, angle: Numbers) -> int:
    """Return how many turns the rows span."""
    first, last = float(angle.values[0]), float(angle.values[-1])
    turn = 360.0 if angle.unit == "deg" else 2 * pi / float(to_si(1.0, "angle", angle.unit))
    span = (last - first) / turn
    off = WHOLE * max(span, 1.0) if angle.unit == "deg" else _digit(table) / turn
    turns = round(span)
    if turns and abs(span - turns) <= off:
        return turns
    ends = [first + turn * k for k in sorted({max(floor(span), 1), max(ceil(span), 1)})]
    whole = " or ".join(f"{end:.6g} {angle.unit}" for end in ends)
    steps = np.diff(angle.values)
    step = float(steps.mean()) if len(steps) else 0.0
    missing = ""
    if step and np.allclose(steps, step, rtol=1e-6) and abs(last + step - ends[-1]) < 1e-3 * step:
        missing = f": the last row is missing, where the torque is that of {first:g} {angle.unit} again"
    raise DataError(
        f"{table.file}: column {angle.header}: found {first:.10g} to {last:.10g} {angle.unit}, not whole turns of the shaft; "
        f"expected a last row at {whole}{missing}"
    )


def _digit(table: ReadTable) -> float:
    """Return the last printed digits of the ends together, at most a thousandth of a turn."""
    places = [last_place(table.written(row, "angle")) for row in (0, table.rows - 1)]
    return min(sum(10.0**place for place in places if place), 2 * pi / 1000)


METHOD = (
    "The load is constant, the mean torque T̄. E(θ) = ∫ (T − T̄) dθ with T linear between rows; the flywheel's moment of "
    "inertia is I = (E_max − E_min)/(C·ω²), C = (ω_max − ω_min)/ω (R. L. Norton, Design of Machinery, §11.11)."
)


def tables(wheel: Flywheel) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    return {"flywheel": lambda: results(wheel), "energy": lambda: energy(wheel)}


def results(wheel: Flywheel) -> Table:
    """One row."""
    unit, peak = wheel.torque_unit, int(np.argmax(np.abs(wheel.torque)))
    columns = [
        computed(wheel, "mean_torque", "torque", lambda w: w.cycle.mean, unit),
        computed(wheel, "work", "energy", lambda w: w.cycle.work),
        computed(wheel, "energy_fluctuation", "energy", lambda w: w.cycle.fluctuation),
        computed(wheel, "flywheel_inertia", "inertia", lambda w: w.inertia),
        computed(wheel, "peak_torque", "torque", lambda w: w.torque[peak], unit),
        computed(wheel, "peak_torque_angle", "angle", lambda w: w.angle[peak]),
        computed(wheel, "mean_power", "power", lambda w: w.cycle.mean * w.speed),
    ]
    if not wheel.constant:
        columns += [
            computed(wheel, "fastest_angle", "angle", lambda w: w.cycle.fastest * 180.0 / np.pi),
            computed(wheel, "slowest_angle", "angle", lambda w: w.cycle.slowest * 180.0 / np.pi),
        ]
    turns = "one turn" if wheel.turns == 1 else f"{wheel.turns} turns"
    return Table(columns, place="", above=f"over {turns} of the shaft, against a constant load:", documented=[names("turns", [wheel.turns])])  # fmt: skip


def energy(wheel: Flywheel) -> Table:
    """A row for each row of the table: E, from zero at the first."""

    def stored(w: Flywheel) -> Any:
        E = w.cycle.energy
        return E if is_doubled(E) else np.where(np.abs(E) > w.cycle.negligible, E, 0.0)

    columns = [
        computed(wheel, "angle", "angle", lambda w: w.angle),
        computed(wheel, "torque", "torque", lambda w: w.torque, wheel.torque_unit),
        computed(wheel, "energy", "energy", stored),
    ]
    return Table(columns, ("angle_deg",), "cycle[]", "of the flywheel, from zero in the first row")


def warnings(wheel: Flywheel) -> list[str]:
    """Warnings about the torque."""
    lines = []
    if wheel.constant:
        lines.append("the torque does not vary: there is nothing for a flywheel to store")
    if wheel.coefficient > 0.5:
        lines.append(
            f"a fluctuation of {wheel.coefficient:g} is {wheel.coefficient:.0%} of the mean speed: 2 % is written 2% or 0.02"
        )
    first, last = float(wheel.torque[0]), float(wheel.torque[-1])
    if abs(first - last) > 1e-6 * float(np.abs(wheel.torque).max()):
        lines.append(
            f"the torque of the last row ({last:g} N·m) is not that of the first ({first:g} N·m): a step between one cycle "
            "and the next"
        )
    return lines


def draw(wheel: Flywheel) -> Figure:
    """Draw torque and energy over the angle."""
    figure = blank()
    sheet(7.5, 5.6, figure)
    above, below = figure.subplots(2, 1, sharex=True)
    c, angle = wheel.cycle, wheel.angle
    first = panel(
        above,
        angle,
        [Curve("torque", wheel.torque), Curve("mean", np.full(len(angle), c.mean), level=True)],
        "torque",
        "N·m",
    )
    # parabolas between rows
    fine = np.unique(
        np.concatenate([np.linspace(angle[0], angle[-1], 721), angle, np.degrees([c.fastest, c.slowest])])
    )
    k = np.clip(np.searchsorted(angle, fine, side="right") - 1, 0, len(angle) - 2)
    width = angle[k + 1] - angle[k]
    share = np.divide(fine - angle[k], width, out=np.zeros_like(fine), where=width > 0)
    over = wheel.torque - c.mean
    here = over[k] + share * (over[k + 1] - over[k])
    values = c.energy[k] + (over[k] + here) / 2 * np.radians(fine - angle[k])
    second = panel(below, fine, [Curve("energy", values)], "energy of the flywheel", "J", c.negligible)
    low, high = float(values.min()), float(values.max())
    scale = below.lines[0].get_ydata()
    if low < high:
        for level in (np.min(scale), np.max(scale)):
            below.axhline(float(level), color="0.5", lw=0.8, ls=":")
    below.set_title(f"between the dotted lines: {c.fluctuation:.4g} J", fontsize=9, loc="left")
    below.set_xlabel("angle of the shaft, deg")
    # quarter turns of one or two turns
    below.set_xticks(angle[0] + 90.0 * np.ceil(wheel.turns / 2) * np.arange(0, 9))
    below.set_xlim(angle[0], angle[-1])
    spread([first, second])
    return figure


def way(wheel: Flywheel) -> list[Topic]:
    """The worked solution."""
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
