"""What options and tables state of a rotor: its correction planes (`A:0mm:20mm`), its tolerance (ISO 21940-11, API, MIL)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.planes import Planes
from cli.read.options import bad, needed, quantity, refuse, two_bearings
from dalembert.dataclass import dataclass, replace
from dalembert.quantities import parse_quantity
from dalembert.results.columns import Table, names, number
from dalembert.units import SMALLEST, from_si, to_si, written


def from_options(specs: Sequence[str], flag: str = "--plane", *, sought: bool = False) -> Planes:
    """Read `NAME:RADIUS` (once) or `NAME:Z:RADIUS` (each); `sought`: a RADIUS may be ?, which is NaN here."""
    names: list[str] = []
    z: list[tuple[float, str]] = []
    radii: list[tuple[float, str]] = []
    for spec in specs:
        parts = spec.rsplit(":", 2)
        try:
            if len(parts) < 2 or not parts[0].strip():
                raise ValueError(
                    f"'{spec}': expected NAME:Z:RADIUS, such as A:0mm:20mm, or for one plane NAME:RADIUS"
                )
            unknown = sought and parts[-1].strip() == "?"
            radius = (float("nan"), "") if unknown else parse_quantity(parts[-1], "length")
            if len(parts) == 3:
                z.append(parse_quantity(parts[1], "length"))
        except ValueError as error:
            raise bad(flag, error) from None
        if not unknown and not radius[0] >= SMALLEST:
            raise bad(flag, f"'{spec}': expected a positive radius")
        if parts[0].strip() in names:
            raise bad(flag, f"the plane {parts[0].strip()} is given twice")
        names.append(parts[0].strip())
        radii.append(radius)
    if (z and len(z) < len(names)) or (len(names) > 1 and not z):
        raise bad(
            flag, "with more than one plane each needs its axial position: NAME:Z:RADIUS, such as A:0mm:20mm"
        )
    planes = Planes(
        names,
        np.array([to_si(value, "length", unit) for value, unit in z]) if z else None,
        np.array([to_si(value, "length", unit) if unit else value for value, unit in radii]),
        z[0][1] if z else "",
        next((unit for _, unit in radii if unit), "mm"),
        flag,
    )
    if two := planes.same_place(range(len(names))):
        raise bad(flag, two)
    return planes


# -- tolerance ----------------------------------------------------------------------------------------------

STANDARDS = ("API", "MIL")
"""What --grade takes in addition to the grades of ISO 21940-11."""


class Verdict(NamedTuple):
    """A plane's permissible, initial and remaining unbalance, kg·m; NaN where the readings do not determine it."""

    plane: str
    permissible: float
    initial: float
    residual: float

    def of(self, unbalance: float) -> str:
        """Say of an unbalance in this plane whether it is within what is permissible."""
        if unbalance != unbalance:
            return "not determined"
        return "within" if unbalance <= self.permissible else "beyond"


@dataclass(frozen=True, eq=False, repr=False)
class Tolerance:
    """A permissible residual unbalance."""

    grade: str | None
    permissible: float
    """U_per of the whole rotor, kg·m; with MIL that of each plane."""
    bearings: tuple[float, float] | None = None
    """Where along the shaft it holds, m; None: in the correction planes."""

    def text(self, unit: str) -> str:
        """Return it in a unit, as people write it: `60 g·mm`."""
        return f"{from_si(self.permissible, 'unbalance', unit):.6g} {written(unit)}"

    @property
    def iso(self) -> bool:
        """Whether it is a grade of ISO 21940-11."""
        return self.grade is not None and self.grade not in STANDARDS

    @property
    def whole_in_each_plane(self) -> bool:
        """Whether every plane may have the whole: MIL-STD-167-1."""
        return self.grade == "MIL"

    @property
    def sharing(self) -> str:
        """How the permissible unbalance goes to planes without --bearings and --center-z."""
        return "in each plane" if self.whole_in_each_plane else "shared equally"

    def shares(
        self, planes: int, center: float | None = None, places: Sequence[float] = ()
    ) -> NDArray[np.float64]:
        """Return what is permissible in each plane, (planes,), kg·m.

        `places` are those of the planes, m, where the centre of mass is known too.
        """
        from balancing import allocate, journal_loads

        if self.whole_in_each_plane:
            return np.full(planes, self.permissible)
        if planes != 2 or center is None or (self.grade == "API" and self.bearings is None):
            return np.full(planes, self.permissible / planes)
        if self.grade == "API":
            return journal_loads(self.permissible, center, *places)
        return allocate(self.permissible, center, *places)


