"""The closed polygons of balancing: unbalances head to tail, and the corrections that lead back to the start.

The graphical form of ΣU + ΣW = 0 and ΣU·z + ΣW·z = 0 (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 9, 12, 13).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.picture import NAMED, SENSE
from dalembert.drawing.amounts import prefixed
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import FOUND, SHARE, head
from dalembert.drawing.sheet import plain, sheet
from dalembert.units import written

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

Complex = NDArray[np.complex128]


class Polygon(NamedTuple):
    """Vectors in a unit: what is given, and the corrections that close the polygon."""

    title: str
    names: Sequence[str]
    given: Complex
    planes: Sequence[str]
    made: Complex
    unit: str


def closed(polygons: Sequence[Polygon], title: str = "", figure: FigureBase | None = None) -> None:
    """Draw polygons side by side, to scale; corrections in the colour that they have in the dials.

    Examples
    --------
    Two equal masses at right angles and the correction that closes the triangle:

    >>> import pytest; _ = pytest.importorskip("matplotlib")
    >>> from matplotlib.figure import Figure
    >>> figure = Figure()
    >>> closed([Polygon("forces", ["1", "2"], np.array([1, 1j]), ["A"], np.array([-1 - 1j]), "kg_m")], figure=figure)
    >>> len(figure.axes)
    1
    """
    figure = sheet(max(4.8 * len(polygons), 5.2), 4.8, figure)
    panels = figure.subplots(1, len(polygons), squeeze=False)[0]
    labels = []
    for axes, polygon in zip(panels, polygons, strict=True):
        vectors = np.concatenate([polygon.given, polygon.made])
        corners = np.concatenate([[0], np.cumsum(vectors)])
        factor, unit = prefixed(float(np.abs(vectors).max(initial=0.0)), written(polygon.unit))
        words = [*polygon.names, *polygon.planes]
        words = words if len(words) <= NAMED else [""] * len(polygon.given) + list(polygon.planes)
        corners, words_placed = corners * factor, []
        middle = corners.mean()
        for k, (start, end) in enumerate(pairwise(corners)):
            look = FOUND if k >= len(polygon.given) else SHARE
            if abs(end - start) > 1e-9 * np.abs(vectors * factor).max(initial=0.0):
                ends = {"xy": (end.real, end.imag), "xytext": (start.real, start.imag)}
                axes.annotate("", **ends, arrowprops=head(look.color, 1.6))
                half = (start + end) / 2
                side = float(np.degrees(np.angle(half - middle)))
                words_placed.append(Label(words[k], (half.real, half.imag), look.color, toward=side))
        axes.plot(corners.real, corners.imag, lw=0)
        axes.plot([0], [0], "o", ms=4, color="0.3")
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.15)
        plain(axes)
        axes.set_title(f"{title}{polygon.title}, {unit}", fontsize=10)
        labels.append((axes, words_placed))
    figure.supxlabel(f"the corrections close the polygon; {SENSE}", fontsize=9)
    place(labels)
