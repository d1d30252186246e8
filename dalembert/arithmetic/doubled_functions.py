"""Functions of doubled numbers: with them a tape gives some 31 digits, to hold its own sixteen against.

Sine and cosine begin at the nearest of 256 angles to a turn (`sines`) and add a few terms of their series from
there, after a reduction with the step of that table in three parts; the arctangent turns back by the nearest of these
angles and adds the series of what is left. The doubled numbers may be floats, arrays, or recorded: then the tape of a
tape in 32 digits is written down.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from dalembert.arithmetic.arrays import NUMPY
from dalembert.arithmetic.doubled import PI, Doubled, quick
from dalembert.arithmetic.exact import two_sum
from dalembert.arithmetic.recorded import RECORDED
from dalembert.arithmetic.sines import STEP, nearest


def _series(*coefficients: str) -> tuple[Doubled, ...]:
    return tuple(Doubled.of(Fraction(c)) for c in coefficients)


SINE = _series("-1/6", "1/120", "-1/5040", "1/362880", "-1/39916800")
COSINE = _series("-1/2", "1/24", "-1/720", "1/40320", "-1/3628800")
ARCTANGENT = _series("-1/3", "1/5", "-1/7", "1/9", "-1/11", "1/13", "-1/15")


def functions(x: Any) -> Any:
    """The functions of the parts of a doubled number: numpy's of arrays, recorded ones, or Python's."""
    return NUMPY if np.ndim(x) else RECORDED


class DoubledKind:
    """The functions of doubled numbers, for `Tape.on`.

    Examples
    --------
    The sine of a half to 31 digits: its high and low parts.

    >>> y = DOUBLED.sin(DOUBLED.const(0.5))
    >>> float(y.high), float(y.low)
    (0.479425538604203, -5.103969860556014e-18)
    """

    @staticmethod
    def const(value: float) -> Doubled:
        return Doubled(value)

    @staticmethod
    def sqrt(x: Doubled) -> Doubled:
        of = functions(x.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            first = Doubled(of.sqrt(x.high))
            if isinstance(first.high, float) and not first.high:
                return first
            square = first.high * first.high
            rest = x.high - square
            rest = rest - first.left(first, square)
            rest = (rest + x.low) / (2 * first.high)
        # the root of zero is zero, and has no correction
        return Doubled(first.high, of.select(first.high, rest, 0.0))

    @classmethod
    def sincos(cls, x: Doubled) -> tuple[Doubled, Doubled]:
        """(sin x, cos x), as good as 31 digits of x allow, for |x| up to some 10⁹."""
        k, sine_there, cosine_there = nearest(x.high)
        # x - k·STEP: the first difference is exact
        product = k.high * STEP[0]
        t, rest = two_sum(x.high - product, -k.left(Doubled(STEP[0]), product))
        product = k.high * STEP[1]
        t, more = two_sum(t, -product)
        rest = rest + more - k.left(Doubled(STEP[1]), product) - k.high * STEP[2] + x.low
        angle = quick(t, rest)
        square = angle * angle
        sine = quick(angle.high, *_pair(_polynomial(SINE, square, 2) * square * angle), angle.low)
        cosine = _polynomial(COSINE, square, 3) * square
        return _turned(sine_there, cosine_there * sine, sine_there * cosine), _turned(
            cosine_there, -(sine_there * sine), cosine_there * cosine
        )

    @classmethod
    def sin(cls, x: Doubled) -> Doubled:
        return cls.sincos(x)[0]

    @classmethod
    def cos(cls, x: Doubled) -> Doubled:
        return cls.sincos(x)[1]

    @classmethod
    def atan2(cls, y: Doubled, x: Doubled) -> Doubled:
        of = functions(y.high + x.high)
        k, sine, cosine = nearest(of.atan2(y.high, x.high))
        with np.errstate(divide="ignore", invalid="ignore"):
            along = x * cosine + y * sine
            slope = (y * cosine - x * sine) / along
        # no length has no angle but that of its signs
        slope = Doubled(*(of.select(abs(along.high), part, 0.0) for part in (slope.high, slope.low)))
        square = slope * slope
        rest = quick(slope.high, *_pair(_polynomial(ARCTANGENT, square, 3) * square * slope), slope.low)
        return _turned(k * Doubled(*STEP[:2]), rest)

    @staticmethod
    def select(test: Doubled, positive: Doubled, otherwise: Doubled) -> Doubled:
        of = functions(test.high)
        return Doubled(
            of.select(test.high, positive.high, otherwise.high),
            of.select(test.high, positive.low, otherwise.low),
        )

    @staticmethod
    def binade(x: Doubled) -> Doubled:
        return Doubled(functions(x.high).binade(x.high))


def _pair(x: Doubled) -> tuple[Any, Any]:
    return x.high, x.low


def _polynomial(coefficients: tuple[Doubled, ...], square: Doubled, doubled: int) -> Doubled:
    """c₀ + c₁·z + …, of a small z: the first coefficients in doubled numbers, what is left in floats."""
    z = square.high
    tail: Any = coefficients[-1].high
    for c in coefficients[-2 : doubled - 1 : -1]:
        tail = c.high + z * tail
    first = coefficients[doubled - 1]
    value = quick(first.high, z * tail, first.low)
    for c in coefficients[: doubled - 1][::-1]:
        value = quick(c.high, *_pair(value * square), c.low)
    return value


def _turned(there: Doubled, *more: Doubled) -> Doubled:
    """A sum of parts of which each is smaller than those before it."""
    high, low = there.high, there.low
    total = quick(*(each.high for each in more)) if len(more) > 1 else Doubled(more[0].high)
    for each in more:
        total.low = total.low + each.low
    return quick(high, total.high, low + total.low)


DOUBLED = DoubledKind()


def root(x: Doubled) -> Doubled:
    """The square root of an array."""
    return DOUBLED.sqrt(Doubled(np.asarray(x.high), x.low))


def direction(y: Doubled, x: Doubled) -> Doubled:
    """The angle of arrays of vectors; on the axes, and with the sign of a zero, as floats have it."""
    angle = DOUBLED.atan2(*(Doubled(np.asarray(part.high), part.low) for part in (y, x)))
    exact = PI * (np.arctan2(y.high, x.high) / np.pi)
    whole = (y.high == 0) | (x.high == 0)
    return Doubled(np.where(whole, exact.high, angle.high), np.where(whole, exact.low, angle.low))


LN2 = Doubled(0.6931471805599453, 2.3190468138462996e-17)


def exponential(x: Doubled) -> Doubled:
    """e to the power of arrays: 2ᵏ times the 2¹⁰-th power of a short series.

    >>> float(exponential(Doubled(1.0)).low)
    1.4456468917292502e-16
    """
    k = np.rint(x.high / math.log(2))
    # less k·ln 2, in 2¹⁰ parts
    r = (x - LN2 * k) / 1024.0
    # e^r - 1, so that no digit of a small r is lost
    less = r
    for n in range(9, 1, -1):
        less = r + less * r / n if n == 9 else r * (1.0 + less / n)
    for _ in range(10):
        less = less * (less + 2.0)
    power = np.exp2(np.clip(k, -1022, 1022))
    e = less + 1.0
    return Doubled(e.high * power, e.low * power)


def logarithm(x: Doubled) -> Doubled:
    """The natural logarithm of arrays of positive numbers, by a step of Newton's."""
    near = np.log(x.high)
    left = x * exponential(Doubled(-near)) - 1.0
    result: Doubled = left - left * left / 2.0 + near
    return result


@lru_cache(maxsize=256)
def constant(x: float) -> Doubled:
    """A constant of a formula as it is written: a short decimal, or a simple fraction of π."""
    share = Fraction(x / math.pi).limit_denominator(360) if math.isfinite(x) else Fraction(0)
    if 0 < abs(share.numerator) <= 360 and abs(float(share) * math.pi - x) <= 2.0**-52 * abs(x):
        return PI * Doubled.of(share)
    return Doubled.of(Fraction(repr(x))) if len(repr(x)) < 9 and math.isfinite(x) else Doubled(x)


def hypot(a: Doubled, b: Doubled) -> Doubled:
    """√(a² + b²) of arrays, by a power of two near the larger: no square underflows."""
    size = np.exp2(np.floor(np.log2(np.maximum(np.maximum(np.abs(a.high), np.abs(b.high)), 1e-290))))
    x, y = a / size, b / size
    result: Doubled = root(x * x + y * y) * size
    return result


def rint(x: Doubled) -> Doubled:
    """The nearest whole numbers of arrays."""
    near = np.rint(x.high)
    rest = x - near
    return Doubled(near + np.where((rest - 0.5).high > 0, 1.0, np.where((rest + 0.5).high < 0, -1.0, 0.0)))
