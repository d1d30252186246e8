"""Sums and products with their errors: exact, against fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from dalembert.arithmetic.exact import exact_sum, two_product, two_sum


def test_a_sum_and_its_error_are_exact() -> None:
    rng = np.random.default_rng(1)
    a, b = (rng.normal(size=500) * 10.0 ** rng.uniform(-20, 20, 500) for _ in range(2))
    for x, y, s, e in zip(a, b, *two_sum(a, b), strict=True):
        assert Fraction(x) + Fraction(y) == Fraction(s) + Fraction(e)


def test_a_product_and_its_error_are_exact() -> None:
    rng = np.random.default_rng(2)
    a, b = (rng.normal(size=500) * 10.0 ** rng.uniform(-20, 20, 500) for _ in range(2))
    for x, y, p, e in zip(a, b, *two_product(a, b), strict=True):
        assert Fraction(x) * Fraction(y) == Fraction(p) + Fraction(e)


def test_sums_along_any_axis() -> None:
    rng = np.random.default_rng(3)
    x = rng.normal(size=(3, 17, 2)) * 10.0 ** rng.uniform(-8, 8, (3, 17, 2))
    for axis in range(3):
        total, rest = exact_sum(x, axis=axis)
        assert total.shape == rest.shape == tuple(np.delete(x.shape, axis))
        moved = np.moveaxis(x, axis, 0).reshape(x.shape[axis], -1)
        for column, t, r in zip(moved.T, total.ravel(), rest.ravel(), strict=True):
            true = sum(map(Fraction, column.tolist()))
            assert abs(Fraction(t) + Fraction(r) - true) <= 1e-29 * sum(map(abs, column))
    total, rest = exact_sum(np.empty((4, 0)))
    assert total.tolist() == rest.tolist() == [0] * 4
    assert exact_sum(x)[0].shape == (3, 17)
