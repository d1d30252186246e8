"""The polar picture of a balancing: masses, their resultant, the correction; a panel for each plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Complex = NDArray[np.complex128]
Panel = tuple[str, Sequence[str], Sequence[str], Complex, Complex]


def draw(panels: Sequence[Panel], unit: str, *, remove: bool) -> Figure:
    """Draw rotors below each other, their planes beside each other, all to one scale per rotor.

    A panel is (rotor, names of the masses, names of the planes, share of each mass in each plane (k, p),
    correction in each plane (p,)), in `unit`; the correction is what is added.
    """
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    columns = max(len(panel[2]) for panel in panels)
    figure = Figure(figsize=(4.4 * columns, 4.5 * len(panels) + 0.7), layout="constrained")
    grid = figure.subplots(len(panels), columns, subplot_kw={"projection": "polar"}, squeeze=False)
    for axes_row, (rotor, masses, planes, shares, made) in zip(grid, panels, strict=True):
        scale = max(float(np.abs(shares).max(initial=0)), float(np.abs(made).max(initial=0)))
        for column, axes in enumerate(axes_row):
            if column >= len(planes):
                axes.set_visible(False)
                continue
            title = f"plane {planes[column]}" if not rotor else f"rotor {rotor}, plane {planes[column]}"
            axes.set_title(title, pad=14)
            axes.set_rlim(0, 1.12 * scale or 1.0)
            axes.tick_params(labelsize=8, colors="0.3")
            axes.set_rlabel_position(
                free_direction([*shares[:, column], shares[:, column].sum(), made[column]])
            )
            axes.grid(color="0.85")
            few = len(masses) <= 12
            for name, share in zip(masses, shares[:, column], strict=True):
                arrow(axes, share, scale, "0.45", 1.2, "-", name if few else "")
            arrow(axes, shares[:, column].sum(), scale, "black", 1.6, "--", "")
            arrow(axes, -made[column] if remove else made[column], scale, "tab:red", 2.6, "-", "")
    handles = [
        Line2D([], [], color="0.45", lw=1.2, label="masses, their share in the plane"),
        Line2D([], [], color="black", lw=1.6, ls="--", label="resultant"),
        Line2D([], [], color="tab:red", lw=2.6, label=f"correction to {'remove' if remove else 'add'}"),
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(3, 2 * columns - 1), fontsize=9, frameon=False
    )
    figure.suptitle(f"unbalance, {unit}; angles counter-clockwise as seen against +z", fontsize=9)
    return figure


def arrow(axes: Axes, value: complex, scale: float, color: str, width: float, style: str, label: str) -> None:
    if not abs(value) > 1e-9 * scale:
        return
    angle, size = float(np.angle(value)), abs(value)
    axes.annotate(
        "",
        xy=(angle, size),
        xytext=(0, 0),
        arrowprops={
            "arrowstyle": "-|>,head_width=0.25,head_length=0.5",
            "color": color,
            "lw": width,
            "ls": style,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    if label:
        axes.annotate(
            label,
            xy=(angle, size),
            xytext=(7 * np.cos(angle), 7 * np.sin(angle)),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
        )


def free_direction(vectors: Sequence[complex]) -> float:
    """Return the direction, in degrees, in the middle of the widest gap between vectors: room for the scale."""
    angles = np.sort(np.degrees(np.angle([v for v in vectors if v])) % 360)
    if not len(angles):
        return 22.5
    gaps = np.diff(np.append(angles, angles[0] + 360))
    widest = int(np.argmax(gaps))
    return float((angles[widest] + gaps[widest] / 2) % 360)
