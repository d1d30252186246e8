"""What is no part of a mechanism, or no rate of its poses, is refused in the words of the field."""

from __future__ import annotations

import numpy as np
import pytest

from tests.virtualwork.mechanisms import four_bar
from virtualwork import Force, Guess, Guide, Input, Link, Mechanism, Torque
from virtualwork.describe import DescriptionError

ARM = {"arm": Link({"O": 0j, "P": 1})}


def test_parts_of_another_kind():
    with pytest.raises(DescriptionError, match="links 'arm': expected Link, found dict"):
        Mechanism({"O": 0j}, {"arm": {"O": 0j, "P": 1}}, inputs=Input("arm"))
    with pytest.raises(DescriptionError, match="inputs 1: expected Input, found str"):
        Mechanism({"O": 0j}, ARM, inputs=["arm"])
    with pytest.raises(DescriptionError, match="guides 2: expected Guide, found dict"):
        Mechanism({"O": 0j}, ARM, inputs=Input("arm"), guides=[Guide("P", "arm"), {"point": "P"}])


@pytest.mark.parametrize("shape", [(3, 4), (4, 2), (1, 3), (2, 3, 1)])
def test_one_input_in_several_axes(shape):
    m = four_bar()
    for of in (m, m.vary({"links.crank.B.x": [0.03, 0.04]})):
        with pytest.raises(ValueError, match=r"angle: expected .*shape \(n,\) for one input, found"):
            of.motion(np.zeros(shape))
        assert of.motion(np.zeros((4, 1))).assembled.shape[-1] == 4


@pytest.mark.parametrize("n", [1, 5])
def test_arrays_that_change_after_the_call_change_nothing(n):
    m = four_bar()
    angle, speed, lengths = np.linspace(1, 2, n), np.full(n, 3.0), np.array([0.03, 0.04])
    expected = m.motion(angle.copy(), speed=speed.copy()), m.vary({"links.crank.B.x": lengths.copy()})
    motion, family = m.motion(angle, speed=speed), m.vary({"links.crank.B.x": lengths})
    swept = family.motion(angle, speed=speed)
    again = expected[1].motion(angle.copy(), speed=speed.copy())
    for changed in (angle, speed, lengths, motion.assembled, motion.condition):
        changed[:] = 0
    assert motion.assembled.all()
    assert np.array_equal(motion.link("rocker").omega, expected[0].link("rocker").omega)
    assert np.array_equal(swept.link("rocker").omega, again.link("rocker").omega)


@pytest.mark.parametrize("name", ["speed", "acceleration"])
def test_rates_of_another_length_than_the_angle(name):
    m, rates = four_bar(), {"speed": 1.0, "acceleration": 0.0}
    for of in (m, m.vary({"links.crank.B.x": [0.03, 0.04]})):
        with pytest.raises(ValueError, match=rf"{name}: expected a number or shape \(3,\).*found \(2,\)"):
            of.motion([0.1, 0.2, 0.3], **{**rates, name: [1.0, 2.0]})
        own = np.array([1.0, 2.0, 3.0])
        there = of.motion([0.1, 0.2, 0.3], **{**rates, name: own}).point("B")
        assert np.isfinite(there.acceleration).all()


@pytest.mark.whole
@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda m: m.motion("abc"), "angle: expected real numbers, found 'abc'"),
        (lambda m: m.motion([0.1, "b"]), "angle: expected real numbers"),
        (lambda m: m.motion(1j), "angle: expected real numbers, found 1j"),
        (lambda m: m.motion(0.1, speed="fast"), "speed: expected real numbers, found 'fast'"),
        (lambda m: m.vary([1]), "vary: expected numbers by their paths.*found \\[1\\]"),
        (lambda m: m.vary({}), "vary: expected numbers by their paths"),
        (lambda m: m.vary({3: [1.0]}), "expected a path such as '.*', found 3"),
        (lambda m: m.vary({"links.crank.B.x": "abc"}), "links.crank.B.x: expected real numbers"),
        (lambda m: m.vary({"links.crank.B.x": [0.03]}).motion("abc"), "angle: expected real numbers"),
        (lambda m: m.motion(0.1).point("B").sensitivity(3), "expected a path such as '.*', found 3"),
        (lambda m: m.motion(0.1).sensitivity("effort", 3), "expected a path such as '.*', found 3"),
        (lambda m: Link({"O": (0, 0, 0)}), "expected a point .* found \\(0, 0, 0\\)"),
        (lambda m: Link({"O": (0,)}), "expected a point .* found \\(0,\\)"),
        (lambda m: Link("OP"), "points: expected a mapping of names, found str"),
        (lambda m: Guide("P", "arm", through=(0, 0, 0)), "expected a point .* found \\(0, 0, 0\\)"),
        (lambda m: Mechanism({"O": 0j}, ARM, gravity=(0, 0, -9.81)), "expected a point"),
        (lambda m: Mechanism(3, ARM), "ground: expected a mapping of names, found int"),
        (lambda m: Mechanism({"O": 0j}, [Link({"O": 0j})]), "links: expected a mapping of names, found list"),
        (
            lambda m: Mechanism({"O": 0j}, ARM, forces=Force("arm", "P", 1j)),
            "forces: expected a list, found Force",
        ),
        (
            lambda m: Mechanism({"O": 0j}, ARM, forces=[{"link": "arm"}]),
            "forces 1: expected Force, found dict",
        ),
        (lambda m: Mechanism({"O": 0j}, ARM, springs=3), "springs: expected a list, found int"),
    ],
)
def test_what_is_no_number_point_path_or_list(call, said):
    """In words of ours, not of numpy's or Python's."""
    with pytest.raises((DescriptionError, ValueError), match=said):
        call(four_bar())


