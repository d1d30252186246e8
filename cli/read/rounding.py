"""How far the numbers of a table can be from what its digits say once they are vectors, and vectors from numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.units import to_si

Real = NDArray[np.float64]

EPS = float(np.finfo(float).eps)


def vector_error(size: ArrayLike, angle: ArrayLike, unit: str) -> Real:
    """Bound the error of a vector of a size and an angle read as decimals: of a large angle the last place counts.

    A whole number of degrees is exact as it is written.
    """
    angles = np.asarray(angle, dtype=float)
    last = np.where((angles == np.rint(angles)) & (unit == "deg"), 0.0, np.spacing(np.abs(angles)) / 2)
    return np.asarray(np.abs(size) * (3 * EPS + to_si(last, "angle", unit)))


def size_error(vector: ArrayLike, bound: ArrayLike) -> Real:
    """Bound the error of a vector's size, once more converted to a unit."""
    return np.asarray(np.asarray(bound) + 3 * EPS * np.abs(vector))


def angle_error(vector: ArrayLike, bound: ArrayLike, degrees: ArrayLike) -> Real:
    """Bound the error of a vector's angle, degrees: half a turn where not even its direction is known."""
    size = np.asarray(np.abs(vector), dtype=float)
    error, shown = np.asarray(bound, dtype=float), np.asarray(degrees, dtype=float)
    directed = error < size
    turn = np.arcsin(np.where(directed, error / np.where(directed, size, 1.0), 0.0))
    turn = np.where(directed, turn, np.where(error > 0, np.pi, 0.0))
    return np.asarray(np.degrees(turn) + 2 * EPS * np.abs(shown))
