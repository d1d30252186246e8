"""Labels next to what they name: clear of each other, of other words and, as far as possible, of lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

Real = NDArray[np.float64]
CELL = 2.0
"""The size of the cells in which the picture is searched, in pixels."""
DISTANCES = (4.0, 8.0, 13.0, 20.0, 29.0, 40.0, 55.0, 75.0, 100.0)
"""The distances of a label from its point, points; from the fourth on a thin line leads to it."""
TURNS = np.arange(0, 360, 15.0)


class Label(NamedTuple):
    """A name and what it belongs to, in the axes' own coordinates."""

    text: str
    at: tuple[float, float]
    color: str = "black"
    size: float = 9.0
    toward: float | None = None
    """Its preferred direction from the point, degrees on the sheet."""


class _Taken:
    """Which cells of the sheet are taken: how much of lines, and whether by words."""

    def __init__(self, width: float, height: float) -> None:
        self.shape = int(height / CELL) + 2, int(width / CELL) + 2
        self.lines, self.words = np.zeros(self.shape), np.zeros(self.shape)

    def add_line(self, points: Real) -> None:
        """Take what a polyline (n, 2), pixels, runs over."""
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) > 1:
            long = np.hypot(*np.diff(points, axis=0).T)
            # a line to nowhere, or far outside, is not followed
            if long.sum() < 1e5:
                s = np.concatenate([[0.0], np.cumsum(long)])
                fine = np.arange(0.0, s[-1], CELL)
                points = np.stack([np.interp(fine, s, points[:, k]) for k in (0, 1)], axis=-1)
        column, row = np.floor(points / CELL).astype(int).T
        inside = (row >= 0) & (row < self.shape[0]) & (column >= 0) & (column < self.shape[1])
        self.lines[row[inside], column[inside]] = 1.0

    def add_markers(self, points: Real, radius: float) -> None:
        """Take the squares about points (n, 2), pixels."""
        for x, y in points[np.isfinite(points).all(axis=1)]:
            self._take(self.lines, np.array([x - radius, y - radius, x + radius, y + radius]))

    def add_box(self, box: Real) -> None:
        """Take a box of words (left, bottom, right, top), pixels."""
        self._take(self.words, box)

    def _take(self, grid: Real, box: Real) -> None:
        left, bottom, right, top = np.floor(box / CELL).astype(int)
        grid[max(bottom, 0) : max(top + 1, 0), max(left, 0) : max(right + 1, 0)] = 1.0

    def under(self, boxes: Real) -> tuple[Real, Real]:
        """Return how many cells of lines and of words lie under each box (n, 4)."""
        left, bottom, right, top = np.floor(boxes / CELL).astype(int).T
        rows, columns = (
            np.clip(k, 0, n) for k, n in zip(((bottom, top + 1), (left, right + 1)), self.shape, strict=True)
        )
        covered = []
        for grid in (self.lines, self.words):
            sums = np.pad(grid.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
            covered.append(
                sums[rows[1], columns[1]]
                - sums[rows[0], columns[1]]
                - sums[rows[1], columns[0]]
                + sums[rows[0], columns[0]]
            )
        return covered[0], covered[1]


def place(wanted: Sequence[tuple[Axes, Sequence[Label]]]) -> list[Annotation]:
    """Write labels into axes of one figure, each as near to its point as there is room; return them.

    The figure is laid out first: everything else must have been drawn. What stands in the way is read off the figure:
    its words, the lines of the axes, the frames of the axes, the edge of the sheet.
    """
    if not wanted:
        return []
    root = wanted[0][0].get_figure(root=True)
    assert root is not None
    root.draw_without_rendering()
    width, height = root.bbox.width, root.bbox.height
    pixels = root.dpi / 72
    taken = _Taken(width, height)
    for box in _words(root):
        taken.add_box(box)
    for axes in root.axes:
        for line in axes.lines:
            if not line.get_visible():
                continue
            at = line.get_transform().transform(line.get_xydata())
            if line.get_linestyle() != "None":
                taken.add_line(at)
            if line.get_marker() not in ("", "None", None):
                taken.add_markers(at, line.get_markersize() / 2 * pixels)
    return [_write(axes, label, taken, pixels) for axes, labels in wanted for label in labels]


def _words(root: Figure) -> Iterable[Real]:
    from matplotlib.legend import Legend
    from matplotlib.text import Text

    for artist_ in root.findobj(lambda artist: isinstance(artist, Text | Legend)):
        if artist_.get_visible() and (not isinstance(artist_, Text) or artist_.get_text().strip()):
            # of the words alone: an annotation's own extent has its arrow too
            box = (
                Text.get_window_extent(artist_) if isinstance(artist_, Text) else artist_.get_window_extent()
            )
            yield np.array(list(box.extents))


def _write(axes: Axes, label: Label, taken: _Taken, pixels: float) -> Annotation:
    words = axes.annotate(
        label.text,
        label.at,
        xytext=(0, 0),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=label.size,
        color=label.color,
        zorder=9,
        annotation_clip=False,
    )
    words.set_in_layout(False)
    extent = words.get_window_extent()
    half = np.array([extent.width, extent.height]) / 2
    point = axes.transData.transform(label.at)
    turns = np.radians(TURNS)
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    # the nearest edge of the box stands at the distance
    reach = np.minimum(
        half[0] / np.maximum(np.abs(ways[:, 0]), 1e-9), half[1] / np.maximum(np.abs(ways[:, 1]), 1e-9)
    )
    distance = np.repeat(DISTANCES, len(turns))
    offsets = (distance * pixels + np.tile(reach, len(DISTANCES)))[:, None] * np.tile(
        ways, (len(DISTANCES), 1)
    )
    centers = point + offsets
    boxes = np.concatenate([centers - half, centers + half], axis=1)
    lines, words_under = taken.under(boxes + pixels * np.array([-1, -1, 1, 1]))
    frame = axes.bbox if axes.name == "rectilinear" else axes.get_figure(root=True).bbox  # type: ignore[union-attr]
    low, high = np.array([frame.x0, frame.y0]) + 2 * pixels, np.array([frame.x1, frame.y1]) - 2 * pixels
    outside = np.maximum(low - boxes[:, :2], 0).sum(axis=1) + np.maximum(boxes[:, 2:] - high, 0).sum(axis=1)
    off = 0.0
    if label.toward is not None:
        off = 1 - np.cos(np.tile(turns, len(DISTANCES)) - np.radians(label.toward))
    cost = 1e3 * words_under + 1e2 * outside + 2.0 * lines + 0.5 * distance + 3.0 * off
    best = int(np.argmin(cost))
    words.set_position(tuple(offsets[best] / pixels))
    taken.add_box(boxes[best])
    if distance[best] >= DISTANCES[3]:
        axes.annotate(
            "",
            label.at,
            xytext=tuple(offsets[best] / pixels),
            textcoords="offset points",
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": "0.5",
                "lw": 0.6,
                "shrinkB": 2,
                "patchB": None,
                "patchA": words,
            },
        ).set_in_layout(False)
    return words
