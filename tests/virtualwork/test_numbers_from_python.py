"""Numbers, points and names that a person types in Python: any type of number is read, what is no number of that place is refused."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from tests.virtualwork.mechanisms import four_bar
from virtualwork import (
    Belt,
    Force,
    Friction,
    Gear,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    Motor,
    Polar,
    Rack,
    Segment,
    Spring,
    Torque,
    TorsionSpring,
)
from virtualwork.describe import DescriptionError

ARM = Link({"O": 0j, "P": 2.0}, mass=1.0, center=1.0)


def arm(**more):
    return Mechanism({"O": 0j, "W": 3.0}, {"arm": ARM}, inputs=Input("arm"), **more)


@pytest.mark.parametrize("speed", [3, np.float32(3), np.int8(3), Decimal(3), Fraction(3), np.array(3)])
def test_an_input_with_a_speed_of_any_type(speed):
    """A whole number ended in a TypeError; at alpha of the crank the speed enters squared."""
    m = Mechanism({"O": 0j}, {"arm": ARM}, inputs=Input("arm", speed=speed))
    assert m.motion(0.0).point("P").acceleration.tolist() == [[-18.0, 0.0]]
    assert m.changed({"input.speed": 2}).motion(0.0).point("P").acceleration.tolist() == [[-8.0, 0.0]]


def test_a_text_is_no_number():
    """`Input(speed="700 rpm")` was read as 7 rad/s."""
    with pytest.raises(DescriptionError, match="Input speed: found '700 rpm', expected a finite real number"):
        Input("arm", speed="700 rpm")
    with pytest.raises(DescriptionError, match="mass: found '1 kg', expected a finite real number"):
        Link({}, mass="1 kg")


@pytest.mark.whole
@pytest.mark.parametrize(
    "make",
    [
        lambda x: Input("arm", value=x),
        lambda x: Input("arm", jerk=x),
        lambda x: Link({}, mass=x),
        lambda x: Link({}, inertia=x),
        lambda x: Guess(at=x),
        lambda x: Guess(angles={"arm": x}),
        lambda x: Torque("arm", x),
        lambda x: Spring((("arm", "P"), ("ground", "W")), stiffness=x),
        lambda x: Spring((("arm", "P"), ("ground", "W")), free_length=x),
        lambda x: TorsionSpring(("ground", "arm"), damping=x),
        lambda x: Gear(("a", "b"), x),
        lambda x: Belt(("a", "b"), (1.0, x)),
        lambda x: Rack("a", "B", x),
        lambda x: Guide("P", "arm", angle=x),
        lambda x: Guide("P", "arm", turned=x),
        lambda x: Friction("O", x),
        lambda x: Motor("ground", "arm", mass=x),
        lambda x: Polar("O", 1.0, x),
        lambda x: Segment(rise=x, motion="cycloidal"),
    ],
)
def test_what_is_no_real_number(make):
    made = make(1.0)
    for value in ("5", "5 N m", 1j, 1 + 0j, np.complex64(1), float("nan"), float("inf"), [[5.0]], np.ones(3)):
        if isinstance(made, Guess) and made.at and np.ndim(value) == 1:
            # of three inputs
            continue
        with pytest.raises(DescriptionError, match=r"found .*, expected a finite real number"):
            make(value)


@pytest.mark.parametrize("pair", [(0, -10), [0, -10], np.array([0, -10]), (Decimal(0), np.float32(-10))])
def test_a_force_at_a_place_by_pairs(pair):
    """As points are: a pair ended in a TypeError. The moment of −10j about O is 10·2·cos θ against the input."""
    for place in ("P", (2, 0), [2.0, 0.0], np.array([2, 0])):
        m = arm(forces=[Force("arm", place, pair)])
        assert m.motion(0.3).effort[0] == pytest.approx(20 * np.cos(0.3), rel=1e-15)


def test_ends_of_a_spring_by_pairs():
    named = arm(springs=[Spring((("arm", "P"), ("ground", "W")), 100, 1)]).motion(0.3).effort
    placed = arm(springs=[Spring([["arm", (2, 0)], ["ground", [3, 0]]], 100, 1)]).motion(0.3).effort
    assert named == placed
    for ends in (("arm.P", "ground.W"), ("P", "W"), (("arm", "P"),), "PW"):
        with pytest.raises(
            DescriptionError, match=r'Spring between: found .*, expected two ends such as \("crank"'
        ):
            Spring(ends)


def test_single_precision_stays_in_the_number_alone():
    """A float32 that a formula multiplies with made its result one."""
    of = [
        arm(springs=[Spring((("arm", "P"), ("ground", "W")), k, 1.0)]).motion(0.3).effort[0]
        for k in (100.0, np.float32(100))
    ]
    assert of[0] == of[1]


def test_flags_are_true_or_false():
    """`crossed="no"` was true."""
    with pytest.raises(DescriptionError, match="Belt crossed: found 'no', expected True or False"):
        Belt(("a", "b"), (1, 2), crossed="no")
    assert Belt(["a", "b"], [1, 2], crossed=np.True_) == Belt(("a", "b"), (1.0, 2.0), crossed=True)


@pytest.mark.parametrize("value", [9.81, -9.81, 10, True])
def test_gravity_is_no_single_number(value):
    """It acted along x; 9.81 downwards is meant."""
    with pytest.raises(DescriptionError, match=r"gravity: found .*, expected its two components"):
        arm(gravity=value)
    assert arm(gravity=0).gravity == 0


def test_places_that_are_none():
    nan = float("nan")
    for place in ({1.0, 2.0}, {1: 5, 2: 6}, ("1", "2"), (1j, 2), "ab"):
        with pytest.raises(DescriptionError, match=r"points.P: expected a point \(x, y\) or x \+ iy"):
            Link({"P": place})
    with pytest.raises(DescriptionError, match=r"ground.D: expected finite coordinates"):
        Mechanism({"O": 0j, "D": (0, nan)}, {"arm": ARM}, inputs=Input("arm"))
    for make in (
        lambda: Link({}, center=(nan, 0)),
        lambda: arm(gravity=(0, nan)),
        lambda: Force("arm", "P", (0, nan)),
        lambda: Guide("P", "arm", through=(0, nan)),
    ):
        with pytest.raises(DescriptionError, match="expected finite coordinates"):
            make()


def test_names_are_texts():
    with pytest.raises(DescriptionError, match="ground: found the name 1, expected a text such as '1'"):
        Mechanism({1: 0j}, {"arm": Link({"P": 0})}, inputs=Input("arm"))


def test_a_guess_that_is_none():
    """A guess of a point that no link has chose nothing, without a word; one of NaN chose either assembly."""
    m = four_bar()
    parts = {"ground": m.ground, "links": m.links, "inputs": m.inputs}
    with pytest.raises(DescriptionError, match=r"\[guess\] c: unknown link or point 'c'"):
        Mechanism(**parts, guess=Guess(points={"c": 1j}))
    with pytest.raises(DescriptionError, match="guess: expected Guess, found dict"):
        Mechanism(**parts, guess={"coupler": 0.3})
    with pytest.raises(DescriptionError, match=r"\[guess\] coupler: found nan"):
        Guess(angles={"coupler": float("nan")})
    for at in (np.float32(0.5), np.array(0.5), Decimal("0.5"), [0.5], np.array([0.5])):
        assert Guess(at).at == (0.5,)
