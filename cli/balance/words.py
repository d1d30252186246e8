"""What is said of the balance of rotors: above and below the terminal's table, and as warnings."""

from __future__ import annotations

import numpy as np

from balancing import GRADES
from cli.balance import columns
from cli.balance.read import Complex, Real
from cli.balance.solve import Balancing
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Section, Table
from cli.show.text import angle_text
from cli.show.verdicts import verdict_columns

NEAR = 20.0  # from this growth of errors on the planes are said to be near each other
SHOWN = 10  # so many rotors are described on the terminal

METHOD = (
    "Each mass is an unbalance U = m·r·e^{iθ}. The corrections are those with the least sum of squares whose resultant and "
    "moment about the planes are opposite to ΣU and ΣU·z (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 6–21); "
    "tolerance after ISO 21940-11. Angles are counter-clockwise as seen against +z."
)


def warnings(found: Balancing) -> list[str]:
    """What a reader of the corrections has to know."""
    near = np.flatnonzero(found.growth > NEAR)
    said = [
        f"rotor {found.rotors.names[r]}: the correction planes lie so close to each other, beside the masses, "
        f"that errors grow by a factor of {found.growth[r]:.3g}"
        for r in near[:5]
    ]
    if len(near) > 5:
        said.append(f"… and so do those of {len(near) - 5} further rotors")
    tolerance = found.request.tolerance
    if tolerance is None:
        return said
    if tolerance.grade is not None and float(tolerance.grade[1:]) not in GRADES:
        said.append(f"{tolerance.grade} is not among the grades of ISO 21940-11; used as given")
    if found.request.center is None and (tolerance.bearings is not None or (found.count == 2).any()):
        said.append("no --center-z: the permissible residual unbalance is shared equally between the planes")
    return said


def notes(found: Balancing) -> str:
    """Say what the rotors were like before and after."""
    unit, length = found.rotors.unbalance_unit, found.length_unit
    named = (
        f"{unit.replace('_', '·')}·{length}".replace("mm·mm", "mm²")
        .replace("in·in", "in²")
        .replace("m·m", "m²")
    )
    lines = []
    masses = np.bincount(found.rotors.rotor)

    def static(value: complex) -> str:
        return f"static {from_si(abs(value), 'unbalance', unit):.6g} {unit.replace('_', '·')}"

    def couple(value: complex) -> str:
        return f", couple {found.couple_size(abs(value)):.6g} {named}" if found.has_couple else ""

    def angle(value: complex) -> str:
        return f" at {angle_text(degrees(value), '.2f')}°"

    for r, name in enumerate(found.rotors.names[:SHOWN]):
        line = f"  initial   {static(found.static[r])}{angle(found.static[r])}"
        if found.has_couple:
            about = from_si(found.about[r], "length", length)
            line += f"{couple(found.couple[r])}{angle(found.couple[r])} about z = {about:g} {length}"
        lines += [
            f"rotor {name}: {masses[r]} unbalance{'' if masses[r] == 1 else 's'}",
            line,
            f"  residual  {static(found.residual_static[r])}{couple(found.residual_couple[r])}",
        ]
    if len(found.rotors.names) > SHOWN:
        lines.append(f"… and {len(found.rotors.names) - SHOWN} further rotors")
    return "\n".join([*lines, "", f"material to {'remove' if found.request.remove else 'add'}:"])


def verdicts(found: Balancing) -> str:
    """Say whether the rotors are within tolerance."""
    tolerance = found.request.tolerance
    if tolerance is None:
        return ""
    unit = found.rotors.unbalance_unit
    named = f"tolerance {tolerance.grade}" if tolerance.grade else "tolerance"
    whole = from_si(tolerance.permissible, "unbalance", unit)
    lines = [f"{named}: U_per = {whole:.6g} {unit.replace('_', '·')}"]
    for r, rotor in enumerate(found.rotors.names[:SHOWN]):
        for v in found.verdicts(r):
            share, before, after = (from_si(value, "unbalance", unit) for value in v[1:])
            lines.append(
                f"  rotor {rotor}, {v.plane}: permissible {share:.6g}, "
                f"initial {before:.6g} ({v.of(v.initial)}), residual {after:.6g} ({v.of(v.residual)})"
            )
    names = found.rotors.names
    if len(names) > SHOWN:
        beyond = [
            name for r, name in enumerate(names) if any(v.residual > v.permissible for v in found.verdicts(r))
        ]
        lines.append(
            f"all {len(names)} rotors: residual (within)"
            if not beyond
            else f"{len(beyond)} of {len(names)} rotors: residual (beyond): {', '.join(beyond[:SHOWN])}{' …' * (len(beyond) > SHOWN)}"
        )
    return "\n".join(lines)


def sections(found: Balancing) -> list[Section]:
    """What the report says: the corrections, the rotors before and after, the tolerance."""
    states: list[str | Table] = [_states(found)]
    if found.has_couple:
        about = from_si(found.about[0], "length", found.length_unit)
        same = (found.about == found.about[0]).all()
        where = f"z = {about:g} {found.length_unit}" if same else "the first correction plane of each"
        states.append(f"The couple is about {where}.")
    action = f"Material to {'remove' if found.request.remove else 'add'}"
    shown = [Section(action, [columns.corrections(found)]), Section("Before and after", states)]
    if found.request.tolerance is not None:
        shown.append(Section("Verdict", [*verdicts(found).splitlines()[:1], _within(found)]))
    return shown


def _states(found: Balancing) -> Table:
    unit, names, length = found.rotors.unbalance_unit, found.rotors.names, found.length_unit

    def both(before: Complex, after: Complex) -> Complex:
        # what rounding leaves is nothing
        after = np.where(np.abs(after) > 1e-12 * np.abs(before), after, 0)
        return np.stack([before, after], axis=1).ravel()

    def angle(value: Complex) -> Real:
        return np.where(value == 0, np.nan, degrees(value))

    static, couple = both(found.static, found.residual_static), both(found.couple, found.residual_couple)
    table = [
        Column("rotor", "", [name for name in names for _ in range(2)]),
        Column("state", "", ["before", "after"] * len(names)),
        Column("static_unbalance", unit, from_si(np.abs(static), "unbalance", unit)),
        Column("angle", "deg", angle(static)),
    ]
    if found.has_couple:
        of_couple = f"{unit}_{length}".replace(f"{length}_{length}", f"{length}2")
        table.append(Column("couple", of_couple, found.couple_size(np.abs(couple))))
        table.append(Column("couple_angle", "deg", angle(couple)))
    return Table(table, keys=("rotor", "state"))


def _within(found: Balancing) -> Table:
    rows = [(name, v) for r, name in enumerate(found.rotors.names) for v in found.verdicts(r)]
    columns = verdict_columns([v for _, v in rows], found.rotors.unbalance_unit)
    return Table([Column("rotor", "", [name for name, _ in rows]), *columns], keys=("rotor", "plane"))
