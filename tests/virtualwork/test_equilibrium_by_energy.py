"""Equilibria, their potential and their stiffness against V(θ) in closed form, differentiated in 30 digits."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq

from virtualwork import Force, Gear, Guess, Guide, Input, Link, Mechanism, Spring, Torque, TorsionSpring

G = 9.81


def bar(**loads: Any) -> Mechanism:
    """A bar of 2 kg on a pivot, its centre of mass at 0.5 m."""
    gravity = loads.pop("gravity", -G * 1j)
    return Mechanism(
        {"O": 0j}, {"bar": Link({"O": 0j}, 2.0, 0.5)}, inputs=Input(link="bar"), gravity=gravity, **loads
    )


def slider_crank(**loads: Any) -> Mechanism:
    """Crank 0.1 m, rod 0.3 m of 3 kg, in line."""
    return Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j, "A": 0.1}), "rod": Link({"A": 0j, "B": 0.3}, 3.0, 0.12 + 0.02j)},
        [Guide("B", "rod")],
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"rod": -0.3}),
        **loads,
    )


def rod(theta: Any) -> Any:
    """The rod's angle."""
    return -mp.asin(mp.mpf("0.1") / mp.mpf("0.3") * mp.sin(theta))


def on_rod(theta: Any, z: complex) -> Any:
    """A point of the rod."""
    return mp.mpf("0.1") * mp.expj(theta) + mp.mpc(z) * mp.expj(rod(theta))


@pytest.mark.parametrize("first", ["ground", "bar"])
def test_a_torsion_spring_and_a_torque(first: str) -> None:
    """V = m g l sin θ + ½ k (θ − θ₀)² − T θ, whichever link the spring names first."""
    k, free, torque = 3.0, 0.7, -2.0
    links, angle = (("ground", "bar"), free) if first == "ground" else (("bar", "ground"), -free)
    m = bar(torsion_springs=[TorsionSpring(links, k, angle)], torques=[Torque("bar", torque)])

    def energy(t: Any) -> Any:
        return G * mp.sin(t) + k * (t - free) ** 2 / 2 - torque * t

    with mp.workdps(30):
        found = m.equilibria().found
        # all sign changes of V' over a turn either way of the guess
        grid = [mp.mpf(i) / 50 for i in range(-314, 315)]
        slope = [mp.diff(energy, t) for t in grid]
        assert len(found) == sum(a * b < 0 for a, b in pairwise(slope)) > 0
        for e in found:
            exact = mp.findroot(lambda t: mp.diff(energy, t), e.inputs[0])
            bend = float(mp.diff(energy, exact, 2))
            assert e.inputs[0] == pytest.approx(float(exact), rel=1e-13)
            assert e.potential == pytest.approx(float(energy(exact)), rel=1e-13)
            assert e.stiffness == pytest.approx(bend, rel=1e-12)
            assert e.stable is (bend > 0)


def test_springs_between_two_moving_links() -> None:
    """A tension spring from crank to rod, a torsion spring in their pin, and the rod's weight."""
    k, s0, kt, free = 400.0, 0.05, 2.0, -2.2
    m = slider_crank(
        gravity=-G * 1j,
        springs=[Spring((("crank", 0.02 + 0.03j), ("rod", 0.2 - 0.04j)), k, s0)],
        torsion_springs=[TorsionSpring(("crank", "rod"), kt, free)],
    )

    def energy(t: Any) -> Any:
        stretch = abs(on_rod(t, 0.2 - 0.04j) - mp.mpc(0.02, 0.03) * mp.expj(t)) - s0
        weight = 3 * G * on_rod(t, 0.12 + 0.02j).imag
        return k * stretch**2 / 2 + kt * (rod(t) - t - free) ** 2 / 2 + weight

    with mp.workdps(30):
        found = m.equilibria().found
        slope = [mp.diff(energy, mp.mpf(i) / 20) for i in range(126)]
        assert len(found) == sum(a * b < 0 for a, b in pairwise(slope)) > 0
        for e in found:
            exact = mp.findroot(lambda t: mp.diff(energy, t), e.inputs[0])
            assert e.inputs[0] == pytest.approx(float(exact), rel=1e-13)
            assert e.potential == pytest.approx(float(energy(exact)), rel=1e-13)
            assert e.stiffness == pytest.approx(float(mp.diff(energy, exact, 2)), rel=1e-11)