def tolerance_of(
    grade: str | None,
    speed: str | None,
    rotor_mass: str | None,
    permissible: str | None,
    bearings: str | None,
) -> Tolerance | None:
    """Read the tolerance; None where none is requested."""
    from balancing import api_unbalance, grade_value, mil_unbalance, permissible_unbalance

    planes = None if bearings is None else two_bearings("--bearings", bearings)
    omega = quantity("--speed", speed, "speed", positive=True)
    mass = quantity("--rotor-mass", rotor_mass, "mass", positive=True)
    if permissible is not None:
        if grade is not None:
            raise bad("--permissible", "expected --grade or --permissible, not both")
        of_grade = "goes with --grade; --permissible states the tolerance by itself"
        refuse(of_grade, speed=speed, rotor_mass=rotor_mass)
        whole = needed("--permissible", permissible, "unbalance", positive=True)
        return Tolerance(None, whole, planes)
    if grade is None:
        refuse(
            "expected --grade or --permissible for a tolerance, or --speed for their forces",
            bearings=bearings,
        )
        refuse("this is for a tolerance: expected --grade too", speed=speed, rotor_mass=rotor_mass)
        return None
    standard = grade.strip().upper().removesuffix("-STD-167-1")
    value = 0.0
    if standard not in STANDARDS:
        try:
            value = grade_value(grade)
        except ValueError as error:
            raise bad("--grade", error) from None
    if omega is None:
        raise bad("--speed", "--grade needs --speed and --rotor-mass")
    if mass is None:
        raise bad("--rotor-mass", "--grade needs --speed and --rotor-mass")
    if standard == "MIL" and planes is not None:
        raise bad("--bearings", "--grade MIL holds in the correction planes: expected no --bearings")
    if standard in STANDARDS:
        limit = api_unbalance if standard == "API" else mil_unbalance
        return Tolerance(standard, float(limit(mass, omega)), planes)
    return Tolerance(f"G{value * 1000:g}", float(permissible_unbalance(value, omega, mass)), planes)


def verdict_table(rows: Sequence[tuple[str, Verdict]], unit: str) -> Table:
    """Return for each rotor and plane what is permissible, what the unbalance was and is, and whether that is within it."""
    share, before, after = (np.array([v[k] for _, v in rows], dtype=float) for k in (1, 2, 3))

    def within(sizes: NDArray[np.float64]) -> list[bool | None]:
        return [
            None if size != size else size <= limit
            for size, limit in zip(sizes.tolist(), share.tolist(), strict=True)
        ]

    # rounding of nothing is shown as nothing
    residual = number("residual", "unbalance", np.where(after <= 1e-12 * before, 0.0, after), unit)
    columns = [
        names("rotor", [name for name, _ in rows]),
        names("plane", [v.plane for _, v in rows]),
        number("permissible", "unbalance", share, unit),
        number("initial", "unbalance", before, unit),
        replace(residual, stored=after),
        names("verdict", [v.of(v.residual) for _, v in rows], place=None),
    ]
    documented = [names("within", within(before)), names("residual_within", within(after))]
    return Table(columns, ("rotor", "plane"), "rotors[].tolerance.planes[]", documented=documented)
