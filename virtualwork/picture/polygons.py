"""Polygons of velocity and acceleration: from the pole the points' own, the parts head to tail between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dalembert.drawing.amounts import prefixed
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import head
from dalembert.drawing.sheet import plain, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from virtualwork.study.parts import Parts

COLORS = {
    "turning": "tab:blue", "relative": "tab:green", "tangential": "tab:blue", "normal": "tab:orange", "Coriolis": "tab:purple",
}  # fmt: skip
OWN = "black"


def rates(every: Sequence[Parts], i: int, figure: FigureBase | None = None) -> None:
    """Draw the polygons of pose i, velocity on the left and acceleration on the right, to scale from one pole each."""
    from matplotlib.lines import Line2D

    figure = sheet(11.0, 5.6, figure)
    left, right = figure.subplots(1, 2)
    labels = []
    velocity = [
        (p.point, p.velocity[i], [("turning", p.base_velocity[i], p.turning_velocity[i]),
         ("relative", p.carried_velocity[i], p.relative_velocity[i])])
        for p in every
    ]  # fmt: skip
    acceleration = []
    for p in every:
        at, chain = p.base_acceleration[i], []
        for name, value in (
            ("normal", p.normal[i]), ("tangential", p.tangential[i]), ("Coriolis", p.coriolis[i]), ("relative", p.relative[i]),
        ):  # fmt: skip
            chain.append((name, at, value))
            at = at + value
        acceleration.append((p.point, p.acceleration[i], chain))
    for axes, rows, title, unit in (
        (left, velocity, "velocity", "m/s"),
        (right, acceleration, "acceleration", "m/s²"),
    ):
        labels.append((axes, _polygon(axes, rows, title, unit)))
    used = {
        name for rows in (velocity, acceleration) for _, _, chain in rows for name, _, v in chain if v != 0
    }
    handles = [Line2D([], [], color=OWN, lw=1.6, label="from the pole: the point's own")]
    handles += [
        Line2D([], [], color=color, lw=1.2, label=name) for name, color in COLORS.items() if name in used
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    place(labels)


def _polygon(axes: Axes, rows: list[tuple[str, complex, list[tuple[str, complex, complex]]]], title: str, unit: str) -> list[Label]:  # fmt: skip
    largest = max((abs(own) for _, own, _ in rows), default=0.0)
    factor, unit = prefixed(largest, unit)
    labels, named = [], {}
    points = [0j]
    for name, own, chain in rows:
        for part, start, value in chain:
            if abs(value) > 1e-9 * largest:
                _arrow(axes, start * factor, (start + value) * factor, COLORS[part], 1.2)
                points += [start * factor, (start + value) * factor]
        if abs(own) > 1e-9 * largest and name not in named:
            _arrow(axes, 0j, own * factor, OWN, 1.6)
            named[name] = own * factor
            points.append(own * factor)
    for name, at in named.items():
        labels.append(Label(name, (at.real, at.imag), OWN, toward=float(np.degrees(np.angle(at)))))
    every = np.array(points)
    axes.plot(every.real, every.imag, lw=0)
    axes.plot([0], [0], "o", color="0.3", ms=5)
    labels.append(Label("pole", (0.0, 0.0), "0.3", 8.0))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.15)
    plain(axes)
    axes.set_title(f"{title}, {unit}", fontsize=11)
    return labels


def _arrow(axes: Axes, start: complex, end: complex, color: str, width: float) -> None:
    axes.annotate("", xy=(end.real, end.imag), xytext=(start.real, start.imag), arrowprops=head(color, width))
