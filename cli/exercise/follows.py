"""Whether an answer follows from earlier wrong ones: the marks are lost once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np

from cli.exercise.description import Answer
from cli.exercise.recomputed import Recomputed
from cli.exercise.slips_of_sums import WRONG, Complexes, is_sum, kind_of, rotor, way_of
from cli.exercise.variants import Variant
from dalembert.angles import degrees

Range = tuple[float, float]
Typed = Mapping[int, tuple[float, float]]
"""Of earlier questions by their number: the value typed, in the unit asked for, and half a unit of its last digit."""
ENOUGH = 3
"""From so many slips on that change both answers in proportion, the one follows from the other."""
AXES = "xyz"


@dataclass(eq=False, repr=False)
class Follows:
    """What follows from earlier answers of a variant, by relations of its command and by its runs with slips."""

    variant: Variant
    runs: Recomputed
    shares: dict[tuple[int, int], float | None] = field(default_factory=dict)
    """The ratios of two answers."""

    def ranges(self, k: int, typed: Typed, wrong: frozenset[int]) -> Iterator[Range]:
        """Yield the ranges of an answer that would follow from earlier ones; `wrong`: those that are not right."""
        command = self.variant.problem.exercise.command[0]
        if command == "balance":
            after = _balance(self.variant, k, typed)
            if after is not None:
                yield after
            return
        related = RELATIONS[command](self.variant, k, typed, wrong) if command in RELATIONS else None
        if related is not None:
            yield related
        for j in sorted(wrong):
            share = self._share(j, k)
            if share is not None:
                value, half = typed[j]
                yield _range([(value - half) * share, (value + half) * share])

    def same_slip(self, k: int, value: float, half: float, typed: Typed, wrong: frozenset[int]) -> bool:
        """Whether one slip in the data or in a load, or another assembly, makes both this answer and an earlier wrong one."""
        if self.variant.problem.exercise.command[0] == "balance":
            return False
        others = [j for j in wrong if self._vector(j) != self._vector(k)]
        return any(
            self._near(k, values[k], value, half) and any(self._near(j, values[j], *typed[j]) for j in others)
            for values in (*(run.values for run in self.runs.runs), *self.runs.assemblies, *self._with_loads)
        )

    @cached_property
    def _with_loads(self) -> list[list[float | None]]:
        """The answers with each slip in a load; None where it changes nothing, or is no sum over the loads."""
        every = [(k, answer.value, is_sum(answer)) for k, answer in enumerate(self.variant.answers)]
        return [
            [
                value + times * part if of_loads and (part := load.parts[k]) else None
                for k, value, of_loads in every
            ]
            for load in (self.runs.loads if any(of_loads for *_, of_loads in every) else ())
            for times in WRONG.values()
        ]

    def _near(self, k: int, slipped: float | None, value: float, half: float) -> bool:
        answer = self.variant.answers[k]
        return slipped is not None and abs(answer.distance(slipped, value)) <= half * (1 + 1e-9)

    def _vector(self, k: int) -> tuple[str, str]:
        """What the number is a part of: size and angle, or the components, are one answer."""
        ask = self.variant.answers[k].ask
        name = ask.name.lower()
        name = re.sub(r"(mass|weight|unbalance|amplitude|magnitude|angle|phase)$", "", name)
        where = {key: text for key, text in ask.where.items() if key != "axis"}
        return re.sub(r"(?<=[_vaf])[xyz]$", "", name), str(sorted(where.items()))

    def _share(self, j: int, k: int) -> float | None:
        """The ratio of two answers, where all slips that change the first change both in proportion."""
        if (j, k) not in self.shares:
            self.shares[j, k] = self._proportion(j, k)
        return self.shares[j, k]

    def _proportion(self, j: int, k: int) -> float | None:
        one, other = self.variant.answers[j], self.variant.answers[k]
        if one.is_angle or other.is_angle or not one.value or not other.value:
            return None
        share, count = other.value / one.value, 0
        for run in self.runs.runs:
            a, b = run.values[j], run.values[k]
            if a is None or b is None or abs(a - one.value) <= 1e-6 * abs(one.value):
                continue
            if abs(b - a * share) > 1e-9 * abs(b):
                return None
            count += 1
        return share if count >= ENOUGH else None


def _range(ends: list[float]) -> Range:
    return min(ends), max(ends)


def _linear(
    variant: Variant, k: int, typed: Typed, wrong: frozenset[int], shares: Mapping[int, float]
) -> Range | None:
    """Carry the errors of earlier answers on: the right answer, and each error times its share."""
    changed = {j: share for j, share in shares.items() if j in typed and share}
    # an answer that rests on right answers alone is no error carried on
    if not changed.keys() & wrong:
        return None
    middle = variant.answers[k].value + sum(
        share * (typed[j][0] - variant.answers[j].value) for j, share in changed.items()
    )
    spread = sum(abs(share) * typed[j][1] for j, share in changed.items())
    return middle - spread, middle + spread


def _efforts(variant: Variant, k: int, typed: Typed, wrong: frozenset[int]) -> Range | None:
    """The effort of a link takes up that of each link driven against it: a motor pushes back on its carrier."""
    inputs = variant.problem.workshop.described.mechanism.inputs
    suffix = "_input_torque"
    name = variant.answers[k].ask.name
    if not name.endswith(suffix):
        return None
    driven = {f"{each.link}{suffix}" for each in inputs if each.link and each.on == name.removesuffix(suffix)}
    shares = {
        j: 1.0
        for j in typed
        if variant.answers[j].ask.name in driven
        and variant.answers[j].unit == variant.answers[k].unit
        and variant.answers[j].ask.where == variant.answers[k].ask.where
    }
    return _linear(variant, k, typed, wrong, shares)


def _body(variant: Variant, k: int, typed: Typed, wrong: frozenset[int]) -> Range | None:
    """H to Ḣ = (Ḣ)rel + Ω × H, to −Ḣ, to the energy ω·H/2; Ḣ over the span to the bearings of a shaft along z."""
    answer = variant.answers[k]
    way = {topic["topic"]: topic for topic in way_of(variant)}
    if "rate of momentum" not in way:
        return None
    rate, omega = way["rate of momentum"], way["momentum"]["omega_rad_s"]
    name, axis = answer.ask.name, answer.ask.where.get("axis", "x")
    of = {(variant.answers[j].ask.name, variant.answers[j].ask.where.get("axis", "x")): j for j in typed}
    shares: dict[int, float] = {}
    if name in ("momentum_rate", "inertia_moment") and axis in AXES:
        at = AXES.index(axis)
        i, j = AXES[(at + 1) % 3], AXES[(at + 2) % 3]
        frame = dict(zip(AXES, rate["frame_omega_rad_s"], strict=True))
        sign = 1.0 if name == "momentum_rate" else -1.0
        other = of.get(("momentum_rate" if sign < 0 else "inertia_moment", axis))
        if other is not None:
            return _linear(variant, k, typed, wrong, {other: -1.0})
        # Ω_i·H_j − Ω_j·H_i; the relative rate is what it is
        for part, share in ((j, frame[i]), (i, -frame[j])):
            q = of.get(("momentum", part))
            if q is not None:
                shares[q] = share * sign
    elif name == "energy":
        motion = dict(zip(AXES, omega, strict=True))
        shares = {q: motion[a] / 2 for a in AXES if (q := of.get(("momentum", a))) is not None}
    bearing = re.fullmatch(r"bearing([12])_dynamic", name)
    places = [each["z_m"] for each in way.get("bearings", {}).get("bearings", ())]
    if bearing and len(places) == 2 and "--axis" not in variant.problem.command and axis in "xy":
        # ΔM about x moves the force along y of the second bearing by −ΔM/span, that about y the one along x by +
        span = places[1] - places[0]
        share = (1.0 if axis == "x" else -1.0) / span * (1.0 if bearing[1] == "2" else -1.0)
        q = of.get(("momentum_rate", "y" if axis == "x" else "x"))
        shares = {} if q is None else {q: share}
    return _linear(variant, k, typed, wrong, shares)


def _balance(variant: Variant, number: int, typed: Typed) -> Range | None:
    """Plane A from plane B; mass, weight and unbalance of one plane from each other."""
    answer = variant.answers[number]
    kind = kind_of(answer)
    own = rotor(variant, answer) if kind else None
    if own is None:
        return None
    here = answer.ask.where.get("plane", own.planes[0])
    p = list(own.planes).index(here)
    same: dict[str, tuple[Answer, tuple[float, float]]] = {}
    other: dict[str, tuple[Answer, tuple[float, float]]] = {}
    for k, pair in typed.items():
        its = variant.answers[k]
        if kind_of(its) and its.ask.where.get("rotor") == answer.ask.where.get("rotor"):
            there = same if its.ask.where.get("plane", own.planes[0]) == here else other
            there[kind_of(its)] = its, pair
    right = own.corrections[p]
    if kind != "angle":
        # mass, weight and unbalance of one plane are in proportion
        for earlier in ("unbalance", "mass", "weight"):
            if earlier != kind and earlier in same and same[earlier][0].value:
                its, (value, half) = same[earlier]
                share = answer.value / its.value
                return (value - half) * share, (value + half) * share
    if len(own.planes) != 2 or not other:
        return None
    q = 1 - p
    sizes, angles = [abs(own.corrections[q])], [float(np.angle(own.corrections[q]))]
    for earlier, (its, (value, half)) in other.items():
        if earlier == "angle":
            angles = [(value + share * half) * 2 * np.pi / its.turn for share in (-1.0, 0.0, 1.0)]
        elif its.value:
            scale = abs(own.corrections[q]) / its.value
            sizes = [(value + share * half) * scale for share in (-1.0, 0.0, 1.0)]
    u = np.array([size * np.exp(1j * angle) for size in sizes for angle in angles])
    # what the other plane leaves of the forces
    made = right - (u - own.corrections[q])
    if kind == "angle":
        return _polar_range(made, answer)
    values = np.abs(made) * (answer.value / abs(right))
    return float(values.min()), float(values.max())


def _polar_range(made: Complexes, answer: Answer) -> Range:
    """Return the range of the angles of vectors, about that in the middle, in the unit of the answer."""
    middle = degrees(made[len(made) // 2 : len(made) // 2 + 1])
    off = np.remainder(degrees(made) - middle + 180.0, 360.0) - 180.0
    unit = answer.turn / 360
    return float(middle[0] + off.min()) * unit, float(middle[0] + off.max()) * unit


def _trim(variant: Variant, k: int, typed: Typed, wrong: frozenset[int]) -> Range | None:
    """The trim follows from the correction: it is the correction less the masses on the rotor."""
    answer = variant.answers[k]
    match = re.fullmatch(r"trim_(mass|unbalance|angle)", answer.ask.name)
    if match is None:
        return None
    right, correction = _vector(variant, k, "trim_"), _vector(variant, k, "")
    if right is None or correction is None:
        return None
    sizes, turns = [abs(correction)], [float(np.angle(correction))]
    there = False
    for j, (value, half) in typed.items():
        its = variant.answers[j]
        if its.ask.where != answer.ask.where:
            continue
        ends = [value + share * half for share in (-1.0, 0.0, 1.0)]
        if its.ask.name in ("mass", "unbalance"):
            sizes, there = [end * abs(correction) / its.value for end in ends], there or j in wrong
        elif its.ask.name == "angle":
            turns, there = [end * 2 * np.pi / its.turn for end in ends], there or j in wrong
    if not there:
        return None
    made = np.array([right - correction + s * np.exp(1j * t) for s, t in product(sizes, turns)])
    if match[1] == "angle":
        return _polar_range(made, answer)
    return _range((np.abs(made) * (answer.value / abs(right))).tolist())


def _vector(variant: Variant, k: int, prefix: str) -> complex | None:
    """A correction or trim of the question's plane, in the unit of the result."""
    where = variant.answers[k].ask.where
    for table in variant.solved.tables:
        columns, cells = {column.name: column.values for column in table.columns}, table.cells
        kind = next((kind for kind in ("mass", "unbalance") if prefix + kind in columns), None)
        if kind is None or f"{prefix}angle" not in columns:
            continue
        rows = [
            i
            for i in range(table.length)
            if all(str(cells[key][i]) == text for key, text in where.items() if key in cells)
        ]
        if len(rows) == 1:
            size, turn = (float(columns[name][rows[0]] or 0.0) for name in (prefix + kind, f"{prefix}angle"))
            return complex(size * np.exp(1j * np.radians(turn)))
    return None


RELATIONS: dict[str, Callable[[Variant, int, Typed, frozenset[int]], Range | None]] = {
    "forces": _efforts,
    "body": _body,
    "field": _trim,
}
