"""Pictures of a balance of virtual power: its ledger as bars, or the unknowns over the steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.work.read import LOADS
from cli.work.solve import WorkBalance

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: WorkBalance) -> Figure:
    """Draw the ledger of one step as bars; of several, each unknown against the step."""
    steps = found.states.steps
    if len(steps) == 1:
        terms = [term for term in found.terms(0) if term.power is not None]
        several = len(steps[0].fields) > 1
        labels = [f"{term.link}: {term.kind}" + (f" ({term.field})" if several else "") for term in terms]
        return _ledger(labels, [term.power or 0.0 for term in terms])
    series: dict[str, list[float]] = {}
    for index in range(len(steps)):
        for _, cell, value in found.unknowns(index):
            name = f"link {cell.link}, {LOADS[cell.quantity]}"
            series.setdefault(name, [np.nan] * len(steps))[index] = np.nan if value is None else value
    return _curves([step.name for step in steps], series)


def _ledger(labels: Sequence[str], powers: Sequence[float]) -> Figure:
    """Draw each term's power as a bar, first term on top."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 0.42 * len(labels) + 1.4), layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(labels))
    unknown = [label.split(": ")[-1].startswith("unknown") for label in labels]
    bars = axes.barh(
        places, powers, height=0.6, color=["black" if mine else "0.65" for mine in unknown], edgecolor="black"
    )
    axes.bar_label(bars, labels=[f"{power:.6g}" for power in powers], padding=4, fontsize=8)
    axes.axvline(0, color="black", lw=0.8)
    axes.set_yticks(places, labels)
    axes.invert_yaxis()
    axes.margins(x=0.2)
    axes.set_xlabel("virtual power, W (black: the unknown's; together zero)")
    axes.grid(axis="x", color="0.9")
    axes.set_axisbelow(True)
    return figure


def _curves(steps: Sequence[str], series: Mapping[str, Sequence[float]]) -> Figure:
    """Draw each unknown over the steps, one panel for each."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 2.6 * len(series) + 0.4), layout="constrained")
    grid = figure.subplots(len(series), 1, squeeze=False, sharex=True)
    try:
        x = [float(step) for step in steps]
    except ValueError:
        x = [float(index) for index in range(1, len(steps) + 1)]
    for axes, (name, values) in zip(grid[:, 0], series.items(), strict=True):
        axes.plot(x, values, color="black", lw=1.4, marker="." if len(x) < 40 else "")
        axes.axhline(0, color="0.5", lw=0.8)
        link, quantity = name.rsplit(", ", 1)
        symbol, unit = quantity.split("_", 1)
        axes.set_ylabel(f"{symbol} on {link}, {unit.replace('_', '·')}")
        axes.grid(color="0.9")
    grid[-1, 0].set_xlabel("step")
    return figure
