"""The minimax problem: every answer is held against its dual bound, an independent proof."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from balancing import Balance, DependentPlanes, NotConverged, least_squares, minimax

Complex = NDArray[np.complex128]


def noise(rng: np.random.Generator, *shape: int) -> Complex:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def gap(fix: Balance) -> float:
    assert fix.bound is not None
    return (float(fix.residual_max) - fix.bound) / float(fix.residual_max)


@settings(max_examples=80, deadline=None)
@given(st.integers(1, 8), st.integers(1, 16), st.integers(0, 2**31))
def test_random_problems_are_proven(p: int, more: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    alpha, v = noise(rng, p + more, p), noise(rng, p + more)
    fix = minimax(alpha, v)
    assert -1e-14 <= gap(fix) < 1e-10
    assert fix.residual_max <= least_squares(alpha, v).residual_max * (1 + 1e-14)
    for _ in range(5):  # and nothing near it is better
        w = fix.corrections + 1e-3 * noise(rng, p)
        assert np.abs(v + alpha @ w).max() >= fix.residual_max * (1 - 1e-14)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 6), st.integers(0, 10), st.integers(0, 2**31), st.floats(0.05, 0.99))
def test_limits_are_kept_and_proven(p: int, more: int, seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    alpha, v = noise(rng, p + more, p), noise(rng, p + more)
    cap = share * np.abs(least_squares(alpha, v).corrections)
    fix = minimax(alpha, v, cap)
    assert (np.abs(fix.corrections) <= cap).all()
    assert -1e-14 <= gap(fix) < 1e-6


def test_24_by_8_to_the_last_digits() -> None:
    worst = 0.0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        worst = max(worst, gap(minimax(noise(rng, 24, 8), noise(rng, 24))))
    assert worst < 1e-13


@pytest.mark.parametrize("power", [-40, -20, 20, 40])
def test_units_change_nothing(power: int) -> None:
    rng = np.random.default_rng(1)
    alpha, v = noise(rng, 9, 3), noise(rng, 9)
    unit = 2.0**power
    here = minimax(alpha, v, 0.3)
    there = minimax(alpha * unit, v, 0.3 / unit)
    assert there.residual_max == pytest.approx(float(here.residual_max), rel=1e-13)


@pytest.mark.parametrize("kappa", [1e2, 1e4, 1e6, 1e8])
def test_ill_conditioned_planes(kappa: float) -> None:
    rng = np.random.default_rng(2)
    q = np.linalg.qr(noise(rng, 24, 8))[0]
    alpha = q * np.geomspace(1, 1 / kappa, 8) @ np.linalg.qr(noise(rng, 8, 8))[0]
    v = noise(rng, 24)
    if kappa > 1e7:
        # where masses of 5e7 leave a residual of 1, rounding of the masses alone is about 1e-9 of it
        try:
            reached, is_returned = gap(minimax(alpha, v)), True
        except NotConverged as error:
            reached, is_returned = error.gap, False
        assert is_returned == (reached <= 1e-9)
    else:
        assert gap(minimax(alpha, v)) < 1e-15 * kappa + 1e-12


@pytest.mark.parametrize("n", [3, 4, 5, 6, 12])
def test_a_regular_polygon(n: int) -> None:
    """One plane that moves n readings alike: the best is the middle of the polygon, radius 1."""
    fix = minimax(np.ones((n, 1)), 2 + np.exp(2j * np.pi * np.arange(n) / n))
    assert fix.corrections == pytest.approx([-2], abs=1e-12)
    assert float(fix.residual_max) == pytest.approx(1, rel=1e-13)
    assert fix.bound == pytest.approx(1, rel=1e-12)


def test_degenerate_problems() -> None:
    rng = np.random.default_rng(3)
    alpha, v = noise(rng, 12, 4), noise(rng, 12)
    alpha[3], v[3] = alpha[2], v[2]  # a sensor read twice
    once = minimax(np.delete(alpha, 3, 0), np.delete(v, 3))
    assert minimax(alpha, v).residual_max == pytest.approx(float(once.residual_max), rel=1e-10)
    # as many planes as readings: nothing is left
    assert minimax(alpha[:4] + np.eye(4), v[:4]).residual_max < 1e-13
    assert minimax(alpha, np.zeros(12)).residual_max == 0
    # real data have a real answer
    real = minimax(alpha.real, v.real)
    assert np.abs(real.corrections.imag).max() < 1e-10
    assert gap(real) < 1e-10


def test_dependent_planes() -> None:
    rng = np.random.default_rng(4)
    alpha, v = noise(rng, 12, 4), noise(rng, 12)
    alpha[:, 3] = alpha[:, 2]
    with pytest.raises(DependentPlanes):
        minimax(alpha, v)
    with pytest.raises(DependentPlanes):
        minimax(noise(rng, 2, 3), noise(rng, 2))
    # with limits there is an answer: the two share one limit of twice the size
    for cap in (0.1, 30.0):
        both = minimax(alpha, v, cap)
        one = minimax(alpha[:, :3], v, [cap, cap, 2 * cap])
        assert both.residual_max == pytest.approx(float(one.residual_max), rel=1e-10)
        assert (np.abs(both.corrections) <= cap).all()


def test_weights_multiply_the_residuals() -> None:
    rng = np.random.default_rng(5)
    alpha, v = noise(rng, 9, 3), noise(rng, 9)
    weights = rng.uniform(0.2, 3, 9)
    fix = minimax(alpha, v, weights=weights)
    assert fix.bound is not None
    assert float((weights * np.abs(fix.residual)).max()) == pytest.approx(fix.bound, rel=1e-12)


def test_one_rotor_at_a_time() -> None:
    with pytest.raises(ValueError, match="one rotor at a time"):
        minimax(np.ones((2, 3, 1)), np.ones((2, 3)))
