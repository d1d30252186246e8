"""The plane in which a planar robot moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dalembert.documents.robots import Array, RobotJoint
from dalembert.errors import DataError

# rad: what angles such as 1.57 for a right angle are off by
ROUNDED = 1e-3
SILENT = 1e-6


@dataclass(frozen=True)
class Plane:
    """Two axes of the world, x and y of the plane, and the normal."""

    x: Array
    y: Array
    normal: Array

    def place(self, at: Array) -> complex:
        """Return a place of space in the plane, m."""
        return complex(float(self.x @ at), float(self.y @ at))

    direction = place

    def turn(self, rotation: Array) -> float:
        """Return the angle of a link's axes: of its x-axis, or of the first that does not stand on the plane."""
        for k in range(3):
            z = self.place(rotation[:, k])
            if abs(z) > 0.5:
                return math.atan2(z.imag, z.real)
        raise AssertionError("three axes cannot all stand on a plane")

    def sense(self, axis: Array) -> float:
        """Return 1 where an axis of turning is counter-clockwise in the plane, else -1."""
        return 1.0 if float(self.normal @ axis) > 0 else -1.0


def plane_of(file: str, joints: list[RobotJoint], notes: list[str]) -> Plane:
    """Return the plane of most joints; the joint that is not in it is named, and by how much.

    A robot in a plane of the world's axes keeps these: x-y, x-z or y-z.
    """
    for j in joints:
        if j.kind == "other":
            raise DataError(
                f"{file}: no planar mechanism: joint '{j.name}' is of the type '{j.type}': expected pins, slides and fixed joints"
            )
    turning, sliding = ([j for j in joints if j.kind == kind] for kind in ("turn", "slide"))
    if turning:
        axes = np.array([j.axis for j in turning])
        normal = max(axes, key=lambda n: int(np.sum(_off(n, axes) < ROUNDED)))
    else:
        along = sliding[0].axis if sliding else np.zeros(3)
        across = (np.cross(along, j.axis) for j in sliding)
        normal = max(across, key=lambda n: float(np.linalg.norm(n)), default=along)
        if np.linalg.norm(normal) <= ROUNDED:
            # parallel slides lie in many planes: the one nearest to a plane of the world's axes, x-y before the others
            normal = min(np.eye(3)[::-1], key=lambda n: round(abs(float(n @ along)), 9))
            normal = normal - along * (along @ normal)
        normal = normal / np.linalg.norm(normal)
    plane = _axes(normal)
    worst = 0.0
    for j in (j for j in joints if j.kind != "ball"):
        off = abs(float(_off(plane.normal, j.axis)) - (math.pi / 2 if j.kind == "slide" else 0.0))
        if off > ROUNDED:
            by = f"{math.degrees(off):.4g} deg"
            turn = f"axis stands {by} off the normal of the plane of the others"
            what = turn if j.kind == "turn" else f"slide leaves the plane by {by}"
            raise DataError(f"{file}: no planar mechanism: joint '{j.name}': its {what}")
        worst = max(worst, off)
    if worst > SILENT:
        notes.append(f"axes are off by up to {math.degrees(worst):.2g} deg: read as planar")
    return plane


def _off(a: Array, b: Array) -> Array:
    """Return the angle between an axis and others, without sense, rad."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.abs(b @ a)))


def _axes(normal: Array) -> Plane:
    """Return the axes of a plane: the world's where it is one of theirs to within rounding."""
    k = int(np.abs(normal).argmax())
    x, y = ((1, 2), (0, 2), (0, 1))[k]
    ex, ey = np.eye(3)[x], np.eye(3)[y]
    if _off(normal, np.eye(3)[k]) > ROUNDED:
        ex = ex - normal * (normal @ ex)
        ex = ex / np.linalg.norm(ex)
        ey = np.cross(normal, ex)
        ey = ey if ey[y] > 0 else -ey
    return Plane(ex, ey, np.cross(ex, ey))
