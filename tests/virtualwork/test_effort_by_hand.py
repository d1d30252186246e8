"""The effort through motors on moving carriers, at springs named from either end, and what a scene does not have."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import Gear, Guess, Input, Link, Mechanism, Motor, Spring, Torque, TorsionSpring
from virtualwork.study.ledger import ledger

G = 9.81


@pytest.mark.parametrize("ratio", [-0.5, 0.25])
def test_a_motor_whose_carrier_turns_with_a_gear(ratio: float) -> None:
    """The motor turns the arm against a wheel geared to it: T (1 − ratio) = m g l cos θ by the work of a turn dθ."""
    m = Mechanism(
        {"O": 0j, "W": -1},
        {"arm": Link({"O": 0j}, 2.0, 0.5), "wheel": Link({"W": 0j})},
        gears=[Gear(("arm", "wheel"), ratio)],
        inputs=Input(link="arm"),
        motors=[Motor("wheel", "arm")],
        gravity=-G * 1j,
    )
    theta = np.array([0.3, 1.0, 4.0])
    motion = m.motion(theta)
    exact = 2 * G * 0.5 * np.cos(theta) / (1 - ratio)
    assert motion.effort == pytest.approx(exact, rel=1e-14)
    assert motion.dynamics.newton_euler[:, 0] == pytest.approx(exact, rel=1e-13)


def test_a_motor_on_a_coupler_and_poses_out_of_reach() -> None:
    """Five bars, one motor carried by a coupler: the power of torques and load vanishes for every pair of speeds."""
    m = Mechanism(
        {"A": (0, 0), "E": (4, 0)},
        {"left": Link({"A": (0, 0), "B": (2, 0)}), "up": Link({"B": (0, 0), "C": (3, 0)}),
         "down": Link({"D": (0, 0), "C": (3, 0)}), "right": Link({"E": (0, 0), "D": (2, 0)})},
        inputs=[Input(link="left"), Input(link="right")],
        guess=Guess((2.0, 1.0), points={"C": (2, 4)}),
        motors=[Motor("up", "left")],
        torques=[Torque("down", 7.0), Torque("up", -2.0)],
    )  # fmt: skip
    q = np.array([[2.0, 1.0], [math.pi, 0.0], [1.9, 1.2]])  # BD = 8 > 6 in the second
    motion = m.motion(q)
    assert motion.assembled.tolist() == [True, False, True]
    torque = motion.dynamics.effort
    assert np.isnan(torque[1]).all()
    for speeds in ([1.0, 0.0], [0.3, -2.0]):
        moving = m.motion(q, speed=speeds)
        w = {name: moving.link(name).omega for name in m.links}
        driven = torque[:, 0] * (w["left"] - w["up"]) + torque[:, 1] * w["right"]
        load = 7 * w["down"] - 2 * w["up"]
        assert driven[[0, 2]] == pytest.approx(-load[[0, 2]], rel=1e-12)


@pytest.mark.parametrize("swap", [False, True])
def test_springs_may_be_named_from_either_end(swap: bool) -> None:
    """A pendulum on a spring to the ground and a torsion spring: τ = k (s − s₀) ds/dθ + k_t (θ − θ₀)."""
    k, s0, kt, free, h = 50.0, 0.2, 3.0, 0.4, 1.5
    ends = ("ground", h * 1j), ("bar", 1.0 + 0j)
    m = Mechanism(
        {"O": 0j},
        {"bar": Link({"O": 0j})},
        inputs=Input(link="bar"),
        springs=[Spring(ends[::-1] if swap else ends, k, s0)],
        torsion_springs=[
            TorsionSpring(("bar", "ground"), kt, -free)
            if swap
            else TorsionSpring(("ground", "bar"), kt, free)
        ],
    )
    theta = np.array([0.3, 1.0, 2.0])
    s = np.sqrt(1 + h * h - 2 * h * np.sin(theta))
    exact = -k * (s - s0) * h * np.cos(theta) / s + kt * (theta - free)
    motion = m.motion(theta)
    assert motion.effort == pytest.approx(exact, rel=1e-13)
    works, workless, absent = ledger(motion.dynamics)
    assert sum(works.values()) == pytest.approx(-exact, rel=1e-13)
    assert workless == []
    assert absent == [
        "bar: no weight and no inertia force, for there is no mass",
        "no weights: gravity is zero",
        "no inertia loads, no damping, no friction: speed and acceleration are zero",
        "no applied forces in the file",
        "no applied torques in the file",
    ]


def test_a_torsion_spring_between_two_arms() -> None:
    """Two arms on one another, each driven against the ground: the spring's torque goes through both, one each way."""
    for links, free in ((("upper", "lower"), 0.1), (("lower", "upper"), -0.1)):
        m = Mechanism(
            {"O": 0j},
            {"upper": Link({"O": 0j, "E": 1}, 2.0, 0.5), "lower": Link({"E": 0j}, 0.0, 0j, 0.3)},
            inputs=(Input(link="upper"), Input(link="lower")),
            torsion_springs=[TorsionSpring(links, 5.0, free, 0.7)],
            gravity=-G * 1j,
        )
        motion = m.motion(np.array([[0.2, 0.9]]), speed=[1.0, 3.0])
        spring = 5.0 * (0.7 - 0.1) + 0.7 * 2.0  # pulls the lower arm back and the upper one on
        weight = 2 * G * 0.5 * math.cos(0.2)
        assert motion.dynamics.effort[0] == pytest.approx([weight - spring, spring], rel=1e-14)
        assert motion.dynamics.newton_euler[0] == pytest.approx([weight - spring, spring], rel=1e-14)
        _, _, absent = ledger(motion.dynamics)
        assert absent[0] == "lower: no weight and no inertia force, for there is no mass"
        assert absent[1] == "upper: no inertia torque, for there is no inertia"
        assert "no weights: gravity is zero" not in absent


@pytest.mark.parametrize("gravity", [complex(G), complex(-G)])
def test_nothing_is_not_minus_nothing(gravity: complex) -> None:
    """Gravity along the bar: the weight acts, its point moves, and its work is zero, whose sign is never shown."""
    m = Mechanism({"O": 0j}, {"bar": Link({"O": 0j}, 1.0, 0.5)}, inputs=Input(link="bar"), gravity=gravity)
    effort = m.motion(np.array([0.0, 0.0])).effort
    assert np.array_equal(effort, [0.0, 0.0])
    assert not np.signbit(effort).any()


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_a_motor_whose_carrier_turns_with_what_it_drives_does_no_work(mirrored: float) -> None:
    """Crank and rocker of a parallelogram turn alike: rounding must not make an effort of the difference."""
    away, arm = complex(0.1, 0.03 * mirrored), complex(0.037, 0.011 * mirrored)
    m = Mechanism(
        {"A": 0j, "D": away},
        {
            "crank": Link({"A": 0j, "B": arm}, 1.0, 0.02),
            "coupler": Link({"B": 0j, "C": away}, 1.0, 0.05),
            "rocker": Link({"D": 0j, "C": arm}, 1.0, 0.02),
        },
        inputs=Input("crank", speed=10.0),
        guess=Guess(0.5, {"coupler": 0.0, "rocker": 0.5}),
        gravity=-9.81j,
        motors=[Motor("rocker", "crank", 0.5, 0.005)],
    )
    for poses in (0.3, np.linspace(-1.2, 1.3, 41)):
        assert not np.isfinite(m.motion(poses).effort).any()
