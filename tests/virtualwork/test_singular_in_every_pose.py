"""Mechanisms that are singular in every pose: named, no digit that does not hold, no change point that is none."""

from __future__ import annotations

import json
import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.study.check import Check

TURN = np.radians(np.arange(0.0, 361.0, 15.0))
LENGTH = 0.073


def bar_in_slots(tilt: float, carried: bool, **more: Any) -> Mechanism:
    """A bar with two pins in two parallel slots exactly its own length apart, behind a crank and a rod.

    `carried`: the rod runs in the first slot and carries the bar (a closed form); else it holds the bar in its middle
    (four unknowns together).
    """
    a = math.radians(tilt)
    along = complex(math.cos(a), math.sin(a))
    low = 0.01j
    links = {
        "crank": Link({"O": (0, 0), "A": (0.03, 0)}, 0.2, (0.01, 0)),
        "rod": Link({"A": (0, 0), "P" if carried else "C": (0.15, 0)}),
        "bar": Link({"P": (0, 0), "Q": (LENGTH, 0), "C": (0.03, 0.02)}, **more),
    }
    guides = [
        Guide("P", "rod" if carried else "bar", "ground", low, a),
        Guide("Q", "bar", "ground", low + 1j * along * LENGTH, a),
    ]
    guess = Guess(1.0, {"rod": 0.0, "bar": a + math.pi / 2})
    return Mechanism({"O": (0, 0)}, links, guides, inputs=Input("crank"), guess=guess, gravity=-10j)


def turned_by_rounding(m: Mechanism, tilt: float) -> float:
    """The angle by which the bar is off for the digits of its length and of the slots' distance alone; exactly.

    At 90° the guides stand at a quarter turn in every digit, and their distance is the bar's length: by none.
    """
    with mp.workdps(40):
        first, second = (guide.through for guide in m.guides)
        assert isinstance(first, complex)
        assert isinstance(second, complex)
        along = mp.mpc(0, 1) ** int(tilt / 90) if tilt % 90 == 0 else mp.expj(mp.mpf(math.radians(tilt)))
        distance = mp.im(mp.conj(along) * (mp.mpmathify(second) - mp.mpmathify(first)))
        return float(mp.sqrt(2 * abs(distance / mp.mpf(LENGTH) - 1)))


@pytest.mark.parametrize("carried", [True, False])
@pytest.mark.parametrize("tilt", [0.0, 17.0, -33.3, 90.0, -90.0, 180.0])
def test_places_hold_and_rates_are_left_out(tilt, carried):
    m = bar_in_slots(tilt, carried)
    motion = m.motion(TURN, speed=1.0, acceleration=0.0)
    assert motion.assembled.all()
    upright = np.exp(1j * (math.radians(tilt) + math.pi / 2))
    assert np.abs(np.exp(1j * motion.link("bar").angle) - upright).max() < 1e-14
    both = motion.point("P").complex(0) + LENGTH * upright
    assert np.abs(motion.point("Q").complex(0) - both).max() < 1e-15
    for rate in (motion.link("bar").omega, motion.link("bar").alpha, motion.slide("Q").speed):
        assert np.isnan(rate).all()
    # no number, no estimate
    assert np.isnan(motion.link("bar").error_estimate(1)).all()
    # what does not hang on the bar is solved as ever
    assert np.isfinite(motion.point("A").acceleration).all()
    assert np.isfinite(motion.link("rod").omega).all() == carried
    assert np.isinf(motion.condition).all()
    # the dimensions as they are rounded may move the bar by the root of a rounding
    estimate = motion.link("bar").error_estimate()
    assert (estimate < 1e-6).all()
    assert (estimate >= turned_by_rounding(m, tilt)).all()


@pytest.mark.slow
def test_the_estimate_covers_the_digits_of_the_slots_at_any_tilt(first_seed):
    rng = np.random.default_rng(first_seed)
    for tilt in rng.uniform(-180.0, 180.0, 60).tolist():
        for carried in (True, False):
            m = bar_in_slots(tilt, carried)
            estimate = m.motion(TURN[::6]).link("bar").error_estimate()
            assert (estimate >= turned_by_rounding(m, tilt)).all(), tilt
            assert (estimate < 1e-6).all(), tilt


