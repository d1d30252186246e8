"""The likely mistake behind a wrong answer: what one slip of a list, or two, make of the right answer.

A slip is named where it reproduces the answer to its digits. Two slips are named only where the answer has four digits or
more, and where there are so few pairs about the answer that a random number would hardly meet one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from math import isfinite, remainder
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cli.exercise.description import Answer, Value
from cli.exercise.solving import Problem
from cli.exercise.variants import Variant
from dalembert.figures import Right, Typed
from dalembert.units import parted, unit_name

Real = NDArray[np.float64]

DIGITS = 4
"""From so many digits on two slips may be named."""
CHANCE = 0.012
"""Two slips are named where less than this share of random numbers about the answer would meet a pair."""
ABOUT = 0.2
"""What is about the answer: within this share of it."""


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
                self.answer.is_angle and self._off(slip.value) < 1e-9
            ):
                continue
            key = f"{slip.value:.9g}"
            if key not in seen:
                seen.add(key)
                likely.append(slip)
        return likely

    def _off(self, value: float) -> float:
        return abs(self.distance(value, self.answer.value))

    def distance(self, value: float, other: float) -> float:
        """How far apart two values are; angles modulo a turn."""
        if not self.answer.is_angle:
            return value - other
        return remainder(value - other, self.turn)

    @property
    def turn(self) -> float:
        """A turn in the unit of an angle."""
        return 360.0 if unit_name(self.answer.unit) == "deg" else 2 * np.pi

    def name(self, number: Typed, scale: float = 1.0) -> str | None:
        """Return the likely mistake behind a wrong answer; None where no slip reproduces it.

        `scale`: the number's unit in the unit asked for.
        """
        a, size = float(number.value) * scale, abs(scale)
        # zeros at the end of a whole number may stand for digits that were rounded
        figures = self.answer.ask.figures
        own = 10.0 ** (number.value.adjusted() - figures + 1) * size
        most = max(float(self.right.unit), own) / 2 * (1 + 1e-9)
        halves = [float(half) * size for half in number.half_units]
        halves = [half for half in halves if half <= most] or halves[:1]
        near = [(abs(self.distance(slip.value, a)), k) for k, slip in enumerate(self.wrong)]
        for half in halves:
            hits = [k for off, k in near if off <= half * (1 + 1e-9)]
            if hits:
                return self.wrong[hits[0]].text
        if number.digits < DIGITS or self._pairs is None:
            return None
        return self._of_two(a, halves[0])

    def _of_two(self, a: float, half: float) -> str | None:
        pairs = self._pairs
        assert pairs is not None
        off = pairs.values - a
        if self.answer.is_angle:
            off = off - self.turn * np.rint(off / self.turn)
        off = np.abs(off)
        room = ABOUT * abs(a) if not self.answer.is_angle else ABOUT * self.turn / 4
        for among in (pairs.likely, np.ones(len(off), dtype=bool)):
            about = np.count_nonzero(off[among] <= room)
            if about * half > CHANCE * room:
                return None
            hits = np.flatnonzero(among & (off <= half * (1 + 1e-9)))
            if len(hits):
                return pairs.texts(int(hits[0]))
        return None


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
) -> tuple[list[Slip], Callable[[], Pairs | None]]:
    """Return the slips of an answer that follows from a sum of terms: each change, and pairs of changes of two terms.

    `value_of`: the answer that follows from sums, in the unit asked for.
    """
    by = np.array([change.by for change in changes], dtype=complex)
    singles = (
        [Slip(c.text, float(v)) for c, v in zip(changes, value_of(total + by), strict=True)]
        if len(by)
        else []
    )

    def pairs() -> Pairs | None:
        if len(by) < 2:
            return None
        i, j = np.triu_indices(len(by), 1)
        term = np.array([change.term for change in changes])
        apart = (term[i] != term[j]) & (term[i] >= 0) & (term[j] >= 0)
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


AXES = "xyz"
PARTS = {
    "v": {"base_velocity_m_s": "velocity of {base}", "turning_velocity_m_s": "part ω × R", "relative_velocity_m_s": "relative velocity"},
    "a": {
        "base_m_s2": "acceleration of {base}",
        "tangential_m_s2": "tangential part α × R",
        "normal_m_s2": "normal part ω²·R",
        "relative_m_s2": "relative acceleration",
        "coriolis_m_s2": "Coriolis part 2ω × V_rel",
    },
}  # fmt: skip
"""What the parts of a point's velocity and acceleration are called."""


