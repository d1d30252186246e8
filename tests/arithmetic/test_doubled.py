"""Doubled numbers against fractions: sums, differences and products to some 31 digits of their terms."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from dalembert.arithmetic.doubled import Doubled


def exactly(x: Doubled, i: int) -> Fraction:
    return Fraction(float(np.broadcast_to(x.high, 200)[i])) + Fraction(float(np.broadcast_to(x.low, 200)[i]))


def test_sums_and_products_against_fractions() -> None:
    rng = np.random.default_rng(4)
    a, b, c, d = (rng.normal(size=200) * 10.0 ** rng.uniform(-6, 6, 200) for _ in range(4))
    found = (Doubled(a) + b) * (c * Doubled(d)) - 2.0 * Doubled(a) + (1.0 - Doubled(b))
    for i, (w, x, y, z) in enumerate(zip(*(map(Fraction, v.tolist()) for v in (a, b, c, d)), strict=True)):
        size = (abs(w) + abs(x)) * abs(y * z) + 2 * abs(w) + abs(x) + 1
        assert abs(exactly(found, i) - ((w + x) * y * z - 2 * w + 1 - x)) <= size * Fraction(1, 10**30)


def test_what_cancels_keeps_sixteen_digits() -> None:
    a = 1 + 2.0**-30
    left = Doubled(np.array([a])) * a - np.array([a * a])
    assert left.value.tolist() == [2.0**-60]
    assert (-left).value.tolist() == [-(2.0**-60)]
