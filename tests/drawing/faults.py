"""What is wrong with a figure, as a reader would see it: words that collide or are cut off, numbers with an offset."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import Axes3D

TOUCH = 0.5
"""Boxes of words may overlap by so many pixels: a letter does not fill its box."""


def faults(figure: Figure) -> list[str]:
    """Return a sentence for each word that is cut off or lies on another, and for each offset beside an axis."""
    FigureCanvasAgg(figure)
    figure.set_dpi(150)  # as the command writes it
    figure.canvas.draw()
    boxes = [(text, Text.get_window_extent(text)) for text in _words(figure)]
    found = [
        f"{text.get_text()!r} is cut off"
        for text, box in boxes
        if box.x0 < -1 or box.y0 < -1 or box.x1 > figure.bbox.x1 + 1 or box.y1 > figure.bbox.y1 + 1
    ]
    found += [
        f"{a.get_text()!r} lies on {b.get_text()!r}"
        for (a, here), (b, there) in combinations(boxes, 2)
        if _overlap(here, there)
    ]
    offsets = [axis.get_offset_text().get_text() for axis in _axes(figure)]
    return found + [f"an offset of {offset!r} beside an axis" for offset in offsets if offset]


def _overlap(a: Bbox, b: Bbox) -> bool:
    return min(a.x1, b.x1) - max(a.x0, b.x0) > 2 * TOUCH and min(a.y1, b.y1) - max(a.y0, b.y0) > 2 * TOUCH


def _axes(figure: Figure) -> Iterator[Axis]:
    for axes in figure.axes:
        if axes.get_visible():
            yield axes.xaxis
            yield axes.yaxis
            if isinstance(axes, Axes3D):
                yield axes.zaxis


def _words(figure: Figure) -> list[Text]:
    """Return what is written: of an axis' numbers those within its limits, of axes in space only titles and names."""
    numbers = {id(text) for axis in _axes(figure) for text in axis.findobj(Text)}
    found = []
    for text in figure.findobj(Text):
        inside = text.axes is None or text.axes.get_visible()
        if id(text) not in numbers and text.get_visible() and text.get_text().strip() and inside:
            found.append(text)
    for axis in _axes(figure):
        found += [axis.label] if axis.label.get_text().strip() else []
        axes = axis.axes
        if isinstance(axes, Axes3D) or not isinstance(axes, Axes):
            continue
        low, high = sorted(axis.get_view_interval())
        room = 1e-9 * (high - low)
        for tick in axis.get_major_ticks():
            shown = low - room <= tick.get_loc() <= high + room
            found += [
                text
                for text in (tick.label1, tick.label2)
                if shown and text.get_visible() and text.get_text()
            ]
    return found
