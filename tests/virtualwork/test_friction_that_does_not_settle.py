"""Friction and the forces it changes, where exchanging one for the other diverges though the mechanism moves."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from tests.virtualwork.released import G
from virtualwork import Friction, Guess, Input, Link, Mechanism
from virtualwork.formulas.friction import balanced


def rocker_driven(seed: int) -> tuple[Mechanism, float, np.random.Generator]:
    """A four-bar in either assembly with friction in some pins, driven by its rocker, and the rocker's speed."""
    rng = np.random.default_rng(seed)
    while True:
        crank, coupler, rocker = rng.uniform([0.05, 0.2, 0.15], [0.2, 0.5, 0.4])
        ground, turned = rng.uniform(0.3, 0.5), rng.uniform(-math.pi, math.pi)
        first = cmath.rect(crank, turned)
        apart = ground - first
        along = (coupler**2 - rocker**2 + abs(apart) ** 2) / (2 * abs(apart))
        if coupler**2 > along**2:
            break
    above = rng.choice([-1, 1]) * math.sqrt(coupler**2 - along**2)
    second = first + apart / abs(apart) * complex(along, above)
    at = cmath.phase(second - ground)
    links = {}
    for (name, ends), length in zip(
        {"crank": "AB", "coupler": "BC", "rocker": "DC"}.items(), (crank, coupler, rocker), strict=True
    ):
        mass = rng.uniform(0.1, 3)
        points = {ends[0]: 0j, ends[1]: complex(length)}
        links[name] = Link(points, mass=mass, center=complex(length / 2), inertia=mass * length**2 / 12)
    pins = rng.choice(list("ABCD"), rng.integers(1, 5), replace=False)
    friction = [Friction(str(pin), rng.uniform(0.05, 1), 10 ** rng.uniform(-3, -1.3)) for pin in pins]
    speed = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1.5))
    m = Mechanism(
        {"A": 0j, "D": complex(ground)},
        links,
        inputs=Input(link="rocker", value=at),
        guess=Guess(at, {"crank": turned, "coupler": cmath.phase(second - first)}),
        gravity=-1j * G,
        friction=friction,
    )
    return m, speed, rng


def judged(seed: int) -> tuple[int, int]:
    """How many poses move and how many lock; where they move, friction takes μ r |R| of every turn: virtual work."""
    m, speed, _ = rocker_driven(seed)
    low, high = m.check.input_limits or (-math.pi, math.pi)
    motion = m.motion(np.linspace(low, high, 42)[1:-1], speed=speed, acceleration=0.0)
    smooth = m.changed({f"friction.{i + 1}.coefficient": 0.0 for i in range(len(m.friction))})
    free = smooth.motion(motion.inputs[:, 0], speed=speed, acceleration=0.0)
    moves = np.isfinite(motion.effort)
    lost = np.zeros(len(moves))
    for pin in m.friction:
        bodies = [name for name, link in m.links.items() if pin.joint in link.points]
        rates = [motion.link(name).omega for name in bodies]
        turning = rates[0] - (rates[1] if len(rates) > 1 else 0.0)
        force = np.linalg.norm(motion.reaction(pin.joint, on=bodies[0]), axis=1)
        lost += pin.coefficient * pin.radius * force * np.abs(turning)
    work = (motion.effort - free.effort) * speed
    size = np.abs(motion.effort * speed) + np.abs(free.effort * speed) + lost
    assert (np.abs(work - lost)[moves] <= 1e-10 * size[moves]).all()
    return int(moves.sum()), int((motion.assembled & ~moves).sum())


@pytest.mark.parametrize(("seed", "moving"), [(7, 40), (34, 31)])
def test_friction_fits_its_forces_beside_the_limits(seed: int, moving: int) -> None:
    """One pose and ten of forty that move were said to lock."""
    assert judged(seed)[0] == moving


def test_the_simplest() -> None:
    """φ = −a·|1 + b·φ| by hand: with b > 0 friction unloads its joint, which moves whatever a b is; with b < 0 it locks from a b = −1 on."""
    for a in (0.3, 1.0, 5.0, 100.0):
        for b in (0.5, 1.0, 7.0):
            for sense in (1.0, -1.0):
                phi = balanced(np.array([sense * a]), np.array([1 + 0j]), np.array([[sense * b + 0j]]))
                assert phi == pytest.approx([-sense * a / (1 + a * b)], rel=1e-14)
                locks = balanced(np.array([sense * a]), np.array([1 + 0j]), np.array([[-sense * b + 0j]]))
                assert (locks is None) == (a * b >= 1)
                assert locks is None or locks == pytest.approx([-sense * a / (1 - a * b)], rel=1e-14)
    assert balanced(np.array([0.0]), np.array([2 + 1j]), np.array([[3 + 0j]])) == pytest.approx([0.0])


def test_the_digits_of_what_does_not_settle() -> None:
    m, speed, _ = rocker_driven(34)
    low, high = m.check.input_limits or (-math.pi, math.pi)
    motion = m.motion(np.linspace(low, high, 42)[1:-1], speed=speed, acceleration=0.0)
    estimate, there = motion.error_estimates("effort")["effort"], np.isfinite(motion.effort)
    assert (estimate[there] < 1e-9 * np.abs(motion.effort[there])).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_friction_fits_its_forces_at_random(seed: int) -> None:
    judged(seed)


def test_what_locks_has_no_forces() -> None:
    """Neither by virtual work nor by Newton and Euler, nor the moment of a pin that rubs."""
    m, speed, _ = rocker_driven(34)
    low, high = m.check.input_limits or (-math.pi, math.pi)
    motion = m.motion([low + (high - low) / 41], speed=speed, acceleration=0.0)
    of = motion.dynamics
    assert of.locked.tolist() == [True]
    joint = next(j for j in of.reactions.joints if j.name == m.friction[0].joint)
    moments = [of.joint_moment(joint, body) for body in joint.bodies]
    assert np.isnan([of.effort[0], of.newton_euler[0], *moments]).all()
