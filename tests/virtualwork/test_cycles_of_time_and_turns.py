"""Cycles: which sweeps are whole, means over time of laws with dwells, the largest torque between poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from tests.virtualwork.mechanisms import four_bar, slider_crank
from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism, TorsionSpring
from virtualwork.motion import Motion
from virtualwork.study.cycle import Cycle
from virtualwork.study.sweep import largest

G = 9.81


def arm(**loads) -> Mechanism:
    """2 kg at half a metre, and 0.6 kg·m² about the pin: τ = 9.81 cos θ + 0.6 α."""
    return Mechanism(
        {"O": 0j}, {"arm": Link({"O": 0j}, 2.0, 0.5, 0.1)}, inputs=Input(link="arm"), gravity=-G * 1j, **loads
    )


def over_time(m: Mechanism, t, q, speed, acceleration) -> Motion:
    motion = m.motion(q, speed, acceleration)
    motion.poses.time = t
    return motion


def up_and_back(t, rise: float, low: float):
    """Return q, q̇ and q̈ of a law that rises, dwells, returns and dwells within 1 s: cycloids of 0.3 s."""
    q, speed, acceleration = (np.zeros_like(t) for _ in range(3))
    q += low
    for start, sign in ((0.1, 1), (0.6, -1)):
        u = np.clip((t - start) / 0.3, 0, 1)
        q += sign * rise * (u - np.sin(2 * np.pi * u) / (2 * np.pi))
        speed += sign * rise / 0.3 * (1 - np.cos(2 * np.pi * u))
        acceleration += sign * rise / 0.09 * 2 * np.pi * np.sin(2 * np.pi * u)
    return q, speed, acceleration


@pytest.mark.parametrize("rise", [0.7, -0.7])
def test_a_law_with_dwells_and_a_return(rise: float) -> None:
    """Mean and r.m.s. over the time, work from power: against quadrature of τ = m g l cos q + I q̈."""
    t = np.linspace(0, 1, 201)
    c = Cycle(over_time(arm(), t, *up_and_back(t, rise, 0.3))).refined()

    def torque(at: float) -> float:
        q, _, acceleration = up_and_back(np.array([at]), rise, 0.3)
        return float(G * np.cos(q[0]) + 0.6 * acceleration[0])

    ends = [0.1, 0.4, 0.6, 0.9]
    mean = quad(torque, 0, 1, points=ends, epsabs=1e-12)[0]
    rms = math.sqrt(quad(lambda at: torque(at) ** 2, 0, 1, points=ends, epsabs=1e-12)[0])
    assert c.whole
    assert c.mean == pytest.approx(mean, rel=1e-6)
    assert c.rms == pytest.approx(rms, rel=1e-6)
    # the weight is lifted and let down again
    assert abs(c.work) <= 1e-6 * c.peak
    assert c.closure is not None
    assert abs(c.closure) <= 1e-6 * c.peak
    largest = max(
        -minimize_scalar(lambda at: -abs(torque(at)), bounds=(low, low + 0.15), method="bounded", options={"xatol": 1e-12}).fun
        for low in (0.1, 0.25, 0.6, 0.75)
    )  # fmt: skip
    assert c.peak == pytest.approx(largest, rel=1e-6)
    with pytest.raises(ValueError, match="stands or turns back"):
        c.flywheel(0.02)


def test_a_steady_turn_over_time_is_that_over_the_input() -> None:
    m, speed = four_bar(gravity=-9.81j), 12.0
    q = np.linspace(0.3, 0.3 + 2 * np.pi, 91)
    over_input = Cycle(m.motion(q, speed)).refined()
    timed = Cycle(over_time(m, q / speed, q, np.full(91, speed), np.zeros(91))).refined()
    for name in ("mean", "rms", "work", "peak", "peak_power", "peak_at", "fluctuation"):
        exact = getattr(over_input, name)
        assert getattr(timed, name) == pytest.approx(exact, rel=1e-7, abs=1e-9 * over_input.peak), name
    assert timed.flywheel(0.02) == pytest.approx(over_input.flywheel(0.02), rel=1e-7)
    backwards = Cycle(m.motion(q[::-1], -speed)).refined()
    assert backwards.peak == pytest.approx(over_input.peak, rel=1e-12)
    assert backwards.fluctuation == pytest.approx(over_input.fluctuation, rel=1e-9)


def test_a_law_that_stands_still_is_held_by_its_weight() -> None:
    t = np.linspace(0, 1, 11)
    c = Cycle(over_time(arm(), t, np.full(11, 0.3), np.zeros(11), np.zeros(11)))
    assert c.whole
    assert c.mean == pytest.approx(G * math.cos(0.3), rel=1e-14)
    assert c.work == c.peak_power == 0


def test_a_stroke_there_and_back_of_a_slide() -> None:
    """A block of 2 kg driven up a slope of 30° and back: F = m g sin 30° + m ẍ, its mean m g / 2."""
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"B": 0j}, 2.0)},
        [Guide("B", "block", "ground", "O", math.pi / 6, 0.0)],
        inputs=Input(slider="B"),
        guess=Guess(0.0),
        gravity=-G * 1j,
    )
    t = np.linspace(0, 1, 101)
    q, v, a = (
        0.1 * (1 - np.cos(2 * np.pi * t)),
        0.2 * np.pi * np.sin(2 * np.pi * t),
        0.4 * np.pi**2 * np.cos(2 * np.pi * t),
    )
    c = Cycle(over_time(m, t, q, v, a)).refined()
    assert c.whole
    assert c.mean == pytest.approx(G, rel=1e-9)
    assert c.peak == pytest.approx(G + 2 * 0.4 * np.pi**2, rel=1e-9)
    assert c.peak_at == pytest.approx(0.0, abs=1e-9)
    half = Cycle(over_time(m, t[:51], q[:51], v[:51], a[:51]))
    assert "does not end where it begins (0 m, then 0.2 m)" in str(half.reason)
    assert "one stroke of the slide B is no cycle" in str(Cycle(m.motion(q[:51], 1.0)).reason)


PART = {
    "a part": (
        np.linspace(0, 1.75, 11),
        "covers 100.268 deg of the input crank, and a whole cycle is 360 deg",
    ),
    "nearly": (np.radians(np.arange(0.0, 356, 5)), "covers 355 deg"),
    "backwards": (np.radians(np.arange(0.0, -101, -5)), "sweep from 0deg to -360deg"),
    "back": (
        np.array([0.0, 1, 2, 1, 0]),
        "does not rise or fall throughout: a cycle that dwells or returns needs",
    ),
    "a dwell": (np.array([0.0, 1, 1, 2]), "does not rise or fall throughout"),
    "one": (np.array([0.5]), "one pose is no cycle"),
}


@pytest.mark.parametrize("case", PART)
def test_a_sweep_that_is_no_whole_cycle_says_why(case: str) -> None:
    q, text = PART[case]
    c = Cycle(four_bar(gravity=-9.81j).motion(q, 12.0))
    assert not c.whole
    assert text in str(c.reason)


def test_a_rocker_as_input_cannot_turn_round() -> None:
    """A door between two springs: the input of a four-bar that is driven by its rocker."""
    m = four_bar(gravity=-9.81j)
    m = Mechanism(
        m.ground,
        m.links,
        inputs=Input(link="rocker"),
        guess=Guess((1.0,), {"crank": 1.0, "coupler": 0.2}),
        gravity=m.gravity,
    )
    low, high = m.assembly.reach.range
    q = np.linspace(low + 0.2, high - 0.2, 41)
    assert "cannot turn a whole turn" in str(Cycle(m.motion(q, 3.0)).reason)


def test_loads_that_come_back_after_more_turns() -> None:
    """A wheel at half the crank's speed needs two turns; a torsion spring on the crank none brings back."""
    m = Mechanism(
        {"O": 0j, "P": 1 + 0j},
        {"crank": Link({"O": 0j}), "wheel": Link({"P": 0j}, 2.0, 0.3j)},
        gears=[Gear(("crank", "wheel"), -0.5)],
        inputs=Input(link="crank"),
        guess=Guess((0.0,), {"wheel": 0.0}),
        gravity=-G * 1j,
    )
    once, twice = (Cycle(m.motion(np.linspace(0, 2 * np.pi * n, 90 * n + 1), 3.0)) for n in (1, 2))
    assert "a whole cycle is 720 deg: sweep from 0deg to 720deg" in str(once.reason)
    assert twice.whole
    sprung = arm(torsion_springs=[TorsionSpring(("ground", "arm"), 4.0, 0.3, 0.2)])
    reason = Cycle(sprung.motion(np.linspace(0, 2 * np.pi, 91), 3.0)).reason
    assert reason == "the loads do not repeat within 32 turns of the input arm"


