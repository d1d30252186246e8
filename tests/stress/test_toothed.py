"""Mechanisms of any topology with belts and racks: positions, rates and joint forces against 50 digits."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from benchmarks.stress.topologies import generate
from benchmarks.truth.mechanism import Exact
from virtualwork import GROUND, Mechanism, MechanismError

NEAR = 1e-8


def loaded(m: Mechanism, rng: np.random.Generator) -> Mechanism:
    """The same mechanism with masses and weight."""
    links = {
        name: replace(
            link, mass=rng.uniform(0, 2), center=complex(*rng.normal(size=2)), inertia=rng.uniform(0, 1)
        )
        for name, link in m.links.items()
    }
    parts = {f.name: getattr(m, f.name) for f in fields(m)}
    return Mechanism(**{**parts, "links": links, "gravity": complex(*rng.normal(size=2))})


def verdict(seed: int) -> str:
    """What becomes of a random mechanism: "agrees", or why it is not compared.

    Not compared are refused ones, poses near a singular one, redundant constraints (the oracle has none), and angles that
    are whole turns from those of the guess, which fractional gears and racks count and the oracle does not.
    """
    t = generate(seed, toothed=True)
    rng = np.random.default_rng([41, seed])
    try:
        m = loaded(t.mechanism, rng)
        inputs = np.array([t.inputs]) + 0.01
        motion = m.motion(inputs if len(m.inputs) > 1 else inputs[:, 0])
        if not motion.assembled[0] or not motion.condition[0] < 100:
            return "singular"
    except MechanismError:
        return "refused"
    try:
        exact = Exact(motion)
    except ValueError:
        return "redundant"
    if not exact.closed:
        return "singular"
    for name in m.links:
        link = motion.link(name)
        if abs(np.exp(1j * float(exact.angle(name, 0))) - np.exp(1j * link.angle[0])) > NEAR:
            return "turns"
        for order, value in enumerate((link.omega, link.alpha), 1):
            assert abs(float(exact.angle(name, order)) - value[0]) < NEAR * (1 + abs(value[0])), (name, order)
    true, d = exact.forces(), motion.dynamics
    size = max(float(abs(v)) for v in [*exact.generalized_loads(), *true.values()])
    for j in range(len(m.inputs)):
        wanted = float(true["input", str(j), 0])
        assert abs(d.effort[0, j] - wanted) < NEAR * size
        assert abs(d.newton_euler[0, j] - wanted) < NEAR * size
    for joint in d.reactions.joints:
        if joint.guide is None:
            for body in joint.bodies[1:]:
                value = complex(true[joint.key, body, 0], true[joint.key, body, 1])
                assert abs(d.joint_force(joint, body)[0] - value) < NEAR * size, (joint.name, body)
            continue
        g = m.guides[joint.guide]
        rail = np.exp(1j * (g.angle + (0 if g.on == GROUND else motion.link(g.on).angle[0])))
        sign = -1.0 if g.link == GROUND else 1.0
        body = g.on if g.link == GROUND else g.link
        across = sign * (d.joint_force(joint, body)[0] * rail.conjugate()).imag
        assert abs(across - float(true[joint.key, g.link, 1])) < NEAR * size, joint.name
        if g.is_slider:
            moment = sign * d.joint_moment(joint, body)[0]
            assert abs(moment - float(true[f"moment:{joint.guide}", g.link, 0])) < NEAR * size, joint.name
    return "agrees"


def test_some_agree_with_fifty_digits() -> None:
    found = [verdict(seed) for seed in range(12)]
    assert found.count("agrees") > 5, found


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_belts_and_racks_anywhere(seed: int) -> None:
    verdict(seed)
