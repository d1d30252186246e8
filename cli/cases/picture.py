"""Pictures of a mechanism: drawn in its poses, or the requested quantities against the input."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.quantities import Quantity, keys_of, solved
from cli.show.picture import blank
from virtualwork.picture.over_input import curves_of, forces
from virtualwork.picture.paper import on_paper
from virtualwork.picture.quantities import Quantity as Drawn
from virtualwork.picture.quantities import pace, unwrapped

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

UNITS = {
    "m": "m", "m_s": "m/s", "m_s2": "m/s²", "m_s3": "m/s³", "deg": "deg", "rad_s": "rad/s", "rad_s2": "rad/s²",
    "rad_s3": "rad/s³", "N": "N", "N_m": "N·m",
}  # fmt: skip


def is_by_quantity(analysis: Analysis) -> bool:
    """Whether --only names single quantities, such as H.x: then the picture has their curves over several poses."""
    only = analysis.request.only or ()
    full = {name for each in (*analysis.places, *analysis.forces) for name in each.names}
    return bool(only) and analysis.inputs.n > 1 and all(word in full for word in only)


def drawn(analysis: Analysis) -> Figure:
    """The mechanism to scale: the first pose in full, others as ghosts, the paths of its points."""
    figure = blank()
    only = None if analysis.request.only is None else analysis.points
    on_paper(analysis.motions[0].poses, only, figure)
    return figure


def forces_drawn(analysis: Analysis) -> Figure:
    """The effort and the requested joint forces against the input, and what shakes the ground."""
    figure = blank()
    forces(analysis.motions[0].dynamics, analysis.shown_pairs, figure)
    return figure


def curves(analysis: Analysis) -> Figure:
    """The requested quantities against the input, of the first assembly."""
    figure, motion = blank(), analysis.motions[0]
    every = [each for each in (*analysis.places, *analysis.forces) if each.key]
    values = solved(motion, keys_of(every))
    curves_of(motion.poses, [_curve(analysis, each, values[each.key]) for each in every], figure)
    return figure


def _curve(analysis: Analysis, each: Quantity, value: NDArray[np.generic]) -> Drawn:
    """A quantity as it is drawn, with how large one of its kind is."""
    m, poses = analysis.mechanism, analysis.motions[0].poses
    numbers = unwrapped(value.real) if each.turns else each.of(value)
    name = each.names[0]
    unit = next(
        text
        for suffix, text in sorted(UNITS.items(), key=lambda u: -len(u[0]))
        if each.header.endswith(f"_{suffix}")
    )
    if each in analysis.forces:
        return Drawn(name, unit, numbers, float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0)))
    size = 1.0 if each.key[0] == "angle" else m.size
    return Drawn(name, unit, numbers, 180.0 if each.turns else size * pace(poses) ** each.order)
