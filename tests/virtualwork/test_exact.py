"""Errors against 50 digits, over random mechanisms, scales and poses."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

EPS = np.finfo(float).eps
KINDS = ("four-bar", "slider-crank", "inverted slider-crank", "Watt", "Stephenson", "triad")


def errors(m, q, exact, order):
    """Largest error of the unknowns' derivatives of an order, relative to the largest of them (at least 1)."""
    motion = m.motion(q, speed=1.0, acceleration=0.0)
    reference = exact(m.assembly, q, order)
    worst, largest = 0.0, 1.0
    for name, values in reference.items():
        if isinstance(name, str):
            found = motion.poses.angle(name) if order == 0 else motion.poses.angle_derivative(name, order)
            scale = 1.0
        else:
            found, scale = motion.poses.slide_derivative(name, order), m.size
        difference = mp.mpf(float(found[0])) - values[order]
        if order == 0 and isinstance(name, str):
            difference = math.remainder(float(difference), 2 * math.pi)
        worst = max(worst, abs(float(difference)) / scale)
        largest = max(largest, abs(float(values[order])) / scale)
    return worst / largest, float(motion.condition[0])


@pytest.mark.parametrize("kind", KINDS)
def test_errors_are_those_of_rounding(kind, random_mechanism, exact):
    rng = np.random.default_rng(20261121)
    solved = 0
    for _ in range(12):
        m = random_mechanism(kind, rng, 10.0 ** rng.integers(-9, 10))
        q = m.at[0] + rng.choice([0.0, 1e-8, 1e-3]) * rng.normal()
        if not m.motion(q).assembled[0]:
            continue
        solved += 1
        for order in range(3):
            error, condition = errors(m, q, exact, order)
            # rounding the input alone moves a pose by ε·κ, its velocity by ε·κ², its acceleration by ε·κ³
            assert error <= 20 * EPS * condition ** (order + 1), (order, error, condition)
    assert solved >= 9


def test_close_to_a_limit(exact):
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
        error, condition = errors(m, limit + apart, exact, 0)
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
