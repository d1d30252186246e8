"""Slips where every row of a table is a term of a sum: the loads of link states, the masses of a rotor."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from cli.exercise.description import Answer
from cli.exercise.slips import Candidates, Change, Pairs, Slip, of_sum, together, way_of
from cli.exercise.variants import Variant
from cli.read.options import components
from dalembert.angles import degrees
from dalembert.units import G0, parted, unit_name

GRAVITIES = (9.81, 10.0, 9.80665, 9.8)
"""Values of g in use."""


class Term(NamedTuple):
    """A term of the ledger."""

    name: str
    power: float
    is_weight: bool


def of_work(variant: Variant, number: int) -> Candidates | None:
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
    changes = [change for k, term in enumerate(terms) for change in _term_changes(k, term)]
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
        instant = _instant(document.get("steps"), "step", answer.ask.where)
    else:
        if not answer.ask.quantity.startswith(("input_torque", "input_force", "virtual_work")):
            return None
        way = way_of(variant)
        ledger = next((topic for topic in way if topic.get("topic") == "ledger"), {})
        instant = _instant(ledger.get("poses"), "input_deg", answer.ask.where)
    if instant is None:
        return None
    terms, unknown = [], []
    for entry in instant.get("terms", ()):
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


def _term_changes(k: int, term: Term) -> Iterator[Change]:
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


Complexes = NDArray[np.complex128]
Real = NDArray[np.float64]
Range = tuple[float, float]


@dataclass(eq=False, repr=False)
class Rotor:
    """A rotor's unbalances, its planes, and the right corrections; SI."""

    names: Sequence[str]
    moment: Complexes
    z: Real
    planes: Sequence[str]
    plane_z: Real
    radius: Real
    gravity: float
    weights: bool
    sign: float
    """−1 where material is removed."""

    @cached_property
    def corrections(self) -> Complexes:
        """The right ones."""
        return self.sign * correct(self.moment, self.z, self.plane_z).unbalance

    def corrections_of(self, moments: Complexes) -> Complexes:
        """The corrections of rotors with other unbalances, (n, k) -> (n, p)."""
        return self.sign * correct(moments, np.broadcast_to(self.z, moments.shape), self.plane_z).unbalance

    def changes(self) -> Iterator[Change]:
        """What can go wrong with a mass: what the change adds to its unbalance."""
        for k, (name, u) in enumerate(zip(self.names, self.moment.tolist(), strict=True)):
            if not u:
                continue
            yield Change(k, f"the term of {name} has the wrong sign", -2 * u, is_sign=True)
            yield Change(k, f"{name} is left out", -u)
            yield Change(k, f"the term of {name} is ten times too large", 9 * u)
            yield Change(k, f"the term of {name} is ten times too small", -0.9 * u)
            yield Change(k, f"sine in place of cosine at {name}", 1j * np.conj(u) - u)
            turned = abs(u) * np.exp(1j * float(degrees(np.array(u))))
            yield Change(k, f"the angle of {name}: degrees taken as radians", turned - u)
            yield Change(k, f"the angle of {name} is counted the other way", np.conj(u) - u)
            yield Change(k, f"the diameter of {name} in place of its radius", u)


def rotor(variant: Variant, answer: Answer) -> Rotor | None:
    """Return the rotor that a question is about; None with three planes or more, or with rounded corrections."""
    from cli.balance.rotors import read_rotors
    from cli.read.rotor_options import from_options, from_table

    words = variant.problem.command
    if any(word in ("--round-mass", "--round-angle") for word in words):
        return None
    options = [words[k + 1] for k, word in enumerate(words[:-1]) if word == "--plane"]
    files = [words[k + 1] for k, word in enumerate(words[:-1]) if word == "--planes"]
    g = gravity(variant) or G0
    planes = from_table(files[0]) if files else from_options(options)
    read = read_rotors(words[1], g, needs_z=planes.several)
    if len(planes.name) > 2 or not len(planes.name) >= 1:
        return None
    if len(read.names) > 1 and "rotor" not in answer.ask.where:
        return None
    which = read.names.index(answer.ask.where["rotor"]) if "rotor" in answer.ask.where else 0
    rows = np.flatnonzero(read.rotor == which)
    names = read.table.texts.get("name") or [f"mass {k}" for k in range(1, read.table.rows + 1)]
    z = read.z if read.z is not None else np.zeros(len(read.moment))
    plane_z = planes.z if planes.z is not None else np.zeros(len(planes.name))
    return Rotor(
        [names[k] for k in rows], read.moment[rows], z[rows], planes.name, np.asarray(plane_z, float),
        np.asarray(planes.radius, float), g, read.weights, -1.0 if "--remove" in words else 1.0,
    )  # fmt: skip


