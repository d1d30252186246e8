"""Estimates of errors where a table beside the file enters: its numbers are the decimals that it has, not the floats."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from virtualwork import Mechanism

WHEEL = """
[ground]
O = [0, 0]
[links.wheel]
points = { O = [0, 0] }
inertia = 1
[input]
link = "wheel"
[[torques]]
link = "wheel"
torque = "brake.csv"
"""
CAM = """
[ground]
O = [0, 0]
[links.cam]
points = { O = [0, 0] }
[links.valve]
points = { V = [0, 0] }
[[sliders]]
point = "V"
angle = "90 deg"
turned = "-90 deg"
[[cams]]
cam = "cam"
slider = "V"
face = "knife"
base_radius = "25 mm"
table = "lift.csv"
[input]
link = "cam"
"""


def mechanism(text: str, table: str) -> Mechanism:
    """The mechanism of a file with one table beside it."""
    return Mechanism.from_toml_text(text, "m.toml", None, lambda _: table.encode())  # type: ignore[arg-type]


def test_a_torque_between_two_rows() -> None:
    """0.1 N m at 0 rad and 0.3 N m at 0.3 rad: at 0.15 rad the effort is −0.2 N m; and random ones."""
    rng = np.random.default_rng(1)
    cases = [(0.3, 0.1, 0.3, 0.15)]
    for _ in range(40):
        end, first, last = (round(float(x), 3) for x in rng.uniform((0.1, -2, -2), (3, 2, 2)))
        cases.append((end, first, last, float(rng.uniform(0, end))))
    for end, first, last, at in cases:
        m = mechanism(WHEEL, f"angle_rad,torque_N_m\n0,{first}\n{end},{last}\n")
        dynamics = m.motion(at, speed=0.0, acceleration=0.0).dynamics
        error = float(np.ravel(dynamics.error_estimate().effort)[0])
        low, high, width = (Fraction(str(x)) for x in (first, last, end))
        exact = low + (high - low) * Fraction(at) / width
        off = abs(float(Fraction(float(np.ravel(dynamics.effort)[0])) + exact))
        assert off <= error <= max(2 * off, 1e-30)


def spline(x: Sequence[Any], y: Sequence[Any]) -> Callable[[Any], tuple[Any, Any, Any]]:
    """The periodic cubic spline by its second derivatives, all equations at once: value and two derivatives."""
    n = len(x) - 1
    h = [b - a for a, b in pairwise(x)]
    matrix, right = mp.zeros(n, n), mp.zeros(n, 1)
    for i in range(n):
        matrix[i, (i - 1) % n] += h[i - 1]
        matrix[i, i] += 2 * (h[i - 1] + h[i])
        matrix[i, (i + 1) % n] += h[i]
        right[i] = 6 * ((y[(i + 1) % n] - y[i]) / h[i] - (y[i] - y[(i - 1) % n]) / h[i - 1])
    bend = mp.lu_solve(matrix, right)

    def at(q: Any) -> tuple[Any, Any, Any]:
        i = max(k for k in range(n) if x[k] <= q)
        left, ahead, width = q - x[i], x[i + 1] - q, h[i]
        a, b, low, high = bend[i], bend[(i + 1) % n], y[i], y[(i + 1) % n]
        down, up = low / width - a * width / 6, high / width - b * width / 6
        value = (a * ahead**3 + b * left**3) / (6 * width) + down * ahead + up * left
        speed = (b * left**2 - a * ahead**2) / (2 * width) - down + up
        return value, speed, (a * ahead + b * left) / width

    return at


def test_a_cam_with_a_table_of_its_lift() -> None:
    """Place, speed and acceleration of the follower are within their estimates, and these no more than twice the error."""
    rng, ratios = np.random.default_rng(3), []
    for _ in range(12):
        some = {round(float(x), 1) for x in rng.uniform(5, 355, int(rng.integers(2, 30)))}
        angles = [0.0, *sorted(some), 360.0]
        lifts = [round(11 - 10 * math.cos(math.radians(x)) + float(rng.uniform(0, 0.1)), 2) for x in angles]
        lifts[-1] = lifts[0]
        rows = "".join(f"{angle},{lift}\n" for angle, lift in zip(angles, lifts, strict=True))
        m, q = mechanism(CAM, f"angle_deg,lift_mm\n{rows}"), float(rng.uniform(0, 6.28))
        slide = m.motion(q, speed=1.0, acceleration=0.0).slide("V")
        with mp.workdps(40):
            law = spline(
                [mp.mpf(str(a)) * mp.pi / 180 for a in angles], [mp.mpf(str(s)) / 1000 for s in lifts]
            )
            lift, *rates = law(mp.mpf(q))
            exact = [mp.mpf(25) / 1000 + lift, *rates]
            for order, value in enumerate((slide.position, slide.speed, slide.acceleration)):
                off = float(abs(mp.mpf(float(np.ravel(value)[0])) - exact[order]))
                error = float(np.ravel(slide.error_estimate(order))[0])
                assert off <= error
                if off:
                    ratios.append(error / off)
    assert np.median(ratios) < 2


def test_a_cam_whose_table_has_one_lift_dwells() -> None:
    """A round cam: the follower stands at the base circle and the lift, and never moves."""
    m = mechanism(CAM, "angle_deg,lift_mm\n0,5\n120,5\n240,5\n360,5\n")
    slide = m.motion(np.linspace(0, 7, 8), speed=1.0, acceleration=0.0).slide("V")
    assert slide.position.tolist() == pytest.approx([0.03] * 8, rel=1e-15)
    assert not slide.speed.any()
    assert not slide.acceleration.any()
