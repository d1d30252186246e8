"""Means, work and energy over sweeps that are no whole turn, no fine one, or none of the clock; counterweights alike."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.virtualwork.mechanisms import berkof_lowen
from virtualwork import (
    DescriptionError,
    Friction,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    Spring,
    Torque,
    TorsionSpring,
)
from virtualwork.study.counterweights import least_squares
from virtualwork.study.cycle import Cycle

G = 9.81


def arm(**loads) -> Mechanism:
    """2 kg at half a metre: m g l = 9.81 N·m."""
    return Mechanism(
        {"O": 0j}, {"arm": Link({"O": 0j}, 2.0, 0.5, 0.1)}, inputs=Input(link="arm"), gravity=-G * 1j, **loads
    )


def test_three_poses_are_summed_by_trapezoids() -> None:
    q = np.array([0.0, 0.5, 1.5])
    c = Cycle(arm().motion(q, 1.0))
    effort = G * np.cos(q)
    work = 0.5 * (effort[0] + effort[1]) / 2 + 1.0 * (effort[1] + effort[2]) / 2
    assert not c.whole
    assert c.span == 1.5
    assert c.work == pytest.approx(work, rel=1e-14)
    assert c.mean == pytest.approx(work / 1.5, rel=1e-14)
    assert c.peak == pytest.approx(G, rel=1e-14)
    square = 0.5 * (effort[0] ** 2 + effort[1] ** 2) / 2 + 1.0 * (effort[1] ** 2 + effort[2] ** 2) / 2
    assert c.rms == pytest.approx(math.sqrt(square / 1.5), rel=1e-14)


def test_a_part_of_a_turn_backwards() -> None:
    """From 1.2 to 0.2 the weight comes down: work m g l (sin 0.2 − sin 1.2), mean G (…)/(−1)."""
    c = Cycle(arm().motion(np.linspace(1.2, 0.2, 101), -3.0))
    work = G * (math.sin(0.2) - math.sin(1.2))
    assert c.work == pytest.approx(work, rel=1e-9)
    assert c.mean == pytest.approx(-work, rel=1e-9)
    kinetic, potential = c.energy
    # ½ (0.1 + 2·0.25)·9, and m g h
    assert kinetic == pytest.approx(np.full(101, 2.7), rel=1e-14)
    assert potential == pytest.approx(G * np.sin(c.input), rel=1e-13)
    assert c.closure == pytest.approx(0.0, abs=1e-8)
    # ∫ (τ − mean) is largest where m g l cos θ is its mean, and zero at both ends
    top = math.acos(c.mean / G)
    exact = G * (math.sin(top) - math.sin(0.2)) - c.mean * (top - 0.2)
    assert c.fluctuation == pytest.approx(exact, rel=1e-7)
    assert Cycle(arm().motion(np.linspace(0.2, 1.2, 101), 3.0)).fluctuation == pytest.approx(exact, rel=1e-7)


def test_two_turns_are_twice_one() -> None:
    m = arm(torques=[Torque("arm", -4.0)], torsion_springs=[TorsionSpring(("ground", "arm"), 0.0, 0.0, 0.5)])
    one, two = (Cycle(m.motion(np.linspace(0, 2 * np.pi * k, 180 * k + 1), 6.0)) for k in (1, 2))
    assert one.whole
    assert two.whole
    # the torque of 4 and the damper's 0.5·6 over each turn
    assert one.work == pytest.approx(7 * 2 * math.pi, rel=1e-13)
    assert two.work == pytest.approx(7 * 4 * math.pi, rel=1e-13)
    assert one.mean == pytest.approx(7.0, rel=1e-13)
    assert one.rms == pytest.approx(math.hypot(7, G / math.sqrt(2)), rel=1e-13)
    for c in (one, two):
        assert c.closure == pytest.approx(0.0, abs=1e-11)
        assert c.fluctuation == pytest.approx(2 * G, rel=1e-7)


def test_a_spring_stores_what_it_is_given() -> None:
    """Springs with dampers, a torsion spring with one and a rubbing pin over a part of a turn: the balance closes."""
    m = arm(
        springs=[
            Spring((("arm", 0.8 + 0j), ("ground", 1.0 + 1.0j)), 30.0, 0.2, 1.5),
            Spring((("ground", -1.0 + 0j), ("arm", 0.5j)), 20.0, 0.1, 2.5),
        ],
        torsion_springs=[TorsionSpring(("ground", "arm"), 4.0, 0.3, 0.2)],
        friction=[Friction("O", 0.1, 0.02)],
    )
    c = Cycle(m.motion(np.linspace(0.1, 1.4, 401), 2.0))
    assert abs(c.closure or 0.0) < 1e-8
    stretch = np.abs(0.8 * np.exp(1j * c.input) - (1 + 1j)) - 0.2
    other = np.abs(0.5j * np.exp(1j * c.input) + 1) - 0.1
    exact = 15 * stretch**2 + 10 * other**2 + 2 * (c.input - 0.3) ** 2 + G * np.sin(c.input)
    assert c.energy[1] == pytest.approx(exact, rel=1e-13)
    assert Cycle(m.motion(np.linspace(0.1, 1.4, 5), 2.0, 1.0)).closure is None


def test_a_stroke_of_a_slide_is_no_turn() -> None:
    """A block pushed 2π metres up a slope against its weight: whole turns are of angles alone."""
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"B": 0j}, 2.0)},
        [Guide("B", "block", "ground", "O", math.pi / 6, 0.0)],
        inputs=Input(slider="B"),
        guess=Guess(0.0),
        gravity=-G * 1j,
    )
    c = Cycle(m.motion(np.linspace(0, 2 * math.pi, 9), 1.0))
    assert not c.whole
    assert c.work == pytest.approx(2 * math.pi * G, rel=1e-13)
    assert c.closure == pytest.approx(0.0, abs=1e-12)


def test_counterweights_on_links_that_turn_alike_are_refused() -> None:
    m = Mechanism(
        {"A": 0j, "D": 5},
        {
            "crank": Link({"A": 0j, "B": 2}, 1.0, 0.7),
            "coupler": Link({"B": 0j, "C": 5}, 3.0, 2.0),
            "rocker": Link({"D": 0j, "C": 2}, 1.0, 0.5),
        },
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"coupler": 0.0, "rocker": 1.0}),
    )
    motion = m.motion(np.linspace(0.2, 1.4, 30), 5.0)
    with pytest.raises(DescriptionError, match="crank, rocker turn alike"):
        least_squares(motion, ["crank", "rocker"])
    # one of them balances all: −(m₁ r₁ + m₃ a + m₄ r₄), the coupler's mass at the crank's radius
    weights, before, after = least_squares(motion, ["crank"])
    assert weights["crank"] == pytest.approx(-(0.7 + 3 * 2 + 0.5), rel=1e-12)
    assert np.abs(after).max() < 1e-11 * np.abs(before).max()
    with pytest.raises(DescriptionError, match="speed is zero"):
        least_squares(m.motion(np.linspace(0.2, 1.4, 30)), ["crank"])


def test_a_turn_that_begins_anywhere_and_one_in_uneven_steps() -> None:
    m = arm(torques=[Torque("arm", -4.0)])
    begun = Cycle(m.motion(np.linspace(0.7, 0.7 + 2 * math.pi, 181), 6.0))
    assert begun.whole
    assert begun.work == pytest.approx(8 * math.pi, rel=1e-13)
    # crowded where the weight is lifted: their plain mean would be wrong
    steps = (
        math.pi / 180 * (1 + 0.9 * np.cos(np.radians(np.arange(360.0))))
    )  # the 90th and 270th are the mean step
    uneven = Cycle(m.motion(np.concatenate([[0.0], np.cumsum(steps)]), 6.0))
    assert uneven.whole
    assert uneven.work == pytest.approx(8 * math.pi, rel=1e-6)
    assert uneven.fluctuation == pytest.approx(2 * G, rel=1e-5)


def test_berkof_and_lowen_with_pivots_away_from_the_links_origins() -> None:
    """Crank of 1, coupler of 3, rocker of 2 m: m₃ = 3 kg at a third gives 2 kg to B and 1 kg to C."""
    m = Mechanism(
        {"A": 0j, "D": 4},
        {
            "crank": Link({"A": 5j, "B": 1 + 5j}, 1.0, 0.5 + 5j),
            "coupler": Link({"B": -2.0, "C": 1.0}, 3.0, -1.0),
            "rocker": Link({"D": 7.0, "C": 7.0 + 2j}, 2.0, 7.0 + 1j),
        },
        inputs=Input(link="crank"),
        guess=Guess(0.5, {"coupler": 0.4, "rocker": 0.0}),
    )
    exact = berkof_lowen(m, "crank", "coupler", "rocker")
    assert exact["crank"] == pytest.approx(-(0.5 + 2.0), rel=1e-15)
    assert exact["rocker"] == pytest.approx(-(2j + 2j), rel=1e-15)
    weights, before, after = least_squares(m.motion(np.linspace(0.1, 2.0, 40), 3.0), ["crank", "rocker"])
    for link, weight in exact.items():
        assert weights[link] == pytest.approx(weight, rel=1e-10)
    assert np.abs(after).max() < 1e-12 * np.abs(before).max()
