"""Numbers and points as they come from Python: floats and x + iy, of any type that has real numbers; the rest is refused."""

from __future__ import annotations

from cmath import isfinite
from collections.abc import Mapping, Sequence, Set
from math import inf
from numbers import Real

from virtualwork.describe import DescriptionError

Point = complex | tuple[float, float] | Sequence[float]


def as_point(value: Point, where: str = "", name: str = "") -> complex:
    """Read a point of the plane, `x + iy` or `(x, y)`, as a complex number; its place and its name are for the message.

    >>> as_point((3, 4))
    (3+4j)

    Raises
    ------
    DescriptionError
        It is neither, or not finite.
    """
    if type(value) is not complex and getattr(value, "ndim", None) == 0:
        # of numpy
        value = value.item()  # type: ignore[union-attr]
    if isinstance(value, complex):
        # a number that varies stays what it is
        point = value
    elif isinstance(value, Real):
        point = complex(value)
    else:
        try:
            if isinstance(value, str | Set | Mapping):
                # a text of two letters is no point either, and a set has no order
                raise TypeError
            x, y = value
            point = joined(x, y)
        except (TypeError, ValueError):
            raise DescriptionError(
                f"{_at(where, name)}expected a point (x, y) or x + iy, found {value!r}"
            ) from None
    if not isfinite(point):
        raise DescriptionError(f"{_at(where, name)}expected finite coordinates, found {value!r}")
    return point


def joined(x: float, y: float) -> complex:
    """x + iy, of numbers that vary too.

    >>> joined(3, 4)
    (3+4j)
    """
    plain = isinstance(x, Real) and isinstance(y, Real)
    return complex(x, y) if plain else as_number(x) + 1j * as_number(y)


def as_number(value: float, where: str = "") -> float:
    """Read a finite real number as a float; one that varies stays what it is.

    Parameters
    ----------
    value : float
        Of any type of real numbers; no text, for numbers in Python have no units.
    where : str
        Its place for the message.

    Raises
    ------
    DescriptionError

    Examples
    --------
    >>> as_number(3)
    3.0
    >>> as_number("700 rpm", "Input speed")
    Traceback (most recent call last):
    virtualwork.describe.DescriptionError: Input speed: found '700 rpm', expected a finite real number (SI units, radians)
    """
    if type(value) is float and isfinite(value):
        return value
    if isinstance(value, complex) and type(value) is not complex and not hasattr(value, "dtype"):
        return value
    try:
        kind: str = getattr(getattr(value, "dtype", None), "kind", "f")
        axes: int = getattr(value, "ndim", False)
        # numpy takes the real part of a complex number, nanoseconds of a time, and a row of one number
        if isinstance(value, str | bytes | complex) or kind not in "biufO" or axes:
            raise TypeError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = inf
    if not abs(number) < inf:
        raise DescriptionError(
            f"{_at(where)}found {value!r}, expected a finite real number (SI units, radians)"
        ) from None
    return number


def _at(where: str, name: str = "") -> str:
    return f"{where}{'.' * bool(name)}{name}: " if where else ""
