"""The picture of an engine: the polygons of its orders, a row for each order, of forces and of couples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.engine.cylinders import Engine
from cli.show.picture import blank
from dalembert.drawing.amounts import prefixed
from dalembert.drawing.polar import head
from dalembert.drawing.sheet import plain, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cli.engine.cylinders import Complex, Real

ROWS = 3
"""So many orders are drawn, the lowest of those with forces."""
NAMED = 12
"""So many cylinders are named."""


def draw(e: Engine) -> Figure:
    """Draw the vectors of the cylinders one behind the other, and what they add up to."""
    f = e.reciprocating
    sizes = np.abs(f.with_crank).sum(axis=0)
    # an order far below the first is no polygon that anybody needs
    shown = np.flatnonzero(sizes > 1e-4 * sizes.max())[:ROWS]
    parallel = bool((e.cylinders.bank == e.cylinders.bank[0]).all())
    figure = blank()
    columns = 2 if parallel else 4
    sheet(3.6 * columns, 3.5 * max(len(shown), 1) + 0.7, figure)
    figure.suptitle(
        "order polygons of the reciprocating masses: vectors "
        + ("from the cylinders' axis" if parallel else "from +x")
        + " at θ = 0; red: their sum",
        fontsize=10,
    )
    panels = figure.subplots(max(len(shown), 1), columns, squeeze=False)
    z = e.cylinders.z
    for row, k in zip(panels, shown, strict=False):
        if parallel:
            # of a force along one axis the two halves are mirror images
            vectors = 2 * f.with_crank[:, k] * np.exp(-1j * np.radians(e.cylinders.bank))
            parts = [("", vectors)]
        else:
            parts = [(" with the crank", f.with_crank[:, k]), (" against it", f.against[:, k])]
        for j, (sense, of) in enumerate(parts):
            for axes, name, values, unit, couple in (
                (row[j], "force", of, "N", False),
                (row[len(parts) + j], "couple", of * z, "N·m", True),
            ):
                _polygon(
                    axes,
                    f"order {k + 1}: {name}{sense}",
                    values,
                    e.cylinders.names,
                    unit,
                    f.rounding(couple),
                    k,
                )
    return figure


def _polygon(
    axes: Axes, title: str, vectors: Complex, names: list[str], unit: str, rounding: Real, k: int
) -> None:
    """Draw vectors one behind the other."""
    factor, unit = prefixed(float(max(np.abs(vectors).max(initial=0.0), abs(vectors.sum()))), unit)
    ends = np.concatenate([[0.0], np.cumsum(vectors)]) * factor
    total = complex(ends[-1]) if abs(vectors.sum()) > rounding[k] else 0.0
    axes.set_title(f"{title}, {unit}", fontsize=9)
    middle = ends.mean()
    size = float(np.abs(ends[:, None] - ends[None, :]).max()) or 1.0
    placed: list[complex] = []
    for start, stop, name in zip(ends[:-1], ends[1:], names, strict=True):
        if abs(stop - start) < 1e-9 * size:
            continue
        axes.annotate("", (stop.real, stop.imag), (start.real, start.imag), arrowprops=head("0.25", 1.4))
        if len(names) > NAMED:
            continue
        along = (stop - start) / abs(stop - start)
        out = (
            1j * along
            if (((start + stop) / 2 - middle) * (1j * along).conjugate()).real >= 0
            else -1j * along
        )
        at = (start + stop) / 2 + 0.075 * size * out
        # vectors that lie on each other have their names side by side
        while any(abs(at - other) < 0.1 * size for other in placed):
            at += 0.11 * size * out
        placed.append(at)
        axes.annotate(
            name,
            (at.real, at.imag),
            ha="center",
            va="center",
            fontsize=8,
            bbox={"fc": "white", "ec": "none", "pad": 0.6},
            zorder=5,
        )
    if total:
        axes.annotate("", (total.real, total.imag), (0.0, 0.0), arrowprops=head("tab:red", 2.2))
    said = f"sum {abs(total):.4g} {unit}" if total else "sum 0: closed" if np.abs(vectors).any() else "none"
    axes.set_xlabel(said, fontsize=9, color="tab:red" if total else "black")
    points = np.array([*ends, *placed])
    center = complex(points.real.max() + points.real.min(), points.imag.max() + points.imag.min()) / 2
    reach = 0.62 * max(float(np.ptp(points.real)), float(np.ptp(points.imag)), 0.3 * size)
    axes.set_xlim(center.real - reach, center.real + reach)
    axes.set_ylim(center.imag - reach, center.imag + reach)
    axes.set_aspect("equal")
    plain(axes)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=5)
