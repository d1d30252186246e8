"""What rounds in the accelerations counts in the error of a motion in time: a long spring that is hardly stretched."""

from __future__ import annotations

import itertools
import math

import mpmath as mp
import numpy as np
import pytest

from benchmarks.stress import released
from benchmarks.stress.random_linkages import four_bar
from benchmarks.truth.mechanism import Exact
from tests.virtualwork.released import G
from tests.virtualwork.released import four_bar as swinging
from virtualwork import Friction, Guide, Input, Link, Mechanism, Spring
from virtualwork.formulas.kinematics import Angle


def far_spring(k: float, mass: float, free: float, mu: float) -> Mechanism:
    """A block on a level guide, and a spring along it of a length far beyond its amplitude."""
    return Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=mass)},
        guides=[Guide("P", "block", turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        gravity=-1j * G,
        friction=[Friction("P", mu)] if mu else [],
        springs=[Spring((("block", 0j), ("ground", complex(-free))), k, free)],
    )


def swings(k: float, mass: float, mu: float, x: float, end: float) -> float:
    """Its place after a time, from rest: half sines about the dead band's ends, in 40 digits."""
    from mpmath import cos, mp, mpf, pi, sqrt

    with mp.workdps(40):
        w, band = sqrt(mpf(k) / mpf(mass)), mpf(mu) * mpf(mass) * mpf(G) / mpf(k)
        place, left = mpf(x), mpf(end)
        while mu == 0 or abs(place) > band:
            middle = band if place > 0 else -band
            if pi / w >= left:
                return float(middle + (place - middle) * cos(w * left))
            place, left = 2 * middle - place, left - pi / w
        return float(place)


def holds(seed: int, rubs: bool, free: float) -> None:
    rng = np.random.default_rng(seed)
    k, mass, x = 10 ** rng.uniform(0, 3), 10 ** rng.uniform(-1, 1), 6e-7
    mu = 10 ** rng.uniform(-3, -0.5) * k * x / (mass * G) if rubs else 0.0
    times = np.linspace(0, rng.uniform(0.5, 20) * math.sqrt(mass / k), 7)
    accuracy = 10 ** rng.uniform(-13, -9)
    run = far_spring(k, mass, free, mu).simulate(times, angle=x, accuracy=accuracy)
    assert run.ended == "end", (run.ended, run.t, free, mu, k, mass)
    error = np.abs(run.angle[:, 0] - [swings(k, mass, mu, x, t) for t in times.tolist()])
    assert (error <= run.error_estimate[:, 0]).all()
    # and not without measure: rounding of the spring's length, over some swings
    assert run.error_estimate.max() < max(accuracy, 1e3 * np.finfo(float).eps * free)


@pytest.mark.parametrize("seed", [0, 3, 11])
def test_rates_near_a_limit_round_as_those_of_the_pose(seed: int) -> None:
    """Released 1e-7 rad from its input's limit: the two ways through time begin alike, and the rates have lost seven digits."""
    m, at = four_bar(np.random.default_rng(seed), 1e-7, 1.0, limit=True)
    run = m.simulate([0.0, 1e-9], angle=at, speed=0.0)
    exact = Exact(run.motion)
    with mp.workdps(50):
        for link in ("coupler", "rocker"):
            own = run.rounding(Angle(link, 2))[0]
            alpha = run.motion.link(link).alpha[0]
            error = float(abs(exact.angle(link, 2) - mp.mpf(float(alpha))))
            assert error <= own <= 1e-6 * abs(alpha)
            assert own > 1e-12 * abs(alpha)


@pytest.mark.whole
@pytest.mark.parametrize("rubs", [True, False])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_spring_of_ten_metres_stretched_by_a_millionth(seed: int, rubs: bool) -> None:
    """Its pull has nine digits fewer than its length: estimates of 1e-17 m stood beside errors of 1.5e-15 m."""
    holds(seed, rubs, 10.0)


@pytest.mark.parametrize("seed", [20261123023, 20261123029, 20261123037])
def test_a_half_swing_ends_where_rounding_lets_it(seed: int) -> None:
    """At rest the speed is what rounding makes of it within a step: "friction would drive joint P there" is no answer."""
    holds(seed, True, 10.0 ** np.random.default_rng(seed).uniform(-2, 3))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_far_springs_at_random(seed: int) -> None:
    holds(seed, bool(seed % 2), 10.0 ** np.random.default_rng(seed).uniform(-2, 3))


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("short", [0.04, 1.6e-3, 1e-4])
def test_a_pendulum_that_comes_by_its_upper_rest_again_and_again(short: float, side: int) -> None:
    """Three periods, six times past the upper rest: sin(θ/2) = k cd(ωt, k²) about the lower one."""
    m = Mechanism({"O": 0j}, {"bob": Link({"O": 0j}, 2.0, 0.5)}, inputs=Input(link="bob"), gravity=-1j * G)
    start = -math.pi / 2 + side * (math.pi - short)
    with mp.workdps(40):
        lower = mp.pi / 2
        k, w = mp.sin((start + lower) / 2), mp.sqrt(mp.mpf(G) / mp.mpf("0.5"))
        end = float(3 * 4 * mp.ellipk(k * k) / w)
        run = m.simulate(np.linspace(0.0, end, 32), angle=start, speed=0.0)
        exact = [2 * mp.asin(k * mp.ellipfun("cd", w * mp.mpf(t), m=k * k)) - lower for t in run.t.tolist()]
        off = np.array(
            [float(abs(mp.mpf(q) - x)) for q, x in zip(run.angle[:, 0].tolist(), exact, strict=True)]
        )
    assert (off <= run.error_estimate[:, 0]).all()
    # an error of the start grows by 1/short² each time it comes by the rest: they add up, and do not multiply
    assert run.error_estimate.max() < 2e4 * np.finfo(float).eps / short**2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 1, 18])
def test_rounding_grows_through_changes_of_coordinates(seed: int) -> None:
    """A five-bar that passes dead points of its inputs, started at other times: only rounding differs, and the estimates cover it."""
    m = released._linkage(np.random.default_rng(seed), "five-bar")
    t = np.linspace(0, 3, 4)
    runs = [m.simulate(t + later, accuracy=1e-11) for later in (0.0, 64.0, 512.0)]
    assert all(len(run.fine.legs) > 2 for run in runs)
    for one, other in itertools.combinations(runs, 2):
        # the times themselves are rounded
        off = 512 * np.finfo(float).eps * np.abs(one.speed)
        apart = np.abs(one.angle - other.angle)
        assert (apart <= one.error_estimate + other.error_estimate + off).all()


def test_small_changes_go_from_one_set_of_coordinates_to_another_and_back() -> None:
    """The derivatives of states undo each other, and take (q̇, q̈) with them."""
    run = swinging("rocker").simulate([0, 2.5])
    assert len(run.fine.legs) > 1
    for before, after in itertools.pairwise(run.fine.legs):
        _, q, v, rates, _ = before.last
        _, p, w, others, _ = after.parted(after.rows[0])
        there = before.coordinates.onto(after.coordinates, q, v)
        back = after.coordinates.onto(before.coordinates, p, w)
        size = np.abs(there) @ np.abs(back)
        # by differences over 2⁻²⁴: half of all digits
        assert (np.abs(there @ back - np.eye(2)) <= 1e-8 * size.max()).all()
        moved = there @ [v[0], rates[0]]
        assert moved == pytest.approx([w[0], others[0]], rel=1e-6)
        # the same coordinates change nothing
        assert (before.coordinates.onto(before.coordinates, q, v) == np.eye(2)).all()
