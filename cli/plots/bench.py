"""Work-precision diagrams, and cost against size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.bench.measure import Measurement

MARKERS = "osD^vP*X<>"


def draw(measurements: Sequence[Measurement]) -> Figure:
    """Draw for each piece of work error over time, or, where it was done in several sizes, time over size."""
    from matplotlib.figure import Figure

    works = list(dict.fromkeys((m.domain, m.work) for m in measurements))
    columns = min(3, len(works))
    rows = -(-len(works) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.7 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, work in zip(panels, works, strict=False):
        mine = [m for m in measurements if (m.domain, m.work) == work]
        methods = list(dict.fromkeys(m.method for m in mine))
        sized = any(len({m.size for m in mine if m.method == method}) > 2 for method in methods)
        for k, method in enumerate(methods):
            points = [m for m in mine if m.method == method]
            label = method
            if sized:
                x, y = np.array([m.size for m in points]), np.array([m.ns * m.size for m in points])
                if len(points) > 2:
                    label += f": size^{np.polyfit(np.log(x[-3:]), np.log(y[-3:]), 1)[0]:.2f}"
            else:
                x = np.array([m.ns for m in points])
                y = np.array([max(m.error or 0.0, 1e-17) for m in points])
            axes.loglog(
                x,
                y,
                MARKERS[k % len(MARKERS)] + "-",
                color=str(0.75 * k / max(len(methods), 2)),
                ms=5,
                lw=1,
                label=label,
            )
        axes.set_title(f"{work[0]}: {work[1]}", fontsize=9)
        axes.set_xlabel("items in one call" if sized else "time per item, ns", fontsize=8)
        axes.set_ylabel("time of the call, ns" if sized else "worst relative error", fontsize=8)
        axes.tick_params(labelsize=8)
        axes.grid(color="0.9")
        axes.legend(fontsize=7)
    for axes in panels[len(works) :]:
        axes.set_visible(False)
    return figure
