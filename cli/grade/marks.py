"""The marks of the answers to an exercise: verdicts, likely mistakes, and the tables of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from functools import cached_property

from cli.exercise.description import Answer, Exercise
from cli.exercise.recomputed import Recomputed, candidates
from cli.exercise.slips import Candidates
from cli.exercise.solving import Workshop
from cli.exercise.variants import Variant
from cli.grade.answers import Student, scale_of
from cli.grade.follows import Follows
from dalembert.errors import DataError, quote
from dalembert.figures import Right, Typed, typed
from dalembert.results.columns import Table, names

SHARES = {"right": Fraction(1), "carried": Fraction(1), "rounding": Fraction(1, 2), "figures": Fraction(1, 2)}
"""Share of the points, by verdict."""
MOST_POWER = 60
"""No answer has a larger power of ten, up or down."""
BLANK = re.compile(r"[-–—?./\s]*|n\.?/?a\.?|none", re.IGNORECASE)
"""What people type where they have no answer."""
RANK = ("right", "rounding", "figures", "carried", "wrong")


@dataclass(frozen=True, eq=False, repr=False)
class Mark:
    """The verdict on an answer."""

    student: Student
    answer: Answer
    given: str
    verdict: str
    mistake: str | None = None

    @property
    def points(self) -> float:
        """The points that it gets."""
        return float(self.answer.ask.points * SHARES.get(self.verdict, Fraction(0)))


@dataclass(frozen=True)
class _Reading:
    """A typed number in its unit, and the verdict on it."""

    number: Typed
    scale: Fraction
    """Its unit in the unit of the question."""
    verdict: str
    figures: int
    """The figures of the question."""

    @property
    def value(self) -> float:
        """In the unit of the question."""
        return float(Fraction(self.number.value) * self.scale)

    @property
    def half(self) -> float:
        """Half a unit of its last figure, in the unit of the question."""
        return float(Fraction(self.number.half_unit_at(self.figures)) * abs(self.scale))


@dataclass(eq=False, repr=False)
class Judge:
    """Marks the answers of students who were given the same numbers."""

    variant: Variant

    @cached_property
    def _runs(self) -> Recomputed:
        """The command run again with slips in the data."""
        return Recomputed(self.variant)

    @cached_property
    def slips(self) -> list[Candidates]:
        """The slips of each question, found where an answer is wrong."""
        return candidates(self.variant, self._runs)

    @cached_property
    def _follows_from(self) -> Follows:
        return Follows(self.variant, self._runs)

    def marks(self, student: Student) -> list[Mark]:
        """Return the marks of a student, in the order of the questions."""
        marks: list[Mark] = []
        earlier: dict[int, _Reading] = {}
        for k, answer in enumerate(self.variant.answers):
            text, unit = student.given.get(k, ("", ""))
            mark, reading = self._mark(student, k, answer, text.strip(), unit.strip(), earlier)
            marks.append(mark)
            if reading is not None:
                earlier[k] = replace(reading, verdict=mark.verdict)
        return marks

    def _mark(
        self, student: Student, k: int, answer: Answer, text: str, unit: str, earlier: Mapping[int, _Reading]
    ) -> tuple[Mark, _Reading | None]:
        if BLANK.fullmatch(text):
            return Mark(student, answer, text, "blank"), None
        numbers = typed(text)
        if not numbers:
            return Mark(student, answer, text, "wrong", f"{quote(text)} is no number"), None
        if any(abs(number.value.adjusted()) > MOST_POWER for number in numbers):
            return Mark(student, answer, text, "wrong"), None
        readings = []
        for number in numbers:
            scale = scale_of(number.unit or unit or answer.unit, answer.unit)
            if scale is None:
                # 7/2, 3 ½, 1.2 ± 0.1
                further = any(map(str.isnumeric, number.unit)) and not any(map(str.isalpha, number.unit))
                trouble = (
                    f"{quote(text)} is no decimal number"
                    if further
                    else f"the unit {quote(number.unit or unit)} does not fit"
                )
                return Mark(student, answer, text, "wrong", trouble), None
            readings.append(_Reading(number, scale, judge(answer, number, scale), answer.ask.figures))
        best = min(readings, key=lambda reading: RANK.index(reading.verdict))
        if best.verdict == "right":
            return Mark(student, answer, text, "right"), best
        for reading in readings:
            if self._follows(k, reading, earlier):
                return Mark(student, answer, text, "carried"), reading
        if best.verdict != "wrong":
            return Mark(student, answer, text, best.verdict), best
        for reading in readings:
            mistake = self.slips[k].name(reading.number, float(reading.scale))
            if mistake is not None:
                return Mark(student, answer, text, "wrong", mistake), reading
        return Mark(student, answer, text, "wrong"), best

    def _follows(self, k: int, reading: _Reading, earlier: Mapping[int, _Reading]) -> bool:
        """Whether an answer follows from earlier ones, of which one at least is not right."""
        if all(each.verdict == "right" for each in earlier.values()):
            return False
        answer = self.variant.answers[k]
        if reading.number.digits < min(2, answer.ask.figures):
            return False
        typed = {j: (each.value, self._half(j, each)) for j, each in earlier.items()}
        wrong = frozenset(j for j, each in earlier.items() if each.verdict != "right")
        for low, high in self._follows_from.ranges(k, typed, wrong):
            middle, spread = (low + high) / 2, (high - low) / 2
            if not middle:
                continue
            right = Right(middle, answer.ask.figures)
            # what the earlier answers' own rounding leaves open, and that of this one
            room = spread * (1 + 1e-9) + max(reading.half, float(right.unit) / 2)
            if abs(answer.distance(reading.value, middle)) <= room:
                return True
        return self._follows_from.same_slip(k, reading.value, reading.half, typed, wrong)

    def _half(self, j: int, reading: _Reading) -> float:
        """What an earlier answer leaves open; a right one no more than its figures do: 0.2 for 0.2000."""
        if reading.verdict != "right":
            return reading.half
        answer = self.variant.answers[j]
        return min(reading.half, float(Right(answer.value, answer.ask.figures).unit) / 2)


def judge(answer: Answer, number: Typed, scale: Fraction) -> str:
    """Judge a number in its own unit; an angle counts modulo a turn."""
    right = Right(Fraction(answer.value) / scale, answer.ask.figures)
    verdict = right.verdict(number)
    if verdict == "right" or not answer.is_angle:
        return verdict
    own = Fraction(answer.turn) / scale
    turn = Decimal(own.numerator) / own.denominator
    turns = ((right.value - number.value) / turn).to_integral_value()
    verdicts = [verdict, right.verdict(Typed(number.value + turns * turn))]
    if turns:
        verdicts.append(
            Right(Fraction(right.value - turns * turn), answer.ask.figures).verdict(number)
            if right.value != turns * turn
            else "wrong"
        )
    return min(verdicts, key=RANK.index)


def mark_all(exercise: Exercise, shop: Workshop, students: Sequence[Student]) -> list[Mark]:
    """Mark all students; those with the same numbers share a judge."""
    judges: dict[tuple[str, ...], Judge] = {}
    marks: list[Mark] = []
    for student in students:
        numbers = tuple(str(student.drawn[draw.name]) for draw in exercise.draws)
        if numbers not in judges:
            problem = shop.problem(student.drawn)
            try:
                solved = problem.result()
                solved.answers  # noqa: B018 - what cannot be solved is an error here, not in the middle of the marks
            except DataError as error:
                of = f" (student {student.name}: {', '.join(numbers)})" if numbers else ""
                raise DataError(f"{error}{of}") from None
            judges[numbers] = Judge(Variant(problem, solved))
        marks += judges[numbers].marks(student)
    return marks


METHOD = (
    "Right is what rounds to the right value at the figures asked, and the right value rounded to more figures; the printed "
    "data count as exact. rounding: one unit of the last figure off; figures: rightly rounded to fewer figures (half the "
    "points each). carried: follows from an earlier wrong answer (all points). A likely mistake is named where one slip alone, "
    "or two where the answer has at least four digits, reproduces the answer to its digits, and a random number would hardly do so."
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
        *(names(header, [mark.answer.ask.where.get(key) for mark in marks]) for key, header in keys.items()),
        names("quantity", [mark.answer.ask.quantity for mark in marks]),
        names("unit", [mark.answer.unit for mark in marks]),
        names("given", [mark.given for mark in marks]),
        names("right", [mark.answer.value for mark in marks]),
        names("figures", [mark.answer.ask.figures for mark in marks]),
        names("verdict", [mark.verdict for mark in marks]),
        names("points", [mark.points for mark in marks]),
        names("mistake", [mark.mistake for mark in marks]),
    ]
    return Table(columns, ["student", *keys.values(), "quantity"], "marks[]")


def totals(exercise: Exercise, students: Sequence[Student], marks: Sequence[Mark]) -> Table:
    """A row for each student."""
    sums = dict.fromkeys(students, Fraction(0))
    for mark in marks:
        sums[mark.student] += Fraction(mark.points)
    columns = [
        names("student", [student.name for student in students]),
        *(names(other, [student.others.get(other) for student in students]) for other in _others(students)),
        names("points", [float(sums[student]) for student in students]),
        names("of", [float(exercise.points)] * len(students)),
    ]
    return Table(columns, ["student"], "totals[]")
