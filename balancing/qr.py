"""Least squares by QR: columns scaled by powers of two, rows in the order of their size.

Each row's own digits are kept (Cox and Higham, BIT 38 (1998) 34-50); the normal equations, which square the condition
number, are never formed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import (
    DependentPlanes,
    adjoint,
    columns_scaled,
    damped,
    require_independent,
    threshold,
)
from balancing.triangle import triangle
from dalembert.arithmetic.shapes import as_vectors, is_doubled

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def smallest_squares(a: Complex, b: Complex, ridge: float = 0.0) -> tuple[Complex, Complex]:
    """Return w (..., p) with Σ|b + a w|² + λ² Σ_p ‖a_p‖² |w_p|² least, and the triangle R (..., p, p) of the scaled columns.

    Parameters
    ----------
    a, b
        Coefficients (..., s, p) and readings (..., s), complex, weighted already.
    ridge
        λ.

    Raises
    ------
    DependentPlanes
        The readings cannot distinguish the planes.

    Examples
    --------
    >>> w, _ = smallest_squares(np.array([[3, -2], [5, -2], [5, -3]], complex), np.array([1, -1, 0], complex))
    >>> (w.real * 21).round(12)
    array([17., 31.])
    """
    planes = a.shape[-1]
    scaled, scale = columns_scaled(a)
    if ridge:
        scaled = damped(scaled, ridge)
        b = np.concatenate([b, np.zeros((*b.shape[:-1], planes))], axis=-1)
    order = (-np.abs(scaled).max(axis=-1)).argsort(axis=-1, kind="stable")
    # of [a, b] R has Qᴴb in its last column
    if scaled.ndim == 2 and b.ndim == 1:
        rows = np.concatenate([scaled, b[:, None]], axis=1)[order]
    else:
        lead = np.broadcast_shapes(scaled.shape[:-2], b.shape[:-1])
        parts = scaled, b[..., None]
        rows = np.concatenate([np.broadcast_to(x, lead + x.shape[-2:]) for x in parts], axis=-1)
        order = np.broadcast_to(order, lead + order.shape[-1:])
        rows = np.take_along_axis(rows, order[..., None], axis=-2)
    readings = rows.shape[-2]
    if readings < planes:
        require_independent(rows[..., :planes], scale, readings, planes, "readings", DependentPlanes)
    both = triangle(rows)[..., :planes, :]
    r = both[..., :planes]
    if not _surely_independent(r, threshold(readings, planes)):
        require_independent(r, scale, readings, planes, "readings", DependentPlanes)
    x = np.linalg.solve(r, -both[..., planes:])[..., 0]
    return np.asarray(x * scale + 0.0, dtype=complex), r


def _surely_independent(r: Complex, least: float) -> bool:
    """Whether σ_min > least·σ_max of every triangle R (..., p, p) is sure without its singular values.

    σ_min >= |det R| ((p - 1)/‖R‖²)^((p - 1)/2), Frobenius' norm, for the product of the others is largest where they are alike
    (Yu and Gu, Linear Algebra Appl. 252 (1997) 25-38).
    """
    planes = max(r.shape[-1] - 1, 1)
    if r.ndim == 2:
        whole = low = high = float(np.vdot(r, r).real)
    else:
        whole = np.square(np.abs(r)).sum(axis=(-2, -1))[..., None]
        low, high = whole.min(initial=1.0), whole.max(initial=1.0)
    if not 1e-280 < low <= high < 1e280:
        # squares may have left the range of numbers
        return False
    shares = np.abs(np.diagonal(r, axis1=-2, axis2=-1)) * (planes / whole) ** 0.5
    # twice: rounding
    return bool((shares.prod(axis=-1) > 2 * least * planes**0.5).all())


def factors(a: Complex) -> tuple[Complex, Complex, Real]:
    """Return Q (..., m, n) in the order of a's rows, R (..., n, n) and the scale (..., n) of a·diag(scale) = Q R."""
    scaled, scale = columns_scaled(a)
    order = np.argsort(-np.abs(scaled).max(axis=-1), axis=-1, kind="stable")
    q, r = np.linalg.qr(np.take_along_axis(scaled, order[..., None], axis=-2))
    return np.take_along_axis(q, np.argsort(order, axis=-1)[..., None], axis=-2), r, scale


def pseudo_inverse(a: Complex) -> Complex:
    """Return A⁺ (..., n, m); its rank is that of the floats in 32 digits too."""
    if not is_doubled(a):
        return np.asarray(np.linalg.pinv(a, rcond=threshold(*a.shape[-2:])), dtype=complex)
    from balancing import second_run

    doubled: Any = a
    return as_vectors(second_run.pseudo_inverse(doubled))


def inverses(a: Complex) -> tuple[Complex, Complex]:
    """Return A⁺ (..., n, m) and a B (..., n, k) with BBᴴ = (AᴴA)⁻¹: of A = QR R⁻¹, in 32 digits A⁺ again."""
    if is_doubled(a):
        inverse = pseudo_inverse(a)
        return inverse, inverse
    scale = 1 / np.linalg.norm(a, axis=-2)
    q, r = np.linalg.qr(a * scale[..., None, :])
    inverse = np.linalg.inv(r) * scale[..., None]
    return inverse @ adjoint(q), inverse
