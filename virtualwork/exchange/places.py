"""Places of a drawing: coordinates that a file gives as decimals are exact, so that the difference of two of them is rounded once."""

from __future__ import annotations

import cmath
import math
from fractions import Fraction

from dalembert.documents.values import exact


class Exact(complex):
    """A place x + iy whose coordinates are exact fractions; the difference of two such places is exact too.

    >>> a, b = place(0.3, 0), place(0.1, 0)
    >>> (a - b).real, complex(0.3) - complex(0.1)
    (0.2, (0.19999999999999998+0j))
    """

    x: Fraction
    y: Fraction

    def __new__(cls, x: Fraction, y: Fraction) -> Exact:
        """Return a place from its two coordinates."""
        z = super().__new__(cls, float(x), float(y))
        z.x, z.y = x, y
        return z

    def __sub__(self, other: complex) -> complex:
        """Return the way from another place."""
        if isinstance(other, Exact):
            return Exact(self.x - other.x, self.y - other.y)
        return complex(self) - other

    def __eq__(self, other: object) -> bool:
        """Compare exactly, where both are exact."""
        return (self.x, self.y) == (other.x, other.y) if isinstance(other, Exact) else complex(self) == other

    # equal fractions are equal floats
    __hash__ = complex.__hash__


ORIGIN = Exact(Fraction(0), Fraction(0))


def coordinates(z: complex) -> tuple[Fraction, Fraction]:
    """Return the exact coordinates of a place; floats stand for their shortest decimals."""
    return (z.x, z.y) if isinstance(z, Exact) else (exact(z.real), exact(z.imag))


def place(x: float, y: float) -> Exact:
    """Return the place of two decimals; ValueError where one is no finite number."""
    return Exact(exact(x), exact(y))


def apart(a: complex, b: complex) -> float:
    """Return the distance of two places."""
    way = b - a
    return math.hypot(way.real, way.imag)


def direction(a: complex, b: complex) -> float:
    """Return the direction from one place to another, degrees from the x-axis."""
    return math.degrees(cmath.phase(b - a))
