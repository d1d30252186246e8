"""Families, slopes and fits where a group slides twice (Scotch yoke, trammel), or where no input moves a part."""

from __future__ import annotations

import numpy as np
import pytest

from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.describe import MechanismError
from virtualwork.describe.dimensions import changed, dimensions, value
from virtualwork.family.tolerance import drawn_numbers, limits

Q = np.linspace(0.3, 6.0, 7)
W = 3.0


def yoke(r=0.05, slot=1.2, **link):
    """A crank whose pin runs in a slot that stands at an angle across a yoke, which slides along x."""
    return Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j, "P": r}), "yoke": Link({"S": 0j}, **link)},
        guides=[Guide("P", "crank", "yoke", "S", slot), Guide("S", "yoke", turned=0.0)],
        inputs=Input("crank", value=0.7, speed=W),
        tolerances={"links.crank.P.x": 1e-4, "slots.1.angle": 1e-3},
    )


def trammel(length=0.3, along=0.1, **link):
    """A bar whose ends run along x and along y: the ellipse of Archimedes."""
    bar = Link({"A": 0j, "B": length, "H": along}, **link)
    return Mechanism(
        {"O": 0j}, {"bar": bar}, guides=[Guide("A", "bar"), Guide("B", "bar", angle=np.pi / 2)],
        inputs=Input("bar", value=0.7, speed=W), tolerances={"links.bar.B.x": 1e-4},
    )  # fmt: skip


def test_slopes_of_a_scotch_yoke_are_those_of_its_closed_form():
    r, b = 0.05, 1.2
    s = yoke(r, b).motion(Q, W, 0.0).point("S")
    # x = r (cos q − sin q cot b)
    places = np.cos(Q) - np.sin(Q) / np.tan(b)
    speeds = -W * (np.sin(Q) + np.cos(Q) / np.tan(b))
    np.testing.assert_allclose(s.position[:, 0], r * places, rtol=1e-13)
    np.testing.assert_allclose(s.sensitivity("links.crank.P.x")[:, 0], places, rtol=1e-13)
    np.testing.assert_allclose(s.sensitivity("links.crank.P.x", 1)[:, 0], speeds, rtol=1e-13)
    np.testing.assert_allclose(
        s.sensitivity("slots.1.angle")[:, 0], r * np.sin(Q) / np.sin(b) ** 2, rtol=1e-13
    )


def test_slopes_of_a_trammel_are_those_of_its_closed_form():
    motion = trammel().motion(Q, W, 0.0)
    # A = (−L cos q, 0), H = A + h e^{iq}
    slope = motion.point("H").sensitivity("links.bar.B.x")
    np.testing.assert_allclose(slope, np.stack([-np.cos(Q), 0 * Q], axis=1), rtol=1e-13, atol=1e-16)
    slope = motion.point("H").sensitivity("links.bar.H.x", 1)
    np.testing.assert_allclose(
        slope, np.stack([-W * np.sin(Q), W * np.cos(Q)], axis=1), rtol=1e-13, atol=1e-15
    )


@pytest.mark.parametrize("v", [1, 40])
def test_variants_of_a_scotch_yoke_and_of_a_trammel(v):
    r, b, mass = np.linspace(0.02, 0.2, v), np.linspace(0.7, 2.0, v), 2.0
    motion = yoke(mass=mass).vary({"links.crank.P.x": r, "slots.1.angle": b}).motion(Q, W, 0.0)
    r, b = r[:, None], b[:, None]
    places = r * (np.cos(Q) - np.sin(Q) / np.tan(b))
    rates = -r * (np.sin(Q) + np.cos(Q) / np.tan(b))
    assert motion.assembled.all()
    np.testing.assert_allclose(motion.point("S").position[..., 0], places, rtol=1e-12, atol=1e-16)
    # the crank drives the yoke's mass: M = m ẍ dx/dq with ẍ = −ω² x
    np.testing.assert_allclose(motion.effort, -mass * W**2 * places * rates, rtol=1e-11, atol=1e-15)
    length = np.linspace(0.1, 0.5, v)
    motion = trammel().vary({"links.bar.B.x": length}).motion(Q)
    ends = [motion.point(name).position for name in "AB"]
    np.testing.assert_allclose(ends[0][..., 0], -length[:, None] * np.cos(Q), rtol=1e-13)
    np.testing.assert_allclose(ends[1][..., 1], length[:, None] * np.sin(Q), rtol=1e-13)


def test_drawn_yokes_and_a_fit_to_one():
    m = yoke()
    numbers = drawn_numbers(m, limits(m, m.tolerances), 200, 1, "uniform")
    drawn = m.vary(numbers).motion(Q).point("S").position[..., 0]
    r, b = (numbers[path][:, None] for path in m.tolerances)
    np.testing.assert_allclose(drawn, r * (np.cos(Q) - np.sin(Q) / np.tan(b)), rtol=1e-13, atol=1e-16)
    design = m.design(["links.crank.P.x", "slots.1.angle"], "points.S")
    x, slopes = design([0.04, 0.9], Q)[0], design.slopes([0.04, 0.9], Q)[0]
    np.testing.assert_allclose(x, 0.04 * (np.cos(Q) - np.sin(Q) / np.tan(0.9)), rtol=1e-13)
    np.testing.assert_allclose(slopes[:, 0], x / 0.04, rtol=1e-13)
    np.testing.assert_allclose(slopes[:, 1], 0.04 * np.sin(Q) / np.sin(0.9) ** 2, rtol=1e-13)


