"""An engine of a table of cylinders: the orders of its forces, its counterweights and balance shafts, in SI."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing.engine import (
    LONGEST_RATIO,
    Forces,
    opposite,
    reciprocating_forces,
    shaft_unbalances,
    turning_force,
)
from balancing.planes import Planes
from dalembert.angles import phasor
from dalembert.arithmetic.shapes import as_array, in_32_digits
from dalembert.errors import DataError
from dalembert.tables.table import Table, read
from dalembert.units import find_unit

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False, repr=False)
class Cylinders:
    """The cylinders of a table; angles in degrees."""

    table: Table
    names: list[str]
    crank: Real
    bank: Real
    z: Real
    throw: Real
    rod: Real
    reciprocating: Real
    rotating: Real
    unbalance_unit: str
    length_unit: str

    @cached_property
    def pins(self) -> list[list[int]]:
        """The cylinders of each crank pin."""
        pins: dict[tuple[float, float], list[int]] = {}
        for i, pin in enumerate(zip(self.z.tolist(), (self.crank % 360.0).tolist(), strict=True)):
            pins.setdefault(pin, []).append(i)
        return list(pins.values())

    @property
    def in_32_digits(self) -> Cylinders:
        """The cylinders in 32 digits, with the decimals of the table exact."""
        from dalembert.tables.exact import as_written

        numbers: dict[str, Any] = {
            name: as_written(self.table.numbers[name])
            if name in self.table.numbers
            else in_32_digits(getattr(self, name))
            for name in ("crank", "bank", "z", "throw", "rod", "reciprocating", "rotating")
        }
        return replace(self, **numbers)

    @property
    def horizontal(self) -> bool:
        """Whether all axes are horizontal, as a locomotive's."""
        return bool((self.bank % 180.0 == 0).all())


@dataclass(frozen=True, eq=False, repr=False)
class Shaft:
    """A balance shaft: a multiple of the crank's speed, its place, m, and its sense."""

    order: int
    z: float
    against: bool


@dataclass(frozen=True, eq=False, repr=False)
class Counterweights:
    """Unbalances on the crankshaft, kg·m, and the part of each that is for the reciprocating masses."""

    names: list[str]
    z: Real
    unbalance: Complex
    for_reciprocating: Complex
    radius: Real | None


def read_cylinders(path: str) -> Cylinders:
    """Read the table of cylinders.

    Raises
    ------
    DataError
        A missing column, a doubled name, a rod no longer than the throw, masses that are all zero.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> head = "cylinder,crank_deg,z_mm,throw_mm,rod_mm,reciprocating_kg"
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "cylinders.csv")
    ...     _ = table.write_text(f"{head}\\n1,0,0,40,140,0.5\\n2,180,90,40,140,0.5\\n")
    ...     cylinders = read_cylinders(str(table))
    >>> cylinders.pins, cylinders.bank, cylinders.unbalance_unit
    ([[0], [1]], array([90., 90.]), 'kg_mm')

    The first order of two opposite cranks leaves a couple, the second a force:

    >>> engine = Engine(cylinders, 100.0, 2, None, None, [], cylinders.pins)
    >>> force, couple = (np.hypot(*engine.reciprocating.coefficients(of)[:, 1].T) for of in (False, True))
    >>> force.round(3), couple.round(3)
    (array([  0.   , 116.712]), array([18.   ,  5.252]))
    """
    dimensions = {
        "crank": "angle",
        "bank": "angle",
        "z": "length",
        "throw": "length",
        "rod": "length",
        "reciprocating": "mass",
        "rotating": "mass",
    }
    table = read(path, numbers=dimensions, texts=["cylinder"])
    names = table.texts.get("cylinder", [str(i + 1) for i in range(table.rows)])
    for i, name in enumerate(names):
        if name in names[:i]:
            raise table.error(i, "cylinder", name, "each cylinder once")
    throw, rod = table.require("throw", "length"), table.require("rod", "length")
    mass = table.require("reciprocating", "mass")
    table.reject(~(throw.si > 1e-60), "throw", "a positive length")
    table.reject(~(throw.si <= LONGEST_RATIO * rod.si), "rod", "a rod that is longer than the throw")
    table.reject(mass.values < 0, "reciprocating", "a mass that is not negative")
    nothing = np.zeros(table.rows)
    rotating = table.numbers.get("rotating")
    if rotating is not None:
        table.reject(rotating.values < 0, "rotating", "a mass that is not negative")
    rotating_mass = nothing if rotating is None else rotating.si
    if not (mass.si.any() or rotating_mass.any()):
        raise DataError(
            f"{table.file}: column {mass.header}: every mass is zero: expected the reciprocating mass of each cylinder"
        )
    z = table.require("z", "length").si if table.rows > 1 or "z" in table.numbers else nothing
    unit = f"{mass.unit}_{throw.unit}"
    return Cylinders(
        table,
        names,
        _degrees(table, "crank"),
        _degrees(table, "bank") if "bank" in table.numbers else np.full(table.rows, 90.0),
        z,
        throw.si,
        rod.si,
        mass.si,
        rotating_mass,
        unit if find_unit("unbalance", unit) else "kg_m",
        table.numbers["z"].unit if "z" in table.numbers else throw.unit,
    )


