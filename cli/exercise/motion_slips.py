"""Slips in the sums of kinematics and of bodies: the parts of a velocity or an acceleration, Σ I·ω, Ω × H."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from cli.exercise.answers import Answer
from cli.exercise.slips import Change, Pairs, Slip, of_sum
from cli.exercise.variants import Variant
from cli.exercise.work_slips import way_of
from dalembert.units import parted

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


def slips(variant: Variant, number: int) -> tuple[list[Slip], Callable[[], Pairs | None]]:
    """Return the slips of an answer that is a sum of such parts, and pairs of them; none of any other answer."""
    answer = variant.answers[number]
    parts = [part for part in _parts(variant, answer) if part.value]
    total = sum(part.value for part in parts)
    if len(parts) < 2 or not total:
        return [], lambda: None
    changes = [change for k, part in enumerate(parts) for change in _changes(k, part)]
    factor = answer.value / total
    return of_sum(answer, changes, complex(total), lambda sums: sums.real * factor)


def _changes(k: int, part: Part) -> Iterator[Change]:
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
