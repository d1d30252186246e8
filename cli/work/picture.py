"""Pictures of a balance of virtual power: its ledger as bars, or the unknowns over the steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.show.picture import blank
from cli.work.read import LOADS
from cli.work.solve import WorkBalance
from dalembert.drawing.amounts import prefixed, quiet
from dalembert.drawing.curves import Curve, panel
from dalembert.drawing.sheet import plain, sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: WorkBalance) -> Figure:
    """Draw the ledger of one step as bars; of several, each unknown against the step."""
    figure, steps = blank(), found.states.steps
    if len(steps) == 1:
        terms = [term for term in found.terms(0) if term.power is not None]
        several = len(steps[0].fields) > 1
        labels = [f"{term.link}: {term.kind}" + (f" ({term.field})" if several else "") for term in terms]
        _ledger(figure, labels, [term.power or 0.0 for term in terms])
        return figure
    series: dict[str, list[float]] = {}
    for index in range(len(steps)):
        for _, cell, value in found.unknowns(index):
            name = f"link {cell.link}, {LOADS[cell.quantity]}"
            series.setdefault(name, [np.nan] * len(steps))[index] = np.nan if value is None else value
    _curves(figure, [step.name for step in steps], series)
    return figure


def _ledger(figure: Figure, labels: Sequence[str], powers: Sequence[float]) -> None:
    """Draw each term's power as a bar, first term on top."""
    sheet(7.4, 0.42 * len(labels) + 1.4, figure)
    axes = figure.subplots()
    places = np.arange(len(labels))
    unknown = [label.split(": ")[-1].startswith("unknown") for label in labels]
    factor, unit = prefixed(float(np.abs(powers).max(initial=0.0)), "W")
    values = quiet(powers, 0.0) * factor
    bars = axes.barh(
        places, values, height=0.6, color=["black" if mine else "0.65" for mine in unknown], edgecolor="black"
    )
    axes.bar_label(bars, labels=[f"{value:.6g}" for value in values], padding=4, fontsize=8)
    axes.axvline(0, color="black", lw=0.8)
    plain(axes, "x")
    axes.grid(visible=False, axis="y")
    axes.set_yticks(places, labels)
    axes.invert_yaxis()
    axes.margins(x=0.25)
    axes.set_xlabel(f"virtual power, {unit} (black: the unknown's; together zero)")


def _curves(figure: Figure, steps: Sequence[str], series: Mapping[str, Sequence[float]]) -> None:
    """Draw each unknown over the steps, one panel for each."""
    sheet(7.4, 2.6 * len(series) + 0.4, figure)
    grid = figure.subplots(len(series), 1, squeeze=False, sharex=True)
    try:
        x = np.array([float(step) for step in steps])
    except ValueError:
        x = np.arange(1.0, len(steps) + 1)
    for axes, (name, values) in zip(grid[:, 0], series.items(), strict=True):
        link, quantity = name.rsplit(", ", 1)
        symbol, unit = quantity.split("_", 1)
        panel(axes, x, [Curve("", values)], f"{symbol} on {link}", unit.replace("_", "·"))
        axes.axhline(0, color="0.5", lw=0.8, zorder=1)
    grid[-1, 0].set_xlabel("step")
