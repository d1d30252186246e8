"""Published slider-cranks by virtual power, from tables of link states."""

from __future__ import annotations

import math

import pytest

from virtualwork.textbook.link_states import LinkStates, UnitLoad
from virtualwork.textbook.power_balance import balance


def slider_crank(r: float, length: float, theta: float, omega: float) -> tuple[float, float]:
    """Return velocity and acceleration of the slider of an in-line slider-crank at constant speed, m/s and m/s²."""
    s, c = math.sin(theta), math.cos(theta)
    root = math.sqrt(length**2 - (r * s) ** 2)
    v = -r * s - r * r * s * c / root
    a = -r * c - r * r * (c * c - s * s) / root - (r * r * s * c) ** 2 / root**3
    return v * omega, a * omega**2


def torque(v: float, omega: float, force: float, mass: float = 0.0, a: float = 0.0) -> float:
    states = LinkStates(
        velocity=[0, v], omega=[omega, 0], force=[0, force], mass=[0, mass], acceleration=[0, a]
    )
    return float(balance(states, [UnitLoad(torque=[1, 0])]).value[0])


def test_uicker_11_2() -> None:
    """Uicker, Pennock and Shigley, problem 11.2: P = −900 N on the slider, r 75 mm, l 350 mm, 105°: −61.5 N·m."""
    v, _ = slider_crank(0.075, 0.35, math.radians(105), 1.0)
    assert torque(v, 1.0, -900.0) == pytest.approx(-61.50387994466376, rel=1e-13)


def test_khurmi_15_7() -> None:
    """Khurmi and Gupta, ex. 15.7: T = 14 491 N·m with the book's approximate acceleration; 14 489.5 with the exact."""
    omega, theta = 250 * math.pi / 30, math.radians(60)
    v, a = slider_crank(0.3, 1.2, theta, omega)
    force = 68722.33929727673
    # the book takes the piston's outward motion as positive: the gas force drives it inward, along −x
    assert v == pytest.approx(-7.672622158706391, rel=1e-13)
    assert a == pytest.approx(-77.12922462049917, rel=1e-12)
    assert -torque(v, omega, -force, 250.0, a) == pytest.approx(14489.517985606446, rel=1e-12)
    approximate = -(omega**2) * 0.3 * (math.cos(theta) + math.cos(2 * theta) / 4)
    assert -torque(v, omega, -force, 250.0, approximate) == pytest.approx(14491.19877420687, rel=1e-12)


def test_bevan_12_3() -> None:
    """Bevan, ch. 12, ex. 3: 6 110 lb·ft with the approximate velocity; 6 117.5 with the exact (in feet and pounds)."""
    v, _ = slider_crank(1.0, 5.0, math.radians(40), 1.0)
    assert -torque(v, 1.0, -8243.539123019618) == pytest.approx(6117.4678220130945, rel=1e-13)
