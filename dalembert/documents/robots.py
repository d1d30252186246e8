"""What a robot's file (URDF, SDF, MJCF) says: records of links, joints, motors and springs, as names and arrays; words that the formats share.

`rigidbody3d` reads them, `virtualwork` lays a planar robot into its plane, and writes mechanisms as robots.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dalembert.documents.markup import At
from dalembert.documents.values import MOST_LINKS, check_count
from dalembert.errors import DataError

Array = NDArray[np.float64]
Kind = Literal["turn", "slide", "ball", "fixed", "other"]

WORLD = "world"
# the entries of an inertia tensor, in the order in which URDF and SDF print them
ROWS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
# of the heaviest link: the mass of a link without mass, where a format requires one
LIGHT = 1e-6
# how the massless bodies are called that slots become
BLOCK = "block "
# elements of SDF: marks on numbers that the format asks for and the mechanism does not have
MASSLESS, POINT_MASS, INERTIA_ALONE = "massless", "point_mass", "inertia_alone"


@dataclass
class Inertial:
    """Mass and inertia tensor of a link; `pose` are the tensor's axes at the centre of mass, in the link's axes.

    `half` is half a unit of each entry's last printed digit.
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
    """A robot of a file, in SI and rad: links, joints, motors, springs; `couplings` are sums of joint coordinates that stay as they are."""

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
    """What is not imported."""
    format: str = ""

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
