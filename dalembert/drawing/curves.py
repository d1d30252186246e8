"""Curves over one variable: distinguished by dash and shade, named at their ends; equal ones are named once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.drawing.amounts import prefixed, quiet
from dalembert.drawing.sheet import empty, plain, zero_alone

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

Real = NDArray[np.float64]
COLORS = ("#000000", "#e69f00", "#0072b2", "#56b4e9", "#d55e00", "#cc79a7")
"""Dark and light by turns: neighbours differ in grey too (Okabe and Ito's colours)."""
DASHES: tuple[tuple[float, ...], ...] = (
    (),
    (6, 2),
    (1.3, 1.3),
    (6, 2, 1.3, 2),
    (3, 1.2),
    (8, 1.5, 1.3, 1.5, 1.3, 1.5),
)
LONGEST = 28
"""Most characters of the names of three and more equal curves."""
MOST = 41
"""Most characters of a name at the side of a picture."""
FEW = 40
"""Of so many values each has a dot: what lies between them was not computed."""
EQUAL = 1e-9
"""Curves that differ nowhere by more, of the largest value of all, are one."""


class Ends(NamedTuple):
    """The names at the ends of the curves of a panel, to be spread once the sheet is laid out."""

    axes: Axes
    names: list[Annotation]


class Curve(NamedTuple):
    """A curve and its name."""

    name: str
    values: ArrayLike
    level: bool = False
    """Whether it is one value everywhere, such as a mean: its places have no dots."""


def panel(axes: Axes, x: Real, curves: Sequence[Curve], what: str, unit: str, scale: float = 0.0) -> Ends:
    """Draw curves of one unit with their names at their ends, and return the names, to be spread by `spread`.

    Parameters
    ----------
    axes
        Where to draw.
    x
        The variable, (n,).
    curves
        Of (n,) values each; NaN where there is none.
    what
        What they are, for the axis; empty where the unit says it.
    unit
        Of the values; the axis takes the prefix that suits them.
    scale
        How large a quantity of this kind is here: what is less than 1e-12 of it is drawn as zero.
    """
    clean = [(curve.name, quiet(curve.values, scale)) for curve in curves]
    level = {curve.name for curve in curves if curve.level}
    sizes = [float(np.abs(v[np.isfinite(v)]).max(initial=0.0)) for _, v in clean]
    largest = max(sizes, default=0.0)
    factor, unit = prefixed(largest, unit)
    groups: list[tuple[list[str], Real]] = []
    for name, values in clean:
        like = next((names for names, other in groups if _equal(values, other, largest)), None)
        if like is None:
            groups.append(([name], values))
        else:
            like.append(name)
    ends = []
    for k, (names, values) in enumerate(groups):
        color, dash = COLORS[k % 6], DASHES[(k + k // 6) % 6]
        (line,) = axes.plot(x, values * factor, color=color, lw=1.5)
        if dash:
            line.set_dashes(dash)
        good = np.flatnonzero(np.isfinite(values))
        dots = good if len(x) <= FEW else good[_alone(good)]
        if len(dots) and not level.issuperset(names):
            line.set(marker="o", markersize=3.5, markevery=dots.tolist())
        text = shortened(_equal_ones([name for name in names if name]))
        if text and len(good):
            ends.append(_end(axes, text, x[good[-1]], values[good[-1]] * factor, color, dash))
    axes.set_ylabel(", ".join(filter(None, (what, unit))))
    plain(axes)
    low, high = axes.get_ylim()
    values = np.concatenate([v[np.isfinite(v)] for _, v in groups]) * factor if groups else np.zeros(0)
    if not len(values):
        axes.update_datalim([(place, 0.0) for place in x], updatey=False)
        axes.autoscale_view(scaley=False)
        empty(axes, "no values", "y")
    elif not values.any():
        zero_alone(axes)
    elif np.ptp(values) == 0:  # a constant in the middle, not on a scale of its rounding
        about = float(values[0])
        axes.set_ylim(about - abs(about), about + abs(about))
    else:
        axes.set_ylim(low, high)
    return Ends(axes, ends)


def _alone(places: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which of ascending whole numbers have no neighbour: no line leads to a value there.

    >>> _alone(np.array([0, 2, 3, 7])).tolist()
    [True, False, False, True]
    """
    gaps = np.concatenate([[True], np.diff(places) > 1, [True]])
    return np.asarray(gaps[:-1] & gaps[1:])


def shortened(name: str, most: int = MOST) -> str:
    """Return a name, its middle left out where it is longer than there is room for.

    >>> shortened("coupler.omega"), shortened("the coupler of machine 7.omega", 21)
    ('coupler.omega', 'the couple…ne 7.omega')
    """
    half = (most - 1) // 2
    return name if len(name) <= most else f"{name[:half]}…{name[-half:]}"


def _equal_ones(names: Sequence[str]) -> str:
    """Return the label of equal curves, with as many names as have room.

    >>> _equal_ones(["A", "B"]), _equal_ones(["O (pin on arm 1)", "O (pin on arm 2)", "C", "D"])
    ('A = B', 'O (pin on arm 1) = 3 others')
    """
    text = " = ".join(names)
    return text if len(names) < 3 or len(text) <= LONGEST else f"{names[0]} = {len(names) - 1} others"


def _equal(a: Real, b: Real, largest: float) -> bool:
    here, there = np.isfinite(a), np.isfinite(b)
    return bool((here == there).all() and (np.abs(a[here] - b[here]) <= EQUAL * largest).all())


def _end(axes: Axes, text: str, x: float, y: float, color: str, dash: tuple[float, ...]) -> Annotation:
    from matplotlib.transforms import blended_transform_factory

    return axes.annotate(
        text,
        (x, y),
        xytext=(1.04, y),
        textcoords=blended_transform_factory(axes.transAxes, axes.transData),
        va="center",
        fontsize=8,
        annotation_clip=False,
        arrowprops={
            "arrowstyle": "-",
            "color": color,
            "lw": 1.2,
            "ls": (0, dash) if dash else "-",
            "shrinkA": 1,
            "shrinkB": 0,
            "relpos": (0, 0.5),
        },
    )


def spread(panels: Sequence[Ends]) -> None:
    """Move the names at the ends of each panel's curves apart, in their order, as little as may be."""
    from matplotlib.text import Text

    for axes, names in panels:
        root = axes.get_figure(root=True)
        if root is None or not names:
            continue
        root.draw_without_rendering()
        # of the words alone: an annotation's own extent has its line too
        pitch = 1.08 * max(Text.get_window_extent(name).height for name in names)
        wanted = np.array([axes.transData.transform((0, name.xyann[1]))[1] for name in names])
        order = np.argsort(wanted, kind="stable")
        heights = _apart(wanted[order], pitch, axes.bbox.y0 + pitch / 2, axes.bbox.y1 - pitch / 2)
        for k, y in zip(order, heights, strict=True):
            names[k].xyann = (1.04, float(axes.transData.inverted().transform((0, y))[1]))


def _apart(wanted: Real, pitch: float, low: float, high: float) -> Real:
    """Return ascending places a pitch apart, within bounds if there is room, as near to the wanted ones as may be.

    >>> _apart(np.array([0.0, 5.0, 5.0]), 2.0, 0.0, 10.0).tolist()
    [0.0, 4.0, 6.0]
    """
    # places that touch move together, about their common middle (pool adjacent violators)
    runs: list[tuple[float, int]] = []
    for y in wanted.tolist():
        middle, count = y, 1
        while runs and middle - runs[-1][0] < pitch * (count + runs[-1][1]) / 2:
            other, more = runs.pop()
            middle, count = (middle * count + other * more) / (count + more), count + more
        runs.append((middle, count))
    places = np.concatenate([m + pitch * (np.arange(n) - (n - 1) / 2) for m, n in runs])
    steps = pitch * np.arange(len(places))
    places = np.maximum(places, low + steps)
    return np.asarray(np.minimum(places, high - steps[::-1]))
