"""Principal moments and axes to 32 digits: C. G. J. Jacobi's rotations, from the axes that floats give.

G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., §8.5: each rotation makes one product of inertia vanish.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled_arrays import ROUNDING, DoubledArray

Array = NDArray[np.float64]
Doubled = Any
"""A `DoubledArray`: what numpy's functions give for one its types do not tell."""

PAIRS = ((0, 1, 2), (0, 2, 1), (1, 2, 0))


def eigenvectors(tensor: Doubled, axes: Array) -> tuple[Doubled, Doubled]:
    """Return moments (..., 3), ascending, and axes (..., 3, 3) of a tensor, the axes as near as can be to those of floats.

    Where two moments are equal any axes across are principal axes. Where the two largest components of an axis are equal but
    for their signs, either sign is right.

    Examples
    --------
    >>> moments, axes = eigenvectors(DoubledArray([[2.0, 1, 0], [1, 2, 0], [0, 0, 5]]), np.eye(3))
    >>> moments.value, axes.value[0]
    (array([1., 3., 5.]), array([ 0.70710678, -0.70710678,  0.        ]))
    """
    # by a power of two near the largest: no square underflows
    largest = np.maximum(np.abs(tensor.high).max(axis=(-1, -2)), 1e-280)
    size = np.exp2(np.floor(np.log2(largest)))
    E = (tensor + np.swapaxes(tensor, -1, -2)) / 2 / size[..., None, None]
    rows = _orthonormal(axes)
    T = [[_form(rows[i], E, rows[j]) for j in range(3)] for i in range(3)]
    for _ in range(12):
        # every pair, not only the first that turns
        turned = [_rotate(T, rows, *pair) for pair in PAIRS]
        if True not in turned:
            break
    moments = [T[i][i] for i in range(3)]
    for i, j in ((0, 1), (1, 2), (0, 1)):
        wrong = (moments[i] - moments[j]).value > 8 * ROUNDING
        moments[i], moments[j] = (
            np.where(wrong, moments[j], moments[i]),
            np.where(wrong, moments[i], moments[j]),
        )
        turned = wrong[..., None]
        rows[i], rows[j] = np.where(turned, rows[j], rows[i]), np.where(turned, rows[i], rows[j])
    first, second = (_pointed(rows[i], axes[..., i, :]) for i in (0, 1))
    return np.stack(moments, axis=-1) * size[..., None], np.stack(
        [first, second, np.cross(first, second)], axis=-2
    )


def _form(a: Doubled, E: Doubled, b: Doubled) -> Doubled:
    """aᵀ E b of batches."""
    return (a * (E * b[..., None, :]).sum()).sum()


def _orthonormal(axes: Array) -> list[Doubled]:
    first = DoubledArray(axes[..., 0, :].copy())
    first = first / np.sqrt((first * first).sum(keepdims=True))
    second = DoubledArray(axes[..., 1, :].copy())
    second = second - first * (first * second).sum(keepdims=True)
    second = second / np.sqrt((second * second).sum(keepdims=True))
    return [first, second, np.cross(first, second)]


def _rotate(T: list[list[Doubled]], rows: list[Doubled], p: int, q: int, r: int) -> bool:
    """Turn two axes until their product of inertia vanishes; False where it does already."""
    a, gap = T[p][q], T[q][q] - T[p][p]
    live = np.abs(a.high) > ROUNDING
    if not live.any():
        return False
    root = np.copysign(np.sqrt(gap * gap + a * a * 4.0), gap)
    t = np.where(live, a * 2.0 / np.where(live, gap + root, 1.0), 0.0)
    c = 1.0 / np.sqrt(t * t + 1.0)
    s = t * c
    T[p][p], T[q][q] = T[p][p] - t * a, T[q][q] + t * a
    T[p][q] = T[q][p] = np.where(live, 0.0, a)
    left, right = T[p][r], T[q][r]
    T[p][r] = T[r][p] = c * left - s * right
    T[q][r] = T[r][q] = s * left + c * right
    c, s = c[..., None], s[..., None]
    rows[p], rows[q] = c * rows[p] - s * rows[q], s * rows[p] + c * rows[q]
    return True


def _pointed(axis: Doubled, like: Array) -> Doubled:
    """An axis whose largest component is positive; of two equal ones either may be, as in the axis of floats."""
    size = np.abs(axis)
    largest = np.where(size.high.argmax(axis=-1)[..., None] == np.arange(3), size, 0.0).sum(keepdims=True)
    rivals = (largest - size).value <= 8 * ROUNDING
    up, down = ((rivals & sign).any(axis=-1) for sign in (axis.high > 0, axis.high < 0))
    along = (axis.high * like).sum(axis=-1)
    return axis * np.where(np.where(up & down, along, np.where(down, -1.0, 1.0)) < 0, -1.0, 1.0)[..., None]


def unknown(moments: Doubled) -> tuple[Array, Array]:
    """Bound what the second run itself cannot know: of the moments (..., 3) and of the axes' components (..., 3, 1)."""
    size = np.abs(moments.high).max(axis=-1, keepdims=True)
    gap = np.diff(moments.value, axis=-1)
    hidden = 8 * ROUNDING * size
    nearest = np.concatenate([gap[..., :1], np.minimum(gap[..., :1], gap[..., 1:]), gap[..., 1:]], axis=-1)
    # of moments that are equal the axes are as good as any
    swing = np.divide(hidden, nearest, out=np.zeros_like(nearest), where=nearest > hidden)
    return np.broadcast_to(hidden, moments.shape), np.minimum(4 * swing, 2.0)[..., None]
