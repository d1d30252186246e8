"""Numbers and ranges as they are written: as they are shown, in SI, and exactly; each comes from the decimals, none from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.decimals import Factor, decimal_to_si, times
from dalembert.quantities import exactly, exactly_in_degrees
from dalembert.units import UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.arithmetic.doubled import Doubled

    Reals = NDArray[np.float64]

DEGREES = UNITS["angle"]["deg"]
ROWS = np.dtype([("shown", float), ("si", float), ("rest", float)])
"""Numbers of many rows, with the fields of `Written`."""


class Written(NamedTuple):
    """A number.

    Attributes
    ----------
    shown : float
        SI, but degrees of an angle.
    si : float
    rest : float
        The exact number in SI less its float.
    """

    shown: float
    si: float
    rest: float

    @classmethod
    def of(cls, digits: str, factor: Factor, *, is_angle: bool) -> Written:
        """Return a decimal number in the unit with this factor.

        >>> Written.of("60", DEGREES, is_angle=True)[:2], Written.of("0.3", (1, 1), is_angle=True)[1]
        ((60.0, 1.0471975511965976), 0.3)
        """
        # the sum has no −0
        si, exact = decimal_to_si(digits, factor) + 0.0, exactly(digits, factor)
        shown = si
        if is_angle:
            shown = float(digits) + 0.0 if factor == DEGREES else float(exactly_in_degrees(exact))
        return cls(shown, si, float(exact - type(exact)(si)))


def written(row: NDArray[Any]) -> list[Written]:
    """Return the numbers of a row."""
    return [Written(*each) for each in row.tolist()]


class Steps(NamedTuple):
    """A range in equal steps: (first + i·each)/below for i from 0 to n − 1, each the nearest double.

    >>> Steps(0, 1, 10, 4).at(np.arange(4))
    array([0. , 0.1, 0.2, 0.3])
    """

    first: int
    each: int
    below: int
    n: int

    def at(self, i: NDArray[np.intp]) -> Reals:
        """The values at some places."""
        if self._fits:
            # one rounding, that of the division
            return np.asarray((self.first + i * self.each) / self.below)
        return np.array([(self.first + k * self.each) / self.below for k in i.tolist()])

    def exact(self, i: NDArray[np.intp]) -> Doubled:
        """The values at some places in 32 digits."""
        from fractions import Fraction

        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_operations import doubled_array

        if self._fits:
            return Doubled((self.first + i * self.each).astype(float)) / float(self.below)
        return doubled_array([Fraction(self.first + k * self.each, self.below) for k in i.tolist()], i.shape)

    @property
    def _fits(self) -> bool:
        """Whether doubles hold the whole numbers exactly."""
        return max(abs(self.first), abs(self.first + (self.n - 1) * self.each), self.below) < 2**53


class Range(NamedTuple):
    """A range of equal steps in the unit with this factor.

    Attributes
    ----------
    steps : Steps
    factor : pair
    is_angle : bool
    """

    steps: Steps
    factor: Factor
    is_angle: bool

    def at(self, i: NDArray[np.intp]) -> tuple[Reals, Reals]:
        """Return the numbers at some places as they are shown, and in SI."""
        numbers, (num, den) = self.steps.at(i), self.factor
        si = times(numbers, num, den) if isinstance(num, int) else numbers * (num / den)
        if not self.is_angle or self.factor == DEGREES:
            return (numbers if self.is_angle else si), si
        from dalembert.arithmetic.doubled import PI

        return (self.exact(i) * 180.0 / PI).value, si

    def exact(self, i: NDArray[np.intp]) -> Doubled:
        """Return the numbers at some places in 32 digits, SI."""
        from dalembert.arithmetic.doubled import Doubled

        return self.steps.exact(i) * Doubled.of(exactly("1", self.factor))
