"""The picture of a flywheel: torque and its mean over the angle, below them the energy with its range."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.flywheel.turns import Flywheel
from cli.show.picture import blank
from dalembert.drawing.curves import Curve, panel, spread
from dalembert.drawing.sheet import sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(wheel: Flywheel) -> Figure:
    """Draw torque and energy over the angle."""
    figure = blank()
    sheet(7.5, 5.6, figure)
    above, below = figure.subplots(2, 1, sharex=True)
    c, angle = wheel.cycle, wheel.angle
    first = panel(
        above,
        angle,
        [Curve("torque", wheel.torque), Curve("mean", np.full(len(angle), c.mean))],
        "torque",
        "N·m",
    )
    # parabolas between rows
    fine = np.unique(
        np.concatenate([np.linspace(angle[0], angle[-1], 721), angle, np.degrees([c.fastest, c.slowest])])
    )
    k = np.clip(np.searchsorted(angle, fine, side="right") - 1, 0, len(angle) - 2)
    width = angle[k + 1] - angle[k]
    share = np.divide(fine - angle[k], width, out=np.zeros_like(fine), where=width > 0)
    over = wheel.torque - c.mean
    here = over[k] + share * (over[k + 1] - over[k])
    values = c.energy[k] + (over[k] + here) / 2 * np.radians(fine - angle[k])
    second = panel(below, fine, [Curve("energy", values)], "energy of the flywheel", "J", c.rounding)
    low, high = float(values.min()), float(values.max())
    scale = below.lines[0].get_ydata()
    if low < high:
        for level in (np.min(scale), np.max(scale)):
            below.axhline(float(level), color="0.5", lw=0.8, ls=":")
    below.set_title(f"between the dotted lines: {c.fluctuation:.4g} J", fontsize=9, loc="left")
    below.set_xlabel("angle of the shaft, deg")
    # quarter turns of one or two turns
    below.set_xticks(angle[0] + 90.0 * np.ceil(wheel.turns / 2) * np.arange(0, 9))
    below.set_xlim(angle[0], angle[-1])
    spread([first, second])
    return figure
