"""Sums and products with their rounding errors kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
"""From 1 to the next number."""


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a + b rounded, and the rounding error; their sum is exact (Knuth, TAOCP 2, 4.2.2, theorem B)."""
    s = a + b
    c = s - a
    return s, (a - (s - c)) + (b - c)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a · b rounded, and the rounding error; exact (Dekker, Numer. Math. 18, 1971, 224-242)."""
    p = a * b
    a1, a2 = halves(a)
    b1, b2 = halves(b)
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


def halves(a: Array) -> tuple[Array, Array]:
    """Return the upper and the lower digits of a number, 26 bits each: products of two such parts are exact."""
    # 2²⁷ + 1
    high = 134217729.0 * a
    high -= high - a
    return high, a - high


UPPER = -1 << 27
"""Of a double's bits, those of its sign, its exponent and the upper 26 of its digits."""


def upper(x: Array) -> Array:
    """Return the upper 26 bits of a number: these alone have exact products with 27 others.

    >>> float(upper(np.array(1 + 2.0**-25 + 2.0**-26))) == 1 + 2.0**-25
    True
    """
    return (np.asarray(x, dtype=float).view(np.int64) & UPPER).view(float)


def exact_sum(x: Array, axis: int = -1) -> tuple[Array, Array]:
    """Return the sum along an axis as a pair (rounded, rest), good to some 30 digits of Σ|x|.

    A tree of two-sums, whose rounding errors are summed beside it (as Ogita, Rump and Oishi, SIAM J. Sci.
    Comput. 26, 2005, 1955-1988, do in sequence): ⌈log₂ n⌉ passes over arrays, no loop over their elements.
    """
    x = np.moveaxis(x, axis, 0)
    rest = np.zeros(x.shape[1:])
    while len(x) > 1:
        half = len(x) // 2
        s, error = two_sum(x[:half], x[half : 2 * half])
        rest = rest + error.sum(axis=0)
        x = np.concatenate([s, x[2 * half :]])
    return two_sum(x[0], rest) if len(x) else (rest, rest)