def test_a_guide_through_a_pair_of_numbers_is_that_through_a_complex_one():
    crank, rod = Link({"O": 0j, "A": 0.1}), Link({"A": 0j, "P": 0.5})
    places = []
    for through in ((0.2, 0.05), 0.2 + 0.05j, [0.2, 0.05]):
        m = Mechanism(
            {"O": 0j},
            {"crank": crank, "rod": rod},
            inputs=Input("crank"),
            guides=[Guide("P", "rod", through=through)],
            guess=Guess(0.3, {"rod": 0.0}),
        )
        places.append(m.motion(0.3).point("P").position[0])
    assert places[0] == pytest.approx(
        [0.1 * np.cos(0.3) + np.sqrt(0.25 - (0.05 - 0.1 * np.sin(0.3)) ** 2), 0.05]
    )
    assert (places[0] == places[1]).all()
    assert (places[0] == places[2]).all()


@pytest.mark.parametrize("times", ["a", ["a"], [0, 1j], {"a": 1}, [0, [1, 2]]])
def test_times_that_are_no_numbers(times):
    m = four_bar()
    for of in (m, m.vary({"links.crank.B.x": [0.03, 0.04]})):
        with pytest.raises(ValueError, match="times: expected real numbers, found"):
            of.simulate(times)
    with pytest.raises(ValueError, match="speed: expected real numbers, found 'fast'"):
        m.simulate([0, 1], speed="fast")


def test_a_point_of_a_link_that_is_not_there():
    """Of a motion, and of one of variants: the message names what is missing."""
    m = Mechanism({"O": 0j}, ARM, inputs=Input("arm"))
    for motion in (m.motion(0.3), m.vary({"links.arm.mass": [1.0, 2.0]}).motion(0.3)):
        with pytest.raises(DescriptionError, match="link 'arm' has no point named 'Q': expected one of O, P"):
            motion.at("arm", "Q")
        with pytest.raises(DescriptionError, match="no link is named 'arn'; did you mean 'arm'"):
            motion.at("arn", 1j)


@pytest.mark.parametrize(
    "rows", [((0.0, 1.0),), ((0.0, 1.0), (1.0, 1.0), (1.0, 3.0)), ((1.0, 1.0), (0.0, 2.0))]
)
def test_tables_that_do_not_rise(rows):
    with pytest.raises(
        DescriptionError, match="torque on arm history: expected at least two rows, the speed rising"
    ):
        Torque("arm", history=rows, over="speed")
    with pytest.raises(
        DescriptionError, match="force on arm history: expected at least two rows, the input rising"
    ):
        Force("arm", history=rows)


@pytest.mark.parametrize(
    ("numbers", "inputs", "words"),
    [
        (
            [],
            [0.0],
            r"numbers must have the shape \(1,\), one for each of links.arm.P.x, found the shape \(0,\)",
        ),
        ([2.0, 3.0], [0.0], r"numbers must have the shape \(1,\).*found the shape \(2,\)"),
        (2.0, [0.0], r"numbers must have the shape \(1,\).*found the shape \(\)"),
        ([[2.0]], [0.0], r"numbers must have the shape \(1,\).*found the shape \(1, 1\)"),
        ([2.0], 0.0, r"inputs must have the shape \(n,\), found the shape \(\)"),
        (["x"], [0.0], "numbers must be an array of numbers, found"),
    ],
)
def test_a_design_of_other_dimensions(numbers, inputs, words):
    design = Mechanism({"O": 0j}, ARM, inputs=Input("arm")).design(["links.arm.P.x"], "points.P")
    for ask in (design, design.slopes):
        with pytest.raises(ValueError, match=words):
            ask(numbers, inputs)


def test_a_design_at_no_inputs():
    design = Mechanism({"O": 0j}, ARM, inputs=Input("arm")).design(["links.arm.P.x"], "points.P")
    assert (design([2.0], []).shape, design.slopes([2.0], []).shape) == ((2, 0), (2, 0, 2))
