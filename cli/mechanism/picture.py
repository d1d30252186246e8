"""Pictures of a mechanism: drawn in its poses, any quantity or the forces against the input."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.mechanism.quantities import pairs
from cli.mechanism.solve import Analysis
from cli.read import options
from cli.show.picture import blank
from virtualwork import DescriptionError
from virtualwork.picture.over_input import curves, forces
from virtualwork.picture.paper import on_paper
from virtualwork.picture.quantities import quantities

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: Analysis) -> Figure:
    """Draw the mechanism to scale: the first pose in full, others as ghosts, the paths of its points."""
    figure = blank()
    on_paper(analysis.motions[0].poses, None if analysis.only is None else analysis.points, figure)
    return figure


def draw_curves(analysis: Analysis, text: str) -> Figure:
    """Draw the quantities that `--graph` names against the input, of the first assembly asked for."""
    figure = blank()
    curves(analysis.motions[0].poses, _names(text), figure)
    return figure


def draw_forces(analysis: Analysis) -> Figure:
    """Draw the effort and the joint forces asked for against the input, and what shakes the ground."""
    figure, motion = blank(), analysis.motions[0]
    forces(motion.dynamics, pairs(analysis), figure)
    return figure


def check_names(analysis: Analysis, text: str) -> None:
    """Refuse names that `--graph` cannot find."""
    try:
        quantities(analysis.motions[0].poses, _names(text))
    except DescriptionError as error:
        raise options.bad("--graph", str(error)) from None


def _names(text: str) -> list[str]:
    return [word.strip() for word in text.split(",")]
