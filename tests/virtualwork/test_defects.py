"""Estimates of the errors of the steps: with the sign of the error, and nearly its size."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp, mpf

from benchmarks.stress.in_time import _falling_four_bar, _oscillator, _pendulum
from tests.virtualwork.released import pendulum
from tests.virtualwork.test_errors_in_time import held, swung
from virtualwork.intime.defect import step_errors


def off(t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The errors of steps of q̈ = −q at their ends."""
    slopes = np.broadcast_to(np.array([[-1.0, 0.0]])[..., None], (1, 2, len(t)))
    return step_errors(lambda t, q, v: -q, slopes, t, q[None], v[None], -q[None])[1]


@pytest.mark.parametrize("side", [1.0, -1.0, 0.0])
@pytest.mark.parametrize("steps", [1, 5])
def test_exact_states_have_no_error(steps: int, side: float) -> None:
    t = np.linspace(0.0, 0.4 * steps, 2 * steps + 1)
    assert np.abs(off(t, side * np.sin(t), side * np.cos(t))).max() < 1e-15


@pytest.mark.parametrize("by", [1e-9, -1e-9])
def test_what_one_state_is_off_by_is_an_error_of_the_step_before_and_of_that_after(by: float) -> None:
    """As a rotation by the angle of the step leaves it."""
    t = np.linspace(0.0, 1.5, 7)
    there = np.arange(7) == 2
    found = off(t, np.sin(t) + by * there, np.cos(t))
    after = [by * np.cos(0.5), -by * np.sin(0.5)]
    assert np.abs(found - np.transpose([[-by, 0.0], after, [0.0, 0.0]])).max() < 1e-3 * abs(by)


def test_without_steps_and_without_length() -> None:
    none = np.zeros(1)
    assert off(none, none, none).shape == (2, 0)
    assert not off(np.zeros(3), np.ones(3), np.ones(3)).any()


@pytest.mark.parametrize("trial", [_pendulum, _oscillator, _falling_four_bar])
def test_estimates_are_near_the_error_and_not_below(trial: object) -> None:
    """Where rounding does not rule, any motion at any accuracy: in the median at most four times the error."""
    seeds = range(4 if trial is _falling_four_bar else 25)
    pairs = [pair for seed in seeds for pair in trial(np.random.default_rng(seed))]  # type: ignore[operator]
    error, estimate = np.array(pairs).T
    assert (error <= estimate).all()
    rules = error > 1e-13
    assert rules.sum() > 5
    assert np.median((estimate / np.maximum(error, 1e-300))[rules]) < 4


@pytest.mark.parametrize("angle", [0.0, -np.pi, -np.pi / 2])
def test_many_together_as_one_by_one(angle: float) -> None:
    """To both sides, and hanging still, where there is no error at all."""
    t = np.linspace(0.0, 3.0, 4)
    runs = pendulum().vary({"links.bob.mass": [1.0, 2.0]}).simulate(t, angle=angle, accuracy=1e-5)
    one = pendulum().simulate(t, angle=angle, accuracy=1e-5)
    with mp.workdps(30):
        error = [
            float(abs(swung(angle, 0.0, x) - mpf(q))) for x, q in zip(t, runs.angle[0, :, 0], strict=True)
        ]
    for estimate in (*runs.error_estimate[..., 0], one.error_estimate[:, 0]):
        assert (np.array(error)[1:] <= estimate[1:]).all()
        # hanging still it is what rounding in two long steps may come to, far below the accuracy
        assert estimate[-1] <= 5 * max(error) + 1e-6 * 1e-5


def test_beside_a_fold() -> None:
    """A six-bar through dead points: its speeds change fast within a step."""
    assert 0 < held(197839880046) <= 1
