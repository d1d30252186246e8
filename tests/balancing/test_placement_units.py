"""Placing masses knows no unit: micrograms and tonnes are split and chosen alike."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import drill_depth, place, place_from_stock

SCALES = [1e-12, 1e-6, 1.0, 1e6, 1e12]


@pytest.mark.parametrize("scale", SCALES)
def test_a_choice_from_stock(scale: float) -> None:
    """2 at 0° and 1 at 90° come to 2 + i exactly; 3 at 45° would be off by half a unit."""
    angles = np.radians([0, 45, 90, 200])
    found = place_from_stock((2 + 1j) * scale, angles, np.array([1.0, 2.0, 3.0]) * scale)
    assert found.masses / scale == pytest.approx([2, 0, 1, 0], abs=1e-12)
    assert abs(found.error) < 1e-14 * scale
    # of two ways to hold 3 on one line the lighter: not 1 at 180° against 2 + 2
    found = place_from_stock(3 * scale, np.radians([0, 180]), np.array([1.0, 2.0]) * scale, pieces=2)
    assert found.masses / scale == pytest.approx([3, 0], abs=1e-12)
    limited = place_from_stock(
        3 * scale, np.radians([0, 180]), np.array([1.0, 2.0]) * scale, 2 * scale, pieces=2
    )
    assert limited.masses / scale == pytest.approx([2, 0], abs=1e-12)
    assert limited.bound == pytest.approx(scale, rel=1e-12)


@pytest.mark.parametrize("scale", SCALES)
def test_a_split(scale: float) -> None:
    """The sine rule: 1 at 30° is 1/√3 at 0° and at 60°; with at most ½ at each, ½ + ½ leave 1 − √3/2."""
    angles = np.radians([0, 60, 180])
    target = scale * np.exp(1j * np.radians(30))
    found = place(target, angles)
    assert found.masses / scale == pytest.approx([1 / np.sqrt(3)] * 2 + [0], rel=1e-14)
    assert found.bound == 0
    held = place(target, angles, 0.5 * scale)
    assert held.masses / scale == pytest.approx([0.5, 0.5, 0.0], rel=1e-14)
    assert held.bound == pytest.approx((1 - np.sqrt(3) / 2) * scale, rel=1e-12)
    one = place(2j * scale, [np.pi / 2], 1.5 * scale)
    assert one.masses[0] == pytest.approx(1.5 * scale, rel=1e-15)
    assert one.bound == pytest.approx(0.5 * scale, rel=1e-12)


def test_of_several_ways_that_fit_the_lightest() -> None:
    """Within their limits the neighbours of the target share it by the sine rule, though filling others would do too."""
    found = place(3, np.radians([90, 180, 210, 240, 330]), [2, 5, 1, 3, 4])
    assert found.masses == pytest.approx([np.sqrt(3), 0, 0, 0, 2 * np.sqrt(3)], abs=1e-14)
    found = place(-3, np.radians([150, 240, 270]), [4, 2, 2])
    assert found.masses == pytest.approx([1.5 * np.sqrt(3), 1.5, 0], abs=1e-14)


def test_a_pointed_drill() -> None:
    """Of 90° its cone is as deep as its radius: π r³/3; below it a full bore, above it a smaller cone alike."""
    r, rho = 0.005, 7800.0
    cone = rho * np.pi * r**3 / 3
    assert drill_depth(cone, 2 * r, rho, np.pi / 2) == pytest.approx(r, rel=1e-14)
    assert drill_depth(cone / 8, 2 * r, rho, np.pi / 2) == pytest.approx(r / 2, rel=1e-14)
    assert drill_depth(cone + rho * np.pi * r**2 * 0.01, 2 * r, rho, np.pi / 2) == pytest.approx(
        0.015, rel=1e-14
    )
    assert drill_depth([0.0, cone], 2 * r, rho, np.pi / 2) == pytest.approx([0.0, r], rel=1e-14)
    # of 118° (r/tan 59°) a quarter of the way down
    point = r / np.tan(np.radians(59))
    mass = rho * np.pi * r**2 * point / 3 / 64
    assert drill_depth(mass, 2 * r, rho, np.radians(118)) == pytest.approx(point / 4, rel=1e-14)