def test_a_force_that_turns_with_its_link_has_a_stiffness_and_no_potential() -> None:
    force, at = 30.0 - 20.0j, 0.25 + 0.05j
    m = slider_crank(gravity=-G * 1j, forces=[Force("rod", at, force, "link")])

    def work(t: Any) -> Any:
        moved = mp.diff(lambda u: on_rod(u, at).real, t), mp.diff(lambda u: on_rod(u, at).imag, t)
        push = mp.mpc(force) * mp.expj(rod(t))
        fall = mp.diff(lambda u: on_rod(u, 0.12 + 0.02j).imag, t)
        return push.real * moved[0] + push.imag * moved[1] - 3 * G * fall

    with mp.workdps(30):
        found = m.equilibria().found
        assert found
        for e in found:
            exact = mp.findroot(work, e.inputs[0])
            assert e.inputs[0] == pytest.approx(float(exact), rel=1e-12)
            assert e.potential is None
            assert e.stiffness == pytest.approx(-float(mp.diff(work, exact)), rel=1e-9)


def test_a_force_given_by_a_table_counts_its_slope() -> None:
    """F = 5 + 5θ, then 13 − 3θ, upwards at 1 m: Q = (F − m g/2) cos θ, so −Q' where it vanishes is −F' cos θ."""
    m = bar(forces=[Force("bar", 1.0 + 0j, history=((0.0, 5.0j), (1.0, 10.0j), (2.0, 7.0j)))])
    rising, falling = m.equilibria([[0.1, 1.5]]).found
    exact = (G - 5) / 5, 1 + (10 - G) / 3
    assert (rising.inputs[0], falling.inputs[0]) == pytest.approx(exact, rel=1e-14)
    assert rising.stiffness == pytest.approx(-5 * math.cos(exact[0]), rel=1e-12)
    assert falling.stiffness == pytest.approx(3 * math.cos(exact[1]), rel=1e-12)
    assert (rising.stable, falling.stable) == (False, True)


def test_a_torque_that_only_just_balances() -> None:
    """T = m g l: the force touches zero, between two samples, and no second variation tells whether it is stable."""
    m = bar(gravity=G * np.exp(1j * (0.123 - math.pi / 2)), torques=[Torque("bar", G)])
    (e,) = m.equilibria().found
    assert e.inputs[0] == pytest.approx(0.123, abs=1e-12)
    assert e.stable is None
    assert bar(torques=[Torque("bar", 1.001 * G)]).equilibria().found == ()


def test_a_root_at_both_ends_of_the_turn_counts_once() -> None:
    m = bar(gravity=-G + 0j)
    assert [e.inputs[0] for e in m.equilibria().found] == pytest.approx([0.0, math.pi], abs=1e-12)
    assert [e.stable for e in m.equilibria().found] == [False, True]
    # of two turns each position once, of one and a half too
    for end in (4 * math.pi, 3 * math.pi):
        assert [e.stable for e in m.equilibria([[0.0, end]]).found] == [False, True]


def test_a_weight_on_a_spring_at_a_slide() -> None:
    """x = x₀ + m g/k below the spring's free end; V = ½ m² g²/k − m g x."""
    mass, k, free = 2.0, 500.0, 0.1
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"B": 0j}, mass)},
        [Guide("B", "block", "ground", "O", -math.pi / 2, 0.0)],
        inputs=Input(slider="B"),
        guess=Guess(0.12),
        gravity=-G * 1j,
        springs=[Spring((("ground", 0j), ("block", 0j)), k, free)],
    )
    (e,) = m.equilibria([[0.05, 0.5]]).found
    sag = mass * G / k
    assert e.inputs[0] == pytest.approx(free + sag, rel=1e-14)
    assert e.stiffness == pytest.approx(k, rel=1e-12)
    assert e.potential == pytest.approx(k * sag**2 / 2 - mass * G * (free + sag), rel=1e-13)


