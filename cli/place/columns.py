"""Placed masses as columns, and as the JSON document."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from cli.place.corrections import Correction
from cli.place.solve import Placing
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from cli.show.columns import Cell, Document


def masses(found: Placing) -> Table:
    """A row for each mass."""
    unit, planes = found.request.unit, found.request.planes

    def errors(which: int, dimension: str, unit: str) -> list[float]:
        return [from_si(bounds[which], dimension, unit) for bounds in found.mass_errors]

    columns = [
        Column("position", "", [str(m.place + 1) for m in found.masses]),
        Column("angle", "deg", [m.angle for m in found.masses], lambda: [b[1] for b in found.mass_errors]),
        Column(
            "mass",
            unit,
            [from_si(m.mass, "mass", unit) for m in found.masses],
            partial(errors, 0, "mass", unit),
        ),
    ]
    if planes is not None:
        columns.insert(
            0, Column("z", "mm", [from_si(m.share.z or 0.0, "length", "mm") for m in found.masses])
        )
    if found.request.drill is not None:
        depths = [from_si(m.depth or 0.0, "length", "mm") for m in found.masses]
        columns.append(Column("drill_depth", "mm", depths, partial(errors, 2, "length", "mm")))
        columns.append(Column("holes", "", [m.holes for m in found.masses]))
    return Table(columns, keys=("position",) if planes is None else ())


def several(found: Sequence[tuple[Correction, Placing]]) -> Table:
    """A row for each mass of each correction; of one alone without its name."""
    tables = [masses(placing) for _, placing in found]
    if len(tables) == 1:
        return tables[0]
    lengths = [len(table.columns[0].values) for table in tables]

    def stacked(k: int) -> list[Cell]:
        return [value for table in tables for value in table.columns[k].values]

    def errors(k: int) -> list[float]:
        return [
            bound for table in tables if (error := table.columns[k].error) is not None for bound in error()
        ]

    names = [
        Column(
            what, "", [getattr(of, what) for (of, _), n in zip(found, lengths, strict=True) for _ in range(n)]
        )
        for what in ("rotor", "plane")
    ]
    columns = [
        Column(c.name, c.unit, stacked(k), None if c.error is None else partial(errors, k))
        for k, c in enumerate(tables[0].columns)
    ]
    return Table([*names, *columns], keys=("rotor", "plane", "position"))


def documents(found: Sequence[tuple[Correction, Placing]]) -> Document:
    """The JSON document of one correction, or of several."""
    if len(found) == 1:
        return document(found[0][1])
    return {
        "placements": [{"rotor": of.rotor, "plane": of.plane, **document(placing)} for of, placing in found]
    }


def document(found: Placing) -> Document:
    """The JSON document."""
    return {
        "target": {"mass_kg": abs(found.target), "angle_deg": degrees(found.target)},
        "masses": [
            {
                "position": str(m.place + 1),
                "angle_deg": m.angle,
                "mass_kg": m.mass,
                "drill_depth_m": m.depth,
                "holes": m.holes,
                **({} if found.request.planes is None else {"z_m": m.share.z}),
            }
            for m in found.masses
        ],
        "error_kg": abs(found.error),
        "error_angle_deg": degrees(found.error),
        "action": "remove" if found.request.removes else "add",
    }
