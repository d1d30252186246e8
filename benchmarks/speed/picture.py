"""Work-precision diagrams, and cost against size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.speed.measure import exponent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from benchmarks.speed.measure import Measurement

MARKERS = "osD^vP*X<>hd"
COUNTED = ("poses", "links", "revolutions", "rotors", "planes", "states", "points")
LEAST = 1e-17  # where an exact answer is drawn


@dataclass(frozen=True)
class Kind:
    """What a panel shows: its axes, and which measurements have a place in it."""

    x: Callable[[Measurement], float]
    y: Callable[[Measurement], float]
    across: str
    up: str


def _error(m: Measurement) -> float:
    return max(m.error or 0.0, LEAST)


PRECISION = Kind(lambda m: m.ns, _error, "time per item, ns", "worst relative error")
COST = Kind(lambda m: m.size, lambda m: m.ns * m.size, "items in one call", "time of the call, ns")
MEMORY = Kind(lambda m: m.size, lambda m: m.bytes or 0.0, "items in one call", "memory of the call, bytes")
CONDITION = Kind(lambda m: m.condition or 1.0, _error, "condition number", "worst relative error")
GROWTH = Kind(lambda m: m.size, _error, "items in one call", "worst error")


def kinds(measurements: Sequence[Measurement]) -> list[Kind]:
    """Return what one piece of work is drawn as."""
    if any(m.condition for m in measurements):
        return [CONDITION]
    sizes: dict[str, set[int]] = {}
    for m in measurements:
        sizes.setdefault(m.method, set()).add(m.size)
    if any(len(s) > 2 for s in sizes.values()):
        errors = [m.error for m in measurements if m.error]
        grows = len(errors) > 2 and max(errors) > 1e4 * min(errors)
        memory = sum(bool(m.bytes) for m in measurements) > 2
        return [COST, *([GROWTH] if grows else []), *([MEMORY] if memory else [])]
    return [PRECISION] if any(m.error is not None for m in measurements) else []


def draw(measurements: Sequence[Measurement]) -> Figure:
    """Draw a panel for each piece of work: error over time, or where sizes differ, time and memory over size.

    Work that is measured at one size and without an error is drawn as bars of its methods.
    """
    from matplotlib.figure import Figure

    works = list(dict.fromkeys((m.domain, m.work) for m in measurements))
    panels: list[tuple[str, list[Measurement], Kind | None]] = []
    for domain, work in works:
        mine = [m for m in measurements if (m.domain, m.work) == (domain, work)]
        shown: list[Kind | None] = [*kinds(mine)] or [None]
        if len(mine) > 1 or len(works) == 1:
            panels += [(work, mine, kind) for kind in shown]
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    wide = any(kind is None for _, _, kind in panels)
    figure = Figure(figsize=((7.0 if wide else 4.8) * columns, 4.4 * rows), layout="constrained")
    every = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (work, mine, kind) in zip(every, panels, strict=False):
        axes.set_title(work, fontsize=9)
        axes.tick_params(labelsize=8)
        if kind is None:
            _bars(axes, mine)
        else:
            _curves(axes, mine, kind)
    for axes in every[len(panels) :]:
        axes.set_visible(False)
    return figure


def _curves(axes: Axes, measurements: list[Measurement], kind: Kind) -> None:
    # the steps of one iteration, "Newton, 3 steps", are one curve
    series: dict[str, list[Measurement]] = {}
    for m in measurements:
        name = m.method.split(", ")[0] if m.method.endswith(" steps") else m.method
        series.setdefault(name, []).append(m)
    for k, (name, mine) in enumerate(series.items()):
        points = [m for m in mine if kind is not MEMORY or m.bytes]
        if kind in (PRECISION, GROWTH, CONDITION):
            points = [m for m in points if m.error is not None]
        if not points:
            continue
        x, y = (np.array([f(m) for m in points], dtype=float) for f in (kind.x, kind.y))
        label = name
        if kind in (COST, MEMORY) and len(points) > 2:
            label += f": size^{exponent(x, y):.2f}"
        peer = points[0].peer
        axes.loglog(
            x,
            y,
            MARKERS[k % len(MARKERS)] + ("--" if peer else "-"),
            color=str(0.7 * k / max(len(series), 2)),
            markerfacecolor="white" if peer else None,
            ms=6,
            lw=1,
            label=label,
        )
        if kind is PRECISION and points[0].method != name:
            for m, at, error in zip(points, x, y, strict=True):
                axes.annotate(
                    m.method.split()[-2], (at, error), (5, 3), textcoords="offset points", fontsize=7
                )
    aimed = {m.aim_ns for m in measurements if m.aim_ns} if kind is PRECISION else set()
    if len(aimed) == 1:
        axes.axvline(aimed.pop(), color="0.4", ls=":", lw=1, label="aim")
    if kind is PRECISION:
        _a_decade(axes, [kind.x(m) for m in measurements], "x")
    if kind is not COST and kind is not MEMORY:
        _a_decade(axes, [kind.y(m) for m in measurements if m.error is not None], "y")
    named = [word for word in COUNTED if word in measurements[0].work]
    across = f"{min(named, key=measurements[0].work.index)} in one call" if named else kind.across
    axes.set_xlabel(across if kind in (COST, MEMORY, GROWTH) else kind.across, fontsize=8)
    axes.set_ylabel(kind.up, fontsize=8)
    axes.grid(color="0.9")
    # below the panel, where it hides nothing
    axes.legend(
        fontsize=7,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.16),
        ncols=2 if len(series) > 3 else 1,
        frameon=False,
    )


def _a_decade(axes: Axes, values: list[float], way: str) -> None:
    """Show at least a decade around the values, so that a rounding error more or less does not look like a mountain."""
    low, high = min(values), max(values)
    while high / low < 30:
        low, high = low / 2, high * 2
    (axes.set_xlim if way == "x" else axes.set_ylim)(low / 2, high * 2)


def _bars(axes: Axes, measurements: list[Measurement]) -> None:
    """Draw times as bars, with the count of operations or the ratio to the floor at their ends."""
    scale, unit = (1e-6, "ms") if max(m.ns for m in measurements) > 1e6 else (1.0, "ns")
    places = np.arange(len(measurements))[::-1]
    widths = [m.ns * scale for m in measurements]
    axes.barh(places, widths, color="0.75", edgecolor="black", lw=0.8)
    for place, width, m in zip(places, widths, measurements, strict=True):
        note = (
            f"{m.operations} operations" if m.operations else f"{m.ratio:.2f} × {m.floor}" if m.ratio else ""
        )
        # the longest bar has more room within than beyond it
        away, side = (-4, "right") if width > 0.9 * max(widths) else (4, "left")
        axes.annotate(
            note, (width, place), (away, 0), textcoords="offset points", ha=side, va="center", fontsize=7
        )
    axes.set_yticks(places, [m.method for m in measurements], fontsize=7)
    axes.set_xlim(0, 1.45 * max(widths))
    axes.set_xlabel(f"time per item, {unit}", fontsize=8)
    axes.grid(color="0.9", axis="x")
    axes.set_axisbelow(True)
