"""Corrections to be placed, from vectors or from a file that `dalembert field` or `balance` wrote, and the options of placing."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

from cli.read import options
from dalembert.errors import DataError, quote
from dalembert.tables.files import SUFFIXES, read_bytes, remember, split_sheet


class Vector(NamedTuple):
    """A mass at an angle, in the units of the user."""

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
    exact_point: Fraction
    """In degrees, as it is written."""


@dataclass(frozen=True)
class Request:
    """Where and how masses go; angles in degrees."""

    places: list[float] | None
    limit: float | None
    stock: list[float] | None
    weights: list[float] | None
    """Of fixed mass, to stand at any angle."""
    pieces: int
    max_pieces: int | None
    radii: tuple[float, float] | None
    """Of the corrections and of the places."""
    drill: Drill | None
    planes: tuple[float, list[float]] | None
    """Where along the shaft the corrections are, and the planes they are carried over to, m."""
    remove: bool
    exact_places: Callable[[], list[Fraction]]
    """The places as they are written, in degrees; worked out on request."""

    @property
    def ratio(self) -> float:
        """Radius of the corrections over that of the places."""
        return 1.0 if self.radii is None else self.radii[0] / self.radii[1]

    @property
    def removes(self) -> bool:
        """Whether material is removed at the places."""
        return self.remove or self.drill is not None


class Correction(NamedTuple):
    """A correction to be placed by itself: of a rotor's plane in a file, or of vectors that are added up."""

    rotor: str
    plane: str
    vectors: list[Vector]
    removed: bool = False
    """Whether the file states that it is material to remove."""

    @property
    def unit(self) -> str:
        """The unit masses are shown in."""
        return self.vectors[0].mass_unit

    @property
    def name(self) -> str:
        """Its name where there are several."""
        return f"rotor {self.rotor}, plane {self.plane}"


def read_corrections(words: list[str], rotor: str | None, plane: str | None) -> list[Correction]:
    """Read MASS@ANGLE ..., or one file, of which --rotor and --plane choose."""
    file = words[0]
    if not _is_file(file):
        options.refuse("chooses among the corrections of a file: expected a file", rotor=rotor, plane=plane)
        return [Correction("1", "1", [read_vector(word) for word in words])]
    if len(words) > 1:
        raise options.bad("MASS@ANGLE", f"'{words[1]}': expected nothing in addition to a file")
    corrections = _of_json(file) if file.lower().endswith(".json") else _of_table(file)
    for noun, wanted, field in (("rotor", rotor, 0), ("plane", plane, 1)):
        if wanted is None:
            continue
        names = dict.fromkeys(str(each[field]) for each in corrections)
        corrections = [each for each in corrections if each[field] == wanted]
        if not corrections:
            raise DataError(f"{file}: no {noun} {quote(wanted)}: expected one of {', '.join(names)}")
    return corrections


def _is_file(text: str) -> bool:
    """Whether a word is a file and no MASS@ANGLE."""
    path, _ = split_sheet(text)
    suffix = Path(path).suffix.lower() in (".csv", ".txt", ".json", *SUFFIXES)
    return text == "-" or suffix or ("@" not in text and Path(path).is_file())


def _of_table(path: str) -> list[Correction]:
    from dalembert.tables.table import read

    # further columns of such a table: no warning that they are ignored
    further = {"mass_uncertainty": "mass", "angle_uncertainty": "angle", "z": "length", "radius": "length"}
    further |= {"trim_mass": "mass", "trim_angle": "angle"}
    table = read(
        path,
        numbers={"mass": "mass", "angle": "angle", "unbalance": "unbalance", "weight": "force", **further},
        texts=["rotor", "plane"],
        blank=list(further),
    )
    if "mass" not in table.numbers and "unbalance" in table.numbers:
        raise DataError(
            f"{table.file}: corrections as unbalances: expected masses, as trial masses in the runs give them"
        )
    mass, angle = table.require("mass", "mass"), table.require("angle", "angle")
    table.reject(mass.values < 0, "mass", "a mass that is not negative")
    names = [table.named(name) for name in ("rotor", "plane")]
    return [
        Correction(rotor, plane, [Vector(m, mass.unit, a, angle.unit)])
        for rotor, plane, m, a in zip(*names, mass.values.tolist(), angle.values.tolist(), strict=True)
    ]


def _of_json(path: str) -> list[Correction]:
    import json

    remember(path)
    file, data = read_bytes(path)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise DataError(f"{file}: no valid JSON: {error}") from None
    try:
        removed = document.get("correction") == "remove"
        corrections = [
            Correction(str(rotor["rotor"]), str(one["plane"]), [_vector(one)], removed)
            for rotor in document["rotors"]
            for one in rotor["corrections"]
        ]
    except (AttributeError, KeyError, TypeError, ValueError):
        corrections = []
    if not corrections:
        raise DataError(
            f"{file}: no corrections with plane, mass_kg and angle_deg below rotors: expected the JSON of dalembert field"
        )
    return corrections


def _vector(one: Mapping[str, str | float]) -> Vector:
    mass, angle = float(one["mass_kg"]), float(one["angle_deg"])
    if not (0 <= mass <= 1e60 and abs(angle) <= 1e60):
        raise ValueError
    return Vector(mass, "kg", angle, "deg")


def read_vector(spec: str) -> Vector:
    """Read `83.5g@308.87deg`."""
    expected = f"'{spec}': expected a mass and an angle, such as 83.5g@308.87deg"
    return Vector(*options.mass_at("MASS@ANGLE", spec, spec, "mass", expected))


def _both(one: str, value: object, other: str, second: object) -> None:
    """Refuse one of two options without the other."""
    if (value is None) != (second is None):
        raise options.bad(one if value is None else other, f"expected both {one} and {other}")


def read_radii(at_radius: str | None, to_radius: str | None) -> tuple[float, float] | None:
    """Read --at-radius and --to-radius."""
    at = options.quantity("--at-radius", at_radius, "length", positive=True)
    to = options.quantity("--to-radius", to_radius, "length", positive=True)
    _both("--at-radius", at, "--to-radius", to)
    return None if at is None or to is None else (at, to)


def read_drill(
    drill: str | None, density: str | None, drill_point: str, max_depth: str | None
) -> Drill | None:
    """Read --drill and what goes with it."""
    diameter = options.quantity("--drill", drill, "length", positive=True)
    rho = options.quantity("--density", density, "density", positive=True)
    _both("--drill", diameter, "--density", rho)
    deepest = options.quantity("--max-depth", max_depth, "length", positive=True)
    if deepest is not None and diameter is None:
        raise options.bad("--max-depth", "is for --drill")
    point = options.needed("--drill-point", drill_point, "angle", positive=True)
    if point > math.pi * (1 + 1e-15):
        raise options.bad("--drill-point", "expected at most 180deg")
    if diameter is None or rho is None:
        return None
    return Drill(
        diameter, rho, min(point, math.pi), deepest, min(options.exact_degrees(drill_point), Fraction(180))
    )


def read_planes(at_z: str | None, to_z: str | None) -> tuple[float, list[float]] | None:
    """Read --at-z and --to-z."""
    at = options.quantity("--at-z", at_z, "length")
    _both("--at-z", at, "--to-z", to_z)
    if at is None or to_z is None:
        return None
    planes = [options.needed("--to-z", part, "length") for part in to_z.split(":")]
    if len(planes) < 2:
        raise options.bad("--to-z", f"'{to_z}': expected two planes or more, such as 0mm:90mm")
    if len(set(planes)) < len(planes):
        raise options.bad("--to-z", f"'{to_z}': two planes lie at the same place")
    return at, planes
