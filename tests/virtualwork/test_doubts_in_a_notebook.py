"""What a person in a notebook is told without a request: a doubtful guess, poses that cannot be assembled, sweeps that are no cycle."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from tests.virtualwork.mechanisms import four_bar, slider_crank
from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.describe import DescriptionError


def by_guess(guess: Guess) -> Mechanism:
    m = four_bar()
    return Mechanism(m.ground, m.links, inputs=m.inputs, guess=guess)


def test_a_guess_of_degrees_is_warned_of_once():
    """It chose the other assembly without a word."""
    m = by_guess(Guess(at=40, angles={"coupler": 17, "rocker": 57}))
    with pytest.warns(UserWarning, match=r"\[guess\] rocker: 57 rad is 9.07 turns"):
        motion = m.motion(0.7)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert m.motion(0.8).assembled.all()
    assert repr(motion) == "Motion('': 1 pose over crank; see .warnings)"
    assert [text.partition(":")[0] for text in motion.warnings] == [
        "[guess] at crank",
        "[guess] coupler",
        "[guess] rocker",
    ]
    good = by_guess(Guess(at=0.7, angles={"coupler": 0.3, "rocker": 1.0})).motion([0.7, 0.8])
    assert (repr(good), good.warnings, good.reason(0)) == ("Motion('': 2 poses over crank)", (), None)


def test_poses_that_cannot_be_assembled_say_why():
    """The rod of 55 mm reaches a line 60 mm sin q away up to q = asin(55/60)."""
    m = slider_crank(0.06, 0.055)
    motion = m.motion([0.5, 1.2, np.nan])
    assert motion.assembled.tolist() == [True, False, False]
    limit = np.arcsin(55 / 60)
    assert motion.reason(1).endswith(f"; it would close at {limit:.6g} rad")
    assert motion.reason(2) == "the input is no number"
    (text,) = motion.warnings
    assert text == f"2 of 3 poses cannot be assembled, the first at 1.2: {motion.reason(1)}"
    assert text in motion._repr_html_()
    assert "poses shown cannot be assembled" in m.motion(np.linspace(0.5, 1.2, 50))._repr_html_()


def test_parts_of_a_motion_that_are_not_there():
    """Input 1 of one, and the derivative of order −1, were zeros; a link of another name had no loads."""
    motion = four_bar().motion([0.7, 0.8], speed=1.0)
    rocker, point = motion.link("rocker"), motion.point("C")
    for j in (1, -1):
        for of in (motion.unit, rocker.coefficient, point.coefficient):
            with pytest.raises(
                ValueError, match=rf"input: found {j}, expected the number of an input: 0 \(crank\)"
            ):
                of(j)
    for order in (-1, 4):
        for of in (rocker.value, point.value, point.complex, point.error_estimate, slider().value):
            with pytest.raises(ValueError, match=rf"order: found {order}, expected 0 \(position or angle\)"):
                of(order)
        with pytest.raises(ValueError, match=f"order: found {order}"):
            point.sensitivity("links.crank.B.x", order)
    with pytest.raises(DescriptionError, match="no link is named 'Rocker'; did you mean 'rocker'"):
        motion.applied("Rocker")
    with pytest.raises(DescriptionError, match="runs at a point named 'b': expected B"):
        slider_crank().motion(0.3).slide("b")


def slider():
    return slider_crank().motion(0.3).slide("B")


def test_inputs_that_are_handed_out_are_a_copy():
    motion = four_bar().motion([0.7, 0.8])
    motion.inputs[:] = 0.0
    assert (motion.link("rocker").angle == four_bar().motion([0.7, 0.8]).link("rocker").angle).all()


@pytest.mark.whole
@pytest.mark.parametrize(
    "angle",
    [
        np.array([1, 2], "timedelta64[s]"),
        np.array(["2020-01-01"], "datetime64[s]"),
        np.array([1 + 1j]),
        np.array([1 + 0j]),
        np.complex64(1),
    ],
)
def test_arrays_of_times_and_complex_numbers_are_no_angles(angle):
    """One second was a billion radians, and of 1 + 1j the real part was taken."""
    m = four_bar()
    for call in (m.motion, lambda x: m.motion(1.0, speed=x), m.evaluator("C.x")):
        with pytest.raises(ValueError, match=r"(angle|speed): expected real numbers, found"):
            call(angle)


def test_what_is_masked_is_no_number():
    """The numbers behind the mask were taken."""
    for kind in (float, int):
        masked = np.ma.array([1, 2, 3], mask=[False, True, False], dtype=kind)
        motion = four_bar().motion(masked, speed=1.0)
        assert motion.assembled.tolist() == [True, False, True]
        assert np.isnan(motion.link("rocker").angle).tolist() == [False, True, False]


def test_an_evaluator_moves_as_the_description_says():
    """A motion had the speed of the description, an evaluator speed 0."""
    arm = Link({"O": 0j, "P": 2.0})
    m = Mechanism({"O": 0j}, {"arm": arm}, inputs=Input("arm", speed=3.0, acceleration=0.5))
    at = m.evaluator("points.P.velocity", "points.P.acceleration")
    assert at(0.0) == {"points.P.velocity": (0.0, 6.0), "points.P.acceleration": (-18.0, 1.0)}
    assert at([0.0])["points.P.velocity"].tolist() == [[0.0, 6.0]]
    assert at(0.0, 0.0, 0.0) == {"points.P.velocity": (0.0, 0.0), "points.P.acceleration": (0.0, 0.0)}
    two = Mechanism(
        {"O": 0j}, {"arm": arm, "hand": Link({"P": 0j})}, inputs=[Input("arm", speed=3.0), Input("hand")]
    )
    assert two.evaluator("arm.omega")([0.0, 1.0])["arm.omega"].tolist() == [3.0]


def test_sweeps_that_are_no_cycle():
    """A flywheel of 57° of a turn had an inertia; one pose divided by zero."""
    m = four_bar(gravity=-9.81j)
    whole = m.motion(np.linspace(0, 2 * np.pi, 73), speed=2.0).cycle
    assert whole.flywheel(0.02) > 0
    for coefficient in (0.0, -0.02, float("nan")):
        with pytest.raises(ValueError, match=r"coefficient: found .*, expected a number above zero"):
            whole.flywheel(coefficient)
    part = m.motion(np.linspace(0, 1, 20), speed=2.0).cycle
    assert part.work != 0
    with pytest.raises(
        ValueError, match=r"the sweep covers 57\.2958 deg of the input crank, and a whole cycle is"
    ):
        part.flywheel(0.02)
    for angle, reason in (
        (1.0, "one pose is no cycle"),
        ([1.0, 3.0, 2.0], "does not rise or fall throughout"),
        ([1.0, 1.0, 2.0], "does not rise or fall throughout"),
    ):
        for name in ("mean", "rms", "work", "fluctuation"):
            with pytest.raises(ValueError, match=reason):
                getattr(m.motion(angle, speed=2.0).cycle, name)
    with pytest.raises(ValueError, match="found 0 poses of 1"):
        _ = m.motion([]).cycle
    with pytest.raises(ValueError, match="21 of 41 poses of the sweep have no effort"):
        _ = slider_crank(0.06, 0.05, gravity=-1j).motion(np.linspace(0, 2, 41)).cycle.work


def test_a_motion_of_no_poses_has_no_picture():
    motion = four_bar().motion([])
    for of in (motion.page, motion.animate, motion.plot, lambda: motion.plot_curves("C.x")):
        with pytest.raises(ValueError, match="a motion of no poses has no picture and no page"):
            of()


def test_ranges_of_rest_and_inputs_of_newton():
    """A range from its higher to its lower end had no rest; a second input was ignored."""
    m = four_bar(gravity=-9.81j)
    assert len(m.equilibria([[0.0, 2 * np.pi]]).found) == 2
    for spans in ([[2 * np.pi, 0.0]], [[0.0, np.nan]], [[0.0, np.inf]]):
        with pytest.raises(ValueError, match=r"spans: found .* to .*, expected the lower and the higher end"):
            m.equilibria(spans)
    with pytest.raises(
        ValueError, match=r"spans: expected shape \(1, 2\), a range of each input, found \(3,\)"
    ):
        m.equilibria([0.0, 1.0, 2.0])
    with pytest.raises(ValueError, match="samples: found 0, expected one or more"):
        m.equilibria(samples=0)
    with pytest.raises(ValueError, match="inputs: found 2, expected one number for each of 1"):
        m.newton(0.7, 0.8)
    with pytest.raises(DescriptionError, match="inputs: found 'a', expected a finite real number"):
        m.newton("a")


def test_names_of_pictures():
    """A path of a point that is not there was left out of the picture without a word."""
    motion = four_bar().motion([0.7, 0.8])
    for points in ("Z", ["C", "Z"]):
        with pytest.raises(DescriptionError, match="plot: unknown point 'Z': expected one of A, D, B, C"):
            motion.plot(points)
    with pytest.raises(DescriptionError, match="plot_curves: expected the names of quantities"):
        motion.plot_curves()


def test_numbers_of_variants_changes_and_events():
    m = four_bar(gravity=-9.81j)
    path = "links.crank.B.x"
    with pytest.raises(ValueError, match=f"{path}: found nan at 1, expected finite numbers"):
        m.vary({path: np.ma.array([0.04, 0.05], mask=[False, True])})
    with pytest.raises(DescriptionError, match=r"'gravity': found 9\.81, expected its two components"):
        m.changed({"gravity": 9.81})
    with pytest.raises(DescriptionError, match=r"expected numbers by their paths, such as .*, found 'a'"):
        m.changed("a")
    for free in ([path], {path: 0.05}, {path: (0.1,)}):
        with pytest.raises(ValueError, match=r"free: found .*, expected a low and a high bound by path"):
            m.fit("C", [(0.1, 0.1), (0.12, 0.1)], free)
    with pytest.raises(DescriptionError, match="until crank: found nan, expected a finite real number"):
        m.simulate([0.0, 0.1], until={"crank": float("nan")})
    for links in ("crank", []):
        with pytest.raises(DescriptionError, match=r"counterweights: found .*, expected a list of links"):
            m.motion(0.7, speed=1.0).counterweights(links)
