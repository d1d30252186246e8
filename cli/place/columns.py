"""Placed masses as columns, and as the JSON document."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from cli.place.solve import Placing
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from cli.show.columns import Document


def masses(found: Sequence[Placing]) -> Table:
    """A row for each mass of each correction; of one alone without its name."""
    unit, request = found[0].of.unit, found[0].request
    rows = [(placing.of, mass) for placing in found for mass in placing.masses]

    def errors(which: int, dimension: str, unit: str) -> Callable[[], list[float]]:
        return lambda: [
            from_si(bounds[which], dimension, unit) for placing in found for bounds in placing.mass_errors
        ]

    keys, columns = ["position"], []
    if len(found) > 1:
        keys = ["rotor", "plane", "position"]
        columns += [Column("rotor", "", [of.rotor for of, _ in rows])]
        columns += [Column("plane", "", [of.plane for of, _ in rows])]
    if request.planes is not None:
        keys = keys[:-1] if len(found) == 1 else keys
        columns.append(Column("z", "mm", [from_si(m.share.z or 0.0, "length", "mm") for _, m in rows]))
    columns += [
        Column("position", "", [str(m.place + 1) for _, m in rows]),
        Column("angle", "deg", [m.angle for _, m in rows], errors(1, "number", "")),
        Column("mass", unit, [from_si(m.mass, "mass", unit) for _, m in rows], errors(0, "mass", unit)),
    ]
    if request.drill is not None:
        depths = [from_si(m.depth or 0.0, "length", "mm") for _, m in rows]
        columns.append(Column("drill_depth", "mm", depths, errors(2, "length", "mm")))
        columns.append(Column("holes", "", [m.holes for _, m in rows]))
    return Table(columns, keys=keys)


def document(found: Sequence[Placing]) -> Document:
    """The JSON document of one correction, or of several."""
    parts = [_document(placing) for placing in found]
    if len(found) == 1:
        return parts[0]
    named = zip(found, parts, strict=True)
    return {"placements": [{"rotor": p.of.rotor, "plane": p.of.plane, **part} for p, part in named]}


def _document(found: Placing) -> Document:
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
