"""Trial masses, index balancing, the error budget."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import error_budget, index_balancing, trial_effect, trial_unbalance


def test_the_trial_force_is_a_tenth_of_the_load() -> None:
    unbalance = float(trial_unbalance(120.0, 157.0, planes=2))
    assert unbalance * 157.0**2 == pytest.approx(0.1 * 60 * 9.80665)
    with pytest.raises(ValueError, match="positive"):
        trial_unbalance(0, 157)


def test_thirty_thirty_across_the_wrap() -> None:
    effect = trial_effect(2 * np.exp(1j * np.radians(359)), 2 * np.exp(1j * np.radians(1)))
    assert effect.amplitude == pytest.approx(0, abs=1e-15)
    assert np.degrees(effect.phase) == pytest.approx(2)
    assert trial_effect(0, 1).amplitude == np.inf
    assert trial_effect(0, 0).amplitude == 0


def test_index_balancing_separates() -> None:
    rng = np.random.default_rng(0)
    rotor, mounting = rng.normal(size=5) + 1j, rng.normal(size=5) - 2j
    for turned in (np.array([0, np.pi]), np.radians([0, 90, 200, 310]), np.radians([30, 140])):
        both = index_balancing(mounting[:, None] + rotor[:, None] * np.exp(1j * turned), turned)
        assert np.abs(both.rotor - rotor).max() < 1e-14
        assert np.abs(both.mounting - mounting).max() < 1e-14
    with pytest.raises(ValueError, match="not turned"):
        index_balancing([1, 2], [0.0, 2 * np.pi])
    with pytest.raises(ValueError, match="two at least"):
        index_balancing([1], [0.0])


def test_error_budget() -> None:
    budget = error_budget(np.array([100.0, 5.0]), random=[3, 4], systematic=[-2])
    assert budget.error == pytest.approx(7)
    assert budget.accept.tolist() == [93, 0]
    assert budget.reject.tolist() == [107, 12]
    assert error_budget(10).accept == 10
    with pytest.raises(ValueError, match="positive"):
        error_budget(0)
