"""Placement, against linear programs, bounded least squares and every choice there is."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, lsq_linear

from balancing import drill_depth, place, place_from_stock, transfer


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(st.integers(1, 9), st.integers(0, 2**31), st.booleans())
def test_least_mass_or_least_error(n: int, seed: int, limited: bool) -> None:
    rng = np.random.default_rng(seed)
    theta = rng.permutation(np.sort(rng.uniform(0, 2 * np.pi, n)))
    cap = rng.uniform(0.2, 3, n) if limited else np.full(n, np.inf)
    target = complex(3 * (rng.normal() + 1j * rng.normal()))
    found = place(target, theta, cap)
    assert (found.masses >= 0).all()
    assert (found.masses <= cap).all()
    rows, goal = np.array([np.cos(theta), np.sin(theta)]), [target.real, target.imag]
    exact = linprog(np.ones(n), A_eq=rows, b_eq=goal, bounds=[(0, None if c == np.inf else c) for c in cap])
    if exact.status == 0:
        assert abs(found.error) < 1e-11 * abs(target)
        assert found.masses.sum() == pytest.approx(exact.fun, rel=1e-6)
        assert found.bound == 0
    else:
        nearest = lsq_linear(rows, goal, bounds=(0, cap), method="bvls")
        assert abs(found.error) <= np.sqrt(2 * nearest.cost) + 1e-9 * abs(target)
        assert found.bound == pytest.approx(abs(found.error), rel=1e-12)


def test_corners() -> None:
    square = np.radians([0, 90, 180, 270])
    assert place(5, square).masses == pytest.approx([5, 0, 0, 0], abs=1e-15)
    assert place(0, square).masses.sum() == 0
    assert place(-3, [0.0]).masses.sum() == 0
    assert place(4 + 4j, square, 3).masses == pytest.approx([3, 3, 0, 0])
    assert abs(place(4 + 4j, square, 3).error) == pytest.approx(np.sqrt(2))
    opposite = place(2j, [0, np.pi])
    assert abs(opposite.error) == pytest.approx(2)
    with pytest.raises(ValueError, match="same angle"):
        place(1, [0.1, 0.1 + 2 * np.pi])
    with pytest.raises(ValueError, match="finite"):
        place(complex(np.nan), [0.0])


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 6), st.integers(0, 2**31), st.integers(1, 6))
def test_of_every_choice_the_nearest_and_then_the_lightest(n: int, seed: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    theta = np.sort(rng.uniform(0, 2 * np.pi, n))
    target = complex(4 * (rng.normal() + 1j * rng.normal()))
    stock = [1.0, 2.0, 5.0]
    every = np.array(list(itertools.product([0, *stock], repeat=n)))
    for limit in (None, most):
        allowed = every if limit is None else every[(every > 0).sum(axis=1) <= limit]
        miss = np.abs(allowed @ np.exp(1j * theta) - target)
        found = place_from_stock(target, theta, stock, max_pieces=limit)
        assert set(found.masses) <= {0, *stock}
        assert abs(found.error) == pytest.approx(miss.min(), abs=1e-11)
        assert found.masses.sum() <= allowed.sum(axis=1)[miss <= miss.min() + 1e-13].min() + 1e-12
        assert found.bound == pytest.approx(miss.min(), abs=1e-11)


@pytest.mark.slow
def test_several_pieces_on_a_place_and_its_limit() -> None:
    square = np.radians([0, 90, 180, 270])
    assert place_from_stock(7, square, [1, 2, 5], pieces=2).masses.tolist() == [7, 0, 0, 0]
    held = place_from_stock(7, square, [1, 2, 5], max_mass=4, pieces=2)
    assert (held.masses <= 4).all()
    assert abs(held.error) == pytest.approx(3)
    assert place_from_stock(0.3, square, [0.1], pieces=3).masses[0] == pytest.approx(0.3)
    many = place_from_stock(10 + 7j, np.radians(np.arange(0, 360, 5)), [1, 2, 5])
    assert many.bound == 0  # too many to search them all: no proof, but near
    assert abs(many.error) < 0.01
    with pytest.raises(ValueError, match="positive"):
        place_from_stock(1, square, [0.0])
    with pytest.raises(ValueError, match="at least one piece"):
        place_from_stock(1, square, [1.0], pieces=0)


def test_the_blades_of_the_example() -> None:
    """Every choice of at most four weights of 10, 20, 50 g on 16 blades."""
    arms = np.exp(2j * np.pi * np.arange(16) / 16)
    target = 83.5 * np.exp(1j * np.radians(308.87))
    found = place_from_stock(complex(target), np.angle(arms), [10, 20, 50], max_pieces=4)
    best = np.inf
    for count in range(5):
        for spots in itertools.combinations(range(16), count):
            grid = np.zeros(1, dtype=complex)
            for spot in spots:
                grid = (grid[:, None] + np.array([10, 20, 50]) * arms[spot]).ravel()
            best = min(best, float(np.abs(grid - target).min()))
    assert abs(found.error) == pytest.approx(best, rel=1e-9)


def test_drilling() -> None:
    assert float(drill_depth(0.01, 0.01, 7850)) == pytest.approx(0.01 / 7850 / (np.pi * 0.005**2))
    point = np.radians(118)
    depth = float(drill_depth(0.01, 0.01, 7850, point))
    tip = 0.005 / np.tan(point / 2)
    assert np.pi * 0.005**2 * (depth - tip + tip / 3) * 7850 == pytest.approx(0.01, rel=1e-12)
    shallow = float(drill_depth(1e-5, 0.01, 7850, point))
    assert shallow < tip
    assert np.pi / 3 * (shallow * np.tan(point / 2)) ** 2 * shallow * 7850 == pytest.approx(1e-5, rel=1e-12)
    with pytest.raises(ValueError, match="positive"):
        drill_depth(1, 0, 7850)


def test_transfer_keeps_force_and_moment() -> None:
    rng = np.random.default_rng(0)
    u, z = rng.normal(size=4) + 1j * rng.normal(size=4), rng.normal(size=4)
    planes = np.array([-1.0, 0.5, 2.0])
    for p in (planes[:2], planes):
        there = transfer(u, z, p)
        assert there.sum() == pytest.approx(u.sum())
        assert there @ p == pytest.approx(u @ z)


def test_weights_from_stock_on_a_thousand_places() -> None:
    """It took minutes: each of 300 000 sums carried a cell for every place. The nearest places to 308.87° are 308.88° and 308.52°."""
    places = np.radians(np.arange(1000) * 0.36)
    choice = place_from_stock(0.0835 * np.exp(1j * np.radians(308.87)), places, [0.001, 0.002], max_pieces=2)
    assert np.flatnonzero(choice.masses).tolist() == [857, 858]
    assert choice.masses[857:859].tolist() == [0.002, 0.002]
