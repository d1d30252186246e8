"""One pose of a motion, asked for again and again: the same numbers as seldom, together or one by one, and bad input."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.scenes import four_bar, klann
from virtualwork.formulas.forces import Effort, Reaction
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.lanes import OFTEN

PINS = (("A", "crank"), ("B", "coupler"), ("C", "rocker"), ("D", "rocker"))


def test_a_loop_over_poses_has_the_numbers_of_the_sweep() -> None:
    m = four_bar(loaded=True)
    angles = np.random.default_rng(1).uniform(0.0, 2 * np.pi, 3 * OFTEN)
    sweep = m.motion(angles, speed=10.0)
    for i, angle in enumerate(angles.tolist()):
        motion = m.motion(angle, speed=10.0)
        assert motion.effort == pytest.approx(sweep.effort[i : i + 1], rel=1e-11, abs=1e-11)
        for pin in PINS:
            assert motion.reaction(*pin)[0] == pytest.approx(sweep.reaction(*pin)[i], rel=1e-11, abs=1e-11)
        # what was handed out once stays as it is, alone and beside others
        keys = [Effort(0), Reaction(*PINS[1]), Angle("rocker", 1)]
        effort, reaction, omega = motion.values(keys)
        assert effort == motion.effort
        assert (np.array([[reaction[0].real, reaction[0].imag]]) == motion.reaction(*PINS[1])).all()
        assert omega == motion.link("rocker").omega


def test_arrays_of_one_pose_are_the_callers_own() -> None:
    m = klann()
    for _ in range(2 * OFTEN):
        motion = m.motion(1.0, speed=2.0)
        first = motion.point("H").velocity
        kept = first.copy()
        first += 1.0
        assert (motion.point("H").velocity == kept).all()


def test_a_pose_that_cannot_be_assembled_has_no_number_however_often() -> None:
    m = klann().changed({"links.crank.B.x": 2.0})
    for _ in range(2 * OFTEN):
        motion = m.motion(3.0, speed=1.0)
        assert not motion.assembled[0]
        assert np.isnan(motion.point("H").position).all()


def test_own_rates_other_numbers_and_refusals() -> None:
    m = klann()
    for _ in range(2 * OFTEN):
        own = m.motion(1.0)
        assert own.link("leg").omega == m.motion([1.0]).link("leg").omega
        assert m.motion(1, speed=2).n == 1
        assert own.n == 1
        assert own.inputs.shape == (1, 1)
    with pytest.raises(ValueError, match="speed"):
        m.motion(1.0, speed="fast")


@pytest.mark.parametrize("angle", [float("inf"), -float("inf"), float("nan")])
def test_an_angle_that_is_no_number_cannot_be_assembled(angle: float) -> None:
    m = four_bar(loaded=True)
    for _ in range(2 * OFTEN):
        for at in (angle, [angle]):
            motion = m.motion(at, speed=10.0)
            assert not motion.assembled[0]
            # the crank's own speed depends on no angle
            for link in ("crank", "rocker"):
                assert np.isnan(motion.link(link).omega).all()
            assert np.isnan(motion.point("C").acceleration).all()
            assert np.isnan(motion.effort).all()
    shown = m.evaluator("C.x", "crank.omega", "crank.torque")(angle, speed=10.0)
    assert all(np.isnan(x) for x in shown.values())


def test_both_coordinates_of_a_point_by_an_evaluator() -> None:
    """Of one pose they are two numbers of one vector; a name that is requested twice is as good."""
    m = klann()
    many = m.evaluator("H", "points.H", "H.x")([1.0], 3.0, 1.0)
    one = m.evaluator("H", "points.H", "H.x")(1.0, 3.0, 1.0)
    assert list(one) == list(many) == ["H.x", "H.y", "H.vx", "H.vy", "H.ax", "H.ay", "points.H"]
    for name, value in many.items():
        assert one[name] == pytest.approx(value[0], rel=1e-13)
    assert one["points.H"] == (one["H.x"], one["H.y"])


@pytest.mark.parametrize("speed", [3, np.float32(3.0), np.array(3.0), [3.0], np.array([3.0])])
def test_an_evaluator_takes_the_speeds_of_a_motion(speed: object) -> None:
    """In float32 the fast way had eight digits, and of an array none."""
    at = klann().evaluator("H.vx")
    assert at(1.0, speed)["H.vx"] == pytest.approx(at(1.0, 3.0)["H.vx"], rel=1e-14)


def test_an_evaluator_refuses_what_is_no_speed() -> None:
    with pytest.raises(ValueError, match="speed: expected real numbers, found 'fast'"):
        klann().evaluator("H.vx")(1.0, "fast")
