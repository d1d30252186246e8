"""A mechanism drawn to scale: the first pose in full, others of the motion as ghosts, the paths of its points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.drawing.amounts import dimensioned
from dalembert.drawing.labels import Label, place
from dalembert.drawing.sheet import empty, plain, sheet
from virtualwork.describe.parts import GROUND
from virtualwork.drawing import Circle, Coil, Drawing, Shape, draw, tracers
from virtualwork.formulas.kinematics import Slide
from virtualwork.formulas.numbers import Complexes
from virtualwork.formulas.poses import Poses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

DRAWN = 6
"""The number of poses of a motion that are drawn, the first in full."""
PATH = 1441
"""Points of a path over a whole turn."""
COLORS = ("#0072b2", "#d55e00", "#009e73", "#a0307a", "#7a5c00", "#5b6ee1", "#b22222", "#2f7f8f")
CHAIN = (0, (9, 2, 2, 2))
LINES: dict[str, dict[str, Any]] = {
    "rail": {"color": "0.35", "lw": 1.0},
    "hatch": {"color": "0.5", "lw": 0.6},
    "frame": {"color": "0.25", "lw": 1.0},
    "link": {"lw": 2.2, "solid_capstyle": "round"},
    "wheel": {"lw": 1.1, "ls": CHAIN},
    "spoke": {"lw": 1.4},
    "belt": {"lw": 1.6},
    "rack": {"lw": 1.4},
    "cam": {"lw": 1.6},
    "roller": {"lw": 1.2},
    "slot": {"lw": 0.9},
    "block": {"lw": 1.4},
    "spring": {"color": "0.25", "lw": 0.9},
    "mass": {"color": "0.35", "lw": 0.8},
    "pin": {"color": "black", "lw": 1.0},
    "tip": {"color": "black", "lw": 1.0},
}
"""The line of a shape of each role; without a colour in that of its body."""
OPAQUE = ("frame", "block", "pin", "tip", "slot")
CIRCLE = np.exp(1j * np.linspace(0, 2 * np.pi, 73))


def on_paper(poses: Poses, points: Sequence[str] | None = None, figure: FigureBase | None = None) -> Axes:
    """Draw the mechanism.

    Parameters
    ----------
    poses
        The first that is assembled is drawn in full, some of the others as ghosts.
    points
        Whose paths are drawn; None: of the points that are no joint.
    figure
        See `dalembert.drawing.sheet`.
    """
    return _Paper(poses, figure).draw(points)


def shapes_of(*motions: Poses) -> Drawing:
    """Return what a mechanism is drawn as, its guides as long as they are used in the poses of all of its motions."""
    return draw(motions[0].mechanism, travel_of(*motions))


def travel_of(*motions: Poses) -> list[tuple[float, float]]:
    """Return the least and the largest slide of each guide in the poses of all motions, m."""
    spans = []
    for i in range(len(motions[0].mechanism.guides)):
        slide = np.concatenate([poses.values([Slide(i, 0)])[0] for poses in motions])
        used = slide[np.isfinite(slide)]
        spans.append((float(used.min()), float(used.max())) if len(used) else (-np.inf, np.inf))
    return spans


class _Paper:
    def __init__(self, poses: Poses, figure: FigureBase | None) -> None:
        self.poses, self.m = poses, poses.mechanism
        self.travel = self._travel()
        self.drawing = shapes_of(poses, self.travel)
        self.scale, self.unit = dimensioned(self.m.size)
        good = np.flatnonzero(poses.assembled)
        steps = np.linspace(0, max(len(good) - 1, 0), min(DRAWN, len(good))).astype(int)
        self.shown: list[int] = list(dict.fromkeys(good[steps].tolist()))
        self.colors = {GROUND: "0.25"} | {b: COLORS[k % len(COLORS)] for k, b in enumerate(self.m.links)}
        # each body's origin and its x-axis of one metre, over the poses
        self.places = {
            body: [poses.point(body, z) * self.scale for z in (0j, 1 + 0j)] for body in self.m.bodies
        }
        self.axes = sheet(7.4, self._height(6.4) + 0.9, figure).add_subplot()

    def _travel(self) -> Poses:
        """Return the poses over the whole travel of the input: a turn, or as far as a slide goes."""
        poses = self.poses
        if len(self.m.inputs) != 1:
            return poses
        low, high = float(poses.inputs.min()), float(poses.inputs.max())
        if not self.m.inputs[0].is_slide:
            turns = max(1.0, (high - low) / (2 * np.pi))
            low = low if turns > 1 else self.m.at[0]
            high = low + 2 * np.pi * turns
        return type(poses)(poses.branch, np.linspace(low, high, PATH)) if high > low else poses

    def _height(self, width: float) -> float:
        """Return the height of a drawing of this width: that of its contents, within bounds."""
        outlines = [self._outline(shape, i) for i in self.shown for shape in self.drawing.shapes]
        every = np.concatenate(outlines) if outlines else np.zeros(1, dtype=complex)
        across = float(np.ptp(every.real))
        if not across:
            return width
        return float(np.clip(width * np.ptp(every.imag) / across, 0.45 * width, 1.1 * width))

    def draw(self, points: Sequence[str] | None) -> Axes:
        axes, labels = self.axes, self._paths(points)
        axes.set_aspect("equal", adjustable="datalim")
        title = self.m.name
        if self.shown:
            first, *others = self.shown
            for i in reversed(others):
                for shape in self.drawing.shapes:
                    if shape.role == "link":
                        z = self._outline(shape, i)
                        axes.plot(z.real, z.imag, color="0.78", lw=0.9, zorder=1)
            for k, shape in enumerate(self.drawing.shapes):
                self._shape(shape, self._outline(shape, first), 3 + k / 1000)
            labels = self._names(first) + labels
            title = " — ".join(filter(None, (self.m.name, self._where(first))))
        axes.set_title(title, fontsize=10)
        if not self.shown:
            empty(axes, "cannot be assembled in any of these poses")
            return axes
        axes.set_xlabel(f"x, {self.unit}")
        axes.set_ylabel(f"y, {self.unit}")
        plain(axes)
        axes.margins(0.06)
        place([(axes, labels)])
        return axes

    def _where(self, i: int) -> str:
        """Return the inputs of a pose as text."""
        shown = []
        for entry, value in zip(self.m.inputs, self.poses.inputs[i], strict=True):
            at = f"{value * self.scale:.6g} {self.unit}" if entry.is_slide else f"{np.degrees(value):.6g}°"
            shown.append(f"{entry.name} at {at}")
        return ", ".join(shown)

    def _at(self, body: str, z: Complexes | complex, i: int) -> Complexes:
        """Return where points of a body stand in a pose, in the unit of the drawing."""
        origin, unit = (place[i] for place in self.places[body])
        return np.atleast_1d(np.asarray(origin + z * (unit - origin)))

    def _outline(self, shape: Shape, i: int) -> Complexes:
        """Return a shape as a line in a pose."""
        if isinstance(shape, Coil):
            a, b = (complex(self._at(body, z, i)[0]) / self.scale for body, z in shape.ends)
            return np.array([self.scale * z for z in shape.along(a, b)], dtype=complex)
        if isinstance(shape, Circle):
            return self._at(shape.body, shape.centre + shape.radius * CIRCLE, i)
        ring = shape.points + shape.points[:1] if shape.closed else shape.points
        return self._at(shape.body, np.array(ring), i)

    def _shape(self, shape: Shape, z: Complexes, level: float) -> None:
        color = self.colors[shape.body]
        closed = len(z) > 2 and z[0] == z[-1]
        if closed and shape.role in OPAQUE:
            self.axes.fill(z.real, z.imag, facecolor="white", zorder=level)
        elif closed and shape.role == "link":
            self.axes.fill(z.real, z.imag, facecolor=color, alpha=0.15, zorder=level)
        self.axes.plot(z.real, z.imag, **({"color": color} | LINES[shape.role]), zorder=level)

    def _names(self, i: int) -> list[Label]:
        """Return the names of points and links in a pose; a link of one point has its name next to the point."""
        names = []
        for label in self.drawing.labels:
            at, point = complex(self._at(label.body, label.at, i)[0]), label.of == "point"
            color, size = ("black", 9.0) if point else (self.colors[label.body], 8.0)
            names.append(Label(label.text, (at.real, at.imag), color, size))
        return names

    def _paths(self, points: Sequence[str] | None) -> list[Label]:
        """Draw the paths of points over the whole travel, and return their names."""
        m = self.m
        labels = []
        wanted = tracers(m) if points is None else [p for p in points if p in m.points and p not in m.ground]
        for name in dict.fromkeys(wanted) if self.travel.n > 1 else ():
            z = self.travel.point(*m.points[name], 0, name) * self.scale
            self.axes.plot(z.real, z.imag, color="0.15", lw=0.9, zorder=2)
            at = z[np.isfinite(z)]
            if len(at):
                top = complex(at[np.argmax(at.imag)])
                labels.append(Label(f"path of {name}", (top.real, top.imag), "0.25", 8.0))
        return labels
