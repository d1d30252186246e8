"""The answers of students as they typed them, and their marks: verdicts, likely mistakes, and the tables of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from pathlib import Path

from cli.exercise.description import MARKED, Answer, Ask, Exercise, Value, same, value_of
from cli.exercise.follows import Follows
from cli.exercise.recomputed import Recomputed, candidates
from cli.exercise.slips import Candidates
from cli.exercise.solving import Workshop
from cli.exercise.variants import Variant
from dalembert.errors import DataError, quote
from dalembert.figures import Right, Typed, typed
from dalembert.quantities import is_number, unit_ratio
from dalembert.results.columns import Table, names
from dalembert.tables.table import Table as ReadTable
from dalembert.tables.table import read

SHARES = {"right": Fraction(1), "carried": Fraction(1), "rounding": Fraction(1, 2), "figures": Fraction(1, 2)}
"""Share of the points, by verdict."""
MOST_POWER = 60
"""No answer has a larger power of ten, up or down."""
BLANK = re.compile(r"[-–—?./\s]*|n\.?/?a\.?|none", re.IGNORECASE)
"""What people type where they have no answer."""
RANK = ("right", "rounding", "figures", "carried", "wrong")


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
    wanted, number = ask.where.get(key, ""), cell.replace(",", ".")
    return cell == wanted or (is_number(number) and same(float(number), wanted))


PREFIXES = {"k": 1000, "M": 10**6}
"""kJ, MW: a thousand or a million of a unit that is known."""


def scale_of(unit: str, unit_of_question: str) -> Fraction | None:
    """Return a unit in another one, 1 kJ = 1000 J; None where they do not measure the same.

    >>> scale_of("kJ", "J"), scale_of("Nm", "N_m"), scale_of("kg", "N_m"), scale_of("", "")
    (Fraction(1000, 1), Fraction(1, 1), None, Fraction(1, 1))
    >>> scale_of("m·s⁻¹", "m_s"), scale_of("s^-1", "rad_s"), scale_of("Kg m²/sec", "kg_m2_s")
    (Fraction(1, 1), Fraction(1, 1), Fraction(1, 1))
    """
    if unit == unit_of_question or not unit_of_question:
        return Fraction(1) if unit == unit_of_question or not unit else None
    scale = unit_ratio(unit, unit_of_question)
    if scale is None and unit_of_question in ("rad_s", "rad_s2"):
        # a radian is a number: ω in 1/s
        scale = unit_ratio(f"rad*{unit}", unit_of_question)
    if scale is None and unit[:1] in PREFIXES:
        scale = unit_ratio(unit[1:], unit_of_question)
        return None if scale is None else scale * PREFIXES[unit[0]]
    return scale


# --- verdicts -------------------------------------------------------------------------------------------------------
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
