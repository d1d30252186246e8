"""Free-body diagrams of every link, all forces to one scale and all links to one scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import head
from dalembert.drawing.sheet import sheet
from dalembert.results.way import figures
from virtualwork.drawing import hull

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from virtualwork.study.free_bodies import FreeBody

COLORS = {
    "weight": "tab:green", "inertia force": "tab:red", "inertia torque": "tab:red", "joint force": "tab:blue",
    "joint moment": "tab:blue", "contact force": "tab:purple",
}  # fmt: skip
LENGTH = 0.8
"""The longest arrow, as a share of the largest link."""
MOST = 3
"""Panels in a row."""


def draw(bodies: Sequence[FreeBody], i: int, figure: FigureBase | None = None) -> None:
    """Draw pose i: a panel for each link, with its forces at their points and its torques as text."""
    columns = min(MOST, len(bodies))
    rows = -(-len(bodies) // columns)
    figure = sheet(3.9 * columns, 4.1 * rows + 0.4, figure)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    largest = max(
        (abs(f.force[i]) for body in bodies for f in body.forces if np.isfinite(f.force[i])), default=0.0
    )
    places = [np.array([*(z[i] for z in body.outline.values()), body.center[i]]) for body in bodies]
    widest = max((max(np.ptp(z.real), np.ptp(z.imag)) for z in places), default=0.0) or 1.0
    per_newton = LENGTH * widest / largest if largest else 0.0
    spans = []
    for body, here in zip(bodies, places, strict=True):
        ends = [f.at[i] + share * f.force[i] * per_newton for f in body.forces for share in (0, 1)]
        every = np.concatenate([here, [z for z in ends if np.isfinite(z)]])
        spans.append((every.real.min(), every.real.max(), every.imag.min(), every.imag.max()))
    window = 1.25 * (max(max(b - a, d - c) for a, b, c, d in spans) or widest)
    labels = []
    for axes, body, (a, b, c, d) in zip(panels, bodies, spans, strict=False):
        labels.append((axes, _panel(axes, body, i, per_newton, largest)))
        x, y = (a + b) / 2, (c + d) / 2
        axes.set_xlim(x - window / 2, x + window / 2)
        axes.set_ylim(y - window / 2, y + window / 2)
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
        torques = [f"{t.name} = {figures(float(t.torque[i]))} N·m" for t in body.torques if t.torque[i]]
        axes.set_title(body.link, fontsize=10)
        axes.set_xlabel("\n".join(torques), fontsize=8)
    for axes in panels[len(bodies) :]:
        axes.set_visible(False)
    if largest:
        figure.supxlabel(f"all to one scale; the longest arrow is {figures(float(largest))} N", fontsize=9)
    place(labels)


def _panel(axes: Axes, body: FreeBody, i: int, per_newton: float, largest: float) -> list[Label]:
    points = [complex(z[i]) for z in body.outline.values()]
    ring = hull(points) if len(points) > 2 else tuple(points)
    closed = np.array([*ring, *ring[:1]] if len(ring) > 2 else ring or [body.center[i]])
    if len(ring) > 2:
        axes.fill(closed.real, closed.imag, facecolor="0.9", zorder=1)
    axes.plot(closed.real, closed.imag, color="0.45", lw=2.5, solid_capstyle="round", zorder=2)
    for z in points:
        axes.plot([z.real], [z.imag], "o", mfc="white", mec="0.3", ms=5, zorder=3)
    center = complex(body.center[i])
    labels = []
    for force in body.forces:
        value, at = complex(force.force[i]), complex(force.at[i])
        if not np.isfinite(value) or abs(value) <= 1e-9 * largest:
            continue
        tip = at + value * per_newton
        color = COLORS.get(force.kind, "black")
        axes.annotate("", xy=(tip.real, tip.imag), xytext=(at.real, at.imag), arrowprops=head(color, 1.5))
        text = f"{force.name} {figures(float(f'{abs(value):.4g}'))} N"
        labels.append(Label(text, (tip.real, tip.imag), color, 7.5, float(np.degrees(np.angle(value)))))
        if force.kind in ("weight", "inertia force"):
            axes.plot([center.real], [center.imag], "+", color="0.2", ms=7, zorder=4)
    return labels
