"""The picture of a motion in time: inputs, speeds and energy as curves, beside them the mechanism at instants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.drawing.curves import Curve, Ends, panel, spread
from dalembert.drawing.sheet import plain, sheet
from virtualwork.describe.description import Description
from virtualwork.formulas.numbers import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

INSTANTS = 5
"""So many times the mechanism is drawn."""
FINE = 2001
"""So many times curves are drawn through."""
TURNS = 20
"""An angle of more turns than these is counted in turns."""


class Course(NamedTuple):
    """What is drawn: times, inputs and speeds (n, k), energy (n,), the motion."""

    t: Reals
    angle: Reals
    speed: Reals
    energy: Reals
    motion: Any


def fine_times(t: Reals) -> Reals:
    """Return times close enough for curves, those given among them."""
    return t if len(t) > FINE else np.union1d(t, np.linspace(t[0], t[-1], FINE))


def draw(course: Course, m: Description, figure: FigureBase | None = None) -> NDArray[np.object_]:
    """Draw a motion; return the axes: those of the inputs, of their speeds, of the energy, of the mechanism."""
    groups = [(what, [j for j, e in enumerate(m.inputs) if e.is_slide is what]) for what in (False, True)]
    groups = [(slide, members) for slide, members in groups if members]
    figure = sheet(11.5, 2.2 + 2.1 * 2 * len(groups), figure)
    if m.name:
        figure.suptitle(m.name, fontsize=10)
    halves: Any = figure.subfigures(1, 2, width_ratios=(1.25, 1))
    left, right = halves
    rows = left.subplots(2 * len(groups) + 1, 1, sharex=True)
    ends = []
    for k, (slide, members) in enumerate(groups):
        turned = float(np.abs(course.angle[:, members]).max(initial=0.0)) > TURNS * 2 * np.pi
        factor, unit = (1.0, "m") if slide else (0.5 / np.pi, "turns") if turned else (180 / np.pi, "deg")
        kinds = ("position", "speed", unit, "m/s") if slide else ("angle", "speed", unit, "rad/s")
        for axes, values, what, of in (
            (rows[k], course.angle * factor, kinds[0], kinds[2]),
            (rows[k + len(groups)], course.speed, kinds[1], kinds[3]),
        ):
            names = [m.inputs[j].name for j in members]
            lines = [
                Curve(n if len(m.inputs) > 1 else "", values[:, j])
                for n, j in zip(names, members, strict=True)
            ]
            label = f"{what} of {names[0]}" if len(m.inputs) == 1 else what
            ends.append(panel(axes, course.t, lines, label, of))
    ends.append(_energy(rows[-1], course))
    rows[-1].set_xlabel("t, s")
    beside = right.subplots()
    _instants(beside, course, m)
    spread(ends)
    return np.array([*rows, beside], dtype=object)


def _energy(axes: Axes, course: Course) -> Ends:
    ends = panel(axes, course.t, [Curve("", course.energy)], "energy", "J")
    # what is kept is a straight line, not its rounding
    low, high = axes.get_ylim()
    room = 1e-3 * max(abs(low), abs(high))
    if high - low < room:
        axes.set_ylim(low - room, high + room)
    return ends


def _instants(axes: Axes, course: Course, m: Description) -> None:
    """The mechanism at a few times, the later the darker, with the way of its free points."""
    from matplotlib.ticker import MaxNLocator

    scale, unit = (1e3, "mm") if m.size < 2 else (1.0, "m")
    motion, t = course.motion, course.t
    places = {p: motion.point(p).complex(0) * scale for link in m.links.values() for p in link.points}
    for name, z in places.items():
        if name not in m.pins and name not in m.ground:
            axes.plot(z.real, z.imag, color="0.6", lw=0.7, zorder=1)
    chosen: Sequence[int] = np.unique(np.searchsorted(t, np.linspace(t[0], t[-1], INSTANTS))).tolist()
    for rank, i in enumerate(chosen):
        shade = str(0.8 * (1 - rank / max(1, len(chosen) - 1)))
        for name, link in m.links.items():
            z = np.array([places[p][i] for p in link.points])
            if len(z) == 1:
                # a link of one named point: to its centre of mass
                z = np.append(z, motion.at(name, m.rigid[name].center).complex(0)[i] * scale)
            ring = np.append(z, z[0]) if len(z) > 2 else z
            axes.plot(ring.real, ring.imag, color=shade, lw=1.6, marker="o", ms=3, zorder=2 + rank)
        axes.plot([], [], color=shade, lw=1.6, label=f"{t[i]:.4g}")
    for z in m.ground.values():
        axes.plot(z.real * scale, z.imag * scale, marker="^", ms=8, mfc="white", mec="black", zorder=10)
    plain(axes)
    axes.set_aspect("equal", adjustable="datalim")
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    # below the axes: it hides nothing
    axes.legend(
        fontsize=8,
        frameon=False,
        title="the mechanism at t, s",
        title_fontsize=8,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.12),
        ncols=len(chosen),
        handlelength=1.4,
        columnspacing=1.2,
    )
