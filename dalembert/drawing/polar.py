"""Polar dials: vectors as arrows from the middle, their tips named, those too short for an arrow as dots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.drawing.labels import Label

if TYPE_CHECKING:
    from matplotlib.lines import Line2D
    from matplotlib.projections.polar import PolarAxes

SHORT = 0.03
"""A vector shorter than this share of the dial is a dot."""


ROOM = 1.3
"""The reach of a dial over its longest vector, with room for a name at the tip."""


class Look(NamedTuple):
    """The look of the vectors of one kind: colour, dash and width."""

    color: str
    width: float
    dash: str = "-"


GIVEN = Look("0.5", 1.3, "--")
SHARE = Look("0.45", 1.2)
SUM = Look("black", 1.6, "--")
FOUND = Look("tab:red", 2.4)


class Vector(NamedTuple):
    """A vector, its look, and its name where it has one."""

    value: complex
    look: Look
    name: str = ""


def dial(axes: PolarAxes, title: str, vectors: Sequence[Vector], room: float = ROOM) -> list[Label]:
    """Draw vectors on polar axes, in their order, and return the labels of their tips, to be placed."""
    from matplotlib.ticker import MaxNLocator, ScalarFormatter

    largest = max((abs(v.value) for v in vectors if np.isfinite(v.value)), default=0.0)
    scale = largest or 1.0
    axes.set_title(title, pad=10, fontsize=11)
    axes.set_rlim(0, room * scale)
    ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(0, scale)
    # of nothing a scale would be made up
    axes.set_rticks([tick for tick in ticks if 0 < tick <= 1.05 * largest])
    formatter = ScalarFormatter(useOffset=False)
    formatter.set_scientific(False)
    axes.yaxis.set_major_formatter(formatter)
    axes.set_rlabel_position(free_direction([v.value for v in vectors]))
    axes.tick_params(labelsize=8, colors="0.3")
    axes.grid(color="0.87", lw=0.7)
    labels = []
    for value, look, name in vectors:
        if not np.isfinite(value):
            continue
        angle, size = float(np.angle(value)), abs(value)
        if size < SHORT * scale:
            axes.plot([angle], [size], "o", color=look.color, ms=3 + look.width, zorder=4)
        else:
            arrow(axes, value, scale, look)
        if name:
            color = "black" if look.color == GIVEN.color else look.color
            labels.append(Label(name, (angle, size), color, 8.0, float(np.degrees(angle))))
    return labels


def arrow(axes: PolarAxes, value: complex, scale: float, look: Look) -> None:
    """Draw a vector as an arrow; one that is nothing against the dial's size `scale` is not drawn."""
    angle, size = float(np.angle(value)), abs(value)
    if not size > 1e-9 * scale:
        return
    # the shaft ends within the head: a dash never blurs the tip
    neck = max(size - 0.03 * scale, 0.5 * size)
    axes.plot([angle, angle], [0, neck], color=look.color, lw=look.width, ls=look.dash, solid_capstyle="butt")
    tip = head(look.color, look.width if look.dash == "-" else 1.2)
    axes.annotate("", (angle, size), (angle, neck), arrowprops=tip).set_in_layout(False)


def head(color: str, width: float = 1.2) -> dict[str, Any]:
    """Return how matplotlib draws the head of an arrow."""
    style = "-|>,head_width=0.25,head_length=0.5"
    return {"arrowstyle": style, "color": color, "lw": width, "shrinkA": 0, "shrinkB": 0}


def handle(look: Look, label: str) -> Line2D:
    """Return a legend's line for vectors of this look."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=look.color, lw=look.width, ls=look.dash, label=label)


def free_direction(vectors: Sequence[complex]) -> float:
    """Return the direction, in degrees, in the middle of the widest gap between vectors: room for the scale."""
    angles = np.sort(np.degrees(np.angle([v for v in vectors if v and np.isfinite(v)])) % 360)
    if not len(angles):
        return 22.5
    gaps = np.diff(np.append(angles, angles[0] + 360))
    widest = int(np.argmax(gaps))
    return float((angles[widest] + gaps[widest] / 2) % 360)
