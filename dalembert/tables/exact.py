"""Numbers as they are written, for the second run in 32 digits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from math import pi, ulp
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from dalembert.angles import phasor
from dalembert.arithmetic.doubled import PI, Doubled
from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors
from dalembert.arithmetic.doubled_operations import doubled_array
from dalembert.quantities import exactly, option_digits
from dalembert.tables.table import Numbers
from dalembert.units import UNITS


def written(number: float) -> Fraction:
    """A number of an option, in SI, as the short decimal that was written; one that is none is the float.

    >>> written(0.1 + 0.2), written(1 / 3) == Fraction(1 / 3)
    (Fraction(3, 10), True)
    """
    text = f"{number:.15g}"
    return Fraction(text) if abs(float(text) - number) <= ulp(number) and len(text) < 15 else Fraction(number)


def writtens(numbers: ArrayLike) -> Doubled:
    """Numbers of options, in SI, as they were written; NaN stays."""
    array = np.asarray(numbers, dtype=float)
    there = np.isfinite(array)
    exact = doubled_array([written(x) for x in np.where(there, array, 0.0).ravel().tolist()], array.shape)
    return Doubled(np.where(there, exact.high, array), exact.low)


def quantity(text: str, dimension: str) -> Doubled:
    """A quantity of an option, in SI, as it is written.

    >>> quantity("0.1 mm", "length").high
    0.0001
    """
    return Doubled.of(exactly(*option_digits(text, dimension)))


def turns(angle: Numbers) -> Vectors:
    """e^{iφ} of the angles of a column, (n,)."""
    return vectors([Fraction(1)] * len(angle.values), angle)


def vectors(sizes: Iterable[Fraction], angle: Numbers) -> Vectors:
    """Vectors of exact sizes at the angles of a column, (n,)."""
    shape = (len(angle.values),)
    size, turned = (DoubledArray.of(doubled_array(x, shape)) for x in (sizes, angle.exact))
    polar: Callable[..., Any] = phasor
    return cast("Vectors", polar(size, turned, "deg" if angle.unit == "deg" else "rad"))


def array(numbers: ArrayLike) -> DoubledArray:
    """Numbers of options, in SI, as they were written, as a `DoubledArray`."""
    return DoubledArray.of(writtens(numbers))


def plain(numbers: ArrayLike) -> DoubledArray:
    """Numbers of a file that has no units, as the shortest decimals that are read as them."""
    values = np.asarray(numbers, dtype=float)
    return DoubledArray.of(doubled_array([Fraction(repr(x)) for x in values.ravel().tolist()], values.shape))


def rates(numbers: ArrayLike) -> DoubledArray:
    """Angular velocities or accelerations of options, in SI, as they were written: in radians, or in degrees or turns.

    >>> bool((rates(3000 * pi / 30) / np.pi).off(100.0) < 1e-28)
    True
    """
    values = np.atleast_1d(np.asarray(numbers, dtype=float))
    exact = array(values)
    for i, x in enumerate(values):
        degrees = x * (180 / pi)
        short = Fraction(f"{degrees:.13g}")
        if not exact.low[i] and abs(float(short) - degrees) <= 2 * ulp(degrees) and x != round(x):
            exact[i] = DoubledArray.of(Doubled.of(short / 180) * PI)
    return exact.reshape(np.shape(numbers))


def column(numbers: Numbers, rows: Sequence[int]) -> DoubledArray:
    """Rows of a column of a file, in SI, as they are written; what is blank is zero."""
    exact = _in_si(replace(numbers, values=np.nan_to_num(numbers.values[list(rows)])))
    return exact * pi / 180.0 if numbers.unit == "deg" else exact


LONG = 100
"""The number of rows from which a column is read as an array."""


def _in_si(numbers: Numbers) -> DoubledArray:
    """A column of a file, in SI, as it is written; degrees stay."""
    if len(numbers.values) < LONG:
        return DoubledArray.of(doubled_array(numbers.exact, numbers.values.shape))
    above, below = (1, 1) if numbers.unit == "deg" else UNITS[numbers.dimension][numbers.unit]
    exact: DoubledArray = long_column(numbers) * float(above) / float(below)
    return exact


def cosine_and_sine(angle: Numbers, rows: Sequence[int]) -> tuple[DoubledArray, DoubledArray]:
    """Cosines and sines of rows of a column of angles."""
    unit = turns(replace(angle, values=np.nan_to_num(angle.values[list(rows)])))
    return DoubledArray.of(unit.x), DoubledArray.of(unit.y)


def long_column(numbers: Numbers) -> DoubledArray:
    """A long column of a file, in its unit, as it is written: whole numbers over a power of ten, where they have 15 figures at most.

    >>> import numpy as np
    >>> x = long_column(Numbers("t_s", "s", np.array([0.1, 12.25]), "time"))
    >>> float(x.low[0]), float(x.low[1])
    (-5.551115123125783e-18, 0.0)
    """
    values = numbers.values
    for places in range(16):
        whole = np.rint(values * 10.0**places)
        if (np.abs(whole) < 2.0**53).all() and (whole / 10.0**places == values).all():
            exact: DoubledArray = DoubledArray(whole) / DoubledArray(10.0**places)
            return exact
    return plain(values)


def as_written(numbers: Numbers) -> DoubledArray:
    """A column of a file, in SI, as it is written; angles in degrees."""
    exact = _in_si(numbers)
    return exact * 180.0 / pi if numbers.dimension == "angle" and numbers.unit != "deg" else exact
