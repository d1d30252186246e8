"""Variants of an exercise: they can be assembled, lie away from limits and are well conditioned."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from math import isfinite, prod, tau
from pathlib import Path
from random import Random
from typing import Any

from cli.exercise.description import Answer, Draw, Exercise, Solved, Value
from cli.exercise.solving import Problem, Workshop, cell_of, placeholders
from cli.show.output import options_of
from dalembert.errors import DataError, quote
from dalembert.figures import Right
from dalembert.hints import nearest

MOST_CONDITION = 25.0
"""Largest condition number of the constraint Jacobian, with lengths divided by the mechanism's size."""
MOST_GROWTH = 60.0
"""An answer changes by at most so many times the share that a datum does."""
STEP = Decimal("1e-6")
NEAR_TIE = Decimal("0.02")
"""An answer lies at least this share of a unit of its last figure away from where the rounding turns."""
TRIES = 400
"""The largest number of variants that are tried for each variant."""


@dataclass(frozen=True, eq=False, repr=False)
class Variant:
    """The numbers of one student, and the right answers."""

    problem: Problem
    solved: Solved

    @property
    def drawn(self) -> Mapping[str, Value]:
        """The drawn values by name."""
        return self.problem.drawn

    @property
    def answers(self) -> list[Answer]:
        """The right answers, in the order of the questions."""
        return self.solved.answers

    @cached_property
    def worked(self) -> Solved:
        """The result with its worked solution, where the command has one."""
        if "--steps" not in options_of(self.problem.exercise.command[0]):
            return self.solved
        return self.problem.result("--steps")


@contextmanager
def workshop(exercise: Exercise) -> Iterator[Workshop]:
    """A folder for the tables of variants, which goes when the work is done."""
    folder = Path(tempfile.mkdtemp(prefix="dalembert-"))
    try:
        shop = Workshop(exercise, folder)
        shop.exercise = replace(exercise, asks=tuple(map(shop.by_column, exercise.asks)))
        _check(shop)
        yield shop
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _check(shop: Workshop) -> None:
    """Refuse names of [draw] that the exercise's files do not have, before anything is drawn."""
    place = shop.exercise.file
    braced = {part for word in shop.exercise.command for part in placeholders(word)}
    for draw in shop.exercise.draws:
        where = f"{place}: [draw], {draw.name}"
        cell = cell_of(draw.name)
        if cell is not None:
            _check_cell(shop, where, draw, cell)
            continue
        if draw.name in braced:
            continue
        if shop.mechanism is None:
            raise DataError(
                f"{where}: no such datum: expected a table's cell such as 'rotor.csv:W1.mass_kg', or a name that stands "
                f"in braces in the command, such as {{{draw.name}}}"
            )
        if draw.name not in shop.dimensions:
            raise DataError(
                f"{where}: the mechanism has no such dimension{nearest(draw.name, shop.dimensions)}"
            )
        _check_unit(where, draw.values, shop.dimensions[draw.name].kind)
    for name in sorted(braced - {draw.name for draw in shop.exercise.draws}):
        raise DataError(f"{place}: key command: found {{{name}}}, expected a name of [draw]")


def _check_cell(shop: Workshop, where: str, draw: Draw, cell: tuple[str, str, str]) -> None:
    file, row, column = cell
    if file not in shop.tables:
        raise DataError(
            f"{where}: found the file {quote(file)}, expected one that the command reads: "
            f"{', '.join(shop.tables) or 'it reads no table'}{nearest(file, shop.tables)}"
        )
    table = shop.table(file)
    if table.row(row) is None:
        raise DataError(f"{where}: no row {quote(row)} in {file}: expected one of {', '.join(table.names)}")
    if table.column(column) is None:
        raise DataError(
            f"{where}: no column {quote(column)} in {file}: expected one of {', '.join(table.header)}"
            f"{nearest(column, table.header)}"
        )
    for value in draw.values:
        shop.entered(draw.name, value)


def _check_unit(where: str, values: Sequence[Value], kind: str) -> None:
    from dalembert.quantities import expected, number_in_si

    for value in values:
        if value.unit and number_in_si(str(value), kind) is None:
            raise DataError(f"{where}: found {quote(str(value))}, expected {expected(kind)}")


