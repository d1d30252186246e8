"""A robot as links, joints and inertias in space, and the plane in which a planar robot moves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.documents.markup import At
from dalembert.documents.robots import WORLD
from dalembert.documents.values import MOST_LINKS, check_count
from dalembert.errors import DataError
from dalembert.figures import last_place
from rigidbody3d.turning import turned

if TYPE_CHECKING:
    from rigidbody3d.body import Body

Array = NDArray[np.float64]
Kind = Literal["turn", "slide", "ball", "fixed", "other"]
PLACES = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
# the order in which MJCF and tables print a tensor
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

    @property
    def body(self) -> Body | None:
        """Its mass, centre of mass and inertia tensor in its own axes; None where the file gives none."""
        from rigidbody3d.body import Body
        from rigidbody3d.inertia import turn

        held = self.inertial
        return held and Body(np.asarray(held.mass), held.pose[:3, 3], turn(held.tensor, held.pose[:3, :3]))


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


@dataclass(frozen=True)
class Gearbox:
    """Two links whose turns against an arm have a fixed ratio: ω_second − ω_arm = ratio·(ω_first − ω_arm)."""

    links: tuple[str, str]
    ratio: float
    arm: str


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
    """A robot of a file; `couplings` are sums of joint coordinates that stay as they are."""

    file: str
    name: str
    links: dict[str, RobotLink] = field(default_factory=dict)
    joints: dict[str, RobotJoint] = field(default_factory=dict)
    couplings: list[tuple[str, list[tuple[str, float]]]] = field(default_factory=list)
    gears: list[Gearbox] = field(default_factory=list)
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
        check_count(self.file, len(self.links), "links", MOST_LINKS)
        if link.name in self.links:
            raise DataError(f"{self.file}: two links are called '{link.name}'")
        self.links[link.name] = link

    def join(self, joint: RobotJoint) -> None:
        """Add a joint; a name is there once."""
        if joint.name in self.joints:
            raise DataError(f"{self.file}: two joints are called '{joint.name}'")
        self.joints[joint.name] = joint

    def drive(self, speeds: Mapping[str, float | None]) -> None:
        """Set the motors: one on each of some joints, with its speed."""
        self.motors = [Motor(name, [(name, 1.0)], speed) for name, speed in speeds.items()]

    def couple(self, name: str, joint: str, other: str, factor: float, offset: float, where: str) -> None:
        """Keep a joint's coordinate at a factor times another's, or as it is where there is no other; the offset is the file's."""
        self.couplings.append((name, [(joint, 1.0), *([(other, -factor)] if other else [])]))
        self.note_offset(where, offset)

    def note_offset(self, where: str, offset: float = 0.0) -> None:
        """Note what a coupling adds to a coordinate."""
        if offset:
            self.notes.append(f"{where}: its offset {offset:g} is left out: the pose is that of the file")

    def mimic(self, joint: str, other: str, words: Mapping[str, str]) -> None:
        """Keep a joint's coordinate at multiplier·(another's − reference) + offset (URDF, SDF)."""
        at = At(self.file, f"joint '{joint}'")
        factor, offset, zero = (
            at.number(f"mimic {key}", words.get(key, default))
            for key, default in (("multiplier", "1"), ("offset", "0"), ("reference", "0"))
        )
        self.couple(joint, joint, other, factor, offset - factor * zero, f"{at.where}, mimic")


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
