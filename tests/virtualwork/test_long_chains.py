"""Chains of many links: no call nests as deep as the chain is long, and twice as many links are twice the work."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from benchmarks import scenes
from virtualwork import Input, Link, Mechanism
from virtualwork.formulas.forces import JointForce
from virtualwork.plan.steps import joints

G = 9.81


def chain(n: int) -> Mechanism:
    """n bars of 1 m and 1 kg, each driven against the ground; the next hangs on its end."""
    links = {f"l{i}": Link({f"P{i}": 0j, f"P{i + 1}": 1 + 0j}, 1.0, 0.5) for i in range(n)}
    return Mechanism({"P0": 0j}, links, inputs=tuple(Input(link=name) for name in links), gravity=-G * 1j)


@contextmanager
def shallow(calls: int) -> Iterator[None]:
    """Few calls may nest."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack()) + calls)
    try:
        yield
    finally:
        sys.setrecursionlimit(before)


@pytest.mark.parametrize(("n", "calls"), [(150, 200), pytest.param(300, 200, marks=pytest.mark.slow)])
def test_positions_and_forces_of_a_chain(n: int, calls: int) -> None:
    angles = 0.01 * np.arange(n)
    with shallow(calls):
        motion = chain(n).motion(angles[None])
        end = motion.point(f"P{n}").position[0]
        effort = motion.effort[0]
        by_forces = motion.dynamics.newton_euler[0]
    assert complex(*end) == pytest.approx(np.exp(1j * angles).sum(), rel=1e-13)
    # each bar carries its own weight at its middle and the later ones at its end
    exact = G * np.cos(angles) * (0.5 + np.arange(n)[::-1])
    assert effort == pytest.approx(exact, rel=1e-12, abs=1e-12 * G * n)
    assert by_forces == pytest.approx(exact, rel=1e-11, abs=1e-11 * G * n)


def loaded(bars: int) -> Mechanism:
    """Four-bars one behind the other, every link heavy."""
    of = scenes.chain(bars)
    links = {name: Link(dict(link.points), 1.0, 0.01, 0.1) for name, link in of.links.items()}
    return Mechanism(of.ground, links, inputs=of.inputs, guess=of.guess, gravity=-G * 1j)


def calls_of_all_joint_forces(bars: int) -> int:
    """How many functions are called for the joint forces of a new mechanism, from the first request on."""
    motion = loaded(bars).motion(np.linspace(0.6, 0.8, 5), speed=1.0)
    motion.point("C0").position  # noqa: B018
    keys = [JointForce(joint.key, body) for joint in joints(motion.mechanism) for body in joint.bodies]
    count = 0

    def counted(*_: object) -> None:
        nonlocal count
        count += 1

    sys.setprofile(counted)
    try:
        motion.values(keys)
    finally:
        sys.setprofile(None)
    return count


def test_twice_as_long_a_chain_is_twice_the_work() -> None:
    calls_of_all_joint_forces(2)
    short, long = calls_of_all_joint_forces(8), calls_of_all_joint_forces(16)
    assert long < 2.2 * short
