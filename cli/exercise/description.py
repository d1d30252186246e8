"""An exercise as its TOML file describes it, and its answers with their figures, points and labels."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from math import inf, isfinite, remainder, tau
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dalembert.errors import DataError, quote, toml_text
from dalembert.hints import nearest
from dalembert.quantities import is_number, number_and_unit, unit_ratio
from dalembert.results.text import plain
from dalembert.tables.files import read_toml
from dalembert.units import composed, parted, unit_name, written

if TYPE_CHECKING:
    from dalembert.results.columns import Column, Document, Table


COMMANDS = (
    "balance", "body", "engine", "equilibrium", "field", "flywheel", "forces", "index", "inspect", "mechanism", "place",
    "signal", "simulate", "spin", "tolerance", "trial", "work",
)  # fmt: skip
"""The commands that can solve an exercise."""
SHOW = (
    "-", "-h", "--expect", "--help", "--json", "--output", "--page", "--plot", "--report", "--save-influence", "--schema",
    "--states", "--steps",
)  # fmt: skip
"""Options that show or write a result."""
KEYS = ("command", "title", "text", "figure", "source", "draw", "ask")
ASK = ("quantity", "where", "figures", "points", "unit", "label")
MARKED = (
    "student", "quantity", "unit", "answer", "value", "figures", "points", "given", "right", "verdict", "mistake", "of",
)  # fmt: skip
"""Columns of the tables of answers, of the key and of the marks."""
MOST_FIGURES = 12
SMALL = 1e-9
"""A number below this share of others may be zero."""
LISTED = 10_000
"""The largest number of values of a draw."""


@dataclass(frozen=True)
class Value:
    """A drawn value: its number as the file has it, and its unit."""

    number: Decimal
    unit: str

    def __str__(self) -> str:
        return f"{self.number:f}{f' {self.unit}' if self.unit else ''}"

    @property
    def option(self) -> str:
        """As an option takes it: `55mm`."""
        return f"{self.number:f}{self.unit}"


@dataclass(frozen=True)
class Draw:
    """A datum that differs from student to student, and its values."""

    name: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Ask:
    """A question: a column of the command's table, the row, the figures."""

    quantity: str
    where: Mapping[str, str]
    figures: int
    points: Fraction
    unit: str
    label: str = ""

    @property
    def name(self) -> str:
        """The quantity without its unit."""
        return self.parted[0]

    @property
    def parted(self) -> tuple[str, str]:
        """The quantity and the unit of its header, which is empty where it has none."""
        return parted(self.quantity, further=("kg_m2_s", "J", "W", "rad_s3", "m_s3"))


@dataclass(frozen=True)
class Exercise:
    """An exercise."""

    file: str
    folder: Path
    command: tuple[str, ...]
    title: str
    text: str
    figure: str | None
    source: str
    draws: tuple[Draw, ...]
    asks: tuple[Ask, ...]

    @property
    def keys(self) -> dict[str, str]:
        """The key columns that the questions name, and what they are called beside columns of the marks: `row_quantity`."""
        return {key: f"row_{key}" if key in MARKED else key for ask in self.asks for key in ask.where}

    @property
    def points(self) -> Fraction:
        """The points of all questions together."""
        return sum((ask.points for ask in self.asks), Fraction(0))


def read_exercise(path: str) -> Exercise:
    """Read an exercise.

    Raises
    ------
    DataError
        With the place in the file, the value and what was expected.
    """
    file, table = read_toml(path)
    place = _Place(file)
    place.known(table, KEYS, "")
    words = _command(place, place.text(table, "command", 'such as "balance rotor.csv --plane A:20mm"'))
    title = place.text(table, "title", "the exercise's name", otherwise="") or Path(path).stem
    text = place.text(table, "text", "what the student reads", otherwise="")
    figure = place.text(table, "figure", "the name of a picture", otherwise="") or None
    source = place.text(table, "source", "where the exercise comes from", otherwise="")
    folder = Path() if path == "-" else Path(path).parent
    if figure is not None:
        if Path(figure).suffix.lower() not in (".svg", ".png"):
            raise place.error("key figure", figure, "a picture, .svg or .png")
        if not folder.joinpath(figure).is_file():
            raise place.error("key figure", figure, f"a file in the folder of {file}")
    draws = tuple(_draws(place, table.get("draw", {})))
    asks = tuple(_asks(place, table.get("ask")))
    return Exercise(file, folder, words, title, text, figure, source, draws, asks)


