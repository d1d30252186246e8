"""A table of eccentric masses, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cli.errors import DataError
from cli.read.tables import Table, read
from cli.read.units import phasor

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False, repr=False)
class Rotors:
    """The masses of a table, in SI, and the units the table is written in."""

    table: Table
    names: list[str]
    rotor: NDArray[np.intp]
    moment: Complex
    z: Real | None
    mass_unit: str
    unbalance_unit: str
    radius_unit: str | None
    weights: bool


def read_rotors(path: str, gravity: float, *, needs_z: bool) -> Rotors:
    """Read masses or weights with their radii, or unbalances, with angles and, if needed, axial positions."""
    known = {
        "mass": "mass",
        "weight": "force",
        "unbalance": "unbalance",
        "radius": "length",
        "angle": "angle",
        "z": "length",
    }
    table = read(path, numbers=known, texts=["rotor", "name"])
    amounts = [name for name in ("mass", "weight", "unbalance") if name in table.numbers]
    if len(amounts) > 1:
        both = " and ".join(table.numbers[name].header for name in amounts)
        raise DataError(
            f"{table.file}: mixed columns {both}: expected masses, weights or unbalances, one of them"
        )
    if not amounts:
        raise DataError(
            f"{table.file}: no column mass_kg (or mass_g, weight_N, unbalance_g_mm …): expected a mass or weight with "
            f"a radius, or an unbalance {table.told}"
        )
    (amount,) = amounts
    given = table.numbers[amount]
    table.reject(given.values < 0, amount, f"a {amount} that is not negative")
    size = given.si
    radius = None
    if amount != "unbalance":
        radius = table.require("radius", "length")
        table.reject(radius.values < 0, "radius", "a radius that is not negative")
        table.reject(
            (radius.values == 0) & (given.values > 0), "radius", "a positive radius, for there is a mass"
        )
        size = size * radius.si
        if amount == "weight":
            size = size / gravity
    angle = table.require("angle", "angle")
    z = table.require("z", "length") if needs_z else table.numbers.get("z")
    names, rotor = table.numbered("rotor", "1")
    radius_unit = radius.unit if radius is not None else None
    return Rotors(
        table,
        names,
        rotor,
        phasor(size, angle.values, angle.unit),
        None if z is None else z.si,
        given.unit if amount == "mass" else "kg" if amount == "weight" else given.unit.split("_")[0],
        given.unit if amount == "unbalance" else {"in": "oz_in", "m": "kg_m"}.get(radius_unit or "", "g_mm"),
        radius_unit,
        amount == "weight",
    )
