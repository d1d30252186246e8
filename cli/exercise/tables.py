"""What is made of an exercise, as a table: the students, their questions and the right answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cli.exercise.description import Exercise
from cli.exercise.sheets import Student
from cli.exercise.variants import Variant
from dalembert.figures import written
from dalembert.results.columns import Table, names


def tables(
    exercise: Exercise, students: Sequence[Student], variants: Sequence[Variant]
) -> dict[str, Callable[[], Table]]:
    """The tables of the result."""
    rows = [
        (student, answer)
        for student, variant in zip(students, variants, strict=True)
        for answer in variant.answers
    ]
    keys = exercise.keys
    columns = [
        names("student", [student.name for student, _ in rows]),
        *(names(key, [answer.ask.where.get(key) for _, answer in rows]) for key in keys),
        names("quantity", [answer.ask.quantity for _, answer in rows]),
        names("unit", [answer.unit for _, answer in rows]),
        names("answer", [written(answer.value, answer.ask.figures) for _, answer in rows]),
        names("value", [answer.value for _, answer in rows]),
        names("figures", [answer.ask.figures for _, answer in rows]),
        names("points", [float(answer.ask.points) for _, answer in rows]),
    ]
    table = Table(columns, ["student", *keys, "quantity"], "key[]")
    return {"key": lambda: table}
