"""The once-per-turn vector of a recorded vibration."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import once_per_turn
from balancing.marks import marks


def test_other_orders_and_an_offset_do_not_leak_into_the_first() -> None:
    # the mark rises half a sample before its first high one
    t = (np.arange(4000) + 0.5) / 4000
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


@pytest.mark.parametrize("cycles", [20.0, 24.7, 31.4159])
def test_the_edge_lies_in_the_middle_between_two_samples(cycles: float) -> None:
    """The first high sample is half a sample late on average: 2.2 degrees at 2048 Hz and 24.7 Hz."""
    rng = np.random.default_rng(2)
    t = np.arange(4096) / 2048
    half = np.degrees(2 * np.pi * cycles / 2048 / 2)
    off, told = [], []
    for _ in range(60):
        angle = 2 * np.pi * cycles * t - rng.uniform(0, 2 * np.pi)
        found = once_per_turn(t, 3 * np.cos(angle + 1)[:, None], angle % (2 * np.pi) < 0.4)
        off.append(float(np.degrees(np.angle(found.vector[0] * np.exp(-1j)))))
        told.append(float(np.degrees(found.phase_resolution)))
    # the samples of 2048 Hz meet 20 Hz at few angles of the turn, 24.7 Hz at many
    assert max(told) <= 1.001 * half
    assert np.abs(off).max() <= max(told) + 0.15 * half
    assert abs(np.mean(off)) < 0.25 * half / np.sqrt(3)
    assert min(told) > 0
    assert cycles == 20.0 or max(told) < 0.1 * half


def test_a_mark_between_two_levels_is_known_finer() -> None:
    t = np.arange(20_000) / 10_000
    angle = 2 * np.pi * 37.77 * t + 0.3
    found = once_per_turn(t, np.cos(angle)[:, None], np.sin(angle))
    assert np.degrees(found.phase_resolution) < 1e-3


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
        ([0, 1, 2, 3], [0, 1, 1, 0], "rises 1 time:"),
        ([0, 1, 2, 3], [0, 1, 0, 1], "four at least"),
    ],
)
def test_what_is_no_recording(t: list[float], mark: list[float], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        once_per_turn(t, np.ones((4, 1)), mark)


@pytest.mark.slow
def test_several_pulses_in_a_turn_tell_a_speed_that_varies_within_it() -> None:
    t = np.arange(40_000) / 20_000
    angle = 2 * np.pi * 11.3 * t + 0.4 * np.sin(2 * np.pi * 11.3 * t) + 0.5
    x = 3 * np.cos(angle + 0.7)[:, None]
    # once in a turn, and twenty times: each rises through half its height where the angle is a multiple of 2π and of π/10
    mark, tacho = np.sin(angle), np.sin(20 * angle)
    both = once_per_turn(t, x, mark, tacho=tacho)
    error = abs(both.vector[0] - 3 * np.exp(0.7j))
    assert error < 5e-3
    assert both.turns in (21, 22)
    # linear between pulses: twice as many, a quarter of the error
    finer = once_per_turn(t, x, mark, tacho=np.sin(40 * angle))
    assert abs(finer.vector[0] - 3 * np.exp(0.7j)) < error / 3
    # the mark alone does not know how the shaft runs ahead and lags within the turn
    assert abs(once_per_turn(t, x, mark).vector[0] - 3 * np.exp(0.7j)) > 0.1
    # without a mark the first pulse is where the angle counts from: after 0.5 rad that of 2π/20·2
    alone = once_per_turn(t, x, tacho, pulses=20)
    first = 2 * np.pi / 20 * np.ceil(0.5 / (2 * np.pi / 20))
    assert abs(alone.vector[0] - 3 * np.exp(1j * (0.7 + first))) < 5e-3
    assert alone.speed == pytest.approx(2 * np.pi * 11.3, rel=2e-3)


def test_pulses_that_cannot_be_counted_are_said() -> None:
    t = np.arange(4000) / 4000
    angle = 2 * np.pi * 10 * t + 0.3
    x, mark, tacho = np.cos(angle)[:, None], np.sin(angle), np.sin(6 * angle)
    missing = np.where((angle > 20) & (angle < 21.5), -1.0, tacho)
    with pytest.raises(ValueError, match=r"5 pulses of the tacho: expected 6, as others"):
        once_per_turn(t, x, mark, tacho=missing)
    with pytest.raises(ValueError, match="from mark to mark"):
        once_per_turn(t, x, mark, pulses=6, tacho=tacho)
    with pytest.raises(ValueError, match="expected 101 at least, a turn of 100"):
        once_per_turn(t, x, mark, pulses=100)
    with pytest.raises(ValueError, match="one at least"):
        once_per_turn(t, x, mark, pulses=0)
    with pytest.raises(ValueError, match="rises 0 times"):
        once_per_turn(t, x, mark, tacho=0 * tacho)


def test_the_true_marks_lie_within_the_resolution() -> None:
    """Marks of two levels at an even speed, at any place between the samples; recordings may begin in a pulse."""
    rng = np.random.default_rng(5)
    for _ in range(300):
        samples, turns, start = rng.uniform(25, 200), int(rng.choice([3, 8, 20])), rng.random()
        angle = start + np.arange(int(samples * turns) + 5) / samples
        found = marks(np.arange(len(angle)), angle % 1 < 0.3)
        true = (np.rint(start + found.at / samples) - start) * samples
        assert abs((found.at - true).mean()) <= found.slack((len(true) - 1) / 2) + 1e-9


@pytest.mark.parametrize("of", ["mark", "tacho"])
def test_the_phase_lies_within_its_resolution_in_short_recordings(of: str) -> None:
    """Several pulses a turn, of a mark or of a tacho beside it; with a part of a turn left over, or begun within a pulse."""
    rng = np.random.default_rng(3)

    def pulse(turn: np.ndarray, count: int, samples: float) -> np.ndarray:
        return (turn * count) % 1 < rng.uniform(1.2 * count / samples, 1 - 1.2 * count / samples)

    for _ in range(400):
        pulses = int(rng.integers(1, 7))
        samples = float(rng.uniform(6 * pulses + 2, 30 * pulses))
        turn = np.arange(int(rng.uniform(2.3 if of == "mark" else 3.3, 5) * samples)) / samples - rng.random()
        x = np.cos(2 * np.pi * turn)[:, None]
        if of == "mark":
            found = once_per_turn(turn, x, pulse(turn, pulses, samples), pulses)
        else:
            shifted = turn - rng.random()
            found = once_per_turn(turn, x, pulse(turn, 1, samples), 1, pulse(shifted, pulses + 1, samples))
        # of several pulses any may be the first of the recording
        alike = pulses if of == "mark" else 1
        off = np.angle(found.vector[0] ** alike) / alike
        assert abs(off) <= found.phase_resolution


def recording(
    ramp: float, turns: int, samples: float, start: float = 0.0, phase: float = 0.5
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, angle and 3 cos(θ + phase) beside a second order; the speed changes by `ramp` at a constant acceleration."""
    t = np.arange(int(turns * samples)) / samples
    angle = 2 * np.pi * ((t - start) + ramp / turns * (t - start) ** 2 / 2)
    return t, angle, (3 * np.cos(angle + phase) + 0.7 * np.cos(2 * angle + 1))[:, None]


