"""Stress of whole mechanisms against 50 digits: near-singular groups, guides, gears, sweeps, whole turns, forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.stress.pairs import Pairs
from benchmarks.stress.random_linkages import four_bar, geared_five_bar, slider_crank, triad, turning_block
from benchmarks.truth.constraints import DIGITS
from benchmarks.truth.mechanism import Exact
from virtualwork import Link, Mechanism, MechanismError
from virtualwork.digits.estimates import Estimates
from virtualwork.formulas.quantity import Quantity
from virtualwork.motion import Motion

Generator = np.random.Generator
FAR = 0.1  # rad: a branch that leaves the computed pose by more is another one


def _scale(rng: Generator) -> float:
    return float(10.0 ** rng.uniform(-12, 12))


def _away(rng: Generator, low: float) -> float:
    """A distance from a singular place, 10^low … 0.1."""
    return float(10.0 ** rng.uniform(low, -1))


def _rates(rng: Generator, scale: float = 1.0) -> dict[str, float]:
    return {"speed": scale * 3 * float(rng.normal()), "acceleration": scale * 9 * float(rng.normal())}


def compare(motion: Motion, i: int = 0, *, singular: bool = False) -> Pairs:
    """Errors and bounds of every link's angle, ω and α, of a point of the last link, and of the slides."""
    if not motion.assembled[i]:
        return [] if singular else [(math.inf, 1.0)]
    exact = Exact(motion, i)
    m = motion.mechanism
    found: Pairs = []
    names = ("angle", "omega", "alpha")
    if not exact.closed:
        return [] if singular else [(math.inf, 1.0)]
    with mp.workdps(DIGITS):
        for name in m.links:
            link = motion.link(name)
            for order in range(3):
                apart = exact.angle(name, order) - mp.mpf(float(getattr(link, names[order])[i]))
                if order == 0:
                    apart -= 2 * mp.pi * mp.nint(apart / (2 * mp.pi))
                    if singular and abs(apart) > FAR:
                        return []
                found.append((_size(apart), float(link.error_estimate(order)[i])))
        last = list(m.links)[-1]
        z = m.size * (0.3 + 0.2j)
        point = motion.at(last, z)
        for order in range(3):
            apart = exact.point(last, z, order) - mp.mpc(complex(point.complex(order)[i]))
            found.append((_size(apart), float(point.error_estimate(order)[i])))
        for g, guide in enumerate(m.guides):
            slide = motion.slide(guide.point)
            for order, value in enumerate((slide.position, slide.speed, slide.acceleration)):
                apart = exact.slide(g, order) - mp.mpf(float(value[i]))
                found.append((_size(apart), float(slide.error_estimate(order)[i])))
    return found


def _size(apart: Any) -> float:
    """An error; what is left of the 50 digits is none."""
    size = float(abs(apart))
    # next to a singular triad the truth itself keeps some 35 of them
    return 0.0 if size < 1e-33 else size


@cache
def _klann() -> Mechanism:
    from benchmarks.scenes import klann

    # the truth takes the numbers as floats, and points by their coordinates
    m = klann()
    links = {name: Link(link.points, link.mass, link.center, link.inertia) for name, link in m.links.items()}
    return replace(m, links=links, decimals=None)


# --- campaigns --------------------------------------------------------------------------------------------------------


def _near(
    make: Callable[[Generator, float, float], tuple[Mechanism, float]], low: float, rng: Generator
) -> Pairs:
    """A mechanism at a distance 10^low … 0.1 from a singular place."""
    scale, near = _scale(rng), _away(rng, low)
    m, at = make(rng, near, scale)
    rates = _rates(rng, scale if m.inputs[0].is_slide else 1.0)
    return compare(m.motion(at, **rates), singular=near < 1e-13)


def _near_triad(rng: Generator) -> Pairs:
    """On either side of the singular place only one has a pose: the other is then taken."""
    scale, near = _scale(rng), _away(rng, -12)
    state = rng.bit_generator.state
    for side in (1, -1):
        rng.bit_generator.state = state
        m, at = triad(rng, side * near, scale)
        try:
            motion = m.motion(at, **_rates(rng))
            if motion.assembled[0]:
                return compare(motion, singular=True)
        except MechanismError:
            continue
    return []


def _gears(rng: Generator) -> Pairs:
    at = float(rng.uniform(-3, 3))
    m = geared_five_bar(rng, at, _scale(rng))
    return [] if m is None else compare(m.motion(at, **_rates(rng)))


def _legs(rng: Generator) -> Pairs:
    return compare(_klann().motion(float(rng.uniform(-10, 10)), **_rates(rng)))


def _wrap(rng: Generator) -> Pairs:
    """A four-bar at ±π and at k turns, k to 10⁴, within 1e-1 … 1e-16 of them."""
    turns = int(rng.choice([0, 1, 10, 1000, 10000])) * int(rng.choice([-1, 1]))
    at = float(rng.choice([-math.pi, 0.0, math.pi])) + float(rng.choice([-1, 1])) * _away(rng, -16)
    m, _ = four_bar(rng, at, _scale(rng))
    motion = m.motion(m.at[0] + 2 * math.pi * turns, **_rates(rng))
    return compare(motion)


