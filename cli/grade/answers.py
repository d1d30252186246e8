"""The answers of a class as their table has them, and the numbers that each student was given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cli.exercise.description import Ask, Exercise, Value, value_of
from dalembert.errors import DataError, quote
from dalembert.quantities import is_number
from dalembert.tables.table import Table, read


@dataclass(eq=False, repr=False)
class Student:
    """A student: what was drawn, what was answered."""

    name: str
    others: dict[str, str] = field(default_factory=dict)
    drawn: dict[str, Value] = field(default_factory=dict)
    given: dict[int, tuple[str, str]] = field(default_factory=dict)
    """Question -> the answer and its unit as typed."""


OWN = ("student", "quantity", "unit", "answer")
KEY = ("value", "figures", "points")


def read_students(exercise: Exercise, answers: str, key: str | None, warnings: list[str]) -> list[Student]:
    """Read the answers and the key.

    Raises
    ------
    DataError
        A column that is missing, a student or a question that is none, an answer that stands twice.
    """
    table = read(answers, texts=None)
    columns = _columns(table, ("student", "quantity", "answer"))
    students = _keyed(exercise, answers, key)
    listed = students is not None
    people: dict[str, Student] = students or {}
    keys = [key for key in exercise.keys if key in columns]
    unknown = _of_key(exercise) if listed else set()
    others = [name for name in columns if name not in (*OWN, *exercise.keys, *unknown)]
    for row, name in enumerate(columns["student"]):
        if not name:
            raise table.error(row, "student", name, "a student")
        if listed and name not in people:
            raise table.error(row, "student", name, f"a student of the key: {_some(people)}")
        student = people.setdefault(name, Student(name))
        for other in others:
            student.others.setdefault(other, columns[other][row])
        k = _question(exercise, table, row, columns, keys)
        if k in student.given:
            raise table.error(
                row, "quantity", columns["quantity"][row], f"each question once (student {name})"
            )
        unit = columns["unit"][row] if "unit" in columns else ""
        student.given[k] = (columns["answer"][row], unit)
    return list(people.values())


def _columns(table: Table, needed: Sequence[str]) -> dict[str, list[str]]:
    columns = {}
    for name, cells in table.texts.items():
        low = name.strip().lower()
        columns[low if low in (*OWN, *KEY) else name] = cells
    for name in needed:
        if name not in columns:
            raise DataError(f"{table.file}: no column {name}: expected one, found {', '.join(table.texts)}")
    return columns


def _of_key(exercise: Exercise) -> set[str]:
    """The columns that a key has besides: where the key itself is handed in, they are no names."""
    return {*KEY, *(draw.name for draw in exercise.draws)}


def _some(names: Mapping[str, object]) -> str:
    listed = list(names)
    return ", ".join(listed[:6]) + (f" and {len(listed) - 6} more" if len(listed) > 6 else "")


def _keyed(exercise: Exercise, answers: str, key: str | None) -> dict[str, Student] | None:
    """Return the students of the key; None where there is no key and none is needed."""
    path = key
    if path is None:
        beside = Path(answers).with_name("key.csv")
        path = str(beside) if answers != "-" and beside.is_file() else None
    if path is None:
        if exercise.draws:
            raise DataError(
                f"{answers}: no key.csv beside it: expected --key key.csv with the numbers of each student, as "
                "dalembert exercise wrote it"
            )
        return None
    table = read(path, texts=None)
    columns = _columns(table, ("student",))
    for draw in exercise.draws:
        if draw.name not in columns:
            raise DataError(
                f"{path}: no column {draw.name}: expected the numbers of [draw], as dalembert exercise wrote them"
            )
    people: dict[str, Student] = {}
    for row, name in enumerate(columns["student"]):
        drawn = {}
        for draw in exercise.draws:
            value = value_of(columns[draw.name][row])
            if value is None:
                raise table.error(row, draw.name, columns[draw.name][row], "a number with its unit")
            drawn[draw.name] = value
        if people.setdefault(name, Student(name, drawn=drawn)).drawn != drawn:
            raise table.error(
                row,
                exercise.draws[0].name,
                columns[exercise.draws[0].name][row],
                f"the same numbers in all rows of student {name}",
            )
    return people


def _question(
    exercise: Exercise, table: Table, row: int, columns: Mapping[str, list[str]], keys: Sequence[str]
) -> int:
    """Return which question a row answers."""
    quantity = columns["quantity"][row]
    there = [k for k, ask in enumerate(exercise.asks) if ask.quantity.lower() == quantity.lower()]
    if not there:
        expected = ", ".join(dict.fromkeys(ask.quantity for ask in exercise.asks))
        raise table.error(row, "quantity", quantity, f"a quantity that is asked for: {expected}")
    fitting = [k for k in there if all(_same(exercise.asks[k], key, columns[key][row]) for key in keys)]
    if len(fitting) == 1:
        return fitting[0]
    missing = [key for key in exercise.keys if key not in keys]
    if not fitting:
        cells = ", ".join(f"{key} {quote(columns[key][row])}" for key in keys)
        expected = "; ".join(_where(exercise.asks[k]) for k in there)
        raise table.error(
            row, keys[0], columns[keys[0]][row], f"a row that is asked for ({expected}); found {cells}"
        )
    raise DataError(
        f"{table.file}: no column {', '.join(missing)}: expected {'it' if len(missing) == 1 else 'them'}, as "
        f"{len(fitting)} questions ask for {quantity}"
    )


def _where(ask: Ask) -> str:
    return ", ".join(f"{key} {text}" for key, text in ask.where.items()) or "no key"


def _same(ask: Ask, key: str, cell: str) -> bool:
    wanted = ask.where.get(key, "")
    if cell == wanted:
        return True
    cell = cell.replace(",", ".")
    return (
        is_number(cell)
        and is_number(wanted)
        and abs(float(cell) - float(wanted)) <= 1e-9 * max(1.0, abs(float(wanted)))
    )
