"""Tables beside a mechanism's file: laws of motion, forces over the input, torques over the time, an angle or a speed."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Sequence
from itertools import pairwise
from typing import Any, TypeVar

from dalembert.dataclass import dataclass
from dalembert.errors import DataError
from dalembert.tables.sources import table_rows
from dalembert.units import LARGEST
from virtualwork.describe import DescriptionError
from virtualwork.describe.file import Entry
from virtualwork.describe.forms import SCALAR, TEXT, Form, Scalar, Schema
from virtualwork.describe.units import SI, Units, wrong

N = TypeVar("N", float, complex)

DEGREE, RPM = math.pi / 180, math.pi / 30
# what every column of these tables is, its unit, and what makes it SI
COLUMNS = {
    **dict.fromkeys(("t_s", "time_s"), ("time", "s", 1.0)),
    "angle_rad": ("angle", "rad", 1.0),
    "angle_deg": ("angle", "deg", DEGREE),
    "position_m": ("length", "m", 1.0),
    "position_mm": ("length", "mm", 1e-3),
    "speed_rad_s": ("speed", "rad/s", 1.0),
    "speed_rpm": ("speed", "rpm", RPM),
    **dict.fromkeys(("fx_N", "fy_N"), ("force", "N", 1.0)),
    "torque_N_m": ("torque", "N m", 1.0),
    "lift_m": ("length", "m", 1.0),
    "lift_mm": ("length", "mm", 1e-3),
    "swing_rad": ("angle", "rad", 1.0),
    "swing_deg": ("angle", "deg", DEGREE),
}
# those of an input that turns and of one that slides; the lift of a sliding follower, and of an arm
TURNS, TRAVELS = ("angle_rad", "angle_deg"), ("position_m", "position_mm")
LIFTS, SWINGS = ("lift_m", "lift_mm"), ("swing_rad", "swing_deg")
# the parts of a force; the columns that a table of torque may be over
PARTS = ("fx_N", "fy_N")
AXES = ("t_s", "time_s", *TURNS, "speed_rad_s", "speed_rpm")


class Rows(tuple[tuple[float, Any], ...]):
    """The rows of a table with the `name` of its file; it compares as its rows."""

    name: str = ""


@dataclass(eq=False, repr=False)
class Curve(Form):
    """A table beside the file, which the file names; rows without a name cannot be written."""

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        if isinstance(value, Rows) and value.name:
            return value.name
        raise DescriptionError("a table beside the file cannot be written into it")


@dataclass(eq=False, repr=False)
class Law(Curve):
    """A law of motion: a CSV of time_s and angle_deg (angle_rad, position_m, position_mm)."""

    def read(self, value: Any, where: str, entry: Entry) -> Rows:
        over = TRAVELS if entry.slides else TURNS
        rows, _ = curve(
            entry,
            value,
            where,
            over,
            ("time_s",),
            f"time_s and {' or '.join(over)}",
            lambda row, column: (_si(row, "time_s"), _si(row, column)),
        )
        return rows


@dataclass(eq=False, repr=False)
class LiftTable(Curve):
    """The lift of a cam's follower over one turn: a CSV of angle_deg (angle_rad) and lift_mm, or swing_deg."""

    def read(self, value: Any, where: str, entry: Entry) -> Rows:
        lifts = LIFTS if entry.slides else SWINGS

        def pair(row: dict[str, str], column: str) -> tuple[float, float]:
            lift = next(name for name in lifts if name in row)
            return _si(row, column), _si(row, lift)

        columns = f"{' or '.join(TURNS)}, and {' or '.join(lifts)}"
        rows, column = curve(entry, value, where, TURNS, lifts, columns, pair)
        rises([at for at, _ in rows], value, where, column)
        if len(rows) < 4 or abs(rows[-1][0] - rows[0][0] - 2 * math.pi) > 1e-9:
            raise wrong(
                where,
                value,
                f"at least four rows over one turn of {column}, the last 360 deg after the first",
            )
        largest = max(abs(lift) for _, lift in rows)
        if abs(rows[-1][1] - rows[0][1]) > 1e-9 * largest:
            raise wrong(where, value, "the same lift in the first and the last row")
        return rows


