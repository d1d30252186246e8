"""Slips that are found by running the command again on data with a slip in them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property

import numpy as np

from cli.exercise.answers import Answer, Solved
from cli.exercise.description import Value
from cli.exercise.slips import Slip
from cli.exercise.solving import Problem
from cli.exercise.variants import Variant
from cli.exercise.work_slips import gravity
from dalembert.errors import DataError
from dalembert.quantities import is_number
from dalembert.units import parted, unit_name

MOST = 160
"""So many slips are tried."""
TIMES = {"ten times too large": Decimal(10), "ten times too small": Decimal("0.1")}
RESULTS = ("kg_m2_s", "J", "W", "rad_s3", "m_s3")


@dataclass(eq=False, repr=False)
class Recomputed:
    """The slips of all questions of a variant; each run serves all of them."""

    variant: Variant

    @cached_property
    def _runs(self) -> list[tuple[str, list[float | None]]]:
        runs: list[tuple[str, list[float | None]]] = []
        for text, problem in self._problems():
            if len(runs) == MOST:
                break
            try:
                solved = problem.result()
            except DataError:
                continue
            runs.append((text, [self._value(solved, k) for k in range(len(self.variant.answers))]))
        return runs

    @staticmethod
    def _value(solved: Solved, k: int) -> float | None:
        try:
            return solved.answer(k + 1, solved.exercise.asks[k]).value
        except DataError:
            return None

    def slips(self, k: int) -> list[Slip]:
        """Return the slips of a question: of its answer alone, of other assemblies, of the data."""
        answer = self.variant.answers[k]
        own = [*_final(answer), *self._siblings(k), *self._assemblies(k)]
        data = [Slip(text, value) for text, values in self._runs if (value := values[k]) is not None]
        # of two slips with one result the first is named: a phase counted the other way turns the angle of a correction
        return [*data, *own] if self.variant.problem.exercise.command[0] == "field" else [*own, *data]

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

    def _assemblies(self, k: int) -> Iterator[Slip]:
        if self._others is None:
            return
        branches = next((c.values for t in self._others.tables for c in t.columns if c.name == "branch"), [])
        for number in dict.fromkeys(map(str, branches)):
            ask = self.variant.answers[k].ask
            try:
                value = self._others.answer(k + 1, replace(ask, where={**ask.where, "branch": number})).value
            except DataError:
                continue
            yield Slip("the other assembly", value)

    def _problems(self) -> Iterator[tuple[str, Problem]]:
        """Yield the problem with each slip in its data, the likelier first."""
        problem = self.variant.problem
        yield from _options(problem)
        yield from self._drawn()
        yield from _cells(problem)

    def _drawn(self) -> Iterator[tuple[str, Problem]]:
        """Slips in the dimensions that the text names or the draw changes."""
        _problem, shop = self.variant.problem, self.variant.problem.workshop
        mentioned = re.findall(r"\{([^{}\n]+)\}", shop.exercise.text)
        names = [name for name in dict.fromkeys([*self.variant.drawn, *mentioned]) if ":" not in name]
        for name in names:
            value = shop.datum(name, self.variant.drawn)
            if value is None or not value.number:
                continue
            for text, number in _slipped(name, value):
                yield text, shop.problem({**self.variant.drawn, name: number})
        g = gravity(self.variant)
        if g and "gravity.y" in shop.dimensions:
            for other in (9.81, 10.0):
                if abs(other - g) > 1e-6 * g:
                    value = Value(Decimal(str(-other)), "")
                    yield (
                        f"g = {other:g} in place of {g:g}",
                        shop.problem({**self.variant.drawn, "gravity.y": value}),
                    )


def replace_further(problem: Problem, *words: str) -> Problem:
    """Return a problem with further words behind its command."""
    return replace(problem, further=[*problem.further, *words])


def _final(answer: Answer) -> Iterator[Slip]:
    """Slips in the answer itself."""
    value = answer.value
    if answer.is_angle:
        half = 180.0 if unit_name(answer.unit) == "deg" else np.pi
        yield Slip("180° off", (value + half) % (2 * half))
        yield Slip("the angle is counted the other way", -value % (2 * half))
        yield Slip("sine in place of cosine in the angle", (half / 2 - value) % (2 * half))
        if half == 180.0:
            yield Slip("radians in place of degrees", value * np.pi / 180)
        else:
            yield Slip("degrees in place of radians", value * 180 / np.pi)
        return
    yield Slip("the answer has the wrong sign", -value)
    if re.search(r"(^|_)(omega|speed)", answer.ask.quantity) or unit_name(answer.unit) in ("rad_s", "rpm"):
        share = np.pi / 30
        yield Slip(
            "rpm in place of rad/s", value / share if unit_name(answer.unit) == "rad_s" else value * share
        )
    yield Slip("the answer is ten times too large", value * 10)
    yield Slip("the answer is ten times too small", value / 10)


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


def _options(problem: Problem) -> Iterator[tuple[str, Problem]]:
    """Slips in the options of the command."""
    words = list(problem.words or problem.exercise.command)

    def with_word(k: int, word: str) -> Problem:
        return replace(problem, words=[*words[:k], word, *words[k + 1 :]])

    for k, word in enumerate(words):
        if k and words[k - 1] == "--gravity":
            for other in ("9.81", "10"):
                changed = re.sub(r"(?<![\d.])(9\.81|9\.80665|10(?:\.0+)?)(?![\d.])", other, word)
                if changed != word:
                    yield (
                        f"g = {other} in place of {word.lstrip('0,-').rstrip(',0') or word}",
                        with_word(k, changed),
                    )
        if re.fullmatch(r"[\d.]+rpm", word):
            yield "rpm taken for rad/s", with_word(k, word.removesuffix("rpm") + "rad_s")
        match = re.fullmatch(r"([\d.]+)deg", word)
        if match:
            yield "degrees taken as radians", with_word(k, f"{match[1]}rad")
    if problem.exercise.command[0] == "field":
        if "--phase-lag" in words:
            rest = [word for word in words if word != "--phase-lag"]
            yield (
                "the phase is counted the other way",
                replace(problem, words=rest),
            )
        else:
            yield "the phase is counted the other way", replace_further(problem, "--phase-lag")


def _cells(problem: Problem) -> Iterator[tuple[str, Problem]]:
    """Slips in the cells of the tables."""
    kinds: list[list[tuple[str, Problem]]] = [[], [], [], []]

    def changed(cells: dict[tuple[str, int, int], str]) -> Problem:
        return replace(problem, cells={**problem.cells, **cells})

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
                number, what = Decimal(cell), f"{quantity.replace('_', ' ')} of {names[r]}"

                def put(
                    kind: int, said: str, value: Decimal, r: int = r, c: int = c, file: str = file
                ) -> None:
                    kinds[kind].append((said, changed({(file, r, c): f"{value:f}"})))

                if unit == "deg":
                    put(1, f"the {what} is 180° off", number + 180)
                    put(1, f"the {what} is counted the other way", -number)
                    put(
                        2, f"the {what}: degrees taken as radians", Decimal(repr(float(number) * 180 / np.pi))
                    )
                    put(2, f"the {what}: sine in place of cosine", 90 - number)
                    continue
                put(1, f"the {what} has the wrong sign", -number)
                for said, times in TIMES.items():
                    put(3, f"the {what} is {said}", number * times)
                if "radius" in quantity:
                    put(1, f"the {what}: the diameter in place of the radius", 2 * number)
                    put(1, f"the {what}: half the radius, as if it were a diameter", number / 2)
                if unit == "rpm":
                    put(1, f"the {what}: rpm taken for rad/s", Decimal(repr(float(number) * 30 / np.pi)))
                if quantity in ("mass", "inertia"):
                    put(2, f"the {what} is left out", Decimal(0))
    for kind in kinds:
        yield from kind


def _trials_left_on(problem: Problem, file: str) -> list[tuple[str, Problem]]:
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
        return [("a trial mass is taken as left on", replace(problem, added={file: ("trial_kept", kept)}))]
    on = {r for r in trials if sheet.rows[r][column].strip().lower() in ("yes", "ja", "y", "1", "true")}
    other, said = (
        ("", "a trial mass that was left on is taken as removed")
        if on
        else ("yes", "a trial mass is taken as left on")
    )
    cells = {(file, r, column): other for r in on or trials}
    return [(said, replace(problem, cells={**problem.cells, **cells}))]