class Part(NamedTuple):
    """A term of the sum that an answer is."""

    name: str
    value: float


def way_of(variant: Variant) -> Sequence[Mapping[str, Any]]:
    """Return the worked solution as JSON has it; empty where the command has none."""
    way: Any = variant.worked.document.get("way")
    return way or ()


def of_motion(variant: Variant, number: int) -> tuple[list[Slip], Callable[[], Pairs | None]]:
    """Return the slips of an answer that is a sum of such parts, and pairs of them; none of any other answer."""
    answer = variant.answers[number]
    parts = [part for part in _parts(variant, answer) if part.value]
    total = sum(part.value for part in parts)
    if len(parts) < 2 or not total:
        return [], lambda: None
    changes = [change for k, part in enumerate(parts) for change in _part_changes(k, part)]
    factor = answer.value / total
    return of_sum(answer, changes, complex(total), lambda sums: sums.real * factor)


def _part_changes(k: int, part: Part) -> Iterator[Change]:
    """What can go wrong with a part."""
    yield Change(k, f"the {part.name} has the wrong sign", -2 * part.value, is_sign=True)
    yield Change(k, f"the {part.name} is left out", -part.value)
    if part.name.startswith("Coriolis"):
        yield Change(k, f"the {part.name} lacks its factor 2", -part.value / 2)
    yield Change(k, f"the {part.name} is ten times too large", 9 * part.value)
    yield Change(k, f"the {part.name} is ten times too small", -0.9 * part.value)


def _parts(variant: Variant, answer: Answer) -> Sequence[Part]:
    command = variant.problem.exercise.command[0]
    name = parted(answer.ask.quantity, further=("kg_m2_s", "J"))[0]
    if command in ("mechanism", "forces"):
        return _of_point(variant, name)
    if command == "body" and answer.ask.where.get("axis", "x") in AXES:
        return _of_body(variant, name, AXES.index(answer.ask.where.get("axis", "x")))
    return ()


def _topic(variant: Variant, name: str) -> Mapping[str, Any]:
    return next((topic for topic in way_of(variant) if topic.get("topic") == name), {})


def _of_point(variant: Variant, name: str) -> Sequence[Part]:
    """The parts of a point's velocity or acceleration along an axis, in the one pose."""
    match = re.fullmatch(r"(.+)_([va])([xy])", name)
    if match is None:
        return ()
    point, kind, axis = match.groups()
    every = [entry for entry in _topic(variant, "parts").get("points", ()) if entry["point"] == point]
    # a point of several links has its parts on each: of the last, which the others lead to
    if not every:
        return ()
    entry = every[-1]
    base = entry.get("from") or "the base"
    return [
        Part(text.format(base=base), float(entry[key][AXES.index(axis)]))
        for key, text in PARTS[kind].items()
        if entry.get(key) is not None
    ]


def _of_body(variant: Variant, name: str, k: int) -> Sequence[Part]:
    """The products in a component of H = I·ω, of Ḣ = (Ḣ)rel + Ω × H, and in the energy."""
    momentum, rate = _topic(variant, "momentum"), _topic(variant, "rate of momentum")
    if not momentum:
        return ()
    omega, tensor, h = momentum["omega_rad_s"], momentum["inertia_kg_m2"], momentum["momentum_kg_m2_s"]
    if name == "momentum":
        return [Part(f"term I_{AXES[k]}{a}·ω_{a}", tensor[k][j] * omega[j]) for j, a in enumerate(AXES)]
    if name in ("momentum_rate", "inertia_moment"):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame = rate["frame_omega_rad_s"]
        return [
            Part("relative rate (Ḣ)rel", rate["relative_N_m"][k]),
            Part(f"term Ω_{AXES[i]}·H_{AXES[j]}", frame[i] * h[j]),
            Part(f"term Ω_{AXES[j]}·H_{AXES[i]}", -frame[j] * h[i]),
        ]
    return ()


