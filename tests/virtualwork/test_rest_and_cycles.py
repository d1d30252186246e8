"""Positions of rest, cycles, flywheels and counterweights, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.virtualwork.mechanisms import SWEEP, berkof_lowen, four_bar, slider_crank
from virtualwork import Force, Guess, Guide, Input, Link, Mechanism, Spring, Torque
from virtualwork.describe import DescriptionError
from virtualwork.study.counterweights import least_squares
from virtualwork.study.cycle import Cycle

# -- equilibrium ------------------------------------------------------------------------------------------------


def test_equilibrium_of_two_bars() -> None:
    """Hibbeler and Gupta, ex. 11.1: two bars of 10 kg and 1 m, 25 N at the sliding end: 98.1 cos θ = 50 sin θ."""
    m = Mechanism(
        ground={"A": 0j},
        links={
            "left": Link({"A": 0j, "B": 1}, 10, 0.5),
            "right": Link({"B": 0j, "C": 1}, 10, 0.5),
            "shoe": Link({"C": 0j}),
        },
        guides=[Guide("C", "shoe", turned=0.0)],
        inputs=Input(link="left"),
        guess=Guess(at=(1.0,), angles={"right": -1.0}),
        gravity=-9.81j,
        forces=[Force("shoe", 0j, -25.0)],
    )
    found = m.equilibria([[0.2, 1.5]])
    assert [e.inputs[0] for e in found.found] == pytest.approx([math.atan2(98.1, 50.0)], rel=1e-14)
    (e,) = found.found
    theta = e.inputs[0]
    assert e.stable is False
    assert e.potential == pytest.approx(98.1 * math.sin(theta) + 50 * math.cos(theta), rel=1e-14)
    assert e.stiffness == pytest.approx(-98.1 * math.sin(theta) - 50 * math.cos(theta), rel=1e-12)


def test_all_equilibria_of_a_spring_pendulum() -> None:
    """V = m g l sin θ + ½ k (s − s₀)²; roots by a dense exact scan, stability by the exact second derivative."""
    l, h, k, s0, mg = 0.5, 0.8, 60.0, 0.3, 20.0
    m = Mechanism(
        {"O": 0j, "T": h * 1j}, {"bar": Link({"O": 0j, "P": l}, mass=mg / 9.81, center=l)}, inputs=Input(link="bar"),
        gravity=-9.81j, springs=[Spring((("bar", l + 0j), ("ground", h * 1j)), k, s0)],
    )  # fmt: skip

    def slope(theta: Any) -> Any:
        s = np.sqrt(l * l + h * h - 2 * l * h * np.sin(theta))
        return mg * l * np.cos(theta) - k * (s - s0) * l * h * np.cos(theta) / s

    # cos θ = 0, or m g = k h (1 − s₀/s)
    s = s0 / (1 - mg / (k * h))
    side = math.asin((l * l + h * h - s * s) / (2 * l * h))
    exact = sorted(x % (2 * math.pi) for x in (math.pi / 2, 3 * math.pi / 2, side, math.pi - side))
    found = m.equilibria().found
    assert [e.inputs[0] for e in found] == pytest.approx(exact, rel=1e-12)
    for e in found:
        step = 1e-5
        bend = (slope(e.inputs[0] + step) - slope(e.inputs[0] - step)) / (2 * step)
        assert e.stable is bool(bend > 0)
        assert e.stiffness == pytest.approx(bend, rel=1e-7)


def test_equilibrium_everywhere() -> None:
    """A spring of no free length with k·a·h = m g l holds a bar at every angle."""
    m = Mechanism(
        {"O": 0j}, {"bar": Link({"O": 0j}, mass=2.0, center=0.3)}, inputs=Input(link="bar"), gravity=-9.81j,
        springs=[Spring((("bar", 0.1 + 0j), ("ground", 0.2j)), 2.0 * 9.81 * 0.3 / (0.1 * 0.2))],
    )  # fmt: skip
    assert m.equilibria().everywhere
    assert four_bar().equilibria().everywhere  # no load at all


def test_equilibria_of_a_double_pendulum() -> None:
    m = Mechanism(
        {"O": 0j},
        {"upper": Link({"O": 0j, "E": 1}, 1.0, 0.5), "lower": Link({"E": 0j}, 1.0, 0.4)},
        inputs=(Input(link="upper"), Input(link="lower")),
        gravity=-9.81j,
    )
    found = {tuple(round(math.degrees(v)) for v in e.inputs): e for e in m.equilibria().found}
    assert {key: e.stable for key, e in found.items()} == {
        (90, 90): False, (90, 270): False, (270, 90): False, (270, 270): True,
    }  # fmt: skip
    assert found[270, 270].stiffness == pytest.approx(0.4 * 9.81, rel=1e-10)
    assert found[270, 270].potential == pytest.approx(-9.81 * (0.5 + 1.0 + 0.4), rel=1e-14)


# -- cycle and flywheel -------------------------------------------------------------------------------------------


def test_energy_closes_over_a_cycle() -> None:
    m = four_bar(
        gravity=-9.81j,
        torques=[Torque("rocker", -3.0)],
        springs=[Spring((("coupler", 0.06 + 0j), ("ground", 0.1 + 0.2j)), 80.0, 0.1, 4.0)],
    )
    motion = m.motion(SWEEP, 12.0)
    c = Cycle(motion)
    # the rocker's torque and the spring give nothing over a turn; the damper takes what the input puts in
    assert c.closure is not None
    assert abs(c.closure) <= 1e-12 * np.abs(motion.effort).max() * 2 * np.pi
    assert c.work > 0
    part = Cycle(m.motion(np.linspace(0.3, 2.0, 200), 12.0))
    assert part.closure is not None
    assert abs(part.closure) <= 1e-8 * np.abs(part.effort).max()


def test_flywheel_of_a_sinusoidal_torque() -> None:
    """τ = −m g l cos θ and a mean of zero: ΔE = 2 m g l, so I = ΔE/(C ω²)."""
    m = Mechanism(
        {"O": 0j}, {"arm": Link({"O": 0j}, mass=2.0, center=0.5)}, inputs=Input(link="arm"), gravity=-9.81j
    )
    c = Cycle(m.motion(np.linspace(0, 2 * np.pi, 181), 10.0))
    energy = 2 * 2.0 * 9.81 * 0.5
    assert c.fluctuation == pytest.approx(energy, rel=1e-7)
    assert c.flywheel(0.02) == pytest.approx(energy / (0.02 * 100), rel=1e-7)
    assert abs(c.mean) <= 1e-14 * energy
    assert c.peak == pytest.approx(energy / 2, rel=1e-14)
    assert c.rms == pytest.approx(energy / 2 / math.sqrt(2), rel=1e-14)
    with pytest.raises(ValueError, match="speed"):
        Cycle(m.motion(np.linspace(0, 2 * np.pi, 181))).flywheel(0.02)


# -- counterweights ------------------------------------------------------------------------------------------------


def test_berkof_and_lowen_balance_a_four_bar_completely() -> None:
    m = four_bar()
    exact = berkof_lowen(m, "crank", "coupler", "rocker")
    weights, before, after = least_squares(m.motion(SWEEP, 30.0), ["crank", "rocker"])
    for link, weight in exact.items():
        assert weights[link] == pytest.approx(weight, rel=1e-12)
    assert np.abs(after).max() <= 1e-13 * np.abs(before).max()
    # and with the weights made real, 0.1 kg each at the radius they need, the ground feels no force
    links = {
        name: Link(
            link.points,
            link.mass + (0.1 if name in exact else 0),
            (link.mass * link.center + exact[name]) / (link.mass + 0.1) if name in exact else link.center,
            link.inertia,
        )
        for name, link in m.links.items()
    }
    balanced = Mechanism(m.ground, links, inputs=m.inputs, guess=m.guess)
    force, _ = balanced.motion(SWEEP, 30.0).dynamics.shaking
    assert np.abs(force).max() <= 1e-13 * np.abs(before).max()


def test_partial_balance_of_a_slider_crank() -> None:
    """A counterweight on the crank cannot balance the piston: the best leaves less, and no other does better."""
    m = slider_crank(piston={"mass": 1.0})
    motion = m.motion(SWEEP[:-1], 10.0)
    weights, before, after = least_squares(motion, ["crank"])
    best = np.sum(np.abs(after) ** 2)
    assert best < np.sum(np.abs(before) ** 2)
    turn = -motion.at("crank", 1.0 + 0j).complex(2)
    for step in (1e-3, -1e-3, 1e-3j, -1e-3j):
        assert np.sum(np.abs(before + (weights["crank"] + step) * turn) ** 2) > best
    with pytest.raises(DescriptionError, match="does not turn about a pin of the ground"):
        least_squares(motion, ["rod"])
