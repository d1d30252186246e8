"""Bounds of the rounding errors of mass properties and of principal axes.

None of it is computed unless an estimate is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record

if TYPE_CHECKING:
    from dalembert.arithmetic.bounds import Given

Array = NDArray[np.float64]


@record
class BodyError(NamedTuple):
    """Bounds of the rounding errors of a body's mass (...), centre (..., 3) and tensor (..., 3, 3)."""

    mass: Array
    center: Array
    inertia: Array


class MassProperties(NamedTuple):
    """Mass (...), centre of mass (..., 3) and tensor at it (..., 3, 3) alone, of any kind of number."""

    mass: Array
    center: Array
    inertia: Array


def of_body(mass: Array, center: Array, inertia: Array, error: BodyError | None = None) -> dict[str, Given]:
    """Return mass properties as numbers that enter a formula; None: they are exact."""
    m, c, I = error or (0.0, 0.0, 0.0)
    return {"mass": (mass, 0, m), "center": (center, 1, c), "inertia": (inertia, 2, I)}


EIGEN = 10 * EPS
"""By how much of the largest moment the eigensolver, and the snapping of a thin rod's moment to zero, may miss."""


def principal(moments: Array, axes: Array, tensor: ArrayLike) -> tuple[Array, Array]:
    """Bound principal moments (..., 3) and axes (..., 3, 3), whose tensor has errors (..., 3, 3).

    With E the error, λ_i moves by a_iᵀ E a_i and the axis a_i by (a_jᵀ E a_i)/(λ_i - λ_j) towards a_j (G. Stewart
    and J. Sun, Matrix Perturbation Theory, §V.2). Where two moments are as near as that, the axes are anything.
    """
    size = np.abs(axes)
    E = np.broadcast_to(np.asarray(tensor, dtype=float), axes.shape)
    push = size @ E @ np.swapaxes(size, -1, -2) + (EIGEN * np.abs(moments).max(axis=-1))[..., None, None]
    own = np.diagonal(push, axis1=-2, axis2=-1)
    gap = np.abs(moments[..., :, None] - moments[..., None, :]) - own[..., :, None] - own[..., None, :]
    with np.errstate(divide="ignore"):
        swing = np.where(gap > 0, push / np.where(gap > 0, gap, 1.0), np.inf)
    swing = np.minimum(np.where(np.eye(3, dtype=bool), 0.0, swing), 2.0)
    back = np.minimum(np.square(swing).sum(axis=-1, keepdims=True) / 2, 2.0)
    bound = swing @ size + back * size + 4 * EPS * size + EPS * swing.sum(axis=-1, keepdims=True)
    # an axis points where its largest component is positive: undecided where two of opposite sign are as large
    largest = np.sort(size, axis=-1)[..., -1:]
    rivals = (size + bound >= largest - bound.max(axis=-1, keepdims=True)) & (size > 0)
    torn = (rivals & (axes > 0)).any(axis=-1) & (rivals & (axes < 0)).any(axis=-1)
    torn[..., 2] = torn[..., :2].any(axis=-1)
    return own.copy(), np.minimum(np.where(torn[..., None], 2.0, bound), 2.0)
