"""How large the error of an answer is, from two solutions of different tolerance, and which tolerance is tried next.

The errors of the steps add up, and the motion itself makes them grow. With tolerances a ratio r apart the error of the
finer solution is about r times that of the coarser, and their distance is that of the coarser. The estimate is ten
times that, at most the distance itself, for the errors of the steps do not add up in just the same way.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals

# the tolerance of a step over the accuracy asked for, at first; between two solutions
FIRST, APART = 0.1, 0.03
# of the estimate
SAFETY = 10.0
# below which no tolerance makes a difference; below which rounding has its share in what two solutions differ by
LEAST, SMALL = 1e-15, 1e-13
# an error of the inputs beyond which nothing is known of what hangs on them
UNKNOWN = 0.1
# solutions at most, until the estimate meets the accuracy
TRIES = 6


def share(ratio: Any, tolerance: Any) -> Any:
    """Of the distance of two solutions what the finer one may err by; all of it where rounding has its share.

    >>> float(share(0.03, 1e-10)), float(share(1e-4, 1e-14))
    (0.3, 1.0)
    """
    return np.where(np.greater(tolerance, SMALL), np.minimum(1.0, SAFETY * np.asarray(ratio)), 1.0)[()]


def spread(fine: Reals, coarse: Reals, of: Any) -> Reals:
    """The error of a quantity over times, the last axis but the inputs': the largest so far, and its rounding."""
    return np.asarray(np.maximum.accumulate(np.abs(fine - coarse) * of, axis=-2) + 4 * EPS * np.abs(fine))


def finer(tolerance: Any, accuracy: float, error: Any) -> Any:
    """The tolerance that should meet an accuracy, where one has come to an error."""
    wanted = 0.3 * accuracy / np.maximum(error, 1e-300)
    return np.maximum(LEAST, tolerance * np.minimum(0.3, np.maximum(1e-4, wanted)))[()]
