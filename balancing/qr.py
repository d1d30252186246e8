"""Least squares by QR: columns scaled by powers of two, rows in the order of their size.

Each row's own digits are kept (Cox and Higham, BIT 38 (1998) 34-50); the normal equations, which square the condition
number, are never formed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import (
    DependentPlanes,
    columns_scaled,
    damping_norms,
    require_independent,
    threshold,
)

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def smallest_squares(a: Complex, b: Complex, ridge: float = 0.0) -> Complex:
    """Return w (..., p) with Σ|b + a w|² + λ² Σ_p ‖a_p‖² |w_p|² least.

    Parameters
    ----------
    a, b
        Coefficients (..., s, p) and readings (..., s), complex, weighted already.
    ridge
        λ.

    Raises
    ------
    DependentPlanes
        The readings do not tell the planes apart.

    Notes
    -----
    The readings go through the factorisation as a last column, [a b] = Q [R c; 0 ρ]: c is their part in Q's
    coordinates, without Q (Golub and Van Loan, Matrix Computations, 4th ed., section 5.3.3).

    Examples
    --------
    >>> w = smallest_squares(np.array([[3, -2], [5, -2], [5, -3]], complex), np.array([1, -1, 0], complex))
    >>> (w.real * 21).round(12)
    array([17., 31.])
    """
    planes = a.shape[-1]
    scaled, scale = columns_scaled(a)
    if ridge:
        norms = damping_norms(scaled)
        scaled = np.concatenate([scaled, ridge * norms[..., None] * np.eye(planes)], axis=-2)
        b = np.concatenate([b, np.zeros((*b.shape[:-1], planes))], axis=-1)
    readings = scaled.shape[-2]
    if readings < planes:
        require_independent(scaled, scale, readings, planes, "readings", DependentPlanes)
    lead = np.broadcast_shapes(scaled.shape[:-2], b.shape[:-1])
    # a row of zeros where there are no more readings than planes: R is square then too
    both = np.zeros((*lead, max(readings, planes + 1), planes + 1), dtype=complex)
    both[..., :readings, :planes], both[..., :readings, planes] = scaled, b
    order = np.argsort(-np.abs(both[..., :planes]).max(axis=-1), axis=-1, kind="stable")
    both = both[order] if not lead else np.take_along_axis(both, order[..., None], axis=-2)
    both = np.asarray(np.linalg.qr(both, mode="r"))
    # [R c; 0 1]⁻¹ = [R⁻¹ -R⁻¹c; 0 1]: the solution, and what R⁻¹ tells of the planes' dependence
    both[..., planes, planes] = 1.0
    try:
        inverse = np.linalg.inv(both)
    except np.linalg.LinAlgError:
        inverse = np.full_like(both, np.nan)
    r = both[..., :planes, :planes]
    # σ_max/σ_min ≤ p² max|R| max|R⁻¹|: the singular values are worked out only where that does not decide
    worst = np.abs(r).max() * np.abs(inverse[..., :planes, :planes]).max()
    if not worst * planes**2 * threshold(readings, planes) < 1:
        require_independent(r, scale, readings, planes, "readings", DependentPlanes)
    return np.asarray(inverse[..., :planes, planes] * scale + 0.0, dtype=complex)


def factors(a: Complex) -> tuple[Complex, Complex, Real]:
    """Return Q (..., m, n) in the order of a's rows, R (..., n, n) and the scale (..., n) of a·diag(scale) = Q R."""
    scaled, scale = columns_scaled(a)
    order = np.argsort(-np.abs(scaled).max(axis=-1), axis=-1, kind="stable")
    q, r = np.linalg.qr(np.take_along_axis(scaled, order[..., None], axis=-2))
    return np.take_along_axis(q, np.argsort(order, axis=-1)[..., None], axis=-2), r, scale
