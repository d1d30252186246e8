"""From a table of eccentric masses to the corrections of each rotor, as they are made, and what these leave; in SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing import CoincidentPlanes, Correction, UnreachedMode, by_size, correct, modal_corrections
from balancing.planes import Planes
from cli.read.rotor_options import Tolerance, Verdict
from dalembert.angles import degrees, phasor
from dalembert.arithmetic.exact import EPS
from dalembert.dataclass import dataclass, field
from dalembert.errors import DataError, quote
from dalembert.tables.table import Table, read
from dalembert.units import UNITS, from_si, to_si

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from fractions import Fraction

    from balancing import ModalCorrection
    from balancing.mode_shapes import Modes
    from dalembert.arithmetic.doubled_arrays import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
DIMENSIONS = {
    "mass": "mass",
    "weight": "force",
    "unbalance": "unbalance",
    "radius": "length",
    "angle": "angle",
    "z": "length",
}
"""The dimensions of the columns of a table of masses."""
AMOUNTS = ("mass", "weight", "unbalance")


@dataclass(frozen=True, eq=False, repr=False)
class Rotors:
    """The masses of a table, in SI, and the units the table is written in."""

    table: Table
    names: list[str]
    rotor: NDArray[np.intp]
    size: Real
    """The unbalances without their angles."""
    moment: Complex
    z: Real | None
    mass_unit: str
    unbalance_unit: str
    radius_unit: str | None
    weight_unit: str
    """Empty where the table has masses or unbalances."""

    def exact(self, gravity: float) -> Vectors:
        """The unbalances of the decimals of the file, in 32 digits."""
        from dalembert.tables.exact import vectors, written

        read = self.table.numbers
        amount = next(read[name] for name in AMOUNTS if name in read)
        sizes = amount.exact
        if "radius" in read and amount is not read.get("unbalance"):
            sizes = [size * radius for size, radius in zip(sizes, read["radius"].exact, strict=True)]
        if self.weight_unit:
            sizes = [size / written(gravity) for size in sizes]
        return vectors(sizes, read["angle"])


def read_rotors(path: str, gravity: float, *, needs_z: bool) -> Rotors:
    """Read masses or weights with their radii, or unbalances, with angles and, if needed, axial positions."""
    needed = [AMOUNTS, ("radius", "unbalance"), ("angle",), *([("z",)] if needs_z else [])]
    table = read(path, numbers=DIMENSIONS, texts=["rotor", "name"], needed=needed)
    amounts = [name for name in AMOUNTS if name in table.numbers]
    if len(amounts) > 1:
        both = " and ".join(table.numbers[name].header for name in amounts)
        raise DataError(
            f"{table.file}: mixed columns {both}: expected masses, weights or unbalances, one of them"
        )
    if not amounts:
        raise DataError(
            f"{table.file}: no column mass_kg (or mass_g, weight_N, unbalance_g_mm …): expected a mass or weight with "
            f"a radius, or an unbalance {table.hint}"
        )
    (amount,) = amounts
    column = table.numbers[amount]
    table.reject(column.values < 0, amount, f"a{'n' * (amount == 'unbalance')} {amount} that is not negative")
    size = column.si
    radius = None
    if amount != "unbalance":
        radius = table.require("radius", "length")
        table.reject(radius.values < 0, "radius", "a radius that is not negative")
        table.reject(
            (radius.values == 0) & (column.values > 0), "radius", "a positive radius, for there is a mass"
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
        size,
        phasor(size, angle.values, angle.unit),
        None if z is None else z.si,
        {"lbf": "lb"}.get(column.unit, "kg") if amount == "weight" else column.unit.split("_")[0],
        column.unit if amount == "unbalance" else {"in": "oz_in", "m": "kg_m"}.get(radius_unit or "", "g_mm"),
        radius_unit,
        column.unit if amount == "weight" else "",
    )


@dataclass(frozen=True, eq=False, repr=False)
class Request:
    """The request of the options."""

    gravity: float
    remove: bool
    mass_step: tuple[float, str] | None
    angle_step: float | None
    center: float | None
    tolerance: Tolerance | None
    modes: Modes | None = None
    """The modes whose modal sums are to vanish, in place of force and couple alone."""
    masses: Mapping[str, float] = field(default_factory=dict)
    """Plane -> the mass that its correction is to have, kg: where the plane has no radius, that is sought."""
    carried: Carried | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Carried:
    """Two bearings that carry the rotor at a speed, to show their forces."""

    bearings: tuple[float, float]
    speed: float
    mass: float | None
    """Mass of the rotor, kg; None: unknown."""


@dataclass(eq=False, repr=False)
class Balancing:
    """The corrections as given out, one row per rotor and plane, and what they leave; all in SI."""

    rotors: Rotors
    planes: Planes
    request: Request
    executor: Executor | None = None
    solved: list[tuple[NDArray[np.intp], NDArray[np.intp], Correction]] = field(default_factory=list)
    """For rotors of equal size: their numbers, the rows of their planes, their corrections."""

    def __post_init__(self) -> None:
        rotors, planes, request = self.rotors, self.planes, self.request
        n = len(rotors.names)
        first, self.count = planes.rows(rotors.names, rotors.table.file)
        self.start = np.cumsum(self.count) - self.count
        self.rotor_of_row = np.repeat(np.arange(n), self.count)
        self.plane_of_row = np.arange(self.count.sum()) - np.repeat(self.start - first, self.count)
        plane_z = planes.z if planes.z is not None else np.zeros(len(planes.name))
        z = rotors.z if rotors.z is not None else np.zeros(len(rotors.moment))
        # the couple needs axial positions of the masses and a plane to refer to
        self.has_couple = rotors.z is not None and (planes.z is not None or request.center is not None)
        self.about = np.full(n, request.center) if request.center is not None else plane_z[first]
        self.static, self.couple, self.residual_static, self.residual_couple = np.empty((4, n), dtype=complex)
        self.growth = np.ones(n)
        self.ideal = np.empty(len(self.rotor_of_row), dtype=complex)
        for group, masses, rows in self._groups():
            u = np.where(masses >= 0, rotors.moment[masses], 0)
            at = np.where(masses >= 0, z[masses], 0)
            try:
                fix = correct(u, at, plane_z[self.plane_of_row[rows]], self.executor)
            except CoincidentPlanes as error:
                name = rotors.names[group[int(np.argmax(error.rotors))]]
                raise DataError(f"rotor {quote(name)}: {error}") from None
            size, lever = np.abs(u), np.abs(at - self.about[group, None])
            self.static[group] = _nonzero(fix.static, size.sum(axis=-1))
            self.couple[group] = _nonzero(fix.couple(self.about[group]), (size * lever).sum(axis=-1))
            self.growth[group] = fix.amplification
            terms = fix.amplification * size.sum(axis=-1)
            self.ideal[rows] = _nonzero(fix.unbalance, terms[:, None])
            self.solved.append((group, rows, fix))
        self.modal: list[tuple[NDArray[np.intp], NDArray[np.intp], ModalCorrection]] = []
        """Where modes are given: of rotors of like size their numbers, the rows of their planes, their corrections."""
        if request.modes is not None:
            self._modal(request.modes, z, plane_z)
        self.mass, self.angle, self.made = self._given_out()
        for group, rows, fix in self.solved:
            added = self.made[rows].any(axis=-1)
            static, couple = fix.residual_of(self.made[rows], self.about[group])
            # of nothing nothing is left
            self.residual_static[group] = np.where(added | (self.static[group] != 0), static, 0.0)
            self.residual_couple[group] = np.where(added | (self.couple[group] != 0), couple, 0.0)
        self.before, self.after = self._in_tolerance_planes()

    def _modal(self, modes: Modes, z: Real, plane_z: Real) -> None:
        """Find the corrections that leave the modes without excitation."""
        names, conditions = self.rotors.names, modes.conditions
        for group, masses, rows in self._groups():
            there = masses >= 0
            planes = plane_z[self.plane_of_row[rows]]
            if planes.shape[-1] < len(conditions):
                raise DataError(
                    f"rotor {quote(names[group[0]])}: {len(conditions)} conditions ({', '.join(conditions)}) need at least "
                    f"{len(conditions)} planes, found {planes.shape[-1]}"
                )
            at = np.where(there, z[masses], modes.z[0])
            try:
                fix = modal_corrections(
                    np.where(there, self.rotors.moment[masses], 0),
                    modes.at(at, "a mass"),
                    modes.at(planes, "a plane"),
                )
            except UnreachedMode as error:
                raise DataError(f"{modes.file}: {modes.unreached(error)}") from None
            self.ideal[rows] = fix.unbalance
            self.growth[group] = fix.condition_number
            self.modal.append((group, rows, fix))

    def _groups(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]]:
        """Yield rotors of like size: their numbers, the places of their masses, the rows of their planes."""
        for group, masses in by_size(self.rotors.rotor):
            for planes in np.flatnonzero(np.bincount(self.count[group])):
                same = self.count[group] == planes
                yield group[same], masses[same], self.start[group[same], None] + np.arange(planes)

    def _given_out(self) -> tuple[Real, Real, Complex]:
        """Return the corrections as printed, mass in the table's unit and angle in degrees, and their unbalance."""
        request, unit, radius = self.request, self.rotors.mass_unit, self.radius
        angle = degrees(-self.ideal if request.remove else self.ideal)
        # at radius 0, which a given mass may lead to, there is nothing to correct
        size = np.abs(self.ideal)
        mass = from_si(np.divide(size, radius, out=np.zeros_like(size), where=radius > 0), "mass", unit)
        fixed = self.given_mass
        mass = np.where(np.isnan(fixed), mass, from_si(fixed, "mass", unit))
        if request.mass_step is None and request.angle_step is None:
            made = np.where(
                np.isnan(fixed) | self.sought, self.ideal, phasor(fixed * radius, degrees(self.ideal), "deg")
            )
            return mass, angle, made
        if request.mass_step is not None:
            # a mass that is given is that of the weight there is
            mass = np.where(np.isnan(fixed), _to_step(mass, self.mass_step), mass)
        if request.angle_step is not None:
            angle = _to_mark(angle, request.angle_step)
        rounded = phasor(to_si(mass, "mass", unit) * radius, angle, "deg")
        return mass, angle, -rounded if request.remove else rounded

    @property
    def mass_step(self) -> Fraction:
        """The step of rounded masses, in the table's unit."""
        from fractions import Fraction

        assert self.request.mass_step is not None
        step, of_step = self.request.mass_step
        (a, b), (c, d) = (UNITS["mass"][unit] for unit in (of_step, self.rotors.mass_unit))
        return Fraction(repr(step)) * Fraction(a) / Fraction(b) * Fraction(d) / Fraction(c)

    @cached_property
    def given_mass(self) -> Real:
        """The mass that each row's correction is to have, kg; NaN where it is free."""
        masses = self.request.masses
        return np.array([masses.get(self.planes.name[p], np.nan) for p in self.plane_of_row])

    @cached_property
    def sought(self) -> NDArray[np.bool_]:
        """Which rows have no radius: it follows from the mass."""
        return np.asarray(np.isnan(self.planes.radius[self.plane_of_row]))

    def in_planes(self, places: tuple[float, float]) -> tuple[Complex, Complex]:
        """Return the unbalances before and after as two in planes at these places, (rotors, 2) each."""
        before, after = np.empty((2, len(self.rotors.names), 2), dtype=complex)
        for group, rows, fix in self.solved:
            before[group] = -correct(fix.moment, fix.z, places).unbalance
            corrected = np.concatenate([fix.moment, self.made[rows]], axis=-1)
            at = np.concatenate([fix.z, fix.planes], axis=-1)
            after[group] = -correct(corrected, at, places).unbalance
        return before, after

    def _in_tolerance_planes(self) -> tuple[Complex, Complex]:
        """Return the unbalances before and after: (rotors, 2) in the bearings, else a row for each correction plane."""
        tolerance = self.request.tolerance
        if tolerance is None or tolerance.bearings is None:
            return -self.ideal, self.made - self.ideal
        bearings = tolerance.bearings
        self.rotors.table.require("z", "length")
        if self.planes.z is None:
            raise DataError(
                "--bearings: the tolerance in the bearings needs the place of the plane: --plane NAME:Z:RADIUS"
            )
        return self.in_planes(bearings)

    @cached_property
    def radius(self) -> Real:
        """The radius of each row's plane: as given, or as the mass that is to stand there needs it."""
        radius = np.asarray(self.planes.radius[self.plane_of_row])
        return np.where(self.sought, np.abs(self.ideal) / self.given_mass, radius)

    @property
    def mass_kg(self) -> Real:
        """The masses as given out."""
        return to_si(self.mass, "mass", self.rotors.mass_unit)

    @property
    def unbalance(self) -> Real:
        """The corrections without their angles, as given out."""
        rounded = self.request.mass_step is not None
        return self.mass_kg * self.radius if rounded else np.abs(self.made)

    @property
    def length_unit(self) -> str:
        """The unit in which lengths are said."""
        return self.rotors.radius_unit or self.planes.z_unit or "mm"

    @property
    def couple_unit(self) -> str:
        """The unit of a couple unbalance: that of the unbalances times that of lengths."""
        unbalance, length = self.rotors.unbalance_unit, self.length_unit
        return f"{unbalance}_{length}".replace(f"{length}_{length}", f"{length}2")

    def rows_of(self, rotor: int) -> slice:
        """Return the rows of a rotor's planes."""
        return slice(self.start[rotor], self.start[rotor] + self.count[rotor])

    def masses_of(self, rotor: int) -> NDArray[np.intp]:
        """Return the rows of a rotor's masses."""
        return np.flatnonzero(self.rotors.rotor == rotor)

    def mass_names(self, rotor: int) -> list[str]:
        """Return the names of a rotor's masses, else their numbers in the table."""
        every = self.rotors.table.texts.get("name") or [str(k + 1) for k in range(self.rotors.table.rows)]
        return [every[k] for k in self.masses_of(rotor)]

    def modal_of(self, rotor: int) -> tuple[ModalCorrection, int]:
        """Return the modal corrections that have those of a rotor, and its place there."""
        group, _, fix = next(each for each in self.modal if rotor in each[0])
        return fix, int(np.flatnonzero(group == rotor)[0])

    def conditions_at_masses(self, rotor: int) -> Real:
        """Return the conditions of the modes at a rotor's masses, (q, m)."""
        assert self.request.modes is not None
        assert self.rotors.z is not None
        return self.request.modes.at(self.rotors.z[self.masses_of(rotor)], "a mass")

    def verdicts(self, rotor: int) -> list[Verdict]:
        """Return the tolerance planes of a rotor; none without a tolerance."""
        tolerance = self.request.tolerance
        if tolerance is None:
            return []
        rows: slice | int = rotor
        if tolerance.bearings is not None:
            names, places = ["bearing 1", "bearing 2"], list(tolerance.bearings)
        else:
            rows = self.rows_of(rotor)
            here = self.plane_of_row[rows]
            names = [self.planes.name[p] for p in here]
            places = self.planes.z[here].tolist() if self.planes.z is not None else []
        shares = tolerance.shares(len(names), self.request.center, places)
        before, after = np.abs(self.before[rows]), np.abs(self.after[rows])
        return list(map(Verdict, names, shares.tolist(), before.tolist(), after.tolist()))

    @cached_property
    def exact(self) -> Vectors:
        """The ideal corrections in 32 digits, of the decimals as they are written, one for each row."""
        from fractions import Fraction

        from balancing.second_run import ExactMasses, least_norm
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors
        from dalembert.arithmetic.doubled_operations import doubled_array, part
        from dalembert.tables.exact import writtens

        rotors, none = self.rotors, Doubled(np.zeros(1))
        # behind the masses nothing, which index -1 means
        moment = Vectors.joined([rotors.exact(self.request.gravity), Vectors(none, none)])
        column = rotors.table.numbers.get("z")
        places = [Fraction(0)] * len(rotors.moment) if column is None or rotors.z is None else column.exact
        z = doubled_array([*places, Fraction(0)], (len(places) + 1,))
        planes = writtens(np.zeros(len(self.planes.name)) if self.planes.z is None else self.planes.z)
        result = Vectors.of(np.zeros(len(self.rotor_of_row)))
        modes = self.request.modes
        for _, masses, rows in self._groups():
            there, at = part(planes, self.plane_of_row[rows]), part(z, masses)
            if modes is None:
                result[rows] = ExactMasses(moment[masses], at, there).corrections
                continue
            # where there is no mass any place will do
            at.high[masses < 0], at.low[masses < 0] = modes.z[0], 0.0
            modal = (moment[masses][..., None, :] * modes.exactly_at(DoubledArray.of(at))).sum()
            shapes: Any = modes.exactly_at(DoubledArray.of(there))
            result[rows] = least_norm(Vectors.of_parts(shapes, shapes * 0.0), modal)
        return result


def _nonzero(value: Complex, terms: Real) -> Complex:
    """Return sums of terms of these sizes, zero where they are the rounding of the terms: of masses evenly around, for one."""
    return np.where(np.abs(value) > 4 * EPS * terms, value, 0.0)


def _to_mark(angle: Real, step: float) -> Real:
    """Round to the nearest mark on a circle whose marks begin at 0°; where the step does not divide it, the last gap is smaller."""
    from fractions import Fraction

    mark = _to_step(angle, Fraction(repr(step)))
    return np.where((mark >= 360.0) | (360.0 - angle < np.abs(mark - angle)), 0.0, mark)


def _to_step(value: Real, step: Fraction) -> Real:
    """Round to a multiple of a step, the double nearest to it.

    >>> from fractions import Fraction
    >>> _to_step(np.array([0.88, 0.31]), Fraction("0.3")).tolist()
    [0.9, 0.3]
    """
    return np.asarray(np.rint(value / float(step)) * float(step.numerator) / float(step.denominator))