@dataclass(frozen=True)
class _Place:
    """What messages call the file."""

    file: str

    def error(self, where: str, value: object, expected: str) -> DataError:
        shown = quote(value) if isinstance(value, str) else toml_text(value)
        return DataError(f"{self.file}: {where}: found {shown}, expected {expected}")

    def known(self, table: object, keys: tuple[str, ...], where: str) -> None:
        """Refuse a key that means nothing."""
        if not isinstance(table, dict):
            raise self.error(where or "the file", table, "a table of keys")
        for key in table:
            if key not in keys:
                at = f"{where}, key {key}" if where else f"key {key}"
                raise DataError(
                    f"{self.file}: {at}: unknown key, expected one of {', '.join(keys)}{nearest(key, keys)}"
                )

    def text(self, table: Mapping[str, Any], key: str, meaning: str, otherwise: str | None = None) -> str:
        if key not in table:
            if otherwise is None:
                raise DataError(f"{self.file}: no key {key}: expected {meaning}")
            return otherwise
        value = table[key]
        if not isinstance(value, str) or (otherwise is None and not value.strip()):
            raise self.error(f"key {key}", value, f"a text, {meaning}")
        return value


def _command(place: _Place, text: str) -> tuple[str, ...]:
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise place.error("key command", text, f"words as in a shell ({error})") from None
    if words and words[0] == "dalembert":
        words = words[1:]
    if not words or words[0] not in COMMANDS:
        name = words[0] if words else ""
        raise place.error(
            "key command", name, f"a command that computes: {', '.join(COMMANDS)}{nearest(name, COMMANDS)}"
        )
    # --plane=A:20mm as two words, so that an option is found in one way
    words = [
        part
        for word in words
        for part in (word.split("=", 1) if re.match(r"--[a-z][a-z-]*=", word) else (word,))
    ]
    for word in words[1:]:
        if word in SHOW or word.startswith("-o"):
            raise place.error(
                "key command", word, "the options that solve the exercise, none that shows or writes"
            )
    return tuple(words)


def _draws(place: _Place, table: object) -> Iterator[Draw]:
    if not isinstance(table, dict):
        raise place.error("[draw]", table, 'a table such as "links.crank.B.x" = "50mm:80mm:5mm"')
    for name, entry in table.items():
        where = f"[draw], {name}"
        if isinstance(entry, dict):
            raise place.error(
                where, entry, f'a path with dots stands in quotes: "{name}.…" = "50mm:80mm:5mm"'
            )
        if isinstance(entry, str):
            values = _steps(place, where, entry)
        elif isinstance(entry, list) and entry:
            values = [_value(place, where, each) for each in entry]
        else:
            raise place.error(where, entry, 'steps such as "50mm:80mm:5mm" or a list such as ["5kg", "6kg"]')
        if len({(value.number, value.unit) for value in values}) < len(values):
            raise place.error(where, entry, "each value once")
        yield Draw(name, tuple(values))


def _value(place: _Place, where: str, entry: object) -> Value:
    if isinstance(entry, (int, float)) and not isinstance(entry, bool):
        text = str(entry)
    elif isinstance(entry, str):
        text = entry.strip()
    else:
        raise place.error(where, entry, 'a number with its unit, such as "5kg"')
    value = value_of(text)
    if value is None:
        raise place.error(where, entry, 'a number with its unit, such as "5kg"')
    return value


def value_of(text: str) -> Value | None:
    """Read a number with its unit; None where it is none, or of a size that cannot be computed with.

    >>> str(value_of("55mm")), str(value_of("-0.50")), value_of("5 furlongs")
    ('55 mm', '-0.50', None)
    """
    parts = number_and_unit(text)
    if parts is None or (parts[1] and composed(parts[1]) is None):
        return None
    number, unit = Decimal(parts[0]), parts[1]
    return Value(number, unit) if -60 < number.adjusted() < 60 else None


