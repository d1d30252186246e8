"""Bounds of the rounding errors of influence coefficients and of least-squares corrections.

With r = A x + b at the computed x, the error is (AᴴA)⁻¹Aᴴr: what this is as computed, and what the roundings of
computing it can hide, by the componentwise perturbation bound of least squares (Å. Björck, BIT 31 (1991) 238-244),
|·| of every component,

    |δx| ≤ |(AᴴA)⁻¹ Aᴴ r| + |A⁺| (δA |x| + δb) + |(AᴴA)⁻¹| δAᴴ |r|,
    |δr| ≤ |A (AᴴA)⁻¹ Aᴴ r| + |I − A A⁺| (δA |x| + δb) + |A⁺ᴴ| δAᴴ |r|.

The same bound carries errors of the given data on, where they are known. The matrices stand in bounds only: nothing
is solved with AᴴA. Corrections under limits, and those of the minimax problem, are in `balancing.optimality`.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import adjoint, damping_norms, roundings
from balancing.influence import influence_coefficients
from balancing.qr import factors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Kind = TypeVar("Kind", np.float64, np.complex128)


class Bounds(NamedTuple):
    """Bounds of a solution (..., n) and of its residual (..., m)."""

    solution: Real
    residual: Real


def perturbed(a: Complex, b: Complex, x: Complex, r: Complex, da: Real, db: Real) -> Bounds:
    """Bound the errors of x, the least-squares solution of A x + b = r ≈ 0, and of r; da, db: errors of A and b."""
    lead = np.broadcast_shapes(a.shape[:-2], b.shape[:-1], x.shape[:-1])
    # rows in the order of their size, columns of like size: then each row of A⁺ keeps its digits
    q, upper, scale = factors(a)
    inverse: Complex = np.asarray(np.linalg.inv(upper) * scale[..., None], dtype=complex)
    pseudo = inverse @ adjoint(q)
    wrong = (da @ np.abs(x)[..., None])[..., 0] + db
    pull = (np.swapaxes(da, -1, -2) @ np.abs(r)[..., None])[..., 0]
    outside = np.eye(a.shape[-2]) - q @ adjoint(q)
    # how far x is from the solution as far as it can be seen; R⁻ᴴ first: what is left is small there
    off = np.matvec(inverse, np.matvec(adjoint(inverse), np.matvec(adjoint(a), r)))
    solution = np.abs(off) + np.matvec(np.abs(pseudo), wrong)
    solution = solution + np.matvec(np.abs(inverse @ adjoint(inverse)), pull)
    left = (
        np.abs(np.matvec(a, off))
        + np.matvec(np.abs(outside), wrong)
        + np.matvec(np.abs(adjoint(pseudo)), pull)
    )
    return Bounds(np.broadcast_to(solution, lead + x.shape[-1:]), np.broadcast_to(left, lead + r.shape[-1:]))


def influence_error(
    initial: ArrayLike,
    trials: ArrayLike,
    trial_masses: ArrayLike,
    *,
    reading_error: tuple[ArrayLike, ArrayLike] | None = None,
    mass_error: ArrayLike | None = None,
) -> Real:
    """Return a bound of the rounding error of `influence_coefficients`, (..., s, p), amplitude per kg.

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
    # (..., s, r)
    change = np.swapaxes(v - v0[..., None, :], -1, -2)
    c = roundings(t.shape[-1])
    off: Real = c * np.abs(change)
    if reading_error is not None:
        e0, e = (np.asarray(part, dtype=float) for part in reading_error)
        off = off + np.swapaxes(e + e0[..., None, :], -1, -2)
    of_masses = c * np.abs(t) + (0.0 if mass_error is None else np.asarray(mass_error, dtype=float))
    each = t[..., None, :, :]
    left = np.matvec(each, alpha) - change
    return perturbed(each, -change, alpha, left, of_masses[..., None, :, :], off).solution


class Solved(NamedTuple):
    """A problem with corrections as found, and bounds of the errors of its data; None: weights of one, exact data."""

    influence: Complex
    initial: Complex
    corrections: Complex
    weights: Real | None
    influence_error: Real | None
    initial_error: Real | None

    @property
    def data_errors(self) -> tuple[Real, Real]:
        """Bounds of the errors of coefficients and vibration, the rounding of the products with them included."""
        c = roundings(self.influence.shape[-1])
        of_influence = 0.0 if self.influence_error is None else self.influence_error
        of_initial = 0.0 if self.initial_error is None else self.initial_error
        return c * np.abs(self.influence) + of_influence, c * np.abs(self.initial) + of_initial

    @property
    def evaluation_error(self) -> Real:
        """By how much V + α w at these very corrections can be wrong, (..., s)."""
        size = np.abs(self.corrections)
        terms = np.abs(self.initial) + np.matvec(np.abs(self.influence), size)
        own = roundings(self.influence.shape[-1]) * terms
        if self.influence_error is not None:
            own = own + np.matvec(self.influence_error, size)
        return np.asarray(own if self.initial_error is None else own + self.initial_error)


def least_squares_bounds(solved: Solved, residual: Complex, ridge: float) -> Bounds:
    """Bound the errors of the corrections of a least-squares problem without limits, and of its residual."""
    alpha, v, w = solved.influence, solved.initial, solved.corrections
    da, db = solved.data_errors
    root = np.ones(v.shape) if solved.weights is None else np.sqrt(solved.weights)
    a, b, r = alpha * root[..., None], v * root, residual * root
    da, db = da * root[..., None], db * root
    if ridge:
        a, b, r, da, db = _damped(ridge, a, b, r, da, db, w)
    bounds = perturbed(a, b, w, r, da, db)
    safe = np.where(root > 0, root, 1.0)
    # a reading without weight takes no part: its residual follows the corrections
    follows = np.matvec(np.abs(alpha), bounds.solution)
    left = np.where(root > 0, np.minimum(bounds.residual[..., : v.shape[-1]] / safe, follows), follows)
    return Bounds(bounds.solution, left + solved.evaluation_error)


def _damped(
    ridge: float, a: Complex, b: Complex, r: Complex, da: Real, db: Real, w: Complex
) -> tuple[Complex, Complex, Complex, Real, Real]:
    """Return the problem with the rows λ‖α_p‖ w_p of `ridge` below it."""
    norms = ridge * damping_norms(a)
    of_norms = ridge * np.linalg.norm(da, axis=-2)
    lead = np.broadcast_shapes(a.shape[:-2], b.shape[:-1])

    def joined(one: NDArray[Kind], other: NDArray[Kind] | Real) -> NDArray[Kind]:
        return np.concatenate([np.broadcast_to(x, lead + x.shape[-2:]) for x in (one, other)], axis=-2)

    def longer(one: NDArray[Kind], other: NDArray[Kind] | Real) -> NDArray[Kind]:
        return joined(one[..., None], other[..., None])[..., 0]

    below, zeros = np.eye(a.shape[-1]), np.zeros(a.shape[-1])
    return (
        joined(a, norms[..., None] * below),
        longer(b, zeros),
        longer(r, norms * w),
        joined(da, of_norms[..., None] * below),
        longer(db, zeros),
    )
