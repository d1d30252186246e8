"""Motion under forces with Coulomb friction: sliding, sticking, breaking away."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.truth.bodies_in_time import Bodies
from tests.virtualwork.released import G, block, double_pendulum, four_bar
from virtualwork import Force, Friction, Input, Link, Mechanism, Spring, Torque


def test_block_that_slides_to_rest_and_stays() -> None:
    """μ g brakes 3 m/s: it stands after v/μg, v²/2μg away, and stays."""
    m = block(gravity=-1j * G, friction=[Friction("P", 0.2)])
    run = m.simulate([0, 1, 2, 5, 50], angle=0.0, speed=3.0)
    assert run.angle[-3:, 0] == pytest.approx([9 / (0.4 * G)] * 3, abs=1e-12)
    assert (run.speed[-3:, 0] == 0).all()
    assert (run.acceleration[-3:, 0] == 0).all()
    assert np.abs(run.energy_drift).max() < 1e-12
    assert run.fine.legs[0].end == pytest.approx(3 / (0.2 * G), rel=1e-13)


def test_spring_and_coulomb_friction_lose_the_same_at_every_turn() -> None:
    """ẍ = −100 x ∓ μ g: every half swing is 2 μ g/100 shorter, until it sticks inside the dead band."""
    band = 0.1 * G / 100
    m = block(
        gravity=-1j * G,
        friction=[Friction("P", 0.1)],
        springs=[Spring((("block", 0j), ("ground", 0j)), 100.0)],
    )
    run = m.simulate(np.linspace(0, 5, 501), angle=0.1)
    legs = [leg.last[1][0] for leg in run.fine.legs[:-1]]
    swings = [0.1]
    while abs(swings[-1]) > band:
        swings.append(-math.copysign(abs(swings[-1]) - 2 * band, swings[-1]))
    assert legs == pytest.approx(swings[1:], abs=1e-10)
    assert run.angle[-1, 0] == pytest.approx(swings[-1], abs=1e-10)
    assert run.speed[-1, 0] == 0


@pytest.mark.parametrize(("pull", "moves"), [(1.96, False), (1.97, True), (-1.97, True)])
def test_stiction_holds_up_to_its_limit(pull: float, moves: bool) -> None:
    m = block(gravity=-1j * G, friction=[Friction("P", 0.2)], forces=[Force("block", 0j, complex(pull))])
    run = m.simulate([0, 10], angle=0.0)
    assert bool(run.speed[-1, 0]) == moves
    if moves:
        assert run.speed[-1, 0] == pytest.approx(math.copysign(10 * (1.97 - 0.2 * G), pull), rel=1e-10)


def test_breaking_away_when_a_torque_has_grown() -> None:
    """A torque t on a wheel whose bearing carries 10 N at μ r = 0.1 m: it breaks away at 1 s, ω = (t − 1)²/2."""
    m = Mechanism(
        {"O": 0j},
        {"wheel": Link({"O": 0j}, mass=10 / G, inertia=1)},
        inputs=Input(link="wheel", value=0.0),
        gravity=-1j * G,
        friction=[Friction("O", 0.5, 0.2)],
        torques=[Torque("wheel", history=((0.0, 0.0), (10.0, 10.0)), over="time")],
    )
    run = m.simulate([0, 0.5, 1, 2, 3])
    assert np.allclose(run.angle[:, 0], [0, 0, 0, 1 / 6, 8 / 6], atol=1e-9)
    assert np.allclose(run.speed[:, 0], [0, 0, 0, 0.5, 2], atol=1e-9)


@pytest.mark.slow
def test_four_bar_with_friction_in_every_pin_against_the_poses_own() -> None:
    """The effort of every pose that moves, friction settled by iteration there, is none; at last it stands."""
    m = four_bar(friction=[Friction(j, 0.3, 0.02) for j in "ABCD"])
    run = m.simulate(np.linspace(0, 20, 101))
    moving = np.abs(run.speed[:, 0]) > 1e-6
    assert np.abs(run.motion.effort[moving]).max() < 1e-12
    assert run.speed[-1, 0] == 0
    assert not run.warnings
    assert np.abs(run.energy_drift).max() < 1e-8


@pytest.mark.slow
def test_double_pendulum_with_friction_comes_to_rest_one_joint_at_a_time() -> None:
    m = double_pendulum(friction=[Friction("O", 0.3, 0.1), Friction("P", 0.3, 0.1)])
    run = m.simulate(np.linspace(0, 60, 61), accuracy=1e-6)
    modes = [leg.equations.mode for leg in run.fine.legs]  # type: ignore[attr-defined]
    assert any(0 in mode and any(mode) for mode in modes)
    assert modes[-1] == (0, 0)
    assert (run.speed[-1] == 0).all()
    assert np.abs(run.energy_drift).max() < 1e-5


@pytest.mark.parametrize("speed", [0.5, -0.5, 0.05, -0.05])
@pytest.mark.parametrize("end", [1.6709640388852773, 2.498090777658394])
def test_a_start_close_to_a_limit_of_the_input(end: float, speed: float) -> None:
    """The rocker moves off near its dead point, where friction by far outweighs the inertia: every body's own coordinates agree."""
    m = four_bar("rocker", friction=[Friction(j, 0.3, 0.02) for j in "ABCD"])
    start = end + math.copysign(1e-4, 2.0 - end)
    run = m.simulate([0, 0.02, 0.05], angle=start, speed=speed, accuracy=1e-8)
    turned = Bodies(m).angles([start], [speed], run.t)["rocker"]
    error = np.abs(run.angle[:, 0] - run.angle[0, 0] - (turned - turned[0]))
    assert (error <= run.error_estimate[:, 0] + 1e-10).all()
    assert not run.warnings
