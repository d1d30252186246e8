"""Slips where an answer is a sum: of the parts of a motion, of the products of a momentum, of loads, powers, unbalances."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from cli.exercise.description import Answer, Value, same
from cli.exercise.slips import (
    ALONE,
    GRAVITIES,
    WEIGHTS,
    Candidates,
    Change,
    Slip,
    Slips,
    finals,
    of_gravity,
    of_sum,
    other_gravities,
)
from cli.exercise.solving import Problem
from cli.exercise.variants import Variant
from dalembert.angles import degrees
from dalembert.results.way import figures

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


WRONG = {
    "has the wrong sign": -2.0,
    "is left out": -1.0,
    "is ten times too small": -0.9,
    "is ten times too large": 9.0,
}
"""How often a part of an answer is added to it by a slip."""


class Part(NamedTuple):
    """A part of a sum: of a velocity, an acceleration, a momentum, a power, or of a load in an answer."""

    name: str
    value: float


def changes_of_part(term: int, name: str, value: complex, unit: str = "") -> Iterator[Change]:
    """Yield what can go wrong with a part; with its unit it says which number is taken for which."""
    for text, times in WRONG.items():
        what = f"the {name} {text}"
        if unit and abs(1 + times) not in (0, 1):
            size, other = figures(abs(value)), figures(abs(value * (1 + times)))
            what = f"the power of {what} ({size} {unit} taken as {other} {unit})"
        yield Change(term, what, times * value, is_sign=times == -2.0)
    if name.startswith("Coriolis"):
        yield Change(term, f"the {name} lacks its factor 2", -value / 2)


def of_parts(
    answer: Answer, parts: Sequence[Part], total: float, unit: str = "", further: Sequence[Change] = ()
) -> Slips:
    """Return the slips of an answer in proportion to a sum of parts, and pairs of them."""
    changes = [c for k, part in enumerate(parts) if part.value for c in changes_of_part(k, *part, unit)]
    share = answer.value / total if total else 1.0
    return of_sum(answer, [*changes, *further], complex(total), lambda sums: sums.real * share)


def way_of(variant: Variant) -> Sequence[Mapping[str, Any]]:
    """Return the worked solution as JSON has it; empty where the command has none."""
    way: Any = variant.worked.document.get("way")
    return way or ()


def of_motion(variant: Variant, number: int) -> Slips:
    """Return the slips of an answer that is a sum of such parts, and pairs of them; none of any other answer."""
    answer = variant.answers[number]
    parts = [part for part in _parts(variant, answer) if part.value]
    total = sum(part.value for part in parts)
    if len(parts) < 2 or not total:
        return [], lambda: None
    return of_parts(answer, parts, total)


def _parts(variant: Variant, answer: Answer) -> Sequence[Part]:
    command = variant.problem.exercise.command[0]
    name = answer.ask.name
    if command in ("mechanism", "forces"):
        return _of_point(variant, name, answer.ask.where)
    if command == "body" and answer.ask.where.get("axis", "x") in AXES:
        return _of_body(variant, name, AXES.index(answer.ask.where.get("axis", "x")))
    return ()


def _topic(variant: Variant, name: str) -> Mapping[str, Any]:
    return next((topic for topic in way_of(variant) if topic.get("topic") == name), {})


def _of_point(variant: Variant, name: str, where: Mapping[str, str]) -> Sequence[Part]:
    """The parts of a point's velocity or acceleration along an axis, in the pose that is asked for."""
    match = re.fullmatch(r"(.+)_([va])([xy])", name)
    if match is None:
        return ()
    point, kind, axis = match.groups()
    topic = _topic(variant, "parts")
    pose = _instant(topic["poses"], where) if "poses" in topic else topic
    every = [entry for entry in pose.get("points", ()) if entry["point"] == point]
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
    """The products in a component of H = I·ω and of Ḣ = (Ḣ)rel + Ω × H."""
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
LOAD = re.compile(r"(?:forces\.(\d+)\.force|torques\.(\d+)\.torque)(?:\.[xy])?")


class Load(NamedTuple):
    """A load, and its part in every answer; None where it has none."""

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


def of_loads(answer: Answer, number: int, every: Sequence[Load]) -> Slips:
    """The slips of an answer that is a sum over the loads, and pairs of them."""
    parts = [Part(load.name, load.parts[number] or 0.0) for load in every if load.parts]
    return of_parts(answer, parts, answer.value)


def is_sum(answer: Answer) -> bool:
    """Whether an answer is a sum over the loads."""
    return LINEAR.search(answer.ask.name) is not None


def of_ledger(variant: Variant, number: int) -> Slips:
    """Return the slips of an unknown load or effort, and pairs of them; none of any other answer, nor of several unknowns."""
    answer = variant.answers[number]
    terms = _ledger(variant, answer)
    total = sum(term.value for term in terms)
    if not total:
        return [], lambda: None
    return of_parts(answer, terms, total, "W", list(_gravity(variant, terms)))


def _ledger(variant: Variant, answer: Answer) -> list[Part]:
    """Return the terms of the instant that the question is about, where it has one unknown, which is asked for."""
    command, asked, where = variant.problem.exercise.command[0], answer.ask.quantity, answer.ask.where
    instant: Mapping[str, Any] = {}
    if command == "work" and asked.startswith(("torque", "fx", "fy")):
        instant = _instant(variant.solved.document.get("steps"), where)
    if command == "forces" and asked.startswith(("input_torque", "input_force", "virtual_work")):
        instant = _instant(_topic(variant, "ledger").get("poses"), where)
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
            terms.append(Part(name, float(entry["power_W"])))
    return terms if len(unknown) == 1 and unknown[0] else []


def _instant(listed: Any, where: Mapping[str, str]) -> Mapping[str, Any]:
    """Return the instant that the question names by its step or its input; the only one, where it names none."""
    instants = [{"step": str(k), **each} for k, each in enumerate(listed or (), 1)]
    for key in ("step", "input_deg", "input_m"):
        if key in where:
            instants = [each for each in instants if same(each.get(key), where[key])]
    return instants[0] if len(instants) == 1 else {}


def _gravity(variant: Variant, terms: Sequence[Part]) -> Iterator[Change]:
    """Another g in all weights, which goes together with a slip in any term; their masses in place of the weights; no weights."""
    weight = sum(term.value for term in terms if term.name.startswith("weight of"))
    if weight and variant.problem.gravity:
        for text, share in of_gravity(variant.problem.gravity):
            yield Change(len(terms), text, weight * (share - 1))
        for text, share in WEIGHTS:
            yield Change(ALONE, text, weight * (share - 1), is_sign=share < 0)


# --- a correction is a sum over the masses -------------------------------------------------------------------------
Complexes = NDArray[np.complex128]
Real = NDArray[np.float64]


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
            yield from changes_of_part(k, f"term of {name}", u)
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
        variant.problem.gravity, bool(read.weight_unit), -1.0 if own["remove"] else 1.0,
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
