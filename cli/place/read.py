"""What the options of a placement ask for, in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from cli.read import options
from cli.read.units import is_number


class Vector(NamedTuple):
    """A correction as given."""

    mass: float
    mass_unit: str
    angle: float
    angle_unit: str


class Drill(NamedTuple):
    """How material is drilled out."""

    diameter: float
    density: float
    point: float
    """Point angle, rad."""
    deepest: float | None


@dataclass(frozen=True)
class Request:
    """What is asked for; angles in degrees."""

    vectors: list[Vector]
    places: list[float] | None
    limit: float | None
    stock: list[float] | None
    pieces: int
    max_pieces: int | None
    ratio: float
    """Radius of the corrections over that of the places."""
    drill: Drill | None
    planes: tuple[float, list[float]] | None
    """Where along the shaft the corrections are, and the planes they are carried over to, m."""
    remove: bool

    @property
    def unit(self) -> str:
        """The unit masses are shown in."""
        return self.vectors[0].mass_unit

    @property
    def removes(self) -> bool:
        """Whether what is given out is material to remove."""
        return self.remove or self.drill is not None


def read_vector(spec: str) -> Vector:
    """Read `83.5g@308.87deg`; a bare angle is in degrees."""
    mass, mark, angle = spec.partition("@")
    if not mark:
        raise options.bad("MASS@ANGLE", f"'{spec}': expected a mass and an angle, such as 83.5g@308.87deg")
    size, turn = (
        options.with_unit("MASS@ANGLE", mass, "mass"),
        options.with_unit("MASS@ANGLE", f"{angle}deg" if is_number(angle) else angle, "angle"),
    )
    assert size is not None
    assert turn is not None
    if size[0] < 0:
        raise options.bad("MASS@ANGLE", f"'{spec}': expected a mass that is not negative")
    return Vector(*size, *turn)


def read_ratio(at_radius: str | None, to_radius: str | None) -> float:
    """Read --at-radius and --to-radius as the one over the other."""
    at = options.quantity("--at-radius", at_radius, "length", positive=True)
    to = options.quantity("--to-radius", to_radius, "length", positive=True)
    if (at is None) != (to is None):
        raise options.bad(
            "--to-radius" if to is None else "--at-radius", "expected both --at-radius and --to-radius"
        )
    return 1.0 if at is None or to is None else at / to


def read_drill(
    drill: str | None, density: str | None, drill_point: str, max_depth: str | None
) -> Drill | None:
    """Read --drill and what goes with it."""
    diameter = options.quantity("--drill", drill, "length", positive=True)
    rho = options.quantity("--density", density, "density", positive=True)
    if (diameter is None) != (rho is None):
        raise options.bad("--density" if rho is None else "--drill", "expected both --drill and --density")
    deepest = options.quantity("--max-depth", max_depth, "length", positive=True)
    if deepest is not None and diameter is None:
        raise options.bad("--max-depth", "is for --drill")
    point = options.needed("--drill-point", drill_point, "angle", positive=True)
    if point > math.pi * (1 + 1e-15):
        raise options.bad("--drill-point", "expected at most 180deg")
    if diameter is None or rho is None:
        return None
    return Drill(diameter, rho, min(point, math.pi), deepest)


def read_stock(stock: str | None) -> list[float] | None:
    """Read --stock."""
    if stock is None:
        return None
    return [options.needed("--stock", part, "mass", positive=True) for part in stock.split(",")]


def read_planes(at_z: str | None, to_z: str | None) -> tuple[float, list[float]] | None:
    """Read --at-z and --to-z."""
    at = options.quantity("--at-z", at_z, "length")
    if (at is None) != (to_z is None):
        raise options.bad("--to-z" if to_z is None else "--at-z", "expected both --at-z and --to-z")
    if at is None or to_z is None:
        return None
    planes = [options.needed("--to-z", part, "length") for part in to_z.split(":")]
    if len(planes) < 2:
        raise options.bad("--to-z", f"'{to_z}': expected two planes or more, such as 0mm:90mm")
    if len(set(planes)) < len(planes):
        raise options.bad("--to-z", f"'{to_z}': two planes lie at the same place")
    return at, planes