def _degrees(table: Table, name: str) -> Real:
    angle = table.require(name, "angle")
    return angle.values if angle.unit == "deg" else np.degrees(angle.si)


@dataclass(frozen=True, eq=False, repr=False)
class Engine:
    """An engine at a speed, and what balances it."""

    cylinders: Cylinders
    speed: float
    highest: int
    share: float | None
    planes: Planes | None
    shafts: list[Shaft]
    pins: list[list[int]]
    """The cylinders of each crank pin, which share its counterweight."""

    @cached_property
    def second(self) -> Engine:
        """The engine in 32 digits, with the decimals of the table and of the options exact."""
        from dalembert.tables.exact import array, rates

        numbers: dict[str, Any] = {
            "cylinders": self.cylinders.in_32_digits,
            "speed": rates(self.speed),
            "share": None if self.share is None else array(self.share),
            "shafts": [replace(shaft, z=array(shaft.z)) for shaft in self.shafts],  # type: ignore[arg-type]
        }
        if self.planes is not None:
            own: dict[str, Any] = {
                name: array(x) for name in ("z", "radius") if (x := getattr(self.planes, name)) is not None
            }
            numbers["planes"] = replace(self.planes, **own)
        return replace(self, **numbers)

    @cached_property
    def reciprocating(self) -> Forces:
        """The forces of the reciprocating mass of each cylinder."""
        c = self.cylinders
        return reciprocating_forces(
            c.crank, c.bank, c.z, c.throw, c.rod, c.reciprocating, self.speed, self.highest
        )

    @cached_property
    def rotating(self) -> Complex:
        """The unbalance of each cylinder's rotating mass at θ = 0, kg·m."""
        c = self.cylinders
        return phasor(c.rotating * c.throw, c.crank, "deg")

    @cached_property
    def counterweights(self) -> Counterweights | None:
        """Those of the rotating masses and a share of the reciprocating ones; None where none are wanted."""
        c = self.cylinders
        if self.share is None and self.planes is None:
            return None
        share = 0.0 if self.share is None else self.share
        bob = phasor(share * c.reciprocating * c.throw, c.crank, "deg")
        if self.planes is not None:
            z = np.zeros(1) if self.planes.z is None else self.planes.z
            every, of_bob = (opposite(u, c.z, z) for u in (self.rotating + bob, bob))
            return Counterweights(self.planes.name, z, every, of_bob, self.planes.radius)
        every, of_bob = (-np.stack([u[pin].sum() for pin in self.pins]) for u in (self.rotating + bob, bob))
        names = ["+".join(c.names[i] for i in pin) for pin in self.pins]
        return Counterweights(names, c.z[[pin[0] for pin in self.pins]], every, of_bob, None)

    @cached_property
    def on_the_crank(self) -> Forces:
        """The forces of the cylinders, the rotating masses and the counterweights."""
        forces = self.reciprocating.joined(
            turning_force(self.rotating, self.cylinders.z, self.speed, self.highest)
        )
        weights = self.counterweights
        if weights is None:
            return forces
        return forces.joined(turning_force(weights.unbalance, weights.z, self.speed, self.highest))

    @cached_property
    def shaft_unbalances(self) -> Complex:
        """The unbalance of each shaft at θ = 0, kg·m."""
        result = np.zeros_like(self.cylinders.z, dtype=complex, shape=len(self.shafts))
        for order, against in {(s.order, s.against) for s in self.shafts}:
            alike = [i for i, s in enumerate(self.shafts) if (s.order, s.against) == (order, against)]
            z = np.stack([as_array(self.shafts[i].z) for i in alike])
            result[alike] = shaft_unbalances(self.on_the_crank, z, self.speed, order, against)
        return result

    @cached_property
    def residual(self) -> Forces:
        """All that shakes the frame."""
        turning = [
            turning_force(u, s.z, self.speed, self.highest, s.order, s.against)
            for s, u in zip(self.shafts, self.shaft_unbalances, strict=True)
        ]
        return self.on_the_crank.joined(*turning)

    @property
    def balanced(self) -> bool:
        """Whether anything balances it."""
        return self.counterweights is not None or bool(self.shafts)
