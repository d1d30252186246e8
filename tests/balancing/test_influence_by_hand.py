"""Influence problems small enough for pencil and paper: weights, condition, significance, the error bound."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import (
    DependentPlanes,
    Infeasible,
    condition_number,
    least_squares,
    minimax,
    plane_significance,
    unseen,
)

EPS = np.finfo(float).eps


def test_condition_numbers() -> None:
    """[[1, 1], [0, 1]] has the squared singular values (3 ± √5)/2; rows weighted by 2 stand √2 as high."""
    golden = (3 + np.sqrt(5)) / 2
    assert condition_number([[1, 1], [0, 1]]) == pytest.approx(golden, rel=1e-14)
    assert condition_number(np.eye(2), [1, 2]) == pytest.approx(np.sqrt(2), rel=1e-14)
    assert condition_number(np.eye(2), [2, 1]) == pytest.approx(np.sqrt(2), rel=1e-14)
    many = condition_number([np.eye(2), [[1, 1], [1, 1]], [[1, 1], [0, 1]]], [1, 1])
    assert many == pytest.approx([1, np.inf, golden], rel=1e-14)
    assert condition_number([[1, 2, 3], [4, 5, 7]]) == np.inf
    assert condition_number(np.ones((4, 2, 3))).tolist() == [np.inf] * 4
    # a plane a thousand times as strong is no worse: powers of two bring it within a factor of two
    assert condition_number([[1, 1024], [0, 1024]]) == pytest.approx(golden, rel=1e-14)


def test_a_result_knows_its_condition_whatever_found_it() -> None:
    alpha = np.array([[1, 1], [0, 1], [0, 0]], dtype=complex)
    golden = (3 + np.sqrt(5)) / 2
    for fix in (
        least_squares(alpha, [1, 2, 3]),
        least_squares(alpha, [1, 2, 3], ridge=0.1),
        minimax(alpha, [1, 2, 3]),
        least_squares(alpha, [1, 2, 3], max_mass=0.5),
    ):
        assert fix.condition_number == pytest.approx(golden, rel=1e-14)
    assert least_squares(np.eye(2), [1, 2], [1, 2]).condition_number == pytest.approx(np.sqrt(2), rel=1e-14)
    assert least_squares(np.eye(2), [1, 2], [1, 2], ridge=0.1).condition_number == pytest.approx(np.sqrt(2))


def test_significance_and_the_combination_least_seen_with_weights() -> None:
    """Columns (√w1, 0) and (√w1, √w2): the sine between them is √(w2/(w1 + w2))."""
    for w1, w2 in ((1.0, 1.0), (1.0, 9.0), (4.0, 1.0)):
        found = plane_significance([[1, 1], [0, 1]], [w1, w2])
        assert found == pytest.approx([np.sqrt(w2 / (w1 + w2))] * 2, rel=1e-14)
    assert plane_significance([[1, 0], [0, 0]]).tolist() == [1.0, 0.0]
    # rows (1, 1) and (ε, −ε): the difference of the planes is seen ε times as well as their sum
    combination, share = unseen([[1, 1], [1, -1]], [1.0, 1e-4])
    assert share == pytest.approx(1e-2, rel=1e-12)
    assert combination == pytest.approx([1, -1], abs=1e-13)
    combination, share = unseen([[1, 1j]])
    assert share == 0
    assert combination == pytest.approx([1, 1j], abs=1e-14)
    combination, share = unseen([[2.0j], [1.0]])
    assert (combination.tolist(), share) == ([1.0], 1.0)
    # a plane half as strong needs twice the mass to stay unseen
    combination, _ = unseen([[2, 1], [2, 1], [0, 0]])
    assert combination == pytest.approx([-0.5, 1], abs=1e-14)


@pytest.mark.parametrize("size", [1.0, 1e-200, 1e200])
def test_root_mean_squares_of_any_size(size: float) -> None:
    fix = least_squares([[0.0], [1.0], [0.0]], np.array([3.0, 5.0, -4.0j]) * size)
    assert fix.residual_rms == pytest.approx(5 / np.sqrt(3) * size, rel=1e-15)
    assert fix.residual_max == 4 * size
    many = least_squares([[[1.0], [0.0]]] * 2, [[1.0, 0.0], [1.0, 7.0]])
    assert many.residual_rms == pytest.approx([0, 7 / np.sqrt(2)], rel=1e-15)


def test_the_error_bound_by_hand() -> None:
    """8 ε (|A⁺|(|A||w| + |V|) + (AᵀA)⁻¹|Aᵀ||r|), worked out on paper."""
    diagonal = least_squares(np.diag([2.0, 4.0]), [1.0, 1.0])  # w = −½, −¼
    assert diagonal.error_estimate() == pytest.approx([8 * EPS, 4 * EPS], rel=1e-12)
    # one plane, two sensors: w = 1, r = (1, −1); ½·1 + ½·3 = 2, and ½·2 = 1
    fix = least_squares([[1.0], [1.0]], [0.0, -2.0])
    assert fix.error_estimate() == pytest.approx([24 * EPS], rel=1e-12)
    # weights 1 and 4: w = 1.6, √w r = (1.6, −0.8); 1.6/5 + 2·7.2/5 = 3.2, and (1.6 + 1.6)/5 = 0.64
    fix = least_squares([[1.0], [1.0]], [0.0, -2.0], [1.0, 4.0])
    assert fix.corrections == pytest.approx([1.6], rel=1e-15)
    assert fix.error_estimate() == pytest.approx([8 * 3.84 * EPS], rel=1e-12)


def test_limits_that_nothing_touches_change_nothing() -> None:
    alpha, v = np.array([[3, -2], [5, -2], [5, -3]]), np.array([1, -1, 0])
    free = least_squares(alpha, v)
    assert np.array_equal(least_squares(alpha, v, max_mass=10.0).corrections, free.corrections)
    assert np.array_equal(least_squares(alpha, v, max_residual=10.0).corrections, free.corrections)
    most = minimax(alpha, v)
    loose = minimax(alpha, v, max_mass=10.0)
    assert loose.corrections == pytest.approx(most.corrections, rel=1e-12)
    assert loose.bound == pytest.approx(0.4, rel=1e-12)


def test_dependent_planes_are_kept_apart_by_their_limits() -> None:
    """Two planes that do the same: 3 units of effect from 1 + 1 at most leave 1; without a limit no telling them apart."""
    alpha, v = np.array([[1.0, 1.0], [2.0, 2.0]]), np.array([-3.0, -6.0])
    fix = least_squares(alpha, v, max_mass=1.0)
    assert fix.corrections == pytest.approx([1.0, 1.0], rel=1e-6)
    assert fix.residual_max == pytest.approx(2.0, rel=1e-6)
    for limit in ([1.0, np.inf], None):
        with pytest.raises(DependentPlanes):
            least_squares(alpha, v, max_mass=limit, max_residual=1.0 if limit is None else None)
        with pytest.raises(DependentPlanes):
            minimax(alpha, v, limit)
    held = minimax(alpha, v, 1.0)
    assert held.residual_max == pytest.approx(2.0, rel=1e-8)
    assert held.bound == pytest.approx(2.0, rel=1e-8)


def test_a_sensor_that_no_plane_moves_excuses_no_other() -> None:
    """Of (1, 10) the plane moves the first alone: it is brought to nothing, though the second stays at ten."""
    fix = minimax([[1.0], [0.0]], [1.0, 10.0])
    assert fix.corrections == pytest.approx([-1.0], rel=1e-12)
    assert fix.residual_max == 10
    assert fix.bound == 10
    fix = minimax(
        [[2.0], [0.0], [2.0j]], [1.0, 10.0, 1.0]
    )  # 1 + 2w and 1 + 2iw: alike in size at w = (-1 + i)/4
    assert fix.corrections == pytest.approx([(-1 + 1j) / 4], abs=1e-10)
    assert np.abs(fix.residual)[[0, 2]] == pytest.approx([np.sqrt(0.5)] * 2, rel=1e-10)


@pytest.mark.parametrize("size", [1e-6, 0.1, 1e6])
def test_a_ceiling_in_any_unit(size: float) -> None:
    """Residuals 1 + w and 1 − w: least squares leaves w = 0 and 1 each, weighted it may leave at most 1.2."""
    alpha, v = np.array([[1.0], [-1.0]]), np.array([1.0, 1.0]) * size
    assert least_squares(alpha, v, max_residual=1.5 * size).corrections == pytest.approx(
        [0.0], abs=1e-12 * size
    )
    fix = least_squares(
        alpha, v, [9.0, 1.0], max_residual=1.2 * size
    )  # freely −0.8, which leaves 0.2 and 1.8
    assert fix.corrections == pytest.approx([-0.2 * size], rel=1e-6)
    assert fix.residual_max <= 1.2 * size
    with pytest.raises(Infeasible) as caught:
        least_squares(alpha, v, max_residual=0.9 * size)
    assert caught.value.smallest == pytest.approx(size, rel=1e-9)
    with pytest.raises(ValueError, match="positive"):
        least_squares(alpha, v, max_residual=0.0)