@pytest.mark.parametrize("phase", [0.5, -0.5])
def test_a_constant_acceleration_is_followed(phase: float) -> None:
    """A fifth more speed within four turns: angles that grew evenly in each turn erred by 0.03 of 3."""
    t, angle, x = recording(0.2, 4, 1000, 0.1, phase)
    found = once_per_turn(t, x, np.sin(angle))
    assert found.turns == 4
    assert abs(found.vector[0] - 3 * np.exp(1j * phase)) < 3e-5


@pytest.mark.parametrize("ramp", [0.01, -0.01, 0.05, -0.05, 0.2, -0.2])
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_ramps_of_speed(ramp: float, noise: float) -> None:
    """Marks of two levels: amplitudes erred by up to 2 %, phases beyond what was stated in a tenth of all recordings."""
    rng = np.random.default_rng(7)
    off, stated = [], []
    for _ in range(60):
        t, angle, x = recording(ramp, int(rng.choice([5, 20, 60])), rng.uniform(20, 100), rng.random())
        found = once_per_turn(t, x + noise * rng.normal(size=x.shape), angle % (2 * np.pi) < 0.5)
        error = found.vector[0] * np.exp(-0.5j) / 3
        assert abs(np.angle(error)) <= found.phase_resolution + 4 * found.deviation[0] / 3
        off.append(abs(error) - 1)
        stated.append(found.deviation[0] / 3)
    assert np.abs(off).max() < 0.01 + 0.15 * noise
    assert (np.abs(off) < 3 * np.array(stated)).mean() > 0.95
    assert abs(np.mean(off)) < 0.001 + 0.02 * noise


def test_a_mark_in_noisy_volts_is_no_finer_than_its_samples() -> None:
    """5 V with 20 mV of noise: once taken as known between the samples, and 2 degrees off without a word."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        t, angle, x = recording(0.05, 20, rng.uniform(20, 100), rng.random())
        mark = 5.0 * (angle % (2 * np.pi) < 0.5) + 0.02 * rng.normal(size=len(t))
        found = once_per_turn(t, x, mark)
        assert abs(np.angle(found.vector[0] * np.exp(-0.5j))) <= found.phase_resolution


def test_a_short_pulse_in_few_samples_is_in_doubt() -> None:
    """A smooth pulse of 3 to 9 samples, by lines through half its height."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        t, angle, x = recording(0.0, 20, rng.uniform(20, 60), rng.random())
        top = np.arccos(1 + 0.04 * np.log(0.5))
        found = once_per_turn(t, x, np.exp(25 * (np.cos(angle - top) - 1)))
        assert 0 < abs(np.angle(found.vector[0] * np.exp(-0.5j))) <= found.phase_resolution


def test_a_pulse_between_two_samples_is_missed_and_named() -> None:
    """A turn that lasts as long as two was taken for one, and half the amplitude was lost."""
    t, angle, x = recording(0.01, 20, 21.3, 0.4)
    with pytest.raises(ValueError, match=r"is (2|0\.5)\S* times the one before it: a pulse was missed"):
        once_per_turn(t, x, angle % (2 * np.pi) < 0.2)
