"""Change points, limits and branches: never a silent jump."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.branch.track import Track
from virtualwork.motion import Motion
from virtualwork.study.check import Check

TWO_TURNS = np.radians(np.arange(0.0, 721.0))


def four_bar(crank, coupler, rocker, ground, at, coupler_angle, rocker_angle, scale=1.0):
    return Mechanism(
        {"A": (0, 0), "D": (ground * scale, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (crank * scale, 0)}),
            "coupler": Link({"B": (0, 0), "C": (coupler * scale, 0)}),
            "rocker": Link({"D": (0, 0), "C": (rocker * scale, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(
            math.radians(at), {"coupler": math.radians(coupler_angle), "rocker": math.radians(rocker_angle)}
        ),
    )


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e9])
@pytest.mark.parametrize(("crank", "ground"), [(2.0, 5.0), (0.3, 0.7), (5.0, 2.0)])
def test_a_parallelogram_stays_one(crank, ground, scale):
    m = four_bar(crank, ground, crank, ground, 60, 0, 60, scale)
    motion = m.motion(TWO_TURNS, speed=1.0, acceleration=0.0)
    assert motion.assembled.all()
    assert np.abs(np.exp(1j * motion.link("rocker").angle) - np.exp(1j * TWO_TURNS)).max() < 1e-12
    assert np.abs(motion.link("rocker").omega - 1).max() < 1e-11
    assert np.abs(motion.link("coupler").omega).max() < 1e-11
    assert np.abs(motion.link("rocker").alpha).max() < 1e-9
    assert np.degrees(Check(m.assembly).change_points) == pytest.approx([0, 180], abs=1e-10)


def test_an_input_that_is_no_number_hides_no_change_point():
    """The condition behind the point at 180° is the parallelogram's; it was the antiparallelogram's beside a NaN."""
    m = four_bar(1.0, 3.0, 1.0, 3.0, 60, 0, 60)
    motion = m.motion([np.nan, 4.0])
    condition = motion.poses.condition
    assert motion.assembled.tolist() == [False, True]
    assert np.isnan(condition[0])
    assert condition[1] == pytest.approx(m.motion(4.0).poses.condition[0], rel=1e-14)
    assert four_bar(1.0, 3.0, 1.0, 3.0, 60, 0, 60).motion([np.nan, np.nan]).assembled.tolist() == [
        False,
        False,
    ]


@pytest.mark.parametrize("apart", [0.0, 1e-15, 1e-12, 1e-8, 1e-4, 0.02])
def test_at_a_change_point_the_velocity_is_the_exact_limit(apart):
    motion = four_bar(2, 5, 2, 5, 60, 0, 60).motion(math.pi + apart, speed=1.0, acceleration=0.0)
    assert motion.link("rocker").omega[0] == pytest.approx(1.0, abs=1e-13)
    assert motion.link("rocker").alpha[0] == pytest.approx(0.0, abs=1e-11)
    assert motion.link("rocker").jerk[0] == pytest.approx(0.0, abs=1e-9)


def test_an_antiparallelogram_stays_one():
    motion = four_bar(2, 5, 2, 5, 60, -60, -100).motion(TWO_TURNS, speed=1.0, acceleration=0.0)
    omega = motion.link("rocker").omega
    # at 0 and 180 degrees the follower's speed is -(g + a)/(g - a) and its inverse
    assert omega[[0, 360, 720]] == pytest.approx([-7 / 3] * 3, abs=1e-12)
    assert omega[[180, 540]] == pytest.approx([-3 / 7] * 2, abs=1e-12)
    assert np.abs(np.diff(omega)).max() < 0.03


def test_a_kite_turns_its_rocker_once_in_two_turns():
    motion = four_bar(2, 5, 5, 2, 60, 90, 100).motion(TWO_TURNS, speed=1.0)
    angle = np.unwrap(motion.link("rocker").angle)
    assert motion.assembled.all()
    assert angle[720] - angle[0] == pytest.approx(2 * math.pi, abs=1e-12)
    assert angle[360] - angle[0] == pytest.approx(math.pi, abs=1e-12)
    assert np.abs(np.diff(angle)).max() < 0.0125
    assert motion.link("rocker").omega[[0, 360, 720]] == pytest.approx([0.7, 0.3, 0.7], abs=1e-12)


def test_an_isosceles_slider_crank_goes_through_its_centre():
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (1, 0)}), "rod": Link({"A": (0, 0), "B": (1, 0)})},
        [Guide("B", "rod")],
        inputs=Input(link="crank"),
        guess=Guess(math.radians(30), {"rod": math.radians(-30)}),
    )
    motion = m.motion(TWO_TURNS, speed=1.0)
    assert motion.slide("B").position == pytest.approx(2 * np.cos(TWO_TURNS), abs=1e-12)
    assert motion.slide("B").speed == pytest.approx(-2 * np.sin(TWO_TURNS), abs=1e-11)


def test_across_a_gap_the_branch_is_remembered():
    m = four_bar(2, 5, 2, 4, 180, 17, 115)
    motion = m.motion(TWO_TURNS)
    rocker = motion.link("rocker").angle
    for i in (60, 180, 300):
        assert rocker[i] == pytest.approx(rocker[i + 360], abs=1e-13)
    limit = math.degrees(math.acos((2**2 + 4**2 - 3**2) / (2 * 2 * 4)))
    assert np.array_equal(np.isnan(rocker[:361]), np.abs(np.arange(361.0) - 180) > 180 - limit)
    assert np.degrees(Check(m.assembly).input_limits) == pytest.approx([limit, 360 - limit], abs=1e-11)
    # the antiparallel twin of the same linkage is on the other branch, everywhere
    other = four_bar(2, 5, 2, 4, 180, -17, -115).motion(TWO_TURNS).link("rocker").angle
    good = np.isfinite(rocker)
    assert np.abs(np.exp(1j * other[good]) - np.exp(1j * rocker[good])).min() > 1e-3


def test_a_narrow_gap_between_two_samples_is_a_gap():
    """Lengths a hair off a parallelogram: 0.02 degrees cannot be assembled, and both limits are found."""
    crank, coupler = 2.0, 5.0 * (1 - 1e-8)
    m = four_bar(crank, coupler, crank, 5.0, 90, 0, 90)
    limits = [limit.input for limit in m.assembly.reach.limits()]
    assert len(limits) == 2
    # d² = (b + c)² at the ends of the gap
    edge = math.acos((crank**2 + 25.0 - (coupler + crank) ** 2) / (2 * crank * 5.0))
    assert sorted(limits) == pytest.approx([edge, 2 * math.pi - edge], abs=1e-9)
    assert not m.motion(math.pi).assembled[0]


def test_peaucellier_goes_straight_through_its_own_change_point():
    """At 60 degrees C, A and D lie in one line: B goes on along x = 1.5 instead of staying with A."""
    rod = {"crank": ("P", "A", 1), "arm1": ("O", "C", 2), "arm2": ("O", "D", 2), "ac": ("A", "C", 1),
           "ad": ("A", "D", 1), "cb": ("C", "B", 1), "db": ("D", "B", 1)}  # fmt: skip
    m = Mechanism(
        {"O": (0, 0), "P": (1, 0)},
        {name: Link({p: (0, 0), q: (length, 0)}) for name, (p, q, length) in rod.items()},
        inputs=Input(link="crank"),
        guess=Guess(math.radians(40), points={"C": (1.7, 1.0), "D": (1.9, -0.4), "B": (1.5, 0.5)}),
    )
    q = np.radians(np.arange(-110.0, 110.5, 0.5))
    motion = m.motion(q, speed=3.0, acceleration=0.0)
    x, y = motion.point("B").position.T
    assert x == pytest.approx(np.full(len(q), 1.5), abs=1e-12)
    assert y == pytest.approx(1.5 * np.tan(q / 2), abs=1e-11)
    assert motion.point("B").velocity[:, 0] == pytest.approx(np.zeros(len(q)), abs=1e-10)


def test_three_parallel_cranks_have_a_redundant_constraint_and_turn():
    links = {
        "crank": Link({"A": (0, 0), "B": (2, 0)}),
        "coupler": Link({"B": (0, 0), "M": (2, 0), "C": (5, 0)}),
        "middle": Link({"N": (0, 0), "M": (2, 0)}),
        "rocker": Link({"D": (0, 0), "C": (2, 0)}),
    }
    m = Mechanism(
        {"A": (0, 0), "D": (5, 0), "N": (2, 0)},
        links,
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"coupler": 0.0, "middle": 1.0, "rocker": 1.0}),
    )
    q = np.radians(np.arange(0, 361, 15.0))
    motion = m.motion(q, speed=1.0)
    assert motion.assembled.all()
    assert np.abs(np.exp(1j * motion.link("rocker").angle) - np.exp(1j * q)).max() < 1e-12
    assert motion.link("middle").omega == pytest.approx(np.ones(len(q)), abs=1e-11)
    check = Check(m.assembly)
    assert (check.mobility, check.mobility_by_rank) == (0, 1)
    assert "pin M" in check.redundant


def test_a_triad_has_limits_and_remembers_its_branch():
    """A Stephenson III driven in its five-bar loop, with a crank too long to turn: Newton-Raphson up to the limit."""
    m = Mechanism(
        {"A": (0, 0), "D": (100, 0), "G": (150, 60)},
        {
            "crank": Link({"G": (0, 0), "F": (35, 0)}),
            "rod": Link({"F": (0, 0), "E": (105, 0)}),
            "left": Link({"A": (0, 0), "B": (70, 0)}),
            "coupler": Link({"B": (0, 0), "C": (80, 0), "E": (45, 60)}),
            "right": Link({"D": (0, 0), "C": (75, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(math.radians(90), points={"B": (10, 69), "C": (88, 74), "E": (50, 130), "F": (150, 85)}),
    )
    low, high = Check(m.assembly).input_limits
    edge = [low + 1e-11, low - 1e-11, high - 1e-11, high + 1e-11]
    assert m.motion(edge).assembled.tolist() == [True, False, True, False]
    motion = m.motion(TWO_TURNS, speed=1.0)
    e = motion.point("E").position
    assert np.isfinite(e[90]).all()
    assert e[360:] == pytest.approx(e[:361], abs=1e-11, nan_ok=True)
    # the loops close, all of them, to rounding
    q = TWO_TURNS[motion.assembled]
    swept = m.motion(q)
    for p, o, length in (("E", "F", 105), ("C", "B", 80), ("E", "B", 75), ("C", "D", 75)):
        apart = np.abs(swept.point(p).complex(0) - swept.point(o).complex(0))
        assert apart == pytest.approx(np.full(len(q), length), rel=1e-13)


@pytest.mark.parametrize("at", [0, 180, 360, -180])
def test_a_guess_at_the_change_point_itself_means_the_parallelogram(at):
    m = four_bar(2, 5, 2, 5, at, 0, at)
    q = np.radians(np.arange(-360.0, 361.0))
    motion = m.motion(q, speed=1.0)
    assert np.abs(np.exp(1j * motion.link("rocker").angle) - np.exp(1j * q)).max() < 1e-12
    assert np.abs(motion.link("rocker").omega - 1).max() < 1e-11
    assert "change point" in m.assembly.warnings[0]
    assert m.motion(math.radians(at), speed=1.0).link("rocker").omega[0] == pytest.approx(1, abs=1e-12)


def test_a_kite_guessed_where_it_is_folded():
    motion = four_bar(2, 5, 5, 2, 0, 90, 90).motion(TWO_TURNS, speed=1.0)
    assert motion.assembled.all()
    assert np.abs(np.diff(np.unwrap(motion.link("rocker").angle))).max() < 0.0125


@pytest.mark.parametrize("turns", [478, -478])
def test_change_points_hundreds_of_turns_away_are_those_of_the_first_turn(turns, monkeypatch):
    m = four_bar(0.3, 0.7, 0.3, 0.7, 60, 0, 60)
    scans = []
    scan = Track._scan
    monkeypatch.setattr(Track, "_scan", lambda track, a, b: (scans.append(a), scan(track, a, b)))
    q = 2 * math.pi * turns + np.linspace(0.0, 4 * math.pi, 101)
    motion = m.motion(q, speed=1.0)
    assert np.abs(np.exp(1j * motion.link("rocker").angle) - np.exp(1j * q)).max() < 1e-12
    assert np.abs(motion.link("rocker").omega - 1).max() < 1e-11
    assert len(scans) == 1


def test_a_kite_is_looked_at_turn_by_turn():
    """It is on its other branch after a turn: what the first turn has is not what the second has."""
    m = four_bar(2.0, 2.0, 5.0, 5.0, 60, -30, 60)
    near, far = m.motion(TWO_TURNS), m.motion(TWO_TURNS + 4 * math.pi * 7)
    found = [np.exp(1j * motion.link("rocker").angle) for motion in (near, far)]
    assert np.abs(found[0] - found[1]).max() < 1e-11


@pytest.mark.parametrize("mirrored", [1, -1])
@pytest.mark.parametrize(
    ("coupler", "rocker", "named"),
    [
        (18.376, 64.944, None),
        (-2.0, 85.0, None),
        (40.0, 40.0, None),
        (20.0, -80.0, ("rocker", -80.0)),
        (-80.0, 65.0, ("rocker", 65.0)),
        (-65.0, -170.0, None),
        (16.0, -112.0, ("rocker", -112.0)),
    ],
)
def test_a_guess_that_contradicts_the_rest_is_named(coupler, rocker, named, mirrored):
    """Norton's four-bar at 60°: coupler and rocker stand at 18.4° and 64.9°, or at −65.2° and −111.8°; a rough guess is some 20° off."""
    m = four_bar(40, 120, 80, 100, *(mirrored * angle for angle in (60, coupler, rocker)))
    warnings = m.assembly.warnings
    expected = named and f"[guess] {named[0]}: {mirrored * named[1]:g} deg contradicts the other guesses"
    assert [w.partition(": they")[0] for w in warnings] == [expected] * (named is not None)


