"""The picture of a balance of virtual power: of one step its ledger, of several the unknowns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.show.picture import blank
from cli.work.read import LOADS
from cli.work.solve import WorkBalance
from virtualwork.textbook.picture import ledger, over_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: WorkBalance) -> Figure:
    """Draw the ledger of one step as bars; of several, each unknown against the step."""
    figure, steps = blank(), found.states.steps
    if len(steps) == 1:
        several = len(steps[0].fields) > 1
        terms = [
            (term.link, term.kind + (f" ({term.field})" if several else ""), term.power)
            for term in found.terms(0)
            if term.power is not None
        ]
        ledger(terms, figure)
        return figure
    series: dict[tuple[str, str], list[float]] = {}
    for index in range(len(steps)):
        for _, cell, value in found.unknowns(index):
            symbol, unit = LOADS[cell.quantity].split("_", 1)
            name = f"{symbol} on link {cell.link}", unit.replace("_", "·")
            series.setdefault(name, [np.nan] * len(steps))[index] = np.nan if value is None else value
    try:
        x = np.array([float(step.name) for step in steps])
    except ValueError:
        x = np.arange(1.0, len(steps) + 1)
    over_steps(x, series, figure)
    return figure
