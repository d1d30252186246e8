"""Slips that are found by running the command again on data with a slip in them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property, partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from cli.exercise.description import Answer, Solved, Value
from cli.exercise.slips import Candidates, Load, Pairs, Slip, is_sum, joined, loads, of_loads, of_motion
from cli.exercise.slips_of_rows import gravity, of_rotor, of_work
from cli.exercise.solving import Problem
from cli.exercise.variants import Variant
from dalembert.errors import DataError
from dalembert.quantities import is_number
from dalembert.units import parted, unit_name

MOST = 160
"""The largest number of slips that are tried."""
TIMES = {"ten times too large": Decimal(10), "ten times too small": Decimal("0.1")}
LIKELY = 12
"""The number of likeliest slips of which any two are tried together."""
RESULTS = ("kg_m2_s", "J", "W", "rad_s3", "m_s3")


class Edit(NamedTuple):
    """A slip in the data of a problem."""

    text: str
    place: object
    """Which datum it changes: two slips are at two places."""
    apply: Callable[[Problem], Problem]

    @property
    def is_sign(self) -> bool:
        """Whether it is a sign or a sense: the likeliest of slips."""
        return self.text.endswith(("wrong sign", "the other way"))


class Run(NamedTuple):
    """What a slip makes of all answers; None where it leaves no answer."""

    edit: Edit
    values: list[float | None]


@dataclass(eq=False, repr=False)
class Recomputed:
    """The slips of all questions of a variant; each run serves all of them."""

    variant: Variant

    @cached_property
    def runs(self) -> list[Run]:
        """The command run again with each slip."""
        runs: list[Run] = []
        for edit in self._edits():
            if len(runs) == MOST:
                break
            values = self._values(edit.apply(self.variant.problem))
            if values is not None:
                runs.append(Run(edit, values))
        return runs

    @cached_property
    def loads(self) -> list[Load]:
        """The part of each load in all answers, where they are sums."""
        return loads(self.variant, self._values)

    @cached_property
    def _pair_runs(self) -> list[tuple[Edit, Edit, list[float | None]]]:
        """The command run again with two slips of the likeliest."""
        runs = []
        for one, other in combinations([run.edit for run in self.runs[:LIKELY]], 2):
            if one.place != other.place:
                values = self._values(other.apply(one.apply(self.variant.problem)))
                if values is not None:
                    runs.append((one, other, values))
        return runs

    def _values(self, problem: Problem) -> list[float | None] | None:
        try:
            solved = problem.result()
        except DataError:
            return None
        return [self._value(solved, k) for k in range(len(self.variant.answers))]

    @staticmethod
    def _value(solved: Solved, k: int) -> float | None:
        try:
            return solved.answer(k + 1, solved.exercise.asks[k]).value
        except DataError:
            return None

    def slips(self, k: int) -> list[Slip]:
        """Return the slips of a question: of its answer alone, of other assemblies, of the data."""
        own = [*self._own(k), *self._siblings(k), *self._assemblies(k)]
        data = [Slip(run.edit.text, value) for run in self.runs if (value := run.values[k]) is not None]
        # of two slips with one result the first is named: a phase counted the other way turns the angle of a correction
        return [*data, *own] if self.variant.problem.exercise.command[0] == "field" else [*own, *data]

    def _own(self, k: int) -> Iterator[Slip]:
        answer = self.variant.answers[k]
        for text, change in finals(answer):
            yield Slip(text, change(answer.value))

    def pairs(self, k: int) -> Pairs | None:
        """Return what two slips make of an answer: one in the data and one in the answer, or two of the likeliest in the data."""
        answer = self.variant.answers[k]
        made: list[tuple[float, str, bool]] = []
        for run in self.runs:
            value = run.values[k]
            if value is not None and value != answer.value:
                for text, change in finals(answer):
                    is_sign = run.edit.is_sign or text.endswith("wrong sign")
                    made.append((change(value), f"{run.edit.text} and {text}", is_sign))
        for one, other, values in self._pair_runs:
            value = values[k]
            if value is not None:
                made.append((value, f"{one.text} and {other.text}", one.is_sign or other.is_sign))
        made = [each for each in made if abs(each[0] - answer.value) > 1e-9 * abs(answer.value)]
        if not made:
            return None
        amounts, texts, likely = zip(*made, strict=True)
        return Pairs(np.array(amounts), lambda i: str(texts[i]), np.array(likely))

    def _siblings(self, k: int) -> Iterator[Slip]:
        """The other component of a vector: sine for cosine."""
        answer = self.variant.answers[k]
        name, unit = parted(answer.ask.quantity, further=RESULTS)
        match = re.fullmatch(r"(.*(?:^|_)[vaf]?)([xy])", name)
        if match is None:
            return
        other = replace(
            answer.ask, quantity=f"{match[1]}{'y' if match[2] == 'x' else 'x'}" + (f"_{unit}" if unit else "")
        )
        try:
            value = self.variant.solved.answer(k + 1, other).value
        except DataError:
            return
        yield Slip("sine in place of cosine: the other component", value)
        yield Slip("sine in place of cosine: the other component, with the wrong sign", -value)

    @cached_property
    def _others(self) -> Solved | None:
        """The result in every assembly; None where there is no other."""
        words = self.variant.problem.command
        if self.variant.problem.exercise.command[0] not in ("mechanism", "forces") or "--branch" in words:
            return None
        try:
            return replace_further(self.variant.problem, "--branch", "all").result()
        except DataError:
            return None

    @cached_property
    def assemblies(self) -> list[list[float | None]]:
        """The answers in every assembly."""
        if self._others is None:
            return []
        branches = next((c.values for t in self._others.tables for c in t.columns if c.name == "branch"), [])
        return [
            [self._in_branch(k, number) for k in range(len(self.variant.answers))]
            for number in dict.fromkeys(map(str, branches))
        ]

    def _in_branch(self, k: int, number: str) -> float | None:
        assert self._others is not None
        ask = self.variant.answers[k].ask
        try:
            return self._others.answer(k + 1, replace(ask, where={**ask.where, "branch": number})).value
        except DataError:
            return None

    def _assemblies(self, k: int) -> Iterator[Slip]:
        for values in self.assemblies:
            if (value := values[k]) is not None:
                yield Slip("the other assembly", value)

    def _edits(self) -> Iterator[Edit]:
        """Yield the slips in the data, the likelier first."""
        problem = self.variant.problem
        yield from _options(problem)
        yield from self._drawn()
        yield from _cells(problem)

    def _drawn(self) -> Iterator[Edit]:
        """Slips in the dimensions that the text names or the draw changes."""
        shop = self.variant.problem.workshop

        def drawn(text: str, name: str, value: Value) -> Edit:
            return Edit(text, name, lambda p: replace(p, drawn={**p.drawn, name: value}))

        mentioned = re.findall(r"\{([^{}\n]+)\}", shop.exercise.text)
        names = [name for name in dict.fromkeys([*self.variant.drawn, *mentioned]) if ":" not in name]
        for name in names:
            value = shop.datum(name, self.variant.drawn)
            if value is None or not value.number:
                continue
            for text, number in _slipped(name, value):
                yield drawn(text, name, number)
        g = gravity(self.variant)
        if g and "gravity.y" in shop.dimensions:
            for other in (9.81, 10.0):
                if abs(other - g) > 1e-6 * g:
                    value = Value(Decimal(str(-other)), "")
                    yield drawn(f"g = {other:g} in place of {g:g}", "gravity.y", value)


def replace_further(problem: Problem, *words: str) -> Problem:
    """Return a problem with further words behind its command."""
    return replace(problem, further=[*problem.further, *words])


def finals(answer: Answer) -> Iterator[tuple[str, Callable[[float], float]]]:
    """Yield the slips in the answer itself."""
    if answer.is_angle:
        half = 180.0 if unit_name(answer.unit) == "deg" else np.pi
        yield "180° off", lambda value: (value + half) % (2 * half)
        yield "the angle is counted the other way", lambda value: -value % (2 * half)
        yield "sine in place of cosine in the angle", lambda value: (half / 2 - value) % (2 * half)
        if half == 180.0:
            yield "radians in place of degrees", lambda value: value * np.pi / 180
        else:
            yield "degrees in place of radians", lambda value: value * 180 / np.pi
        return
    yield "the answer has the wrong sign", lambda value: -value
    if re.search(r"(^|_)(omega|speed)", answer.ask.quantity) or unit_name(answer.unit) in ("rad_s", "rpm"):
        share = 30 / np.pi if unit_name(answer.unit) == "rad_s" else np.pi / 30
        yield "rpm in place of rad/s", lambda value: value * share
    yield "the answer is ten times too large", lambda value: value * 10
    yield "the answer is ten times too small", lambda value: value / 10


def _slipped(name: str, value: Value) -> Iterator[tuple[str, Value]]:
    """Yield a datum with each slip in it."""
    unit = unit_name(value.unit)
    degrees = unit == "deg"
    if unit == "rpm":
        yield f"{name}: rpm taken for rad/s", Value(value.number, "rad/s")
    if degrees:
        yield f"{name}: degrees taken as radians", Value(value.number, "rad")
        yield f"{name} is counted the other way", Value(-value.number, value.unit)
        yield f"{name}: sine in place of cosine", Value(90 - value.number, value.unit)
        return
    yield f"{name} has the wrong sign", Value(-value.number, value.unit)
    for text, times in TIMES.items():
        yield f"{name} is {text}", Value(value.number * times, value.unit)
    if "radius" in name:
        yield f"{name}: the diameter in place of the radius", Value(2 * value.number, value.unit)


def _options(problem: Problem) -> Iterator[Edit]:
    """Slips in the options of the command."""
    words = list(problem.words or problem.exercise.command)

    def put(text: str, k: int, word: str) -> Edit:
        def apply(p: Problem) -> Problem:
            own = list(p.words or p.exercise.command)
            return replace(p, words=[*own[:k], word, *own[k + 1 :]])

        return Edit(text, k, apply)

    for k, word in enumerate(words):
        if k and words[k - 1] == "--gravity":
            for other in ("9.81", "10"):
                changed = re.sub(r"(?<![\d.])(9\.81|9\.80665|10(?:\.0+)?)(?![\d.])", other, word)
                if changed != word:
                    yield put(
                        f"g = {other} in place of {word.lstrip('0,-').rstrip(',0') or word}", k, changed
                    )
        if re.fullmatch(r"[\d.]+rpm", word):
            yield put("rpm taken for rad/s", k, word.removesuffix("rpm") + "rad_s")
        match = re.fullmatch(r"([\d.]+)deg", word)
        if match:
            yield put("degrees taken as radians", k, f"{match[1]}rad")
    if problem.exercise.command[0] == "field":
        lag, text = "--phase-lag", "the phase is counted the other way"
        if lag in words:

            def leading(p: Problem) -> Problem:
                return replace(p, words=[word for word in p.words or p.exercise.command if word != lag])

            yield Edit(text, lag, leading)
        else:
            yield Edit(text, lag, lambda p: replace_further(p, lag))


def _cells(problem: Problem) -> Iterator[Edit]:
    """Slips in the cells of the tables."""
    kinds: list[list[Edit]] = [[], [], [], []]
    for file, sheet in problem.sheets.items():
        names = sheet.names()
        kept = sheet.column("trial_kept")
        if problem.exercise.command[0] == "field":
            kinds[0] += _trials_left_on(problem, file)
        for r, row in enumerate(sheet.rows):
            for c, text in enumerate(row):
                quantity, unit = parted(sheet.header[c], further=("kg_m2",))
                cell = text.strip().replace(",", ".")
                if not unit or c == kept or not is_number(cell) or not Decimal(cell):
                    continue
                what = f"{quantity.replace('_', ' ')} of {names[r]}"
                for kind, slip, value in _of_cell(quantity, unit, Decimal(cell)):
                    place = (file, r, c)
                    kinds[kind].append(Edit(f"the {what} {slip}", place, _put({place: f"{value:f}"})))
    for edits in kinds:
        yield from edits


def _put(cells: dict[tuple[str, int, int], str]) -> Callable[[Problem], Problem]:
    return lambda p: replace(p, cells={**p.cells, **cells})


def _of_cell(quantity: str, unit: str, number: Decimal) -> Iterator[tuple[int, str, Decimal]]:
    """Yield the slips of a cell: how likely (0 first), what, the number."""
    if unit == "deg":
        yield 1, "is 180° off", number + 180
        yield 1, "is counted the other way", -number
        yield 2, "has degrees taken as radians", Decimal(repr(float(number) * 180 / np.pi))
        yield 2, "has sine in place of cosine", 90 - number
        return
    yield 1, "has the wrong sign", -number
    for text, times in TIMES.items():
        yield 3, f"is {text}", number * times
    if "radius" in quantity:
        yield 1, "is the diameter in place of the radius", 2 * number
        yield 1, "is half the radius, as if it were a diameter", number / 2
    if unit == "rpm":
        yield 1, "has rpm taken for rad/s", Decimal(repr(float(number) * 30 / np.pi))
    if quantity in ("mass", "inertia"):
        yield 2, "is left out", Decimal(0)


def _trials_left_on(problem: Problem, file: str) -> list[Edit]:
    """Trial masses that were left on taken as removed, or the reverse."""
    sheet = problem.sheets[file]
    mass = next(
        (k for k, title in enumerate(sheet.header) if title.startswith(("trial_mass", "trial_unbalance"))),
        None,
    )
    if mass is None:
        return []
    column = sheet.column("trial_kept")
    trials = [r for r, row in enumerate(sheet.rows) if row[mass].strip()]
    if column is None:
        kept = ["yes" if r in trials else "" for r in range(len(sheet.rows))]

        def further(p: Problem) -> Problem:
            return replace(p, added={file: ("trial_kept", kept)})

        return [Edit("a trial mass is taken as left on", "trial_kept", further)]
    on = {r for r in trials if sheet.rows[r][column].strip().lower() in ("yes", "ja", "y", "1", "true")}
    other, text = (
        ("", "a trial mass that was left on is taken as removed")
        if on
        else ("yes", "a trial mass is taken as left on")
    )
    return [Edit(text, "trial_kept", _put({(file, r, column): other for r in on or trials}))]


PROVIDERS = {"work": of_work, "forces": of_work, "balance": of_rotor}


def candidates(variant: Variant, again: Recomputed | None = None) -> list[Candidates]:
    """Return the slips of every question of a variant; `again`: its runs with slips in the data."""
    runs = again or Recomputed(variant)
    return [_of_question(variant, k, runs) for k in range(len(variant.answers))]


def _of_question(variant: Variant, k: int, runs: Recomputed) -> Candidates:
    provider = PROVIDERS.get(variant.problem.exercise.command[0])
    own = None if provider is None else provider(variant, k)
    if own is not None:
        return own
    answer = variant.answers[k]
    parts, pairs = of_motion(variant, k)
    loaded, two_loads = of_loads(answer, k, runs.loads) if is_sum(answer) else ([], lambda: None)
    return Candidates(
        answer, [*parts, *loaded, *runs.slips(k)], joined([pairs, two_loads, partial(runs.pairs, k)])
    )
