"""A wheel geared one to two with a coupler that two cranks swing through ±180°."""

from __future__ import annotations

import numpy as np

from virtualwork import Gear, Guess, Input, Link, Mechanism


def swinging() -> Mechanism:
    return Mechanism(
        {"A": (0, 0), "D": (0, 0.5), "W": (1, 1)},
        {
            "first": Link({"A": (0, 0), "B": (0.3, 0)}),
            "second": Link({"D": (0, 0), "E": (0.15, 0)}),
            "coupler": Link({"B": (0, 0), "C": (1.2, 0)}),
            "other": Link({"E": (0, 0), "C": (1.2, 0)}),
            "wheel": Link({"W": (0, 0), "R": (0.2, 0)}),
        },
        gears=[Gear(("coupler", "wheel"), 0.5)],
        inputs=[Input(link="first"), Input(link="second")],
        guess=Guess(at=(0.0, 0.0), angles={"coupler": 2.9, "other": -2.9, "wheel": 1.0}),
    )


def test_a_fractional_gear_on_a_coupler_does_not_jump_where_its_angle_wraps() -> None:
    m = swinging()
    t = np.linspace(0, 4 * np.pi, 400)
    motion = m.motion(np.stack([t, -t], axis=1))
    assert motion.assembled.all()
    coupler = np.unwrap(motion.link("coupler").angle)
    assert np.abs(coupler).max() > np.pi > np.abs(coupler).min()
    wheel = motion.link("wheel").angle
    turned = np.exp(1j * (wheel - wheel[0]))
    assert np.abs(turned - np.exp(0.5j * (coupler - coupler[0]))).max() < 1e-12
    # a pose asked alone stands as in the sweep
    alone = [m.motion(np.array([[q, -q]])).link("wheel").angle[0] for q in t[::40]]
    assert np.abs(np.exp(1j * np.array(alone)) - np.exp(1j * wheel[::40])).max() < 1e-12


def test_a_pose_behind_a_limit_has_no_number_of_turns() -> None:
    """Half a turn from the guess the pins stand too far apart; a whole turn from it they stand as at first."""
    m = swinging()
    m = Mechanism(
        m.ground | {"D": (0, 1.9)},
        m.links
        | {"coupler": Link({"B": (0, 0), "C": (1.0, 0)}), "other": Link({"E": (0, 0), "C": (1.0, 0)})},
        gears=m.gears,
        inputs=m.inputs,
        guess=Guess(at=(np.pi / 2, -np.pi / 2), angles={"coupler": 2.4, "other": -2.4, "wheel": 1.0}),
    )
    at = np.array([[0.5, -0.5], [1.5, -1.5], [2.5, -0.6]]) * np.pi
    assert m.motion(at).assembled.tolist() == [True, False, False]
