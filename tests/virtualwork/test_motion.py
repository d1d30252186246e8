"""What is asked is solved, once, and nothing else; and it is right."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.formulas.closed_forms import angle_and_slide, cross, turning_slide, two_angles, two_slides
from virtualwork.plan.steps import Group

R = math.radians


@pytest.fixture
def klann():
    g = 350 + 360 * complex(math.cos(R(10)), math.sin(R(10)))
    h = 360 + 430 * complex(math.cos(R(-40)), math.sin(R(-40)))
    return Mechanism(
        {"A": (0, 90), "D": (350, 0), "E": (290, 230)},
        {
            "crank": Link({"A": 0j, "B": 120 + 0j}),
            "coupler": Link({"B": 0j, "C": 350 + 0j, "G": g}),
            "rocker": Link({"D": 0j, "C": 140 + 0j}),
            "arm": Link({"E": 0j, "F": 270 + 0j}),
            "leg": Link({"F": 0j, "G": 360 + 0j, "H": h}),
        },
        inputs=Input(link="crank"),
        guess=Guess(R(60), {"coupler": R(-15), "rocker": R(60), "arm": R(45), "leg": R(-60)}),
    )


def groups(motion):
    return [(step.name, order) for step, order in motion.solved if isinstance(step, Group)]


def test_only_what_is_asked_is_solved_and_never_twice(klann):
    motion = klann.motion(np.linspace(0, 6, 50), speed=2.0)
    assert motion.solved == []
    _ = motion.point("C").position
    assert groups(motion) == [("coupler + rocker", 0)]
    _ = motion.point("C").position
    _ = motion.link("rocker").angle
    assert groups(motion) == [("coupler + rocker", 0)]
    _ = motion.point("H").position
    assert groups(motion) == [("coupler + rocker", 0), ("arm + leg", 0)]
    _ = motion.link("rocker").alpha
    assert groups(motion)[2:] == [("coupler + rocker", 1), ("coupler + rocker", 2)]
    assert not [name for name, order in groups(motion) if order and name == "arm + leg"]


def test_positions_build_no_jacobian(klann, monkeypatch):
    import virtualwork.formulas.rates as state

    def never(*_):
        raise AssertionError("a Jacobian was built")

    klann.assembly.track.cover(0.0, 6.0)
    monkeypatch.setattr(state, "columns", never)
    _ = klann.motion(np.linspace(0, 6, 50)).point("H").position
    with pytest.raises(AssertionError, match="Jacobian"):
        _ = klann.motion(1.0, speed=1.0).point("H").velocity


def test_one_pose_and_many_are_the_same(klann):
    q = np.linspace(0, 2 * np.pi, 9001)
    swept = klann.motion(q, speed=3.0, acceleration=2.0)
    for i in (0, 17, 4095, 4096, 8192, 9000):
        one = klann.motion(q[i], speed=3.0, acceleration=2.0)
        for quantity in ("position", "velocity", "acceleration", "jerk"):
            a = getattr(swept.point("H"), quantity)[i]
            b = getattr(one.point("H"), quantity)[0]
            assert a == pytest.approx(b, rel=1e-12, abs=1e-10)


def test_rates_in_time_follow_the_chain_rule(klann):
    """x(t) with q = 1 + 2t + 1.5t² + t³/3: derivatives against a polynomial fit of positions."""
    t = np.cos(np.pi * (np.arange(24) + 0.5) / 24) * 0.05
    q = 1 + 2 * t + 1.5 * t**2 + t**3 / 3
    fit = np.polynomial.Chebyshev.fit(t, klann.motion(q).point("H").complex(0).real, 15)
    motion = klann.motion(1.0, speed=2.0, acceleration=3.0, jerk=2.0)
    found = [motion.point("H").complex(k).real[0] for k in (1, 2, 3)]
    assert found == pytest.approx([fit.deriv(k)(0.0) for k in (1, 2, 3)], rel=1e-7)


def test_speeds_may_differ_from_pose_to_pose(klann):
    q = np.array([0.3, 1.0, 2.0])
    speed = np.array([1.0, -2.0, 0.0])
    motion = klann.motion(q, speed=speed)
    unit = klann.motion(q, speed=1.0)
    assert motion.link("leg").omega == pytest.approx(unit.link("leg").omega * speed, rel=1e-14)


def test_several_inputs():
    """A five-bar: the point C lies on both circles, and its velocity is linear in the two speeds."""
    m = Mechanism(
        {"A": (0, 0), "E": (4, 0)},
        {"left": Link({"A": (0, 0), "B": (2, 0)}), "up": Link({"B": (0, 0), "C": (3, 0)}),
         "down": Link({"D": (0, 0), "C": (3, 0)}), "right": Link({"E": (0, 0), "D": (2, 0)})},
        inputs=[Input(link="left"), Input(link="right")],
        guess=Guess((2.0, 1.0), points={"C": (2, 4)}),
    )  # fmt: skip
    q = np.array([[2.0, 1.0], [1.9, 1.2]])
    motion = m.motion(q, speed=[1.0, 2.0], acceleration=[0.0, 1.0])
    c, b, d = (motion.point(p).complex(0) for p in "CBD")
    assert np.abs(c - b) == pytest.approx([3, 3], rel=1e-15)
    assert np.abs(c - d) == pytest.approx([3, 3], rel=1e-15)
    k = [motion.point("C").coefficient(j) for j in (0, 1)]
    assert motion.point("C").complex(1) == pytest.approx(1.0 * k[0] + 2.0 * k[1], rel=1e-13)
    t = np.cos(np.pi * (np.arange(16) + 0.5) / 16) * 0.02
    path = m.motion(np.stack([2.0 + t, 1.0 + 2 * t + t * t / 2], axis=1)).point("C").complex(0)
    fit = np.polynomial.Chebyshev.fit(t, path.imag, 12)
    assert motion.point("C").complex(2).imag[0] == pytest.approx(fit.deriv(2)(0.0), rel=1e-8)


def test_an_input_between_two_moving_links_and_at_a_slide():
    four = {"crank": Link({"A": (0, 0), "B": (4, 0)}), "coupler": Link({"B": (0, 0), "C": (12, 0)}),
            "rocker": Link({"D": (0, 0), "C": (8, 0)})}  # fmt: skip
    m = Mechanism({"A": (0, 0), "D": (10, 0)}, four, inputs=Input(link="coupler", on="crank"),
                  guess=Guess(-0.7, {"crank": 1.0, "coupler": 0.3, "rocker": 1.0}))  # fmt: skip
    motion = m.motion([-0.7, -0.6], speed=2.0)
    assert motion.link("coupler").angle - motion.link("crank").angle == pytest.approx([-0.7, -0.6], abs=1e-14)
    assert motion.link("coupler").omega - motion.link("crank").omega == pytest.approx([2, 2], abs=1e-13)
    boom = Mechanism(
        {"A": (0, 0), "P": (1, -0.5)},
        {"boom": Link({"A": (0, 0), "B": (2, 0)}), "cylinder": Link({"P": (0, 0)}),
         "rod": Link({"B": (0, 0), "R": (-1, 0)})},
        [Guide("R", "rod", "cylinder", "P", 0.0, 0.0)],
        inputs=Input(slider="R"),
        guess=Guess(0.6, {"boom": 0.5}),
    )  # fmt: skip
    motion = boom.motion([0.6, 0.8], speed=0.1)
    assert np.abs(motion.point("B").complex(0) - (1 - 0.5j)) == pytest.approx([1.6, 1.8], rel=1e-15)
    low, high = sorted(limit.input for limit in boom.assembly.reach.limits())
    reach = math.hypot(1, 0.5)
    assert (low, high) == pytest.approx((2 - reach - 1, 2 + reach - 1), rel=1e-12)


def test_gears():
    """Sun, planet and fixed ring (Willis), and a wheel meshing with a coupler keeps count of its turns."""
    m = Mechanism(
        {"O": (0, 0)},
        {"sun": Link({"O": (0, 0)}), "arm": Link({"O": (0, 0), "P": (3, 0)}), "planet": Link({"P": (0, 0)})},
        gears=[Gear(("sun", "planet"), -2.0, "arm"), Gear(("planet", "ground"), 0.25, "arm")],
        inputs=Input(link="sun"),
    )
    motion = m.motion(0.5, speed=6.0)
    assert motion.link("arm").omega[0] == pytest.approx(2.0, rel=1e-15)
    assert motion.link("planet").omega[0] == pytest.approx(-6.0, rel=1e-15)
    m = Mechanism(
        {"A": (0, 0), "D": (2, 0)},
        {"crank": Link({"A": (0, 0), "B": (5, 0)}), "coupler": Link({"B": (0, 0), "C": (5, 0)}),
         "rocker": Link({"D": (0, 0), "C": (4.5, 0)}), "wheel": Link({"D": (0, 0)})},
        gears=[Gear(("rocker", "wheel"), 1.3)],
        inputs=Input(link="crank"),
        guess=Guess(0.5, {"coupler": 0.0, "rocker": 0.7, "wheel": 0.1}),
    )  # fmt: skip
    q = np.linspace(0.5, 0.5 + 8 * np.pi, 4001)
    motion = m.motion(q, speed=1.0)
    rocker, wheel = (np.unwrap(motion.link(name).angle) for name in ("rocker", "wheel"))
    assert wheel[0] == pytest.approx(0.1, abs=1e-15)
    assert wheel - wheel[0] == pytest.approx(1.3 * (rocker - rocker[0]), abs=1e-11)
    assert abs(rocker[-1] - rocker[0]) == pytest.approx(8 * np.pi, abs=1e-10)


finite = st.floats(-3, 3)
point = st.builds(complex, finite, finite)
length = st.floats(0.05, 3)


@settings(max_examples=200, deadline=None)
@given(w=point, v1=point, v2=point, sign=st.sampled_from([1, -1]))
def test_two_angles_close_on_the_side_asked_for(w, v1, v2, sign):
    if min(abs(w), abs(v1), abs(v2)) < 0.05:
        return
    e1, e2, margin = two_angles(w, v1, v2, sign)
    if not margin > 1e-8:
        return
    size = abs(w) + abs(v1) + abs(v2)
    assert abs(w + v1 * e1 + v2 * e2) < 1e-11 * size
    assert abs(abs(e1) - 1) < 1e-8
    assert cross(v1 * e1, v2 * e2) * sign > 0
    assert margin == pytest.approx((cross(v1 * e1, v2 * e2) / abs(v1) / abs(v2)) ** 2, rel=1e-4, abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(w=point, v=point, angle=st.floats(-3, 3), sign=st.sampled_from([1, -1]))
def test_angle_and_slide_both_kinds(w, v, angle, sign):
    u = complex(math.cos(angle), math.sin(angle))
    if min(abs(w), abs(v)) < 0.05:
        return
    e, s, margin = angle_and_slide(w, v, u, sign)
    if margin > 1e-8:
        assert abs(w + v * e + s * u) < 1e-12 * (abs(w) + abs(v))
        assert abs(e) == pytest.approx(1, abs=1e-12)
    e, s, margin = turning_slide(w, v, u, sign, 1.0)
    if margin > 1e-8:
        assert abs(w + (v + s * u) * e) < 1e-12 * (abs(w) + abs(v))
        assert abs(e) == pytest.approx(1, abs=1e-7)


def test_two_slides_cut():
    u, v = np.exp(0.3j), np.exp(1.9j)
    s, t, _ = two_slides(-2 * u - 3 * v, u, v)
    assert (s, t) == pytest.approx((2, 3), rel=1e-14)


def test_every_assembly(klann):
    """Four of them at 60 degrees: both dyads close in two ways."""
    found = klann.assemblies()
    assert len(found) == 4
    assert found[0].signs == klann.assembly.signs
    assert len({tuple(a.signs.values()) for a in found}) == 4


def test_every_assembly_of_a_group_without_a_closed_form(random_mechanism):
    rng = np.random.default_rng(3)
    m = random_mechanism("triad", rng)
    found = m.assemblies()
    assert 1 < len(found) <= 6  # a triad with three pins has six at most
    for a in found:
        state = a.state(m.at)
        for closure in a.merged[1].closures:
            from virtualwork.formulas.positions import loop

            assert abs(np.ravel(loop(closure, state))[0]) < 1e-12 * m.size


@pytest.mark.parametrize("kind", ["four-bar", "triad"])
def test_a_motion_of_no_poses_has_no_numbers(kind: str, random_mechanism: Any) -> None:
    motion = random_mechanism(kind, np.random.default_rng(2)).motion(np.array([]))
    link = next(iter(motion.mechanism.links))
    pin = next(iter(motion.mechanism.links[link].points))
    assert motion.assembled.shape == motion.effort.shape == motion.link(link).alpha.shape == (0,)
    assert motion.point(pin).jerk.shape == (0, 2)
    assert motion.point(pin).error_estimate(0).shape == (0,)