@pytest.mark.parametrize("side", [1, -1])
def test_a_guessed_point_that_contradicts_the_rest_is_named(side):
    """The pin C stands at (133.9, 72.5), as the links' angles have it, and not at (70.3, −74.3)."""
    m = four_bar(40, 120, 80, 100, side * 60, 0, 0)
    turned = {name: side * math.radians(angle) for name, angle in (("coupler", 20.0), ("rocker", 65.0))}
    for point, contradicts in ((72.0 - 76.0j, True), (115.0 + 55.0j, False)):
        at = complex(point.real, side * point.imag)
        guess = Guess(side * math.radians(60), turned, {"C": at})
        warnings = Mechanism(m.ground, m.links, inputs=m.inputs, guess=guess).assembly.warnings
        assert [w.split(" m ")[0] for w in warnings] == [f"[guess] C: (72, {-76 * side})"] * contradicts


@pytest.mark.parametrize("unit", [1.0, math.degrees(1.0)], ids=["radians", "degrees read as radians"])
@pytest.mark.parametrize("mirrored", [1, -1])
def test_a_guess_in_degrees_that_is_read_in_radians_is_named(mirrored, unit):
    """Angles of 60, 20 and 65 are some ten turns in radians; two turns, as of a four-stroke engine, are none too many."""
    m = four_bar(40, 120, 80, 100, *(mirrored * unit * angle for angle in (60, 20, 65)))
    named = [w.partition(" is ")[0] for w in m.assembly.warnings if "turns" in w]
    expected = ["at crank: {}60 rad", "coupler: {}20 rad", "rocker: {}65 rad"]
    sign = "-" if mirrored < 0 else ""
    assert named == [f"[guess] {text.format(sign)}" for text in expected] * (unit != 1.0)
    two = Mechanism(m.ground, m.links, inputs=m.inputs, guess=Guess(mirrored * 4 * math.pi, m.guess.angles))
    assert not any("at crank" in w for w in two.assembly.warnings)
    own = Mechanism(
        m.ground, m.links, inputs=Input("crank", value=mirrored * 60.0), guess=Guess(angles=m.guess.angles)
    )
    assert any(w.startswith(f"[input] crank: {sign}60 rad is 9.55 turns") for w in own.assembly.warnings)


