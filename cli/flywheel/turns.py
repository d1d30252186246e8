"""From a table of torque over whole turns to the flywheel, in SI."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from functools import cached_property
from math import ceil, floor, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing.flywheel import TorqueCycle, torque_cycle
from dalembert.arithmetic.shapes import is_doubled
from dalembert.errors import DataError
from dalembert.tables.table import Numbers, Table, read
from dalembert.units import to_si

Real = NDArray[np.float64]

WHOLE = 1e-9
"""Degrees miss a whole number of turns by no more than this share."""


@dataclass(eq=False, repr=False)
class Flywheel:
    """A torque over whole turns, the speed of the shaft and its fluctuation."""

    table: Table
    angle: Real
    """As the table has it, degrees."""
    turns: int
    torque: Real
    torque_unit: str
    speed: float
    coefficient: float

    @cached_property
    def second(self) -> Flywheel:
        """The same in numbers of 32 digits, with the decimals of the table and of the options as they are written."""
        from cli.read.exact import array, as_written, rates

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
        """Of the flywheel, kg·m²."""
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
    table = read(path, numbers={"angle": "angle", "torque": "torque"})
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


def _whole_turns(table: Table, angle: Numbers) -> int:
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
        f"{table.file}: column {angle.header}: found {first:g} to {last:g} {angle.unit}, not whole turns of the shaft; "
        f"expected a last row at {whole}{missing}"
    )


def _digit(table: Table) -> float:
    """Return the last printed digits of the ends together, at most a thousandth of a turn."""
    total = 0.0
    for row in (0, table.rows - 1):
        try:
            exponent = Decimal(table.written(row, "angle").replace(",", ".")).as_tuple().exponent
        except InvalidOperation:
            exponent = 0
        total += 10.0 ** int(exponent) if exponent else 0.0
    return min(total, 2 * pi / 1000)