def test_two_inputs_with_torsion_springs() -> None:
    """V = ½ k₁ (θ₁ − a)² + ½ k₂ (θ₂ − θ₁ − b)²: its least stiffness is that of the matrix [[k₁+k₂, −k₂], [−k₂, k₂]]."""
    k1, a, k2, b = 2.0, 1.1, 3.0, 0.4
    m = Mechanism(
        {"O": 0j},
        {"upper": Link({"O": 0j, "E": 1}), "lower": Link({"E": 0j})},
        inputs=(Input(link="upper"), Input(link="lower")),
        torsion_springs=[TorsionSpring(("ground", "upper"), k1, a), TorsionSpring(("upper", "lower"), k2, b)],
    )
    (e,) = m.equilibria().found
    assert e.inputs == pytest.approx((a, a + b), rel=1e-13)
    half = (k1 + 2 * k2) / 2
    assert e.stiffness == pytest.approx(half - math.sqrt(half**2 - k1 * k2), rel=1e-12)
    assert e.stable is True
    assert abs(e.potential or 0.0) < 1e-25


@pytest.mark.parametrize("inputs", [1, 2])
def test_a_rest_at_a_negative_angle_under_a_torsion_spring(inputs: int) -> None:
    """A bar that a stiff spring holds level hangs a little below: k θ = −m g l cos θ, and not a turn later."""
    k, held = 30.0, TorsionSpring(("ground", "bar"), 30.0, 0.0)
    other = {"other": Link({"Q": 0j}, 1.0, 1.0)}
    m = Mechanism(
        {"O": 0j, "Q": 5},
        {"bar": Link({"O": 0j}, 2.0, 0.5)} | (other if inputs == 2 else {}),
        inputs=[Input(link="bar"), Input(link="other")][:inputs],
        gravity=-G * 1j,
        torsion_springs=[held],
    )
    sag = float(mp.findroot(lambda t: k * t + G * mp.cos(t), -0.3))
    for spans in (None, [[-1.0, 1.0], [math.nan] * 2][:inputs]):
        found = m.equilibria(spans).found
        assert [e.inputs[0] for e in found] == pytest.approx([sag] * inputs, rel=1e-13)
        assert [e.stable for e in found] == [False, True][-inputs:]


@pytest.mark.parametrize(("at", "stable"), [(0.5 * math.pi, False), (1.5 * math.pi, True), (0.0, None)])
def test_a_range_of_one_position(at: float, stable: bool | None) -> None:
    """A pendulum stands, hangs, or does not rest there at all."""
    found = bar().equilibria([[at, at]]).found
    assert [(e.inputs[0], e.stable) for e in found] == ([] if stable is None else [(at, stable)])


@pytest.mark.parametrize("width", [0.0, 1e-6, 1e-3])
def test_a_narrow_range_of_one_of_two_inputs(width: float) -> None:
    hanging = 1.5 * math.pi
    m = Mechanism(
        {"O": 0j},
        {"a": Link({"O": 0j, "P": 1}, 1.0, 1.0), "b": Link({"P": 0j}, 1.0, 1.0)},
        inputs=[Input(link="a"), Input(link="b")],
        gravity=-G * 1j,
    )
    found = m.equilibria([[hanging - width, hanging + width], [math.nan] * 2]).found
    assert [e.stable for e in found] == [False, True]
    assert not m.equilibria([[0.1, 0.1 + width], [math.nan] * 2]).found


