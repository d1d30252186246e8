"""Numbers of twice as many digits: each the sum of two floats, of which the second is below the rounding of the first.

As T. J. Dekker, Numer. Math. 18 (1971) 224-242, section 4. The second run of a formula is in these numbers: what they
and floats agree in are the digits that hold.
"""

from __future__ import annotations

from fractions import Fraction
from math import frexp
from typing import Any

import numpy as np

from dalembert.arithmetic.exact import halves
from dalembert.arithmetic.recorded import RECORDED, Real


class Doubled:
    """high + low, some 32 digits; arrays (...) that broadcast, or floats, with each other and with plain numbers.

    The parts may be recorded numbers too: then the operations on them are written down.

    Examples
    --------
    What is left of (1 + 2⁻⁴⁰)² - 1 - 2⁻³⁹:

    >>> x = np.array(1 + 2.0**-40)
    >>> float((Doubled(x) * x - 1.0 - 2.0**-39).value) == 2.0**-80
    True
    """

    __slots__ = ("_halves", "high", "low")

    # numpy's own arrays leave their operators with a doubled number to it
    __array_ufunc__ = None

    def __init__(self, high: Any, low: Any = 0.0) -> None:
        self.high, self.low = high, low
        self._halves: Any = None

    @classmethod
    def of(cls, exact: Fraction) -> Doubled:
        """The number nearest to an exact one.

        >>> Doubled.of(Fraction("0.1"))
        Doubled(0.1, -5.551115123125783e-18)
        """
        high = float(exact)
        return cls(high, float(exact - Fraction(high)))

    def __repr__(self) -> str:
        return f"Doubled({self.high!r}, {self.low!r})"

    @property
    def value(self) -> Any:
        """The nearest float."""
        return self.high + self.low

    @property
    def halves(self) -> tuple[Any, Any]:
        """The upper and the lower digits of `high`, formed once: their products are exact."""
        if self._halves is None:
            self._halves = halves(self.high)
        return self._halves  # type: ignore[no-any-return]

    def __add__(self, other: Any) -> Doubled:
        # Knuth's sum with its rounding error, in place where arrays are long
        b = doubled(other)
        total = self.high + b.high
        back = total - self.high
        rest = b.high - back
        back -= total
        back += self.high
        rest += back
        if _none(self.low) and _none(b.low):
            return Doubled(total, rest)
        if not _none(self.low):
            rest += self.low
        if not _none(b.low):
            rest += b.low
        return settled(total, rest)

    def __mul__(self, other: Any) -> Doubled:
        b = doubled(other)
        if _binary(b):
            return Doubled(self.high * b.high, self.low * b.high)
        if _binary(self):
            return Doubled(b.high * self.high, b.low * self.high)
        product = self.high * b.high
        rest = self.left(b, product)
        if not _none(b.low):
            rest += self.high * b.low
        if not _none(self.low):
            rest += self.low * b.high
        return Doubled(product, rest)

    def left(self, b: Doubled, product: Any) -> Any:
        """The rounding error of a product of the upper parts (Dekker)."""
        if isinstance(self.high, Real) or isinstance(b.high, Real):
            return product.left if isinstance(product, Real) else 0.0
        (a1, a2), (b1, b2) = self.halves, b.halves
        rest = a1 * b1
        rest -= product
        rest += a1 * b2
        rest += a2 * b1
        rest += a2 * b2
        return rest

    def __truediv__(self, other: Any) -> Doubled:
        b = doubled(other)
        first = Doubled(_quotient(self.high, b.high))
        product = b.high * first.high
        rest = self.high - product
        rest -= b.left(first, product)
        if not _none(self.low):
            rest += self.low
        if not _none(b.low):
            rest -= b.low * first.high
        if isinstance(self.high, float) and self.high == 1.0:
            # the first quotient is near enough to 1/b
            return Doubled(first.high, rest * first.high)
        return Doubled(first.high, _quotient(rest, b.high))

    def __rtruediv__(self, other: Any) -> Doubled:
        return doubled(other).__truediv__(self)

    def __abs__(self) -> Doubled:
        if isinstance(self.high, Real):
            return Doubled(abs(self.high), RECORDED.select(self.high, self.low, -self.low))
        if not np.ndim(self.high):
            return -self if self.high < 0 else self
        sign = np.where(self.high < 0, -1.0, 1.0)
        return Doubled(self.high * sign, self.low * sign)

    def __neg__(self) -> Doubled:
        return Doubled(-self.high, -self.low)

    def __sub__(self, other: Any) -> Doubled:
        return self + -doubled(other)

    def __rsub__(self, other: Any) -> Doubled:
        return doubled(other) + -self

    __radd__ = __add__
    __rmul__ = __mul__


def _none(low: Any) -> bool:
    return isinstance(low, float) and low == 0.0


def _binary(x: Doubled) -> bool:
    """Whether it is a power of two, with which a product is exact."""
    return isinstance(x.high, float) and _none(x.low) and abs(frexp(x.high)[0]) == 0.5


def _quotient(a: Any, b: Any) -> Any:
    """a/b, as numpy has it where b is zero."""
    return (
        a / b if np.ndim(b) or b else np.float64(a) / np.float64(b) if not np.ndim(a) else a / np.float64(b)
    )


def quick(a: Any, b: Any, *low: Any) -> Doubled:
    """a + b + low, where b is no larger than a, or a is zero, and low is rounding (Dekker)."""
    total = a + b
    rest = total - a
    rest = b - rest
    for more in low:
        if not _none(more):
            rest = rest + more
    return Doubled(total, rest)


def settled(high: Any, low: Any) -> Doubled:
    """This number with low below half a unit in the last place of high: a cancellation leaves it above."""
    return quick(high, low)


def doubled(x: Any) -> Doubled:
    """A number as a doubled one: exactly what it is."""
    if isinstance(x, Doubled):
        return x
    return Doubled(float(x) if not np.ndim(x) else np.asarray(x, dtype=float))


PI = Doubled(3.141592653589793, 1.2246467991473532e-16)
