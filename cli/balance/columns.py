"""The corrections of rotors as columns, and as the JSON document."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from cli.balance.solve import Balancing
from cli.read.rounding import angle_error, size_error
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from cli.balance.read import Real
    from cli.show.columns import Document


def corrections(found: Balancing) -> Table:
    """One row per rotor and plane, in the input's own units."""
    rotors, planes, row = found.rotors, found.planes, found.plane_of_row
    given = rotors.table.numbers
    z_unit = given["z"].unit if "z" in given else planes.z_unit
    radius_unit = rotors.radius_unit or planes.radius_unit
    unbalance_unit, mass_unit, gravity = rotors.unbalance_unit, rotors.mass_unit, found.request.gravity

    @cache
    def size() -> Real:
        return size_error(found.ideal, found.bound)

    columns = [
        Column("rotor", "", [rotors.names[r] for r in found.rotor_of_row]),
        Column("plane", "", [planes.name[p] for p in row]),
    ]
    if planes.z is not None:
        columns.append(Column("z", z_unit, from_si(planes.z[row], "length", z_unit)))
    columns += [
        Column("radius", radius_unit, from_si(found.radius, "length", radius_unit)),
        Column(
            "unbalance",
            unbalance_unit,
            from_si(np.abs(found.made), "unbalance", unbalance_unit),
            lambda: from_si(size(), "unbalance", unbalance_unit),
        ),
        Column("mass", mass_unit, found.mass, lambda: from_si(size() / found.radius, "mass", mass_unit)),
    ]
    if rotors.weights:
        columns.append(
            Column("weight", "N", found.mass_kg * gravity, lambda: size() / found.radius * gravity)
        )
    columns.append(
        Column("angle", "deg", found.angle, lambda: angle_error(found.ideal, found.bound, found.angle))
    )
    return Table(columns, keys=("rotor", "plane"))


def document(found: Balancing) -> Document:
    """The JSON document."""
    planes, couple, tolerance = found.planes, found.has_couple, found.request.tolerance
    mass, amount = found.mass_kg.tolist(), np.abs(found.made).tolist()
    angle, row = found.angle.tolist(), found.plane_of_row.tolist()
    z = [None] * len(planes.name) if planes.z is None else planes.z.tolist()
    radius = planes.radius.tolist()
    documents: list[Document] = []
    for r, name in enumerate(found.rotors.names):
        rows = found.rows_of(r)
        entry: Document = {
            "rotor": name,
            "initial": {
                "static_unbalance_kg_m": abs(found.static[r]),
                "static_angle_deg": degrees(found.static[r]),
                "couple_unbalance_kg_m2": abs(found.couple[r]) if couple else None,
                "couple_angle_deg": degrees(found.couple[r]) if couple else None,
                "couple_about_z_m": found.about[r] if couple else None,
            },
            "corrections": [
                {
                    "plane": planes.name[row[i]],
                    "z_m": z[row[i]],
                    "radius_m": radius[row[i]],
                    "unbalance_kg_m": amount[i],
                    "mass_kg": mass[i],
                    "weight_N": mass[i] * found.request.gravity,
                    "angle_deg": angle[i],
                }
                for i in range(rows.start, rows.stop)
            ],
            "residual": {
                "static_unbalance_kg_m": abs(found.residual_static[r]),
                "couple_unbalance_kg_m2": abs(found.residual_couple[r]) if couple else None,
            },
        }
        if tolerance is not None:
            entry["tolerance"] = tolerance.document(found.verdicts(r))
        documents.append(entry)
    return {"correction": "remove" if found.request.remove else "add", "rotors": documents}