def test_a_range_with_gaps_and_a_range_about_zero() -> None:
    """A four-bar that cannot turn all the way, 2 kg at its rocker's pin: V = m g y_C, from the two circles' cut."""
    m = Mechanism(
        {"A": 0j, "D": 4},
        {
            "crank": Link({"A": 0j, "B": 2}),
            "coupler": Link({"B": 0j, "C": 5}),
            "rocker": Link({"D": 0j, "C": 2}, 2.0, 2.0),
        },
        inputs=Input(link="crank"),
        guess=Guess(math.pi, {"coupler": 0.3, "rocker": 2.0}),
        gravity=-G * 1j,
    )

    def energy(t: Any) -> Any:
        b = 2 * mp.expj(t)
        d = abs(4 - b)
        foot = (d**2 + 25 - 4) / (2 * d)
        return 2 * G * (b + mp.mpc(foot, mp.sqrt(25 - foot**2)) * (4 - b) / d).imag

    with mp.workdps(30):
        edge = mp.acos(mp.mpf(11) / 16)
        grid = [edge + (2 * mp.pi - 2 * edge) * i / 200 for i in range(1, 200)]
        slope = [mp.diff(energy, t, h=mp.mpf(10) ** -12) for t in grid]
        exact = [
            mp.findroot(lambda t: mp.diff(energy, t), (t + u) / 2)
            for (t, a), (u, b) in pairwise(zip(grid, slope, strict=True))
            if a * b < 0
        ]
        assert exact
        for span in (None, [[0.0, 2 * math.pi]], [[-0.5, 2 * math.pi - 0.5]]):
            found = m.equilibria(span).found
            assert [e.inputs[0] for e in found] == pytest.approx([float(t) for t in exact], rel=1e-11)
            for e, t in zip(found, exact, strict=True):
                assert e.stiffness == pytest.approx(float(mp.diff(energy, t, 2)), rel=1e-9)


def test_an_equilibrium_at_the_end_of_the_range_is_found_though_the_end_is_rounded() -> None:
    """sin(−π) and cos(−π/2) are not zero in doubles, and have no other sign beside them."""
    turned = bar(gravity=-G + 0j).equilibria([[-math.pi, math.pi]]).found
    assert [e.inputs[0] for e in turned] == pytest.approx([-math.pi, 0.0], abs=1e-12)
    hanging, standing = bar().equilibria([[-math.pi / 2, 3 * math.pi / 2]]).found
    assert (hanging.inputs[0], standing.inputs[0]) == pytest.approx((-math.pi / 2, math.pi / 2), abs=1e-12)
    assert (hanging.stable, standing.stable) == (True, False)
    assert [e.inputs[0] for e in bar().equilibria([[0.1, math.pi / 2]]).found] == [math.pi / 2]
    # half a turn that begins and ends at rest is no whole one: both count
    half = bar(gravity=-G + 0j).equilibria([[0.0, math.pi]]).found
    assert [e.inputs[0] for e in half] == pytest.approx([0.0, math.pi], abs=1e-12)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_equilibria_in_any_unit(scale: float) -> None:
    """A watch and a ship: V = M (sin θ + (θ − 0.7)²/6), stable or not whatever M."""
    m = Mechanism(
        {"O": 0j},
        {"bar": Link({"O": 0j}, 2.0 * scale, 0.5)},
        inputs=Input(link="bar"),
        gravity=-G * 1j,
        torsion_springs=[TorsionSpring(("ground", "bar"), G / 3 * scale, 0.7)],
    )
    found = m.equilibria().found
    one = bar(torsion_springs=[TorsionSpring(("ground", "bar"), G / 3, 0.7)]).equilibria().found
    assert [e.inputs[0] for e in found] == pytest.approx([e.inputs[0] for e in one], rel=1e-13)
    for e in found:
        bend = -math.sin(e.inputs[0]) + 1 / 3
        assert math.cos(e.inputs[0]) == pytest.approx(-(e.inputs[0] - 0.7) / 3, abs=1e-13)
        assert e.stiffness == pytest.approx(G * scale * bend, rel=1e-12)
        assert e.stable is (bend > 0)


