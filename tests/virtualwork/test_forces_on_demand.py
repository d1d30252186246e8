"""Forces on demand: what is formed once, long chains, many blocks, and what is given back."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.virtualwork.mechanisms import SWEEP, four_bar
from virtualwork import Guess, Input, Link, Mechanism, Motor
from virtualwork.formulas.loaded_pose import LoadedPose


def test_what_is_formed_for_one_joint_force_serves_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop's forces are written down once, however the joint forces are asked for; of one pose they are formed once."""
    from virtualwork.formulas.load_paths import LoopForces

    count = 0
    solve = LoopForces.form

    def counted(self: LoopForces, pose: LoadedPose) -> Any:
        nonlocal count
        count += 1
        return solve(self, pose)

    monkeypatch.setattr(LoopForces, "form", counted)
    sweep = np.linspace(0.0, 6.0, 20_000)  # three blocks
    m = four_bar(gravity=-9.81j)
    motion = m.motion(sweep, 10.0)
    one_by_one = [motion.reaction(pin, on) for pin, on in (("A", "crank"), ("B", "coupler"), ("D", "rocker"))]
    assert count == 1
    one = m.motion(float(sweep[7]), 10.0).dynamics
    for pin, on, alone in zip("ABD", ("crank", "coupler", "rocker"), one_by_one, strict=True):
        assert np.abs(one.reaction(pin, on)[0] - alone[7]).max() <= 1e-14 * np.abs(alone).max()
    assert count == 2


@pytest.mark.slow
def test_a_long_chain_has_joint_forces() -> None:
    """Sixty four-bars in a row: each passes on what the next ones bear on it, however deep that goes."""
    ground = {"A": 0j} | {f"D{i}": 0.1 * (i + 1) + 0j for i in range(60)}
    links = {"crank": Link({"A": 0j, "B": 0.04}, 1.0, 0.02, 1e-3)}
    angles, before = {}, "B"
    for i in range(60):
        links[f"coupler{i}"] = Link({before: 0j, f"C{i}": 0.12 if i == 0 else 0.1}, 1.0, 0.05, 1e-3)
        links[f"rocker{i}"] = Link({f"D{i}": 0j, f"C{i}": 0.08}, 1.0, 0.03, 1e-3)
        angles |= {f"coupler{i}": 0.3 if i == 0 else 0.0, f"rocker{i}": 1.0}
        before = f"C{i}"
    m = Mechanism(
        ground, links, inputs=Input(link="crank"), guess=Guess(at=(0.7,), angles=angles), gravity=-9.81j
    )
    motion = m.motion(np.linspace(0.0, 6.0, 7), 10.0)
    gap = np.abs(motion.dynamics.newton_euler[:, 0] - motion.effort).max()
    assert gap <= 1e-14 * np.abs(motion.effort).max() * 60
    force, _ = motion.dynamics.shaking
    feet = [("A", "crank"), *((f"D{i}", f"rocker{i}") for i in range(60))]
    on_ground = -sum(motion.reaction(pin, link) for pin, link in feet)
    assert np.abs(on_ground - force).max() <= 1e-13 * np.abs(force).max() * 60


def test_the_forces_of_a_motion_go_with_it() -> None:
    """No ring of references: the arrays are given back at once, not when the garbage collector comes."""
    motion = four_bar(gravity=-9.81j).motion(SWEEP, 10.0)
    motion.reaction("A", on="crank")
    dynamics = weakref.ref(motion.dynamics)
    alone = motion.dynamics
    gc.disable()
    try:
        del motion
        assert np.isfinite(alone.newton_euler).all()  # the forces need only the solution, which they hold
        del alone
        assert dynamics() is None
    finally:
        gc.enable()


def test_a_motor_on_another_link_over_many_blocks() -> None:
    """What a carried motor does to its carrier is known before the blocks are solved one after the other."""
    m = replace(four_bar(gravity=-9.81j), motors=[Motor("rocker", "crank")])
    q = np.linspace(0.0, 6.0, 10_000)
    motion, few = m.motion(q, 3.0), m.motion(q[::999], 3.0)
    for pin, on in (("A", "crank"), ("D", "rocker")):
        force = motion.reaction(pin, on)
        assert np.abs(force[::999] - few.reaction(pin, on)).max() <= 1e-13 * np.abs(force).max()
    gap = np.abs(motion.dynamics.newton_euler - motion.dynamics.effort).max()
    assert gap <= 1e-13 * np.abs(motion.dynamics.effort).max()