@pytest.mark.parametrize("driven", ["four-bar", "slider-crank"])
def test_the_largest_torque_does_not_depend_on_the_steps(driven: str) -> None:
    m = four_bar(gravity=-9.81j) if driven == "four-bar" else slider_crank(piston={"mass": 1.0})
    cycles = [Cycle(m.motion(np.linspace(0, 2 * np.pi, n), 25.0)).refined() for n in (21, 101, 2001)]
    dense = m.motion(np.linspace(0, 2 * np.pi, 400_001), 25.0)
    size = np.abs(dense.effort)
    for c in cycles:
        # of a parabola's top: a step of 1.6e-5 rad moves it by 1e-10 of it
        assert size.max() * (1 - 1e-13) <= c.peak <= size.max() * (1 + 1e-8)
        assert c.peak == pytest.approx(cycles[0].peak, rel=1e-12)
        assert c.peak_at == pytest.approx(cycles[0].peak_at, abs=1e-6)
        assert c.peak_power == pytest.approx(25 * c.peak, rel=1e-12)
        for name in ("mean", "rms", "fluctuation"):
            assert getattr(c, name) == pytest.approx(getattr(cycles[0], name), rel=1e-8, abs=1e-12 * c.peak)
    assert np.interp(cycles[0].peak_at, dense.inputs[:, 0], size) == pytest.approx(size.max(), rel=1e-8)


