"""Masses that follow from MJCF's shapes: spheres, capsules, cylinders, boxes, ellipsoids of one density."""

from __future__ import annotations

import numpy as np

from cli.read.robots.robot import Array, Inertial, pose
from rigidbody3d import inertia

# of a shape that says of neither mass nor density, kg/m³
DENSITY = 1000.0
# how many of a shape's sizes are used, those along its own axes being halves
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


def unit_mass(shape: str, size: list[float]) -> tuple[float, Array]:
    """Return a shape's volume, m³, and its moments for unit mass, (3,) m².

    >>> unit_mass("box", [0.5, 1.0, 1.5])[0]
    6.0
    """
    if shape in ("sphere", "ellipsoid"):
        a, b, c = size if shape == "ellipsoid" else 3 * size
        return 4 / 3 * np.pi * a * b * c, np.array([b * b + c * c, a * a + c * c, a * a + b * b]) / 5
    if shape == "box":
        a, b, c = size
        return 8 * a * b * c, np.array([b * b + c * c, a * a + c * c, a * a + b * b]) / 3
    r, h = size
    side = np.pi * r * r * 2 * h
    across, along = r * r / 4 + h * h / 3, r * r / 2
    if shape == "cylinder":
        return side, np.array([across, across, along])
    # a capsule: its two halves of a sphere, each with its centre 3r/8 beyond the cylinder's end
    ends = 4 / 3 * np.pi * r**3
    outer = 2 / 5 * r * r - (3 / 8 * r) ** 2 + (h + 3 / 8 * r) ** 2
    whole = side + ends
    x = (side * across + ends * outer) / whole
    return whole, np.array([x, x, (side * along + ends * 2 / 5 * r * r) / whole])


def together(parts: list[tuple[float, Array, Array]]) -> Inertial | None:
    """Return the inertia of several masses: each its mass, pose and moments in its own axes."""
    mass = sum(m for m, _, _ in parts)
    if mass <= 0:
        return None
    center = sum(m * at[:3, 3] for m, at, _ in parts) / mass
    tensor = sum(
        inertia.turn(np.diag(moments), at[:3, :3]) + inertia.shift(m, at[:3, 3] - center)
        for m, at, moments in parts
    )
    return Inertial(mass, pose(center), np.asarray(tensor), np.zeros((3, 3)))
