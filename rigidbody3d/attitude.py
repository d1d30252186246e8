"""Unit quaternions [w, x, y, z]: scalar first, body to space, Hamilton's product.

A vector with components v in body axes has the components of q v q* in space axes; q and -q are one
attitude. `compose(a, b)` turns by b first, then by a. scipy's `Rotation` keeps the scalar last:
`to_scipy` and `from_scipy` convert.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.shapes import as_array, is_doubled

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the attitude of turning by b, then by a: the quaternion product a b.

    Parameters
    ----------
    a, b
        Quaternions, (..., 4).

    Examples
    --------
    >>> compose([0, 1, 0, 0], [0, 0, 1, 0])  # i j = k
    array([0., 0., 0., 1.])
    """
    a, b = as_array(a), as_array(b)
    w, x, y, z = np.moveaxis(a, -1, 0)
    W, X, Y, Z = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            w * W - x * X - y * Y - z * Z,
            w * X + x * W + y * Z - z * Y,
            w * Y - x * Z + y * W + z * X,
            w * Z + x * Y - y * X + z * W,
        ],
        axis=-1,
    )


def inverse(q: ArrayLike) -> Array:
    """Return the opposite turn of a unit quaternion, (..., 4): its conjugate.

    Examples
    --------
    >>> inverse([0.5, 0.5, 0.5, 0.5])
    array([ 0.5, -0.5, -0.5, -0.5])
    """
    return as_array(q) * [1.0, -1.0, -1.0, -1.0]


def normalize(q: ArrayLike) -> Array:
    """Return the unit quaternion of the same direction, (..., 4).

    Raises
    ------
    ValueError
        A quaternion of zero length, or not finite.

    Examples
    --------
    >>> normalize([2, 0, 0, 0])
    array([1., 0., 0., 0.])
    """
    q = as_array(q)
    if q.shape[-1:] != (4,):
        raise ValueError(f"a quaternion has four components [w, x, y, z], found {q.shape[-1:]}")
    largest = np.abs(q).max(axis=-1, keepdims=True)
    if not (np.isfinite(q).all() and (largest > 0).all()):
        raise ValueError("a quaternion must be finite and not zero")
    scaled = q / largest
    # a quaternion that is one already stays the one that was given
    near = 0.0 if is_doubled(q) else 4e-16
    return np.where(np.abs(np.square(q).sum(axis=-1, keepdims=True) - 1) < near, q, scaled / length(scaled))


def rotate(q: ArrayLike, vector: ArrayLike) -> Array:
    """Return in space axes the vectors given in body axes, (..., 3).

    Examples
    --------
    >>> rotate([0.5, 0.5, 0.5, 0.5], [1, 0, 0])  # x -> y -> z -> x
    array([0., 1., 0.])
    """
    q, v = as_array(q), as_array(vector)
    w, u = q[..., :1], q[..., 1:]
    t = 2 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


def to_matrix(q: ArrayLike) -> Array:
    """Return the matrix of a unit quaternion, (..., 3, 3): its columns are the body's axes in space.

    Notes
    -----
    H. Goldstein, Classical Mechanics, §4.5; entries as differences of products only.

    Examples
    --------
    >>> to_matrix([0.5, 0.5, 0.5, 0.5])
    array([[0., 0., 1.],
           [1., 0., 0.],
           [0., 1., 0.]])
    """
    w, x, y, z = np.moveaxis(as_array(q), -1, 0)
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(matrix: ArrayLike) -> Array:
    """Return the unit quaternion of a rotation matrix, (..., 4), its largest component positive.

    Notes
    -----
    S. W. Shepperd, J. Guidance and Control 1 (1978) 223-224: divide by the largest component.

    Examples
    --------
    >>> from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    array([0.5, 0.5, 0.5, 0.5])
    """
    R = as_array(matrix)
    r = [[R[..., i, j] for j in range(3)] for i in range(3)]
    # 4 q qᵀ: every row is a multiple of q; take the one with the largest diagonal
    a, b, c = r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]
    d, e, f = r[1][0] + r[0][1], r[0][2] + r[2][0], r[2][1] + r[1][2]
    table = np.stack(
        [
            np.stack([1 + r[0][0] + r[1][1] + r[2][2], a, b, c], axis=-1),
            np.stack([a, 1 + r[0][0] - r[1][1] - r[2][2], d, e], axis=-1),
            np.stack([b, d, 1 - r[0][0] + r[1][1] - r[2][2], f], axis=-1),
            np.stack([c, e, f, 1 - r[0][0] - r[1][1] + r[2][2]], axis=-1),
        ],
        axis=-2,
    )
    best = np.diagonal(table, axis1=-2, axis2=-1).argmax(axis=-1)
    row = np.take_along_axis(table, best[..., None, None], axis=-2)[..., 0, :]
    return row / length(row)


