"""What is said of the balance of rotors: above and below the terminal's table, and as warnings."""

from __future__ import annotations

import numpy as np

from balancing import GRADES
from cli.balance import columns
from cli.balance.read import Complex
from cli.balance.solve import Balancing
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Section, Table
from cli.show.text import angle_text

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
    unit = found.rotors.unbalance_unit
    length = found.rotors.radius_unit or found.planes.z_unit or "mm"
    lines = []
    masses = np.bincount(found.rotors.rotor)

    def couple(value: complex) -> str:
        size = from_si(from_si(abs(value), "unbalance", unit), "length", length)
        text = f"{size:.6g} {unit.replace('_', '·')}·{length}"
        return text.replace("mm·mm", "mm²").replace("in·in", "in²").replace("m·m", "m²")

    def static(value: complex) -> str:
        return f"{from_si(abs(value), 'unbalance', unit):.6g} {unit.replace('_', '·')}"

    def angle(value: complex) -> str:
        return f"{angle_text(degrees(value), '.2f')}°"

    for r, name in enumerate(found.rotors.names[:SHOWN]):
        lines.append(f"rotor {name}: {masses[r]} unbalance{'' if masses[r] == 1 else 's'}")
        line = f"  initial   static {static(found.static[r])} at {angle(found.static[r])}"
        after = f"  residual  static {static(found.residual_static[r])}"
        if found.has_couple:
            about = f"about z = {from_si(found.about[r], 'length', length):g} {length}"
            line += f", couple {couple(found.couple[r])} at {angle(found.couple[r])} {about}"
            after += f", couple {couple(found.residual_couple[r])}"
        lines += [line, after]
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
            share, before, after = (
                from_si(value, "unbalance", unit) for value in (v.permissible, v.initial, v.residual)
            )
            lines.append(
                f"  rotor {rotor}, {v.plane}: permissible {share:.6g}, "
                f"initial {before:.6g} ({'within' if v.initial <= v.permissible else 'beyond'}), "
                f"residual {after:.6g} ({'within' if v.residual <= v.permissible else 'beyond'})"
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
    unit = found.rotors.unbalance_unit
    length = found.rotors.radius_unit or found.planes.z_unit or "mm"
    action = f"Material to {'remove' if found.request.remove else 'add'}"
    shown = [Section(action, [columns.corrections(found)]), Section("Before and after", [_states(found)])]
    if found.has_couple:
        about = from_si(found.about[0], "length", length)
        same = (found.about == found.about[0]).all()
        where = f"z = {about:g} {length}" if same else "the first correction plane of each"
        shown[1] = Section("Before and after", [_states(found), f"The couple is about {where}."])
    if found.request.tolerance is not None:
        shown.append(Section("Verdict", [*verdicts(found).splitlines()[:1], _within(found, unit)]))
    return shown


def _states(found: Balancing) -> Table:
    unit, names = found.rotors.unbalance_unit, found.rotors.names
    length = found.rotors.radius_unit or found.planes.z_unit or "mm"

    def both(before: Complex, after: Complex) -> Complex:
        # what rounding leaves is nothing
        after = np.where(np.abs(after) > 1e-12 * np.abs(before), after, 0)
        return np.stack([before, after], axis=1).ravel()

    def angle(value: Complex) -> list[float | None]:
        return [float(degrees(v)) if v else None for v in value.tolist()]

    static = both(found.static, found.residual_static)
    table = [
        Column("rotor", "", [name for name in names for _ in range(2)]),
        Column("state", "", ["before", "after"] * len(names)),
        Column("static_unbalance", unit, from_si(np.abs(static), "unbalance", unit)),
        Column("angle", "deg", angle(static)),
    ]
    if found.has_couple:
        couple = both(found.couple, found.residual_couple)
        size = from_si(from_si(np.abs(couple), "unbalance", unit), "length", length)
        of_couple = f"{unit}_{length}".replace(f"{length}_{length}", f"{length}2")
        table += [Column("couple", of_couple, size), Column("couple_angle", "deg", angle(couple))]
    return Table(table, keys=("rotor", "state"))


def _within(found: Balancing, unit: str) -> Table:
    rows = [
        (
            rotor,
            v.plane,
            *(from_si(u, "unbalance", unit) for u in v[1:]),
            "within" if v.residual <= v.permissible else "beyond",
        )
        for r, rotor in enumerate(found.rotors.names)
        for v in found.verdicts(r)
    ]
    names = ("rotor", "plane", "permissible", "before", "after", "verdict")
    units = ("", "", unit, unit, unit, "")
    columns = zip(names, units, zip(*rows, strict=True), strict=True)
    return Table([Column(*column) for column in columns], keys=("rotor", "plane"))
