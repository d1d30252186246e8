"""Tolerances of rotors, after ISO 21940-11, API or MIL-STD-167-1: their options, and the verdicts as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from cli.read import options
from dalembert.dataclass import dataclass
from dalembert.results.columns import Table, names, number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


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
        import numpy as np

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
    """Read the tolerance; None where none is asked for."""
    from balancing import api_unbalance, grade_value, mil_unbalance, permissible_unbalance

    planes = None if bearings is None else options.two_bearings("--bearings", bearings)
    omega = options.quantity("--speed", speed, "speed", positive=True)
    mass = options.quantity("--rotor-mass", rotor_mass, "mass", positive=True)
    if permissible is not None:
        if grade is not None:
            raise options.bad("--permissible", "expected --grade or --permissible, not both")
        of_grade = "goes with --grade; --permissible states the tolerance by itself"
        options.refuse(of_grade, speed=speed, rotor_mass=rotor_mass)
        whole = options.needed("--permissible", permissible, "unbalance", positive=True)
        return Tolerance(None, whole, planes)
    if grade is None:
        options.refuse("is for a tolerance: expected --grade or --permissible too", bearings=bearings)
        options.refuse("is for a tolerance: expected --grade too", speed=speed, rotor_mass=rotor_mass)
        return None
    standard = grade.strip().upper().removesuffix("-STD-167-1")
    value = 0.0
    if standard not in STANDARDS:
        try:
            value = grade_value(grade)
        except ValueError as error:
            raise options.bad("--grade", error) from None
    if omega is None:
        raise options.bad("--speed", "--grade needs --speed and --rotor-mass")
    if mass is None:
        raise options.bad("--rotor-mass", "--grade needs --speed and --rotor-mass")
    if standard == "MIL" and planes is not None:
        raise options.bad("--bearings", "--grade MIL holds in the correction planes: expected no --bearings")
    if standard in STANDARDS:
        limit = api_unbalance if standard == "API" else mil_unbalance
        return Tolerance(standard, float(limit(mass, omega)), planes)
    return Tolerance(f"G{value * 1000:g}", float(permissible_unbalance(value, omega, mass)), planes)


def verdict_table(rows: Sequence[tuple[str, Verdict]], unit: str) -> Table:
    """Return for each rotor and plane what is permissible, what the unbalance was and is, and whether that is within it."""
    import numpy as np

    share, before, after = (np.array([v[k] for _, v in rows], dtype=float) for k in (1, 2, 3))

    def within(sizes: np.typing.NDArray[np.float64]) -> list[bool | None]:
        return [
            None if size != size else size <= limit
            for size, limit in zip(sizes.tolist(), share.tolist(), strict=True)
        ]

    columns = [
        names("rotor", [name for name, _ in rows]),
        names("plane", [v.plane for _, v in rows]),
        number("permissible", "unbalance", share, unit),
        number("initial", "unbalance", before, unit),
        number("residual", "unbalance", after, unit),
        names("verdict", [v.of(v.residual) for _, v in rows], place=None),
    ]
    documented = [names("within", within(before)), names("residual_within", within(after))]
    return Table(columns, ("rotor", "plane"), "rotors[].tolerance.planes[]", documented=documented)
