"""A body in two views to scale: its parts as their shapes, principal axes, vectors; of a shaft the bearing forces below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dalembert.drawing.amounts import dimensioned, prefixed, quiet
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import Look, head
from dalembert.drawing.sheet import plain, sheet, zero_alone
from rigidbody3d.solids import Piece, Solid, Whole, outline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

Array = NDArray[np.float64]
NAMED = 16
"""The largest number of parts with their names in the picture."""
VIEWS = ((0, 2), (1, 2), (0, 1))
"""The axes of a view, to the right and up; of views that show as much the first are taken."""
ALONG_SHAFT = ((2, 0), (2, 1))
LOOKS = (Look("tab:red", 2.2), Look("tab:blue", 2.0, "--"), Look("black", 1.8, ":"))


def body(
    solids: Sequence[Solid],
    names: Sequence[str],
    whole: Whole,
    vectors: Mapping[str, Array] | None = None,
    figure: FigureBase | None = None,
) -> NDArray[np.object_]:
    """Draw a body in the two views that show most of it.

    Parameters
    ----------
    solids, names
        Its parts, and their names; without names none is written.
    whole
        Centre of mass and principal axes.
    vectors
        By name, (3,) each: drawn by their direction alone.
    figure
        See `dalembert.drawing.sheet`.

    Returns
    -------
    array of axes
        The two views.
    """
    figure = sheet(11, 5.6, figure)
    pieces = [outline(solid) for solid in solids]
    every = np.concatenate([piece.points for of in pieces for piece in of])
    shown = sorted(VIEWS, key=lambda view: -round(_area(every[:, view]), 12))[:2]
    shown = [view for view in VIEWS if view in shown]
    views = figure.subplots(1, 2)
    drawn = [
        _view(axes, view, solids, pieces, names, whole, vectors or {})
        for axes, view in zip(views, shown, strict=True)
    ]
    _legend(figure, solids, vectors or {})
    place(drawn)
    grid: NDArray[np.object_] = views
    return grid


def shaft(
    solids: Sequence[Solid],
    names: Sequence[str],
    whole: Whole,
    bearings: Array,
    forces: Mapping[str, Array],
    vectors: Mapping[str, Array] | None = None,
    figure: FigureBase | None = None,
    letters: str = "xyz",
) -> NDArray[np.object_]:
    """Draw a shaft along z seen from two sides, and below each view the bearing forces in its plane.

    Parameters
    ----------
    solids, names, whole, vectors, figure
        As for `body`.
    bearings
        Their places along z, (2,), m.
    forces
        By name, (2, 2): of each bearing on the shaft, x and y, N.
    letters
        What the axes x, y, z are called.

    Returns
    -------
    array (2, 2) of axes
        The views, and below them the forces.
    """
    figure = sheet(11.5, 7.4, figure)
    grid: NDArray[np.object_] = figure.subplots(2, 2, sharex="col", height_ratios=(1.5, 1))
    pieces = [outline(solid) for solid in solids]
    largest = max((float(np.abs(f[np.isfinite(f)]).max(initial=0.0)) for f in forces.values()), default=0.0)
    factor, unit = prefixed(largest, "N")
    drawn = []
    for component, (view, below) in enumerate(grid.T):
        drawn.append(
            _view(
                view, ALONG_SHAFT[component], solids, pieces, names, whole, vectors or {}, bearings, letters
            )
        )
        at = bearings * _length(whole, pieces)[0]
        wide = 0.03 * abs(at[1] - at[0])
        for k, (name, force) in enumerate(forces.items()):
            value = quiet(force[:, component], largest) * factor
            shift = (k - (len(forces) - 1) / 2) * wide
            below.bar(at + shift, value, width=wide, label=name, **_BARS.get(name, _FURTHER))
        below.axhline(0, color="0.4", lw=0.8)
        plain(below)
        below.margins(y=0.15)
        if not largest or not any(quiet(f[:, component], largest).any() for f in forces.values()):
            zero_alone(below)
        below.set_ylabel(f"bearing force on the shaft\nalong {letters[component]}, {unit}")
        below.set_xlabel(view.get_xlabel())
        view.set_xlabel("")
    _legend(figure, solids, vectors or {}, grid[1, 0].get_legend_handles_labels()[0])
    place(drawn)
    return grid


_BARS = {
    "static": {"color": "0.7", "edgecolor": "black", "lw": 0.6},
    "dynamic": {"color": "tab:red", "edgecolor": "black", "lw": 0.6},
}
_FURTHER = {"color": "white", "edgecolor": "tab:blue", "hatch": "////", "lw": 1.0}


def _area(points: Array) -> float:
    ring = _hull(points)
    if len(ring) < 3:
        return 0.0
    x, y = ring.T
    return float(abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2)


def _hull(points: Array) -> Array:
    """Return the corners of the convex hull of points (n, 2) in order; of points in one line its two ends."""
    from scipy.spatial import ConvexHull

    middle = points - points.mean(axis=0)
    _, size, ways = np.linalg.svd(middle, full_matrices=False)
    if len(points) < 3 or size[1] <= 1e-9 * size[0]:
        along = middle @ ways[0]
        return points[[int(along.argmin()), int(along.argmax())]]
    return np.asarray(points[ConvexHull(points).vertices])


def _length(whole: Whole, pieces: Sequence[Sequence[Piece]]) -> tuple[float, str]:
    """Return by what metres are multiplied, and the unit."""
    every = np.concatenate([piece.points for of in pieces for piece in of])
    return dimensioned(float(max(np.ptp(every, axis=0).max(), 2 * whole.gyration.max())))


def _view(
    axes: Axes,
    view: tuple[int, int],
    solids: Sequence[Solid],
    pieces: Sequence[Sequence[Piece]],
    names: Sequence[str],
    whole: Whole,
    vectors: Mapping[str, Array],
    bearings: Array | None = None,
    letters: str = "xyz",
) -> tuple[Axes, list[Label]]:
    factor, unit = _length(whole, pieces)
    center = whole.center[list(view)] * factor
    toward = np.cross(np.eye(3)[view[0]], np.eye(3)[view[1]])
    # what is nearer to the eye is drawn later
    order = sorted(range(len(solids)), key=lambda i: float(toward @ solids[i].center))
    for rank, i in enumerate(order):
        for piece in pieces[i]:
            _piece(axes, piece, view, factor, rank, solids[i])
    every = np.concatenate([piece.points[:, view] for of in pieces for piece in of]) * factor
    reach = float(max(np.abs(every - center).max(), (whole.gyration * factor).max()))
    for length, direction in zip(whole.gyration * factor, whole.axes, strict=True):
        line = center + np.array([[-1], [1]]) * 1.15 * length * direction[list(view)]
        axes.plot(*line.T, color="0.35", lw=0.9, ls="-.", zorder=60)
    for look, vector in zip(LOOKS, vectors.values(), strict=False):
        size = float(np.linalg.norm(vector))
        if size > 0:
            _vector(axes, center, vector[list(view)] / size * reach, look, reach)
    axes.plot(*center, marker="+", color="black", ms=11, mew=1.6, zorder=70)
    labels = []
    if len(solids) <= NAMED:
        labels = [
            Label(name, tuple(solid.center[list(view)] * factor), size=8.0)
            for name, solid in zip(names, solids, strict=False)
        ]
    if bearings is not None:
        axes.plot(bearings * factor, [0, 0], "^", color="black", ms=9, zorder=65)
        axes.plot(bearings * factor, [0, 0], color="0.5", lw=1.0, zorder=0)
    _frame(axes, bearings is not None)
    axes.set_xlabel(f"{letters[view[0]]}, {unit}")
    axes.set_ylabel(f"{letters[view[1]]}, {unit}")
    plain(axes)
    return axes, labels


def _frame(axes: Axes, shared: bool) -> None:
    """Show all that is drawn, to one scale; a shared horizontal axis is made long enough for the height."""
    every = np.concatenate([line.get_xydata() for line in axes.lines])
    low, high = every.min(axis=0), every.max(axis=0)
    axes.margins(0.06)
    if shared:
        wide = max(1.12 * (high - low)[0], 1.9 * (high - low)[1])
        axes.set_xlim(*((low + high)[0] / 2 + np.array([-0.5, 0.5]) * wide))
    axes.set_aspect("equal", adjustable="datalim")


def _piece(axes: Axes, piece: Piece, view: tuple[int, int], factor: float, rank: int, solid: Solid) -> None:
    kind, points = piece.kind, piece.points[:, view] * factor
    hole, level = solid.mass < 0, 2 + 0.5 * rank
    edge: dict[str, Any] = {"color": "0.25", "lw": 0.9, "ls": "--" if hole else "-", "zorder": level + 0.2}
    if kind == "triangles":
        from matplotlib.collections import PolyCollection

        corners = list(points.reshape(-1, 3, 2))
        fill = PolyCollection(
            corners, facecolor="white" if hole else "0.75", edgecolor="0.6", lw=0.2, zorder=level
        )
        axes.add_collection(fill)
    elif kind == "point":
        axes.plot(*points.T, "o", ms=7, mfc="white" if hole else "0.6", mec="0.25", zorder=level)
    elif kind == "line":
        axes.plot(*points.T, **{**edge, "lw": 2.2 if solid.shape in ("rod", "arc", "ring") else 0.6})
    else:
        ring = _hull(points)
        if len(ring) > 2:
            filled = "white" if hole or kind == "hole" else "0.75"
            axes.fill(*ring.T, facecolor=filled, alpha=0.55, zorder=level)
        if kind == "hole":
            edge["ls"] = ":"
        thin = 2.2 if len(ring) < 3 else 0.9
        axes.plot(*np.append(ring, ring[:1], axis=0).T, **{**edge, "lw": thin})


def _vector(axes: Axes, start: Array, span: Array, look: Look, reach: float) -> None:
    """Draw a vector's projection; one that points to the eye or away is a dot."""
    if float(np.hypot(*span)) < 0.03 * reach:
        axes.plot(*start, "o", color=look.color, ms=5 + look.width, mfc="none", mew=look.width, zorder=68)
        return
    axes.plot(
        *np.stack([start, start + 0.97 * span], axis=-1),
        color=look.color,
        lw=look.width,
        ls=look.dash,
        zorder=67,
    )
    neck = tuple(start + 0.97 * span)
    axes.annotate("", tuple(start + span), neck, arrowprops=head(look.color), zorder=67).set_in_layout(False)


def _legend(
    figure: FigureBase, solids: Sequence[Solid], vectors: Mapping[str, Array], more: Sequence[object] = ()
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[object] = [Patch(facecolor="0.75", edgecolor="0.25", label="parts, to scale")]
    if any(solid.mass < 0 for solid in solids):
        handles.append(Patch(facecolor="white", edgecolor="0.25", ls="--", label="taken away"))
    handles += [
        Line2D([], [], ls="", marker="+", color="black", ms=9, label="centre of mass"),
        Line2D([], [], color="0.35", ls="-.", lw=1, label="principal axes (radii of gyration)"),
    ]
    for look, (name, vector) in zip(LOOKS, vectors.items(), strict=False):
        if np.any(vector):
            handles.append(
                Line2D([], [], color=look.color, ls=look.dash, lw=look.width, label=f"{name} (direction)")
            )
    if more:
        handles += [Line2D([], [], ls="", marker="^", color="black", label="bearings"), *more]
    figure.legend(handles=handles, fontsize=8, loc="outside lower center", ncols=4, frameon=False)