def _sweeps(rng: Generator) -> Pairs:
    """Four poses of a sweep of 10⁵ … 10⁶, over one turn or many."""
    m, at = four_bar(rng, float(rng.uniform(-3, 3)), _scale(rng))
    n = int(10 ** rng.uniform(5, 6))
    q = at + np.linspace(0.0, float(rng.choice([1e-6, 0.1, 20 * math.pi])), n)
    rates = _rates(rng)
    motion = m.motion(q, **rates)
    there = np.flatnonzero(motion.assembled)
    found: Pairs = []
    for i in rng.choice(there, 4):
        alone = m.motion(q[i], **rates)
        if alone.assembled[0]:
            found += _picked(motion, int(i), alone)
    return found


def _picked(sweep: Motion, i: int, alone: Motion) -> Pairs:
    """One pose of a sweep against 50 digits; `alone` is that pose by itself."""
    exact = Exact(alone)
    if not exact.closed:
        return []

    def values(keys: Sequence[Quantity]) -> list[Any]:
        return [value[i : i + 1] for value in sweep.values(keys)]

    estimates = Estimates(alone.poses, values)
    found: Pairs = []
    with mp.workdps(DIGITS):
        for name in sweep.mechanism.links:
            link = sweep.link(name)
            for order in range(3):
                apart = exact.angle(name, order) - mp.mpf(float(link.value(order)[i]))
                if order == 0:
                    apart -= 2 * mp.pi * mp.nint(apart / (2 * mp.pi))
                found.append((_size(apart), float(estimates.of(link.key(order))[0])))
    return found


def _closure(rng: Generator) -> Pairs:
    """The pose after 1, 10 and 1000 turns (of a gear train of −1/3: 3, 9, 30), at the very double of the angle."""
    at = float(rng.uniform(-3, 3))
    if rng.random() < 0.5:
        m = geared_five_bar(rng, at, _scale(rng))
        turns = (3, 9, 30)
    else:
        m, at = four_bar(rng, at, _scale(rng))
        turns = (1, 10, 1000)
    if m is None:
        return []
    k = int(rng.choice(turns))
    return compare(m.motion(at + 2 * math.pi * k, **_rates(rng)))


def _forces(rng: Generator) -> Pairs:
    """Effort both ways, joint forces and shaking force of a heavy four-bar 1e-1 … 1e-15 from a limit."""
    near = _away(rng, -15)
    m, at = four_bar(rng, near, float(10 ** rng.uniform(-3, 3)), limit=True)
    motion = m.motion(at, **_rates(rng))
    if not motion.assembled[0]:
        return [(0.0 if near < 1e-13 else math.inf, 1.0)]
    exact = Exact(motion)
    if not exact.closed:
        return []
    true, d = exact.forces(), motion.dynamics
    bounds = d.error_estimate()
    found: Pairs = []
    with mp.workdps(DIGITS):
        effort = true["input", "0", 0]
        for value, bound in ((d.effort, bounds.effort), (d.newton_euler, bounds.newton_euler)):
            if np.isfinite(value[0, 0]):
                found.append((_size(effort - mp.mpf(float(value[0, 0]))), float(bound[0, 0])))
        for joint in d.reactions.joints:
            body = joint.bodies[-1]
            force = d.joint_force(joint, body)[0]
            if np.isfinite(force):
                apart = mp.mpc(true[joint.key, body, 0], true[joint.key, body, 1]) - mp.mpc(complex(force))
                found.append((_size(apart), float(bounds.joint_force(joint, body)[0])))
        loads = exact.loads()
        apart = sum((load[2] for load in loads), mp.mpc(0)) - mp.mpc(*map(float, d.shaking[0][0]))
        found.append((_size(apart), float(bounds.shaking[0][0])))
    return found


CAMPAIGNS = {
    "near-singular triads": ("Stephenson six-bars 1e-1 … 1e-12 from a singular triad", _near_triad),
    "slider-cranks": (
        "driven at crank or piston, 1e-1 … 1e-15 from a dead point",
        partial(_near, slider_crank, -15),
    ),
    "turning blocks": (
        "inverted slider-cranks 1e-1 … 1e-15 from a limit",
        partial(_near, turning_block, -15),
    ),
    "geared five-bars": ("gears of −1/3, ±1 and 2", _gears),
    "Klann legs": ("anywhere", _legs),
    "input angles at the wrap": ("four-bars at ±π and at up to 10⁴ turns", _wrap),
    "long sweeps": ("poses of sweeps of 10⁵ … 10⁶", _sweeps),
    "closure": ("after 1, 10, 1000 turns; geared 3, 9, 30", _closure),
    "forces near dead points": ("effort, joint forces and shaking of heavy four-bars", _forces),
}
