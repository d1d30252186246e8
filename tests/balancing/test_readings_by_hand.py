"""Errors of readings where the answer is a line of algebra: given coefficients, run-out, one sensor and one plane."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import spread
from tests.balancing.measured import balance, fitted


def test_without_errors_every_draw_is_the_answer_and_run_out_is_taken_off() -> None:
    alpha = np.array([[2.0, 0.0], [0.0, 4.0j]])
    readings = balance(
        fitted([3.0 + 1j, 9.0], influence=alpha), (0.0, 0.0), runout=np.array([1.0 + 1j, 1.0 + 0j])
    )
    drawn = readings.correction_samples(n=3)
    assert drawn == pytest.approx(np.array([[-1.0, 2.0j]] * 3), rel=1e-15)
    problems = list(readings.problem_samples(n=2))
    assert len(problems) == 2
    for found, vibration in problems:
        assert np.array_equal(found, alpha)
        assert np.array_equal(vibration, [2.0, 8.0])
    # with a trial run of 0.5 kg that moved the first sensor to 4 + 1j
    tried = balance(fitted([3.0 + 1j], [[4.0 + 1j]], [[0.5]]), (0.0, 0.0), runout=np.array([1.0 + 1j]))
    assert tried.fit.influence == pytest.approx(np.array([[2.0]]), rel=1e-15)
    assert tried.correction_samples(n=2) == pytest.approx(np.array([[-1.0]] * 2), rel=1e-15)
    ((found, vibration),) = tried.problem_samples(n=1)
    assert (found[0, 0], vibration[0]) == (2.0, 2.0)


@pytest.mark.parametrize(("amplitude", "phase"), [(0.03, 0.0), (0.0, 0.02)])
def test_one_sensor_and_one_plane_with_a_given_coefficient(amplitude: float, phase: float) -> None:
    """w = −V/α: a relative error of V is one of w, and an angle's is its angle's."""
    v, alpha = 5.0 * np.exp(0.7j), 2.0 * np.exp(-1.1j)
    readings = balance(fitted([v], influence=[[alpha]]), (amplitude, phase))
    w = np.array([-v / alpha])
    assert readings.corrections == pytest.approx(w, rel=1e-15)
    cov = readings.covariance[0]
    assert cov == pytest.approx(np.diag([amplitude**2, phase**2]) * 2.5**2, rel=1e-13, abs=1e-16)
    drawn = spread(readings.correction_samples(n=4000), w)[0]
    assert np.diag(drawn) == pytest.approx(np.diag(cov), rel=0.1, abs=1e-5)


def test_a_trial_run_on_one_sensor() -> None:
    """w = −t V₀/(V₁ − V₀): dw/w = dV₀/V₀ − (dV₁ − dV₀)/(V₁ − V₀), so with V₁ = 3 V₀ it is 3/2 ε₀ − 3/2 ε₁."""
    v = 2.0 * np.exp(0.4j)
    readings = balance(fitted([v], [[3 * v]], [[0.25]]), (0.01, 0.02), [-0.125])
    size = 0.125 * 1.5 * np.sqrt(2)
    expected = np.diag([(0.01 * size) ** 2, (0.02 * size) ** 2])
    assert readings.covariance[0] == pytest.approx(expected, rel=1e-12, abs=1e-18)
    # at a fixed correction: r = V₀ + α w = 0 as read; its error is 3/2 V₀ (ε₀ − ε₁)
    left = readings.residual_samples(n=4000)
    assert np.abs(left.mean()) < 0.01 * 3
    assert np.sqrt(np.mean(left.real**2 + left.imag**2)) == pytest.approx(
        3 * np.sqrt(2) * np.hypot(0.01, 0.02), rel=0.05
    )


def test_the_covariance_across_a_zero_correction_is_in_space_axes() -> None:
    """A correction of zero has no direction: radial errors of V stand along −1/α V on the real and imaginary axes."""
    alpha = np.array([[1.0, 0.0], [0.0, 2.0]])
    found = balance(fitted([0.0, 4.0j], influence=alpha), (0.1, 0.0), [0.0, -2.0j]).covariance
    assert found[0] == pytest.approx(np.zeros((2, 2)), abs=1e-30)
    assert found[1] == pytest.approx(np.diag([0.04, 0.0]), rel=1e-13, abs=1e-18)
    moved = balance(fitted([2.0j, 4.0j], influence=alpha), (0.1, 0.0), [0.0, 0.0]).covariance
    assert moved[0] == pytest.approx(np.diag([0.0, 0.04]), rel=1e-13, abs=1e-18)


def test_the_spread_of_four_draws() -> None:
    """A tenth along and a fifth across 0.5i, to either side: variances of (0.05² + 0.05²)/4 and (0.1² + 0.1²)/4."""
    about = np.array([0.5j])
    drawn = about * np.array([[1.1], [0.9], [1 + 0.2j], [1 - 0.2j]])
    assert spread(drawn, about)[0] == pytest.approx(np.diag([0.05**2 / 2, 0.1**2 / 2]), abs=1e-16)
    # about no correction at all the axes are those of space
    assert spread(np.array([[0.3], [-0.3], [0.2j], [-0.2j]]), np.zeros(1, dtype=complex))[0] == pytest.approx(
        np.diag([0.045, 0.02]), abs=1e-16
    )
