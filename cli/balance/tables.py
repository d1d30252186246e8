"""Tables of the results of rotors: corrections, unbalance before and after, forces of the bearings, tolerance; warnings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from balancing import GRADES
from cli.balance.rotors import Balancing
from cli.read.rotor_options import verdict_table
from dalembert.angles import degrees
from dalembert.results.columns import Column, Table, apart, names, number, read_number, vector
from dalembert.units import UNITS, from_si

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cli.balance.rotors import Complex, Real
    from dalembert.arithmetic.doubled import Doubled


NEAR = 20.0  # from this growth of errors on the planes are named as near each other

MODAL = (
    "Modal balancing: the corrections of least sum of squares with which the modal sums ΣU·φ of the modes vanish (R. E. D. "
    "Bishop, G. M. L. Gladwell 1959), with --rigid also ΣU and ΣU·z (W. Kellenberger 1972, N + 2 planes). Angles are "
    "counter-clockwise as seen against +z."
)
METHOD = (
    "Each mass is an unbalance U = m·r·e^{iθ}. The corrections are those with the least sum of squares whose resultant and "
    "moment about the planes are opposite to ΣU and ΣU·z (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 6–21); "
    "tolerance after ISO 21940-11, API (4W/N) or MIL-STD-167-1. Angles are counter-clockwise as seen against +z."
)


def tables(b: Balancing) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    made: dict[str, Callable[[], Table]] = {
        "corrections": cache(lambda: corrections(b)),
        "rotors": lambda: states(b),
    }
    if b.request.carried is not None:
        made["bearings"] = lambda: bearings(b)
    if b.modal:
        made["modes"] = lambda: modes(b)
    return made | ({} if b.request.tolerance is None else {"tolerance": lambda: verdicts(b)})


def modes(b: Balancing) -> Table:
    """One row per rotor and mode: the modal sum ΣU·φ before and with the corrections as given out."""
    shapes = b.request.modes
    assert shapes is not None
    first, unit = len(shapes.conditions) - len(shapes.names), b.rotors.unbalance_unit
    order = np.argsort(np.concatenate([group for group, _, _ in b.modal]), kind="stable")
    before = np.concatenate([fix.modal[:, first:] for _, _, fix in b.modal])[order]
    after = np.concatenate([fix.residual_of(b.made[rows])[:, first:] for _, rows, fix in b.modal])[order]
    # rounding of nothing is shown as nothing
    size = np.concatenate(
        [np.abs(fix.at_planes) @ np.abs(b.made[rows])[..., None] for _, rows, fix in b.modal]
    )[order]
    left = np.where(np.abs(after) > 1e-12 * size[:, first:, 0], np.abs(after), 0.0)
    count = len(shapes.names)
    return Table(
        [
            names("rotor", [name for name in b.rotors.names for _ in range(count)]),
            names("mode", shapes.names * len(b.rotors.names)),
            number(
                "modal_unbalance", "unbalance", np.abs(before).ravel(), unit, place="initial.modal_unbalance"
            ),
            number("angle", "angle", degrees(before).ravel(), place="initial.angle"),
            number(
                "residual_modal_unbalance", "unbalance", left.ravel(), unit, place="residual.modal_unbalance"
            ),
        ],
        ("rotor", "mode"),
        "rotors[].modes[]",
        "modal sums of unbalances times shape, before and with the corrections",
    )


def corrections(b: Balancing) -> Table:
    """One row per rotor and plane, in the input's own units."""
    rotors, planes, row = b.rotors, b.planes, b.plane_of_row
    read = rotors.table.numbers
    z_unit = read["z"].unit if "z" in read else planes.z_unit
    radius, gravity = b.radius, b.request.gravity

    def wrong(dimension: str, unit: str, arm: ArrayLike = 1.0, g: float = 1.0) -> Callable[[], Real]:
        """The errors of unbalances over an arm, times g, as they are before they are rounded to a step."""

        def exact() -> Doubled:
            from dalembert.tables.exact import writtens

            return b.exact.size / writtens(arm) * writtens(g)

        si = np.abs(b.ideal) / np.where(np.asarray(arm) > 0, arm, np.nan) * g
        return apart(from_si(si, dimension, unit), dimension, unit, exact)

    def turn() -> Real:
        return (-b.exact).turned(-b.ideal) if b.request.remove else b.exact.turned(b.ideal)

    unit, mass_unit = rotors.unbalance_unit, rotors.mass_unit
    unbalance = number("unbalance", "unbalance", b.unbalance, unit)
    if b.request.mass_step is not None:
        unbalance.values = b.mass * _arms(radius, mass_unit, unit)
    unbalance.error = wrong("unbalance", unit)
    weight_unit = rotors.weight_unit or "N"
    weight = number(
        "weight",
        "force",
        b.mass_kg * gravity,
        weight_unit,
        wrong("force", weight_unit, radius, gravity),
    )
    mass, of_mass = read_number("mass", "mass", b.mass, mass_unit), wrong("mass", mass_unit, radius)
    mass.error = lambda: np.where(np.isnan(b.given_mass), of_mass(), 0.0)
    at = np.full(len(row), np.nan) if planes.z is None else planes.z[row]
    z = number("z", "length", at, z_unit)
    columns = [
        names("rotor", [rotors.names[r] for r in b.rotor_of_row]),
        names("plane", [planes.name[p] for p in row]),
        *([] if planes.z is None else [z]),
        number("radius", "length", radius, rotors.radius_unit or planes.radius_unit),
        unbalance,
        mass,
        *([weight] if rotors.weight_unit else []),
        number("angle", "angle", b.angle, error=turn),
    ]
    return Table(
        columns,
        keys=("rotor", "plane"),
        place="rotors[].corrections[]",
        above=f"material to {'remove' if b.request.remove else 'add'}:",
        documented=[*([z] if planes.z is None else []), *([] if rotors.weight_unit else [weight])],
    )


