"""The check of a robot's inertias as columns, and as the JSON document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from cli.body.inertias import Check
from cli.errors import DataError
from cli.read.robots.robot import PLACES, Robot
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from cli.show.columns import Document


def document(found: Sequence[Check]) -> Document:
    """Return the JSON document."""
    return {
        "bodies": [
            {
                "link": c.link.name,
                "valid": c.valid,
                "principal_kg_m2": c.moments.tolist(),
                "nearest_kg_m2": c.nearest.tolist(),
                "likely": c.likely,
            }
            for c in found
        ]
    }


def table(found: Sequence[Check]) -> Table:
    """Return a row for each link: whether a body can have its tensor, its moments, the nearest tensor's entries."""
    columns = [
        Column("link", "", [c.link.name for c in found]),
        Column("valid", "", ["yes" if c.valid else "no" for c in found]),
    ]
    columns += [Column(f"principal_{k + 1}", "kg_m2", [float(c.moments[k]) for c in found]) for k in range(3)]
    columns += [
        Column(f"nearest_{entry}", "kg_m2", [float(c.nearest[place]) for c in found])
        for entry, place in PLACES.items()
    ]
    columns.append(Column("likely", "", [c.likely for c in found]))
    return Table(columns, keys=("link",))


def warnings(robot: Robot, found: Sequence[Check]) -> list[str]:
    """Name what is broken, and what looks wrong though a body can have it."""
    if not found:
        raise DataError(f"{robot.file}: no link has an inertia: nothing to check")
    said = []
    for c in found:
        hint = f"; likely: {c.likely}" if c.likely else ""
        if not c.valid:
            I1, I2, I3 = c.moments
            why = "is negative" if I1 < 0 else f"{I1:.6g} + {I2:.6g} < {I3:.6g}"
            moments = f"principal moments {I1:.6g}, {I2:.6g}, {I3:.6g} kg·m²"
            said.append(
                f"link '{c.link.name}': no body has it: {moments}: {'the first ' if I1 < 0 else ''}{why}{hint}"
            )
        elif hint:
            said.append(
                f"link '{c.link.name}': a body can have it, but it is larger than the link's reach allows{hint}"
            )
    return said
