"""A motion as columns, SI and radians: the inputs, which poses are assembled, angles and places with their rates."""

from __future__ import annotations

from typing import Any

from virtualwork.describe.description import Description
from virtualwork.formulas.kinematics import Angle, Point
from virtualwork.formulas.poses import Poses
from virtualwork.quantities import LINK, POINT

ANGLE = ("angle_rad", *LINK[1:])


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
    links = {f"{name}_{ANGLE[k]}": Angle(name, k) for name in m.links for k in range(orders)}
    points = [
        (name, k, Point(body, 0j, name, k))
        for name, (body, _) in m.points.items()
        if name not in m.ground
        for k in range(orders)
    ]
    values = iter(poses.values([*links.values(), *(key for *_, key in points)]))
    table: dict[str, Any] = {header: next(values) for header in links}
    for (name, k, _), z in zip(points, values, strict=True):
        x, y = POINT[k]
        table[f"{name}_{x}"], table[f"{name}_{y}"] = z.real, z.imag
    return table
