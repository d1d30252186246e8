"""What pictures show of bodies: the shapes of their parts with their outlines, and the axis that is followed in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidbody3d.inertia import principal

Array = NDArray[np.float64]

ELLIPSOID = "ellipsoid"
"""The shape of a body with a tensor alone: the homogeneous ellipsoid that has it."""
MESH = "mesh"
TURN = np.linspace(0.0, 2 * np.pi, 73)
LIKE = 1e-9
"""Moments as near as this, relatively, are those of a body of revolution."""


class Solid(NamedTuple):
    """A shape in its place."""

    shape: str
    dimensions: Mapping[str, float]
    mass: float
    center: Array
    """(3,), m."""
    rotation: Array
    """(3, 3): its rows are the axes of space, its columns those of the shape."""
    points: Array | None = None
    """The triangles of a mesh in its own axes, (n, 3, 3)."""


class Whole(NamedTuple):
    """A body as a whole: centre of mass (3,), principal radii of gyration (3,), m, and axes (3, 3), a row each."""

    center: Array
    gyration: Array
    axes: Array


class Piece(NamedTuple):
    """A part of an outline: points (n, 3), and whether they are all of a filled hull, a hole, a line, or triangles."""

    kind: str
    points: Array


def of_shape(shape: str, mass: Array, center: Array, dimensions: Mapping[str, ArrayLike]) -> list[Solid]:
    """Return the shapes of bodies that lie along their own axes, flat."""
    lead = np.broadcast_shapes(mass.shape, center.shape[:-1], *(np.shape(d) for d in dimensions.values()))
    sizes = {name: np.broadcast_to(d, lead).ravel() for name, d in dimensions.items()}
    masses, centers = np.broadcast_to(mass, lead).ravel(), np.broadcast_to(center, (*lead, 3)).reshape(-1, 3)
    return [
        Solid(shape, {name: float(d[i]) for name, d in sizes.items()}, float(m), c, np.eye(3))
        for i, (m, c) in enumerate(zip(masses, centers, strict=True))
    ]


def of_tensor(mass: Array, center: Array, inertia: Array) -> list[Solid]:
    """Return the homogeneous ellipsoids of bodies: half axes aᵢ² = 5 (Iⱼ + Iₖ − Iᵢ)/(2m)."""
    solids = []
    for m, c, I in zip(mass.ravel(), center.reshape(-1, 3), inertia.reshape(-1, 3, 3), strict=True):
        moments, axes = principal(I * np.sign(m))
        square = 5 * (moments.sum() - 2 * moments) / (2 * abs(m))
        halves = np.sqrt(np.clip(square, 0, None))
        solids.append(Solid(ELLIPSOID, dict(zip("abc", halves.tolist(), strict=True)), float(m), c, axes.T))
    return solids


def moved(solids: Callable[[], list[Solid]], offset: Array) -> list[Solid]:
    """Return shapes moved by an offset, (3,) or one for each."""
    made = solids()
    by = np.broadcast_to(offset, (len(made), 3)) if offset.ndim < 2 else offset.reshape(-1, 3)
    return [s._replace(center=s.center + d) for s, d in zip(made, by, strict=True)]


def turned(solids: Callable[[], list[Solid]], rotation: Array, about: Array | None) -> list[Solid]:
    """Return shapes turned about a point; without one each about its own centre."""
    made = solids()
    R = np.broadcast_to(rotation, (len(made), 3, 3)) if rotation.ndim < 3 else rotation.reshape(-1, 3, 3)
    if about is None:
        return [s._replace(rotation=r @ s.rotation) for s, r in zip(made, R, strict=True)]
    points = np.broadcast_to(about, (len(made), 3)) if about.ndim < 2 else about.reshape(-1, 3)
    return [
        s._replace(center=p + r @ (s.center - p), rotation=r @ s.rotation)
        for s, r, p in zip(made, R, points, strict=True)
    ]


def outline(solid: Solid) -> list[Piece]:
    """Return what a shape is drawn with, in space, m."""
    pieces = _own(solid.shape, solid.dimensions, solid.points)
    return [Piece(kind, points @ solid.rotation.T + solid.center) for kind, points in pieces]


def _circle(radius: float, z: float = 0.0) -> Array:
    return np.stack([radius * np.cos(TURN), radius * np.sin(TURN), np.full(len(TURN), z)], axis=-1)


def _ball(halves: Sequence[float]) -> Array:
    u, v = np.meshgrid(TURN[:-1], np.linspace(0, np.pi, 19))
    unit = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)
    return np.asarray(unit.reshape(-1, 3) * halves)


def _own(shape: str, d: Mapping[str, float], points: Array | None) -> list[tuple[str, Array]]:
    """Along its own axes, as `shapes` has them."""
    if shape == MESH:
        return [("triangles", np.zeros((0, 3)) if points is None else points.reshape(-1, 3))]
    if shape == "rod":
        return [("line", np.array([[0, 0, -0.5], [0, 0, 0.5]]) * d["length"])]
    if shape == "arc":
        turn = np.linspace(-0.5, 0.5, 73) * d["angle"]
        # its centre of mass, not that of the circle, is the origin
        middle = d["radius"] * np.sinc(d["angle"] / (2 * np.pi))
        x, y = d["radius"] * np.cos(turn) - middle, d["radius"] * np.sin(turn)
        return [("line", np.stack([x, y, 0 * turn], axis=-1))]
    if shape in ("ring", "disk"):
        return [("line" if shape == "ring" else "hull", _circle(d["radius"]))]
    if shape in ("cylinder", "tube"):
        solids = []
        for kind, name in (("hull", "radius"), ("hole", "inner_radius")):
            if d.get(name):
                ends = [_circle(d[name], z * d["length"]) for z in (-0.5, 0.5)]
                solids += [(kind, np.concatenate(ends)), *(("line", end) for end in ends)]
        return solids
    if shape == "cone":
        base, apex = _circle(d["radius"], -d["length"] / 4), np.array([[0, 0, 0.75 * d["length"]]])
        return [("hull", np.concatenate([base, apex])), ("line", base)]
    if shape in ("box", "plate"):
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * [d["width"] / 2, d["height"] / 2]
        depth = d.get("depth", 0.0) / 2
        faces = [np.column_stack([corners, np.full(5, z)]) for z in ((-depth, depth) if depth else (0.0,))]
        sides = [("line", np.array(pair)) for pair in zip(*faces, strict=True)] if depth else []
        return [("hull", np.concatenate(faces)), *(("line", face) for face in faces), *sides]
    if shape == "sphere":
        solids = [("hull", _ball([d["radius"]] * 3))]
        inner = d.get("inner_radius", 0.0)
        return solids + ([("hole", _ball([inner] * 3))] if inner else [])
    if shape == ELLIPSOID and max(d.values()) > 0:
        return [("hull", _ball([d["a"], d["b"], d["c"]]))]
    return [("point", np.zeros((1, 3)))]


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