@pytest.mark.parametrize(("coupler", "rocker"), [(0.7, 0.299), (1.9, 0.902)])
def test_links_that_turn_about_one_place_have_no_dips(coupler, rocker, monkeypatch):
    """Both ground pins in one place: coupler and rocker turn with the crank, or reach it nowhere; no dip of rounding is searched."""
    monkeypatch.setattr("virtualwork.branch.sampling.lowest", lambda *_: pytest.fail("a constant has no dip"))
    m = four_bar(1.0, coupler, rocker, 0.0, 10, 40, 70)
    motion = m.motion(TWO_TURNS, speed=1.0)
    if coupler + rocker < 1:
        assert not motion.assembled.any()
        return
    assert np.abs(np.diff(np.unwrap(motion.link("rocker").angle - TWO_TURNS))).max() < 1e-13
    assert np.abs(motion.link("coupler").omega - 1).max() < 1e-12
    assert len(Check(m.assembly).change_points) == 0


@pytest.mark.parametrize(
    ("lengths", "angles"),
    [
        (
            (0.1, 0.2, 0.2, 0.3),
            (60, 180),
        ),  # crank and ground stretch coupler and rocker: 0.1 + 0.3 = 0.2 + 0.2
        ((0.3, 0.1, 0.2, 0.4), (0, 180)),  # and fold them: 0.4 − 0.3 = 0.2 − 0.1
        ((0.3, 0.3, 0.3, 0.3), (0, 180)),
        ((0.4, 1.2, 0.8, 1.0), (math.degrees(math.acos(1.72 / 1.92)), math.degrees(math.acos(0.12 / 1.92)))),
    ],
)
def test_transmission_angles_of_decimals_that_are_equal_in_sum(lengths, angles):
    """In floats 0.1 + 0.3 is not 0.2 + 0.2: by the root of the difference the angle was 2e-6° off."""
    (found,) = four_bar(*lengths, 0.3, 0.5, 1.5).check.four_bars
    assert np.degrees(found.transmission) == pytest.approx(angles, abs=1e-12)


