"""Rounding errors of influence coefficients and of least-squares corrections: computed twice, with 16 and with 32 digits.

The second run (`balancing.second_run`) takes the data as they are written, or the floats as exact. Corrections under limits,
and those of the minimax problem, are in `balancing.optimality`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import damped, roundings
from balancing.influence import influence_coefficients
from balancing.second_run import smallest_squares
from dalembert.arithmetic.doubled import Doubled, doubled
from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.doubled_operations import part

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def influence_error(initial: ArrayLike, trials: ArrayLike, trial_masses: ArrayLike) -> Real:
    """Return the rounding error of `influence_coefficients`, (..., s, p), amplitude per kg.

    Parameters
    ----------
    initial, trials, trial_masses
        As given to `influence_coefficients`: (..., s), (..., r, s), (..., r, p).

    Returns
    -------
    ndarray
        |α - α₃₂| of the answers with 16 and with 32 digits, (..., s, p).

    Notes
    -----
    The coefficients of each sensor solve T α = V_j - V_0 by least squares. The readings are taken as exact; how their own
    errors grow is `condition_number(trial_masses)`.

    Examples
    --------
    A difference of two exact readings has all its digits, however little they differ:

    >>> error = influence_error([1.0], [[1.0 + 2**-40]], [[1.0]])
    >>> bool(error[0, 0] < 1e-14 * 2**-40)
    True
    """
    v0, v = np.asarray(initial, dtype=complex), np.asarray(trials, dtype=complex)
    t = np.asarray(trial_masses, dtype=complex)
    # (..., s, r)
    change = Vectors.of(np.swapaxes(v0[..., None, :] + 0 * v, -1, -2)) - Vectors.of(np.swapaxes(v, -1, -2))
    exact = smallest_squares(Vectors.of(t[..., None, :, :]), change)[0]
    return exact.off(influence_coefficients(v0, v, t))


class Problem(NamedTuple):
    """A problem with the corrections (..., p) that were found of its floats: coefficients and vibration in 32 digits."""

    influence: Vectors
    initial: Vectors
    corrections: Complex
    weights: Real | None
    floats: tuple[Complex, Complex]

    @property
    def moved(self) -> Real:
        """Return the error of V + α w at these corrections in floats, or its bound, (..., s)."""
        alpha, v = self.floats
        change = (self.initial - Vectors.of(v)).value + np.matvec(
            (self.influence - Vectors.of(alpha)).value, self.corrections
        )
        terms = np.abs(v) + np.matvec(np.abs(alpha), np.abs(self.corrections))
        return np.asarray(np.abs(change) + roundings(alpha.shape[-1]) * terms)

    def residual(self, corrections: Vectors) -> Vectors:
        """V + α w."""
        return self.initial + (self.influence * corrections[..., None, :]).sum()


def least_squares_again(problem: Problem, ridge: float | Doubled) -> Vectors:
    """Return the corrections of a least-squares problem without limits in 32 digits."""
    a: Any = problem.influence
    b, ridge = problem.initial, doubled(ridge)
    if problem.weights is not None:
        of_rows = DOUBLED.sqrt(Doubled(np.asarray(problem.weights, dtype=float)))
        a, b = a * part(of_rows, (..., None)), b * of_rows
    if ridge.high:
        of_columns: Any = DoubledArray.of(ridge)
        a = damped(a, of_columns)
        lead = np.broadcast_shapes(a.shape[:-2], b.shape[:-1])
        b = Vectors.joined(
            [b + Vectors.of(np.zeros((*lead, 1))), Vectors.of(np.zeros((*lead, a.shape[-1])))], axis=-1
        )
    return smallest_squares(a, b)[0]
