"""The laws of cams against their closed forms, in floats and in fifty digits."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest

from virtualwork.describe.laws import RISES, TURN, Lift, Segment, pieces, spans
from virtualwork.formulas.lifts import lift_at

Law = Callable[[mp.mpf], mp.mpf]


def rising(motion: str, start: float = 0.0, width: float = TURN / 2, rise: float = 1.0) -> Lift:
    """A rise by a law, a dwell, and a return by the same law."""
    law = spans(
        [Segment(start, start + width, rise, motion), Segment(end=start + 4.0), Segment(motion=motion)], "law"
    )
    return Lift("cam", "ground", start, TURN, *pieces(law))


def trapezoid(u: mp.mpf) -> mp.mpf:
    """The acceleration of the modified trapezoid, integrated twice, by its pieces."""
    peak = 8 * mp.pi / (2 + mp.pi)
    if u > mp.mpf(1) / 2:
        return 1 - trapezoid(1 - u)
    wave = lambda x: peak * (x / (4 * mp.pi) - mp.sin(4 * mp.pi * x) / (16 * mp.pi**2))  # noqa: E731
    eighth = mp.mpf(1) / 8
    if u <= eighth:
        return wave(u)
    speed = peak / (4 * mp.pi)
    if u <= 3 * eighth:
        x = u - eighth
        return wave(eighth) + speed * x + peak * x * x / 2
    x = u - 3 * eighth
    here = wave(eighth) + speed / 4 + peak / 32
    fast = speed + peak / 4
    return here + fast * x + peak * (1 - mp.cos(4 * mp.pi * x)) / (16 * mp.pi**2)


def sine(u: mp.mpf) -> mp.mpf:
    """The modified sine as Norton's eq. 8.14 has it."""
    c = mp.pi / (4 + mp.pi)
    if u < mp.mpf(1) / 8:
        return c * (u - mp.sin(4 * mp.pi * u) / (4 * mp.pi))
    if u <= mp.mpf(7) / 8:
        return c * (2 / mp.pi + u - 9 * mp.sin(mp.pi / 3 + 4 * mp.pi * u / 3) / (4 * mp.pi))
    return c * (4 / mp.pi + u - mp.sin(4 * mp.pi * u) / (4 * mp.pi))


TRUTH: dict[str, Law] = {
    "simple harmonic": lambda u: (1 - mp.cos(mp.pi * u)) / 2,
    "cycloidal": lambda u: u - mp.sin(2 * mp.pi * u) / (2 * mp.pi),
    "3-4-5": lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5,
    "4-5-6-7": lambda u: 35 * u**4 - 84 * u**5 + 70 * u**6 - 20 * u**7,
    "modified sine": sine,
    "modified trapezoid": trapezoid,
}

# peak factors of velocity, acceleration and jerk, in closed form
PEAKS: dict[str, tuple[float, float, float]] = {
    "simple harmonic": (math.pi / 2, math.pi**2 / 2, math.pi**3 / 2),
    "cycloidal": (2.0, TURN, TURN**2),
    "3-4-5": (15 / 8, 10 / math.sqrt(3), 60.0),
    "4-5-6-7": (35 / 16, 84 / (5 * math.sqrt(5)), 52.5),
    "modified sine": (
        4 * math.pi / (4 + math.pi),
        4 * math.pi**2 / (4 + math.pi),
        16 * math.pi**3 / (4 + math.pi),
    ),
    "modified trapezoid": (2.0, 8 * math.pi / (2 + math.pi), 32 * math.pi**2 / (2 + math.pi)),
}


def test_every_law_has_a_truth() -> None:
    assert TRUTH.keys() == PEAKS.keys() == RISES.keys()


@pytest.mark.parametrize("motion", PEAKS)
def test_peak_factors(motion: str) -> None:
    width = 1.3
    of = rising(motion, 0.4, width, 0.02)
    # where the peaks of the closed forms stand, and everything between
    special = [0, 1 / 8, 3 / 8, 0.5, (1 - 1 / math.sqrt(3)) / 2, (1 - 1 / math.sqrt(5)) / 2, 0.25]
    u = np.sort(
        np.concatenate([np.linspace(0, 0.999, 2001), special, np.nextafter(np.array([0.125, 0.375]), 0)])
    )
    for k, peak in enumerate(PEAKS[motion], 1):
        value = lift_at(of, 0.4 + width * u, k) * width**k / 0.02
        assert abs(np.abs(value).max() / peak - 1) < 1e-13, (motion, k)


@pytest.mark.parametrize("motion", TRUTH)
def test_against_fifty_digits(motion: str) -> None:
    start, width, rise = 0.75, 2.5, 0.03125
    of = rising(motion, start, width, rise)
    with mp.workdps(50):
        for u in (0.0, 1e-6, 0.01, 0.124, 0.2, 0.374, 0.45, 0.55, 0.63, 0.8, 0.9, 0.9999):
            angle = start + width * u
            exact = (mp.mpf(angle) - mp.mpf(start)) / mp.mpf(width)
            for k in range(4):
                law = TRUTH[motion]
                true = (mp.diff(law, exact, k) if k else law(exact)) * mp.mpf(rise) / mp.mpf(width) ** k
                scale = rise / width**k * (1.0, *PEAKS[motion])[k]
                assert abs(lift_at(of, angle, k) - float(true)) < 4e-15 * scale, (motion, u, k)


@pytest.mark.parametrize("motion", RISES)
def test_continuous_over_the_turn(motion: str) -> None:
    of = rising(motion)
    for knot in of.knots[1:-1]:
        for k in (0, 1):
            below, above = (lift_at(of, knot + side * 1e-9, k) for side in (-1, 1))
            assert abs(above - below) < 1e-7
    assert max(abs(lift_at(of, angle)) for angle in (-TURN, 0.0, TURN)) < 1e-30


def test_one_angle_and_many_agree() -> None:
    of = rising("modified sine")
    q = np.linspace(-7, 7, 301)
    for k in range(5):
        scale = np.abs(lift_at(of, q, k)).max()
        assert np.abs(lift_at(of, q, k) - [lift_at(of, float(x), k) for x in q]).max() < 1e-14 * scale
