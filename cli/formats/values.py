"""What the files of other programs hold: so much at most, finite numbers, and decimals that stay exact.

Coordinates that a file gives as decimals are exact fractions, so that the difference of two of them is rounded once.
"""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from typing import Any

from dalembert.errors import DataError, quote
from dalembert.units import LARGEST

# bytes
LARGEST_FILE = 10_000_000
# elements of XML, values of JSON, lines of text
MOST_PARTS = 20_000
# links of a mechanism or a robot
MOST_LINKS = 1000


def check_count(file: str, count: int, what: str, most: int = MOST_PARTS) -> None:
    """Refuse a file that holds too many of something."""
    if count > most:
        raise DataError(f"{file}: {count} {what}: expected at most {most}")


def values_in(document: Any) -> int:
    """Return how many objects, lists and their values a JSON document has.

    >>> values_in({"a": [1, 2], "b": {}})
    5
    """
    waiting, count = [document], 0
    while waiting:
        value = waiting.pop()
        count += 1
        if isinstance(value, list | dict):
            waiting += value.values() if isinstance(value, dict) else value
    return count


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


def exact(value: float) -> Fraction:
    """Return the decimal that a number was written as; ValueError where it is no finite number.

    >>> float(exact(0.3) - exact(0.1))
    0.2
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"found {value!r}, expected a finite number")
    return Fraction(repr(value))


def place(x: float, y: float) -> Exact:
    """Return the place of two decimals; ValueError where one is no finite number."""
    return Exact(exact(x), exact(y))


def damaged(file: str, where: str, value: object, expected: str) -> DataError:
    """Return the error of a file: the place, the value there, the expected value."""
    return DataError(f"{file}: {where}: found {quote(str(value))}, expected {expected}")


def finite(file: str, where: str, word: object) -> float:
    """Return the finite number that a word is; DataError names the place where it is none."""
    try:
        value = float(str(word).replace("_", " "))
        exact(value)
    except ValueError:
        raise damaged(file, where, word, "a finite number") from None
    return value


def objects(file: str, where: str, value: Any) -> list[dict[str, Any]]:
    """Return the objects of a JSON list, or of an object by their ids; none where there is no value."""
    if isinstance(value, dict):
        value = [{"id": k} | v if isinstance(v, dict) else v for k, v in value.items()]
    value = [] if value is None else value
    if not isinstance(value, list) or not all(isinstance(e, dict) for e in value):
        raise damaged(file, where, value, "a list of objects")
    return value


def apart(a: complex, b: complex) -> float:
    """Return the distance of two places."""
    way = b - a
    return math.hypot(way.real, way.imag)


def direction(a: complex, b: complex) -> float:
    """Return the direction from one place to another, degrees from the x-axis."""
    return math.degrees(cmath.phase(b - a))
