"""Tables beside a mechanism's file: laws of motion, forces over the input, torques over the time, an angle or a speed."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from dalembert.dataclass import dataclass
from dalembert.decimals import decimal_to_si
from dalembert.errors import DataError
from dalembert.quantities import number_expected, parse_number
from dalembert.tables.files import split_sheet
from dalembert.tables.headers import find_columns
from dalembert.tables.sources import Source, source_of
from dalembert.units import LISTED, MINUS, UNITS
from virtualwork.describe import DescriptionError
from virtualwork.describe.file import Entry
from virtualwork.describe.forms import SCALAR, TEXT, Form, Scalar, Schema
from virtualwork.describe.units import SI, Units, wrong

# the quantities of these tables and their dimensions
QUANTITIES = {
    "t": "time",
    "time": "time",
    "angle": "angle",
    "position": "length",
    "speed": "speed",
    "fx": "force",
    "fy": "force",
    "torque": "torque",
    "lift": "length",
    "swing": "angle",
}
TIME, FORCE = ("time", "t"), ("fx", "fy")


class Rows(tuple[tuple[float, Any], ...]):
    """The rows of a table with the `name` of its file; it compares as its rows."""

    name: str = ""


@dataclass(eq=False, repr=False)
class Curve(Form):
    """A table in the file's folder, which the file names; rows without a name cannot be written."""

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        if isinstance(value, Rows) and value.name:
            return value.name
        raise DescriptionError("rows without the name of their table cannot be written into a file")


@dataclass(eq=False, repr=False)
class Law(Curve):
    """A law of motion: the angle or the position over the time."""

    def read(self, value: Any, where: str, entry: Entry) -> Rows:
        rows, _ = curve(entry, value, where, TIME, (_coordinate(entry.slides),))
        return rows


@dataclass(eq=False, repr=False)
class LiftTable(Curve):
    """The lift of a cam's follower, or the swing of an arm, over the angle of one turn."""

    def read(self, value: Any, where: str, entry: Entry) -> Rows:
        rows, _ = curve(entry, value, where, ("angle",), ("lift" if entry.slides else "swing",))
        if len(rows) < 4 or abs(rows[-1][0] - rows[0][0] - 2 * math.pi) > 1e-9:
            raise wrong(
                where,
                value,
                "at least four rows over one turn of the angle, the last 360 deg after the first",
            )
        largest = max(abs(lift) for _, lift in rows)
        if abs(rows[-1][1] - rows[0][1]) > 1e-9 * largest:
            raise wrong(where, value, "the same lift in the first and the last row")
        return rows


@dataclass(eq=False, repr=False)
class ForceTable(Curve):
    """The two components of a force over the input; one that is left out is 0."""

    def fields(self, name: str, value: Any, where: str, entry: Entry) -> dict[str, Any]:
        inputs = entry.file.rows("input")
        if len(inputs) != 1:
            raise wrong(where, value, "a mechanism with one input, for the force is given over it")
        rows, axis = curve(entry, value, where, (_coordinate("slider" in inputs[0]),), FORCE)
        return {name: rows, "periodic": axis == "angle" and is_cycle(rows[0][0], rows[-1][0])}


@dataclass(eq=False, repr=False)
class TorqueOrTable(Form):
    """A torque, or a table of it over the time, or over the angle or speed of its link."""

    torque = Scalar("torque")

    def dimension(self, slides: bool) -> str:
        return "torque"

    def schema(self) -> Schema:
        return {"anyOf": [SCALAR, TEXT]}

    def fields(self, name: str, value: Any, where: str, entry: Entry) -> dict[str, Any]:
        # a text that does not begin with a number names a file
        if not isinstance(value, str) or re.match(r"\s*[-+]?(\d|\.\d)", value):
            return self.torque.fields(name, value, where, entry)
        rows, axis = curve(entry, value, where, (*TIME, "angle", "speed"), ("torque",))
        periodic = axis == "angle" and is_cycle(rows[0][0], rows[-1][0])
        return {name: 0.0, "history": rows, "over": "time" if axis in TIME else axis, "periodic": periodic}

    def converted(self, value: Any, where: str) -> float:
        return self.torque.converted(value, where)

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return self.torque.text(value, units, slides)