@dataclass(eq=False, repr=False)
class ForceTable(Curve):
    """A force over the input: a CSV of angle_deg (angle_rad, position_m, position_mm), fx_N and fy_N."""

    def fields(self, name: str, value: Any, where: str, entry: Entry) -> dict[str, Any]:
        inputs = entry.file.rows("input")
        if len(inputs) != 1:
            raise wrong(where, value, "a mechanism with one input, for the force is given over it")
        over = TRAVELS if "slider" in inputs[0] else TURNS
        rows, column = curve(
            entry,
            value,
            where,
            over,
            PARTS,
            f"{' or '.join(over)}, fx_N and fy_N",
            lambda row, column: (_si(row, column), complex(*(_si(row, of) for of in PARTS))),
        )
        rises([at for at, _ in rows], value, where, column)
        return {name: rows, "periodic": over is TURNS and is_cycle(rows[0][0], rows[-1][0])}


@dataclass(eq=False, repr=False)
class TorqueOrTable(Form):
    """A torque, or a table of it over the time, or over the angle or speed of its link: a CSV with torque_N_m."""

    torque = Scalar("torque")

    def dimension(self, slides: bool) -> str:
        return "torque"

    def schema(self) -> Schema:
        return {"anyOf": [SCALAR, TEXT]}

    def fields(self, name: str, value: Any, where: str, entry: Entry) -> dict[str, Any]:
        # a text that does not begin with a number names a file
        if not isinstance(value, str) or re.match(r"\s*[-+]?(\d|\.\d)", value):
            return self.torque.fields(name, value, where, entry)
        rows, column = curve(
            entry,
            value,
            where,
            AXES,
            ("torque_N_m",),
            f"torque_N_m and one of {', '.join(AXES)}",
            lambda row, column: (_si(row, column), _si(row, "torque_N_m")),
        )
        rises([at for at, _ in rows], value, where, column)
        axis = COLUMNS[column][0]
        periodic = axis == "angle" and is_cycle(rows[0][0], rows[-1][0])
        return {name: 0.0, "history": rows, "over": axis, "periodic": periodic}

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return self.torque.text(value, units, slides)


def curve(
    entry: Entry,
    name: Any,
    where: str,
    over: Collection[str],
    values: Collection[str],
    columns: str,
    pair: Callable[[dict[str, str], str], tuple[float, N]],
) -> tuple[Rows, str]:
    """The rows of a CSV file beside this one, each as `pair` reads it, and the column that they are over.

    Parameters
    ----------
    over, values : collection of str
        Columns of which one must be there.
    columns : str
        The columns as an error names them.
    pair : function of a row and the column that it is over
    """
    try:
        data = entry.file.beside(name)
    except (OSError, ValueError):
        raise wrong(where, name, "a CSV file that can be read") from None
    try:
        rows = table_rows(str(name), data)
    except DataError as error:
        raise DescriptionError(f"{where}: {error}") from None
    column = next((c for c in over if rows and c in rows[0]), None)
    if column is None or rows[0].keys().isdisjoint(values):
        raise wrong(where, name, f"columns {columns}")
    try:
        pairs = Rows(pair(row, column) for row in rows)
    except (TypeError, ValueError):
        raise wrong(where, name, "numbers in every row") from None
    if not all(math.hypot(at, abs(value)) <= LARGEST for at, value in pairs):
        raise wrong(where, name, "finite numbers in every row")
    pairs.name = str(name)
    for each in rows[0].keys() & COLUMNS.keys():
        texts = [row[each] for row in rows if row[each]]
        entry.file.units.decimals.note_column(*COLUMNS[each], texts)
    return pairs, column


def _si(row: dict[str, str], column: str) -> float:
    """The number of a row in SI; 0 of a part of a force that is left out."""
    text = row.get(column) or "0" if column in PARTS else row[column]
    return float(text) * COLUMNS[column][2]


def rises(at: Sequence[float], name: Any, where: str, column: str) -> None:
    """Refuse a table whose first column does not rise."""
    if len(at) < 2 or any(not b > a for a, b in pairwise(at)):
        raise wrong(where, name, f"at least two rows with rising {column}")


def is_cycle(first: float, last: float) -> bool:
    """Whether a span of angles is one of whole turns."""
    turns = (last - first) / (2 * math.pi)
    return abs(turns - round(turns)) < 1e-9 and round(turns) > 0
