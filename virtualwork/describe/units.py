"""The units of bare numbers in a mechanism's file, and messages about values; the units themselves: `dalembert.units`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from dalembert.decimals import Factor, times
from dalembert.errors import toml_text
from dalembert.quantities import decimals, exactly, expected, number_in_si
from dalembert.units import DIMENSIONS, LARGEST, composed
from virtualwork.describe import DescriptionError

LONGEST = 60
"""The length to which a message cuts a value."""


def wrong(where: str, value: Any, expected: str) -> DescriptionError:
    """The error of a value: its place, the value, and the expected one."""
    shown = toml_text(value)
    shown = shown if len(shown) <= LONGEST else f"{shown[: LONGEST - 3]}..."
    return DescriptionError(f"{where}: found {shown}, expected {expected}")


def text_of(value: Any, where: str) -> str:
    """Return a text of the file, or a bare number as a text: names may be numbers."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise wrong(where, value, "text")
    return str(value)


# the dimension of a table's column, the factor of its unit, what is written in its cells, and their numbers in SI
Written = tuple[str, Factor, Sequence[str], Sequence[float]]


class Decimals:
    """The numbers of a file as they are written there: what each is exactly, where a float is the nearest to it.

    Examples
    --------
    >>> units = Units({"length": "mm"})
    >>> units.decimals.rest("length", units.number(120.1, "length", "A"))
    1.5765166949677224e-18
    """

    def __init__(
        self, written: Mapping[tuple[str, float], tuple[Any, Factor]] = MappingProxyType({})
    ) -> None:
        self._written = dict(written)
        # of tables, which are long, on request alone
        self._columns: list[Written] = []
        self._rests: dict[tuple[str, float], float] = {}

    def note(self, dimension: str, number: float, value: Any, factor: Factor) -> None:
        """Note what a number is written as: a value of TOML, bare in the unit with this factor."""
        self._written[dimension, number] = value, factor

    def note_column(
        self, dimension: str, factor: Factor, texts: Sequence[str], numbers: Sequence[float]
    ) -> None:
        """Note what the numbers of a table's column, SI, are written as, in the unit with this factor."""
        self._columns.append((dimension, factor, texts, numbers))

    def and_also(self, rests: Iterable[tuple[str, float, float]]) -> Decimals:
        """These and further numbers: the dimension of each, its float, and the exact number less it."""
        more = Decimals(self._written)
        more._columns = self._columns[:]
        more._rests = self._rests | {(dimension, number): rest for dimension, number, rest in rests}
        return more

    def rest(self, dimension: str, number: float) -> float:
        """Return the exact number less its float; 0 if the file does not have it."""
        if self._columns:
            # on the first request: a second run alone asks
            self._rests, self._columns = _rests(self._columns) | self._rests, []
        if (dimension, number) in self._rests:
            return self._rests[dimension, number]
        if (dimension, number) not in self._written:
            return 0.0
        value, factor = self._written[dimension, number]
        parts = decimals(value, dimension, factor)
        if parts is None or not number:
            return 0.0
        exact = exactly(*parts)
        return float(exact - type(exact)(number))


def _rests(columns: Sequence[Written]) -> dict[tuple[str, float], float]:
    """What the numbers of tables are exactly, less their floats."""
    from decimal import Decimal

    from dalembert.arithmetic.splines import decimals

    rests: dict[tuple[str, float], float] = {}
    for dimension, factor, texts, numbers in columns:
        for number, exact in zip(numbers, decimals(texts, factor), strict=True):
            rests[dimension, number] = float(exact - Decimal(number))
    return rests


class Units:
    """The units of a file's bare numbers: lengths and angles in units of their own, everything else SI.

    Examples
    --------
    >>> units = Units({"length": "mm"})
    >>> units.number(120, "length", "A"), units.number("0.4 ft", "length", "A"), units.number("30 deg", "angle", "at")
    (0.12, 0.12192, 0.5235987755982988)
    """

    def __init__(self, bare: dict[str, Any]) -> None:
        self.factors: dict[str, Factor] = {}
        self.decimals = Decimals()
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
        self.decimals.note(dimension, number, value, self.factors.get(dimension, (1, 1)))
        return number

    def bare(self, si: float, dimension: str) -> float:
        """A number in SI as the file writes it without a unit."""
        numerator, denominator = self.factors.get(dimension, (1, 1))
        return times(si, denominator, numerator)

    def pair(self, value: Any, dimension: str, where: str) -> complex:
        """Two of them, [x, y], as x + iy."""
        if not isinstance(value, list) or len(value) != 2:
            raise wrong(where, value, "two numbers [x, y]")
        return complex(*(self.number(v, dimension, where) for v in value))


SI = Units({})
"""Metres and radians."""
