"""The picture of a placement: the places on the rotor, the masses on them, what they are to be and what they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cli.place.solve import Placing
from cli.read.units import from_si
from cli.show.picture import arrow, free_direction

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes


class Panel(NamedTuple):
    """A plane: its places in degrees, the masses on them, what they are to be together and what they are."""

    title: str
    places: Sequence[float]
    masses: Sequence[float]
    target: complex
    total: complex


def draw(found: Placing) -> Figure:
    """Draw for each plane its places with their masses on the rim, target and total as vectors."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    unit, removed = found.request.unit, found.request.removes
    panels = [
        Panel(
            "" if share.z is None else f"z = {from_si(share.z, 'length', 'mm'):g} mm: ",
            [angle % 360.0 for angle in share.places],
            from_si(share.placed.masses, "mass", unit).tolist(),
            from_si(share.goal, "mass", unit),
            complex(from_si(share.placed.total, "mass", unit)),
        )
        for share in found.shares
    ]
    figure = Figure(figsize=(5.6 * len(panels), 6.2), layout="constrained")
    row = figure.subplots(1, len(panels), subplot_kw={"projection": "polar"}, squeeze=False)[0]
    for axes, panel in zip(row, panels, strict=True):
        _panel(axes, panel, unit, removed=removed)
    handles = [
        Line2D([], [], color="0.45", lw=4, label="correction"),
        Line2D([], [], color="tab:red", lw=1.8, label="what the masses are together"),
        Line2D(
            [],
            [],
            color="tab:red",
            marker="o",
            ls="",
            mfc="white" if removed else "tab:red",
            label="drilled" if removed else "mass",
        ),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    return figure


def _panel(axes: PolarAxes, panel: Panel, unit: str, *, removed: bool) -> None:
    title, places, masses, target, total = panel
    scale = max(abs(target), abs(total), *masses) or 1.0
    rim = 1.2 * scale
    axes.set_rlim(0, 1.95 * scale)
    axes.set_rticks([tick for tick in axes.get_yticks() if 0 < tick <= scale])
    axes.set_rlabel_position(free_direction([target, total]))
    axes.tick_params(labelsize=8, colors="0.3")
    axes.grid(color="0.88")
    largest = max(masses) or 1.0
    for k, (angle, mass) in enumerate(zip(places, masses, strict=True)):
        at = np.radians(angle)
        size = 4 + 12 * np.sqrt(mass / largest) if mass > 0 else 4
        axes.plot(
            [at],
            [rim],
            "o",
            ms=size,
            mfc="tab:red" if mass > 0 and not removed else "white",
            mec="tab:red" if mass > 0 else "0.6",
            mew=1.5,
        )
        if mass > 0:
            axes.annotate(
                f"{k + 1}: {mass:.4g} {unit}",
                xy=(at, rim),
                xytext=(36 * np.cos(at), 20 * np.sin(at)),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=9,
                bbox={"fc": "white", "ec": "none", "pad": 0.6, "alpha": 0.85},
            )
    arrow(axes, target, scale, "0.45", 4.0, "-", "")
    arrow(axes, total, scale, "tab:red", 1.8, "-", "")
    axes.set_title(
        f"{title}material to {'remove' if removed else 'add'}, {unit}; angles counter-clockwise",
        fontsize=10,
        pad=16,
    )
