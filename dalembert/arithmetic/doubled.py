"""Numbers of twice as many digits: each the sum of two floats, of which the second is rounding beside the first.

As T. J. Dekker, Numer. Math. 18 (1971) 224-242, section 4. For the few differences that are all cancellation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.exact import two_product, two_sum

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Doubled:
    """high + low, some 32 digits; arrays (...) that broadcast, with each other and with plain numbers.

    Examples
    --------
    What is left of (1 + 2⁻⁴⁰)² - 1 - 2⁻³⁹:

    >>> x = np.array(1 + 2.0**-40)
    >>> float((Doubled(x) * x - 1.0 - 2.0**-39).value) == 2.0**-80
    True
    """

    high: Array
    low: Array | float = 0.0

    # numpy's own arrays leave their operators with a doubled number to it
    __array_ufunc__ = None

    @property
    def value(self) -> Array:
        """The nearest float."""
        return self.high + self.low

    def __add__(self, other: Doubled | Array | float) -> Doubled:
        b = _doubled(other)
        total, rest = two_sum(self.high, b.high)
        return _settled(total, rest + (self.low + b.low))

    def __mul__(self, other: Doubled | Array | float) -> Doubled:
        b = _doubled(other)
        product, rest = two_product(self.high, b.high)
        return _settled(product, rest + (self.high * b.low + self.low * b.high))

    def __truediv__(self, other: Doubled | Array | float) -> Doubled:
        b = _doubled(other)
        first = self.high / b.high
        return _settled(first, (self - b * first).value / b.high)

    def __rtruediv__(self, other: Array | float) -> Doubled:
        return _doubled(other) / self

    def __abs__(self) -> Doubled:
        sign = np.where(self.high < 0, -1.0, 1.0)
        return Doubled(self.high * sign, self.low * sign)

    def __neg__(self) -> Doubled:
        return Doubled(-self.high, -self.low)

    def __sub__(self, other: Doubled | Array | float) -> Doubled:
        return self + -_doubled(other)

    def __rsub__(self, other: Array | float) -> Doubled:
        return -self + other

    __radd__ = __add__
    __rmul__ = __mul__


def _settled(high: Array, low: Array) -> Doubled:
    """The same number with low below half a unit in the last place of high: a cancellation leaves it above."""
    total = np.asarray(high + low)
    return Doubled(total, low - (total - high))


def _doubled(x: Doubled | Array | float) -> Doubled:
    return x if isinstance(x, Doubled) else Doubled(np.asarray(x, dtype=float))
