"""Periods of small oscillations against closed forms, kinetic energy by forces, and motions in time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism, Spring, TorsionSpring

G = 9.81


def rod(**loads: Any) -> Mechanism:
    """A uniform rod of 2 kg and 1 m on a pin at its end."""
    return Mechanism(
        {"O": 0j}, {"rod": Link({"O": 0j, "E": 1.0}, 2.0, 0.5, 2 / 12)}, inputs=Input(link="rod"), **loads
    )


@pytest.mark.parametrize("down", [-1j, 1j])
def test_a_rod_on_a_pin(down: complex) -> None:
    """2π √(2 l / 3 g), hanging; none standing; the same with gravity upwards."""
    periods = [(e.stable, e.period) for e in rod(gravity=G * down).equilibria().found]
    expected = 2 * math.pi * math.sqrt(2 / (3 * G))
    assert sorted(periods) == [(False, None), (True, pytest.approx(expected, rel=1e-14))]


def test_a_torsion_spring_turns_a_rod() -> None:
    """2π √(I / k), wherever the free angle lies."""
    m = rod(torsion_springs=[TorsionSpring(("ground", "rod"), 3.0, 0.4)])
    (rest,) = m.equilibria().found
    assert rest.period == pytest.approx(2 * math.pi * math.sqrt((2 / 3) / 3.0), rel=1e-13)


@pytest.mark.parametrize("angle", [0.0, 0.6, 2.5])
def test_a_block_on_a_spring(angle: float) -> None:
    """2π √(m / k) along a guide at any angle, wherever gravity puts the position of rest."""
    way = complex(np.exp(1j * angle))
    m = Mechanism(
        {"O": 0j, "W": -1.0 * way},
        {"block": Link({"B": 0j}, 2.5)},
        [Guide("B", "block", angle=angle, turned=0.0)],
        inputs=Input(slider="B"),
        guess=Guess(0.1, {"block": angle}),
        springs=[Spring((("block", "B"), ("ground", "W")), 400.0, 0.9)],
        gravity=-G * 1j,
    )
    stable = [e for e in m.equilibria().found if e.stable]
    assert stable
    for rest in stable:
        assert rest.period == pytest.approx(2 * math.pi * math.sqrt(2.5 / 400), rel=1e-12)


def test_a_double_pendulum_has_two_periods() -> None:
    """Two equal bobs on threads of 1 m: ω² = g (2 ± √2) / l; the longest first."""
    links = {"a": Link({"O": 0j, "P": 1.0}, 1.0, 1.0), "b": Link({"P": 0j, "Q": 1.0}, 1.0, 1.0)}
    m = Mechanism({"O": 0j}, links, inputs=[Input(link="a"), Input(link="b")], gravity=-G * 1j)
    (hanging,) = (e for e in m.equilibria().found if e.stable)
    expected = [2 * math.pi / math.sqrt(G * (2 + s * math.sqrt(2))) for s in (-1, 1)]
    assert hanging.periods == pytest.approx(expected, rel=1e-13)
    assert hanging.period == hanging.periods[0]


def test_one_of_two_parts_without_mass_has_no_period() -> None:
    """A thread without a bob that a spring holds does not swing: one period, of the part with a mass."""
    links = {"a": Link({"O": 0j, "P": 1.0}, 1.0, 1.0), "b": Link({"P": 0j, "Q": 1.0})}
    m = Mechanism(
        {"O": 0j}, links, inputs=[Input(link="a"), Input(link="b")], gravity=-G * 1j,
        torsion_springs=[TorsionSpring(("ground", "b"), 5.0, 1.5 * math.pi)],
    )  # fmt: skip
    hanging = [e for e in m.equilibria().found if e.stable]
    assert len(hanging) == 1
    assert hanging[0].periods == pytest.approx((2 * math.pi / math.sqrt(G),), rel=1e-12)


def test_nothing_with_a_mass_has_no_period() -> None:
    """A massless bar on a spring rests, and does not swing."""
    m = Mechanism(
        {"O": 0j},
        {"bar": Link({"O": 0j})},
        inputs=Input(link="bar"),
        torsion_springs=[TorsionSpring(("ground", "bar"), 3.0, 0.4)],
    )
    (rest,) = m.equilibria().found
    assert rest.stable
    assert rest.period is None


@pytest.mark.parametrize("ratio", [-0.5, 3.0])
def test_a_geared_flywheel_swings_with_it(ratio: float) -> None:
    """The wheel's inertia counts with the square of the ratio."""
    links = {"rod": Link({"O": 0j}, 2.0, 0.5, 2 / 12), "wheel": Link({"W": 0j}, 0.0, 0j, 0.3)}
    m = Mechanism(
        {"O": 0j, "W": 2.0}, links, inputs=Input(link="rod"), gears=[Gear(("rod", "wheel"), ratio)],
        guess=Guess(0.0, {"wheel": 0.0}), gravity=-G * 1j,
    )  # fmt: skip
    (hanging,) = (e for e in m.equilibria().found if e.stable)
    expected = 2 * math.pi * math.sqrt((2 / 3 + 0.3 * ratio**2) / G)
    assert hanging.period == pytest.approx(expected, rel=1e-13)


def four_bar(rng: np.random.Generator) -> Mechanism:
    """A four-bar with masses everywhere, a spring and gravity."""
    a, b, c = 0.3, rng.uniform(0.8, 1.1), rng.uniform(0.8, 1.1)

    def link(p: str, q: str, length: float) -> Link:
        return Link(
            {p: 0j, q: length},
            rng.uniform(0.1, 3),
            complex(*rng.uniform(-0.3, 0.6, 2)),
            rng.uniform(0.01, 0.3),
        )

    links = {"crank": link("A", "B", a), "coupler": link("B", "C", b), "rocker": link("D", "C", c)}
    return Mechanism(
        {"A": 0j, "D": 1.0, "S": complex(*rng.uniform(-1, 1, 2))}, links, inputs=Input(link="crank"),
        guess=Guess(0.5, {"coupler": 0.6, "rocker": 1.5}), gravity=complex(*rng.normal(0, 8, 2)),
        springs=[Spring((("rocker", "C"), ("ground", "S")), rng.uniform(10, 300), 0.3)],
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
def test_four_bars_by_their_forces(seed: int) -> None:
    """The effort that a unit acceleration from rest adds is the generalized mass."""
    m, tried = four_bar(np.random.default_rng(seed)), 0
    for rest in m.equilibria().found:
        if not rest.stable:
            continue
        tried += 1
        pushed, still = (float(m.motion(rest.inputs, 0.0, a).effort[0]) for a in (1.0, 0.0))
        assert rest.period == pytest.approx(
            2 * math.pi * math.sqrt((pushed - still) / rest.stiffness), rel=1e-9
        )
    assert tried


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_four_bars_released(seed: int) -> None:
    """Released a ten-thousandth of a radian beside the position of rest it passes it a quarter of a period later."""
    m = four_bar(np.random.default_rng(1000 + seed))
    for rest in m.equilibria().found:
        if not rest.stable or rest.period is None:
            continue
        quarter = rest.period / 4
        run = m.simulate([0.0, quarter, 2 * quarter], angle=rest.inputs[0] + 1e-4, speed=0.0)
        beside = run.angle[:, 0] - rest.inputs[0]
        assert abs(beside[1]) < 1e-6
        assert beside[2] == pytest.approx(-1e-4, rel=1e-2)
