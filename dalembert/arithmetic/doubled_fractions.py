"""Doubled arrays from exact numbers, and formulas in fractions where even 32 digits cancel."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction

from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.doubled_operations import doubled_array


def exactly(numbers: Iterable[Fraction], shape: tuple[int, ...]) -> DoubledArray:
    """Exact numbers as a doubled array of this shape."""
    return DoubledArray.of(doubled_array(numbers, shape))


def by_fractions(formula: Callable[..., Fraction], *numbers: DoubledArray) -> DoubledArray:
    """A formula of arrays of one shape in fractions, number by number: what cancels in it is exact.

    >>> by_fractions(lambda a, b: a - b, DoubledArray([1.0], [1e-30]), DoubledArray([1.0])).value
    array([1.e-30])
    """
    rows = [
        [Fraction(a) + Fraction(b) for a, b in zip(x.high.flat, x.low.flat, strict=True)] for x in numbers
    ]
    return exactly([formula(*row) for row in zip(*rows, strict=True)], numbers[0].shape)
