"""The likely mistake behind a wrong answer: what one slip of a list, or two, make of the right answer.

A slip is named where it alone reproduces the answer to its digits: where two make numbers that round to the answer, none is.
A whole number with zeros at its end has the name of a slip that makes it exactly; where none does, of one that rounds to it.
An answer of two digits has a name only where a random number would hardly meet a slip; two slips are named only where the
answer has four digits or more, and a random number would hardly meet a pair.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from math import isfinite, log, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cli.exercise.description import Answer
from dalembert.figures import Right, Typed
from dalembert.units import unit_name

Real = NDArray[np.float64]

FEWEST = 2
"""An answer of fewer digits, where more are asked, is named only where a slip makes it exactly."""
SURE = 3
"""From so many digits on random numbers hardly meet a slip."""
DIGITS = 4
"""From so many digits on two slips may be named."""
CHANCE = 0.015
"""Two slips, or one behind an answer of two digits, are named where less than this share of random numbers would meet any."""
SIZES = 10.0
"""Random numbers beside an answer of two digits: from its tenth to so many times it, evenly on a logarithmic scale."""
ABOUT = 0.2
"""Random numbers beside a pair: within this share of it."""
EQUAL = 1e-9
"""Two slips make one number where it differs by less than this share of it."""
MOST_PAIRED = 400
"""The largest number of changes of which any two are tried together: of more, a random number would meet a pair."""
GRAVITIES = (9.81, 10.0)
"""Values of g in courses."""


@dataclass(frozen=True)
class Slip:
    """What one slip makes of an answer, in the unit asked for."""

    text: str
    value: float


@dataclass(frozen=True, eq=False, repr=False)
class Pairs:
    """What two slips make of an answer: values, and which two slips; the likelier kind first."""

    values: Real
    texts: Callable[[int], str]
    likely: NDArray[np.bool_]
    """Where one of the two is a sign."""


Slips = tuple[list[Slip], Callable[[], Pairs | None]]
"""The slips of an answer, and pairs of them, which are formed on request."""


def joined(every: Sequence[Callable[[], Pairs | None]]) -> Callable[[], Pairs | None]:
    """Put pairs of several kinds together, the likelier kind first; they are formed on request."""

    def pairs() -> Pairs | None:
        made = [each for one in every if (each := one()) is not None]
        if not made:
            return None
        starts = np.cumsum([0, *(len(each.values) for each in made)])

        def text(k: int) -> str:
            of = int(np.searchsorted(starts, k, side="right")) - 1
            return made[of].texts(k - int(starts[of]))

        return Pairs(
            np.concatenate([each.values for each in made]),
            text,
            np.concatenate([each.likely for each in made]),
        )

    return pairs


@dataclass(eq=False, repr=False)
class Candidates:
    """The slips of one question."""

    answer: Answer
    singles: list[Slip]
    pairs: Callable[[], Pairs | None] = lambda: None

    @cached_property
    def right(self) -> Right:
        """The judge of the right answer."""
        return Right(self.answer.value, self.answer.ask.figures)

    @cached_property
    def _pairs(self) -> Pairs | None:
        return self.pairs()

    @cached_property
    def wrong(self) -> list[Slip]:
        """The slips that change the answer at the figures asked."""
        seen, likely = set(), []
        for slip in self.singles:
            if not isfinite(slip.value) or abs(slip.value) > 1e60:
                continue
            exact = Decimal(slip.value)
            if self.right.verdict(Typed(exact)) == "right" or (
                self.answer.is_angle and abs(self.answer.distance(slip.value, self.answer.value)) < 1e-9
            ):
                continue
            key = f"{slip.value:.9g}"
            if key not in seen:
                seen.add(key)
                likely.append(slip)
        return likely

    def name(self, number: Typed, scale: float = 1.0) -> str | None:
        """Return the likely mistake behind a wrong answer; None where no slip reproduces it, or several do.

        `scale`: the number's unit in the unit asked for.
        """
        a, size = float(number.value) * scale, abs(scale)
        figures = self.answer.ask.figures
        if not a or number.digits < min(FEWEST, figures):
            exact = self.met(a, EQUAL * (abs(a) or abs(self.answer.value)))
            return exact[0].text if len(exact) == 1 else None
        own = 10.0 ** (number.value.adjusted() - figures + 1) * size
        most = max(float(self.right.unit), own) / 2 * (1 + 1e-9)
        halves = [float(half) * size for half in number.half_units]
        # zeros at the end of a whole number may stand for digits that were rounded, to the figures asked or to far fewer
        zeros = len(halves) - 1 if halves[-1] > 10 * own else sum(half <= most for half in halves[1:])
        digits = number.digits - zeros
        if digits < SURE:
            met = self.met(a, halves[zeros])
            return met[0].text if len(met) == 1 and self._chance(a, halves[zeros]) <= CHANCE else None
        # a slip that makes all digits as they were typed goes before those that round to them
        met = self.met(a, halves[0]) or self.met(a, halves[zeros])
        if met or number.digits < DIGITS or self._pairs is None:
            return met[0].text if len(met) == 1 else None
        return self._of_two(a, halves[0])

    def met(self, a: float, half: float) -> list[Slip]:
        """Return the slips within half a unit of an answer; of those that make one number the first."""
        met: list[Slip] = []
        equal = EQUAL * (abs(a) or abs(self.answer.value))
        for slip in self.wrong:
            if abs(self.answer.distance(slip.value, a)) <= half * (1 + 1e-9) and not any(
                abs(self.answer.distance(slip.value, other.value)) <= equal for other in met
            ):
                met.append(slip)
        return met

    def _chance(self, a: float, half: float) -> float:
        """The share of random numbers of the size of an answer, and of its sign, that would meet a slip."""
        if self.answer.is_angle:
            return len(self.wrong) * 2 * half / self.answer.turn
        near = sum(1 / SIZES <= slip.value / a <= SIZES for slip in self.wrong)
        return near * half / (abs(a) * log(SIZES))

    def _of_two(self, a: float, half: float) -> str | None:
        pairs = self._pairs
        assert pairs is not None
        off = pairs.values - a
        if self.answer.is_angle:
            off = off - self.answer.turn * np.rint(off / self.answer.turn)
        off = np.abs(off)
        room = ABOUT * abs(a) if not self.answer.is_angle else ABOUT * self.answer.turn / 4
        for among in (pairs.likely, np.ones(len(off), dtype=bool)):
            about = np.count_nonzero(off[among] <= room)
            if about * half > CHANCE * room:
                return None
            hits = np.flatnonzero(among & (off <= half * (1 + 1e-9)))
            if len(hits):
                return pairs.texts(int(hits[0]))
        return None


ALONE = -1
"""The term of a change that goes together with no other."""


@dataclass(frozen=True)
class Change:
    """A change of one term of a sum."""

    term: int
    text: str
    by: complex
    """What it adds to the sum."""
    is_sign: bool = False


def together(first: Change, second: Change) -> str:
    """Say two slips, a sign before the other."""
    if second.is_sign and not first.is_sign:
        first, second = second, first
    return f"{first.text} and {second.text}"


def of_sum(
    answer: Answer,
    changes: Sequence[Change],
    total: complex,
    value_of: Callable[[NDArray[np.complex128]], Real],
) -> Slips:
    """Return the slips of an answer that follows from a sum of terms: each change, and pairs of changes of two terms.

    `value_of`: the answer that follows from sums, in the unit asked for.
    """
    by = np.array([change.by for change in changes], dtype=complex)
    singles = [Slip(c.text, float(v)) for c, v in zip(changes, value_of(total + by), strict=True)]

    def pairs() -> Pairs | None:
        if not 2 <= len(by) <= MOST_PAIRED:
            return None
        i, j = np.triu_indices(len(by), 1)
        term = np.array([change.term for change in changes])
        apart = (term[i] != term[j]) & (term[i] != ALONE) & (term[j] != ALONE)
        i, j = i[apart], j[apart]
        if not len(i):
            return None
        sign = np.array([change.is_sign for change in changes])
        values = value_of(total + by[i] + by[j])
        right = abs(answer.value) or 1.0
        good = np.isfinite(values) & (np.abs(values - answer.value) > 1e-9 * right)
        i, j, values = i[good], j[good], values[good]
        return Pairs(values, lambda k: together(changes[i[k]], changes[j[k]]), sign[i] | sign[j])

    return singles, pairs


def finals(answer: Answer) -> list[Slip]:
    """Return the slips in the answer itself."""
    return [Slip(text, change(answer.value)) for text, change in changes_of(answer)]


def changes_of(answer: Answer) -> Iterator[tuple[str, Callable[[float], float]]]:
    """Yield the slips in an answer itself, and what each makes of a value."""
    if answer.is_angle:
        turn, is_degrees = answer.turn, answer.turn == 360.0
        yield "180° off", lambda value: (value + turn / 2) % turn
        yield "the angle is counted the other way", lambda value: -value % turn
        yield "sine in place of cosine in the angle", lambda value: (turn / 4 - value) % turn
        text = "radians in place of degrees" if is_degrees else "degrees in place of radians"
        yield text, lambda value: value * (pi / 180 if is_degrees else 180 / pi)
        return
    yield "the answer has the wrong sign", lambda value: -value
    if unit_name(answer.unit) in ("rad_s", "rpm"):
        share = 30 / pi if unit_name(answer.unit) == "rad_s" else pi / 30
        yield "rpm in place of rad/s", lambda value: value * share
    yield "the answer is ten times too large", lambda value: value * 10
    yield "the answer is ten times too small", lambda value: value / 10


TWICE = {"radius": "diameter", "throw": "stroke"}
"""Lengths that are taken for twice as long."""
TERMS = ("mass", "inertia", "force", "fx", "fy", "torque", "unbalance", "weight", "reciprocating", "rotating")
"""Quantities that may be left out."""
DEGREES, RPM = Decimal(180 / pi), Decimal(30 / pi)


class DatumSlip(NamedTuple):
    """A slip in a number of the data."""

    text: str
    """Behind the name of the number."""
    change: Callable[[Decimal], Decimal]
    likely: int = 1
    """1 before 3."""
    is_unit: bool = False
    """Whether another quantity or unit is read: in an option, and in all cells of a column alike."""


def of_datum(quantity: str, unit: str) -> Iterator[DatumSlip]:
    """Yield what can go wrong with a number of the data."""
    if unit == "deg":
        yield DatumSlip(" is 180° off", lambda x: x + 180)
        yield DatumSlip(" is counted the other way", lambda x: -x)
        yield DatumSlip(": degrees taken as radians", lambda x: x * DEGREES, 2, is_unit=True)
        yield DatumSlip(": sine in place of cosine", lambda x: 90 - x, 2)
        return
    if unit == "rpm":
        yield DatumSlip(": rpm taken for rad/s", lambda x: x * RPM, is_unit=True)
    length = quantity.rpartition("_")[2]
    if length in TWICE:
        yield DatumSlip(f": the {TWICE[length]} in place of the {length}", lambda x: 2 * x, is_unit=True)
        yield DatumSlip(f": the {length} taken for the {TWICE[length]}", lambda x: x / 2, is_unit=True)
    yield DatumSlip(" has the wrong sign", lambda x: -x)
    if quantity in TERMS:
        yield DatumSlip(" is left out", lambda x: Decimal(0), 2)
    yield DatumSlip(" is ten times too large", lambda x: x * 10, 3)
    yield DatumSlip(" is ten times too small", lambda x: x / 10, 3)


def of_gravity(g: float) -> Iterator[tuple[str, float]]:
    """Yield the slips in weights, and what each is multiplied by: 9.81 for 10 or the reverse, the mass for the weight."""
    yield "the mass in place of the weight", 1 / g
    yield from other_gravities(g)


WEIGHTS = (("the weights are left out", 0.0), ("the weights have the wrong sign", -1.0))
"""Slips in all weights together, and what each is multiplied by."""


def other_gravities(g: float) -> Iterator[tuple[str, float]]:
    """Yield the slips in g: 9.81 for 10 or the reverse, and what g is multiplied by."""
    for other in GRAVITIES:
        if abs(other / g - 1) > 1e-3:
            yield f"g = {other:g} in place of {g:g}", other / g
