"""The answers of students as they typed them: the tables of answers and of the key, and units as people spell them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from cli.exercise.description import MARKED, Ask, Exercise, Value, value_of
from dalembert.errors import DataError, quote
from dalembert.quantities import is_number
from dalembert.tables.table import Table as ReadTable
from dalembert.tables.table import read
from dalembert.units import composed


@dataclass(eq=False, repr=False)
class Student:
    """A student: what was drawn, what was answered."""

    name: str
    others: dict[str, str] = field(default_factory=dict)
    drawn: dict[str, Value] = field(default_factory=dict)
    given: dict[int, tuple[str, str]] = field(default_factory=dict)
    """Question -> the answer and its unit as typed."""


def read_students(exercise: Exercise, answers: str, key: str | None) -> list[Student]:
    """Read the answers and the key.

    Raises
    ------
    DataError
        A column that is missing, a student or a question that is none, an answer that stands twice.
    """
    table = read(answers, texts=None)
    columns = _columns(table, exercise, ("student", "quantity", "answer"))
    students = _keyed(exercise, answers, key)
    listed = students is not None
    people: dict[str, Student] = students or {}
    own = {*MARKED, *exercise.keys.values(), *(draw.name for draw in exercise.draws)}
    others = [name for name in columns if name not in own]
    for row, name in enumerate(columns["student"]):
        if not name:
            raise table.error(row, "student", name, "a student")
        if listed and name not in people:
            raise table.error(row, "student", name, f"a student of the key: {_some(people)}")
        student = people.setdefault(name, Student(name))
        for other in others:
            student.others.setdefault(other, columns[other][row])
        k = _question(exercise, table, row, columns)
        if k in student.given:
            raise table.error(
                row, "quantity", columns["quantity"][row], f"each question once (student {name})"
            )
        unit = columns["unit"][row] if "unit" in columns else ""
        student.given[k] = (columns["answer"][row], unit)
    return list(people.values())


def _columns(table: ReadTable, exercise: Exercise, needed: Sequence[str]) -> dict[str, list[str]]:
    """Return the columns; those that mean something under their own names, whatever their case."""
    known = {name.lower(): name for name in (*MARKED, *exercise.keys.values())}
    columns = {known.get(name.lower(), name): cells for name, cells in table.as_written.items()}
    for name in needed:
        if name not in columns:
            raise DataError(
                f"{table.file}: no column {name}: expected one, found {', '.join(table.as_written)}"
            )
    return columns


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
                f"{answers}: no key.csv in its folder: expected --key key.csv with the numbers of each student, as "
                "dalembert exercise wrote it"
            )
        return None
    table = read(path, texts=None)
    columns = _columns(table, exercise, ("student",))
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


def _question(exercise: Exercise, table: ReadTable, row: int, columns: Mapping[str, list[str]]) -> int:
    """Return which question a row answers."""
    quantity = columns["quantity"][row]
    there = [k for k, ask in enumerate(exercise.asks) if ask.quantity.lower() == quantity.lower()]
    if not there:
        expected = ", ".join(dict.fromkeys(ask.quantity for ask in exercise.asks))
        raise table.error(row, "quantity", quantity, f"a quantity that is asked for: {expected}")
    cells = {key: columns[header][row] for key, header in exercise.keys.items() if header in columns}
    fitting = [k for k in there if all(_same(exercise.asks[k], key, cell) for key, cell in cells.items())]
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        (key, cell), *_ = cells.items()
        expected = "; ".join(_where(exercise.asks[k]) for k in there)
        found = ", ".join(f"{key} {quote(cell)}" for key, cell in cells.items())
        raise table.error(
            row, exercise.keys[key], cell, f"a row that is asked for ({expected}); found {found}"
        )
    missing = [header for header in exercise.keys.values() if header not in columns]
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


SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
SPELLED = (
    (r"[Kk][Gg](?![a-zA-Z])", "kg"),
    (r"sec\b", "s"),
    (r"degrees?\b|º", "deg"),
    (r"rad(s|ians?)\b", "rad"),
    (r"RPM\b", "rpm"),
    # N-m, and units that are run together: Nm, kgm², gmm
    (r"(?<=[A-Za-z])-(?=[A-Za-z])", "*"),
    (r"(?<![A-Za-z])([kMm]?N|kgf|kg|g)(mm|cm|m)(?![A-Za-z])", r"\1*\2"),
)
"""Spellings of units, and how they are read."""
INVERSE = re.compile(r"1/s(?:\^?2)?|s\^?-[12]")


def spelled(unit: str, unit_of_question: str) -> str:
    """Return a unit in the spelling that is read: `Nm` is `N*m`."""
    unit = unit.translate(SUPERSCRIPTS).replace("²", "2")
    for pattern, plain in SPELLED:
        unit = re.sub(pattern, plain, unit)
    # a radian is a number: ω in 1/s
    if INVERSE.fullmatch(unit) and unit_of_question in ("rad_s", "rad_s2"):
        return "rad/s2" if unit.endswith("2") else "rad/s"
    return unit


def scale_of(unit: str, unit_of_question: str) -> Fraction | None:
    """Return a unit in another one, 1 kJ = 1000 J; None where they do not measure the same.

    >>> scale_of("kJ", "J"), scale_of("Nm", "N_m"), scale_of("kg", "N_m"), scale_of("", "")
    (Fraction(1000, 1), Fraction(1, 1), None, Fraction(1, 1))
    >>> scale_of("m·s⁻¹", "m_s"), scale_of("s^-1", "rad_s"), scale_of("Kg m²/sec", "kg_m2_s")
    (Fraction(1, 1), Fraction(1, 1), Fraction(1, 1))
    """
    if unit == unit_of_question or not unit_of_question:
        return Fraction(1) if unit == unit_of_question or not unit else None
    own, wanted = _measure(spelled(unit, unit_of_question)), _measure(unit_of_question)
    if own is None or wanted is None or own[1] != wanted[1]:
        return None
    return own[0] / wanted[0]


def _measure(unit: str) -> tuple[Fraction, object] | None:
    scale = composed(unit)
    if scale is None and unit[:1] in "kM" and unit[1:]:
        # kJ, MW: a thousand or a million of a unit that is known
        bare = composed(unit[1:])
        if bare is not None:
            (n, d), exponents = bare
            return Fraction(n) / Fraction(d) * (1000 if unit[0] == "k" else 10**6), exponents
    if scale is None:
        return None
    (n, d), exponents = scale
    return Fraction(n) / Fraction(d), exponents
