"""Errors against 50 digits, over random mechanisms, scales and poses."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.mechanism import Exact
from virtualwork.formulas.kinematics import Slide

EPS = np.finfo(float).eps
KINDS = ("four-bar", "slider-crank", "inverted slider-crank", "Watt", "Stephenson", "triad")


def errors(m, q, orders=3):
    """Of each order, the largest error of the angles and slides over the largest of them (at least 1); the condition."""
    motion = m.motion(q, speed=1.0, acceleration=0.0)
    exact = Exact(motion)
    assert exact.closed
    found = []
    for order in range(orders):
        values = [
            (
                motion.poses.angle(name, order),
                exact.angle(name, order),
            )
            for name in m.links
        ]
        apart = [float(mp.mpf(float(value[0])) - true) for value, true in values]
        if order == 0:
            apart = [math.remainder(x, 2 * math.pi) for x in apart]
        sizes = [float(true) for _, true in values]
        for i, _ in enumerate(m.guides):
            true = exact.slide(i, order)
            apart.append(float(mp.mpf(float(motion.poses.values([Slide(i, order)])[0][0])) - true) / m.size)
            sizes.append(float(true) / m.size)
        found.append(max(map(abs, apart)) / max(1.0, *map(abs, sizes)))
    return found, float(motion.condition[0])


@pytest.mark.parametrize(
    "kind",
    # a triad is followed through a whole turn by Newton's method, which takes seconds for each
    [kind if kind != "triad" else pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS],
)
def test_errors_are_those_of_rounding(kind, random_mechanism):
    rng = np.random.default_rng(20261121)
    solved = 0
    for _ in range(12):
        m = random_mechanism(kind, rng, 10.0 ** rng.integers(-9, 10))
        q = m.at[0] + rng.choice([0.0, 1e-8, 1e-3]) * rng.normal()
        if not m.motion(q).assembled[0]:
            continue
        solved += 1
        found, condition = errors(m, q)
        for order, error in enumerate(found):
            # rounding the input alone moves a pose by ε·κ, its velocity by ε·κ², its acceleration by ε·κ³
            assert error <= 20 * EPS * condition ** (order + 1), (order, error, condition)
    assert solved >= 9


def test_close_to_a_limit():
    """Within 1e-8 of the limit of a triple-rocker the errors stay those of the condition number."""
    from virtualwork import Guess, Input, Link, Mechanism

    m = Mechanism(
        {"A": (0, 0), "D": (4, 0)},
        {"crank": Link({"A": (0, 0), "B": (2, 0)}), "coupler": Link({"B": (0, 0), "C": (5, 0)}),
         "rocker": Link({"D": (0, 0), "C": (2, 0)})},
        inputs=Input(link="crank"),
        guess=Guess(3.14, {"coupler": 0.3, "rocker": 2.0}),
    )  # fmt: skip
    limit = math.acos((2**2 + 4**2 - 3**2) / (2 * 2 * 4))
    for apart in (1e-2, 1e-5, 1e-8):
        (error,), condition = errors(m, limit + apart, 1)
        assert error <= 20 * EPS * condition
        assert condition > 0.3 / math.sqrt(apart)


def test_a_sweep_is_as_exact_as_its_poses(random_mechanism):
    """Angle addition along a uniform sweep loses nothing against single poses."""
    rng = np.random.default_rng(7)
    m = random_mechanism("slider-crank", rng)
    q = np.linspace(m.at[0] - 0.2, m.at[0] + 0.2, 10001)
    swept = m.motion(q)
    position = swept.point("C").position
    for i in (0, 1, 4095, 4096, 5000, 9999, 10000):
        if swept.assembled[i]:
            alone = m.motion(q[i])
            bound = 20 * EPS * alone.condition[0] * m.size
            assert np.abs(position[i] - alone.point("C").position[0]).max() <= bound
