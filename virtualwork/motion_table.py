"""A motion as columns, SI and radians: the inputs, which poses are assembled, angles and places with their rates."""

from __future__ import annotations

from typing import Any

from virtualwork.describe.description import Description
from virtualwork.formulas.poses import Poses
from virtualwork.quantities import links, points


def columns(poses: Poses) -> dict[str, Any]:
    """Return the columns by their headers; rates where the inputs have any."""
    m = poses.mechanism
    orders = 3 if any(poses.moves) else 1
    table: dict[str, Any] = {
        f"{e.name}_{'m' if e.is_slide else 'rad'}": poses.inputs[:, j] for j, e in enumerate(m.inputs)
    }
    table["assembled"] = poses.assembled
    return table | moving_columns(m, poses, orders)


def moving_columns(m: Description, poses: Poses, orders: int) -> dict[str, Any]:
    """Return the columns of links and points that move, up to this order."""
    free = [name for name in m.points if name not in m.ground]
    shown = [*links(m.links, orders - 1), *points(m, free, orders - 1)]
    keys = list(dict.fromkeys(each.key for each in shown))
    values = dict(zip(keys, poses.values(keys), strict=True))
    table: dict[str, Any] = {}
    for each in shown:
        header = each.header.removesuffix("deg") + "rad" if each.in_degrees else each.header
        table[header] = each.in_si(values[each.key])
    return table
