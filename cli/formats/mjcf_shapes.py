"""Orientations of MJCF in its five forms, and masses and moments of its shapes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from cli.formats.markup import At
from cli.formats.robot import Array, Inertial, about, pose, quaternion


@dataclass(frozen=True)
class Frames:
    """How a file writes orientations: angles in degrees or rad, Euler angles about which axes."""

    file: str
    degrees: bool
    sequence: str

    def __post_init__(self) -> None:
        """Check the axes."""
        if len(self.sequence) != 3 or not set(self.sequence.lower()) <= set("xyz"):
            raise At(self.file, "compiler").error("", f"eulerseq '{self.sequence}'", "three of x, y, z")

    def angle(self, value: float) -> float:
        """Return an angle of the file in rad."""
        return float(np.radians(value)) if self.degrees else value

    def pose(self, where: str, e: Mapping[str, str]) -> Array:
        """Return the pose that pos and one of quat, euler, axisangle, xyaxes, zaxis give."""
        at = At(self.file, where)
        place = at.numbers("pos", e.get("pos"), 3, (0.0, 0.0, 0.0))
        turned = np.eye(3)
        if "quat" in e:
            turned = at.rotation(at.numbers("quat", e["quat"], 4))
        elif "euler" in e:
            for axis, angle in zip(self.sequence, at.numbers("euler", e["euler"], 3), strict=True):
                one = about("xyz".index(axis.lower()), self.angle(angle))
                turned = turned @ one if axis.islower() else one @ turned
        elif "axisangle" in e:
            *v, angle = at.numbers("axisangle", e["axisangle"], 4)
            half = self.angle(angle) / 2
            turned = quaternion(np.cos(half), *(np.sin(half) * at.direction("axisangle", v)))
        elif "xyaxes" in e:
            v = at.numbers("xyaxes", e["xyaxes"], 6)
            x = at.direction("xyaxes", v[:3])
            y = at.direction("xyaxes", np.array(v[3:]) - x * (x @ v[3:]))
            turned = np.column_stack([x, y, np.cross(x, y)])
        elif "zaxis" in e:
            turned = _onto(at.direction("zaxis", at.numbers("zaxis", e["zaxis"], 3)))
        return pose(place, turned)


def _onto(z: Array) -> Array:
    """Return the least rotation that turns the z-axis onto a direction."""
    axis = np.cross([0.0, 0.0, 1.0], z)
    s, c = float(np.linalg.norm(axis)), float(z[2])
    if s < 1e-15:
        return np.eye(3) if c > 0 else about(0, np.pi)
    half = np.arctan2(s, c) / 2
    return quaternion(np.cos(half), *(np.sin(half) * axis / s))


# of a shape with neither mass nor density, kg/m³
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
    from rigidbody3d import inertia

    mass = sum(m for m, _, _ in parts)
    if mass <= 0:
        return None
    center = sum(m * at[:3, 3] for m, at, _ in parts) / mass
    tensor = sum(
        inertia.turn(np.diag(moments), at[:3, :3]) + inertia.shift(m, at[:3, 3] - center)
        for m, at, moments in parts
    )
    return Inertial(mass, pose(center), np.asarray(tensor), np.zeros((3, 3)))


def mass_of_shapes(
    frames: Frames, where: str, geoms: Iterable[Mapping[str, str]], notes: list[str]
) -> Inertial | None:
    """Return the inertia of a body's shapes, each by its attributes."""
    at, parts = At(frames.file, where), []
    for values in geoms:
        shape = values.get("type", "sphere")
        if shape not in SIZES or "mesh" in values:
            notes.append(f"{where}: the mass of a {values.get('mesh', shape)} is not imported")
            continue
        here = frames.pose(f"{where}, geom", values)
        size = at.numbers("geom size", values.get("size", "0"))
        if "fromto" in values:
            ends = np.array(at.numbers("geom fromto", values["fromto"], 6)).reshape(2, 3)
            way = ends[1] - ends[0]
            here = pose(ends.mean(axis=0), _onto(at.direction("geom fromto", way)))
            # across it has one size, whatever its shape
            size = size[:1] * (SIZES[shape] - 1) + [float(np.linalg.norm(way)) / 2]
        if len(size) < SIZES[shape] or min(size[: SIZES[shape]]) <= 0:
            raise at.error("geom size", len(size), f"{SIZES[shape]} above zero")
        volume, moments = unit_mass(shape, size[: SIZES[shape]])
        density = at.number("geom density", values.get("density", str(DENSITY)))
        mass = at.number("geom mass", values.get("mass", repr(density * volume)))
        parts.append((mass, here, mass * moments))
    return together(parts)
