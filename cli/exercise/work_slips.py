"""Slips in a balance of virtual power: signs, terms left out, ten times too large or small, the wrong g."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from cli.exercise.answers import Answer
from cli.exercise.slips import Candidates, Change, Slip, of_sum
from cli.exercise.variants import Variant
from cli.read.options import components
from dalembert.units import unit_name

GRAVITIES = (9.81, 10.0, 9.80665, 9.8)
"""Values of g in use."""


class Term(NamedTuple):
    """A term of the ledger."""

    name: str
    power: float
    is_weight: bool


def slips(variant: Variant, number: int) -> Candidates | None:
    """Return the slips of an unknown load or effort; None where the question is not one, or has several unknowns."""
    answer = variant.answers[number]
    ledger = _ledger(variant, answer)
    if ledger is None:
        return None
    terms, unknown = ledger
    total = sum(term.power for term in terms)
    if not total or not unknown:
        return None
    # the answer is in proportion to the sum of the powers
    factor = answer.value / total
    changes = [change for k, term in enumerate(terms) for change in _changes(k, term)]
    singles, pairs = of_sum(
        answer, [*changes, *_gravity(variant, terms)], complex(total), lambda sums: sums.real * factor
    )
    singles.append(Slip("the answer has the wrong sign", -answer.value))
    singles += _units(variant, answer)
    return Candidates(answer, singles, pairs)


def _ledger(variant: Variant, answer: Answer) -> tuple[list[Term], float] | None:
    """Return the terms of the instant that the question is about, and the power of its one unknown."""
    document = variant.solved.document
    is_work = variant.problem.exercise.command[0] == "work"
    if is_work:
        if not answer.ask.quantity.startswith(("torque", "fx", "fy")):
            return None
        found = _instant(document.get("steps"), "step", answer.ask.where)
    else:
        if not answer.ask.quantity.startswith(("input_torque", "input_force", "virtual_work")):
            return None
        way = way_of(variant)
        ledger = next((topic for topic in way if topic.get("topic") == "ledger"), {})
        found = _instant(ledger.get("poses"), "input_deg", answer.ask.where)
    if found is None:
        return None
    terms, unknown = [], []
    for entry in found.get("terms", ()):
        if entry["kind"] == "unknown":
            unknown.append(float(entry["power_W"] or 0.0))
        elif entry["power_W"] and not entry.get("workless"):
            name = (
                entry["kind"]
                if entry["kind"] in ("spring", "damper", "friction")
                else f"{entry['kind']} of link {entry['link']}"
            )
            terms.append(Term(name, float(entry["power_W"]), entry["kind"] == "weight"))
    return (terms, unknown[0]) if len(unknown) == 1 else None


def way_of(variant: Variant) -> Sequence[Mapping[str, Any]]:
    """Return the worked solution as JSON has it; empty where the command has none."""
    way: Any = variant.worked.document.get("way")
    return way or ()


def _instant(listed: Any, key: str, where: Mapping[str, str]) -> Mapping[str, Any] | None:
    """Return the instant whose key the question names; the only one, where it names none."""
    if not isinstance(listed, Sequence) or not listed:
        return None
    if key not in where:
        return listed[0] if len(listed) == 1 else None
    for each in listed:
        cell = each.get(key)
        if str(cell) == where[key] or (isinstance(cell, float) and abs(cell - float(where[key])) < 1e-9):
            return each  # type: ignore[no-any-return]
    return None


def number(value: float) -> str:
    """Write a number of a term as people do: `450 000`.

    >>> number(-450000.0), number(0.25), number(80.0)
    ('−450 000', '0.25', '80')
    """
    text = f"{value:.6g}" if abs(value) < 1e6 else f"{value:.0f}"
    if "e" not in text and len(text.partition(".")[0]) > 4:
        text = f"{float(text):,.10g}".replace(",", " ")
    return text.replace("-", "−")


def _changes(k: int, term: Term) -> Iterator[Change]:
    """What can go wrong with a term."""
    power = term.power
    yield Change(k, f"the {term.name} has the wrong sign", -2 * power, is_sign=True)
    yield Change(k, f"the {term.name} is left out", -power)
    small = f"{number(abs(power))} W taken as {number(abs(power) / 10)} W"
    large = f"{number(abs(power))} W taken as {number(abs(power) * 10)} W"
    yield Change(k, f"the power of the {term.name} is ten times too small ({small})", -0.9 * power)
    yield Change(k, f"the power of the {term.name} is ten times too large ({large})", 9 * power)


def _gravity(variant: Variant, terms: Sequence[Term]) -> Iterator[Change]:
    """Another g in all weights; their masses in place of the weights."""
    weight = sum(term.power for term in terms if term.is_weight)
    g = gravity(variant)
    if not weight or not g:
        return
    # no term of its own: it goes together with any
    place = len(terms)
    for other in GRAVITIES:
        if abs(other - g) > 1e-6 * g and (abs(g - 10) < 1e-9 or abs(other - 10) < 1e-9):
            yield Change(place, f"g = {other:g} in place of {g:g}", weight * (other / g - 1))
    yield Change(place, "the mass in place of the weight", weight * (1 / g - 1))


def gravity(variant: Variant) -> float:
    """The g of the command or of the mechanism's file; 0 where there is none."""
    words = variant.problem.command
    if "--gravity" in words[:-1]:
        text = words[words.index("--gravity") + 1]
        return math.hypot(*components("--gravity", text, "acceleration", min(text.count(","), 2) + 1))
    if variant.problem.workshop.mechanism is not None:
        return abs(complex(variant.problem.workshop.described.mechanism.gravity))
    return 0.0


def _units(variant: Variant, answer: Answer) -> Iterator[Slip]:
    """Speeds in rpm taken as rad/s: the effort goes as the inverse of one."""
    if any(
        "_rpm" in title for sheet in variant.problem.sheets.values() for title in sheet.header
    ) and unit_name(answer.unit):
        yield Slip("rpm taken for rad/s", answer.value * np.pi / 30)
