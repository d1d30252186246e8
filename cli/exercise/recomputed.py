"""Slips that are found by running the command again on data with a slip in them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property, partial
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from cli.exercise.description import Solved, Value
from cli.exercise.slips import (
    WEIGHTS,
    Candidates,
    Pairs,
    Slip,
    changes_of,
    finals,
    joined,
    of_datum,
    of_gravity,
)
from cli.exercise.slips_of_sums import Load, is_sum, loads, of_ledger, of_loads, of_motion, of_rotor
from cli.exercise.solving import DataTable, Problem
from cli.exercise.variants import Variant
from dalembert.errors import DataError
from dalembert.units import G0, unit_name

MOST = 160
"""The largest number of slips that are tried."""
LIKELY = 12
"""The number of likeliest slips of which any two are tried together."""
RANGES = ("--over", "--time", "--cases")
"""Options that say at how many places a quantity is shown."""
NUMBER = r"(?<![\w.])([-+]?\d+\.?\d*)"
AMOUNT = re.compile(NUMBER + r"([A-Za-z]\w*)")
"""A number with its unit in a word of the command."""


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
        answer = self.variant.answers[k]
        own = [*finals(answer), *self._siblings(k), *self._assemblies(k)]
        if self.variant.problem.exercise.command[0] == "trial":
            # a tenth of the rotor's weight
            own += [Slip(text, answer.value * share) for text, share in of_gravity(G0)]
        data = [Slip(run.edit.text, value) for run in self.runs if (value := run.values[k]) is not None]
        # of two slips with one result the first is named: a phase counted the other way turns the angle of a correction
        return [*data, *own] if self.variant.problem.exercise.command[0] == "field" else [*own, *data]

    def pairs(self, k: int) -> Pairs | None:
        """Return what two slips make of an answer: one in the data and one in the answer, or two of the likeliest in the data."""
        answer = self.variant.answers[k]
        made: list[tuple[float, str, bool]] = []
        for run in self.runs:
            value = run.values[k]
            if value is not None and value != answer.value:
                for text, change in changes_of(answer):
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
        name, unit = answer.ask.parted
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
        problem = self.variant.problem
        if problem.exercise.command[0] not in ("mechanism", "forces"):
            return None
        words = list(problem.words or problem.exercise.command)
        if "--branch" in words:
            # the assembly that the command names is one of all
            at = words.index("--branch")
            problem = replace(problem, words=[*words[:at], *words[at + 2 :]])
        try:
            return replace_further(problem, "--branch", "all").result()
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
        yield from _columns(problem)
        # of link states each power is a term, which the ledger has
        if problem.exercise.command[0] != "work":
            yield from _cells(problem)

    def _drawn(self) -> Iterator[Edit]:
        """Slips in the dimensions that the text names or the draw changes."""
        problem = self.variant.problem
        shop = problem.workshop

        def drawn(text: str, values: Mapping[str, Value]) -> Edit:
            return Edit(text, next(iter(values)), lambda p: replace(p, drawn={**p.drawn, **values}))

        mentioned = re.findall(r"\{([^{}\n]+)\}", shop.exercise.text)
        speeds = [path for path in shop.dimensions if re.fullmatch(r"input(\.\d+)?\.speed", path)]
        names = dict.fromkeys([*self.variant.drawn, *mentioned, *speeds])
        for name in names:
            value = None if ":" in name else shop.datum(name, self.variant.drawn)
            if value is None or not value.number:
                continue
            for slip in of_datum(_quantity(problem.exercise.command, name), unit_name(value.unit)):
                yield drawn(f"{name}{slip.text}", {name: Value(slip.change(value.number), value.unit)})
        g = problem.gravity
        if g and "gravity.y" in shop.dimensions:
            field = complex(shop.described.mechanism.gravity)
            for text, share in (*of_gravity(g), *WEIGHTS):
                x, y = (Value(Decimal(repr(part * share)), "") for part in (field.real, field.imag))
                yield drawn(text, {"gravity.x": x, "gravity.y": y})


def _quantity(words: Sequence[str], name: str) -> str:
    """Return what a drawn value is: the option whose value it is, or the last part of a dimension's path."""
    for option, word in pairwise(words):
        if f"{{{name}}}" in word and option.startswith("--"):
            return option.removeprefix("--")
    return name.rpartition(".")[2]


def replace_further(problem: Problem, *words: str) -> Problem:
    """Return a problem with further words behind its command."""
    return replace(problem, further=[*problem.further, *words])


