"""What skipping saves: one scene, and less and less of it asked for; time, and calls of the kernels."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from types import CodeType, FrameType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import loaded_klann
from benchmarks.speed.measure import Measurement, measured, seconds
from virtualwork import Mechanism
from virtualwork.formulas import closed_forms, load_paths, loads, positions, quantities
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.reactions import Reactions
from virtualwork.motion import Motion

Real = NDArray[np.float64]

DOMAIN = "skipping"

PINS = (
    ("A", "crank"),
    ("B", "coupler"),
    ("C", "rocker"),
    ("D", "rocker"),
    ("E", "arm"),
    ("F", "leg"),
    ("G", "leg"),
)


def kernels() -> set[CodeType]:
    """Return the functions that do the work: closed forms, placements, derivative steps, loads, joint forces."""
    found: list[Any] = [
        closed_forms.two_angles,
        closed_forms.angle_and_slide,
        closed_forms.turning_slide,
        closed_forms.two_slides,
        positions.run,
        Rates.advance,
        Reactions.on_side,
    ]
    kinds = [
        kind
        for module in (loads, quantities, load_paths)
        for kind in vars(module).values()
        if isinstance(kind, type)
    ]
    found += [kind.form for kind in kinds if issubclass(kind, loads.Load | quantities.Quantity)]
    return {function.__code__ for function in found}


def count(call: Callable[[], Any]) -> int:
    """Return how often a call enters a kernel, once all that is kept from a first call is there."""
    call()
    wanted, entered = kernels(), 0

    def watch(frame: FrameType, event: str, _: Any) -> None:
        nonlocal entered
        if event == "call" and frame.f_code in wanted:
            entered += 1

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        call()
    finally:
        sys.setprofile(before)
    return entered


def _forces(motion: Motion, *, joints: bool) -> list[Real]:
    return [motion.effort, *(motion.reaction(pin, on=link) for pin, link in PINS if joints)]


def _everything(mechanism: Mechanism, angles: Real) -> list[Real]:
    motion = mechanism.motion(angles, speed=10.0, acceleration=0.0)
    foot = motion.point("H")
    turns = [motion.link(name) for name in ("coupler", "rocker", "arm", "leg")]
    rates = [x for link in turns for x in (link.angle, link.omega, link.alpha)]
    return [foot.position, foot.velocity, foot.acceleration, *rates, *_forces(motion, joints=True)]


def _reactions(mechanism: Mechanism, angles: Real) -> list[Real]:
    return _forces(mechanism.motion(angles, speed=10.0, acceleration=0.0), joints=True)


def _effort(mechanism: Mechanism, angles: Real) -> list[Real]:
    return _forces(mechanism.motion(angles, speed=10.0, acceleration=0.0), joints=False)


def _at_rest(mechanism: Mechanism, angles: Real) -> list[Real]:
    return _forces(mechanism.motion(angles, speed=0.0, acceleration=0.0), joints=False)


def _velocity(mechanism: Mechanism, angles: Real) -> list[Real]:
    foot = mechanism.motion(angles, speed=10.0, acceleration=0.0).point("H")
    return [foot.position, foot.velocity]


def _foot(mechanism: Mechanism, angles: Real) -> list[Real]:
    return [mechanism.motion(angles).point("H").position]


def _pin(mechanism: Mechanism, angles: Real) -> list[Real]:
    return [mechanism.motion(angles).point("C").position]


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield times and kernel calls of the Klann leg with masses, gravity and a force at its foot, asked for ever less."""
    angles = np.linspace(0.0, 2 * np.pi, 4096 if quick else 40_960)
    heavy, light = loaded_klann(), loaded_klann(masses=False, gravity=False)
    no_weights = loaded_klann(gravity=False)
    asked: tuple[tuple[str, Mechanism, Callable[[Mechanism, Real], list[Real]]], ...] = (
        ("everything: foot, angles and rates, torque, joint forces", heavy, _everything),
        ("torque and every joint force", heavy, _reactions),
        ("torque alone, by virtual work", heavy, _effort),
        ("torque, no gravity", no_weights, _effort),
        ("torque, at rest: no inertia loads, no acceleration", heavy, _at_rest),
        ("torque, no masses, no gravity: one force left", light, _effort),
        ("the foot's position and velocity, no acceleration", heavy, _velocity),
        ("the foot's position", heavy, _foot),
        ("one pin's position: arm and leg are never solved", heavy, _pin),
    )
    whole = 0.0
    for method, mechanism, ask in asked:
        call = partial(ask, mechanism, angles)
        whole = whole or seconds(call, 0.3) / len(angles) * 1e9
        found = measured(
            DOMAIN,
            "Klann leg, loaded: what is asked for",
            method,
            call,
            size=len(angles),
            kernels=count(call),
        )
        yield replace(found, floor="everything", ratio=found.ns / whole)
