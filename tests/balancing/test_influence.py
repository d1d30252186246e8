"""Influence coefficients and least squares, against exact arithmetic and many digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from balancing import (
    DependentPlanes,
    DependentTrials,
    Infeasible,
    condition_number,
    influence_coefficients,
    least_squares,
    minimax,
    plane_significance,
    unseen,
)

EPS = np.finfo(float).eps
Complex = NDArray[np.complex128]


def noise(rng: np.random.Generator, *shape: int) -> Complex:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def exact_least_squares(alpha: Complex, v: Complex) -> Complex:
    """By 60 digits; the normal equations are harmless there."""
    with mp.workdps(60):
        a = mp.matrix([[mp.mpc(x) for x in row] for row in alpha.tolist()])
        b = mp.matrix([mp.mpc(x) for x in v.tolist()])
        w = mp.lu_solve(a.H * a, -(a.H * b))
        return np.array([complex(x) for x in w])


def graded(rng: np.random.Generator, s: int, p: int, kappa: float) -> Complex:
    u = np.linalg.qr(noise(rng, s, p))[0]
    v = np.linalg.qr(noise(rng, p, p))[0]
    return np.asarray(u * np.geomspace(1, 1 / kappa, p) @ v)


@pytest.mark.parametrize("kappa", [1e0, 1e2, 1e4, 1e6, 1e8, 1e10])
@pytest.mark.parametrize("shape", [(2, 2), (6, 3), (24, 8)])
def test_the_digits_that_the_condition_number_leaves(shape: tuple[int, int], kappa: float) -> None:
    rng = np.random.default_rng(int(np.log10(kappa)) + shape[0])
    alpha = graded(rng, *shape, kappa)
    w = noise(rng, shape[1])
    v = -alpha @ w  # a rotor that can be balanced: no κ² from a residual
    found = least_squares(alpha, v)
    want = exact_least_squares(alpha, v)
    assert np.linalg.norm(found.corrections - want) <= 20 * EPS * kappa * np.linalg.norm(want)
    assert found.condition_number == pytest.approx(kappa, rel=1.0)
    assert found.residual_max <= 1e-14 * np.abs(alpha).max() * np.abs(w).max() * shape[1]


def test_ten_thousand_rotors_at_once() -> None:
    """Recovered corrections to 1e-12 κ, from runs with masses put on, left on and taken off at random."""
    rng = np.random.default_rng(0)
    n, s, p = 10_000, 4, 3
    alpha, w = noise(rng, n, s, p), noise(rng, n, p)
    v0 = -np.matvec(alpha, w)
    on = noise(rng, n, p, p) * np.where(rng.random((n, p, p)) < 0.4, 0, 1)
    on = on + 3 * np.eye(p)
    runs = v0[:, None] + on @ np.swapaxes(alpha, -1, -2)
    found = influence_coefficients(v0, runs, on)
    kappa = condition_number(alpha) * np.linalg.cond(on)
    size = np.abs(w).max(axis=-1)
    error = np.abs(least_squares(found, v0).corrections - w).max(axis=-1)
    assert (error <= 1e-12 * kappa * size).all()
    one = least_squares(found[7], v0[7])
    assert (
        np.abs(one.corrections - least_squares(found, v0).corrections[7]).max() < 1e-12 * kappa[7] * size[7]
    )


def test_no_row_drowns_another() -> None:
    """Sensors of very different size: each row keeps its own digits."""
    rng = np.random.default_rng(3)
    scale = np.geomspace(1, 1e-9, 6)
    alpha = noise(rng, 6, 6)
    w = noise(rng, 6)
    want = exact_least_squares(alpha * scale[:, None], -(alpha @ w) * scale)
    found = least_squares(alpha * scale[:, None], -(alpha @ w) * scale).corrections
    assert np.abs(found - want).max() < 1e-13 * np.linalg.cond(alpha) * np.abs(w).max()


@pytest.mark.parametrize("power", [-12, -6, 6, 12])
def test_units_change_nothing(power: int) -> None:
    rng = np.random.default_rng(4)
    alpha, v = noise(rng, 7, 3), noise(rng, 7)
    unit = 2.0 ** (3 * power)
    here, there = least_squares(alpha, v), least_squares(alpha * unit, v)
    assert np.array_equal(there.corrections * unit, here.corrections)
    planes = np.array([1.0, unit, 1 / unit])
    # planes in different units: the order of the rows may change, and with it the last digit
    mixed = least_squares(alpha * planes, v).corrections * planes
    assert np.abs(mixed - here.corrections).max() <= 1e-14 * np.abs(here.corrections).max()
    assert condition_number(alpha * planes) == pytest.approx(float(condition_number(alpha)), rel=3)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 4),
    st.integers(0, 3),
    st.integers(0, 2**31),
    st.lists(st.floats(0, 6.3), min_size=1, max_size=1),
)
def test_turning_the_mark_turns_the_corrections(p: int, more: int, seed: int, turn: list[float]) -> None:
    rng = np.random.default_rng(seed)
    alpha, v = noise(rng, p + more, p), noise(rng, p + more)
    arm = np.exp(1j * turn[0])
    here = least_squares(alpha, v).corrections
    assert np.abs(least_squares(alpha, v * arm).corrections - here * arm).max() <= 1e-9 * max(
        np.abs(here).max(), 1
    )
    assert np.abs(least_squares(alpha * arm, v).corrections * arm - here).max() <= 1e-9 * max(
        np.abs(here).max(), 1
    )


def test_weights() -> None:
    """Σ w |r|²: a weight of zero leaves a sensor out, one of 4 counts it four times."""
    rng = np.random.default_rng(5)
    alpha, v = noise(rng, 5, 2), noise(rng, 5)
    out = least_squares(alpha, v, [1, 1, 0, 1, 1])
    assert (
        np.abs(out.corrections - least_squares(np.delete(alpha, 2, 0), np.delete(v, 2)).corrections).max()
        < 1e-14
    )
    often = [0, 0, 0, 0, 1, 2, 3, 4]
    four = least_squares(alpha, v, [4, 1, 1, 1, 1])
    assert np.abs(four.corrections - least_squares(alpha[often], v[often]).corrections).max() < 1e-14


def test_ridge_is_the_augmented_problem() -> None:
    rng = np.random.default_rng(6)
    alpha, v = noise(rng, 5, 3), noise(rng, 5)
    norms = np.linalg.norm(alpha, axis=0)
    stacked = np.concatenate([alpha, 0.3 * np.diag(norms)])
    want = exact_least_squares(stacked, np.concatenate([v, np.zeros(3)]))
    assert np.abs(least_squares(alpha, v, ridge=0.3).corrections - want).max() < 1e-14
    # two planes that are the same: damped, they share
    same = np.stack([alpha[:, 0], alpha[:, 0]], axis=1)
    w = least_squares(same, v, ridge=0.1).corrections
    assert abs(w[0] - w[1]) < 1e-13 * abs(w[0])


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_dependent_planes_are_named_not_solved(scale: float) -> None:
    rng = np.random.default_rng(7)
    alpha = noise(rng, 6, 3) * scale
    alpha[:, 2] = 2 * alpha[:, 0] - 1j * alpha[:, 1]  # no two alike, dependent all the same
    with pytest.raises(DependentPlanes, match="planes 0, 1, 2 apart") as caught:
        least_squares(alpha, noise(rng, 6))
    assert np.abs(alpha @ caught.value.combination).max() < 1e-13 * scale
    assert np.isinf(condition_number(alpha))
    assert (plane_significance(alpha) == 0).all()
    assert unseen(alpha)[1] < 1e-14
    batch = np.stack([noise(rng, 6, 3), alpha])
    with pytest.raises(DependentPlanes) as caught:
        least_squares(batch, noise(rng, 2, 6))
    assert caught.value.case == (1,)


def test_a_plane_without_effect_and_a_node() -> None:
    alpha = np.array([[1.0, 0], [2, 0], [1, 0]])
    with pytest.raises(DependentPlanes, match="do not show plane 1 at all"):
        least_squares(alpha, [1, 1, 1])
    with pytest.raises(DependentPlanes, match="2 planes need at least as many readings"):
        least_squares([[1, 2]], [1])
    # a sensor at a node does no harm
    node = np.array([[1.0, 2], [0, 0], [3, 1]])
    assert (
        np.abs(
            least_squares(node, [1, 5, 2]).corrections - least_squares(node[[0, 2]], [1, 2]).corrections
        ).max()
        < 1e-15
    )
    assert minimax(node, [1, 5, 2]).residual_max == 5


def test_significance_is_a_sine() -> None:
    angle = 0.01
    alpha = np.array([[1, np.cos(angle)], [0, np.sin(angle)]])
    assert plane_significance(alpha) == pytest.approx([np.sin(angle)] * 2, rel=1e-12)
    assert plane_significance(np.eye(4, 3)) == pytest.approx([1, 1, 1])


def test_trials_that_do_not_tell() -> None:
    v0, run = np.ones(2), np.ones((2, 2)) + 1j
    with pytest.raises(DependentTrials, match="do not show plane 1"):
        influence_coefficients(v0, run, [[1, 0], [2, 0]])
    with pytest.raises(DependentTrials, match="planes 0, 1 apart"):
        influence_coefficients(v0, run, [[1, 1], [2, 2]])
    with pytest.raises(DependentTrials, match="2 planes need at least as many trial runs, found 1"):
        influence_coefficients(v0, run[:1], [[1, 1]])
    with pytest.raises(ValueError, match="finite"):
        influence_coefficients(v0, run, [[1, np.nan], [0, 1]])
    with pytest.raises(ValueError, match="shapes do not fit"):
        influence_coefficients(v0, np.ones((2, 3)), np.eye(2))


def test_more_runs_than_planes_are_fitted() -> None:
    rng = np.random.default_rng(8)
    alpha = noise(rng, 3, 2)
    on = noise(rng, 5, 2)
    v0 = noise(rng, 3)
    assert np.abs(influence_coefficients(v0, v0 + on @ alpha.T, on) - alpha).max() < 1e-14


def test_no_vibration_no_correction() -> None:
    fix = least_squares([[1, 2j], [3, 1]], [0, 0])
    assert (fix.corrections == 0).all()
    assert fix.residual_rms == 0


def test_limits() -> None:
    """The optimum under limits, by its own conditions (Karush, Kuhn, Tucker)."""
    rng = np.random.default_rng(9)
    for _ in range(20):
        alpha, v = noise(rng, 6, 3), noise(rng, 6)
        cap = 0.7 * np.abs(least_squares(alpha, v).corrections)
        cap[2] = np.inf
        fix = least_squares(alpha, v, max_mass=cap)
        w = fix.corrections
        assert (np.abs(w) <= cap).all()
        pull = alpha.conj().T @ fix.residual
        for p in range(3):
            if abs(w[p]) < cap[p] * (1 - 1e-9):
                assert abs(pull[p]) < 1e-11
            else:  # the pull points outwards, straight against the limit
                ratio = -pull[p] / w[p]
                assert ratio.real >= -1e-11
                assert abs(ratio.imag) < 1e-10 * max(abs(ratio), 1)


def test_a_residual_limit() -> None:
    rng = np.random.default_rng(10)
    alpha, v = noise(rng, 8, 3), noise(rng, 8)
    least = float(minimax(alpha, v).residual_max)
    free = least_squares(alpha, v)
    middle = (least + float(free.residual_max)) / 2
    held = least_squares(alpha, v, max_residual=middle)
    assert held.residual_max <= middle * (1 + 1e-14)
    assert free.residual_rms < held.residual_rms < minimax(alpha, v).residual_rms * (1 + 1e-12)
    with pytest.raises(Infeasible) as caught:
        least_squares(alpha, v, max_residual=0.999 * least)
    assert caught.value.smallest == pytest.approx(least, rel=1e-9)
    almost = least_squares(alpha, v, max_residual=least * (1 + 1e-8))
    assert almost.residual_max <= least * (1 + 1e-8)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        least_squares([[1.0]], [bad])
    with pytest.raises(ValueError, match="weights"):
        least_squares([[1.0]], [1], [bad])
    with pytest.raises(ValueError, match="max_mass must be positive"):
        least_squares([[1.0]], [1], max_mass=0)
    with pytest.raises(ValueError, match="ridge"):
        least_squares([[1.0]], [1], ridge=bad)


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e200, 1e300])
def test_beyond_the_range_of_squares(size: float) -> None:
    alpha = np.array([[2, 1j], [1, 3]])
    w = np.array([1 + 1j, 2])
    columns = np.array([1.0, size])
    found = least_squares(alpha * columns, -(alpha @ w)).corrections * columns
    assert np.abs(found - w).max() < 1e-14
    with pytest.raises(DependentPlanes):
        least_squares(np.array([[1, 0], [1, 0]]) * size, [size, size])


def test_numbers_whose_squares_overflow() -> None:
    """Least squares without limits has no squares; minimax and limits have, and refuse; so has the second run."""
    alpha, v = np.array([[3, -2], [5, -2], [5, -3]]), np.array([1, -1, 0])
    for large in ((alpha, v * 1e160), (alpha * 1e-160, v), (alpha * 1e160, v * 1e160)):
        with pytest.raises(ValueError, match="choose other units"):
            minimax(*large)
        with pytest.raises(ValueError, match="choose other units"):
            least_squares(*large, max_mass=1.0)
        free = least_squares(*large)
        assert np.isfinite(free.corrections).all()
        assert np.isinf(free.error_estimate()).all()
        assert "too large or too small" in free.error_reason
    # the corrections themselves are too large
    with pytest.raises(ValueError, match="choose other units"):
        least_squares(alpha * 1e-200, v * 1e200)


def test_no_rotor_at_all() -> None:
    """An empty batch is answered by an empty one."""
    influence, initial = np.zeros((0, 3, 2)), np.zeros((0, 3))
    assert least_squares(influence, initial).corrections.shape == (0, 2)
    assert condition_number(influence).shape == (0,)
