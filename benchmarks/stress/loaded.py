"""Mechanisms of any topology under loads, at many poses and on every engine: all estimates against fifty digits."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import fields, replace
from itertools import product
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np

from benchmarks.stress.pairs import Pairs
from benchmarks.stress.topologies import Topology, generate, regularity
from benchmarks.truth.constraints import DIGITS, along, ratio
from benchmarks.truth.mechanism import Exact
from virtualwork import GROUND, Belt, Force, Friction, Gear, Mechanism, Spring, Torque, TorsionSpring
from virtualwork.describe import MechanismError
from virtualwork.formulas.forces import Effort, JointForce, JointMoment, NewtonEuler, Shaking
from virtualwork.formulas.kinematics import Angle, Point, Slide
from virtualwork.formulas.quantity import Quantity
from virtualwork.motion import Motion

Generator = np.random.Generator
# poses of a mechanism, and how far from its guess they lie: 10 to these, rad or m
POSES, OFF = 12, (-6.0, -0.5)
# of some: how far from the end of the input's range
BESIDE = (-9.0, -1.0)
# what is less than this of the largest is nothing in fifty digits
NOTHING = mp.mpf(10) ** -30


class Answer(NamedTuple):
    """A number that the program hands out: what it is, its error and the estimate of it."""

    name: str
    error: float
    estimate: float
    seed: int
    pose: int


def under_loads(t: Topology, rng: Generator) -> Mechanism:
    """A random mechanism with masses, weight, forces, torques, springs and dampers."""
    m = t.mechanism
    names = list(m.links)

    def some(most: int) -> range:
        return range(int(rng.integers(0, most + 1)))

    def place() -> complex:
        return complex(*rng.normal(size=2))

    def link() -> str:
        return str(rng.choice(names))

    def two() -> tuple[str, str]:
        first, second = rng.choice([GROUND, *names], 2, replace=False)
        return str(first), str(second)

    links = {
        name: replace(
            one,
            mass=float(rng.uniform(0, 2)),
            center=place(),
            inertia=float(rng.choice([0.0, rng.uniform()])),
        )
        for name, one in m.links.items()
    }
    torsion = []
    for _ in some(1):
        a, b = two()
        twist = t.angles.get(b, 0.0) - t.angles.get(a, 0.0)
        stiffness, free, damping = (
            float(x) for x in (rng.uniform(0, 5), twist + rng.uniform(-1, 1), rng.uniform())
        )
        torsion.append(TorsionSpring((a, b), stiffness, free, damping))
    rubs = []
    if not m.racks and rng.random() < 0.4:
        single = [pin for pin, bodies in m.pins.items() if len(bodies) == 2]
        guided = [g.point for g in m.guides if g.point not in m.pins]
        for joint in rng.permutation([*single, *guided])[:2].tolist():
            rubs.append(Friction(joint, float(rng.uniform(0, 0.3)), 0.05 if joint in m.pins else 0.0))
    parts = {f.name: getattr(m, f.name) for f in fields(m)}
    parts |= {
        "friction": rubs,
        "links": links,
        "gravity": place(),
        "forces": [Force(link(), place(), 9 * place(), str(rng.choice(["ground", "link"]))) for _ in some(2)],  # type: ignore[arg-type]
        "torques": [Torque(link(), float(rng.normal())) for _ in some(1)],
        "springs": [
            Spring(
                tuple((body, place()) for body in two()),  # type: ignore[arg-type]
                *(float(x) for x in rng.uniform(0, 3, 3)),
            )
            for _ in some(2)
        ],
        "torsion_springs": torsion,
    }
    return Mechanism(**parts)


def _keys(motion: Motion) -> list[Quantity]:
    """Everything that has an estimate."""
    m = motion.mechanism
    keys: list[Quantity] = []
    for order in range(3):
        keys += [Angle(body, order) for body in m.links]
        keys += [Slide(i, order) for i in range(len(m.guides))]
        keys += [
            Point(body, z, p, order)
            for body, points in m.bodies.items()
            if body != GROUND
            for p, z in points.items()
        ]
    keys += [kind(j) for kind in (Effort, NewtonEuler) for j in range(len(m.inputs))]
    for joint in motion.dynamics.reactions.joints:
        keys += [JointForce(joint.key, body) for joint_body in [joint] for body in joint_body.bodies[1:]]
        if joint.guide is not None and m.guides[joint.guide].is_slider:
            keys += [JointMoment(joint.key, body) for body in joint.bodies[1:]]
    return [*keys, Shaking()]


def _true(exact: Exact, forces: dict[Any, Any], key: Quantity) -> Any:
    """A quantity in fifty digits; None where the oracle has no number for it."""
    m = exact.m
    if isinstance(key, Angle):
        return exact.angle(key.body, key.order)
    if isinstance(key, Slide):
        return exact.slide(key.guide, key.order)
    if isinstance(key, Point):
        return exact.point(key.body, key.z, key.order)
    if isinstance(key, (Effort, NewtonEuler)):
        return forces["input", str(key.input), 0]
    if isinstance(key, JointMoment):
        guide = int(key.joint.partition(":")[2])
        g = m.guides[guide]
        return (1 if key.body == g.link else -1) * forces[f"moment:{guide}", g.link, 0]
    if isinstance(key, JointForce):
        kind, _, which = key.joint.partition(":")
        if kind == "pin":
            return mp.mpc(forces[key.joint, key.body, 0], forces[key.joint, key.body, 1])
        if kind == "guide" and which.isdigit():
            g = m.guides[int(which)]
            sign = 1 if key.body == g.link else -1
            return sign * forces[key.joint, g.link, 1]
    return None


def constants_of(motion: Motion) -> list[list[Any]]:
    """The constants of gears, belts and racks at every pose, as the second run has them at the first one.

    What the guess fixes by way of loops is no number of the description: its last digits are the program's own. Between poses
    they differ by the whole turns in which the answers count angles.
    """
    m = motion.mechanism
    slides = [m.guide_at(rack.slider) for rack in m.racks]
    keys: list[Quantity] = [*(Angle(body, 0) for body in m.links), *(Slide(i, 0) for i in slides)]
    second = motion.rounding.second.doubled(keys)
    first: list[Any] = []
    every = []
    for i in np.flatnonzero(motion.assembled).tolist():

        def exact(key: Quantity, i: int = i) -> Any:
            x = second[key][0]
            parts = (np.broadcast_to(part, motion.n)[i] for part in (x.high, x.low))
            return sum((mp.mpf(float(part)) for part in parts), mp.mpf(0))

        angle: dict[str, Any] = {GROUND: mp.mpf(0)}
        for body in m.links:
            x = exact(Angle(body, 0))
            angle[body] = x + 2 * mp.pi * mp.nint(
                (mp.mpf(float(motion.link(body).angle[i])) - x) / (2 * mp.pi)
            )
        here: list[tuple[Any, tuple[Any, ...]]] = []
        toothed: tuple[Gear | Belt, ...] = (*m.gears, *m.belts)
        for part in toothed:
            (a, b), r = part.links, ratio(part)
            here.append((angle[b] - r * angle[a] + (r - 1) * angle[part.arm], (1, r, r - 1)))
        for rack, i in zip(m.racks, slides, strict=True):
            r = mp.mpf(rack.radius)
            here.append((exact(Slide(i, 0)) - r * (angle[rack.gear] - angle[m.guides[i].on]), (r,)))
        first = first or [value for value, _ in here]
        every.append(
            [own + _turns(value - own, shares) for own, (value, shares) in zip(first, here, strict=True)]
        )
    return every


def _turns(apart: Any, shares: tuple[Any, ...]) -> Any:
    """The whole turns of angles, by their shares, that a difference is; what is left is an error."""
    counts = product(range(-3, 4), repeat=len(shares))
    turns = (2 * mp.pi * sum(k * share for k, share in zip(each, shares, strict=True)) for each in counts)
    return min(turns, key=lambda turn: abs(apart - turn))


def answers(seed: int, poses: int = POSES) -> Iterator[Answer]:
    """Every number of a random mechanism at some poses beside its guess."""
    rng = np.random.default_rng([26, seed])
    t = generate(seed, toothed=bool(rng.random() < 0.4))
    if regularity(t) < 1e-6:
        return
    try:
        m = under_loads(t, rng)
        motion = _motion(m, rng, poses)
    except MechanismError:
        return
    here = np.flatnonzero(motion.assembled)
    keys = _keys(motion)
    engine = os.environ.get("DALEMBERT_ENGINE")
    os.environ["DALEMBERT_ENGINE"] = str(rng.choice(["numpy", "llvm", "python"]))
    try:
        values = motion.values(keys)
        motion.rounding.together(keys)
        estimates = [motion.rounding.of(key) for key in keys]
    finally:
        del os.environ["DALEMBERT_ENGINE"]
        if engine is not None:
            os.environ["DALEMBERT_ENGINE"] = engine
    with mp.workdps(DIGITS):
        constants = constants_of(motion)
    for i, own in zip(here, constants, strict=True):
        try:
            exact = Exact(motion, int(i), constants=own)
        except ValueError:
            return
        if not exact.closed:
            continue
        forces = exact.forces()
        with mp.workdps(DIGITS):
            for key, value, estimate in zip(keys, values, estimates, strict=True):
                true = _true(exact, forces, key)
                if true is None or mp.isnan(true) or not np.isfinite(value[i]):
                    continue
                answer = mp.mpmathify(value[i].item())
                if isinstance(key, JointForce) and key.joint.startswith("guide"):
                    # across the guide; along it the teeth of a rack push
                    g = m.guides[int(key.joint.partition(":")[2])]
                    answer = mp.im(answer * mp.conj(along(g.angle) * exact.turn(g.on, 0)[0]))
                apart = true - answer
                if key.is_angle:
                    apart -= 2 * mp.pi * mp.nint(apart / (2 * mp.pi))
                error = float(abs(apart)) if abs(apart) > NOTHING * (1 + abs(true)) else 0.0
                yield Answer(str(key), error, float(estimate[i]), seed, int(i))


def _motion(m: Mechanism, rng: Generator, poses: int) -> Motion:
    """Poses about the guess, near and far, at random rates."""
    k = len(m.inputs)
    off = rng.choice([-1, 1], (poses, k)) * 10.0 ** rng.uniform(*OFF, (poses, k))
    q = np.array(m.at) + off * [0.3 if e.is_slide else 1.0 for e in m.inputs]
    speed, acceleration = rng.normal(size=(2, poses, k))
    if k == 1 and rng.random() < 0.4:
        ends = [end for end in m.assembly.reach.range if math.isfinite(end)]
        if ends:
            end = float(rng.choice(ends))
            side = 1.0 if end < m.at[0] else -1.0
            q = end + side * 10.0 ** rng.uniform(*BESIDE, (poses, 1))
    if k == 1:
        return m.motion(q[:, 0], speed[:, 0], acceleration[:, 0])
    return m.motion(q, speed, acceleration)


def _trial(rng: Generator) -> Pairs:
    return [(one.error, one.estimate) for one in answers(int(rng.integers(1 << 31)))]


CAMPAIGNS = {
    "loaded mechanisms of any topology": (
        "twelve poses, every engine: places, rates, efforts and joint forces under weights, springs, dampers",
        _trial,
    ),
}
