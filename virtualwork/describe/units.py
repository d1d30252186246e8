"""What the bare numbers of a mechanism's file mean, and what is wrong with a value; the units themselves: `dalembert.units`."""

from __future__ import annotations

from typing import Any

from dalembert.quantities import expected, number_in_si
from dalembert.units import DIMENSIONS, LARGEST, Factor, composed
from virtualwork.describe import DescriptionError


def wrong(where: str, value: Any, expected: str) -> DescriptionError:
    """The complaint that something else was expected."""
    return DescriptionError(f"{where}: found {value!r}, expected {expected}")


class Units:
    """What a file's bare numbers mean: its lengths and angles in units of their own, everything else SI.

    Examples
    --------
    >>> units = Units({"length": "mm"})
    >>> units.number(120, "length", "A"), units.number("0.4 ft", "length", "A"), units.number("30 deg", "angle", "at")
    (0.12, 0.12192, 0.5235987755982988)
    """

    def __init__(self, bare: dict[str, Any]) -> None:
        self.factors: dict[str, Factor] = {}
        for dimension, text in bare.items():
            unit = composed(str(text))
            if unit is None or unit[1] != DIMENSIONS[dimension].exponents:
                raise wrong(
                    f"[units] {dimension}",
                    text,
                    f"a unit of {dimension} such as '{'deg' if dimension == 'angle' else 'mm'}'",
                )
            self.factors[dimension] = unit[0]

    def number(self, value: Any, dimension: str, where: str) -> float:
        """One quantity: a bare number in the file's unit (length, angle) or SI, or a text with its unit."""
        number = number_in_si(value, dimension, self.factors.get(dimension, (1, 1)))
        if number is None or not abs(number) <= LARGEST:
            raise wrong(where, value, expected(dimension))
        return number

    def bare(self, si: float, dimension: str) -> float:
        """A number in SI as the file writes it without a unit."""
        numerator, denominator = self.factors.get(dimension, (1, 1))
        return si * denominator / numerator

    def pair(self, value: Any, dimension: str, where: str) -> complex:
        """Two of them, [x, y], as x + iy."""
        if not isinstance(value, list) or len(value) != 2:
            raise wrong(where, value, "two numbers [x, y]")
        return complex(*(self.number(v, dimension, where) for v in value))


SI = Units({})
"""Metres and radians."""
