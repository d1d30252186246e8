"""Limits, dead points and change points on the branch's own scale."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from virtualwork import Gear, Guess, Input, Link, Mechanism
from virtualwork.study.check import Check


def change_point_four_bar(dyad: bool) -> Mechanism:
    """Crank 60, coupler 90, rocker 70, ground 100 mm: s + l = p + q, the same pose again after two turns."""
    ground = {"A": (0, 0), "D": (0.1, 0)}
    links = {
        "crank": Link({"A": (0, 0), "B": (0.06, 0)}),
        "coupler": Link({"B": (0, 0), "C": (0.09, 0)}),
        "rocker": Link({"D": (0, 0), "C": (0.07, 0)}),
    }
    angles = {"coupler": -1.45, "rocker": 3.7}
    if dyad:
        ground["F"] = (-0.05, 0.1)
        links["rod"] = Link({"C": (0, 0), "E": (0.142, 0)})
        links["lever"] = Link({"F": (0, 0), "E": (0.1, 0)})
        angles |= {"rod": 1.8, "lever": -0.5}
    return Mechanism(ground, links, inputs=Input("crank"), guess=Guess(math.radians(60), angles))


def test_a_branch_with_one_change_point_a_turn_has_two_turns():
    m = change_point_four_bar(dyad=False)
    assert m.assembly.reach.turns == 2
    assert np.degrees(Check(m.assembly).change_points) == pytest.approx([180, 540], abs=1e-7)


def test_a_dead_point_of_the_second_turn_is_not_printed_in_the_first():
    """The dyad is out of reach where the chain carries C far from F, which it does in its second turn only."""
    m = change_point_four_bar(dyad=True)
    check = Check(m.assembly)
    dead = np.degrees(check.dead_points)
    q = np.radians(np.arange(0, 1440, 0.25))
    there = m.motion(q).assembled
    assert m.assembly.reach.turns == 2
    # what a dense scan of the whole branch says
    edges = np.flatnonzero(there[:-1] != there[1:])
    scanned = np.unique(((np.degrees(q[edges]) + 0.125) % 720).round(3))
    assert len(dead) == len(scanned) == 2
    assert np.abs(np.sort(dead) - scanned).max() < 0.13
    assert dead.min() > 360
    # at the same angle a turn away a sweep passes smoothly
    for at in dead:
        assert m.motion(np.radians((at + 360) % 720 + np.linspace(-0.1, 0.1, 5))).assembled.all()
    low, high = check.input_limits
    assert low < m.at[0] < high
    just = np.array([low + 1e-9, high - 1e-9, low - 1e-9, high + 1e-9])
    assert m.motion(just).assembled.tolist() == [True, True, False, False]


def test_a_dead_point_at_446_degrees_and_none_at_86():
    """Rod 160 and lever 155 from C to F: stretched where |C − F| = 315, which C reaches on the other side of the rocker."""
    m = change_point_four_bar(dyad=True)
    m = Mechanism(
        m.ground | {"F": (-0.105, -0.175)},
        m.links | {"rod": Link({"C": (0, 0), "E": (0.16, 0)}), "lever": Link({"F": (0, 0), "E": (0.155, 0)})},
        inputs=m.inputs,
        guess=Guess(m.at, {"coupler": -1.45, "rocker": 3.7, "rod": 3.14, "lever": 1.57}),
    )

    def over(q: mp.mpf) -> mp.mpf:
        """|C − F| − 315 mm, with C to the left of the way from B to D: the rocker's place of the second turn."""
        w = 100 - 60 * mp.expj(q)
        along = (abs(w) ** 2 + 90**2 - 70**2) / (2 * abs(w))
        c = 100 - w + w / abs(w) * (along + mp.j * mp.sqrt(90**2 - along**2))
        return abs(c - mp.mpc(-105, -175)) - 315

    with mp.workdps(30):
        second, first = (float(mp.degrees(mp.findroot(over, mp.radians(q)))) for q in (86.3, 347.2))
    assert round(second, 2) == 86.26
    check = Check(m.assembly)
    assert np.degrees(check.dead_points) == pytest.approx([first, second + 360], abs=1e-9)
    assert np.degrees(check.input_limits) == pytest.approx([second - 360, first], abs=1e-9)
    assert np.degrees(check.printed_limits) == pytest.approx([second + 360, first], abs=1e-9)
    # 86.26 lies in the middle of the range, and a sweep passes it as any other place
    at = np.radians(np.linspace(86.16, 86.36, 21))
    e = m.motion(at).point("E").position
    assert np.isfinite(e).all()
    assert np.abs(np.diff(e, 2, axis=0)).max() < 1e-7


def test_a_mechanism_behind_a_reducing_gear_repeats_after_its_own_number_of_turns():
    """The crank turns once in two turns of the input: the limits of a triple-rocker lie in [0, 720)."""
    m = Mechanism(
        {"A": (0, 0), "D": (4, 0), "G": (-3, 0)},
        {
            "pinion": Link({"G": (0, 0), "T": (1, 0)}),
            "crank": Link({"A": (0, 0), "B": (2, 0)}),
            "coupler": Link({"B": (0, 0), "C": (5, 0)}),
            "rocker": Link({"D": (0, 0), "C": (2, 0)}),
        },
        gears=[Gear(("pinion", "crank"), -0.5)],
        inputs=Input("pinion"),
        guess=Guess(0.0, {"crank": math.pi, "coupler": 0.3, "rocker": 2.0}),
    )
    assert m.assembly.reach.turns == 2
    half = math.radians(46.56746344221)
    expected = sorted((-2 * (q - math.pi)) % (4 * math.pi) for q in (half, 2 * math.pi - half))
    assert Check(m.assembly).dead_points == pytest.approx(expected, abs=1e-10)


def test_a_gear_that_no_loop_hangs_on_does_not_count():
    m = change_point_four_bar(dyad=False)
    m = Mechanism(
        {**m.ground, "G": (0, 1)},
        {**m.links, "wheel": Link({"G": (0, 0)})},
        gears=[Gear(("crank", "wheel"), -5 / 7)],
        inputs=m.inputs,
        guess=m.guess,
    )
    assert m.assembly.reach.turns == 2


def test_a_branch_that_never_repeats_has_no_period():
    m = Mechanism(
        {"A": (0, 0), "E": (1, 0)},
        {
            "first": Link({"A": (0, 0), "B": (0.5, 0)}),
            "last": Link({"E": (0, 0), "D": (0.4, 0)}),
            "left": Link({"B": (0, 0), "C": (0.9, 0)}),
            "right": Link({"D": (0, 0), "C": (0.9, 0)}),
        },
        gears=[Gear(("first", "last"), math.sqrt(2))],
        inputs=Input("first"),
        guess=Guess(0.3, {"last": 1.0, "left": 0.9, "right": 1.9}),
    )
    assert m.assembly.reach.turns is None
    assert Check(m.assembly).dead_points == ()
