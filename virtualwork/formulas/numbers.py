"""What the formulas run on: Python numbers of one pose, arrays over many poses, or any numbers that behave so.

A formula needs +, −, ·, /, `abs`, `.real`, `.imag` and `.conjugate()` of its numbers. What Python has no operator for,
roots, e^{iθ}, and a complex number of two real ones, a `Kind` gives; a state carries its kind. Recorded numbers bring
a kind of their own.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

# complex or float, or an array of them; None is a zero that costs nothing
Number = Any
Reals = NDArray[np.float64]
Complexes = NDArray[np.complex128]
EPS = float(np.finfo(float).eps)
# sine of the angle between two columns below which the joint forces have no digit left that counts
PARALLEL = 1e-11


class Kind(Protocol):
    """The operations of one kind of number."""

    def constant(self, z: complex) -> Number:
        """A constant of the mechanism as such a number, so that its size and its inverse have all digits."""

    def sqrt(self, x: Number) -> Number:
        """The root; NaN of a negative number."""

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""

    def join(self, re: Number, im: Number) -> Number:
        """re + i·im."""

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        """1/(c1 × c2); NaN where two columns are parallel to rounding, for the joint forces have no value there."""


class One:
    """Python numbers: a single pose."""

    def constant(self, z: complex) -> complex:
        """The constant itself."""
        return z

    def sqrt(self, x: float) -> float:
        """The root."""
        return math.sqrt(x) if x >= 0 else math.nan

    def exp(self, angle: float) -> complex:
        """e^{i·angle}."""
        return complex(math.cos(angle), math.sin(angle))

    def join(self, re: float, im: float) -> complex:
        """re + i·im."""
        return complex(re, im)

    def regular(self, inverse: float, c1: complex, c2: complex) -> float:
        """1/(c1 × c2), or NaN."""
        return inverse if abs(inverse) * (abs(c1) * abs(c2)) < 1 / PARALLEL else math.nan


class Many:
    """Arrays over poses; what is the same in all of them may be a Python number."""

    sqrt = staticmethod(np.sqrt)

    def constant(self, z: complex) -> complex:
        """The constant itself."""
        return z

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""
        if not np.ndim(angle):
            return ONE.exp(angle)
        z = np.empty(np.shape(angle), complex)
        np.cos(angle, out=z.real)
        np.sin(angle, out=z.imag)
        return z

    def join(self, re: Number, im: Number) -> Number:
        """re + i·im."""
        z = np.empty(np.broadcast_shapes(np.shape(re), np.shape(im)), complex)
        z.real = re
        z.imag = im
        return z

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        """1/(c1 × c2), or NaN."""
        # the norms over the block are above the largest entry: in most blocks they say that no pose is near
        bound = np.vdot(inverse, inverse).real * np.vdot(c1, c1).real * np.vdot(c2, c2).real
        if bound < 1 / PARALLEL**2:
            return inverse
        return np.where(np.abs(inverse) * (np.abs(c1) * np.abs(c2)) < 1 / PARALLEL, inverse, np.nan)


class Folded:
    """A kind for two assemblies that meet in every pose: the root is zero, and its noise is left out."""

    def __init__(self, kind: Kind) -> None:
        self.exp, self.join, self.regular = kind.exp, kind.join, kind.regular
        self.constant = kind.constant

    def sqrt(self, x: Number) -> Number:
        """Zero."""
        return 0.0 * x


ONE, MANY = One(), Many()


def cross(a: Number, b: Number) -> Number:
    """The plane's vector product a_x·b_y − a_y·b_x.

    >>> cross(1 + 0j, 1j)
    1.0
    """
    return (a.conjugate() * b).imag


def dot(a: Number, b: Number) -> Number:
    """The scalar product a_x·b_x + a_y·b_y."""
    return (a.conjugate() * b).real


def plus(a: Number, b: Number) -> Number:
    """a + b, where None is zero."""
    return b if a is None else a if b is None else a + b


def minus(a: Number, b: Number) -> Number:
    """a − b, where None is zero."""
    return a if b is None else -b if a is None else a - b


def times(a: Number, b: Number) -> Number:
    """a·b, where None is zero; a factor of exactly 1 leaves the other as it is."""
    if a is None or b is None:
        return None
    if isinstance(a, float) and a == 1.0:
        return b
    return a if isinstance(b, float) and b == 1.0 else a * b


def xy(z: Complexes) -> Reals:
    """x + iy as rows (x, y), without a copy.

    >>> xy(np.array([1 + 2j]))
    array([[1., 2.]])
    """
    return np.ascontiguousarray(z).view(float).reshape(-1, 2)
