"""The picture of a body: its parts, principal axes and vectors of its motion; of a shaft its bearing forces too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.body.solve import MovingBody
from cli.show.picture import blank
from rigidbody3d.picture import views

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: MovingBody) -> Figure:
    """Draw the body in two views; below them, for a shaft, the forces of the bearings."""
    figure, parts, motion = blank(), found.parts, found.motion
    solids, whole = parts.each.solids(), parts.whole.whole()
    vectors = {"angular velocity": motion.omega, "angular momentum": motion.momentum, "its rate": motion.rate}
    if found.request.shaft is None:
        views.body(solids, parts.name, whole, vectors, figure)
        return figure
    forces = {"static": found.shaft.static} if any(found.request.shaft.gravity) else {}
    forces["dynamic"] = found.shaft.dynamic
    if found.correction is not None:
        forces["dynamic, after correction"] = found.corrected
    views.shaft(solids, parts.name, whole, found.shaft.bearings, forces, vectors, figure)
    return figure
