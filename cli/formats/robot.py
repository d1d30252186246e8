"""A robot as links, joints and inertias in space, and the plane in which a planar robot moves."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.formats.drawn import Body
from dalembert.errors import DataError

Array = NDArray[np.float64]
Kind = Literal["turn", "slide", "ball", "fixed", "other"]
WORLD = "world"
# of the heaviest link: the mass of a link without mass, where a format requires one
LIGHT = 1e-6
# how the massless bodies are called that slots become
BLOCK = "block "
# how thick a link is drawn, of the mechanism's size
THICK = 0.008
PLACES = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
# the orders in which formats and tables print a tensor: URDF, SDF; MJCF
ROWS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
DIAGONAL_FIRST = tuple(PLACES)


@dataclass
class Inertial:
    """Mass and inertia tensor of a link; `pose` are the tensor's axes at the centre of mass, in the link's axes.

    `half` is half a unit of each entry's last printed digit; `entries` are their names in the file.
    """

    mass: float
    pose: Array
    tensor: Array
    half: Array


@dataclass
class RobotLink:
    """A link: its pose in the file's own configuration, its inertia, its named points in its own axes.

    `shapes` are spheres around its shapes, (centre in its axes, radius), m; none where one is a mesh.
    """

    name: str
    pose: Array
    inertial: Inertial | None = None
    points: dict[str, Array] = field(default_factory=dict)
    shapes: list[tuple[Array, float]] = field(default_factory=list)


@dataclass
class RobotJoint:
    """A joint; `ends` are its places on its two links, `axis` its axis, all in the world.

    `value` is its coordinate in the file's own configuration, `rest` that where its spring is at rest. A `ball` is pinned in every plane; `type` is its type in
    the file, `more` names its further data: limits, friction.
    """

    name: str
    kind: Kind
    parent: str
    child: str
    ends: tuple[Array, Array]
    axis: Array
    value: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0
    type: str = ""
    more: tuple[str, ...] = ()


@dataclass
class Motor:
    """A motor on a sum of joint coordinates, Σ factor·coordinate, at a speed."""

    name: str
    terms: list[tuple[str, float]]
    speed: float | None = None


@dataclass
class Spring:
    """A spring and damper: between two places, each (link, place in its axes), or on a sum of joint coordinates.

    `rest` is the length, or the sum, without force; None where that is as the file stands.
    """

    name: str
    ends: list[tuple[str, Array]]
    terms: list[tuple[str, float]]
    stiffness: float
    damping: float
    rest: float | None


@dataclass
class Robot:
    """A robot of a file; `gears` are (a, b, ratio, arm), `couplings` sums of joint coordinates that stay as they are."""

    file: str
    format: str
    name: str
    links: dict[str, RobotLink] = field(default_factory=dict)
    joints: dict[str, RobotJoint] = field(default_factory=dict)
    couplings: list[tuple[str, list[tuple[str, float]]]] = field(default_factory=list)
    gears: list[tuple[str, str, float, str]] = field(default_factory=list)
    motors: list[Motor] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    ground: str = WORLD
    gravity: Array | None = None
    notes: list[str] = field(default_factory=list)

    def link(self, name: str, where: str) -> RobotLink:
        """Return a link that must be there."""
        if name not in self.links:
            names = ", ".join(self.links)[:200]
            raise DataError(f"{self.file}: {where}: no link is called '{name}': expected one of {names}")
        return self.links[name]

    def add(self, link: RobotLink) -> None:
        """Add a link; a name is there once."""
        if link.name in self.links:
            raise DataError(f"{self.file}: two links are called '{link.name}'")
        self.links[link.name] = link

    def join(self, joint: RobotJoint) -> None:
        """Add a joint; a name is there once."""
        if joint.name in self.joints:
            raise DataError(f"{self.file}: two joints are called '{joint.name}'")
        self.joints[joint.name] = joint


def pose(xyz: ArrayLike = (0.0, 0.0, 0.0), rotation: Array | None = None) -> Array:
    """Return a pose (4, 4) from a place and a rotation."""
    made = np.eye(4)
    made[:3, 3] = np.asarray(xyz, dtype=float)
    if rotation is not None:
        made[:3, :3] = rotation
    return made


def about(axis: int, angle: float) -> Array:
    """Return the rotation about one of the axes x, y, z (0, 1, 2), rad.

    >>> about(2, np.pi / 2).round(9)[0]
    array([ 0., -1.,  0.])
    """
    c, s = np.cos(angle), np.sin(angle)
    made = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made[i, i] = made[j, j] = c
    made[i, j], made[j, i] = -s, s
    return made


def rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation by fixed axes x, y, z in that order (URDF, SDF)."""
    return np.asarray(about(2, yaw) @ about(1, pitch) @ about(0, roll))


def quaternion(w: float, x: float, y: float, z: float) -> Array:
    """Return the rotation of a quaternion of any length but zero.

    >>> quaternion(1, 0, 0, 1).round(9)[0]
    array([ 0., -1.,  0.])
    """
    n = w * w + x * x + y * y + z * z
    if not n > 0:
        raise ValueError("found 0 0 0 0, expected a quaternion of some length")
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(rows) / n


def half_unit(word: str) -> float:
    """Return half a unit of the last printed digit of a number; a whole number, and zero, is exact.

    >>> half_unit("0.250"), half_unit("1.2e-3"), half_unit("0.0"), half_unit("12")
    (0.0005, 5e-05, 0.0, 0.0)
    """
    digits, _, exponent = word.lower().partition("e")
    places = len(digits.partition(".")[2])
    if float(digits) == 0 or not (places or exponent):
        return 0.0
    return float(f"0.5e{int(exponent or 0) - places}")


def symmetric(entries: Mapping[str, float]) -> Array:
    """Return the matrix of ixx, iyy, izz, ixy, ixz, iyz as it is written: the products are the matrix's own entries."""
    made = np.empty((3, 3))
    for entry, (i, j) in PLACES.items():
        made[i, j] = made[j, i] = entries[entry]
    return made


def printed(texts: Mapping[str, str]) -> tuple[Array, Array]:
    """Return the matrix of such entries as printed, and half a unit of the last digit of each."""
    of = (float, half_unit)
    tensor, half = (symmetric({entry: read(text) for entry, text in texts.items()}) for read in of)
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


def strokes(body: Body) -> list[tuple[complex, complex]]:
    """Return what a body looks like: the sides of the hull of its points, in its axes."""
    from virtualwork.drawing import hull

    ends = hull(body.points.values())
    return list(zip(ends, ends[1:] + (ends[:1] if len(ends) > 2 else ()), strict=False))


def boxes(body: Body, size: float) -> Iterator[tuple[complex, float, tuple[float, float, float]]]:
    """Yield the strokes as boxes for a mechanism of this size: the middle, the direction and the sides of each."""
    for a, b in strokes(body):
        yield (a + b) / 2, cmath.phase(b - a), (abs(b - a), 2 * THICK * size, 2 * THICK * size)


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
