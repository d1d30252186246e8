"""Weights of fixed mass, turned until they are a correction: closed forms, the reach, and random sets of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from balancing import place_from_stock, place_weights


def degrees(target: complex, *weights: float) -> list[float]:
    return sorted(((np.degrees(place_weights(target, weights).angles) + 180) % 360 - 180).round(9).tolist())


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("turn", [0.0, 1.0, -3.0])
def test_two_equal_weights_spread_about_the_correction(scale: float, turn: float) -> None:
    for size in (1e-9, 0.5, 1.0, 1.5, 1.9999999, 2.0):
        found = place_weights(scale * size * np.exp(1j * turn), [scale, scale])
        half = np.arccos(size / 2)
        # near its largest size the angle is the root of what is rounded
        assert found.angles == pytest.approx([turn - half, turn + half], abs=1e-7 if size > 1.9 else 2e-15)
        assert abs(found.error) < 2e-15 * scale
        assert found.bound == 0


def test_two_unequal_weights_are_the_sides_of_a_triangle() -> None:
    a, b, c = 5.0, 3.0, 4.0
    found = place_weights(c, [a, b])
    # law of cosines
    one, other = (
        np.arccos((a * a + c * c - b * b) / (2 * a * c)),
        np.arccos((b * b + c * c - a * a) / (2 * b * c)),
    )
    assert np.abs(found.angles) == pytest.approx([one, other], abs=1e-14)
    assert found.angles[0] < 0 < found.angles[1]


@pytest.mark.parametrize("size", [0.0, 0.3, 1.0, 2.0, 2.9, 3.0])
def test_three_equal_weights_one_on_it_two_symmetric(size: float) -> None:
    found = place_weights(size, [1.0, 1.0, 1.0])
    aside = np.arccos((size - 1) / 2)
    assert found.angles == pytest.approx([-aside, 0, aside], abs=1e-7 if size > 2.8 else 1e-14)
    assert abs(found.error) < 1e-15


def test_out_of_reach_the_error_is_the_least() -> None:
    over = place_weights(9j, [4.0, 4.0])
    assert degrees(9j, 4.0, 4.0) == [90, 90]
    assert (over.bound, abs(over.error)) == pytest.approx((1, 1))
    under = place_weights(1.0, [4.0, 2.0])
    assert degrees(1.0, 4.0, 2.0) == [-180, 0]
    assert (under.bound, under.total.real) == pytest.approx((1, 2))
    assert place_weights(0, [2.0]).bound == 2
    assert place_weights(0, [2.0, 2.0]).total == pytest.approx(0, abs=1e-15)


def test_wrong_weights() -> None:
    for weights in ([], [0.0], [-1.0, 2.0], [np.inf], [[1.0]]):
        with pytest.raises(ValueError, match="weights, positive"):
            place_weights(1.0, weights)
    with pytest.raises(ValueError, match="finite"):
        place_weights(np.nan, [1.0])


@pytest.mark.slow
def test_random_weights_reach_what_can_be_reached() -> None:
    seed = int(np.random.default_rng().integers(2**32))
    rng = np.random.default_rng(seed)
    for _ in range(20_000):
        n = int(rng.integers(1, 8))
        weights = rng.uniform(0.01, 1, n) * 10 ** rng.uniform(-9, 9)
        least, most = max(0.0, 2 * weights.max() - weights.sum()), weights.sum()
        edges = [0.0, least, most, least * (1 - 1e-12), most * (1 + 1e-12), 2 * most]
        size = float(rng.choice([*edges, least + (most - least) * rng.random()]))
        found = place_weights(size * np.exp(1j * rng.uniform(-9, 9)), weights)
        best = max(least - size, size - most, 0.0)
        assert abs(abs(found.error) - best) < 1e-14 * most, seed
        assert abs(found.bound - best) < 1e-14 * most, seed


@pytest.mark.parametrize(("places", "pieces"), [(36, 2), (24, 3)])
def test_few_weights_on_many_places_are_all_compared(places: int, pieces: int) -> None:
    """More places than can be searched with any number of weights: all choices of a few were not compared before."""
    rng = np.random.default_rng(3)
    angles, stock = 2 * np.pi * np.arange(places) / places, np.array([1.0, 2.0, 5.0])
    for _ in range(3):
        goal = complex(rng.uniform(0, 12) * np.exp(1j * rng.uniform(0, 7)))
        found = place_from_stock(goal, angles, stock, max_pieces=pieces)
        best = abs(goal)
        for count in range(1, pieces + 1):
            at = np.array(list(itertools.combinations(range(places), count)))
            for weights in itertools.product(stock, repeat=count):
                best = min(best, float(np.abs((np.exp(1j * angles[at]) * weights).sum(axis=1) - goal).min()))
        assert abs(found.error) == pytest.approx(best, rel=1e-9, abs=1e-12)
        assert found.bound == pytest.approx(best, rel=1e-9, abs=1e-12)
