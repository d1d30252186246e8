"""`dalembert grade`: the marks of answers to an exercise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.show.commands import with_options
from cli.show.output import show

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


OPTIONS = """
Arguments:
  file FILE.toml  The exercise.
  answers ANSWERS  Table of the answers; - is standard input.
What:
  key KEY.csv  Right answers of each student (default: key.csv in the folder of the answers).
"""


@with_options(
    OPTIONS, ("json", "output", "text", "report", "about", "no_color"), show, example="exercise-slider-crank"
)
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Mark the answers to an exercise: right, rounding, figures, carried, wrong or blank, with the likely mistake.

    ANSWERS is the answers.csv of dalembert exercise, with the column answer filled in. It has the columns student,
    quantity, answer, unit and those that name the row; further columns are kept. An answer may have a decimal comma,
    a power of ten and its own unit: 1,23 or 1.23e0 or 18.1 kJ. An angle may differ by whole turns. The status is 0
    however wrong the answers are.
    """
    from cli.exercise.description import read_exercise
    from cli.exercise.variants import several, workshop
    from cli.grade.marks import METHOD, mark_all, read_students, tables
    from dalembert.results.result import Result

    with workshop(read_exercise(options.file)) as shop:
        exercise = shop.exercise
        students = read_students(exercise, options.answers, options.key)
        marks = mark_all(exercise, shop, students)
    points = sum(mark.points for mark in marks)
    of = float(exercise.points) * len(students)
    return Result(
        tables=tables(exercise, students, marks),
        companions=["totals"],
        notes=lambda: f"{exercise.title}: {several(len(students), 'student')}, {points:g} of {of:g} points",
        method=METHOD,
        # the marks hold the answers; the tables of each student's numbers are gone with the workshop
        shows_input=True,
        about={"title": f"Marks: {exercise.title}"},
    )
