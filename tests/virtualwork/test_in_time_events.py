"""The first time at which an input has a value: of pendulums against elliptic integrals, to any accuracy."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from tests.virtualwork.released import G, pendulum, rotor
from virtualwork import Torque
from virtualwork.intime.passing import at, turns, zero

LOWEST = -math.pi / 2


def when(amplitude: float, level: float) -> float:
    """When a pendulum of 1 m, released at an amplitude, first has an angle against its lowest place."""
    with mp.workdps(40):
        k = mp.sin(mp.mpf(amplitude) / 2)
        # as near the amplitude as the level is itself a number
        x = max(mp.mpf(-1), min(mp.mpf(1), mp.sin(mp.mpf(level) / 2) / k))
        return float((mp.ellipk(k * k) - mp.ellipf(mp.asin(x), k * k)) / mp.sqrt(mp.mpf(G)))


def uncertain(amplitude: float, level: float, accuracy: float) -> float:
    """How much a time hangs on an error of the angle: by the speed there, and close to the turn by its square root."""
    speed = math.sqrt(max(2 * G * (math.cos(level) - math.cos(amplitude)), 0.0))
    return accuracy / max(speed, math.sqrt(accuracy * G * math.sin(amplitude)))


@pytest.mark.parametrize("accuracy", [1e-5, 1e-7, 1e-9, 1e-11])
@pytest.mark.parametrize("share", [0.9, 0.0, -0.9, -0.9999, 0.9999])
def test_first_crossing_of_a_swing(share: float, accuracy: float) -> None:
    level = 0.5 * share
    run = pendulum().simulate([0, 10], angle=LOWEST + 0.5, accuracy=accuracy, until={"bob": LOWEST + level})
    # the level is the rounded sum of the two angles
    close = 20 * uncertain(0.5, level, accuracy)
    assert run.t[-1] == pytest.approx(when(0.5, level), abs=close)


def test_a_level_that_is_only_touched_is_met_and_one_beyond_is_not() -> None:
    """The other end of a swing after half a period, and the level of the start again after a whole one."""
    half = when(0.5, -0.5)
    for level, end in ((-0.5, half), (0.5, 2 * half)):
        run = pendulum().simulate([0, 10], angle=LOWEST + 0.5, until={"bob": LOWEST + level})
        assert run.t[-1] == pytest.approx(end, abs=1e-4)
    run = pendulum().simulate([0, 10], angle=LOWEST + 0.5, until={"bob": LOWEST - 0.50001})
    assert "is not met" in " ".join(run.warnings)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_two_crossings_in_one_long_exact_step(sense: float) -> None:
    """A rotor thrown against a constant torque passes a level on its way out and back: the first counts."""
    m = rotor(2.0, torques=[Torque("rotor", -2.0 * sense)])
    for level in (0.1, 12.0, 12.5 * (1 - 1e-12)):
        run = m.simulate([0, 100], angle=0.0, speed=5 * sense, until={"rotor": sense * level})
        assert run.t[-1] == pytest.approx(5 - math.sqrt(25 - 2 * level), rel=1e-9)
    run = m.simulate([0, 100], angle=0.0, speed=5 * sense, until={"rotor": -sense})
    assert run.t[-1] == pytest.approx(5 + math.sqrt(27), rel=1e-12)
    # and from the level itself, back to it
    run = m.simulate([0, 100], angle=1.0, speed=5 * sense, until={"rotor": 1.0})
    assert run.t[-1] == pytest.approx(10, rel=1e-12)


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_variants_meet_the_first_crossing_too(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    level = -0.45
    amplitudes = np.array([0.5, 0.45 * (1 + 1e-7), 0.4501, 1.0, 2.5, 0.44])
    runs = (
        pendulum()
        .vary({"links.bob.mass": np.ones(len(amplitudes))})
        .simulate([0, 10], angle=LOWEST + amplitudes[:, None], accuracy=1e-9, until={"bob": LOWEST + level})
    )
    for amplitude, times in zip(amplitudes[:-1].tolist(), runs.times, strict=False):
        close = 20 * uncertain(amplitude, level, 1e-9)
        assert np.nanmax(times) == pytest.approx(when(amplitude, level), abs=close)
    assert runs.warnings == {5: ("bob: the event is not met before 10 s",)}


def test_turns_and_zeros_of_polynomials() -> None:
    """Cubics with their turns at 0.2 and 0.7, and lines and constants that have none."""
    # of x³ − 1.35 x² + 0.42 x, whose slope is 3 (x − 0.2)(x − 0.7)
    b = np.array([[0.0, 0.14, -0.17, 0.07], [0.0, 1.0, 2.0, 3.0], [2.0, 2.0, 2.0, 2.0]])
    found = turns(b)
    assert found[0] == pytest.approx([0, 0.2, 0.7, 1], abs=1e-14)
    assert at(b[:1], found[:1])[0] == pytest.approx([0, 0.038, -0.0245, 0.07], abs=1e-15)
    assert at(b[1:], found[1:])[0] == pytest.approx(3 * found[1], abs=1e-14)
    assert at(b[1:], found[1:])[1] == pytest.approx(2)
    (x,) = zero(b[:1], np.array([0.2]), np.array([0.7]))
    assert x == pytest.approx(0.675 - math.sqrt(0.675**2 - 0.42), abs=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200))
def test_crossings_at_random(seed: int) -> None:
    """Any amplitude, any level, close to the turns too, to any accuracy."""
    rng = np.random.default_rng(seed)
    accuracy, amplitude = 10 ** rng.uniform(-12, -4), rng.uniform(0.05, 2.5)
    near = 10 ** rng.uniform(-7, -2)
    share = [rng.uniform(-1, 1), near - 1, 1 - near, -1 - 10 ** rng.uniform(-3, -1)][rng.integers(4)]
    level = float(share * amplitude)
    # so near the turn that the accuracy wanted leaves it open
    if 0 < 1 - abs(share) < 50 * accuracy / amplitude:
        return
    run = pendulum().simulate(
        [0, 10], angle=LOWEST + amplitude, accuracy=accuracy, until={"bob": LOWEST + level}
    )
    if abs(share) > 1:
        assert run.t[-1] == 10.0
    else:
        close = 30 * uncertain(amplitude, level, accuracy) + 1e-14
        assert run.t[-1] == pytest.approx(when(amplitude, level), abs=close)
