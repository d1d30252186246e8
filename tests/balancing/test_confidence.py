"""Linear propagation of reading errors, against drawn readings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from balancing import LogBalance, minimax, spread
from tests.balancing.measured import balance, fitted


def measured(errors: tuple[float, float], *, runout: bool = False, **how: Any) -> LogBalance:
    rng = np.random.default_rng(0)
    alpha = rng.normal(size=(4, 2)) + 1j * rng.normal(size=(4, 2))
    v0 = 10 * (rng.normal(size=4) + 1j * rng.normal(size=4))
    on = np.array([[3, 0], [3, 2j]])
    shift = 0.3 * rng.normal(size=4) + 0j if runout else None
    return balance(fitted(v0, v0 + on @ alpha.T, on), errors, runout=shift, **how)


@pytest.mark.parametrize("ridge", [0.0, 0.3])
@pytest.mark.parametrize("weights", [None, [1, 3, 0.5, 2]])
@pytest.mark.parametrize("errors", [(1e-3, 0.0), (0.0, 1e-3), (1e-3, 2e-3)])
def test_propagation_is_what_drawing_shows(
    errors: tuple[float, float], weights: list[float] | None, ridge: float
) -> None:
    read = measured(errors, runout=True, weights=weights, ridge=ridge)
    linear = read.covariance
    drawn = spread(read.correction_samples(n=40_000), read.corrections)
    assert np.diagonal(linear, axis1=1, axis2=2) == pytest.approx(
        np.diagonal(drawn, axis1=1, axis2=2), rel=0.06
    )
    assert np.abs(linear - drawn).max() < 0.06 * np.abs(linear).max()


def test_one_plane_by_hand() -> None:
    """w = -V0 t/(V1 - V0): its relative derivatives are V1/(V0 (V1 - V0)) dV0 and -dV1/(V1 - V0)."""
    v0, v1, t = 3.4 * np.exp(2j), 1.8 * np.exp(0.7j), 2.0
    read = balance(fitted([v0], [[v1]], [[t]]), (0.02, 0.0))
    parts = np.array([v1 / (v1 - v0), -v1 / (v1 - v0)]) * 0.02
    covariance = read.covariance[0] / abs(read.corrections[0]) ** 2
    assert covariance[0, 0] == pytest.approx((parts.real**2).sum(), rel=1e-12)
    assert covariance[1, 1] == pytest.approx((parts.imag**2).sum(), rel=1e-12)
    assert covariance[0, 1] == pytest.approx((parts.real * parts.imag).sum(), rel=1e-12)


def test_given_coefficients_count_as_exact() -> None:
    covariance = balance(fitted([6.0], influence=[[2.0]]), (0.01, 0.02)).covariance
    assert np.sqrt(np.diagonal(covariance[0])) == pytest.approx([0.03, 0.06], rel=1e-12)


def test_the_residual_that_is_left() -> None:
    read = measured((0.02, 0.03))
    w = read.corrections
    samples = read.residual_samples(n=20_000)
    mean = read.fit.initial + read.fit.influence @ w
    assert np.abs(samples.mean(axis=0) - mean).max() < 0.05 * np.abs(samples - mean).max()
    # the same from the drawn problems themselves
    again = np.array([v + alpha @ w for alpha, v in read.problem_samples(2000)])
    assert np.quantile(np.abs(again).max(axis=1), 0.95) == pytest.approx(
        np.quantile(np.abs(samples).max(axis=1), 0.95), rel=0.05
    )


def test_minimax_spread_by_drawing_grows_with_the_errors() -> None:
    """No formula stands for it: with the same draws, errors of half the size make half the spread."""
    sizes = []
    for error in (1e-5, 2e-5):
        read = measured((error, error))
        w = minimax(read.fit.influence, read.fit.initial).corrections
        drawn = np.array([minimax(a, v).corrections for a, v in read.problem_samples(40)])
        sizes.append(np.sqrt(np.trace(spread(drawn, w), axis1=1, axis2=2)))
    assert sizes[1] / sizes[0] == pytest.approx([2, 2], rel=0.05)
    assert (sizes[0] > 0).all()