def test_the_first_of_two_equal_peaks() -> None:
    c = Cycle(arm().motion(np.linspace(0.5, 0.5 + 2 * np.pi, 38), 1.0)).refined()
    assert c.peak == pytest.approx(G, rel=1e-15)
    assert c.peak_at == pytest.approx(np.pi, abs=1e-7)


@pytest.mark.slow
def test_peaks_of_random_four_bars_against_dense_sweeps() -> None:
    rng = np.random.default_rng(24)
    for _ in range(60):
        m = four_bar(gravity=complex(*rng.normal(size=2) * 10))
        rate, start, n = rng.normal() * 30, rng.uniform(-4, 4), int(rng.integers(9, 400))
        c = Cycle(m.motion(np.linspace(start, start + 2 * np.pi, n), rate)).refined()
        dense = m.motion(np.linspace(0, 2 * np.pi, 100_001), rate).effort
        assert np.abs(dense).max() * (1 - 1e-12) <= c.peak <= np.abs(dense).max() * (1 + 1e-6)
        assert c.mean == pytest.approx(dense[:-1].mean(), abs=1e-10 * c.peak)
        assert c.rms == pytest.approx(np.sqrt((dense[:-1] ** 2).mean()), rel=1e-9)


def test_the_largest_value_is_no_less_than_any_of_the_table() -> None:
    """Of two peaks that differ by rounding the first counts, with the size of the larger one."""
    place, values = np.arange(5.0), np.array([0.0, 1.0 - 1e-13, 0.0, -1.0, 0.0])
    assert largest(lambda q: np.interp(q, place, values), place, values) == (1.0, 1.0)
