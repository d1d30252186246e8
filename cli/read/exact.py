"""Numbers as they are written, for the second run in 32 digits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import ulp

import numpy as np
from numpy.typing import ArrayLike

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_vectors import Vectors, doubled_array
from dalembert.quantities import decimals, exactly
from dalembert.tables.table import Numbers


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
    """A quantity of an option, in SI, as its decimals say.

    >>> quantity("0.1 mm", "length").high
    0.0001
    """
    parts = decimals(text, dimension)
    assert parts is not None
    return Doubled.of(exactly(*parts))


def turns(angle: Numbers) -> Vectors:
    """e^{iφ} of the angles of a column, (n,)."""
    return vectors([Fraction(1)] * len(angle.values), angle)


def vectors(sizes: Iterable[Fraction], angle: Numbers) -> Vectors:
    """Vectors of exact sizes at the angles of a column, (n,)."""
    exact: Sequence[Fraction] = angle.exact
    return Vectors.polar(doubled_array(sizes, (len(exact),)), exact, angle.unit, (len(exact),))
