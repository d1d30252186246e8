"""The inertias of a robot file as a table, and warnings of what is broken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dalembert.documents.robots import Robot
from dalembert.errors import DataError
from dalembert.results.columns import Table, names, number, vector
from rigidbody3d.robots.elements import PLACES
from rigidbody3d.robots.inertias import InertiaCheck


def table(every: Sequence[InertiaCheck]) -> Table:
    """Return a row for each link: whether a body can have its tensor, its moments, the nearest tensor."""
    columns = [
        names("link", [c.link.name for c in every]),
        names("valid", ["yes" if c.valid else "no" for c in every]),
    ]
    columns[1].stored = [c.valid for c in every]
    moments = np.array([c.moments for c in every]).reshape(-1, 3)
    columns += vector("principal", "inertia", moments, "123")
    columns += [
        number(f"nearest_{entry}", "inertia", [float(c.nearest[place]) for c in every], place=None)
        for entry, place in PLACES.items()
    ]
    columns.append(names("likely", [c.likely for c in every]))
    nearest = names("nearest_kg_m2", [None] * len(every))
    nearest.stored = [c.nearest.tolist() for c in every]
    return Table(columns, keys=("link",), place="bodies[]", documented=[nearest])


def warnings(robot: Robot, checks: Sequence[InertiaCheck]) -> list[str]:
    """Name what is broken, and what looks wrong though a body can have it."""
    if not checks:
        raise DataError(f"{robot.file}: no link has an inertia: nothing to check")
    lines = []
    for c in checks:
        hint = f"; likely: {c.likely}" if c.likely else ""
        if not c.valid:
            I1, I2, I3 = c.moments
            why = "is negative" if I1 < 0 else f"{I1:.6g} + {I2:.6g} < {I3:.6g}"
            moments = f"principal moments {I1:.6g}, {I2:.6g}, {I3:.6g} kg·m²"
            lines.append(
                f"link '{c.link.name}': impossible for any body: {moments}: {'the first ' if I1 < 0 else ''}{why}{hint}"
            )
        elif hint:
            off = "smaller than its span suggests" if c.too_small else "larger than the link's reach allows"
            lines.append(f"link '{c.link.name}': possible, but {off}{hint}")
    return lines
