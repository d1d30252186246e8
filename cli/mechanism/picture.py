"""Pictures of a mechanism: drawn in its poses with the paths of its points, or any output against the input."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.graphs import quantities
from cli.mechanism.solve import Analysis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from virtualwork.motion import Motion

DRAWN = 6  # poses of a sweep that are drawn, the first in full


def draw(analysis: Analysis) -> Figure:
    """Draw the mechanism to scale: the first pose in full, others as ghosts, the paths of its points."""
    from matplotlib.figure import Figure

    scale, unit = _unit(analysis.mechanism.size)
    motion = analysis.motions[0]
    figure = Figure(figsize=(7.2, 6.0), layout="constrained")
    axes = figure.subplots()
    axes.set_aspect("equal", adjustable="datalim")
    good = np.flatnonzero(motion.assembled)
    for curve, name in _paths(analysis, motion):
        axes.plot(curve.real * scale, curve.imag * scale, color="0.15", lw=0.9, ls="-", zorder=2)
        at = curve[np.isfinite(curve)]
        if len(at):
            top = at[np.argmax(at.imag)]
            axes.annotate(
                f"path of {name}", (top.real * scale, top.imag * scale), textcoords="offset points",
                xytext=(0, 5), fontsize=8, color="0.15", ha="center",
            )  # fmt: skip
    if len(good):
        chosen = list(
            dict.fromkeys(good[np.linspace(0, len(good) - 1, min(DRAWN, len(good))).astype(int)].tolist())
        )
        for rank, i in enumerate(reversed(chosen)):
            _pose(axes, analysis, motion, i, scale, full=rank == len(chosen) - 1)
    for name, z in analysis.mechanism.ground.items():
        axes.plot(z.real * scale, z.imag * scale, marker="^", ms=9, mfc="white", mec="black", zorder=6)
        _label(axes, name, z * scale, (7, -11))
    shown = analysis.inputs.shown[good[0]] if len(good) else []
    where = ", ".join(
        f"{e.name} at {v * (scale if e.is_slide else 1):.6g} {unit if e.is_slide else 'deg'}"
        for e, v in zip(analysis.mechanism.inputs, shown, strict=False)
    )
    axes.set_title(" — ".join(t for t in (analysis.mechanism.name, where) if t), fontsize=10)
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    return figure


def _unit(size: float) -> tuple[float, str]:
    return (1e3, "mm") if size < 2 else (1.0, "m")


def _paths(analysis: Analysis, motion: Motion) -> list[tuple[Any, str]]:
    """The curves of the points asked for, over the whole travel of the input."""
    from virtualwork.motion import Motion

    m = analysis.mechanism
    if len(m.inputs) != 1:
        full = motion
    else:
        track = motion.assembly.track
        if m.inputs[0].is_slide:
            low, high = motion.inputs.min(), motion.inputs.max()
        else:
            turns = max(1.0, float(np.ptp(motion.inputs)) / (2 * np.pi))
            low = motion.inputs.min() if turns > 1 else track.start
            high = low + 2 * np.pi * turns
        full = Motion(motion.assembly, np.linspace(low, high, 1441)) if high > low else motion
    if analysis.only is not None:
        names = [p for p in analysis.points if p not in m.ground]
    else:
        guided = {g.point for g in m.guides}
        names = [p for n in m.links for p in m.links[n].points if p not in m.pins and p not in guided]
    return [(full.point(name).complex(0), name) for name in names] if full.n > 1 else []


def _pose(axes: Axes, analysis: Analysis, motion: Motion, i: int, scale: float, *, full: bool) -> None:
    m = analysis.mechanism
    for k, (name, link) in enumerate(m.links.items()):
        z = np.array([motion.point(p).complex(0)[i] for p in link.points]) * scale
        colour = "0.72"
        if full:
            colour = (
                "tab:blue",
                "tab:orange",
                "tab:green",
                "tab:red",
                "tab:purple",
                "tab:brown",
                "tab:olive",
                "tab:cyan",
            )[k % 8]
        width, level = (2.4, 4) if full else (1.0, 1)
        if len(z) > 2:
            order = _around(z)
            axes.fill(
                z[order].real, z[order].imag, facecolor=colour, alpha=0.16 if full else 0.05, zorder=level - 1
            )
            ring = np.append(order, order[0])
            axes.plot(
                z[ring].real, z[ring].imag, color=colour, lw=width, zorder=level, solid_capstyle="round"
            )
        elif len(z) == 2:
            axes.plot(z.real, z.imag, color=colour, lw=width, zorder=level, solid_capstyle="round")
        if full and len(z) > 1:
            at = z.mean()
            axes.annotate(
                name, (at.real, at.imag), textcoords="offset points", xytext=(5, 5), fontsize=8,
                color=colour, zorder=8, bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7},
            )  # fmt: skip
    if not full:
        return
    for number, guide in enumerate(m.guides):
        _guide(axes, motion, number, guide, i, scale)
    for body in m.links.values():
        for p in body.points:
            z = motion.point(p).complex(0)[i] * scale
            axes.plot(z.real, z.imag, marker="o", ms=4.5, mfc="white", mec="black", zorder=7)
            if p not in m.ground:
                _label(axes, p, z, (-10, -10))


def _guide(axes: Axes, motion: Motion, number: int, guide: Any, i: int, scale: float) -> None:
    """A guide as a dash-dotted line as long as the point travels along it."""
    m = motion.mechanism
    through = m.bodies[guide.on][guide.through] if isinstance(guide.through, str) else guide.through
    slide = motion.slide(guide.point).position
    ends = np.array([np.nanmin(slide), np.nanmax(slide)]) + np.array([-0.12, 0.12]) * m.size
    along = complex(np.cos(guide.angle), np.sin(guide.angle))
    z = np.array([motion.at(guide.on, through + s * along).complex(0)[i] for s in ends]) * scale
    axes.plot(z.real, z.imag, color="0.35", lw=1.2, ls="-.", zorder=3)
    at = motion.point(guide.point).complex(0)[i] * scale
    axes.plot(at.real, at.imag, marker="s", ms=9, mfc="none", mec="black", zorder=7)


def _around(z: Any) -> Any:
    """The points of a link in an order that does not cross itself."""
    return np.argsort(np.angle(z - z.mean()))


def _label(axes: Axes, name: str, z: complex, offset: tuple[int, int]) -> None:
    axes.annotate(name, (z.real, z.imag), textcoords="offset points", xytext=offset, fontsize=9, zorder=9)


STYLES = ("-", "--", "-.", ":")


def graphs(analysis: Analysis, text: str) -> Figure:
    """Draw quantities against the input: one panel for each unit."""
    from matplotlib.figure import Figure

    found = quantities(analysis, text)
    units = list(dict.fromkeys(q.unit for q in found))
    figure = Figure(figsize=(7.2, 1.0 + 2.2 * len(units)), layout="constrained")
    rows = figure.subplots(len(units), 1, sharex=True, squeeze=False)[:, 0]
    m = analysis.mechanism
    x: Any
    if len(m.inputs) == 1:
        slide = m.inputs[0].is_slide
        x, label = analysis.inputs.shown[:, 0], f"{m.inputs[0].name}, {'m' if slide else 'deg'}"
    else:
        x, label = np.arange(1, len(analysis.inputs.shown) + 1), "step"
    for axes, unit in zip(rows, units, strict=True):
        for k, q in enumerate(q for q in found if q.unit == unit):
            marker = "o" if len(x) == 1 else None
            axes.plot(x, q.values, lw=1.6, ls=STYLES[k % 4], label=q.label, marker=marker)
        axes.set_ylabel(unit)
        axes.grid(color="0.9", lw=0.6)
        axes.legend(fontsize=8, frameon=False)
    rows[-1].set_xlabel(f"input {label}")
    figure.suptitle(m.name, fontsize=10)
    return figure
