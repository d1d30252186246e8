"""Complex numbers of 32 digits, arrays of them: vectors of a second run, and decimals as they are written.

What a formula gives in floats is held against the same formula on these. A decimal of a file is entered exactly:
0.1 is a tenth, and 120° has the cosine -1/2.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.angles import degrees
from dalembert.arithmetic.doubled import PI, Doubled, doubled, settled
from dalembert.arithmetic.doubled_functions import DOUBLED

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

OWN = 1.01
"""What the second run itself may be off by, of the difference."""


class Vectors:
    """x + iy of two doubled arrays (...).

    Examples
    --------
    What a quotient of floats leaves:

    >>> third = Vectors.of(np.array([1 + 3j])) / Vectors.of(np.array([3 + 0j]))
    >>> third.apart(np.array([1 / 3 + 1j])).round(19)
    array([1.87e-17])
    """

    __slots__ = ("x", "y")
    __array_ufunc__ = None

    def __init__(self, x: Doubled, y: Doubled) -> None:
        self.x, self.y = x, y

    @classmethod
    def of(cls, z: ArrayLike) -> Vectors:
        """Complex floats, exactly."""
        array = np.asarray(z, dtype=complex)
        return cls(Doubled(array.real.copy()), Doubled(array.imag.copy()))

    @classmethod
    def polar(cls, size: Doubled, angles: Iterable[Fraction], unit: str, shape: tuple[int, ...]) -> Vectors:
        """size·e^{i·angle} of exact angles in degrees (`deg`) or radians, laid out in this shape."""
        quarter, rest = [], []
        for angle in angles:
            turns = round(angle / 90) if unit == "deg" else 0
            quarter.append(turns % 4)
            rest.append(angle - 90 * turns)
        part = doubled_array(rest, shape)
        sine, cosine = DOUBLED.sincos(part * PI / 180.0 if unit == "deg" else part)
        q = np.array(quarter).reshape(shape)

        def turned(a: Doubled, b: Doubled) -> Doubled:
            return Doubled(
                *(np.choose(q, [m, n, -m, -n]) + 0.0 for m, n in ((a.high, b.high), (a.low, b.low)))
            )

        return cls(size * turned(cosine, -sine), size * turned(sine, cosine))

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(np.shape(self.x.high))

    @property
    def value(self) -> Complex:
        """The nearest complex floats."""
        z = np.empty(self.shape, dtype=complex)
        z.real, z.imag = self.x.value, self.y.value
        return z

    @property
    def conj(self) -> Vectors:
        return Vectors(self.x, -self.y)

    @property
    def square(self) -> Doubled:
        """|z|²."""
        return self.x * self.x + self.y * self.y

    @property
    def size(self) -> Doubled:
        """|z|."""
        return DOUBLED.sqrt(self.square)

    @property
    def angle(self) -> Doubled:
        """The angle, [0, 2π)."""
        angle = DOUBLED.atan2(self.y, self.x)
        below = angle.high < 0
        turned = angle + PI * 2.0
        return Doubled(np.where(below, turned.high, angle.high), np.where(below, turned.low, angle.low))

    @property
    def degrees(self) -> Doubled:
        """The angle in degrees, [0, 360)."""
        return self.angle * 180.0 / PI

    def __add__(self, other: Vectors) -> Vectors:
        return Vectors(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vectors) -> Vectors:
        return Vectors(self.x - other.x, self.y - other.y)

    def __neg__(self) -> Vectors:
        return Vectors(-self.x, -self.y)

    def __mul__(self, other: Vectors | Doubled | Real) -> Vectors:
        if isinstance(other, Vectors):
            return Vectors(
                self.x * other.x - self.y * other.y,
                self.x * other.y + self.y * other.x,
            )
        return Vectors(self.x * other, self.y * other)

    def __truediv__(self, other: Vectors | Doubled | Real) -> Vectors:
        if isinstance(other, Vectors):
            above, below = self * other.conj, other.square
            return Vectors(above.x / below, above.y / below)
        return Vectors(self.x / other, self.y / other)

    def __getitem__(self, index: Any) -> Vectors:
        return Vectors(part(self.x, index), part(self.y, index))

    def __setitem__(self, index: Any, value: Vectors) -> None:
        for own, other in ((self.x, value.x), (self.y, value.y)):
            if not np.ndim(own.low):
                own.low = np.zeros(self.shape)
            own.high[index], own.low[index] = other.high, other.low

    def total(self, axis: int = -1) -> Vectors:
        """The sum along an axis."""
        return Vectors(total(self.x, axis), total(self.y, axis))

    def swapped(self) -> Vectors:
        """The vectors with their last two axes exchanged."""
        parts = ((x.high, x.low + 0.0 * x.high) for x in (self.x, self.y))
        return Vectors(*(Doubled(*(np.swapaxes(each, -1, -2) for each in pair)) for pair in parts))

    def apart(self, value: ArrayLike) -> Real:
        """Return by how much complex floats differ from these."""
        off = self - Vectors.of(value)
        return np.asarray(OWN * np.hypot(off.x.value, off.y.value))

    def turned(self, value: ArrayLike) -> Real:
        """Return by how much the angles of complex floats differ, degrees; half a turn where no direction holds."""
        size, error = np.abs(np.asarray(value)), self.apart(value)
        turn = off(degrees(np.asarray(value, dtype=complex)), self.degrees, 360.0)
        return np.where(error < size, turn, np.where(error > 0, 180.0, 0.0))

    @classmethod
    def joined(cls, parts: Iterable[Vectors], axis: int = 0) -> Vectors:
        """Arrays behind each other along an axis."""
        each = list(parts)
        return cls(*(_joined([getattr(z, name) for z in each], axis) for name in ("x", "y")))


def _joined(parts: list[Doubled], axis: int) -> Doubled:
    return Doubled(
        np.concatenate([x.high for x in parts], axis),
        np.concatenate([x.low + 0.0 * x.high for x in parts], axis),
    )


def part(x: Doubled, index: Any) -> Doubled:
    """Entries of a doubled array."""
    return Doubled(x.high[index], x.low[index] if np.ndim(x.low) else x.low)


def total(x: Doubled, axis: int = -1) -> Doubled:
    """The sum of a doubled array along an axis, in pairs."""
    rest = np.broadcast_to(x.low, np.shape(x.high))
    x = Doubled(np.moveaxis(x.high, axis, 0), np.moveaxis(rest, axis, 0))
    if not len(x.high):
        nothing = np.zeros(x.high.shape[1:])
        return Doubled(nothing, nothing)
    while (many := len(x.high)) > 1:
        half = many // 2
        pairs = part(x, slice(half)) + part(x, slice(half, 2 * half))
        x = _joined([pairs, part(x, slice(2 * half, many))], 0) if many % 2 else pairs
    return settled(x.high[0], x.low[0])


def doubled_array(exact: Iterable[Fraction], shape: tuple[int, ...]) -> Doubled:
    """Exact numbers as a doubled array of this shape."""
    numbers = [Doubled.of(x) for x in exact]
    high, low = np.array([x.high for x in numbers]), np.array([x.low for x in numbers])
    return Doubled(high.reshape(shape), low.reshape(shape))


def off(value: ArrayLike, exact: Doubled, turn: float | Doubled = 0.0) -> Real:
    """Return by how much floats differ from doubled numbers; of angles by what but whole turns."""
    difference = exact - np.asarray(value, dtype=float)
    whole = doubled(turn)
    if whole.high:
        difference = difference - Doubled(np.rint(difference.high / whole.high)) * whole
    return np.asarray(OWN * np.abs(difference.value))
