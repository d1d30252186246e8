"""Variants with friction are worked out together, and are what each of them is alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from virtualwork import Friction, Guess, Input, Link, Mechanism, Torque
from virtualwork.family.part import Part

Q = np.linspace(0.0, 2 * np.pi, 25)
PINS = (("A", "crank"), ("B", "coupler"), ("C", "rocker"), ("D", "rocker"))


def four_bar(joints: str, coefficient: float = 0.2, speed: float = 5.0) -> Mechanism:
    """A crank-rocker whose pins rub."""
    bars = {
        "crank": Link({"A": 0j, "B": 0.04}, 0.3, 0.015, 5e-5),
        "coupler": Link({"B": 0j, "C": 0.12}, 0.8, 0.06 + 0.02j, 1.2e-3),
        "rocker": Link({"D": 0j, "C": 0.08}, 0.5, 0.04 - 0.01j, 5e-4),
    }
    return Mechanism(
        {"A": 0j, "D": 0.1 + 0j},
        bars,
        inputs=Input(link="crank", speed=speed),
        guess=Guess(0.7, {"coupler": 0.3, "rocker": 1.0}),
        gravity=-9.81j,
        torques=[Torque("rocker", -3.0)],
        friction=[Friction(joint, coefficient, 0.006) for joint in joints],
    )


@pytest.mark.parametrize("joints", ["A", "BD", "ABCD"])
@pytest.mark.parametrize("path", ["links.crank.B.x", "links.coupler.mass", "friction.1.coefficient"])
def test_variants_together_are_what_each_is_alone(
    joints: str, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def alone(*_: Any) -> Any:
        raise AssertionError("a variant was described alone")

    m = four_bar(joints)
    values = m.value(path).real * np.array([0.7, 1.0, 1.04])
    with monkeypatch.context() as patch:
        patch.setattr(Part, "poses", alone)
        motion = m.vary({path: values}).motion(Q)
        effort, forces = motion.effort, [motion.reaction(*pin) for pin in PINS]
    for i, value in enumerate(values):
        one = m.changed({path: value}).motion(Q)
        np.testing.assert_allclose(effort[i], one.effort, rtol=1e-12)
        for pin, force in zip(PINS, forces, strict=True):
            size = np.abs(one.reaction(*pin)).max()
            np.testing.assert_allclose(force[i], one.reaction(*pin), rtol=0, atol=1e-12 * size)


def test_poses_that_lock_or_do_not_assemble_are_left_out() -> None:
    """A friction far too large locks some poses; a crank far too long does not go round."""
    m = four_bar("ABCD", 9.0)
    for path, values in (("friction.1.coefficient", (0.1, 9.0, 30.0)), ("links.crank.B.x", (0.04, 0.11))):
        effort = m.vary({path: np.array(values)}).motion(Q).effort
        for i, value in enumerate(values):
            one = m.changed({path: value}).motion(Q)
            assert np.isnan(one.effort).any()
            assert one.dynamics.locked.any() or not one.assembled.all()
            np.testing.assert_array_equal(np.isnan(effort[i]), np.isnan(one.effort))
            np.testing.assert_allclose(effort[i], one.effort, rtol=1e-9)


def test_at_rest_nothing_rubs() -> None:
    still, free = four_bar("AB", speed=0.0), four_bar("", speed=0.0)
    values = {"links.crank.B.x": np.array([0.03, 0.04])}
    np.testing.assert_allclose(
        still.vary(values).motion(Q).effort, free.vary(values).motion(Q).effort, rtol=1e-13
    )
