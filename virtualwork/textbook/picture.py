"""Pictures of a balance of virtual power: its ledger as bars, or the unknowns over the steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.drawing.amounts import prefixed, quiet
from dalembert.drawing.curves import Curve, panel
from dalembert.drawing.sheet import plain, sheet

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

UNKNOWN = "unknown"
Panels = NDArray[np.object_]


def ledger(terms: Sequence[tuple[str, str, float]], figure: FigureBase | None = None) -> Panels:
    """Draw the power of each term as a bar, first term on top; a term is its link, its kind and its power, W."""
    figure = sheet(7.4, 0.42 * len(terms) + 1.4, figure)
    axes = figure.subplots()
    places = np.arange(len(terms))
    powers = np.array([power for *_, power in terms])
    factor, unit = prefixed(float(np.abs(powers).max(initial=0.0)), "W")
    values = quiet(powers, 0.0) * factor
    colors = ["black" if kind.startswith(UNKNOWN) else "0.65" for _, kind, _ in terms]
    bars = axes.barh(places, values, height=0.6, color=colors, edgecolor="black")
    axes.bar_label(bars, labels=[f"{value:.6g}" for value in values], padding=4, fontsize=8)
    axes.axvline(0, color="black", lw=0.8)
    plain(axes, "x")
    axes.grid(visible=False, axis="y")
    axes.set_yticks(places, [f"{link}: {kind}" for link, kind, _ in terms])
    axes.invert_yaxis()
    axes.margins(x=0.25)
    axes.set_xlabel(f"virtual power, {unit} (black: the unknown load; the sum is zero)")
    return np.array([axes], dtype=object)


def over_steps(
    x: ArrayLike, series: Mapping[tuple[str, str], ArrayLike], figure: FigureBase | None = None
) -> Panels:
    """Draw each unknown over the steps, one panel for each: what it is and its unit -> its values."""
    figure = sheet(7.4, 2.6 * len(series) + 0.4, figure)
    grid: Panels = figure.subplots(len(series), 1, squeeze=False, sharex=True)[:, 0]
    for axes, ((what, unit), values) in zip(grid, series.items(), strict=True):
        panel(axes, np.asarray(x, dtype=float), [Curve("", values)], what, unit)
        axes.axhline(0, color="0.5", lw=0.8, zorder=1)
    grid[-1].set_xlabel("step")
    return grid
