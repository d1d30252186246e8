"""The plane in which a robot moves: every axis of turning stands on it, every slide lies in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cli.read.robots.robot import RobotJoint
from dalembert.errors import DataError

Array = NDArray[np.float64]

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
    turning = [j for j in joints if j.kind == "turn"]
    sliding = [j for j in joints if j.kind == "slide"]
    if turning:
        normal = max((j.axis for j in turning), key=lambda n: sum(_off(n, j.axis) < ROUNDED for j in turning))
    else:
        pairs = [np.cross(a.axis, b.axis) for a in sliding for b in sliding]
        normal = max(pairs, key=lambda n: float(np.linalg.norm(n)), default=np.array([0.0, 0.0, 1.0]))
        length = float(np.linalg.norm(normal))
        normal = normal / length if length > ROUNDED else np.array([0.0, 0.0, 1.0])
    plane = _axes(normal)
    worst = 0.0
    for j in joints:
        if j.kind == "ball":
            continue
        off = _off(plane.normal, j.axis)
        off = off if j.kind == "turn" else math.pi / 2 - off
        if off > ROUNDED:
            what = "its axis stands" if j.kind == "turn" else "its slide leaves the plane by"
            behind = " off the normal of the plane of the others" if j.kind == "turn" else ""
            raise DataError(
                f"{file}: no planar mechanism: joint '{j.name}': {what} {math.degrees(off):.4g} deg{behind}"
            )
        worst = max(worst, off)
    if worst > SILENT:
        notes.append(f"axes are off by up to {math.degrees(worst):.2g} deg: taken as planar")
    return plane


def _off(a: Array, b: Array) -> float:
    """Return the angle between two axes without sense, rad."""
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), abs(float(a @ b)))


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