def _coordinate(slides: bool) -> str:
    """The quantity of an input."""
    return "position" if slides else "angle"


def curve(
    entry: Entry, name: Any, where: str, over: Sequence[str], values: Sequence[str]
) -> tuple[Rows, str]:
    """The rows of a table in the file's folder in SI, and the quantity that they are over.

    Parameters
    ----------
    over, values : sequence of str
        Quantities of which one must be there; the two components of a force make one complex number.
    """
    known = {quantity: QUANTITIES[quantity] for quantity in (*over, *values)}
    try:
        data = entry.file.beside(name)
    except (OSError, ValueError):
        raise wrong(where, name, "a table that can be read") from None
    try:
        file, sheet = split_sheet(str(name))
        source = source_of(file, data, known, (), sheet)
        columns = find_columns(source.file, source.headings, known, ())
        axes = [quantity for quantity in over if quantity in columns]
        if len(axes) > 1:
            both = " and ".join(source.header[columns[quantity][0]] for quantity in axes)
            raise DataError(
                f"{name}: found the columns {both}, expected one of them: a table is over one quantity"
            )
        axis = next(iter(axes), None)
        if axis is None or columns.keys().isdisjoint(values):
            expected = ", and ".join(_headers(quantities) for quantities in (over, values))
            raise DataError(f"{name}: found the columns {', '.join(source.header)}, expected {expected}")
        used = {q: at for q, at in columns.items() if q == axis or q in values}
        source.check_cells(place for place, _ in used.values())
        rows = [row for _, row in source.rows()]
        cells = {q: [row[at] if at < len(row) else "" for row in rows] for q, (at, _) in used.items()}
        comma = source.has_commas(cells.values())
        numbers = {q: _numbers(entry, source, q, *used[q], cells[q], comma) for q in used}
    except DataError as error:
        raise DescriptionError(f"{where}: {error}") from None
    at = numbers[axis]
    if len(at) < 2 or any(not b > a for a, b in pairwise(at)):
        raise wrong(where, name, f"at least two rows with rising {source.header[used[axis][0]]}")
    if values == FORCE:
        parts = (numbers.get(part, [0.0] * len(at)) for part in FORCE)
        pairs = Rows(zip(at, map(complex, *parts), strict=True))
    else:
        pairs = Rows(zip(at, numbers[values[0]], strict=True))
    pairs.name = str(name)
    return pairs, axis


def _headers(quantities: Sequence[str]) -> str:
    """The columns of which one is expected, as headers have them: `t_s or angle_deg`."""
    return " or ".join(f"{quantity}_{LISTED[QUANTITIES[quantity]][0]}" for quantity in quantities)


def _numbers(
    entry: Entry, source: Source, quantity: str, place: int, unit: str, cells: Sequence[str], comma: bool
) -> list[float]:
    """The numbers of a column in SI; what is left out of a component of a force is 0."""
    dimension = QUANTITIES[quantity]
    factor = UNITS[dimension][unit]
    texts = []
    for i, cell in enumerate(cells):
        text = cell.strip().replace(MINUS, "-") or ("0" if quantity in FORCE else "")
        # 2.500 beside 1,5 may be 2500: it is no number
        point = text.replace(".", "'").replace(",", ".") if comma else text
        try:
            parse_number(point)
        except ValueError:
            expected = "a number with a decimal comma" if comma else number_expected(text)
            raise source.error(i, source.header[place], cell, expected) from None
        texts.append(point)
    si = [decimal_to_si(text, factor) for text in texts]
    entry.file.units.decimals.note_column(dimension, factor, texts, si)
    return si


def is_cycle(first: float, last: float) -> bool:
    """Whether a span of angles is one of whole turns."""
    turns = (last - first) / (2 * math.pi)
    return abs(turns - round(turns)) < 1e-9 and round(turns) > 0
