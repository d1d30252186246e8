"""Rounding errors of influence coefficients and of least-squares corrections: computed twice, with 16 and with 32 digits.

The second run (`balancing.second_run`) takes the data as exact. Where bounds δA, δb of their own errors are known, these
are carried on, to first order, by the componentwise perturbation bound of least squares (Å. Björck, BIT 31 (1991) 238-244),
|·| of every component,

    |δx| ≤ |A⁺| (δA |x| + δb) + |(AᴴA)⁻¹| δAᴴ |r|,
    |δr| ≤ |I − A A⁺| (δA |x| + δb) + |A⁺ᴴ| δAᴴ |r|.

The matrices stand in bounds only: nothing is solved with AᴴA. Corrections under limits, and those of the minimax
problem, are in `balancing.optimality`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import adjoint, damping_norms, roundings
from balancing.influence import influence_coefficients
from balancing.qr import factors
from balancing.second_run import smallest_squares
from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.doubled_vectors import Vectors, part, total

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Bounds(NamedTuple):
    """Bounds of a solution (..., n) and of its residual (..., m)."""

    solution: Real
    residual: Real


def carried(a: Complex, x: Complex, r: Complex, da: Real, db: Real) -> Bounds:
    """Bound what errors da of A and db of b do to x, the least-squares solution of A x + b = r ≈ 0, and to r."""
    lead = np.broadcast_shapes(a.shape[:-2], r.shape[:-1], x.shape[:-1])
    # rows in the order of their size, columns of like size: then each row of A⁺ keeps its digits
    q, upper, scale = factors(a)
    inverse: Complex = np.asarray(np.linalg.inv(upper) * scale[..., None], dtype=complex)
    pseudo = inverse @ adjoint(q)
    wrong = (da @ np.abs(x)[..., None])[..., 0] + db
    pull = (np.swapaxes(da, -1, -2) @ np.abs(r)[..., None])[..., 0]
    outside = np.eye(a.shape[-2]) - q @ adjoint(q)
    solution = np.matvec(np.abs(pseudo), wrong) + np.matvec(np.abs(inverse @ adjoint(inverse)), pull)
    left = np.matvec(np.abs(outside), wrong) + np.matvec(np.abs(adjoint(pseudo)), pull)
    return Bounds(np.broadcast_to(solution, lead + x.shape[-1:]), np.broadcast_to(left, lead + r.shape[-1:]))


def influence_error(
    initial: ArrayLike,
    trials: ArrayLike,
    trial_masses: ArrayLike,
    *,
    reading_error: tuple[ArrayLike, ArrayLike] | None = None,
    mass_error: ArrayLike | None = None,
) -> Real:
    """Return the rounding error of `influence_coefficients`, (..., s, p), amplitude per kg.

    Parameters
    ----------
    initial, trials, trial_masses
        As given to `influence_coefficients`: (..., s), (..., r, s), (..., r, p).
    reading_error
        Bounds of the errors of the readings, (initial, trials); None: they are exact. Where a trial run hardly
        differs from the initial one they, and not the arithmetic, are what matters.
    mass_error
        Bounds of the errors of the trial masses, (..., r, p), kg; None: exact.

    Notes
    -----
    The coefficients of each sensor solve T α = V_j - V_0 by least squares, see the module. How readings' own errors
    grow is `condition_number(trial_masses)`.

    Examples
    --------
    A difference of two exact readings has all its digits, however little they differ:

    >>> bound = influence_error([1.0], [[1.0 + 2**-40]], [[1.0]])
    >>> bool(bound[0, 0] < 1e-14 * 2**-40)
    True
    >>> float(influence_error([1.0], [[1.0 + 2**-40]], [[1.0]], reading_error=([1e-16], [[1e-16]]))[0, 0].round(17))
    2e-16
    """
    v0, v = np.asarray(initial, dtype=complex), np.asarray(trials, dtype=complex)
    t = np.asarray(trial_masses, dtype=complex)
    alpha = influence_coefficients(v0, v, t)
    each = t[..., None, :, :]
    # (..., s, r)
    exact = Vectors.of(np.swapaxes(v0[..., None, :] + 0 * v, -1, -2)) - Vectors.of(np.swapaxes(v, -1, -2))
    error = smallest_squares(Vectors.of(each), exact)[0].apart(alpha)
    if reading_error is None and mass_error is None:
        return error
    off: Real = np.zeros(exact.shape)
    if reading_error is not None:
        e0, e = (np.asarray(part, dtype=float) for part in reading_error)
        off = off + np.swapaxes(e + e0[..., None, :], -1, -2)
    of_masses = np.zeros(t.shape) if mass_error is None else np.asarray(mass_error, dtype=float)
    left = np.matvec(each, alpha) - np.swapaxes(v - v0[..., None, :], -1, -2)
    return np.asarray(error + carried(each, alpha, left, of_masses[..., None, :, :], off).solution)


class Solved(NamedTuple):
    """A problem with corrections as found, and bounds of the errors of its data; None: weights of one, exact data."""

    influence: Complex
    initial: Complex
    corrections: Complex
    weights: Real | None
    influence_error: Real | None
    initial_error: Real | None

    @property
    def residual(self) -> Complex:
        """V + α w."""
        return np.asarray(self.initial + np.matvec(self.influence, self.corrections))

    @property
    def data_errors(self) -> tuple[Real, Real]:
        """Bounds of the errors of coefficients and vibration; zero where these are exact."""
        of_influence, of_initial = self.influence_error, self.initial_error
        return (
            np.zeros(self.influence.shape) if of_influence is None else of_influence,
            np.zeros(self.initial.shape) if of_initial is None else of_initial,
        )

    @property
    def carried_error(self) -> Real:
        """By how much errors of the data move V + α w at these very corrections, (..., s)."""
        da, db = self.data_errors
        return np.asarray(np.matvec(da, np.abs(self.corrections)) + db)

    @property
    def evaluation_error(self) -> Real:
        """By how much V + α w at these very corrections can be wrong, (..., s)."""
        terms = np.abs(self.initial) + np.matvec(np.abs(self.influence), np.abs(self.corrections))
        return np.asarray(roundings(self.influence.shape[-1]) * terms + self.carried_error)


def least_squares_bounds(solved: Solved, residual: Complex, ridge: float) -> Bounds:
    """Return the errors of the corrections of a least-squares problem without limits, and of its residual."""
    alpha, v, w = solved.influence, solved.initial, solved.corrections
    exact, at = Vectors.of(alpha), Vectors.of(v)
    a, b = exact, at
    if solved.weights is not None:
        of_rows = DOUBLED.sqrt(Doubled(np.asarray(solved.weights, dtype=float)))
        a, b = a * part(of_rows, (..., None)), b * of_rows
    if ridge:
        a, b = _damped(ridge, a, b)
    true = smallest_squares(a, b)[0]
    bounds = Bounds(true.apart(w), (at + (exact * true[..., None, :]).total()).apart(residual))
    if solved.influence_error is None and solved.initial_error is None:
        return bounds
    root = np.ones(v.shape) if solved.weights is None else np.sqrt(solved.weights)
    da, db = solved.data_errors
    own, r = a.value, residual * root
    if ridge:
        norms = ridge * damping_norms(alpha * root[..., None])
        r = np.concatenate([r, np.broadcast_to(norms * w, (*r.shape[:-1], w.shape[-1]))], axis=-1)
    of_a, of_b = np.zeros(own.shape), np.zeros(r.shape)
    of_a[..., : v.shape[-1], :], of_b[..., : v.shape[-1]] = da * root[..., None], db * root
    if ridge:
        of_a[..., v.shape[-1] :, :] = (
            ridge * np.linalg.norm(da * root[..., None], axis=-2)[..., None] * np.eye(w.shape[-1])
        )
    more = carried(own, w, r, of_a, of_b)
    safe = np.where(root > 0, root, 1.0)
    # a reading without weight takes no part: its residual follows the corrections
    follows = np.matvec(np.abs(alpha), more.solution)
    left = np.where(root > 0, np.minimum(more.residual[..., : v.shape[-1]] / safe, follows), follows)
    return Bounds(bounds.solution + more.solution, bounds.residual + left + solved.carried_error)


def _damped(ridge: float, a: Vectors, b: Vectors) -> tuple[Vectors, Vectors]:
    """Return the problem with the rows λ‖α_p‖ w_p of `ridge` below it."""
    norms, planes = DOUBLED.sqrt(total(a.square, -2)), a.shape[-1]
    given = norms.high > 0
    norms = Doubled(np.where(given, norms.high, damping_norms(a.value)), np.where(given, norms.low, 0.0))
    below = part(norms * ridge, (..., None)) * np.eye(planes)
    lead = np.broadcast_shapes(a.shape[:-2], b.shape[:-1])

    def spread(z: Vectors, *own: int) -> Vectors:
        return z + Vectors.of(np.zeros((*lead, *own)))

    rows = Vectors(below, below * 0.0)
    return (
        Vectors.joined([spread(a, *a.shape[-2:]), spread(rows, planes, planes)], axis=-2),
        Vectors.joined([spread(b, b.shape[-1]), Vectors.of(np.zeros((*lead, planes)))], axis=-1),
    )
