"""A decimal number times a ratio, rounded once: 7.1 g are 0.0071 kg, and 0.0071 kg are 7.1 g.

A float stands for the decimal that was written: of at most 15 figures exactly one float is read, and it is the shortest decimal
of that float. 7.1/1000 would be rounded twice, and a quarter of all decimals would be one place off. The decimal is a whole
number m over a power of ten, 10^k, so that the result is the quotient m·a/(10^k·b) of whole numbers. A float of more figures
comes from a computation and is itself multiplied and divided.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Factor = tuple[float, float]
Scaled = TypeVar("Scaled", float, complex, "NDArray[np.float64]", "NDArray[np.complex128]")

FIGURES = 15  # decimals of so many figures are all told apart by their floats
PLACES = 22  # the largest power of ten that is a float
WHOLE = 2.0**53  # whole numbers up to it are floats


def decimal_to_si(number: str, factor: Factor) -> float:
    """A decimal number times a unit's factor, with one rounding where the factor is a ratio of whole numbers.

    Examples
    --------
    >>> decimal_to_si("0.3", (1, 1000)), decimal_to_si("7.1", (1, 1000)), decimal_to_si("120", (1, 1000))
    (0.0003, 0.0071, 0.12)
    """
    value, (above, below) = float(number), factor
    # what is below all floats is zero: its power of ten may have a billion digits
    if not value or not math.isfinite(value):
        return value * above
    if not (isinstance(above, int) and isinstance(below, int)):
        return value * (above / below)
    whole, places = _parts(number)
    return _quotient(whole, places, above, below)


def _parts(number: str) -> tuple[int, int]:
    """A decimal number as a whole number and its number of decimal places: `2.5e-3` is 25 and 4."""
    mantissa, _, power = number.lower().partition("e")
    whole, _, part = mantissa.partition(".")
    return int(whole + part), len(part.rstrip()) - int(power or 0)


def _quotient(whole: int, places: int, above: int, below: int) -> float:
    """Whole numbers are divided with one rounding, however long they are."""
    up: int = 10 ** max(-places, 0)
    down: int = 10 ** max(places, 0)
    return whole * above * up / (below * down)


def times(value: Scaled, above: float, below: float) -> Scaled:
    """Numbers times above/below; those of at most 15 figures are the decimals that they show, and rounded once.

    Parameters
    ----------
    value : float, complex or array
    above, below : float
        The ratio; where one of them is no `int` it is irrational, and the result is rounded as floats are.

    Examples
    --------
    >>> 7.1 / 1000, times(7.1, 1, 1000), times(0.0071, 1000, 1)
    (0.0070999999999999995, 0.0071, 7.1)
    >>> times(1 / 3, 1, 1000) == 1 / 3 / 1000
    True
    """
    plain = value * above / below
    if above == below or not (isinstance(above, int) and isinstance(below, int)):
        return plain
    if isinstance(value, (int, float)):
        return _one(float(value), above, below)
    if isinstance(value, complex):
        return complex(times(value.real, above, below), times(value.imag, above, below))
    import numpy as np

    if value.dtype.kind == "c":
        result = np.empty(value.shape, dtype=complex)
        result.real, result.imag = (times(part, above, below) for part in (value.real, value.imag))
        return result
    return _many(value, plain, above, below)  # type: ignore[arg-type, return-value]


def shown(value: Scaled, above: float, below: float) -> Scaled:
    """Convert numbers from SI to the unit with the factor above/below, back to the decimal they were read from.

    If a decimal of at most 8 figures converts to the same number in SI, the result is that decimal.

    Examples
    --------
    A number of pounds-force has no short decimal in newtons.

    >>> lbf = (8896443230521, 2 * 10**12)
    >>> times(times(2.3, *lbf), *reversed(lbf)), shown(times(2.3, *lbf), *lbf)
    (2.3000000000000003, 2.3)
    """
    result = times(value, below, above)
    if not (isinstance(above, int) and isinstance(below, int)) or 10**PLACES % (above * below) == 0:
        return result
    import numpy as np

    parts, stored = (np.ascontiguousarray(np.atleast_1d(x)).view(float) for x in (result, value * 1.0))
    with np.errstate(all="ignore"):
        power = 10.0 ** (7.0 - np.floor(np.log10(np.abs(parts))))
        short = np.rint(parts * power) / power
        same = times(short, above, below) == stored
    shortest = np.where(same, short, parts).view(np.asarray(result).dtype).reshape(np.shape(result))
    return shortest if shortest.ndim else shortest.item()  # type: ignore[return-value]


def _one(value: float, above: int, below: int) -> float:
    if not value or not abs(value) < 10.0**FIGURES:
        return value * above / below
    if value.is_integer():
        return int(value) * above / below
    whole, places = _parts(float.__repr__(value))
    if places > PLACES or abs(whole) >= 10**FIGURES:
        return value * above / below
    return _quotient(whole, places, above, below)


def _many(
    value: NDArray[np.float64], plain: NDArray[np.float64], above: int, below: int
) -> NDArray[np.float64]:
    import numpy as np

    x, result = np.ravel(np.asarray(value, dtype=float)), np.ravel(np.array(plain, dtype=float))
    exponent = x.view(np.int64) >> 52 & _EXPONENT
    power = _powers(0)[exponent]
    whole = np.rint(x * power)
    short = whole / power == x
    big = np.flatnonzero(short & (np.abs(whole) >= 10.0**FIGURES))
    short[big] = (np.rint(whole[big] / 10.0) * 10.0 == whole[big]) & (np.abs(x[big]) < 10.0**FIGURES)
    by, over = above // math.gcd(above, below), below // math.gcd(above, below)
    if by == 1 or over == 1:
        tens = len(str(over)) - len(str(by))
        if max(by, over) == 10 ** abs(tens):
            quotient = whole / _powers(tens)[exponent]
            np.copyto(result, quotient, where=short & (quotient == quotient))
            short &= quotient != quotient
    left = np.flatnonzero(short)
    for places in range(PLACES + 1):
        if not len(left):
            break
        power = 10**places
        whole = np.rint(x[left] * float(power))
        match = whole / float(power) == x[left]
        here, whole, left = left[match], whole[match], left[~match]
        common = math.gcd(above, below * power)
        by, over = above // common, below * power // common
        # one rounding where product and divisor are floats without one
        result[here] = whole * by / over
        long = np.abs(whole) * by >= WHOLE if over == float(over) else np.ones(len(here), dtype=bool)
        result[here[long]] = [n * by / over for n in map(int, whole[long].tolist())]
    return result.reshape(np.shape(plain))


_EXPONENT = 2047  # eleven bits of a float


@cache
def _powers(tens: int) -> NDArray[np.float64]:
    """For the exponent of a float the power of ten 10^k that makes of its decimals a whole number, times 10^tens.

    The whole number has 15 or 16 figures: where the decimal has at most 15, it is one below 4e15. NaN where there is none.
    """
    import numpy as np

    powers = np.full(_EXPONENT + 1, math.nan)
    for exponent in range(-80, 51):
        places = min(PLACES, math.floor(FIGURES + 0.6 - exponent * math.log10(2.0)))
        if places >= 0 and 0 <= places + tens <= PLACES:
            powers[exponent + 1022] = float(10 ** (places + tens))
    return powers