def test_rest_of_a_block_that_runs_away_where_its_guides_are_parallel() -> None:
    """A block of 1 kg on a turning bar and a vertical line at 1 m: V = m g tan θ − T θ, endless at 90°."""
    m = Mechanism(
        {"O": 0j},
        {"bar": Link({"O": 0j}), "block": Link({"B": 0j, "C": 0j}, 1.0)},
        [Guide("B", "block", on="bar", turned=0.0), Guide("C", "block", through=1.0, angle=math.pi / 2)],
        inputs=Input(link="bar"),
        gravity=-G * 1j,
        torques=[Torque("bar", 4 * G)],
        guess=Guess(0.0, {}, {"B": 1.0}),
    )
    rest = m.equilibria().found
    assert [e.stable for e in rest] == [True, False, True, False]
    assert np.allclose(np.degrees([e.inputs[0] for e in rest]), [60, 120, 240, 300], rtol=0, atol=1e-10)


def all_roots(f: Any, low: float, high: float, steps: int = 4001) -> list[float]:
    """The sign changes of a function, by Brent's method between samples."""
    q = np.linspace(low, high, steps)
    values = [f(x) for x in q]
    return [
        brentq(f, a, b, xtol=1e-15) for (a, u), (b, v) in pairwise(zip(q, values, strict=True)) if u * v < 0
    ]


@pytest.mark.parametrize("side", [1, -1])
def test_a_crank_between_limits_rests_where_it_can_go(side: int) -> None:
    """A weight below a crank that is longer than its rod, and a soft torsion spring: V = −m g l cos θ + ½ k (θ − θ₀)².

    The crank swings between ±asin(5/6). At half a turn, and a turn farther on, the loads balance too: there the spring would be
    wound up on a way that the rod bars.
    """
    mass, arm, k, free = 1.0, 0.06, 0.03, side * 0.4
    m = Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j, "A": arm}, mass, -1j * side * arm), "rod": Link({"A": 0j, "B": 0.05})},
        [Guide("B", "rod")],
        inputs=Input(link="crank"),
        guess=Guess(side * 0.3, {"rod": -side * 0.36}),
        gravity=-1j * side * G,
        torsion_springs=[TorsionSpring(("ground", "crank"), k, free)],
    )

    def slope(t: float) -> float:
        return mass * G * arm * math.sin(t) + k * (t - free)

    end = math.asin(5 / 6)
    (exact,) = all_roots(slope, -end, end)
    assert len(all_roots(slope, side * 0.3 - 2 * math.pi, side * 0.3 + 2 * math.pi)) == 5
    found = m.equilibria()
    assert found.ranges == (pytest.approx((-end, end), rel=1e-8),)
    (e,) = found.found
    assert e.inputs[0] == pytest.approx(exact, rel=1e-12)
    assert e.stable is True
    assert e.stiffness == pytest.approx(mass * G * arm * math.cos(exact) + k, rel=1e-12)


@pytest.mark.parametrize(("ratio", "turns"), [(-0.5, 2), (-2.0, 1), (2 / 3, 3), (1.5, 2)])
def test_weights_on_a_crank_and_on_a_gear(ratio: float, turns: int) -> None:
    """V = m₁ g l₁ sin θ + m₂ g l₂ sin(φ₀ + r θ) comes back after as many turns of the crank as the ratio's denominator."""
    start = 0.4
    m = Mechanism(
        {"O": 0j, "Q": 1.0},
        {"crank": Link({"O": 0j}, 2.0, 0.5), "gear": Link({"Q": 0j}, 3.0, 0.4)},
        gears=[Gear(("crank", "gear"), ratio)],
        inputs=Input(link="crank"),
        guess=Guess(start, {"gear": 0.7}),
        gravity=-G * 1j,
    )
    first = 0.7 - ratio * start

    def slope(t: float) -> float:
        return G * (math.cos(t) + 1.2 * ratio * math.cos(first + ratio * t))

    exact = all_roots(slope, 0.0, 2 * math.pi * turns)
    assert exact
    found = m.equilibria()
    assert found.turns == (turns,)
    assert [e.inputs[0] for e in found.found] == pytest.approx(exact, rel=1e-12)
    for e in found.found:
        bend = -G * (math.sin(e.inputs[0]) + 1.2 * ratio**2 * math.sin(first + ratio * e.inputs[0]))
        assert e.stiffness == pytest.approx(bend, rel=1e-11)


