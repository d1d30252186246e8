"""Change points of one loop and limits of another on the same crank, and an input asked beyond all reach."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.describe import MechanismError
from virtualwork.study.check import Check


def both() -> Mechanism:
    """A parallelogram, and from the same pin a rocker that the crank cannot carry all the way round."""
    return Mechanism(
        {"A": (0, 0), "D": (5, 0), "E": (0, 4)},
        {
            "crank": Link({"A": (0, 0), "B": (2, 0)}),
            "coupler": Link({"B": (0, 0), "C": (5, 0)}),
            "rocker": Link({"D": (0, 0), "C": (2, 0)}),
            "rod": Link({"B": (0, 0), "F": (5, 0)}),
            "lever": Link({"E": (0, 0), "F": (2, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(
            math.radians(270), {"coupler": 0.0, "rocker": math.radians(270), "rod": 1.9, "lever": 3.4}
        ),
    )


def test_the_one_loop_does_not_hide_the_other() -> None:
    m = both()
    check = Check(m.assembly)
    # EB = 3 stretches rod and lever against one another: its crank's angle to the line AE, as of a triangle 2, 4, 3
    reach = math.degrees(math.acos((4 + 16 - 9) / 16))
    limits = np.degrees(check.input_limits or ())
    assert sorted(limits % 360) == pytest.approx([90 - reach, 90 + reach], abs=1e-10)
    assert sorted(np.degrees(check.change_points) % 360) == pytest.approx([0, 180], abs=1e-10)
    q = np.radians(np.arange(150.0, 391.0, 5.0))
    motion = m.motion(q, speed=1.0)
    assert motion.assembled.all()
    assert np.abs(np.exp(1j * motion.link("rocker").angle) - np.exp(1j * q)).max() < 1e-12
    far = m.motion(q + 40 * math.pi)
    assert np.abs(np.exp(1j * far.link("rocker").angle) - np.exp(1j * q)).max() < 1e-11
    assert far.point("F").complex(0) == pytest.approx(motion.point("F").complex(0), abs=1e-11)
    assert not m.motion(math.radians(90)).assembled[0]


@pytest.mark.parametrize("turns", [30_000, -30_000])
def test_an_input_too_many_turns_away_is_refused_at_once(turns: int) -> None:
    m = both()
    with pytest.raises(MechanismError, match="turns away from the guess"):
        m.motion(m.at[0] + 2 * math.pi * turns).assembled  # noqa: B018


def test_a_change_point_and_limits_in_one_loop() -> None:
    """2 + 4 = 5 + 1: stretched at 180° the linkage may fold over; it reaches no further than d = 5 − 1, cos θ = 1/4."""
    m = Mechanism(
        {"A": (0, 0), "D": (4, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (2, 0)}),
            "coupler": Link({"B": (0, 0), "C": (5, 0)}),
            "rocker": Link({"D": (0, 0), "C": (1, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(math.radians(120), {"coupler": 0.2, "rocker": 1.2}),
    )
    check = Check(m.assembly)
    edge = math.degrees(math.acos(0.25))
    assert np.degrees(check.input_limits) == pytest.approx([edge, 360 - edge], abs=1e-10)
    assert np.degrees(check.change_points) == pytest.approx([180], abs=1e-10)
    q = np.radians(np.arange(76.0, 285.0))
    motion = m.motion(q, speed=1.0)
    assert motion.assembled.all()
    # through 180° by the tangent: the angles run on smoothly, and the triangle BDC turns over
    rocker = np.unwrap(motion.link("rocker").angle)
    assert np.abs(np.diff(rocker, 2)).max() < 0.05
    c, b = motion.point("C").complex(0), motion.point("B").complex(0)
    side = ((4 - b).conjugate() * (c - b)).imag
    assert (side[q < 3.14] > 0).all() != (side[q > 3.15] > 0).all()
    # at 180° B, C and D lie at −2, 3 and 4: the velocity of C from both sides, and its acceleration along the line
    at = m.motion(math.pi, speed=1.0)
    w3, w4 = at.link("coupler").omega[0], at.link("rocker").omega[0]
    assert -2 + 5 * w3 == pytest.approx(-w4, abs=1e-12)
    assert 2 - 5 * w3**2 == pytest.approx(w4**2, abs=1e-12)
