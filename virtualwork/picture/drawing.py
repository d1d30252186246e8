"""A mechanism drawn to scale: the first pose in full, others of the motion as ghosts, the paths of its points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dalembert.drawing.amounts import prefixed
from dalembert.drawing.labels import Label, place
from dalembert.drawing.sheet import plain, sheet
from virtualwork.describe.parts import GROUND, Guide
from virtualwork.formulas.numbers import Complexes, Reals
from virtualwork.formulas.poses import Poses
from virtualwork.picture.pitch_circles import pitch_circles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

DRAWN = 6
"""So many poses of a motion are drawn, the first in full."""
PATH = 1441
"""Points of a path over a whole turn."""
COLORS = ("#0072b2", "#d55e00", "#009e73", "#a0307a", "#7a5c00", "#5b6ee1", "#b22222", "#2f7f8f")


def drawing(poses: Poses, points: Sequence[str] | None = None, figure: FigureBase | None = None) -> Axes:
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
    return _Drawing(poses, sheet(7.4, _height(poses, 6.4) + 0.9, figure).add_subplot()).draw(points)


def _height(poses: Poses, width: float) -> float:
    """Return how high a drawing of this width had best be: as high as the motion is, within bounds."""
    m = poses.mechanism
    wheels = {(circle.body, circle.center): circle.radius for circle in pitch_circles(m)}
    found = []
    for body, points in m.bodies.items():
        for p, place_in_body in points.items():
            z = poses.point_derivative(body, place_in_body, 0, p)
            r = wheels.get((body, p), 0.0)
            found += [z - r * (1 + 1j), z + r * (1 + 1j)]
    every = np.concatenate(found) if found else np.zeros(0, dtype=complex)
    every = every[np.isfinite(every)]
    if not len(every) or not np.ptp(every.real):
        return width
    return float(np.clip(width * np.ptp(every.imag) / np.ptp(every.real), 0.45 * width, 1.1 * width))


class _Drawing:
    def __init__(self, poses: Poses, axes: Axes) -> None:
        self.poses, self.axes, self.m = poses, axes, poses.mechanism
        # drawings are dimensioned in millimetres up to two metres
        self.scale, self.unit = (1e3, "mm") if 2e-3 <= self.m.size < 2 else prefixed(self.m.size, "m")
        self.labels: list[Label] = []
        self.travel = self._travel()

    def draw(self, points: Sequence[str] | None) -> Axes:
        axes, m = self.axes, self.m
        axes.set_aspect("equal", adjustable="datalim")
        good = np.flatnonzero(self.poses.assembled)
        self._paths(points)
        title = m.name
        if len(good):
            steps = np.linspace(0, len(good) - 1, min(DRAWN, len(good))).astype(int)
            first, *others = dict.fromkeys(good[steps].tolist())
            for i in reversed(others):
                self._ghost(i)
            self._pose(first)
            title = " — ".join(filter(None, (m.name, self._where(first))))
        for name, z in m.ground.items():
            at = z * self.scale
            axes.plot(at.real, at.imag, marker="^", ms=9, mfc="white", mec="black", zorder=6)
            self.labels.append(self._label(name, at))
        axes.set_title(title, fontsize=10)
        axes.set_xlabel(f"x, {self.unit}")
        axes.set_ylabel(f"y, {self.unit}")
        plain(axes)
        axes.margins(0.08)
        place([(axes, self.labels)])
        return axes

    def _where(self, i: int) -> str:
        """Say at which inputs a pose stands."""
        shown = []
        for entry, value in zip(self.m.inputs, self.poses.inputs[i], strict=True):
            at = f"{value * self.scale:.6g} {self.unit}" if entry.is_slide else f"{np.degrees(value):.6g}°"
            shown.append(f"{entry.name} at {at}")
        return ", ".join(shown)

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
        return Poses(poses.branch, np.linspace(low, high, PATH)) if high > low else poses

    def _point(self, poses: Poses, body: str, point: str) -> Complexes:
        return poses.point_derivative(body, self.m.bodies[body][point], 0, point) * self.scale

    def _label(self, text: str, at: complex, color: str = "black", size: float = 9.0) -> Label:
        return Label(text, (float(at.real), float(at.imag)), color, size)

    def _paths(self, points: Sequence[str] | None) -> None:
        m = self.m
        if self.travel.n < 2:
            return
        guided = {g.point for g in m.guides}
        for body, link in m.links.items():
            for name in link.points:
                if points is not None:
                    mine = (
                        name in points
                        and name not in m.ground
                        and m.pins.get(name, (body,))[0] in (body, GROUND)
                    )
                else:
                    mine = name not in m.pins and name not in guided
                if not mine:
                    continue
                z = self._point(self.travel, body, name)
                self.axes.plot(z.real, z.imag, color="0.15", lw=0.9, zorder=2)
                at = z[np.isfinite(z)]
                if len(at):
                    self.labels.append(self._label(f"path of {name}", at[np.argmax(at.imag)], "0.25", 8.0))

    def _outline(self, body: str, i: int) -> Complexes:
        """Return the points of a link in a pose, around in an order that does not cross itself; of two, both."""
        z: Complexes = np.array([self._point(self.poses, body, p)[i] for p in self.m.bodies[body]])
        if len(z) < 3:
            return z
        ring = np.argsort(np.angle(z - z.mean()), kind="stable")
        return np.asarray(z[np.append(ring, ring[0])])

    def _ghost(self, i: int) -> None:
        for body in self.m.links:
            z = self._outline(body, i)
            self.axes.plot(z.real, z.imag, color="0.78", lw=0.9, zorder=1)
            for end in self._rail(body, i):
                self.axes.plot(end.real, end.imag, color="0.78", lw=0.9, zorder=1)

    def _pose(self, i: int) -> None:
        axes, m = self.axes, self.m
        colors = {body: COLORS[k % len(COLORS)] for k, body in enumerate(m.links)}
        for body, color in colors.items():
            z = self._outline(body, i)
            if len(z) > 2:
                axes.fill(z.real, z.imag, facecolor=color, alpha=0.15, zorder=3)
            axes.plot(z.real, z.imag, color=color, lw=2.4, zorder=4, solid_capstyle="round")
            rails = self._rail(body, i)
            for end in rails:
                axes.plot(end.real, end.imag, color=color, lw=2.4, zorder=4, solid_capstyle="round")
            # a link of one point alone is named beside it, another at its middle
            middle = z[:-1].mean() if len(z) > 2 else z.mean()
            if len(z) == 1 and rails:
                middle = rails[0].mean()
            self.labels.append(self._label(body, middle, color, 8.0))
        for body, center, radius in pitch_circles(m):
            around = np.exp(1j * np.linspace(0, 2 * np.pi, 121)) * radius * self.scale
            z = self._point(self.poses, body, center)[i] + around
            axes.plot(z.real, z.imag, color=colors.get(body, "black"), lw=1.1, ls=(0, (9, 2, 2, 2)), zorder=3)
        for number, guide in enumerate(m.guides):
            self._guide(number, guide, i)
        named = set(m.ground)
        for body in m.links:
            for p in m.links[body].points:
                z = self._point(self.poses, body, p)[i]
                axes.plot(z.real, z.imag, marker="o", ms=4.5, mfc="white", mec="black", zorder=7)
                if p not in named:
                    named.add(p)
                    self.labels.insert(0, self._label(p, z))

    def _line(self, number: int, i: int) -> tuple[complex, complex, Complexes, Reals]:
        """Return of a guide in a pose a point of its line, its direction, its two ends and how far these are."""
        m, guide = self.m, self.m.guides[number]
        slide = np.concatenate([p.slide_derivative(number, 0) for p in (self.poses, self.travel)])
        slide = slide[np.isfinite(slide)]
        room = 0.06 * m.size
        ends = np.array([slide.min() - room, slide.max() + room]) if len(slide) else np.array([-room, room])
        through, along = m.through(guide), complex(np.cos(guide.angle), np.sin(guide.angle))
        on = [
            self.poses.point_derivative(guide.on, through + s * along, 0)[i] * self.scale for s in (0.0, 1.0)
        ]
        return on[0], on[1] - on[0], on[0] + (on[1] - on[0]) * ends, ends

    def _rail(self, body: str, i: int) -> list[Complexes]:
        """Return what joins a moving body that carries a guide to where the guide's pin runs: lines, each its two ends."""
        found = []
        for number, guide in enumerate(self.m.guides):
            if guide.on != body:
                continue
            start, _, ends, _ = self._line(number, i)
            points = [self._point(self.poses, body, p)[i] for p in self.m.bodies[body]]
            near = min(points, key=lambda z: min(abs(z - e) for e in ends), default=start)
            found += [ends, np.array([near, min(ends, key=lambda e: abs(e - near))])]
        return found

    def _guide(self, number: int, guide: Guide, i: int) -> None:
        """Draw a guide as a slot as long as its pin travels along it, and a slider in it as a block."""
        axes = self.axes
        _, along, ends, _ = self._line(number, i)
        color = "0.35"
        axes.plot(ends.real, ends.imag, color="0.6", lw=7, alpha=0.3, zorder=2, solid_capstyle="round")
        axes.plot(ends.real, ends.imag, color=color, lw=1.0, ls=(0, (9, 2, 2, 2)), zorder=5)
        at = (
            self._point(self.poses, guide.link, guide.point)[i]
            if guide.point in self.m.bodies[guide.link]
            else None
        )
        if at is None:
            return
        if guide.is_slider:
            turn = float(np.degrees(np.angle(along)))
            axes.plot(at.real, at.imag, marker=(4, 0, turn + 45), ms=17, mfc="white", mec="black", zorder=6)
