"""Functions of doubled numbers: with them a tape gives some 31 digits, to hold its own sixteen against.

Sine and cosine by a table of 256 angles to a turn and a few terms of their series from there, after a reduction with π/2
in three parts; the arctangent by one correction of the float's, from the sine and cosine of it: its error is then that
correction's cube.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import factorial, nan, pi, sqrt
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled import Doubled, settled

# the remainders of π/2, each the nearest double of what is left
HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33, 5.562271104316826e-50)
TERMS = 15  # of either series for the table: (π/4)³⁰/30! is below 1e-35
STEPS = 256  # of the table


@cache
def _inverse_factorial(n: int) -> Doubled:
    return Doubled.of(Fraction((-1) ** (n // 2), factorial(n)))


def _series(r: Doubled) -> tuple[Doubled, Doubled]:
    """(sin r, cos r) for |r| up to π/4."""
    square = r * r
    sine = cosine = Doubled(np.zeros_like(r.high))
    for n in range(TERMS, -1, -1):
        sine = sine * square + _inverse_factorial(2 * n + 1)
        cosine = cosine * square + _inverse_factorial(2 * n)
    return sine * r, cosine


@cache
def _table() -> tuple[np.ndarray, ...]:
    """Sines and cosines of the table's angles, high and low parts."""
    k = np.arange(STEPS)
    quarter = np.rint(k / (STEPS / 4))
    within = Doubled(HALF_PI[0], HALF_PI[1]) * ((k - quarter * (STEPS / 4)) * (4 / STEPS))
    sine, cosine = _series(within)
    found = []
    for turned in (quarter.astype(int), quarter.astype(int) + 1):
        # of a sine; the cosine is the sine a quarter turn on
        for s, c in ((sine.high, cosine.high), (sine.low, cosine.low)):
            found.append(np.choose(turned % 4, [s, c, -s, -c]))
    return tuple(found)


class DoubledKind:
    """The functions of doubled numbers, for `Tape.on`.

    Examples
    --------
    The sine of a half to 31 digits: its high and low parts.

    >>> y = DOUBLED.sin(DOUBLED.const(0.5))
    >>> float(y.high), float(y.low)
    (0.479425538604203, -5.1039698605560106e-18)
    """

    @staticmethod
    def const(value: float) -> Doubled:
        return Doubled(value)

    @staticmethod
    def sqrt(x: Doubled) -> Doubled:
        if not np.ndim(x.high):
            first: Any = sqrt(x.high) if x.high >= 0 else nan
            return (
                settled(first, (x - Doubled(first) * first).high / (2 * first)) if first else Doubled(first)
            )
        with np.errstate(divide="ignore", invalid="ignore"):
            root = Doubled(np.sqrt(x.high))
            square = root.high * root.high
            rest = x.high - square
            rest -= root.left(root, square)
            rest += x.low
            rest /= 2 * root.high
            # the root of zero is zero, and has no correction
            rest[root.high == 0] = 0.0
        return settled(root.high, rest)

    @staticmethod
    def sincos(x: Doubled) -> tuple[Doubled, Doubled]:
        """(sin x, cos x), as good as 31 digits of x allow, for |x| up to some 10⁹."""
        k = np.rint(x.high * (STEPS / (2 * pi)))
        t = x
        for part in HALF_PI[:3]:
            t = t - Doubled(k) * (part * (4 / STEPS))
        square = t * t
        q = square.high
        # what is left out is below 2⁻¹⁰⁷ of the first term
        sine = _inverse_factorial(5) + q * (-1 / 5040 + q * (1 / 362880 - q / 39916800))
        sine = t + t * ((sine * square + _inverse_factorial(3)) * square)
        cosine = _inverse_factorial(6) + q * (1 / 40320 - q * (1 / 3628800 - q / 479001600))
        cosine = ((cosine * square + _inverse_factorial(4)) * square - 0.5) * square
        place = np.mod(np.nan_to_num(k, posinf=0.0, neginf=0.0), STEPS).astype(int)
        s, s_low, c, c_low = (part[place] for part in _table())
        of_sine, of_cosine = Doubled(s, s_low), Doubled(c, c_low)
        return of_sine + (of_sine * cosine + of_cosine * sine), of_cosine + (
            of_cosine * cosine - of_sine * sine
        )

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
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = (y * cosine - x * sine).high / along.high
        return settled(first, np.where(along.high == 0, 0.0, rest))

    @classmethod
    def select(cls, test: Doubled, positive: Doubled, otherwise: Doubled) -> Doubled:
        return cls._where(test.high > 0, positive, otherwise)

    @staticmethod
    def binade(x: Doubled) -> Doubled:
        from dalembert.arithmetic.arrays import NUMPY

        return Doubled(NUMPY.binade(x.high))

    @staticmethod
    def _where(test: Any, a: Doubled, b: Doubled) -> Doubled:
        if not np.ndim(test):
            return a if test else b
        return Doubled(np.where(test, a.high, b.high), np.where(test, a.low, b.low))


DOUBLED = DoubledKind()