def test_a_slot_along_its_slide_has_no_place_alone_and_among_many():
    b = np.linspace(0.0, 1.0, 33)
    family = yoke().vary({"slots.1.angle": b})
    motion = family.motion(Q)
    assert not motion.assembled[0].any()
    assert motion.assembled[1:].all()
    assert np.isnan(motion.point("S").position[0]).all()
    assert "parallel" in motion.reason(0)


# --- parts that no input moves ------------------------------------------------------------------------------------------
def beside(kind):
    """A crank, and beside it a part of one group that nothing moves."""
    ground, crank = {"O": 0j, "D": 0.1, "E": 0.2}, Link({"O": 0j, "P": 0.05}, 1.0)
    links, guides, angles = {
        "RRR": ({"a": Link({"D": 0j, "C": 0.07}), "b": Link({"E": 0j, "C": 0.08})}, [], {"a": 1.0, "b": 2.0}),
        "RRP": (
            {"a": Link({"D": 0j, "C": 0.07}), "b": Link({"C": 0j})},
            [Guide("C", "b", through=0.02j, turned=0.0)],
            {"a": 0.2},
        ),
        "RPR": ({"a": Link({"D": 0j, "X": 0.01})}, [Guide("E", "ground", "a", 0.01j, 0.1)], {"a": 0.2}),
        "PRP": (
            {"b": Link({"Y": 0j})},
            [Guide("Y", "b", through=0.02j, turned=0.3), Guide("E", "ground", "b", 0.01j, 1.5)],
            {},
        ),
    }[kind]
    entry = Input("crank", value=0.5, speed=W)
    return Mechanism(ground, {"crank": crank, **links}, guides=guides, inputs=entry, guess=Guess(0.5, angles))


@pytest.mark.parametrize("kind", ["RRR", "RRP", "RPR", "PRP"])
def test_what_no_input_moves_is_varied_as_it_is_alone(kind):
    m = beside(kind)
    alone = m.motion(Q)
    # one at a time: what hangs on no other number that varies is a constant beside recorded ones
    for path in (path for path, d in dimensions(m).items() if d.kind == "length"):
        own = float(value(m, path).real)
        motion = m.vary({path: own + np.linspace(0.0, 2e-3, 33)}).motion(Q)
        last = changed(m, {path: own + 2e-3}).motion(Q)
        np.testing.assert_allclose(motion.effort[32], last.effort, rtol=1e-12, atol=1e-15)
        design = m.design([path], *(f"points.{name}" for name in m.points))
        places, slopes = design([own], Q).reshape(-1, 2, len(Q)), design.slopes([own], Q)[..., 0]
        for i, name in enumerate(m.points):
            found, of = motion.point(name).position, alone.point(name)
            np.testing.assert_allclose(found[0], of.position, rtol=1e-12, atol=1e-15)
            np.testing.assert_allclose(found[32], last.point(name).position, rtol=1e-12, atol=1e-15)
            np.testing.assert_allclose(places[i].T, of.position, rtol=1e-12, atol=1e-15)
            slope = slopes.reshape(-1, 2, len(Q))[i].T
            np.testing.assert_allclose(slope, of.sensitivity(path), rtol=1e-11, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_random_yokes_and_trammels_among_many_are_those_alone(seed):
    rng = np.random.default_rng(seed)
    for m in (yoke(0.05, rng.uniform(0.3, 2.8), mass=1.0), trammel(mass=1.0)):
        paths = [p for p, d in dimensions(m).items() if d.kind in ("length", "angle", "mass")]
        paths = [p for p in paths if not p.startswith("input")]
        numbers = {}
        for p in paths:
            own = float(value(m, p).real)
            numbers[p] = np.abs(own) if p.endswith("mass") else own + 0.02 * rng.normal(size=40)
            numbers[p] = np.broadcast_to(numbers[p], 40)
        family = m.vary(numbers)
        motion = family.motion(Q, W, 1.0)
        for i in range(40):
            try:
                alone = family[i].motion(Q, W, 1.0)
            except MechanismError:
                assert not motion.assembled[i].any()
                continue
            for name in m.points:
                for got, own in zip(
                    (motion.point(name).position, motion.point(name).acceleration),
                    (alone.point(name).position, alone.point(name).acceleration),
                    strict=True,
                ):
                    np.testing.assert_allclose(got[i], own, rtol=1e-10, atol=1e-12)
            np.testing.assert_allclose(motion.effort[i], alone.effort, rtol=1e-10, atol=1e-12)
