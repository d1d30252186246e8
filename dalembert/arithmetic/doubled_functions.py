"""Functions of doubled numbers: with them a tape gives some 31 digits, to hold its own sixteen against.

Sine and cosine by their series after a reduction with π/2 in four parts; the arctangent by one correction of the
float's, from the sine and cosine of it: its error is then that correction's cube.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import factorial

import numpy as np

from dalembert.arithmetic.doubled import Doubled

# the remainders of π/2, each the nearest double of what is left
HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33, 5.562271104316826e-50)
TERMS = 15  # of either series: (π/4)³⁰/30! is below 1e-35


@cache
def _inverse_factorial(n: int) -> Doubled:
    exact = Fraction(1, factorial(n))
    high = float(exact)
    return Doubled(np.array(high), float(exact - Fraction(high)))


class DoubledKind:
    """The functions of doubled numbers, for `Tape.on`.

    Examples
    --------
    The sine of a half to 31 digits: its high and low parts.

    >>> y = DOUBLED.sin(DOUBLED.const(0.5))
    >>> float(y.high), float(y.low)
    (0.479425538604203, -5.103969860556012e-18)
    """

    @staticmethod
    def const(value: float) -> Doubled:
        return Doubled(np.array(value))

    @staticmethod
    def sqrt(x: Doubled) -> Doubled:
        first = np.sqrt(x.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            # the root of zero is zero, and has no correction
            rest = np.where(first == 0, 0.0, (x - Doubled(first) * first).value / (2 * first))
        return Doubled(first) + rest

    @classmethod
    def sincos(cls, x: Doubled) -> tuple[Doubled, Doubled]:
        """(sin x, cos x), as good as 31 digits of x allow, for |x| up to some 10⁶."""
        k = np.rint(x.high * (2 / np.pi))
        r = x
        for part in HALF_PI:
            r = r - Doubled(np.asarray(part)) * k
        square = r * r
        sine = cosine = Doubled(np.zeros_like(k))
        for n in range(TERMS, -1, -1):
            sign = -1.0 if n % 2 else 1.0
            sine = sine * square + _inverse_factorial(2 * n + 1) * sign
            cosine = cosine * square + _inverse_factorial(2 * n) * sign
        sine = sine * r
        quarter = np.mod(k, 4)
        odd, turned = quarter % 2 == 1, quarter >= 2
        first, second = cls._where(odd, cosine, sine), cls._where(odd, sine, cosine)
        return cls._where(turned, -first, first), cls._where(turned ^ odd, -second, second)

    @classmethod
    def sin(cls, x: Doubled) -> Doubled:
        return cls.sincos(x)[0]

    @classmethod
    def cos(cls, x: Doubled) -> Doubled:
        return cls.sincos(x)[1]

    @classmethod
    def atan2(cls, y: Doubled, x: Doubled) -> Doubled:
        first = np.arctan2(y.high, x.high)
        sine, cosine = cls.sincos(Doubled(first))
        along = x * cosine + y * sine
        with np.errstate(invalid="ignore"):
            rest = ((y * cosine - x * sine) / along).value
        return Doubled(first) + np.where(along.high == 0, 0.0, rest)

    @classmethod
    def select(cls, test: Doubled, positive: Doubled, otherwise: Doubled) -> Doubled:
        return cls._where(test.high > 0, positive, otherwise)

    @staticmethod
    def _where(test: np.ndarray, a: Doubled, b: Doubled) -> Doubled:
        return Doubled(np.where(test, a.high, b.high), np.where(test, a.low, b.low))


DOUBLED = DoubledKind()