def _options(problem: Problem) -> Iterator[Edit]:
    """Slips in the options of the command."""
    words = problem.exercise.command

    def put(text: str, k: int, word: str) -> Edit:
        def apply(p: Problem) -> Problem:
            own = list(p.words or words)
            return replace(p, words=[*own[:k], word, *own[k + 1 :]])

        return Edit(text, k, apply)

    for k, word in enumerate(words):
        option = words[k - 1]
        if option == "--gravity" and (g := problem.gravity):
            for text, share in (*of_gravity(g), *WEIGHTS):
                yield put(text, k, _times(word, share))
        if option in RANGES:
            continue
        for match in AMOUNT.finditer(word):
            for slip in of_datum(option.removeprefix("--"), match[2]):
                if slip.is_unit or match[2] == "deg":
                    number = slip.change(Decimal(match[1]))
                    changed = f"{word[: match.start()]}{number:f}{match[2]}{word[match.end() :]}"
                    yield put(f"{match[0]}{slip.text}", k, changed)
    if problem.exercise.command[0] in ("field", "index"):
        lag, text = "--phase-lag", "the phase is counted the other way"
        if lag in words:
            yield put(text, words.index(lag), "")
        else:
            yield Edit(text, lag, lambda p: replace_further(p, lag))


def _times(word: str, factor: float) -> str:
    return re.sub(NUMBER, lambda match: repr(float(match[0]) * factor), word)


def _numbers(table: DataTable) -> Iterator[tuple[int, int, str, str, Decimal]]:
    """Yield the numbers of a table that are not zero: row, column, quantity, unit, number."""
    for c in range(len(table.header)):
        quantity, unit = table.quantity(c)
        for r in range(len(table.rows) if unit else 0):
            number = table.number(r, c)
            if number:
                yield r, c, quantity, unit, number


def _columns(problem: Problem) -> Iterator[Edit]:
    """Slips in all cells of a column alike."""
    for file, table in problem.tables.items():
        cells: dict[str, dict[tuple[str, int, int], str]] = {}
        for r, c, quantity, unit, number in _numbers(table):
            for slip in of_datum(quantity, unit):
                if slip.is_unit:
                    text = f"{quantity.replace('_', ' ')}{slip.text}"
                    cells.setdefault(text, {})[file, r, c] = f"{slip.change(number):f}"
        for text, changed in cells.items():
            if len(changed) > 1:
                yield Edit(text, text, _put(changed))


def _cells(problem: Problem) -> Iterator[Edit]:
    """Slips in the cells of the tables, the likelier first."""
    edits: list[tuple[int, Edit]] = []
    for file, table in problem.tables.items():
        if problem.exercise.command[0] == "field":
            edits += [(0, edit) for edit in _trials_left_on(problem, file)]
        for r, c, quantity, unit, number in _numbers(table):
            what, place = f"{quantity.replace('_', ' ')} of {table.called(r)}", (file, r, c)
            for slip in of_datum(quantity, unit):
                changed = _put({place: f"{slip.change(number):f}"})
                edits.append((slip.likely, Edit(f"{what}{slip.text}", place, changed)))
    yield from (edit for _, edit in sorted(edits, key=lambda each: each[0]))


def _put(cells: dict[tuple[str, int, int], str]) -> Callable[[Problem], Problem]:
    return lambda p: replace(p, cells={**p.cells, **cells})


def _trials_left_on(problem: Problem, file: str) -> list[Edit]:
    """Trial masses that were left on taken as removed, or the reverse."""
    table = problem.tables[file]
    quantities = [table.quantity(k)[0].lower() for k in range(len(table.header))]
    mass = next(
        (k for k, each in enumerate(quantities) if each.startswith(("trial_mass", "trial_unbalance"))), None
    )
    if mass is None:
        return []
    column = table.column("trial_kept")
    trials = [r for r, row in enumerate(table.rows) if row[mass].strip()]
    if column is None:
        kept = ["yes" if r in trials else "" for r in range(len(table.rows))]

        def further(p: Problem) -> Problem:
            return replace(p, added={file: ("trial_kept", kept)})

        return [Edit("a trial mass is taken as left on", "trial_kept", further)]
    on = {r for r in trials if table.rows[r][column].strip().lower() in ("yes", "ja", "y", "1", "true")}
    other, text = (
        ("", "a trial mass that was left on is taken as removed")
        if on
        else ("yes", "a trial mass is taken as left on")
    )
    return [Edit(text, "trial_kept", _put({(file, r, column): other for r in on or trials}))]


def candidates(variant: Variant, again: Recomputed | None = None) -> list[Candidates]:
    """Return the slips of every question of a variant; `again`: its runs with slips in the data."""
    runs = again or Recomputed(variant)
    return [_of_question(variant, k, runs) for k in range(len(variant.answers))]


def _of_question(variant: Variant, k: int, runs: Recomputed) -> Candidates:
    own = of_rotor(variant, k) if variant.problem.exercise.command[0] == "balance" else None
    if own is not None:
        return own
    answer = variant.answers[k]
    sums = [of_ledger(variant, k)]
    if not sums[0][0]:
        sums = [of_motion(variant, k), *([of_loads(answer, k, runs.loads)] if is_sum(answer) else [])]
    singles = [slip for slips, _ in sums for slip in slips]
    return Candidates(
        answer, [*singles, *runs.slips(k)], joined([*(pairs for _, pairs in sums), partial(runs.pairs, k)])
    )
