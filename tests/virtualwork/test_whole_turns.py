"""Whole turns of what a closed form turns: gears of fractional ratio and torsion springs hang on them.

A rod swings about O and is guided by a pin B that a crank carries past O at a small distance: there it turns by half
a turn at once, one way or the other. θ = arg(1 + (1 + ε)e^{iq}) is known, whole turns included: for ε > 0 it is q plus
an angle within ±90°, for ε < 0 it is within ±90° itself.
"""

from __future__ import annotations

import numpy as np
import pytest

from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.describe.parts import TorsionSpring

PAST = [0.1, -0.1, 1e-3, -1e-3, 1e-4, -1e-4, 1e-5, -1e-5]


def swinging_past(past: float, inputs: int = 1, spring: float = 0.0) -> Mechanism:
    idle = {"idle": Link({"I": (0, 0)})} if inputs == 2 else {}
    return Mechanism(
        {"A": (1, 0), "O": (0, 0), "W": (3, 0), "I": (5, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (1 + past, 0)}),
            "rod": Link({"O": (0, 0)}),
            "wheel": Link({"W": (0, 0)}),
        }
        | idle,
        guides=[Guide("B", "crank", "rod", 0j, 0.0)],
        gears=[Gear(("rod", "wheel"), 0.5)],
        inputs=[Input(link="crank"), Input(link="idle")][:inputs],
        guess=Guess(at=(0.0, 0.0)[:inputs], angles={"rod": 0.0, "wheel": 0.0}),
        torsion_springs=[TorsionSpring(("ground", "rod"), spring)] if spring else [],
    )


def rod(past: float, q: np.ndarray) -> np.ndarray:
    b = 1 + (1 + past) * np.exp(1j * q)
    return q + np.angle(b * np.exp(-1j * q)) if past > 0 else np.angle(b)


@pytest.mark.parametrize("past", PAST)
@pytest.mark.parametrize("inputs", [1, 2])
def test_a_rod_that_swings_past_its_pin_turns_a_gear(past: float, inputs: int) -> None:
    q = np.linspace(-7, 13, 57)
    at = q if inputs == 1 else np.stack([q, 0.1 * q], axis=1)
    stood = np.exp(0.5j * rod(past, q))
    assert (
        np.abs(np.exp(1j * swinging_past(past, inputs).motion(at).link("wheel").angle) - stood).max() < 1e-13
    )
    # a pose asked alone, of a mechanism that knows no other
    alone = swinging_past(past, inputs).motion(at[-1:]).link("wheel").angle
    assert abs(np.exp(1j * alone[0]) - stood[-1]) < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("past", PAST)
def test_a_rod_that_swings_past_its_pin_winds_a_torsion_spring(past: float) -> None:
    q = np.array([-6.0, -1.0, 2.0, 3.0, 4.0, 12.0, 1300.0])
    m = swinging_past(past, spring=2.0)
    b = 1 + (1 + past) * np.exp(1j * q)
    rate = ((1 + past) * np.exp(1j * q) / b).real
    # dV/dq = c·θ·θ′
    assert np.abs(m.motion(q).effort / (2.0 * rod(past, q) * rate) - 1).max() < 1e-9


def test_a_link_that_stands_at_half_a_turn_at_the_guess() -> None:
    """Whether its rounding makes it +180° or −180° is nothing to the wheel that is geared one to two with it."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        r, at, wheel = rng.uniform(0.3, 2), rng.uniform(-3, 3), rng.uniform(-3, 3)
        a = complex(*rng.uniform(-1, 1, 2))
        pin = a + r * np.exp(1j * at)
        m = Mechanism(
            {"A": a, "O": complex(pin.real + rng.uniform(0.5, 2), pin.imag), "W": (3, 0)},
            {
                "crank": Link({"A": (0, 0), "B": (r, 0)}),
                "rod": Link({"O": (0, 0)}),
                "wheel": Link({"W": (0, 0)}),
            },
            guides=[Guide("B", "crank", "rod", 0j, 0.0)],
            gears=[Gear(("rod", "wheel"), 0.5)],
            inputs=[Input(link="crank")],
            guess=Guess(at=(at,), angles={"rod": np.pi * rng.choice([1, -1]), "wheel": wheel}),
        )
        for off in ([0.0], [0.0, 1e-7, -1e-7]):
            stood = m.motion(at + np.array(off)).link("wheel").angle
            assert np.abs(np.exp(1j * stood) - np.exp(1j * wheel)).max() < 1e-6


@pytest.mark.parametrize("turns", [-1, 0, 1, 2])
def test_a_prism_stands_at_the_whole_turn_of_the_guess_where_a_gear_counts_them(turns: int) -> None:
    """A block turns as its bar does, and is geared to it: 3 θ is given, and of three places the guess has one."""
    bar = -2.978
    block = bar + 2 * np.pi * turns
    m = Mechanism(
        {"O": (0, 0)},
        {"bar": Link({"O": (0, 0)}), "block": Link({"S": (0, 0)})},
        guides=[Guide("S", "block", "bar", 0j, 0.0, turned=0.0)],
        gears=[Gear(("block", "bar"), -2.0)],
        inputs=[Input(slider="S")],
        guess=Guess(at=(1.0,), angles={"bar": bar, "block": block}),
    )
    motion = m.motion([1.0, 2.0])
    assert motion.link("bar").angle == pytest.approx([bar, bar], abs=1e-14)
    assert np.exp(1j * motion.link("block").angle) == pytest.approx(np.exp([1j * bar] * 2), abs=1e-14)
    assert motion.point("S").position[1] == pytest.approx([2 * np.cos(bar), 2 * np.sin(bar)], abs=1e-14)