Values = Sequence[float | None]
LINEAR = re.compile(r"(_f[xy]|_moment|_contact_force|(^|_)input_(torque|force))$")
"""Of the columns of `dalembert forces`: a sum over the loads."""
WRONG = {
    "has the wrong sign": -2.0,
    "is left out": -1.0,
    "is ten times too small": -0.9,
    "is ten times too large": 9.0,
}
"""How often a load's part is added to the answer by a slip."""
LOAD = re.compile(r"(?:forces\.(\d+)\.force|torques\.(\d+)\.torque)(?:\.[xy])?")


class Load(NamedTuple):
    """A load, and its part in every answer; None where it has none that can be told."""

    name: str
    parts: Values


def loads(variant: Variant, run: Callable[[Problem], Values | None]) -> list[Load]:
    """The loads of a mechanism with forces; none with friction, where the forces are no sums.

    `run`: the answers of a problem; None where it has none.
    """
    problem = variant.problem
    shop = problem.workshop
    if problem.exercise.command[0] != "forces" or shop.mechanism is None or shop.described.mechanism.friction:
        return []
    whole = [answer.value for answer in variant.answers]
    described = shop.described.mechanism
    weightless = ["gravity.x", "gravity.y"] if described.gravity else []
    result: list[Load] = []

    def without(*paths: str) -> Values | None:
        zero = {path: Value(Decimal(0), "") for path in paths}
        return run(replace(problem, drawn={**problem.drawn, **zero}))

    def add(name: str, more: Values | None, less: Values | None) -> None:
        if more is not None and less is not None:
            result.append(Load(name, _less(more, less)))

    floating = without(*weightless) if weightless else whole
    for link, own in described.links.items():
        mass, inertia = f"links.{link}.mass", f"links.{link}.inertia"
        if own.mass:
            massless = without(mass, *weightless)
            add(f"inertia force of link {link}", floating, massless)
            if weightless and floating is not None and massless is not None:
                add(f"weight of link {link}", _less(whole, without(mass)), _less(floating, massless))
        if own.inertia:
            add(f"inertia torque of link {link}", whole, without(inertia))
    for name, paths in _applied(shop.dimensions).items():
        add(name, whole, without(*paths))
    return result


def _applied(dimensions: Mapping[str, object]) -> dict[str, list[str]]:
    """The paths of the applied forces and torques, by what they are called."""
    paths: dict[str, list[str]] = {}
    for path in dimensions:
        match = LOAD.fullmatch(path)
        if match is not None:
            name = f"applied force {match[1]}" if match[1] else f"applied torque {match[2]}"
            paths.setdefault(name, []).append(path)
    return paths


def _less(more: Values | None, less: Values | None) -> list[float | None]:
    if more is None or less is None:
        return []
    return [None if a is None or b is None else a - b for a, b in zip(more, less, strict=True)]


def of_loads(
    answer: Answer, number: int, every: Sequence[Load]
) -> tuple[list[Slip], Callable[[], Pairs | None]]:
    """The slips of an answer that is a sum over the loads, and pairs of them."""
    changes = [change for k, load in enumerate(every) for change in _load_changes(k, load, number)]
    return of_sum(answer, changes, complex(answer.value), lambda sums: sums.real)


def is_sum(answer: Answer) -> bool:
    """Whether an answer is a sum over the loads."""
    return LINEAR.search(parted(answer.ask.quantity)[0]) is not None


def _load_changes(k: int, load: Load, number: int) -> Iterator[Change]:
    part = load.parts[number] if load.parts else None
    if part:
        for text, times in WRONG.items():
            yield Change(k, f"the {load.name} {text}", times * part, is_sign=times == -2.0)
