"""Influence coefficients, vibration, weights and limits, checked before corrections are computed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.shapes import as_numbers, common_shape, spread_to

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LARGEST = 1e140
"""The squares of larger numbers, and of the reciprocals of smaller ones than 1/LARGEST, overflow."""
OUT_OF_RANGE = (
    f"influence, initial and their quotients must be zero or between {1 / LARGEST:.0e} and {LARGEST:.0e} in size: "
    "choose other units"
)


def checked(
    influence: ArrayLike, initial: ArrayLike, weights: ArrayLike | None
) -> tuple[Complex, Complex, Real | None]:
    """Return α, V and the square roots of the weights, or say what is wrong with them."""
    alpha, v = as_numbers("influence", influence, complex), as_numbers("initial", initial, complex)
    if alpha.ndim < 2 or v.ndim < 1 or alpha.shape[-2] != v.shape[-1] or 0 in alpha.shape[-2:]:
        raise ValueError(f"shapes do not fit: influence {alpha.shape}, initial {v.shape}")
    common_shape(influence=alpha.shape[:-1], initial=v.shape)
    if not (np.isfinite(alpha).all() and np.isfinite(v).all()):
        raise ValueError("influence and initial must be finite")
    if weights is None:
        return alpha, v, None
    w = as_numbers("weights", weights)
    common_shape(weights=w.shape, influence=alpha.shape[:-1], initial=v.shape)
    if not ((w >= 0) & (w < np.inf)).all() or not (w > 0).any():
        raise ValueError("weights must not be negative, and not all zero")
    return alpha, v, np.sqrt(w)


def is_in_range(alpha: Complex, v: Complex) -> bool:
    """Whether the squares of the numbers and of their quotients are numbers too."""
    coefficient, vibration = np.abs(alpha).max(axis=-2), np.abs(v).max(axis=-1)[..., None]
    with np.errstate(all="ignore"):
        quotient = np.where(coefficient > 0, vibration / coefficient, 0.0)
    sizes = np.concatenate([x.ravel() for x in (coefficient, vibration, quotient)])
    sizes = sizes[sizes > 0]
    return bool(((sizes >= 1 / LARGEST) & (sizes <= LARGEST)).all())


def require_size(alpha: Complex, v: Complex) -> None:
    """Refuse numbers whose squares, or those of their quotients, are none."""
    if not is_in_range(alpha, v):
        raise ValueError(OUT_OF_RANGE)


def limits_of(name: str, limits: ArrayLike | None, count: int) -> Real:
    """Return a limit for each of so many planes or sensors, infinite where there is none."""
    limit = spread_to(name, np.inf if limits is None else limits, (count,))
    if not (limit > 0).all():
        raise ValueError(f"{name} must be positive")
    return limit