KINDS = ("mass", "weight", "unbalance", "angle")


def kind_of(answer: Answer) -> str:
    """What a question asks of a correction: mass, weight, unbalance, angle; empty for anything else."""
    name = parted(answer.ask.quantity)[0].lower()
    return name if name in KINDS else ""


def of_rotor(variant: Variant, number: int) -> Candidates | None:
    """Return the slips of a correction."""
    answer = variant.answers[number]
    kind = kind_of(answer)
    own = rotor(variant, answer) if kind else None
    if own is None:
        return None
    p = list(own.planes).index(answer.ask.where["plane"]) if "plane" in answer.ask.where else 0
    right = own.corrections[p]

    def value_of(u: Complexes) -> Real:
        # in the unit asked for, by the right answer
        if kind == "angle":
            return np.asarray(degrees(u)) if unit_name(answer.unit) == "deg" else np.radians(degrees(u))
        return np.asarray(np.abs(u) * (answer.value / abs(right)))

    changes = list(own.changes())
    singles: list[Slip] = []
    pairs = None
    if changes:
        by = np.array([change.by for change in changes])
        term = np.array([change.term for change in changes])
        changed = np.tile(own.moment, (len(changes), 1))
        changed[np.arange(len(changes)), term] += by
        after = own.corrections_of(changed)[:, p]
        singles += [Slip(c.text, float(v)) for c, v in zip(changes, value_of(after), strict=True)]
        # in the forces alone, with the other plane right; in the moments alone, carried into the forces
        if len(own.planes) == 2:
            forces, other = right - own.sign * by, own.corrections_of(changed)[:, 1 - p]
            moments = right - (other - own.corrections[1 - p])
            for where, u in (("forces", forces), ("moments", moments)):
                singles += [
                    Slip(f"{c.text} in the sum of the {where}", float(v))
                    for c, v in zip(changes, value_of(u), strict=True)
                ]
        pairs = _pairs(own, p, changes, value_of, answer)
    singles += _final(own, kind, p, answer, right)
    return Candidates(answer, singles, (lambda: pairs) if pairs is not None else (lambda: None))


def _pairs(own: Rotor, p: int, changes: Sequence[Change], value_of, answer: Answer) -> Pairs | None:  # type: ignore[no-untyped-def]
    """Two slips at two masses."""
    i, j = np.triu_indices(len(changes), 1)
    term = np.array([change.term for change in changes])
    by = np.array([change.by for change in changes])
    apart = term[i] != term[j]
    i, j = i[apart], j[apart]
    if not len(i) or len(i) > 20_000:
        return None
    moments = np.tile(own.moment, (len(i), 1))
    row = np.arange(len(i))
    moments[row, term[i]] += by[i]
    moments[row, term[j]] += by[j]
    values = value_of(own.corrections_of(moments)[:, p])
    sign = np.array([change.is_sign for change in changes])
    good = np.isfinite(values) & (np.abs(values - answer.value) > 1e-9 * abs(answer.value))
    i, j, values = i[good], j[good], values[good]
    return Pairs(values, lambda k: together(changes[i[k]], changes[j[k]]), sign[i] | sign[j])


