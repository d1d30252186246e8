"""From a table of eccentric masses to the corrections of each rotor, in every form they are shown in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing import GRADES, CoincidentPlanes, Correction, allocate, by_size, correct
from cli.errors import DataError, quote
from cli.read.planes import Planes
from cli.read.rounding import EPS, angle_error, angle_text, size_error, vector_error
from cli.read.tables import LARGE, Table, read
from cli.read.units import degrees, from_si, phasor, to_si
from cli.show.output import Shown

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

NEAR = 20.0  # from this growth of errors on the planes are said to be near each other


@dataclass(frozen=True)
class Wanted:
    """What the options ask for."""

    gravity: float
    remove: bool
    mass_step: tuple[float, str] | None
    angle_step: tuple[float, str] | None
    center: float | None
    tolerance: tuple[str | None, float, tuple[float, float] | None] | None


@dataclass(frozen=True)
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
            f"a radius, or an unbalance (the header is: {', '.join(table.header)})"
        )
    (amount,) = amounts
    given = table.numbers[amount]
    table.reject(given.values < 0, amount, f"a {amount} that is not negative")
    size = to_si(given.values, known[amount], given.unit)
    radius = None
    if amount != "unbalance":
        radius = table.require("radius", "length")
        table.reject(radius.values < 0, "radius", "a radius that is not negative")
        table.reject(
            (radius.values == 0) & (given.values > 0), "radius", "a positive radius, for there is a mass"
        )
        size = size * to_si(radius.values, "length", radius.unit)
        if amount == "weight":
            size = size / gravity
    angle = table.require("angle", "angle")
    z = table.require("z", "length") if needs_z else table.numbers.get("z")
    names, rotor = number_names(table.texts.get("rotor") or ["1"] * table.rows)
    radius_unit = radius.unit if radius is not None else None
    return Rotors(
        table,
        names,
        rotor,
        phasor(size, angle.values, angle.unit),
        None if z is None else to_si(z.values, "length", z.unit),
        given.unit if amount == "mass" else "kg" if amount == "weight" else given.unit.split("_")[0],
        given.unit if amount == "unbalance" else {"in": "oz_in", "m": "kg_m"}.get(radius_unit or "", "g_mm"),
        radius_unit,
        amount == "weight",
    )


def number_names(names: list[str]) -> tuple[list[str], NDArray[np.intp]]:
    """Number names in the order in which they first stand."""
    if len(names) >= LARGE:
        import pandas as pd

        codes, unique = pd.factorize(np.array(names, dtype=object))
        return unique.tolist(), codes.astype(np.intp)
    first: dict[str, int] = {}
    codes = np.array([first.setdefault(name, len(first)) for name in names], dtype=np.intp)
    return list(first), codes


def balance(rotors: Rotors, planes: Planes, wanted: Wanted) -> Shown:
    """Balance every rotor and return the result ready to be shown."""
    result = _Balanced(rotors, planes, wanted)
    return Shown(
        document=result.document,
        columns=result.columns(),
        keys=("rotor", "plane"),
        notes=result.notes,
        afterword=result.verdicts,
        figure=result.figure,
        errors=result.errors,
        warnings=[*rotors.table.warnings, *result.warnings],
    )


@dataclass
class _Balanced:
    """The corrections as given out, one row per rotor and plane, and what they leave; all in SI."""

    rotors: Rotors
    planes: Planes
    wanted: Wanted
    warnings: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        rotors, planes, wanted = self.rotors, self.planes, self.wanted
        n = len(rotors.names)
        first, count = planes.rows(rotors.names, rotors.table.file)
        self.start = np.cumsum(count) - count
        self.count = count
        self.rotor_of_row = np.repeat(np.arange(n), count)
        self.plane_of_row = np.arange(count.sum()) - np.repeat(self.start - first, count)
        self.has_z = rotors.z is not None
        plane_z = planes.z if planes.z is not None else np.zeros(len(planes.name))
        z = rotors.z if rotors.z is not None else np.zeros(len(rotors.moment))
        # the couple needs axial positions of the masses and a plane to refer to
        self.has_couple = self.has_z and (planes.z is not None or wanted.center is not None)
        self.about = np.full(n, wanted.center) if wanted.center is not None else plane_z[first]
        self.static = np.empty(n, dtype=complex)
        self.couple = np.empty(n, dtype=complex)
        self.residual_static = np.empty(n, dtype=complex)
        self.residual_couple = np.empty(n, dtype=complex)
        self.growth = np.ones(n)
        bearings = wanted.tolerance[2] if wanted.tolerance is not None else None
        if bearings is not None and not self.has_z:
            rotors.table.require("z", "length")
        if bearings is not None and planes.z is None:
            raise DataError(
                "--bearings: the tolerance in the bearings needs the place of the plane: --plane NAME:Z:RADIUS"
            )
        shape = (n, 2) if bearings is not None else len(self.rotor_of_row)
        self.ideal = np.empty(len(self.rotor_of_row), dtype=complex)
        self.made = np.empty(len(self.rotor_of_row), dtype=complex)
        self.before: Complex = np.empty(shape, dtype=complex)  # in the tolerance planes
        self.after: Complex = np.empty(shape, dtype=complex)
        self.solved: list[tuple[NDArray[np.intp], NDArray[np.intp], Correction]] = []
        for group, masses, rows in self._groups():
            u = np.where(masses >= 0, rotors.moment[masses], 0)
            at = np.where(masses >= 0, z[masses], 0)
            try:
                fix = correct(u, at, plane_z[self.plane_of_row[rows]])
            except CoincidentPlanes as error:
                name = rotors.names[group[int(np.argmax(error.rotors))]]
                raise DataError(f"rotor {quote(name)}: {error}") from None
            self.static[group] = fix.static
            self.couple[group] = fix.couple(self.about[group])
            self.ideal[rows] = fix.unbalance
            self.growth[group] = fix.amplification
            self.solved.append((group, rows, fix))
        self._round()
        for group, rows, fix in self.solved:
            left = fix.residual_of(self.made[rows], self.about[group])
            self.residual_static[group], self.residual_couple[group] = left
            if bearings is not None:
                self.before[group] = -correct(fix.moment, fix.z, bearings).unbalance
                corrected = np.concatenate([fix.moment, self.made[rows]], axis=-1)
                self.after[group] = -correct(
                    corrected, np.concatenate([fix.z, fix.planes], axis=-1), bearings
                ).unbalance
            else:
                self.before[rows] = -self.ideal[rows]
                self.after[rows] = self.made[rows] - self.ideal[rows]
        self._warn()

    def _groups(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]]:
        """Yield rotors of like size: their numbers, the places of their masses, the rows of their planes."""
        for group, masses in by_size(self.rotors.rotor):
            for planes in np.flatnonzero(np.bincount(self.count[group])):
                same = self.count[group] == planes
                yield group[same], masses[same], self.start[group[same], None] + np.arange(planes)

    def _round(self) -> None:
        """Turn the ideal corrections into those given out: mass and angle as printed, and their unbalance."""
        radius = self.planes.radius[self.plane_of_row]
        unit = self.rotors.mass_unit
        self.angle_deg = degrees(-self.ideal if self.wanted.remove else self.ideal)
        self.mass = from_si(np.abs(self.ideal) / radius, "mass", unit)
        if self.wanted.mass_step is None and self.wanted.angle_step is None:
            self.made = self.ideal
            return
        if self.wanted.mass_step is not None:
            step, step_unit = self.wanted.mass_step
            if step_unit != unit:
                step = float(from_si(to_si(step, "mass", step_unit), "mass", unit))
            self.mass = _to_step(self.mass, step)
        if self.wanted.angle_step is not None:
            step, step_unit = self.wanted.angle_step
            step = step if step_unit == "deg" else float(np.degrees(step))
            self.angle_deg = _to_step(self.angle_deg, step) % 360.0
        given = phasor(to_si(self.mass, "mass", unit) * radius, self.angle_deg, "deg")
        self.made = -given if self.wanted.remove else given

    def _warn(self) -> None:
        near = np.flatnonzero(self.growth > NEAR)
        for r in near[:5]:
            self.warnings.append(
                f"rotor {self.rotors.names[r]}: the correction planes lie so close to each other, beside the masses, "
                f"that errors grow by a factor of {self.growth[r]:.3g}"
            )
        if len(near) > 5:
            self.warnings.append(f"… and so do those of {len(near) - 5} further rotors")
        if self.wanted.tolerance is None:
            return
        grade, _, bearings = self.wanted.tolerance
        if grade is not None and float(grade[1:]) not in GRADES:
            self.warnings.append(f"{grade} is not among the grades of ISO 21940-11; used as given")
        if self.wanted.center is None and (bearings is not None or (self.count == 2).any()):
            self.warnings.append(
                "no --center-z: the permissible residual unbalance is shared equally between the planes"
            )

    # -- shown ---------------------------------------------------------------------------------------------

    def columns(self) -> dict[str, Any]:
        """The CSV: one row per rotor and plane, in the input's own units."""
        rotors, planes, row = self.rotors, self.planes, self.plane_of_row
        z_unit = rotors.table.numbers["z"].unit if "z" in rotors.table.numbers else planes.z_unit
        radius_unit = rotors.radius_unit or planes.radius_unit
        amount = np.abs(self.made)
        columns: dict[str, Any] = {
            "rotor": [rotors.names[r] for r in self.rotor_of_row],
            "plane": [planes.name[p] for p in row],
        }
        if planes.z is not None:
            columns[f"z_{z_unit}"] = from_si(planes.z[row], "length", z_unit)
        columns[f"radius_{radius_unit}"] = from_si(planes.radius[row], "length", radius_unit)
        columns[f"unbalance_{rotors.unbalance_unit}"] = from_si(amount, "unbalance", rotors.unbalance_unit)
        columns[f"mass_{rotors.mass_unit}"] = self.mass
        if rotors.weights:
            columns["weight_N"] = self._mass_kg * self.wanted.gravity
        columns["angle_deg"] = self.angle_deg
        return columns

    def errors(self) -> dict[str, Any]:
        """Bounds of the rounding errors of the corrections: of the solution, and of the masses' own vectors."""
        rotors, row = self.rotors, self.rotor_of_row
        angle = rotors.table.numbers["angle"]
        wrong = np.bincount(rotors.rotor, vector_error(np.abs(rotors.moment), angle.values, angle.unit))
        rounding = np.empty(len(row))
        for _, rows, fix in self.solved:
            rounding[rows] = fix.error_estimate()
        bound = rounding + (wrong * self.growth)[row] + self._of_places()[row]
        radius = self.planes.radius[self.plane_of_row]
        return {
            f"unbalance_{rotors.unbalance_unit}": from_si(
                size_error(self.ideal, bound), "unbalance", rotors.unbalance_unit
            ),
            f"mass_{rotors.mass_unit}": from_si(
                size_error(self.ideal, bound) / radius, "mass", rotors.mass_unit
            ),
            "weight_N": size_error(self.ideal, bound) / radius * self.wanted.gravity,
            "angle_deg": angle_error(self.ideal, bound, self.angle_deg),
        }

    def _of_places(self) -> Real:
        """Bounds of what the rounding of axial positions as written does to the corrections, for each rotor."""
        rotors, n = self.rotors, len(self.rotors.names)
        if rotors.z is None or self.planes.z is None:
            return np.zeros(n)
        z = self.planes.z[self.plane_of_row]
        apart = np.maximum.reduceat(z, self.start) - np.minimum.reduceat(z, self.start)
        # masses at one place are misplaced together
        place = np.lexsort((rotors.z, rotors.rotor))
        new = (np.diff(rotors.rotor[place]) != 0) | (np.diff(rotors.z[place]) != 0)
        first = np.concatenate([[0], np.flatnonzero(new) + 1])
        there = np.abs(np.add.reduceat(rotors.moment[place], first)) * np.abs(rotors.z[place[first]])
        turned = np.bincount(rotors.rotor[place[first]], there, minlength=n)
        turned += np.add.reduceat(np.abs(self.ideal) * np.abs(z), self.start)
        return np.asarray(np.divide(2 * EPS * turned, apart, out=np.zeros(n), where=apart > 0))

    @property
    def _mass_kg(self) -> Real:
        return np.asarray(to_si(self.mass, "mass", self.rotors.mass_unit))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        planes = self.planes
        mass, amount = self._mass_kg.tolist(), np.abs(self.made).tolist()
        angle, row = self.angle_deg.tolist(), self.plane_of_row.tolist()
        z = [None] * len(planes.name) if planes.z is None else planes.z.tolist()
        radius = planes.radius.tolist()
        couple = self.has_couple
        documents = []
        for r, name in enumerate(self.rotors.names):
            rows = range(self.start[r], self.start[r] + self.count[r])
            documents.append(
                {
                    "rotor": name,
                    "initial": {
                        "static_unbalance_kg_m": abs(self.static[r]),
                        "static_angle_deg": degrees(self.static[r]),
                        "couple_unbalance_kg_m2": abs(self.couple[r]) if couple else None,
                        "couple_angle_deg": degrees(self.couple[r]) if couple else None,
                        "couple_about_z_m": self.about[r] if couple else None,
                    },
                    "corrections": [
                        {
                            "plane": planes.name[row[i]],
                            "z_m": z[row[i]],
                            "radius_m": radius[row[i]],
                            "unbalance_kg_m": amount[i],
                            "mass_kg": mass[i],
                            "weight_N": mass[i] * self.wanted.gravity,
                            "angle_deg": angle[i],
                        }
                        for i in rows
                    ],
                    "residual": {
                        "static_unbalance_kg_m": abs(self.residual_static[r]),
                        "couple_unbalance_kg_m2": abs(self.residual_couple[r]) if couple else None,
                    },
                }
            )
            if self.wanted.tolerance is not None:
                grade, whole, _ = self.wanted.tolerance
                documents[-1]["tolerance"] = {
                    "grade": grade,
                    "permissible_kg_m": whole,
                    "planes": [
                        {
                            "plane": plane,
                            "permissible_kg_m": share,
                            "initial_kg_m": before,
                            "within": before <= share,
                            "residual_kg_m": after,
                            "residual_within": after <= share,
                        }
                        for plane, share, before, after in self._verdict(r)
                    ],
                }
        return {"correction": "remove" if self.wanted.remove else "add", "rotors": documents}

    def _verdict(self, r: int) -> list[tuple[str, float, float, float]]:
        """Return for each tolerance plane of a rotor: name, permissible, initial and residual unbalance."""
        assert self.wanted.tolerance is not None
        _, whole, bearings = self.wanted.tolerance
        rows: slice | int = r
        if bearings is not None:
            names, places = ["bearing 1", "bearing 2"], list(bearings)
        else:
            rows = slice(self.start[r], self.start[r] + self.count[r])
            here = self.plane_of_row[rows]
            names = [self.planes.name[p] for p in here]
            places = self.planes.z[here].tolist() if self.planes.z is not None else []
        if len(names) == 2 and self.wanted.center is not None:
            shares = allocate(whole, self.wanted.center, *places)
        else:
            shares = np.full(len(names), whole / len(names))
        before, after = np.abs(self.before[rows]), np.abs(self.after[rows])
        return list(zip(names, shares.tolist(), before.tolist(), after.tolist(), strict=True))

    def notes(self) -> str:
        """Say what the rotors were like before and after, above the terminal's table."""
        unit = self.rotors.unbalance_unit
        length = self.rotors.radius_unit or self.planes.z_unit or "mm"
        lines = []
        masses = np.bincount(self.rotors.rotor)

        def couple(value: complex) -> str:
            size = from_si(from_si(abs(value), "unbalance", unit), "length", length)
            return (
                f"{size:.6g} {unit.replace('_', '·')}·{length}".replace("mm·mm", "mm²")
                .replace("in·in", "in²")
                .replace("m·m", "m²")
            )

        def static(value: complex) -> str:
            return f"{from_si(abs(value), 'unbalance', unit):.6g} {unit.replace('_', '·')}"

        for r, name in enumerate(self.rotors.names[:10]):
            lines.append(f"rotor {name}: {masses[r]} unbalance{'' if masses[r] == 1 else 's'}")
            line = f"  initial   static {static(self.static[r])} at {angle_text(degrees(self.static[r]), '.2f')}°"
            after = f"  residual  static {static(self.residual_static[r])}"
            if self.has_couple:
                about = f"about z = {from_si(self.about[r], 'length', length):g} {length}"
                line += f", couple {couple(self.couple[r])} at {angle_text(degrees(self.couple[r]), '.2f')}° {about}"
                after += f", couple {couple(self.residual_couple[r])}"
            lines += [line, after]
        if len(self.rotors.names) > 10:
            lines.append(f"… and {len(self.rotors.names) - 10} further rotors")
        return "\n".join([*lines, "", f"material to {'remove' if self.wanted.remove else 'add'}:"])

    def verdicts(self) -> str:
        """Say whether the rotors are within tolerance, below the terminal's table."""
        if self.wanted.tolerance is None:
            return ""
        grade, whole, _ = self.wanted.tolerance
        unit = self.rotors.unbalance_unit
        name = unit.replace("_", "·")
        lines = [
            f"tolerance {grade or ''}: U_per = {from_si(whole, 'unbalance', unit):.6g} {name}".replace(
                " :", ":"
            )
        ]
        for r, rotor in enumerate(self.rotors.names[:10]):
            for plane, share, before, after in self._verdict(r):
                b, s, a = (from_si(value, "unbalance", unit) for value in (before, share, after))
                lines.append(
                    f"  rotor {rotor}, {plane}: permissible {s:.6g}, initial {b:.6g} ({'within' if before <= share else 'beyond'}), "
                    f"residual {a:.6g} ({'within' if after <= share else 'beyond'})"
                )
        return "\n".join(lines)

    def figure(self) -> Any:
        """Draw the first rotors, a panel for each plane."""
        from cli.balance.picture import draw

        shown = range(min(len(self.rotors.names), 4))
        panels = []
        mass_names = self.rotors.table.texts.get("name") or [
            str(i + 1) for i in range(self.rotors.table.rows)
        ]
        for r in shown:
            mine = np.flatnonzero(self.rotors.rotor == r)
            rows = slice(self.start[r], self.start[r] + self.count[r])
            here = self.plane_of_row[rows]
            at = self.rotors.z[mine, None] if self.rotors.z is not None else np.zeros((len(mine), 1))
            plane_z = self.planes.z[here] if self.planes.z is not None else np.zeros(len(here))
            # each mass alone, carried to the planes as they will balance it
            shares = -correct(self.rotors.moment[mine, None], at, plane_z).unbalance
            panels.append(
                (
                    self.rotors.names[r] if len(self.rotors.names) > 1 else "",
                    [mass_names[i] for i in mine],
                    [self.planes.name[p] for p in here],
                    from_si(shares, "unbalance", self.rotors.unbalance_unit),
                    from_si(self.made[rows], "unbalance", self.rotors.unbalance_unit),
                )
            )
        return draw(panels, self.rotors.unbalance_unit.replace("_", "·"), remove=self.wanted.remove)


def _to_step(value: Real, step: float) -> Real:
    """Round to a multiple of a step; a step such as 0.1 divides by 10, which prints as it should."""
    inverse = round(1 / step) if step < 1 else 0
    if inverse and abs(inverse * step - 1) < 4e-16:
        return np.asarray(np.rint(value * inverse) / inverse)
    return np.asarray(np.rint(value / step) * step)
