"""The four-run method and its relatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from balancing import influence_from_amplitudes


@settings(max_examples=80, deadline=None)
@given(
    st.floats(0.02, 20),
    st.floats(0, 2 * np.pi),
    st.floats(0, 2 * np.pi),
    st.floats(0.5, 2.5),
    st.floats(1e-9, 1e9),
)
def test_exact_readings_give_the_exact_answer(
    size: float, phase: float, start: float, apart: float, unit: float
) -> None:
    """Three trials at least 0.5 rad apart, at any angles: consistent readings have one answer."""
    alpha = size * np.exp(1j * phase)
    masses = unit * np.exp(1j * (start + apart * np.array([0, 1, 2.1])))
    reading = np.abs(1 + alpha * masses / unit)
    fit = influence_from_amplitudes([1.0], reading[:, None], masses)
    assert abs(fit.influence[0] * unit - alpha) < 1e-7 * size
    assert fit.misfit[0] < 1e-9 * (1 + size)


def test_the_least_squares_point_is_stationary() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        masses = np.exp(2j * np.pi * np.arange(3) / 3)
        alpha = rng.normal() + 1j * rng.normal()
        reading = np.abs(1 + alpha * masses) * (1 + 0.02 * rng.normal(size=3))
        fit = influence_from_amplitudes([1.0], reading[:, None], masses)

        def cost(z: complex, masses=masses, reading=reading) -> float:  # type: ignore[no-untyped-def]
            return float(np.sqrt(np.mean((np.abs(1 + z * masses) - reading) ** 2)))

        z = complex(fit.influence[0])
        assert cost(z) == pytest.approx(fit.misfit[0], rel=1e-9)
        assert all(cost(z + 1e-4 * np.exp(1j * a)) > cost(z) for a in range(6))


def test_two_trials_leave_two_answers() -> None:
    masses = np.array([1, np.exp(2j)])
    alpha = 0.8 * np.exp(1j)
    fit = influence_from_amplitudes([1.0], np.abs(1 + alpha * masses)[:, None], masses)
    both = np.array([fit.influence[0], fit.other[0]])
    assert np.abs(both - alpha).min() < 1e-12
    for z in both:
        assert np.abs(np.abs(1 + z * masses) - np.abs(1 + alpha * masses)).max() < 1e-12
    # trials on one line leave the mirror image, however many they are
    line = np.array([1, -1, 0.5])
    fit = influence_from_amplitudes([1.0], np.abs(1 + alpha * line)[:, None], line)
    assert sorted(np.array([fit.influence[0], fit.other[0]]).imag) == pytest.approx(
        [-alpha.imag, alpha.imag], rel=1e-9
    )


def test_several_sensors_at_once() -> None:
    masses = 3 * np.exp(2j * np.pi * np.arange(4) / 4)
    alpha = np.array([0.5 + 1j, -2 + 0.1j])
    initial = np.array([4.0, 7.0])
    fit = influence_from_amplitudes(initial, np.abs(initial + alpha * masses[:, None]), masses)
    assert np.abs(fit.influence - alpha).max() < 1e-12


def test_what_cannot_be_done() -> None:
    thirds = np.exp(2j * np.pi * np.arange(3) / 3)
    with pytest.raises(ValueError, match="at least two trial runs"):
        influence_from_amplitudes([1], [[1]], [1])
    with pytest.raises(ValueError, match="positive in the initial run"):
        influence_from_amplitudes([0], [[1], [1], [1]], thirds)
    with pytest.raises(ValueError, match="without trial mass"):
        influence_from_amplitudes([1], [[1], [1], [1]], [1, 0, 1j])
    with pytest.raises(ValueError, match="all alike"):
        influence_from_amplitudes([1], [[1], [1], [1]], [1, 1, 1])
    with pytest.raises(ValueError, match="shapes do not fit"):
        influence_from_amplitudes([1, 2], [[1], [1], [1]], thirds)