def _arms(radius: Real, mass_unit: str, unit: str) -> Real:
    """Return what takes masses in a unit to unbalances in another, by radii in m as they are written: 20 for g and g·mm at 20 mm."""
    from fractions import Fraction

    from dalembert.tables.exact import written

    (a, b), (c, d) = UNITS["mass"][mass_unit], UNITS["unbalance"][unit]
    scale = Fraction(a) / Fraction(b) * Fraction(d) / Fraction(c)
    each, where = np.unique(radius, return_inverse=True)
    return np.array([float(written(r) * scale) if np.isfinite(r) else r for r in each.tolist()])[where]


def states(b: Balancing) -> Table:
    """One row per rotor: its unbalance before and after the corrections."""
    rotors, length = b.rotors, b.length_unit
    masses = np.bincount(rotors.rotor, minlength=len(rotors.names))
    couple_unit = b.couple_unit

    def residual(name: str, dimension: str, before: Complex, after: Complex, unit: str) -> Column:
        # rounding of nothing is shown as nothing
        shown = np.where(np.abs(after) > 1e-12 * np.abs(before), np.abs(after), 0.0)
        column = number(f"residual_{name}", dimension, shown, unit, place=f"residual.{name}")
        column.stored = np.abs(after)
        return column

    unbalance = rotors.unbalance_unit
    # a couple unbalance has the dimension of a moment of inertia; without axial positions there is none
    couple = np.where(b.has_couple, b.couple, np.nan)
    # the correction has a moment where its plane's place is given
    left = np.where(b.has_couple and b.planes.z is not None, b.residual_couple, np.nan)
    about = np.where(b.has_couple, b.about, np.nan)
    angle = np.where(b.has_couple, degrees(b.couple), np.nan)
    couples = [
        number("couple_unbalance", "inertia", np.abs(couple), couple_unit, place="initial.couple_unbalance"),
        number("couple_angle", "angle", angle, place="initial.couple_angle"),
        number("couple_about_z", "length", about, length, place="initial.couple_about_z"),
        residual("couple_unbalance", "inertia", couple, left, couple_unit),
    ]
    columns = [
        names("rotor", rotors.names),
        names("unbalances", masses.tolist(), place=None),
        number(
            "static_unbalance", "unbalance", np.abs(b.static), unbalance, place="initial.static_unbalance"
        ),
        number("static_angle", "angle", degrees(b.static), place="initial.static_angle"),
        residual("static_unbalance", "unbalance", b.static, b.residual_static, unbalance),
        *(couples if b.has_couple else []),
    ]
    limit = b.request.tolerance
    grades = [] if limit is None else [
        names("grade", [limit.grade] * len(rotors.names), "tolerance.grade"),
        number("permissible", "unbalance", [limit.permissible] * len(rotors.names), place="tolerance.permissible"),
    ]  # fmt: skip
    return Table(
        columns, keys=("rotor",), place="rotors[]", documented=[*([] if b.has_couple else couples), *grades]
    )


