"""What the formats of robots write alike: poses and rotations, tensors with their printed digits, shapes, further data of a joint."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from dalembert.documents.markup import At
from dalembert.documents.robots import Array
from dalembert.figures import last_place
from rigidbody3d.turning import turned

PLACES = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
# the order in which MJCF and tables print a tensor
DIAGONAL_FIRST = tuple(PLACES)


def pose(xyz: ArrayLike = (0.0, 0.0, 0.0), rotation: Array | None = None) -> Array:
    """Return a pose (4, 4) from a place and a rotation."""
    made = np.eye(4)
    made[:3, 3] = np.asarray(xyz, dtype=float)
    if rotation is not None:
        made[:3, :3] = rotation
    return made


def rpy(*angles: float) -> Array:
    """Return the rotation by fixed axes x, y, z in that order (URDF, SDF).

    >>> rpy(0, 0, np.pi / 2).round(9)[0]
    array([ 0., -1.,  0.])
    """
    return turned(((axis, np.cos(angle), np.sin(angle)) for axis, angle in enumerate(angles)), np.eye(3))


def rotation(at: At, wxyz: Sequence[float]) -> Array:
    """Return the rotation of a quaternion of a file."""
    if not sum(v * v for v in wxyz) > 0:
        raise at.error("", "0 0 0 0", "a quaternion of some length")
    from rigidbody3d.attitude import to_matrix

    return np.asarray(to_matrix(wxyz) / np.dot(wxyz, wxyz))


def stated(limits: Iterable[str | None], friction: str | None) -> tuple[str, ...]:
    """Name the further data of a joint: limits and friction that are present and not zero."""
    result = {"limits": list(limits), "friction": [friction]}
    return tuple(what for what, words in result.items() if any((word or "").strip("0. ") for word in words))


def half_unit(word: str) -> float:
    """Return half a unit of the last printed digit of a number; a whole number, and zero, is exact.

    >>> half_unit("0.250"), half_unit("1.2e-3"), half_unit("0.0"), half_unit("12")
    (0.0005, 5e-05, 0.0, 0.0)
    """
    place = last_place(word)
    return 0.0 if float(word) == 0 or not (place or "e" in word.lower()) else float(f"0.5e{place}")


def symmetric(entries: Mapping[str, float]) -> Array:
    """Return the matrix of ixx, iyy, izz, ixy, ixz, iyz as it is written: the products are the matrix's own entries."""
    made = np.empty((3, 3))
    for entry, (i, j) in PLACES.items():
        made[i, j] = made[j, i] = entries[entry]
    return made


def printed(texts: Mapping[str, str]) -> tuple[Array, Array]:
    """Return the matrix of such entries as printed, and half a unit of the last digit of each."""
    tensor, half = (symmetric({k: read(text) for k, text in texts.items()}) for read in (float, half_unit))
    return tensor, half


def sphere_around(shape: str, size: list[float]) -> float | None:
    """Return the radius of the sphere around a box (edges), cylinder or capsule (radius, length), or sphere (radius).

    >>> sphere_around("box", [3.0, 4.0, 12.0]), sphere_around("mesh", [])
    (6.5, None)
    """
    if shape == "box" and size:
        return float(np.linalg.norm(size)) / 2
    if shape in ("cylinder", "capsule") and len(size) == 2:
        radius, length = size
        return float(np.hypot(radius, length / 2)) if shape == "cylinder" else radius + length / 2
    return max(size) if shape in ("sphere", "ellipsoid") and size else None
