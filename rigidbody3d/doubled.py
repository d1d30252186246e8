"""Sums and products in doubled precision, for the one difference that decides on which side of the separatrix a body is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def weighted_difference(I1: Array, I2: Array, I3: Array, w1: Array, w3: Array) -> Array:
    """I1 (I2-I1) ω1² - I3 (I3-I2) ω3² in doubled precision: on the separatrix it is all cancellation."""
    first = _double_product(I1, I2, w1, -1.0)
    last = _double_product(I3, I2, w3, 1.0)
    s, e = _two_sum(first[0], -last[0])
    return s + (e + (first[1] - last[1]))


def _double_product(a: Array, b: Array, w: Array, sign: float) -> tuple[Array, Array]:
    """a · sign·(a - b) · w², as a pair."""
    d, d_rest = _two_sum(sign * a, -sign * b)
    p, p_rest = _two_product(a, d)
    p_rest = p_rest + a * d_rest
    q, q_rest = _two_product(w, w)
    r, r_rest = _two_product(p, q)
    return r, r_rest + (p * q_rest + p_rest * q)


def _two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """The rounded sum and its rounding error (Knuth, TAOCP 2, 4.2.2, theorem B)."""
    s = a + b
    c = s - a
    return s, (a - (s - c)) + (b - c)


def _two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """The rounded product and its rounding error (Dekker, Numer. Math. 18, 1971, 224-242)."""
    p = a * b
    a1, b1 = _upper(a), _upper(b)
    a2, b2 = a - a1, b - b1
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


def _upper(a: Array) -> Array:
    c = 134217729.0 * a  # 2²⁷ + 1
    return c - (c - a)