def bearings(b: Balancing) -> Table:
    """One row per rotor and bearing: the forces of the bearings on the rotor, at rest, and as it turns before and after."""
    carried = b.request.carried
    assert carried is not None
    z1, z2 = carried.bearings
    before, after = b.in_planes(carried.bearings)
    n = len(b.rotors.names)
    square = carried.speed**2

    def across(force: Complex) -> Real:
        return np.stack([force.real, force.imag], axis=-1).reshape(-1, 2) + 0.0

    columns = [
        names("rotor", np.repeat(b.rotors.names, 2).tolist()),
        names("bearing", ["1", "2"] * n),
        number("z", "length", np.tile([z1, z2], n), b.length_unit),
    ]
    if carried.mass is not None and b.request.center is not None:
        share = np.array([z2 - b.request.center, b.request.center - z1]) / (z2 - z1)
        weight = share * complex(0.0, carried.mass * b.request.gravity)
        static = np.asarray(np.tile(weight, (n, 1)), dtype=np.complex128)
        columns += vector("static", "force", across(static), "xy")
    # rounding of nothing is shown as nothing
    left = np.where(np.abs(after) > 1e-12 * np.abs(before).max(axis=-1, keepdims=True), after, 0)
    turning: dict[str, Complex] = {
        "dynamic": np.asarray(-square * before, dtype=np.complex128),
        "corrected": np.asarray(-square * left, dtype=np.complex128),
    }
    for name, force in turning.items():
        columns += vector(name, "force", across(force), "xy")
        columns.append(number(f"{name}_size", "force", np.abs(force).ravel(), place=f"{name}_size"))
    above = "forces of the bearings on the rotor: static ones carry its weight (gravity along -y), dynamic ones turn with it"
    return Table(columns, ("rotor", "bearing"), "rotors[].bearings[]", above=above)


def verdicts(b: Balancing) -> Table:
    """One row per rotor and tolerance plane: what is permissible, what it was and is."""
    limit, unit = b.request.tolerance, b.rotors.unbalance_unit
    assert limit is not None
    rows = [(name, v) for r, name in enumerate(b.rotors.names) for v in b.verdicts(r)]
    named = f"{limit.grade}: " if limit.grade else ""
    each = " in each plane" if limit.whole_in_each_plane else ""
    above = f"{named}U_per = {limit.text(unit)}{each}"
    beyond = [name for name, v in rows if v.residual > v.permissible]
    below = ""
    if beyond or len(b.rotors.names) > 1:
        every, bad = len(b.rotors.names), list(dict.fromkeys(beyond))
        more = " …" if len(bad) > 10 else ""
        below = f"all {every} rotors: residual within the tolerance"
        if bad:
            below = (
                f"{len(bad)} of {every} rotors: residual beyond the tolerance: {', '.join(bad[:10])}{more}"
            )
    return replace(verdict_table(rows, unit), above=above, below=below)


def warnings(b: Balancing) -> list[str]:
    """Warnings about planes, bearings and tolerance."""
    near = np.flatnonzero(b.growth > NEAR)
    why = "hardly tell the modes apart" if b.modal else "are close to each other and far from the masses"
    lines = [
        f"rotor {b.rotors.names[r]}: the correction planes {why}: errors grow by a factor of {b.growth[r]:.3g}"
        for r in near[:5]
    ]
    if len(near) > 5:
        lines.append(f"… and of {len(near) - 5} further rotors")
    limit, carried = b.request.tolerance, b.request.carried
    if limit is None and carried is not None and (carried.mass is None) != (b.request.center is None):
        lines.append("no static forces in the bearings: they need --rotor-mass and --center-z")
    fixed = ~np.isnan(b.given_mass) & ~b.sought
    if fixed.any():
        named = ", ".join(dict.fromkeys(b.planes.name[p] for p in b.plane_of_row[fixed]))
        lines.append(
            f"mass and radius of plane {named} are fixed: only the angle is computed, see the residual"
        )
    if limit is None:
        return lines
    if limit.grade is not None and limit.iso and float(limit.grade[1:]) not in GRADES:
        lines.append(f"{limit.grade} is not a grade of ISO 21940-11; its value is used")
    if limit.grade == "API" and b.request.center is not None and limit.bearings is None:
        lines.append("no --bearings: half of the rotor's mass is taken as the load of each journal")
    if limit.whole_in_each_plane:
        return lines
    if b.request.center is None and (limit.bearings is not None or (b.count == 2).any()):
        lines.append("no --center-z: the permissible residual unbalance is shared equally between the planes")
    if limit.bearings is None and (b.count > 2).any():
        lines.append(
            "more than two planes share the permissible residual unbalance equally; --bearings shows it in two"
        )
    return lines
