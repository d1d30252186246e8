"""The marks as tables: a row for each question and student, and the totals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

from cli.exercise.description import Exercise
from cli.grade.answers import Student
from cli.grade.marks import Mark
from dalembert.results.columns import Table, names

METHOD = (
    "Right is what rounds to the right value at the figures asked, and the right value rounded to more figures; the printed "
    "data count as exact. rounding: one unit of the last figure off; figures: rightly rounded to fewer figures (half the "
    "points each). carried: follows from an earlier wrong answer (all points). A likely mistake is named where one slip, or "
    "two where the answer has at least four digits, reproduces the answer to its digits."
)


def tables(
    exercise: Exercise, students: Sequence[Student], marks: Sequence[Mark]
) -> dict[str, Callable[[], Table]]:
    """The tables of the result, the CSV's first."""
    return {
        "marks": lambda: marks_table(exercise, students, marks),
        "totals": lambda: totals(exercise, students, marks),
    }


def _others(students: Sequence[Student]) -> list[str]:
    return list(dict.fromkeys(name for student in students for name in student.others))


def marks_table(exercise: Exercise, students: Sequence[Student], marks: Sequence[Mark]) -> Table:
    """A row for each question and student."""
    keys = exercise.keys
    columns = [
        names("student", [mark.student.name for mark in marks]),
        *(names(other, [mark.student.others.get(other) for mark in marks]) for other in _others(students)),
        *(names(key, [mark.answer.ask.where.get(key) for mark in marks]) for key in keys),
        names("quantity", [mark.answer.ask.quantity for mark in marks]),
        names("unit", [mark.answer.unit for mark in marks]),
        names("given", [mark.given for mark in marks]),
        names("right", [mark.answer.value for mark in marks]),
        names("figures", [mark.answer.ask.figures for mark in marks]),
        names("verdict", [mark.verdict for mark in marks]),
        names("points", [mark.points for mark in marks]),
        names("mistake", [mark.mistake for mark in marks]),
    ]
    return Table(columns, ["student", *keys, "quantity"], "marks[]")


def totals(exercise: Exercise, students: Sequence[Student], marks: Sequence[Mark]) -> Table:
    """A row for each student."""
    sums = {id(student): Fraction(0) for student in students}
    for mark in marks:
        sums[id(mark.student)] += Fraction(mark.points)
    columns = [
        names("student", [student.name for student in students]),
        *(names(other, [student.others.get(other) for student in students]) for other in _others(students)),
        names("points", [float(sums[id(student)]) for student in students]),
        names("of", [float(exercise.points)] * len(students)),
    ]
    return Table(columns, ["student"], "totals[]")
