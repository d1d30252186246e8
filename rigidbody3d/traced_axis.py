"""Which axis of a body is followed in pictures of its rotation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidbody3d.inertia import principal

Array = NDArray[np.float64]

LIKE = 1e-9
"""Moments as near as this, relatively, are those of a body of revolution."""


def pole(moments: Array) -> int | None:
    """Return which of the principal moments (3,), ascending, is about the axis of revolution; None where there is none.

    >>> pole(np.array([1.0, 2.0, 2.0])), pole(np.array([1.0, 1.0, 1.0])), pole(np.array([1.0, 2.0, 3.0]))
    (0, None, None)
    """
    low, middle, high = moments.tolist()
    if high - low <= LIKE * high:
        return None
    if middle - low <= LIKE * high:
        return 2
    return 0 if high - middle <= LIKE * high else None


def traced_axis(inertia: ArrayLike, omega: ArrayLike, top: bool = False) -> tuple[Array, str]:
    """Return the axis that is followed, a unit vector (3,) in body axes, and its name.

    Of a top it is body z, of a body of revolution its axis, of another the principal axis about which it turns fastest.

    >>> traced_axis([1, 2, 3], [0.1, 4.0, 0.2])[1]
    'body y'
    """
    moments, axes = principal(inertia)
    k = pole(moments)
    if top:
        axis = np.array([0.0, 0.0, 1.0])
    else:
        axis = axes[int(np.argmax(np.abs(axes @ np.asarray(omega, dtype=float)))) if k is None else k]
    name = next((a for a, e in zip("xyz", np.eye(3), strict=True) if np.allclose(np.abs(axis), e)), None)
    return axis, f"body {name}" if name else "a principal axis"