def _steps(place: _Place, where: str, text: str) -> list[Value]:
    parts = text.split(":")
    if len(parts) != 3:
        raise place.error(where, text, 'FROM:TO:STEP, such as "50mm:80mm:5mm"')
    first, last, step = (_value(place, where, part) for part in parts)
    units = {value.unit for value in (first, last, step) if value.unit}
    if len(units) > 1:
        raise place.error(where, text, f"one unit, not {' and '.join(sorted(units))}")
    unit = units.pop() if units else ""
    if step.number <= 0 or last.number < first.number:
        raise place.error(where, text, "a step above zero, from the smaller value to the larger")
    count = int((last.number - first.number) / step.number) + 1
    if count > LISTED:
        raise place.error(where, text, f"at most {LISTED} steps")
    return [Value(first.number + k * step.number, unit) for k in range(count)]


def _asks(place: _Place, entries: object) -> Iterator[Ask]:
    if not isinstance(entries, list) or not entries:
        raise DataError(
            f'{place.file}: no [[ask]]: expected one or more, such as [[ask]] with quantity = "mass_kg", figures = 3'
        )
    seen = set()
    for k, table in enumerate(entries, 1):
        where = f"[[ask]] {k}"
        place.known(table, ASK, where)
        quantity = table.get("quantity", "")
        if not isinstance(quantity, str) or not quantity.strip():
            raise place.error(
                f"{where}, key quantity", quantity, 'a column of the command\'s table, such as "mass_kg"'
            )
        figures = table.get("figures", 3)
        if not isinstance(figures, int) or isinstance(figures, bool) or not 1 <= figures <= MOST_FIGURES:
            raise place.error(f"{where}, key figures", figures, f"a whole number from 1 to {MOST_FIGURES}")
        points = table.get("points", 1)
        if not isinstance(points, (int, float)) or isinstance(points, bool) or not 0 < points < 1e6:
            raise place.error(f"{where}, key points", points, "a number above 0")
        unit, label = table.get("unit", ""), table.get("label", "")
        if not isinstance(unit, str) or (unit and composed(unit) is None):
            raise place.error(f"{where}, key unit", unit, 'a unit such as "kg"')
        if not isinstance(label, str):
            raise place.error(f"{where}, key label", label, "a text, what the sheet calls it")
        ask = Ask(
            quantity,
            _where(place, where, table.get("where", {})),
            figures,
            Fraction(str(points)),
            unit,
            label,
        )
        if (quantity, tuple(ask.where.items())) in seen:
            raise place.error(where, quantity, "each question once; where tells the rows apart")
        seen.add((quantity, tuple(ask.where.items())))
        yield ask


def _where(place: _Place, where: str, entry: object) -> dict[str, str]:
    """Read the keys of a row: a table, or `plane=B,rotor=1`."""
    if isinstance(entry, str) and entry.strip():
        pairs = [part.partition("=") for part in entry.split(",")]
        if any(not sign for _, sign, _ in pairs):
            raise place.error(f"{where}, key where", entry, 'a row\'s keys, such as { plane = "B" }')
        return {name.strip(): value.strip() for name, _, value in pairs}
    if not isinstance(entry, dict) or any(isinstance(value, (dict, list, bool)) for value in entry.values()):
        raise place.error(f"{where}, key where", entry, 'a row\'s keys, such as { plane = "B" }')
    return {key: str(value) for key, value in entry.items()}


@dataclass(frozen=True)
class Answer:
    """The right answer to a question, in the unit asked for."""

    ask: Ask
    value: float
    unit: str
    is_angle: bool = False

    @property
    def turn(self) -> float:
        """A turn in the unit of an angle."""
        return 360.0 if unit_name(self.unit) == "deg" else tau

    def distance(self, one: float, other: float) -> float:
        """How far apart two values are; angles modulo a turn."""
        return remainder(one - other, self.turn) if self.is_angle else one - other


