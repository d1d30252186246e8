"""The once-per-turn vector of a recorded vibration."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import once_per_turn


def test_other_orders_and_an_offset_do_not_leak_into_the_first() -> None:
    t = np.arange(4000) / 4000
    angle = 2 * np.pi * 40 * t
    x = 5 + 3 * np.cos(angle + 0.7) + 2 * np.cos(2 * angle - 1) + np.sin(3 * angle)
    found = once_per_turn(t, x[:, None], np.arange(4000) % 100 == 0)
    assert abs(found.vector[0] - 3 * np.exp(0.7j)) < 1e-11
    assert found.speed == pytest.approx(80 * np.pi, rel=1e-12)
    assert found.turns == 39
    assert found.deviation[0] < 1e-11


def test_a_mark_between_the_samples_is_found() -> None:
    t = np.arange(20_000) / 10_000
    angle = 2 * np.pi * 37.77 * (t - 0.00123)
    pulse = (angle % (2 * np.pi)) < 0.3
    smooth = np.exp(20 * (np.cos(angle) - 1))
    for mark, shift in ((pulse, 0.0), (smooth, np.arccos(1 + np.log(0.5) / 20))):
        found = once_per_turn(t, 2 * np.cos(angle + 1.1)[:, None], mark)
        # the smooth mark passes half its height before its top
        assert np.angle(found.vector[0]) == pytest.approx(1.1 - shift, abs=1e-3)
        assert abs(found.vector[0]) == pytest.approx(2, rel=1e-3)
        assert found.speed == pytest.approx(2 * np.pi * 37.77, rel=1e-5)


def test_the_uncertainty_of_the_mean_is_that_of_many_recordings() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(2000) / 2000
    x = 3 * np.cos(2 * np.pi * 20 * t)[:, None] + rng.normal(size=(2000, 300))
    found = once_per_turn(t, x, np.arange(2000) % 100 == 0)
    off = found.vector - 3
    assert np.sqrt(np.square(off.real).mean()) == pytest.approx(
        np.sqrt(np.square(found.deviation).mean()), rel=0.15
    )


@pytest.mark.parametrize(
    ("t", "mark", "says"),
    [
        ([0, 1, 1, 2], [0, 1, 0, 1], "rise from row to row"),
        ([0, 1, 2, 3], [0, 1, 1, 0], "rises 1 times"),
        ([0, 1, 2, 3], [0, 1, 0, 1], "four at least"),
    ],
)
def test_what_is_no_recording(t: list[float], mark: list[float], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        once_per_turn(t, np.ones((4, 1)), mark)