def from_vector(turn: ArrayLike) -> Array:
    """Return the quaternion of a turn by |v| radians about v, (..., 4).

    Examples
    --------
    >>> from_vector([0, 0, np.pi]).round(12)
    array([0., 0., 0., 1.])
    """
    v = as_array(turn)
    half = length(v) / 2
    safe = np.where(half > 0, half, 1.0)
    return np.concatenate([np.cos(half), v / 2 * np.where(half > 0, np.sin(half) / safe, 1.0)], axis=-1)


def to_scipy(q: ArrayLike) -> Rotation:
    """Return the scipy `Rotation` of an attitude, (4,) or (n, 4).

    Parameters
    ----------
    q
        Quaternions [w, x, y, z], body to space, (4,) or (n, 4).

    Examples
    --------
    >>> to_scipy([0.5, 0.5, 0.5, 0.5]).apply([1, 0, 0])
    array([0., 1., 0.])
    """
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.asarray(q, dtype=float)[..., [1, 2, 3, 0]])


def from_scipy(rotation: Rotation) -> Array:
    """Return the attitude [w, x, y, z] of a scipy `Rotation`, (4,) or (n, 4).

    Parameters
    ----------
    rotation
        scipy's `Rotation`, whose quaternions have the scalar last.

    Examples
    --------
    >>> from_scipy(to_scipy([0.5, 0.5, 0.5, 0.5]))
    array([0.5, 0.5, 0.5, 0.5])
    """
    return np.asarray(np.asarray(rotation.as_quat())[..., [3, 0, 1, 2]])


def angle_between(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the angle of the turn from attitude b to attitude a, (...), rad in [0, π]; q and -q are one.

    By the sine of the half angle, so that a difference of 1e-16 is seen.

    Examples
    --------
    >>> float(angle_between([1, 0, 0, 0], [-1, 0, 0, 0]))
    0.0
    """
    turn = compose(a, inverse(b))
    sine = length(turn[..., 1:])[..., 0]
    return 2 * np.arctan2(sine, np.abs(turn[..., 0]))


def apart(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the difference of two attitudes as quaternions, (..., 4), of which each is one of ±q: the lesser one.

    Examples
    --------
    >>> apart([-1.0, 0.0, 0.0, 0.0], [0.8, 0.6, 0.0, 0.0])[:2]
    array([ 0.2, -0.6])
    """
    a, b = as_array(a), as_array(b)
    return a * np.where((a * b).sum(axis=-1) < 0, -1.0, 1.0)[..., None] - b


def length(vectors: Array) -> Array:
    """Return |v| of vectors (..., k), as (..., 1)."""
    return np.sqrt(np.square(vectors).sum(axis=-1, keepdims=True))  # type: ignore[no-any-return]


def left_matrix(q: Array) -> Array:
    """Return the matrix of p -> q p, (..., 4, 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack(
        [np.stack(r, axis=-1) for r in ([w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w])],
        axis=-2,
    )


def right_matrix(q: Array) -> Array:
    """Return the matrix of p -> p q, (..., 4, 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack(
        [np.stack(r, axis=-1) for r in ([w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w])],
        axis=-2,
    )