@pytest.mark.parametrize("carried", [True, False])
@pytest.mark.parametrize("tilt", [0.0, 17.0])
def test_there_is_no_change_point_and_no_dead_point(tilt, carried):
    m = bar_in_slots(tilt, carried)
    check = Check(m.assembly)
    assert check.change_points == check.dead_points == ()
    assert check.singular == ("bar" if carried else "rod + bar",)
    assert (check.mobility, check.mobility_by_rank) == (1, 2)
    (text,) = m.assembly.track.warnings()
    assert text.startswith("singular in every pose: the two assemblies of ")
    assert "is not determined" in text


@pytest.mark.parametrize("q", [0.0, 0.7, 3.0])
def test_one_pose_alone_is_the_same(q):
    m = bar_in_slots(17.0, carried=False)
    one, many = m.motion(q, speed=2.0), m.motion(np.array([q, 1.0, 2.0]), speed=2.0)
    assert one.point("C").position[0] == pytest.approx(many.point("C").position[0], abs=1e-16)
    assert np.isnan(one.link("bar").omega[0])


def test_forces_that_hang_on_it_are_left_out_and_others_come():
    heavy = bar_in_slots(0.0, carried=True, mass=1.0, center=(0.02, 0.01)).motion(TURN)
    assert np.isnan(heavy.effort).all()
    # slots that pinch the bar press on it without any load, but no work goes through a bar that weighs nothing
    light = bar_in_slots(0.0, carried=True).motion(TURN)
    np.testing.assert_allclose(light.effort, 0.2 * 10 * 0.01 * np.cos(TURN), rtol=1e-13, atol=1e-17)
    assert np.isnan(light.reaction("Q", "bar")).all()


def test_with_several_inputs_too():
    m = Mechanism(
        {"O": (0, 0)},
        {
            "crank": Link({"O": (0, 0), "A": (0.03, 0)}),
            "arm": Link({"A": (0, 0), "B": (0.1, 0), "S": (0.1, 0.05)}),
            "bar": Link({"B": (0, 0), "T": (0.05, 0)}),
        },
        [Guide("T", "bar", "arm", "S", 0.0)],
        inputs=[Input("crank"), Input("arm")],
        guess=Guess((1.0, 0.3), {"bar": 1.9}),
    )
    motion = m.motion(np.array([[1.0, 0.3], [2.0, 0.1], [0.5, -0.4]]), speed=1.0)
    turned = np.exp(1j * (motion.link("bar").angle - motion.link("arm").angle))
    assert np.abs(turned - 1j).max() < 1e-15
    assert np.isnan(motion.link("bar").omega).all()


@pytest.mark.slow
def test_the_command_names_it(dalembert, tmp_path):
    a = math.radians(17)
    text = f"""
    ground = {{ O = [0, 0] }}
    input = {{ link = "crank", angle = 1.0, speed = 1.0, acceleration = 0 }}
    guess = {{ at = 1.0, rod = 0, bar = {a + math.pi / 2} }}
    links.crank.points = {{ O = [0, 0], A = [0.03, 0] }}
    links.rod.points = {{ A = [0, 0], C = [0.15, 0] }}
    links.bar.points = {{ P = [0, 0], Q = [{LENGTH}, 0], C = [0.03, 0.02] }}
    slots = [
      {{ point = "P", link = "bar", through = [0, 0.01], angle = {a} }},
      {{ point = "Q", link = "bar", through = [{-LENGTH * math.sin(a)!r}, {0.01 + LENGTH * math.cos(a)!r}], angle = {a} }},
    ]
    """
    file = tmp_path / "bar.toml"
    file.write_text(text)
    run = dalembert("forces", str(file), "--over", "0deg:360deg:30deg", "--json")
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout)
    assert any("singular in every pose" in w and "not determined" in w for w in found["warnings"])
    assert not any("dead or change point" in w or "two assemblies meet" in w for w in found["warnings"])
    check = json.loads(dalembert("inspect", str(file), "--json").stdout)["check"]
    assert check["change_points_deg"] == []
    assert check["singular"] == ["rod + bar"]
    for pose in found["poses"]:
        assert pose["assembled"]
        assert pose["marks"] == []
        assert pose["condition"] is None
        assert pose["links"]["bar"]["angle_deg"] == pytest.approx(107, abs=1e-12)
        assert pose["links"]["bar"]["alpha_rad_s2"] is None
        assert pose["links"]["crank"]["omega_rad_s"] == 1
