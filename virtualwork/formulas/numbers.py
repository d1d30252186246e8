"""What the formulas run on: Python numbers of one pose, arrays over many poses, or any numbers that behave so.

A formula needs +, −, ·, /, `abs`, `.real`, `.imag` and `.conjugate()` of its numbers. What Python has no operator for,
roots, e^{iθ}, a complex number of two real ones, a `Kind` gives; a state carries its kind (`kinds`).
"""

from __future__ import annotations

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
# of the mechanism's size: two points nearer than this have no direction from one to the other
TOGETHER = 64 * EPS


class Kind(Protocol):
    """The operations of one kind of number."""

    def sqrt(self, x: Number) -> Number:
        """The root; NaN of a negative number."""

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""

    def join(self, re: Number, im: Number) -> Number:
        """re + i·im."""

    def angle(self, z: Number) -> Number:
        """The angle of a complex number, in (−π, π]."""

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        """1/(c1 × c2); NaN where two columns are parallel to rounding, for the joint forces have no value there."""

    def inverse(self, length: Number, least: float) -> Number:
        """1/length; NaN of one that is not above the least, which has no direction."""

    def solve(self, cols: list[list[Number]], right: list[Number]) -> list[Number]:
        """Solve Σ column·x + right = 0, complex, for the real unknowns x of a group."""

    def transposed(self, cols: list[list[Number]], loads: list[Number]) -> list[Number]:
        """Solve Σ_c λ_c·column_c + load = 0 for the complex λ of a group's loops; NaN where they have no value."""


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


def leave_out(values: NDArray[Any], which: NDArray[np.bool_]) -> None:
    """Give no number where `which` is true: a complex one is NaN in both its parts, which NaN alone is not.

    >>> z = np.array([1 + 2j, 3j])
    >>> leave_out(z, np.array([False, True]))
    >>> xy(z)
    array([[ 1.,  2.],
           [nan, nan]])
    """
    values[which] = complex(np.nan, np.nan) if values.dtype.kind == "c" else np.nan


def xy(z: Complexes) -> Reals:
    """x + iy as rows (x, y), without a copy.

    >>> xy(np.array([1 + 2j]))
    array([[1., 2.]])
    """
    return np.ascontiguousarray(z).view(float).reshape(-1, 2)
