"""Slips at a rotor whose masses are known: every mass is a term of the sum; plane A after plane B as it was answered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from cli.exercise.description import Answer
from cli.exercise.slips import GRAVITIES, Candidates, Change, Slip, finals, of_sum, other_gravities
from cli.exercise.variants import Variant
from dalembert.angles import degrees

Complexes = NDArray[np.complex128]
Real = NDArray[np.float64]
Range = tuple[float, float]


@dataclass(eq=False, repr=False)
class Rotor:
    """A rotor's unbalances, its planes, and the right corrections; SI."""

    names: Sequence[str]
    moment: Complexes
    angle_deg: Real | None
    """The angles as the table has them; None where they are in radians."""
    has_radius: bool
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
        return self.corrections_of(self.moment)

    def corrections_of(self, moments: Complexes) -> Complexes:
        """The corrections of rotors with other unbalances, (n, k) -> (n, p)."""
        return self.sign * correct(moments, np.broadcast_to(self.z, moments.shape), self.plane_z).unbalance

    @cached_property
    def in_radians(self) -> Complexes | None:
        """The unbalances with each angle's degrees taken as radians."""
        return None if self.angle_deg is None else np.abs(self.moment) * np.exp(1j * self.angle_deg)

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
            if self.in_radians is not None:
                turned = complex(self.in_radians[k])
                yield Change(k, f"the angle of {name}: degrees taken as radians", turned - u)
            yield Change(k, f"the angle of {name} is counted the other way", np.conj(u) - u)
            if self.has_radius:
                yield Change(k, f"the diameter of {name} in place of its radius", u)

    def of_all(self) -> Iterator[tuple[str, Complexes]]:
        """What can go wrong with all masses alike: the unbalances."""
        if self.in_radians is not None:
            yield "the angles of the masses: degrees taken as radians", self.in_radians
        if self.has_radius:
            yield "the diameters of the masses in place of their radii", 2 * self.moment


def rotor(variant: Variant, answer: Answer) -> Rotor | None:
    """Return the rotor that a question is about; None with three planes or more, modes, or rounded corrections."""
    own = variant.problem.parameters
    if any(own[name] for name in ("round_mass", "round_angle", "modes", "mass")):
        return None
    read, planes = variant.problem.known_masses()
    if not 1 <= len(planes.name) <= 2 or planes.rotor is not None:
        return None
    if len(read.names) > 1 and "rotor" not in answer.ask.where:
        return None
    which = read.names.index(answer.ask.where["rotor"]) if "rotor" in answer.ask.where else 0
    rows = np.flatnonzero(read.rotor == which)
    names = read.table.texts.get("name") or [f"mass {k}" for k in range(1, read.table.rows + 1)]
    z = read.z if read.z is not None else np.zeros(len(read.moment))
    plane_z = planes.z if planes.z is not None else np.zeros(len(planes.name))
    angle = read.table.numbers["angle"]
    return Rotor(
        [names[k] for k in rows], read.moment[rows], angle.values[rows] if angle.unit == "deg" else None,
        read.radius_unit is not None, z[rows], planes.name, np.asarray(plane_z, float), np.asarray(planes.radius, float),
        variant.problem.gravity, read.weights, -1.0 if own["remove"] else 1.0,
    )  # fmt: skip


KINDS = ("mass", "weight", "unbalance", "angle")


def kind_of(answer: Answer) -> str:
    """What a question asks of a correction: mass, weight, unbalance, angle; empty for anything else."""
    name = answer.ask.name.lower()
    return name if name in KINDS else ""


def of_rotor(variant: Variant, number: int) -> Candidates | None:
    """Return the slips of a correction."""
    answer = variant.answers[number]
    kind = kind_of(answer)
    own = rotor(variant, answer) if kind else None
    if own is None:
        return None
    p = list(own.planes).index(answer.ask.where["plane"]) if "plane" in answer.ask.where else 0
    right = complex(own.corrections[p])
    if not right or not answer.value:
        return None

    def value_of(u: Any) -> Real:
        # in the unit asked for, by the right answer
        if kind == "angle":
            return np.asarray(degrees(u) * (answer.turn / 360))
        return np.asarray(np.abs(u) * (answer.value / abs(right)))

    changes = list(own.changes())
    by = np.array([change.by for change in changes])
    changed = np.tile(own.moment, (len(changes), 1))
    changed[np.arange(len(changes)), [change.term for change in changes]] += by
    after = own.corrections_of(changed)
    # a correction is a sum over the masses, as their unbalances are
    shares = [
        replace(change, by=complex(u) - right)
        for change, u in zip(changes, after[:, p].tolist(), strict=True)
    ]
    singles, pairs = of_sum(answer, shares, right, value_of)
    for text, moments in own.of_all():
        singles.append(Slip(text, float(value_of(own.corrections_of(moments)[p]))))
    # in the forces alone, with the other plane right; in the moments alone, carried into the forces
    if len(own.planes) == 2:
        forces = right - own.sign * by
        moments = right - (after[:, 1 - p] - own.corrections[1 - p])
        for where, u in (("forces", forces), ("moments", moments)):
            singles += [
                Slip(f"{c.text} in the sum of the {where}", float(v))
                for c, v in zip(changes, value_of(u), strict=True)
            ]
    singles += _final(own, kind, p, answer)
    return Candidates(answer, singles, pairs)


def _final(own: Rotor, kind: str, p: int, answer: Answer) -> Iterator[Slip]:
    """Slips of the last step: the angle's quadrant and sense, radius, weight."""
    value, g = answer.value, own.gravity
    if kind == "angle":
        yield Slip(
            "180° off: the angle of the unbalance in place of the correction's, or the wrong quadrant",
            value + answer.turn / 2,
        )
    for other in (g, *(other for other in GRAVITIES if other != g)):
        if kind == "mass":
            yield Slip("the weight in place of the mass", value * other)
        if kind == "weight":
            yield Slip("the mass in place of the weight", value / other)
    if kind == "weight" or (own.weights and kind != "angle"):
        for text, share in other_gravities(g):
            yield Slip(text, value * share if kind == "weight" else value / share)
    if kind in ("mass", "weight"):
        yield Slip("the diameter in place of the radius of the plane", value / 2)
        yield Slip("the unbalance in place of the mass or weight", value * float(own.radius[p]))
    yield from finals(answer)


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
        return polar_range(made, answer)
    values = np.abs(made) * (answer.value / abs(right))
    return float(values.min()), float(values.max())


def polar_range(made: Complexes, answer: Answer) -> Range:
    """Return the range of the angles of vectors, about that in the middle, in the unit of the answer."""
    middle = degrees(made[len(made) // 2 : len(made) // 2 + 1])
    off = np.remainder(degrees(made) - middle + 180.0, 360.0) - 180.0
    unit = answer.turn / 360
    return float(middle[0] + off.min()) * unit, float(middle[0] + off.max()) * unit
