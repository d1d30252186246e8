"""The picture of a motion under forces: inputs, speeds and energy over time, the mechanism at instants."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from virtualwork import Mechanism
    from virtualwork.intime.run import Run

STYLES = ("-", "--", "-.", ":")
INSTANTS = 5


def draw(run: Run, m: Mechanism) -> Figure:
    """Draw angles, speeds and energy against time, and beside them the mechanism at instants evenly apart."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 6.4), layout="constrained")
    halves: Any = figure.subfigures(1, 2, width_ratios=(1.25, 1))
    places, speeds, energy = halves[0].subplots(3, 1, sharex=True)
    for j, entry in enumerate(m.inputs):
        slide = entry.is_slide
        style = {"color": "0.0", "ls": STYLES[j % 4], "lw": 1.4}
        shown = run.angle[:, j] if slide else np.degrees(run.angle[:, j])
        places.plot(run.t, shown, label=f"{entry.name}, {'m' if slide else 'deg'}", **style)
        speeds.plot(run.t, run.speed[:, j], label=f"{entry.name}, {'m/s' if slide else 'rad/s'}", **style)
    energy.plot(run.t, run.energy, color="0.0", lw=1.4)
    # what is kept is a straight line, not its rounding
    low, high = energy.get_ylim()
    room = 1e-3 * float(np.abs(run.energy).max()) or 1.0
    if high - low < room:
        energy.set_ylim(low - room, high + room)
    for axes, label in ((places, "input"), (speeds, "speed"), (energy, "energy, J")):
        axes.set_ylabel(label)
        axes.grid(color="0.9")
    for axes in (places, speeds):
        axes.legend(fontsize=8, frameon=False)
    energy.set_xlabel("t, s")
    _instants(halves[1].subplots(), run, m)
    figure.suptitle(m.name, fontsize=10)
    return figure


def _instants(axes: Axes, run: Run, m: Mechanism) -> None:
    """The mechanism at a few times, the later the darker, with the way of its free points."""
    from matplotlib.ticker import MaxNLocator

    scale, unit = (1e3, "mm") if m.size < 2 else (1.0, "m")
    motion = run.motion
    chosen = np.unique(np.linspace(0, len(run.t) - 1, INSTANTS).astype(int))
    places = {p: motion.point(p).complex(0) * scale for link in m.links.values() for p in link.points}
    for name, z in places.items():
        if name not in m.pins and name not in m.ground:
            axes.plot(z.real, z.imag, color="0.6", lw=0.7, zorder=1)
    for rank, i in enumerate(chosen):
        shade = str(0.8 * (1 - rank / max(1, len(chosen) - 1)))
        for name, link in m.links.items():
            z = np.array([places[p][i] for p in link.points])
            if len(z) == 1:
                # a link of one named point: to its centre of mass
                z = np.append(z, motion.at(name, m.rigid[name].center).complex(0)[i] * scale)
            ring = np.append(z, z[0]) if len(z) > 2 else z
            axes.plot(ring.real, ring.imag, color=shade, lw=1.6, marker="o", ms=3, zorder=2 + rank)
        axes.plot([], [], color=shade, lw=1.6, label=f"{run.t[i]:.4g} s")
    for z in m.ground.values():
        axes.plot(z.real * scale, z.imag * scale, marker="^", ms=8, mfc="white", mec="black", zorder=10)
    axes.set_aspect("equal", adjustable="datalim")
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.legend(fontsize=8, frameon=False, title="mechanism at")
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