@pytest.mark.parametrize("ratio", [-1.5, 2.0, 1 / 3])
def test_every_assembly_of_a_loop_that_drives_a_gear(ratio):
    """A quick return whose bar turns a wheel, whose pin pulls a rod: the bar's other assembly is half a turn on."""
    m = Mechanism(
        {"O": (0, 0), "Q": (0, -0.06), "G": (0.2, 0)},
        {
            "crank": Link({"O": (0, 0), "A": (0.1, 0)}),
            "bar": Link({"Q": (0, 0)}),
            "wheel": Link({"G": (0, 0), "W": (0.03, 0)}),
            "rod": Link({"W": (0, 0), "B": (0.3, 0)}),
        },
        [Guide("A", "crank", "bar", "Q"), Guide("B", "rod", through=(0, 0.05))],
        gears=[Gear(("bar", "wheel"), ratio)],
        inputs=Input("crank"),
        guess=Guess(0.7, {"bar": 1.0, "wheel": 0.2, "rod": 3.0}),
    )
    all_ = m.assemblies()
    assert len(all_) == 4
    first, *others = [Motion(each, np.array([0.7, 1.1])) for each in all_]
    assert first.link("wheel").angle[0] == pytest.approx(0.2, abs=1e-14)
    for motion in (first, *others):
        assert motion.assembled.all()
        assert motion.point("B").position[:, 1] == pytest.approx(0.05, abs=1e-14)
        bar, wheel = motion.link("bar").angle, motion.link("wheel").angle
        turned = np.exp(1j * (wheel - wheel[0])) / np.exp(1j * ratio * (bar - bar[0]))
        assert np.abs(turned - 1).max() < 1e-13
