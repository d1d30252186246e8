"""Slips in the joint forces of a mechanism: a weight, an inertia force, an applied load with the wrong sign, or left out.

Without friction joint forces are sums over the loads. What one load has a part in is the difference to the command run
without it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import NamedTuple

from cli.exercise.answers import Answer
from cli.exercise.description import Value
from cli.exercise.slips import Change, Pairs, Slip, of_sum
from cli.exercise.solving import Problem
from cli.exercise.variants import Variant
from dalembert.units import parted

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


def slips(
    answer: Answer, number: int, every: Sequence[Load]
) -> tuple[list[Slip], Callable[[], Pairs | None]]:
    """The slips of an answer that is a sum over the loads, and pairs of them."""
    changes = [change for k, load in enumerate(every) for change in _changes(k, load, number)]
    return of_sum(answer, changes, complex(answer.value), lambda sums: sums.real)


def is_sum(answer: Answer) -> bool:
    """Whether an answer is a sum over the loads."""
    return LINEAR.search(parted(answer.ask.quantity)[0]) is not None


def _changes(k: int, load: Load, number: int) -> Iterator[Change]:
    part = load.parts[number] if load.parts else None
    if part:
        for text, times in WRONG.items():
            yield Change(k, f"the {load.name} {text}", times * part, is_sign=times == -2.0)