def variants(workshop: Workshop, count: int, seed: int, warnings: list[str]) -> list[Variant]:
    """Draw variants, each once as long as there are enough; then they repeat.

    Raises
    ------
    DataError
        Where no variant can be used; why the last one cannot.
    """
    exercise = workshop.exercise
    if not exercise.draws:
        problem = workshop.problem({})
        solved = problem.result()
        solved.answers  # noqa: B018 - what cannot be asked is an error here
        warnings.extend(solved.result.warnings)
        one = Variant(problem, solved)
        return [one] * count
    result: list[Variant] = []
    reason: str = ""
    reasons: set[str] = set()
    tried = refused = 0
    for drawn in _orders(exercise, Random(seed)):
        tried += 1
        variant, why = _usable(workshop, drawn)
        if variant is not None:
            result.append(variant)
            if len(result) == count:
                break
        else:
            refused, reason = refused + 1, f"{_in_words(drawn)}: {why}"
            reasons.add(why)
        if tried >= TRIES * (len(result) + 1):
            break
    if not result:
        if tried > 1 and len(reasons) == 1 and why.startswith("key command"):
            # the command itself is wrong, whatever is drawn
            raise DataError(f"{exercise.file}: {why}")
        raise DataError(
            f"{exercise.file}: [draw]: none of {tried} drawn variants can be used; the last: {reason}; expected other values to draw from"
        )
    if len(result) < count:
        warnings.append(
            f"{exercise.file}: [draw]: {several(len(result), 'variant')} for {count} students: some have the same numbers"
            + (f" ({several(refused, 'variant')} cannot be used; the last: {reason})" if refused else "")
        )
    return [result[k % len(result)] for k in range(count)]


def _in_words(drawn: Mapping[str, Value]) -> str:
    return ", ".join(f"{name} {value}" for name, value in drawn.items())


def several(count: int, noun: str) -> str:
    """Return a number of things in words.

    >>> several(1, "variant"), several(3, "student")
    ('1 variant', '3 students')
    """
    return f"{count} {noun}{'s' * (count != 1)}"


def _orders(exercise: Exercise, random: Random) -> Iterator[dict[str, Value]]:
    """Yield every combination once, in random order."""
    sizes = [len(draw.values) for draw in exercise.draws]
    every = prod(sizes)
    if every <= 200_000:
        numbers: Iterator[int] = iter(random.sample(range(every), every))
    else:
        numbers = _without_repeats(random, every)
    for number in numbers:
        drawn = {}
        for draw, size in zip(exercise.draws, sizes, strict=True):
            number, k = divmod(number, size)
            drawn[draw.name] = draw.values[k]
        yield drawn


def _without_repeats(random: Random, every: int) -> Iterator[int]:
    seen: set[int] = set()
    while len(seen) < 200_000:
        number = random.randrange(every)
        if number not in seen:
            seen.add(number)
            yield number


def _usable(workshop: Workshop, drawn: dict[str, Value]) -> tuple[Variant | None, str]:
    """Return the variant, or why it cannot be used."""
    problem = workshop.problem(drawn)
    try:
        solved = problem.result()
    except DataError as error:
        return None, str(error).removeprefix(f"{workshop.exercise.file}: ")
    why = _pose_trouble(solved.document)
    answers = solved.answers
    why = why or next(filter(None, map(_trouble, answers)), "") or _growth(workshop, drawn, answers)
    return (None, why) if why else (Variant(problem, solved), "")


def _pose_trouble(document: Mapping[str, Any]) -> str:
    """What is wrong with the poses of a mechanism: at a limit, close to one."""
    poses = document.get("poses")
    for pose in poses if isinstance(poses, Sequence) else ():
        if not isinstance(pose, Mapping):
            continue
        if pose.get("assembled") is False:
            return "the mechanism cannot be assembled"
        if pose.get("marks"):
            return f"the mechanism is at a {pose['marks'][0]}"
        condition = pose.get("condition")
        if isinstance(condition, (int, float)) and not condition <= MOST_CONDITION:
            return f"the mechanism is close to a limit (condition {condition:.3g})"
    return ""


def _trouble(answer: Answer) -> str:
    """What is wrong with an answer for a question of figures."""
    what = answer.ask.quantity
    right = Right(answer.value, answer.ask.figures)
    if not right.answer:
        return f"{what} is zero: it has no figures"
    share = (abs(right.value) / right.unit) % 1
    if abs(share - Decimal("0.5")) < NEAR_TIE:
        return f"{what} = {answer.value:.8g} is at the border between two rounded values"
    return ""


def _growth(workshop: Workshop, drawn: Mapping[str, Value], answers: Sequence[Answer]) -> str:
    """What is wrong with the condition: an answer that depends on the last digit of a datum."""
    for name, value in drawn.items():
        if not value.number:
            continue
        beside = {**drawn, name: Value(value.number * (1 + STEP), value.unit)}
        try:
            others = workshop.problem(beside).result().answers
        except DataError:
            return f"{name}: the mechanism is at a limit"
        for answer, other in zip(answers, others, strict=True):
            if not change(answer, other) <= MOST_GROWTH * float(STEP):
                return f"{answer.ask.quantity} is badly conditioned: it depends on the last digits of {name}"
    return ""


def change(answer: Answer, other: Answer) -> float:
    """The share of itself by which an answer changes; an angle in radians, modulo a turn."""
    if answer.is_angle:
        return abs(answer.distance(other.value, answer.value)) * tau / answer.turn
    size = abs(answer.value)
    off = abs(other.value - answer.value)
    return off / size if size and isfinite(off) else float("inf")
