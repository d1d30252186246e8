"""What tolerances do: the linear spread by hand, drawn mechanisms beside it, and where the first order is not enough."""

from __future__ import annotations

import numpy as np
import pytest

from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.describe import DescriptionError
from virtualwork.family.tolerance import STREAM, drawn, drawn_numbers, limits, spread, summary
from virtualwork.formulas.kinematics import Point

KEY = Point("coupler", 0j, "H", 0)


def four_bar(tolerances=None):
    links = {
        "crank": Link({"A": 0j, "B": 0.04}),
        "coupler": Link({"B": 0j, "C": 0.12, "H": 0.06 + 0.03j}),
        "rocker": Link({"D": 0j, "C": 0.08}),
    }
    return Mechanism(
        {"A": 0j, "D": 0.1}, links, inputs=Input("crank"), guess=Guess(0.7, {"coupler": 0.3, "rocker": 1.0}),
        tolerances=tolerances,
    )  # fmt: skip


SMALL = {"links.crank.B.x": 3e-5, "links.coupler.C": 6e-5, "ground.D.x": 9e-5}


def test_a_crank_by_hand():
    """P = r e^{iq}: ± t on r moves x by t·cos q, ± u on the direction of the frame's y by −u·sin q."""
    crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 0.5})}, inputs=Input("crank"))
    q = np.linspace(0, 6, 7)
    point = crank.motion(q).point("P")
    slopes = [point.sensitivity(f"links.crank.P.{axis}")[:, 0] for axis in "xy"]
    found = spread(slopes, [3e-3, 4e-3])
    x, y = 3e-3 * np.abs(np.cos(q)), 4e-3 * np.abs(np.sin(q))
    np.testing.assert_allclose(found.worst, x + y, rtol=1e-13)
    np.testing.assert_allclose(found.sd, np.hypot(x, y) / 3, rtol=1e-13)
    np.testing.assert_allclose(found.shares, [x**2 / (x**2 + y**2), y**2 / (x**2 + y**2)], atol=1e-13)
    np.testing.assert_allclose(found.shares.sum(axis=0), 1.0, rtol=1e-15)


def test_a_point_s_own_path_holds_for_both_coordinates():
    m = four_bar(SMALL)
    assert [d.path for d in limits(m, m.tolerances)] == [
        "links.crank.B.x", "links.coupler.C.x", "links.coupler.C.y", "ground.D.x",
    ]  # fmt: skip
    with pytest.raises(DescriptionError, match="did you mean"):
        limits(m, {"links.crnak.B.x": 1.0})


@pytest.mark.parametrize(("distribution", "wider"), [("normal", 1.0), ("uniform", np.sqrt(3.0))])
def test_drawn_and_linear_spreads_agree_within_their_sampling_error(distribution, wider):
    """The sd of n normal draws has a relative error of 1/√(2n), that of uniform ones less.

    Six such errors of 12 poses × 2 components: by chance beyond with a probability below 24·2e-9 = 5e-8 < 1e-6.
    What the second order adds is 1e-3 of the spread for limits of 1e-3 of the lengths.
    """
    m, draws = four_bar(), 40_000
    given = limits(m, SMALL)
    q = np.linspace(0, 6, 12)
    motion = m.motion(q)
    slopes = [motion.point("H").sensitivity(d.path) @ [1, 1j] for d in given]
    numbers = drawn_numbers(m, given, draws, 7, distribution)
    for rows, (values,), assembled in drawn(m, numbers, motion.inputs, (None, None), [KEY]):
        assert assembled.all()
        for part in ("real", "imag"):
            linear = spread([getattr(slope, part) for slope in slopes], list(given.values()))
            found = summary(getattr(values, part), getattr(motion.point("H").complex(0), part)[rows])
            apart = np.abs(found.sd / (wider * linear.sd[rows]) - 1)
            assert apart.max() < 6 / np.sqrt(2 * draws) + 2e-3
            if distribution == "normal":
                high = getattr(motion.point("H").complex(0), part)[rows] + 3 * linear.sd[rows]
                assert (
                    np.abs(found.quantiles[1] - high) < 6 * found.errors[1] + 2e-3 * linear.sd[rows]
                ).all()


def test_more_draws_leave_the_first_as_they_were():
    m = four_bar()
    given = limits(m, SMALL)
    few = drawn_numbers(m, given, STREAM + 5, 3, "normal")
    many = drawn_numbers(m, given, 3 * STREAM, 3, "normal")
    other = drawn_numbers(m, given, STREAM + 5, 4, "normal")
    for path in few:
        np.testing.assert_array_equal(few[path], many[path][: STREAM + 5])
        assert not np.isin(few[path], other[path]).any()


def test_quantiles_and_their_sampling_errors():
    """Of 1 … 100 000 in any order the 0.135 % quantile is 136, to some √(n p) = 12 places."""
    values = np.random.default_rng(0).permutation(np.arange(1.0, 100_001.0))[:, None]
    found = summary(values, np.array([0.0]))
    np.testing.assert_allclose(found.quantiles[:, 0], [136.0, 99_865.0], atol=0.5)
    np.testing.assert_allclose(found.errors[:, 0], 12, atol=1)


def test_an_angle_is_averaged_beside_its_nominal_value():
    found = summary(np.array([[359.0], [0.5], [1.5]]), np.array([0.2]), 360.0)
    assert abs(found.mean[0] - 1 / 3) < 1e-12
