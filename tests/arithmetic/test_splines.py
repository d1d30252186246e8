"""Splines of laws of motion: a rate that is zero is zero, and no rounding of its terms."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise

import pytest

from dalembert.arithmetic.splines import decimals, periodic, rates

DEGREES = (math.pi, 180)


def decimal_rates(t: list[str], degrees: list[str]) -> tuple[list[float], list[float]]:
    speed, acceleration = rates(decimals(t), decimals(degrees, DEGREES))
    return [*map(float, speed)], [*map(float, acceleration)]


def exact_rates(t: list[str], degrees: list[str]) -> tuple[list[Fraction], list[Fraction]]:
    """The same spline by Gauss' elimination of rational numbers: M of all rows, not-a-knot at both ends."""
    x, y, n = [*map(Fraction, t)], [*map(Fraction, degrees)], len(t)
    h = [b - a for a, b in pairwise(x)]
    rows = []
    for i in range(1, n - 1):
        row = [Fraction(0)] * (n + 1)
        row[i - 1 : i + 2] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
        row[n] = 6 * ((y[i + 1] - y[i]) / h[i] - (y[i] - y[i - 1]) / h[i - 1])
        rows.append(row)
    for i in (0, n - 3):
        row = [Fraction(0)] * (n + 1)
        row[i : i + 3] = h[i + 1], -h[i] - h[i + 1], h[i]
        rows.append(row)
    for k in range(n):
        pivot = next(r for r in range(k, n) if rows[r][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for r in range(n):
            if r != k and rows[r][k]:
                share = rows[r][k] / rows[k][k]
                rows[r] = [a - share * b for a, b in zip(rows[r], rows[k], strict=True)]
    bends = [rows[k][n] / rows[k][k] for k in range(n)]
    speed = [(y[i + 1] - y[i]) / h[i] - h[i] * (2 * bends[i] + bends[i + 1]) / 6 for i in range(n - 1)]
    last = (y[-1] - y[-2]) / h[-1] + h[-1] * (bends[-2] + 2 * bends[-1]) / 6
    return [*speed, last], bends


TABLES = [
    # at rest; uniform; a parabola and a cubic from rest; there and back
    ["30", "30", "30", "30", "30"],
    ["0.1", "0.2", "0.3", "0.4", "0.5"],
    ["0", "1", "4", "9", "16", "25"],
    ["0", "-1", "-4", "-9", "-16", "-25"],
    ["0", "1", "8", "27", "64"],
    ["10", "20", "30", "20", "10"],
    ["10", "20", "30", "30", "30", "20", "10"],
    ["0", "0.7", "0.1", "0.7", "0"],
]


@pytest.mark.parametrize("step", ["0.1", "0.01", "0.3"])
@pytest.mark.parametrize("degrees", TABLES)
def test_rates_are_those_of_rational_numbers(degrees: list[str], step: str) -> None:
    times = [str(Decimal(step) * i) for i in range(len(degrees))]
    unit = Fraction("3.14159265358979323846264338327950288419717") / 180
    for computed, exact in zip(decimal_rates(times, degrees), exact_rates(times, degrees), strict=True):
        assert computed == [float(x * unit) for x in exact]


def test_a_small_rate_beside_large_ones_stays() -> None:
    # of a table at rest that begins to move, the spline dies away before it, by 2 + √3 from row to row
    degrees = ["30"] * 30 + ["31", "33", "36"]
    computed, _ = decimal_rates([str(i) for i in range(33)], degrees)
    exact, _ = exact_rates([str(i) for i in range(33)], degrees)
    unit = Fraction("3.14159265358979323846264338327950288419717") / 180
    assert computed == [float(x * unit) for x in exact]
    assert 0 < abs(computed[0]) < 1e-16


def test_a_periodic_table_at_rest_stays_there() -> None:
    angles = decimals([str(k) for k in range(0, 361, 40)], DEGREES)
    assert periodic(angles, decimals(["0.1"] * 10)) == [0] * 9