@dataclass(eq=False, repr=False)
class Solved:
    """What the command computes of a student's numbers."""

    exercise: Exercise
    tables: list[Table]
    document: Document
    result: Any

    @cached_property
    def answers(self) -> list[Answer]:
        """The right answers, in the order of the questions.

        Raises
        ------
        DataError
            A quantity or a row that the result does not have, or one without a number.
        """
        return [self.answer(k, ask) for k, ask in enumerate(self.exercise.asks, 1)]

    def answer(self, number: int, ask: Ask) -> Answer:
        place = f"{self.exercise.file}: [[ask]] {number}"
        table, column, scale = self._column(place, ask)
        row = self._row(place, ask, table)
        value = column.values[row]
        if value is None or isinstance(value, str) or not isfinite(value):
            raise DataError(f"{place}, key quantity: {ask.quantity} has no number in that row")
        unit = column.unit
        number_asked = 0.0 if _is_zero(table, column, row) else float(value)
        if scale is not None:
            unit, factor = scale
            number_asked = float(Fraction(number_asked) * factor)
        return Answer(ask, number_asked, unit, unit_name(unit) in ("deg", "rad"))

    def _column(self, place: str, ask: Ask) -> tuple[Table, Column, tuple[str, Fraction] | None]:
        """Return the table and column asked for, and what turns its numbers into the unit asked for."""
        by_unit = f"{place}, key unit: found {quote(ask.unit)}"
        for table in self.tables:
            for column in table.columns:
                if ask.quantity.lower() in (column.header.lower(), column.name.lower()):
                    return table, column, self._scale(by_unit, column, ask.unit)
        base, unit = parted(ask.quantity)
        for table in self.tables:
            for column in table.columns:
                if unit and column.unit and column.name.lower() == base.lower():
                    own = self._scale(f"{place}, key quantity: found {quote(ask.quantity)}", column, unit)
                    return table, column, self._scale(by_unit, column, ask.unit) if ask.unit else own
        every = [column.header for table in self.tables for column in table.columns if column.unit]
        raise DataError(
            f"{place}, key quantity: found {quote(ask.quantity)}, expected a column of the result: "
            f"{', '.join(dict.fromkeys(every))}{nearest(ask.quantity, every)}"
        )

    @staticmethod
    def _scale(found: str, column: Column, unit: str) -> tuple[str, Fraction] | None:
        if not unit or unit_name(unit) == column.unit:
            return None
        scale = unit_ratio(column.unit, unit)
        if scale is None:
            raise DataError(f"{found}, expected a unit of {column.header}")
        return unit, scale

    def _row(self, place: str, ask: Ask, table: Table) -> int:
        cells = table.cells
        for key in ask.where:
            if key not in cells:
                keys = table.keys or list(cells)
                raise DataError(
                    f"{place}, key where: found {quote(key)}, expected some of {', '.join(keys)}{nearest(key, keys)}"
                )
        rows = [
            row
            for row in range(table.length)
            if all(same(cells[key][row], text) for key, text in ask.where.items())
        ]
        if len(rows) == 1:
            return rows[0]
        named = ", ".join(f"{key} {text}" for key, text in ask.where.items()) or "no key"
        keys = ", ".join(key for key in table.keys if key in cells) or "none"
        raise DataError(
            f"{place}, key where: found {named}, which {len(rows)} rows of the result have, expected one row (keys: {keys})"
        )


def _is_zero(table: Table, column: Column, row: int) -> bool:
    """Whether a number is zero but for its rounding error, which is computed where others in its row are far larger."""
    value: Any = column.values[row]
    number = abs(remainder(value, 360.0)) if column.unit == "deg" else abs(float(value))
    cells: list[Any] = [each.values[row] for each in table.columns if each is not column]
    largest = max((abs(float(cell)) for cell in cells if isinstance(cell, (int, float))), default=inf)
    if not number or column.error is None or number > SMALL * largest:
        return not number
    return bool(column.error()[row] >= number)


def same(cell: object, text: str) -> bool:
    """Whether a cell is the name or the number of a key."""
    if isinstance(cell, str) or not is_number(text):
        return str(plain(cell)) == text
    return cell is not None and abs(float(cell) - float(text)) <= 1e-9 * max(1.0, abs(float(text)))  # type: ignore[arg-type]


def unit_text(unit: str) -> str:
    """Return a unit as people write it."""
    return written(unit_name(unit)) if unit else ""
