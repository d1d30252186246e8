"""Numbers and quantities as people write them, in files, TOML and options: `120 mm`, `3000rpm`, `-1.5`."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from dalembert.decimals import Factor, decimal_to_si
from dalembert.units import (
    DIMENSIONS,
    LARGEST,
    LISTED,
    MINUS,
    UNITS,
    composed,
    find_unit,
    nearest_unit,
    unit_name,
)

if TYPE_CHECKING:
    from fractions import Fraction

_SPOKEN_DIMENSION = {
    "inertia": "moment of inertia",
    "speed": "angular speed",
    "velocity": "speed",
    "torsional stiffness": "torsional stiffness",
}


def expected(dimension: str) -> str:
    """Return an example of a value of this dimension: `a length such as '120 mm'`."""
    of = DIMENSIONS[dimension]
    if not of.example:
        return "a number"
    more = " or '700 rpm'" if dimension == "speed" else ""
    return f"{of.article} {_SPOKEN_DIMENSION.get(dimension, dimension)} such as '{of.example}'{more}"


# to fifty digits
PI = (31415926535897932384626433832795028841971693993751, 10**49)


def exactly(number: str, factor: Factor) -> Fraction:
    """A decimal number times a unit's factor, not rounded; of π, which an angle's factor has, fifty digits.

    Examples
    --------
    >>> exactly("0.3", (1, 1000)), float(exactly("180", (math.pi, 180)) - exactly("1", (math.pi, 1)))
    (Fraction(3, 10000), 0.0)
    """
    from fractions import Fraction

    def exact(part: float) -> Fraction:
        if isinstance(part, int):
            return Fraction(part)
        # the only irrational factor is π, times a ratio
        return Fraction(part / math.pi).limit_denominator(10**6) * Fraction(*PI)

    # what is below all floats is zero: its power of ten may have a billion digits
    return Fraction(number) * exact(factor[0]) / exact(factor[1]) if float(number) else Fraction(0)


def unit_ratio(unit: str, other: str) -> Fraction | None:
    """One unit in another; None where they do not measure the same.

    >>> unit_ratio("kN", "N"), float(unit_ratio("rpm", "rad_s")), unit_ratio("kg", "N_m")
    (Fraction(1000, 1), 0.10471975511965978, None)
    """
    own, wanted = composed(unit), composed(other)
    if own is None or wanted is None or own[1] != wanted[1]:
        return None
    return exactly("1", own[0]) / exactly("1", wanted[0])


def exactly_in_degrees(angle: Fraction) -> Fraction:
    """An angle, rad, in degrees: exact where it is written in degrees or turns.

    >>> exactly_in_degrees(exactly("0.25", (2 * math.pi, 1)))
    Fraction(90, 1)
    """
    return angle * 180 / type(angle)(*PI)


_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*\Z", re.ASCII | re.DOTALL)


# one mark between all thousands, another one for decimals
_WITH_THOUSANDS = r"[-+]?\d{1,3}(?:([^\d\w+-])\d{3})(?:\1\d{3})*(?:(?!\1)[.,]\d+)?"


def number_and_unit(text: str) -> tuple[str, str] | None:
    """Take a quantity apart: its decimals and the unit behind them as it is written; None where it begins with no number.

    >>> number_and_unit("2.5 N m"), number_and_unit("-3"), number_and_unit("m")
    (('2.5', 'N m'), ('-3', ''), None)
    """
    match = _QUANTITY.match(text.replace(MINUS, "-"))
    return None if match is None else (match[1], match[2])


def _quantity(text: str, dimension: str) -> tuple[str, Factor] | None:
    """The decimals of a quantity and the factor of its unit; None where text is no quantity of that dimension."""
    parts = number_and_unit(text)
    unit = composed(parts[1]) if parts and parts[1] else None
    if parts is None or unit is None:
        return None
    own, wanted = unit[1], DIMENSIONS[dimension].exponents
    # rad is a pure number: a torque may be N m/rad, but a length is never an angle
    loose = own[:3] == wanted[:3] and wanted[:3] != (0, 0, 0) and 0 in (own[3], wanted[3])
    loose = loose and dimension not in ("speed", "angular acceleration", "angular jerk")
    return (parts[0], unit[0]) if own == wanted or loose else None


def parse_number(text: str) -> float:
    """Read a finite decimal number; ValueError otherwise (NaN, inf, `1_000`, `0x10`, above 1e60)."""
    text = text.strip().replace(MINUS, "-")
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    value = float(text)
    if not abs(value) <= LARGEST:
        raise ValueError(text)
    return value


def number_expected(text: str) -> str:
    """Return the expected value in place of a text that `parse_number` refuses: a number, or a smaller one.

    >>> number_expected("five"), number_expected("1e300"), number_expected("1.234,5"), number_expected("10.5 g")
    ('a number', 'a number of at most 1e+60', 'a number without marks between its thousands', 'a number alone: its unit stands in the header')
    """
    if re.fullmatch(_WITH_THOUSANDS, text):
        return "a number without marks between its thousands"
    if (parts := number_and_unit(text.replace(",", "."))) and parts[1] and composed(parts[1]):
        return "a number alone: its unit stands in the header"
    try:
        large = abs(float(text)) > LARGEST and any(map(str.isdigit, text))
    except ValueError:
        large = False
    return f"a number of at most {LARGEST:g}" if large else "a number"


def is_number(text: str) -> bool:
    """Whether a text is a number and nothing else."""
    try:
        parse_number(text)
    except ValueError:
        return False
    return True


def parse_quantity(text: str, dimension: str) -> tuple[float, str]:
    """Read an option's value such as `3000rpm` or `30 g_mm`: the number and the unit behind it.

    Raises ValueError with a sentence that says what is wrong and which units there are.
    """
    names = ", ".join(LISTED[dimension])
    parts = number_and_unit(text)
    if parts is None:
        raise ValueError(f"'{text}' is not a number with a unit (units: {names})")
    value, suffix = float(parts[0]), parts[1]
    if not abs(value) <= LARGEST:
        raise ValueError(f"'{text}' is too large a number")
    suffix = unit_name(suffix)
    unit = find_unit(dimension, suffix)
    if unit is None:
        if not suffix:
            raise ValueError(f"'{text}' has no unit (units: {names})")
        if re.match(r",\d", suffix):
            raise ValueError(f"'{text}' has a comma in its number: expected a decimal point")
        raise ValueError(
            f"'{text}' has the unknown {dimension} unit '{suffix}' (units: {names}){nearest_unit(suffix, dimension)}"
        )
    return value, unit


def option_digits(text: str, dimension: str) -> tuple[str, Factor]:
    """Return the decimals of an option's value and the factor of its unit; ValueError as `parse_quantity`.

    >>> option_digits("20MM", "length")
    ('20', (1, 1000))
    """
    _, unit = parse_quantity(text, dimension)
    number = number_and_unit(text)
    assert number is not None
    return number[0], UNITS[dimension][unit]


def number_in_si(value: Any, dimension: str, factor: Factor = (1, 1)) -> float | None:
    """Read a value of a TOML file: a bare number in the unit with this factor, or a text with its unit.

    None where it is neither, infinity where it is too large.

    Examples
    --------
    >>> number_in_si("120 mm", "length"), number_in_si("0.1rev", "angle"), number_in_si("3 kg", "length")
    (0.12, 0.6283185307179586, None)
    """
    if isinstance(value, (int, float)) and not abs(value) <= LARGEST:
        # a whole number of TOML has no bound
        return math.inf
    parts = decimals(value, dimension, factor)
    return None if parts is None else decimal_to_si(*parts)


def decimals(value: Any, dimension: str, factor: Factor = (1, 1)) -> tuple[str, Factor] | None:
    """The decimals of a value of a TOML file and the factor of its unit; None where it is no number.

    >>> decimals("120 mm", "length"), decimals(0.3, "angle", (1, 1000))
    (('120', (1, 1000)), ('0.3', (1, 1000)))
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return repr(value), factor
    if not isinstance(value, str):
        return None
    parts = _quantity(value, dimension)
    if parts is None and is_number(value):
        return value.strip().replace(MINUS, "-"), factor
    return parts
