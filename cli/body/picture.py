"""The picture of a body: its parts, its principal axes and the vectors of its motion; of a shaft, its bearing forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.body.solve import MovingBody

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase


def draw(found: MovingBody) -> Figure:
    """Draw the body; beside it, for a shaft, the forces of the bearings seen along and across it."""
    from matplotlib.figure import Figure

    shaft = found.request.shaft is not None
    figure = Figure(figsize=(11 if shaft else 7, 6), layout="constrained")
    if shaft:
        left, right = figure.subfigures(1, 2, width_ratios=(1.25, 1), squeeze=False)[0]
        _body(left, found)
        _bearings(right, found)
    else:
        _body(figure, found)
    return figure


def _body(figure: FigureBase, found: MovingBody) -> None:
    from matplotlib.lines import Line2D

    axes = figure.add_subplot(projection="3d")
    parts, whole = found.parts.each, found.parts.whole
    center = whole.center
    lengths = np.sqrt(np.clip(np.trace(parts.inertia, axis1=1, axis2=2) / 2 / parts.mass, 0, None))
    reach = float(max(np.abs(parts.center - center).max(), lengths.max(), 1e-12))
    solid = parts.mass > 0
    size = 20 + 180 * np.abs(parts.mass) / np.abs(parts.mass).max()
    axes.scatter(
        *parts.center[solid].T, s=size[solid], color="0.6", alpha=0.7, edgecolor="0.3", depthshade=False
    )
    if (~solid).any():
        axes.scatter(
            *parts.center[~solid].T, s=size[~solid], facecolor="none", edgecolor="0.3", depthshade=False
        )
    if len(parts.mass) <= 12:
        for name, at in zip(found.parts.name, parts.center, strict=True):
            axes.text(*at, f"  {name}", fontsize=8)
    axes.scatter(*center, marker="+", color="black", s=90)
    moments, directions = whole.principal
    gyration = np.sqrt(moments / whole.mass)
    handles = [
        Line2D([], [], ls="", marker="o", color="0.6", markeredgecolor="0.3", label="parts (by mass)"),
        Line2D([], [], ls="", marker="+", color="black", label="centre of mass"),
        Line2D([], [], color="0.4", ls="-.", lw=1, label="principal axes (radius of gyration)"),
    ]
    for length, direction in zip(gyration, directions, strict=True):
        axes.plot(
            *np.stack([center - length * direction, center + length * direction], axis=-1),
            color="0.4",
            ls="-.",
            lw=1,
        )
    motion = found.motion
    span = max(reach, float(gyration.max()))
    for vector, label, color, style in (
        (motion.omega, "angular velocity", "tab:red", "-"),
        (motion.momentum, "angular momentum", "tab:blue", "--"),
        (motion.rate, "its rate", "black", ":"),
    ):
        length = float(np.linalg.norm(vector))
        if length > 0:
            axes.quiver(
                *center, *(vector / length * span), color=color, ls=style, lw=2, arrow_length_ratio=0.12
            )
            handles.append(Line2D([], [], color=color, ls=style, lw=2, label=f"{label} (direction)"))
    # a cube around everything, so that right angles look right
    low = np.minimum(parts.center.min(axis=0), center - span)
    high = np.maximum(parts.center.max(axis=0), center + span)
    middle, half = (low + high) / 2, (high - low).max() / 2
    for i, name in enumerate("xyz"):
        getattr(axes, f"set_{name}lim")(middle[i] - half, middle[i] + half)
        getattr(axes, f"set_{name}label")(f"{name}, m")
    axes.set_box_aspect((1, 1, 1))
    axes.tick_params(labelsize=7)
    figure.legend(handles=handles, fontsize=8, loc="outside lower left", ncols=2, frameon=False)


def _bearings(figure: FigureBase, found: MovingBody) -> None:
    shaft, request = found.shaft, found.request.shaft
    assert request is not None
    z = np.asarray(request.bearings)
    parts = found.parts.each
    for component, axes in enumerate(figure.subplots(2, 1, sharex=True)):
        axes.axhline(0, color="0.7", lw=3)
        axes.plot(parts.center[:, 2], 0 * parts.center[:, 2], "o", color="0.5", ms=5)
        span = abs(z[1] - z[0])
        kinds = [
            ("static", shaft.static[:, component], "0.45", -0.012),
            ("dynamic", shaft.dynamic[:, component], "tab:red", 0.012),
        ]
        if found.correction is not None:
            kinds.append(("after correction", found.corrected[:, component], "tab:blue", 0.036))
        for name, force, color, shift in kinds:
            axes.bar(z + shift * span, force, width=0.02 * span, color=color, label=name)
        axes.plot(z, [0, 0], "^", color="black", ms=9, label="bearings")
        axes.margins(y=0.15)
        axes.set_ylabel(f"force along {'xy'[component]}, N")
        axes.grid(color="0.92")
        axes.set_axisbelow(True)
        if component == 0:
            axes.set_title("forces of the bearings on the shaft", fontsize=10)
            axes.legend(fontsize=8)
        else:
            axes.set_xlabel("z, m")
