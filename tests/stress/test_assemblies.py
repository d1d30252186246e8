"""Limits and assemblies of any topology against a scan of all constraints (benchmarks.stress.assemblies)."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.stress.assemblies import one_input, wrong_assemblies, wrong_dead_points, wrong_limits
from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism


def _limits(seeds: range) -> int:
    met = 0
    for seed in seeds:
        t = one_input(seed)
        if t is not None:
            assert wrong_limits(t) == [], f"seed {seed}"
            met += t.mechanism.check.input_limits is not None
    return met


def _assemblies(seeds: range) -> int:
    several = 0
    for seed in seeds:
        t = one_input(seed)
        # a gear of another tooth is another mechanism, not another assembly
        if t is not None and not t.mechanism.gears and len(t.mechanism.links) <= 4:
            assert wrong_assemblies(t, np.random.default_rng(seed)) == [], f"seed {seed}"
            several += len(t.mechanism.assemblies()) > 1
    return several


@pytest.mark.parametrize("seed", [19, 294])
def test_the_limit_of_a_slide_beyond_the_size_of_the_mechanism(seed: int) -> None:
    """Of 0.1.0: said to be infinitely far."""
    t = one_input(seed)
    assert t is not None
    assert t.mechanism.inputs[0].is_slide
    assert wrong_limits(t) == []
    low, high = t.mechanism.check.input_limits or (0.0, 0.0)
    assert max(t.inputs[0] - low, high - t.inputs[0]) > t.mechanism.size


def test_a_limit_on_one_side_alone() -> None:
    t = one_input(112)
    assert t is not None
    assert wrong_limits(t) == []
    assert t.mechanism.check.input_limits[1] == np.inf


@pytest.mark.slow
def test_limits_are_where_a_scan_can_go_no_further() -> None:
    assert _limits(range(18)) > 2


@pytest.mark.slow
def test_every_assembly_is_listed_and_closes() -> None:
    assert _assemblies(range(60)) > 2


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(100061, id="a gear of fractional ratio inside a group"),
        pytest.param(100202, id="ends of ranges in other turns, where the wheels stand otherwise"),
        pytest.param(100249, id="a slide's other range, behind a gap"),
        pytest.param(100300, id="the same"),
        pytest.param(500227, id="a group whose own range is longer than a turn"),
        pytest.param(92604029, id="a group that ends with the one before it, its own Jacobian constant"),
    ],
)
def test_dead_points_of_every_range(seed: int) -> None:
    t = one_input(seed)
    assert t is not None
    assert wrong_dead_points(t) == []


@pytest.mark.slow
def test_dead_points_are_where_a_scan_can_go_no_further() -> None:
    met = 0
    for seed in range(40):
        t = one_input(seed)
        if t is not None:
            assert wrong_dead_points(t) == [], f"seed {seed}"
            met += len(t.mechanism.check.dead_points) > 0
    assert met > 5


def test_behind_a_limit_nothing_stands_where_a_gear_turns_by_halves() -> None:
    """Seed 11: links of one group turn by half a turn of the input; a turn back it stands otherwise, not as before."""
    t = one_input(11)
    assert t is not None
    m = t.mechanism
    low, _ = m.check.input_limits or (0.0, 0.0)
    assert m.assembly.reach.turns == 2
    assert m.motion(low + np.array([1e-6, 1.0, 6.0])).assembled.all()
    assert not m.motion(low - np.array([1e-6, 1.0, 4.0, 2 * np.pi, 7.0])).assembled.any()


def test_a_crank_driven_by_its_piston_has_four_dead_points() -> None:
    """±(rod ± crank): a range that is met behind the gap, half of it within one size from the guess, has both of its ends."""
    m = Mechanism(
        {"O": (0, 0), "S": (0, 2)},
        {
            "crank": Link({"O": (0, 0), "C": (0.5, 0)}),
            "rod": Link({"C": (0, 0), "B": (1, 0)}),
            "block": Link({"B": (0, 0)}),
        },
        guides=[Guide("B", "block", "ground", 0j, 0.0, 0.0)],
        inputs=Input(slider="B"),
        guess=Guess(at=1.2, angles={"rod": 0.3, "crank": -0.5}),
    )
    assert m.check.dead_points == pytest.approx((-1.5, -0.5, 0.5, 1.5), abs=1e-12)
    assert m.check.input_limits == pytest.approx((0.5, 1.5), abs=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_a_group_without_a_closed_form_ends_where_the_one_before_it_does(side: int) -> None:
    """Two bars geared together ride on a four-bar, and one slides along the other: they stop with it, where it folds.

    The Jacobian of the two is constant; its rounding was extrapolated to a limit up to 0.2 degrees off.
    """
    crank, coupler, rocker, base = 2.0, 1.0, 1.5, 2.6
    end = float(np.arccos((crank**2 + base**2 - (coupler + rocker) ** 2) / (2 * crank * base)))
    m = Mechanism(
        {"A": (0, 0), "D": (base, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (crank, 0)}),
            "coupler": Link({"B": (0, 0), "C": (coupler, 0)}),
            "rocker": Link({"D": (0, 0), "C": (rocker, 0)}),
            "bar": Link({"C": (0, 0)}),
            "arm": Link({"C": (0, 0), "E": (0.7, 0.4)}),
        },
        guides=[Guide("E", "arm", "bar", 0.3j, 0.0)],
        gears=[Gear(("bar", "arm"), -1.9)],
        inputs=Input("crank"),
        guess=Guess(0.7 * side, {"coupler": -0.5 * side, "rocker": 1.9 * side, "bar": 0.4, "arm": 0.1}),
    )
    assert m.check.input_limits == pytest.approx((-end, end), abs=1e-14)
    assert m.check.dead_points == pytest.approx((end, 2 * np.pi - end), abs=1e-14)
