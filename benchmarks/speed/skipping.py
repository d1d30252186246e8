"""What skipping saves: one scene, and smaller and smaller requests of it; time, and the operations that are left on the tape."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import loaded_klann
from benchmarks.speed.evaluators import engine
from benchmarks.speed.measure import Measurement, measured
from virtualwork import Mechanism
from virtualwork.motion import Motion

Real = NDArray[np.float64]

DOMAIN = "skipping"

PINS = ("A.crank", "B.coupler", "C.rocker", "D.rocker", "E.arm", "F.leg", "G.leg")
FOOT = ("points.H", "points.H.velocity", "points.H.acceleration")
TURNS = tuple(
    f"links.{link}.{what}"
    for link in ("coupler", "rocker", "arm", "leg")
    for what in ("angle", "omega", "alpha")
)
FORCES = ("effort", *(f"reactions.{pin}" for pin in PINS))


def quantity(motion: Motion, name: str) -> Real:
    """Return a quantity of a motion, called as an evaluator calls it."""
    kind, *of = name.split(".")
    if kind == "effort":
        return motion.effort
    if kind == "reactions":
        return motion.reaction(*of)
    whose: Any = motion.point(of[0]) if kind == "points" else motion.link(of[0])
    found: Real = getattr(whose, of[1] if len(of) > 1 else "position")
    return found


def ask(mechanism: Mechanism, angles: Real, speed: float, names: tuple[str, ...]) -> list[Real]:
    """Return quantities of a new motion."""
    motion = mechanism.motion(angles, speed=speed, acceleration=0.0)
    return [quantity(motion, name) for name in names]


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield times and operations of the Klann leg with masses, gravity and a force at its foot, for ever smaller requests."""
    # on one engine throughout: left to itself, each request goes over to compiled code when that pays
    with engine("numpy"):
        yield from _requests(quick)


def _requests(quick: bool) -> Iterator[Measurement]:
    angles = np.linspace(0.0, 2 * np.pi, 4096 if quick else 40_960)
    heavy, light = loaded_klann(), loaded_klann(masses=False, gravity=False)
    no_weights = loaded_klann(gravity=False)
    effort, turning = ("effort",), 10.0
    requests: tuple[tuple[str, Mechanism, float, tuple[str, ...]], ...] = (
        (
            "everything: foot, angles and rates, torque, joint forces",
            heavy,
            turning,
            (*FOOT, *TURNS, *FORCES),
        ),
        ("torque and every joint force", heavy, turning, FORCES),
        ("torque alone, by virtual work", heavy, turning, effort),
        ("torque, no gravity", no_weights, turning, effort),
        ("torque, at rest: no inertia loads, no acceleration", heavy, 0.0, effort),
        ("torque, no masses, no gravity: one force left", light, turning, effort),
        ("the foot's position and velocity, no acceleration", heavy, turning, FOOT[:2]),
        ("the foot's position", heavy, 0.0, FOOT[:1]),
        ("one pin's position: arm and leg are never solved", heavy, 0.0, ("points.C",)),
    )
    whole = 0.0
    for method, mechanism, speed, names in requests:
        call = partial(ask, mechanism, angles, speed, names)
        found = measured(
            DOMAIN,
            "Klann leg, loaded: requested quantities",
            method,
            call,
            size=len(angles),
            operations=mechanism.evaluator(*names).operations(speed=speed != 0.0, acceleration=False),
        )
        whole = whole or found.ns
        yield replace(found, floor="everything", ratio=found.ns / whole)
