"""Angles of vectors in degrees: what was written in degrees comes back as it was written."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from dalembert.angles import degrees, phasor


@pytest.mark.whole
@pytest.mark.parametrize(
    "angle", [0.0, 30.0, 330.0, 60.0, 90.0, 120.0, 180.0, 210.0, 270.0, 1e-9, 359.9, 12.3456789]
)
def test_one_angle(angle: float) -> None:
    for size in (1.0, 0.0135 * 20, 7e-9):
        assert float(degrees(phasor(np.array(size), np.array(angle), "deg"))) == angle


@pytest.mark.parametrize("digits", [0, 1, 3, 5, 6])
def test_many_angles(digits: int) -> None:
    rng = np.random.default_rng(digits)
    angles = np.round(rng.uniform(0, 360, 20_000), digits) % 360
    sizes = rng.uniform(1e-6, 1e3, 20_000)
    assert (degrees(phasor(sizes, angles, "deg")) == angles).all()
    # mirrored: of half a turn, for 360 - angle has fewer decimals of its own than a small angle
    half = angles[angles <= 180]
    mirrored = np.where(half == 0, 0, np.round(360 - half, 6))
    assert (degrees(phasor(sizes[: len(half)], -half, "deg")) == mirrored).all()


def test_other_angles_are_right_to_rounding() -> None:
    rng = np.random.default_rng(5)
    z = rng.normal(size=500) + 1j * rng.normal(size=500)
    with mpmath.workdps(30):
        for shown, x in zip(degrees(z).tolist(), z.tolist(), strict=True):
            exact = mpmath.degrees(mpmath.arg(mpmath.mpc(x))) % 360
            assert abs(shown - exact) <= 5 * np.spacing(float(exact))


def test_small_angles_stay() -> None:
    assert 0 < float(degrees(1 + 1e-17j)) < 1e-15
    assert float(degrees(complex(-1, -0.0))) == 180.0
    assert float(degrees(0j)) == 0.0


def test_turns() -> None:
    turns = np.array([0.25, -0.25, 0.5, 1.0, 400.75, 0.1])
    assert degrees(phasor(np.ones(6), turns, "rev")).tolist() == [90, 270, 180, 0, 270, 36]
    assert phasor(np.array(2.0), np.array(0.25), "rev") == 2j