def _final(own: Rotor, kind: str, p: int, answer: Answer, right: complex) -> Iterator[Slip]:
    """Slips of the last step: the angle's quadrant and sense, radius, weight."""
    value = answer.value
    if kind == "angle":
        half, quarter = (180.0, 90.0) if unit_name(answer.unit) == "deg" else (np.pi, np.pi / 2)
        yield Slip(
            "180° off: the angle of the unbalance in place of the correction's, or the wrong quadrant",
            (value + half) % (2 * half),
        )
        yield Slip("the angle is counted the other way", -value % (2 * half))
        yield Slip("sine in place of cosine in the angle", (quarter - value) % (2 * half))
        yield Slip(
            "radians in place of degrees" if half == 180.0 else "degrees in place of radians",
            value * np.pi / 180 if half == 180.0 else value * 180 / np.pi,
        )
        return
    g = own.gravity
    if kind == "mass":
        yield Slip("the weight in place of the mass", value * g)
    if kind == "weight":
        yield Slip("the mass in place of the weight", value / g)
    if own.weights or kind == "weight":
        for other in GRAVITIES:
            if abs(other - g) > 1e-6 * g and (abs(g - 10) < 1e-9 or abs(other - 10) < 1e-9):
                yield Slip(
                    f"g = {other:g} in place of {g:g}", value * (other / g if kind == "weight" else g / other)
                )
    if kind != "unbalance":
        yield Slip("the diameter in place of the radius of the plane", value / 2)
        yield Slip("the unbalance in place of the mass or weight", value * float(own.radius[p]))
    yield Slip("the answer is ten times too large", value * 10)
    yield Slip("the answer is ten times too small", value / 10)


def carried(variant: Variant, number: int, typed: Mapping[int, tuple[float, float]]) -> Range | None:
    """Return the range of the answer that follows from earlier answers as they were typed, in its unit.

    Parameters
    ----------
    typed
        Of earlier questions by their number: the value typed, in the unit asked for, and half a unit of its last digit.
    """
    answer = variant.answers[number]
    kind = kind_of(answer)
    own = rotor(variant, answer) if kind else None
    if own is None:
        return None
    here = answer.ask.where.get("plane", own.planes[0])
    p = list(own.planes).index(here)
    same = {
        kind_of(variant.answers[k]): pair for k, pair in typed.items()
        if _plane(variant.answers[k], own) == here and _rotor(variant.answers[k]) == _rotor(answer)
    }  # fmt: skip
    other = {
        kind_of(variant.answers[k]): (variant.answers[k], pair) for k, pair in typed.items()
        if _plane(variant.answers[k], own) not in (here, None) and _rotor(variant.answers[k]) == _rotor(answer)
    }  # fmt: skip
    right = own.corrections[p]
    if kind != "angle":
        # mass, weight and unbalance of one plane are in proportion
        for earlier in ("unbalance", "mass", "weight"):
            if earlier != kind and earlier in same:
                k = next(
                    k
                    for k in typed
                    if kind_of(variant.answers[k]) == earlier and _plane(variant.answers[k], own) == here
                )
                share = answer.value / variant.answers[k].value
                value, half = same[earlier]
                return (value - half) * share, (value + half) * share
    if len(own.planes) != 2 or not other:
        return None
    q = 1 - p
    sizes, angles = [abs(own.corrections[q])], [float(np.angle(own.corrections[q]))]
    for earlier, (its, (value, half)) in other.items():
        if earlier == "angle":
            unit = np.pi / 180 if unit_name(its.unit) == "deg" else 1.0
            angles = [(value + share * half) * unit for share in (-1.0, 0.0, 1.0)]
        elif earlier:
            scale = abs(own.corrections[q]) / its.value
            sizes = [(value + share * half) * scale for share in (-1.0, 0.0, 1.0)]
    u = np.array([size * np.exp(1j * angle) for size in sizes for angle in angles])
    # what the other plane leaves of the forces
    made = right - (u - own.corrections[q])
    if kind == "angle":
        return polar_range(made, answer)
    values = np.abs(made) * (answer.value / abs(right))
    return float(values.min()), float(values.max())


def polar_range(made: Complexes, answer: Answer) -> Range:
    """Return the range of the angles of vectors, about that in the middle, in the unit of the answer."""
    middle = degrees(made[len(made) // 2 : len(made) // 2 + 1])
    off = np.remainder(degrees(made) - middle + 180.0, 360.0) - 180.0
    low, high = float(middle[0] + off.min()), float(middle[0] + off.max())
    return (
        (low, high) if unit_name(answer.unit) == "deg" else (float(np.radians(low)), float(np.radians(high)))
    )


def _plane(answer: Answer, own: Rotor) -> str | None:
    return answer.ask.where.get("plane", own.planes[0]) if kind_of(answer) else None


def _rotor(answer: Answer) -> str:
    return answer.ask.where.get("rotor", "")
