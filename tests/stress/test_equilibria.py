"""Equilibria against the sign changes of the potential's slope on a fine grid (benchmarks.stress.equilibria)."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.stress.equilibria import faults, scene

# each has an equilibrium less than a quarter of a degree from a dead point
NEAR_A_DEAD_POINT = (34, 36, 37, 45, 59, 538)
# some half a minute
MORE = 600


@pytest.mark.parametrize("seed", NEAR_A_DEAD_POINT)
def test_an_equilibrium_close_to_a_dead_point(seed: int) -> None:
    mechanism, potential = scene(np.random.default_rng(seed))
    assert faults(mechanism, potential) == []
    dead = np.array(mechanism.check.dead_points)
    found = np.array([e.inputs[0] for e in mechanism.equilibria().found])
    apart = np.abs(np.angle(np.exp(1j * (found[:, None] - dead))))
    assert apart.min() < 2 * np.pi / 1440


def _none_wrong(seeds: range) -> None:
    for seed in seeds:
        assert faults(*scene(np.random.default_rng(seed))) == [], f"seed {seed}"


@pytest.mark.slow
def test_equilibria_of_four_bars_and_slider_cranks() -> None:
    _none_wrong(range(60))


@pytest.mark.slow
def test_equilibria_of_many_more(first_seed: int) -> None:
    _none_wrong(range(first_seed, first_seed + MORE))