def test_gears_that_never_come_back_are_searched_a_turn_either_way() -> None:
    ratio = -math.sqrt(0.5)
    m = Mechanism(
        {"O": 0j, "Q": 1.0},
        {"crank": Link({"O": 0j}, 2.0, 0.5), "gear": Link({"Q": 0j}, 3.0, 0.4)},
        gears=[Gear(("crank", "gear"), ratio)],
        inputs=Input(link="crank"),
        guess=Guess(0.4, {"gear": 0.7}),
        gravity=-G * 1j,
    )
    low, high = 0.4 - 2 * math.pi, 0.4 + 2 * math.pi
    exact = all_roots(lambda t: math.cos(t) + 1.2 * ratio * math.cos(0.7 + ratio * (t - 0.4)), low, high)
    found = m.equilibria()
    assert (found.turns, found.ranges) == ((None,), (pytest.approx((low, high)),))
    assert [e.inputs[0] for e in found.found] == pytest.approx(exact, rel=1e-12)


def test_a_geared_input_of_two() -> None:
    """The same gear, with another pendulum that is an input too: each rest of the one with each of the other."""
    first = 0.7 + 0.5 * 0.4
    m = Mechanism(
        {"O": 0j, "Q": 1.0, "P": 5.0},
        {
            "crank": Link({"O": 0j}, 2.0, 0.5),
            "gear": Link({"Q": 0j}, 3.0, 0.4),
            "bob": Link({"P": 0j}, 1.0, 1.0),
        },
        gears=[Gear(("crank", "gear"), -0.5)],
        inputs=(Input(link="crank"), Input(link="bob")),
        guess=Guess((0.4, 0.0), {"gear": 0.7}),
        gravity=-G * 1j,
    )
    exact = all_roots(lambda t: math.cos(t) - 0.6 * math.cos(first - 0.5 * t), 0.0, 4 * math.pi)
    found = m.equilibria()
    assert found.turns == (2, 1)
    assert [e.inputs for e in found.found] == [
        pytest.approx((t, u), rel=1e-11) for t in exact for u in (math.pi / 2, 3 * math.pi / 2)
    ]


def test_a_branch_of_two_turns_has_the_rests_of_both() -> None:
    """Crank 60, coupler 90, rocker 70, ground 100 mm: through the change point at 180° the other assembly goes on."""
    m = Mechanism(
        {"A": 0j, "D": 0.1},
        {
            "crank": Link({"A": 0j, "B": 0.06}),
            "coupler": Link({"B": 0j, "C": 0.09}, 1.0, 0.045 + 0.03j),
            "rocker": Link({"D": 0j, "C": 0.07}, 1.0, 0.035),
        },
        inputs=Input("crank"),
        guess=Guess(math.radians(60), {"coupler": -1.45, "rocker": 3.7}),
        gravity=-G * 1j,
    )

    def energy(t: Any) -> Any:
        b = 0.06 * mp.expj(t)
        way = 0.1 - b
        foot = (0.09**2 - 0.07**2 + abs(way) ** 2) / (2 * abs(way))
        side = -1 if mp.cos(t / 2) > 0 else 1
        across = side * mp.sqrt(max(mp.mpf(0), 0.09**2 - foot**2))
        pin = b + mp.mpc(foot, across) * way / abs(way)
        coupler, rocker = (pin - b) / mp.mpf("0.09"), (pin - 0.1) / mp.mpf("0.07")
        return G * ((b + mp.mpc(0.045, 0.03) * coupler).imag + 0.035 * rocker.imag)

    with mp.workdps(30):
        exact = all_roots(lambda t: float(mp.diff(energy, t, h=mp.mpf(10) ** -10)), 1e-6, 4 * math.pi, 601)
        found = m.equilibria()
    assert found.turns == (2,)
    assert max(exact) > 2 * math.pi
    assert [e.inputs[0] for e in found.found] == pytest.approx(exact, rel=1e-9)
