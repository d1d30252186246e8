"""The right answers of an exercise: the columns and rows of a result that its questions ask for."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any

from cli.exercise.description import Ask, Exercise
from dalembert.errors import DataError, quote
from dalembert.hints import nearest
from dalembert.quantities import is_number
from dalembert.units import composed, parted, unit_name, written

if TYPE_CHECKING:
    from dalembert.results.columns import Column, Document, Table


@dataclass(frozen=True)
class Answer:
    """The right answer to a question, in the unit asked for."""

    ask: Ask
    value: float
    unit: str
    is_angle: bool = False


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
        number_asked = float(value)
        if scale is not None:
            unit, factor = scale
            number_asked = float(Fraction(number_asked) * factor)
        angle = unit_name(unit) in ("deg", "rad") and composed(unit) is not None
        return Answer(ask, number_asked, unit, angle)

    def _column(self, place: str, ask: Ask) -> tuple[Table, Column, tuple[str, Fraction] | None]:
        """Return the table and column asked for, and what turns its numbers into the unit asked for."""
        for table in self.tables:
            for column in table.columns:
                if ask.quantity.lower() in (column.header.lower(), column.name.lower()):
                    return table, column, self._scale(place, ask, column, ask.unit)
        base, unit = parted(ask.quantity)
        for table in self.tables:
            for column in table.columns:
                if unit and column.unit and column.name.lower() == base.lower():
                    return table, column, self._scale(place, ask, column, ask.unit or unit)
        every = [column.header for table in self.tables for column in table.columns if column.unit]
        raise DataError(
            f"{place}, key quantity: found {quote(ask.quantity)}, expected a column of the result: "
            f"{', '.join(dict.fromkeys(every))}{nearest(ask.quantity, every)}"
        )

    def _scale(self, place: str, ask: Ask, column: Column, unit: str) -> tuple[str, Fraction] | None:
        if not unit or unit_name(unit) == column.unit:
            return None
        own, wanted = composed(column.unit), composed(unit)
        if own is None or wanted is None or own[1] != wanted[1]:
            raise DataError(f"{place}, key unit: found {quote(unit)}, expected a unit of {column.header}")
        (n, d), (wn, wd) = own[0], wanted[0]
        return unit, Fraction(n) / Fraction(d) * Fraction(wd) / Fraction(wn)

    def _row(self, place: str, ask: Ask, table: Table) -> int:
        cells = table.cells
        for key in ask.where:
            if key not in cells:
                raise DataError(
                    f"{place}, key where: found {quote(key)}, expected some of {', '.join(table.keys)}{nearest(key, table.keys)}"
                )
        rows = [
            row
            for row in range(table.length)
            if all(_same(cells[key][row], text) for key, text in ask.where.items())
        ]
        if len(rows) == 1:
            return rows[0]
        named = ", ".join(f"{key} {text}" for key, text in ask.where.items()) or "no key"
        keys = ", ".join(key for key in table.keys if key in cells) or "none"
        raise DataError(
            f"{place}, key where: found {named}, which {len(rows)} rows of the result have, expected one row (keys: {keys})"
        )


def _same(cell: object, text: str) -> bool:
    if isinstance(cell, str) or not is_number(text):
        return str(cell) == text
    return cell is not None and abs(float(cell) - float(text)) <= 1e-9 * max(1.0, abs(float(text)))  # type: ignore[arg-type]


def unit_text(unit: str) -> str:
    """Return a unit as people write it."""
    return written(unit_name(unit)) if unit else ""
