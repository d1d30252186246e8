"""One coordinate of a point as the target of a fit: a straight line, a dwell."""

from __future__ import annotations

import numpy as np
import pytest

from tests.virtualwork.test_fitting import FOUR_BAR, stephenson
from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.describe.dimensions import changed, value
from virtualwork.family.target import Target


def upright_slider_crank(crank: float, rod: float) -> Mechanism:
    """A crank at the origin that drives a slide along the y-axis."""
    return Mechanism(
        ground={"O": 0j},
        links={"crank": Link({"O": 0j, "A": crank}), "rod": Link({"A": 0j, "B": rod, "H": (0.1, 0.04)})},
        guides=[Guide("B", "rod", "ground", through=0j, angle=np.pi / 2)],
        inputs=Input("crank"),
        guess=Guess(np.pi / 2, {"rod": np.pi / 2}),
    )


def test_one_coordinate_is_wanted_alone():
    """The ends of the stroke are l + r above the crank and l − r: r = 60 mm, l = 150 mm."""
    m = upright_slider_crank(0.05, 0.17)
    free = {"links.crank.A.x": (0.04, 0.09), "links.rod.B.x": (0.1, 0.2)}
    for name in ("B.y", "points.B.y"):
        found = m.fit(name, [0.21, 0.09], free, inputs=[np.pi / 2, -np.pi / 2])
        assert found.values == pytest.approx([0.06, 0.15], rel=1e-12)
        (each,) = found.reached
        assert (each.kind, each.dimension, each.label) == ("coordinate", "length", "B.y")
    # one length for both ends: r = (0.20 − 0.08)/2 leaves 10 mm at either
    found = m.changed({"links.rod.B.x": 0.15}).fit(
        "B.y", [0.20, 0.08], {"links.crank.A.x": (0.04, 0.09)}, inputs=[np.pi / 2, -np.pi / 2]
    )
    assert found.parameters["links.crank.A.x"] == pytest.approx(0.06, rel=1e-9)
    assert (found.rms, found.max) == pytest.approx((0.01, 0.01), rel=1e-7)
    assert "rms 0.01 m" in repr(found)


def test_coordinates_have_the_weights_of_their_own():
    """x of P is r cos q and y is r sin q: r = (w_x a cos + w_y b sin)/(w_x cos² + w_y sin²) at one angle, twice."""
    arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1.2})}, inputs=Input("arm"))
    q = np.full(2, np.arccos(0.6))
    target = Target({"P.x": [0.6, 0.6], "P.y": [1.6, 1.6]}, q, {"P.x": 3.0})
    found = arm.fit([target], free={"links.arm.P.x": (0.5, 3)})
    right = (3 * 0.6 * 0.6 + 1.6 * 0.8) / (3 * 0.36 + 0.64)
    assert found.parameters["links.arm.P.x"] == pytest.approx(right, rel=1e-9)
    assert [each.label for each in found.reached] == ["P.x", "P.y"]


def test_both_coordinates_are_the_point():
    """Of a four-bar: the same rows, so the same bits; and one coordinate with an angle finds the hidden dimensions."""
    q = np.linspace(0, 5, 9)
    truth = changed(FOUR_BAR, {"ground.D.x": 0.104, "links.coupler.H.y": 0.045})
    motion = truth.motion(q)
    place, angle = motion.point("H").position, motion.link("rocker").angle
    free = {"ground.D.x": (0.09, 0.12), "links.coupler.H.y": (0.03, 0.07)}
    whole, parts = (
        FOUR_BAR.fit([Target(places, q)], free=free)
        for places in ({"H": place}, {"H.x": place[:, 0], "H.y": place[:, 1]})
    )
    assert whole.parameters == parts.parameters
    one = FOUR_BAR.fit([Target({"H.y": place[:, 1], "links.rocker": angle}, q)], free=free)
    assert one.values == pytest.approx([0.104, 0.045], rel=1e-9)
    with pytest.raises(ValueError, match=r"H and H.y name the same number"):
        FOUR_BAR.fit([Target({"H": place, "H.y": place[:, 1]}, q)], free=free)


def test_a_coordinate_of_a_group_without_a_closed_form_is_met():
    truth = stephenson()
    q = truth.at[0] + np.linspace(-0.6, 0.6, 12)
    target = truth.motion(q).point("E").position[:, 1]
    free = {"links.left.B.x": (2.0, 3.0)}
    own = value(truth, "links.left.B.x").real
    free = {"links.left.B.x": (0.9 * own, 1.1 * own)}
    found = changed(truth, {"links.left.B.x": 1.05 * own}).fit("E.y", target, free, q, starts=4)
    assert found.parameters["links.left.B.x"] == pytest.approx(own, rel=1e-9)
    slopes, point = (truth.design(["links.left.B.x"], name).slopes([own], q) for name in ("E.y", "E"))
    assert slopes[0] == pytest.approx(point[1], rel=1e-13)


def test_a_name_with_a_dot_is_a_name_first():
    """A point named `P.x` beside a point P."""
    arm = Mechanism({"O": 0j}, {"arm.x": Link({"O": 0j, "P": 1.0, "P.x": 2j})}, inputs=Input("arm.x"))
    at = arm.design(["links.arm.x.P.x"], "P.x", "points.P.y", "links.arm.x")
    assert at([1.5], [0.0])[:, 0] == pytest.approx([0, 2, 0, 0])
    with pytest.raises(ValueError, match=r"points.P.y and P.y name the same number"):
        arm.design([], "points.P.y", "P.y")
