"""A fixed pin in a moving slot: the same mechanism as one with a massless block pinned to the ground there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from virtualwork import Force, Friction, Guess, Guide, Input, Link, Mechanism
from virtualwork.study.check import Check

TURN = np.radians(np.arange(0.0, 360.0, 7.0))
GROUND = {"O": (0, 0), "P": (0.3, 0.05)}


def swinging_rod(pin: bool, **more: Any) -> Mechanism:
    """A crank whose rod slides over a pin (pin) or in a block (not pin) that stands fast."""
    links = {
        "crank": Link({"O": (0, 0), "A": (0.1, 0)}, 0.5, (0.05, 0), 1e-3),
        "rod": Link({"A": (0, 0), "E": (0.5, 0.02)}, 0.8, (0.25, 0.01), 0.02),
    }
    if pin:
        guides = [Guide("P", "ground", "rod", "A", 0.1)]
    else:
        links["block"] = Link({"P": (0, 0)})
        guides = [Guide("P", "block", "rod", "A", 0.1, 0.0)]
    forces = [Force("rod", 0.5 + 0.02j, 20 - 7j)]
    guess = Guess(1.0, {"rod": 0.0})
    return Mechanism(
        GROUND, links, guides, inputs=Input("crank"), guess=guess, gravity=-9.81j, forces=forces, **more
    )


def test_the_motion_is_that_of_a_pinned_block():
    a, b = (swinging_rod(pin).motion(TURN, speed=3.0, acceleration=2.0) for pin in (True, False))
    for got, expected in (
        (a.point("E").acceleration, b.point("E").acceleration),
        (a.link("rod").omega, b.link("rod").omega),
        (a.slide("P").position, b.slide("P").position),
        (a.slide("P").speed, b.slide("P").speed),
    ):
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12)
    assert a.point("P").position == pytest.approx(np.tile([0.3, 0.05], (len(TURN), 1)))
    # the pin lies on the slot's line
    along = np.exp(1j * (a.link("rod").angle + 0.1)) * a.slide("P").position
    np.testing.assert_allclose(a.point("A").complex(0) + along, 0.3 + 0.05j, rtol=1e-13)


@pytest.mark.parametrize("friction", [0.0, 0.15])
def test_its_forces_are_those_of_a_pinned_block(friction):
    more = {"friction": [Friction("P", friction)]} if friction else {}
    a, b = (swinging_rod(pin, **more).motion(TURN, speed=3.0, acceleration=2.0) for pin in (True, False))
    np.testing.assert_allclose(a.effort, b.effort, rtol=1e-9)
    np.testing.assert_allclose(a.effort, a.dynamics.newton_euler[:, 0], rtol=1e-10)
    np.testing.assert_allclose(a.reaction("A", "rod"), b.reaction("A", "rod"), rtol=1e-9)
    np.testing.assert_allclose(a.reaction("P", "rod"), b.reaction("P", "rod"), rtol=1e-9)
    np.testing.assert_allclose(a.reaction("P", "ground"), -a.reaction("P", "rod"), rtol=1e-12)
    if not friction:
        rail = np.exp(1j * (a.link("rod").angle + 0.1))
        force = a.reaction("P", "rod") @ [1, 1j]
        assert np.abs((force * rail.conj()).real).max() < 1e-11 * np.abs(force).max()
        bound = a.dynamics.error_estimate()
        assert (np.abs(a.effort - b.effort) <= bound.effort[:, 0] * 2).all()


def test_its_check_counts_as_the_block_does():
    a, b = (Check(swinging_rod(pin).assembly) for pin in (True, False))
    assert (a.mobility, a.mobility_by_rank, a.redundant) == (1, 1, ())
    assert b.mobility == 1
    assert a.dead_points == b.dead_points == ()


def test_a_rail_that_slides_through_a_fixed_block_keeps_its_direction():
    """A Scotch yoke turned about: the rail moves on the block as the crank's pin drives its cross slot."""
    m = Mechanism(
        {"O": (0, 0), "B": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (0.1, 0)}), "yoke": Link({"Y": (0, 0), "T": (0.3, 0)}, 2.0)},
        [Guide("B", "ground", "yoke", "Y", 0.0, 0.0), Guide("A", "crank", "yoke", "Y", math.pi / 2)],
        inputs=Input("crank"),
    )
    motion = m.motion(TURN, speed=4.0)
    np.testing.assert_allclose(motion.point("T").position[:, 0], 0.1 * np.cos(TURN) + 0.3, rtol=1e-14)
    np.testing.assert_allclose(motion.slide("B").position, -0.1 * np.cos(TURN), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(
        motion.effort, 2.0 * 0.01 * 16 * np.cos(TURN) * np.sin(TURN), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(motion.effort, motion.dynamics.newton_euler[:, 0], rtol=1e-10, atol=1e-13)


def test_a_fixed_pin_may_be_driven_along_the_moving_slot():
    m = Mechanism(
        GROUND,
        {"arm": Link({"O": (0, 0), "C": (0.2, 0)}, 1.0, (0.1, 0)), "rod": Link({"C": (0, 0), "E": (0.6, 0)})},
        [Guide("P", "ground", "rod", "C", 0.0)],
        inputs=Input(slider="P"),
        guess=Guess(0.3, {"arm": 1.0, "rod": -1.0}),
        gravity=-10j,
    )
    motion = m.motion(np.array([0.28, 0.3, 0.32]), speed=0.1)
    gap = np.abs(motion.point("C").complex(0) - (0.3 + 0.05j))
    np.testing.assert_allclose(gap, [0.28, 0.3, 0.32], rtol=1e-13)
    np.testing.assert_allclose(motion.effort, motion.dynamics.newton_euler[:, 0], rtol=1e-11)


def test_a_file_names_the_ground_as_the_link_of_a_slot():
    text = """
    ground = { O = [0, 0], P = [0.3, 0] }
    input = { link = "crank", angle = "60 deg" }
    guess = { at = "60 deg", rod = 0 }
    [links]
    crank = { points = { O = [0, 0], A = [0.1, 0] } }
    rod = { points = { A = [0, 0], E = [0.5, 0] } }
    [[slots]]
    point = "P"
    link = "ground"
    on = "rod"
    through = "A"
    """
    m = Mechanism.from_toml_text(text, "file")
    assert m.guides[0].link == "ground"
    assert Mechanism.from_toml_text(text.replace('link = "ground"\n', ""), "file").guides == m.guides
    assert math.hypot(0.3 - 0.05, 0.1 * math.sin(math.pi / 3)) == pytest.approx(
        m.motion().slide("P").position[0]
    )


def test_an_unknown_point_of_the_ground_is_named():
    with pytest.raises(ValueError, match="point of ground 'Q'"):
        Mechanism(
            GROUND,
            {"crank": Link({"O": (0, 0), "A": (0.1, 0)}), "rod": Link({"A": (0, 0)})},
            [Guide("Q", "ground", "rod", "A")],
            inputs=Input("crank"),
        )
