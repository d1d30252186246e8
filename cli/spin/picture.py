"""The picture of a rotation: ω(t), the polhode where two ellipsoids meet, the trace of the body's axis on the sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.show.picture import blank
from cli.spin.read import Array
from cli.spin.solve import Rotation
from rigidbody3d.picture.rotation import rotation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: Rotation) -> Figure:
    """Draw the rotation over the times asked for; from a single time, from zero to there."""
    figure, given = blank(), found.given
    time = _fine(found)
    states = found.at(time)
    rotation(
        time,
        states.omega,
        states.attitude,
        given.inertia,
        free=given.torque is None and given.mgl is None,
        top=given.mgl is not None,
        name=given.name,
        figure=figure,
    )
    return figure


def _fine(found: Rotation) -> Array:
    ends = [min(0.0, float(found.time.min())), float(found.time.max())]
    if len(found.time) > 1:
        ends[0] = float(found.time.min())
    size = float(np.linalg.norm(found.given.omega))
    if ends[0] == ends[1]:
        ends[1] = ends[0] + (found.period or (2 * np.pi / size if size else 1.0))
    turns = (ends[1] - ends[0]) * size / (2 * np.pi)
    return np.linspace(ends[0], ends[1], int(np.clip(60 * turns, 600, 6000 if found.exact else 2000)))
