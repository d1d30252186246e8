"""The picture of a fit: the target, what the fitted mechanism does there, and what it did before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.drawing.amounts import dimensioned
from dalembert.drawing.sheet import plain, sheet
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.positions import unwound

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

# from this number of rows on they are not numbered
NUMBERED = 24


class Fitted(NamedTuple):
    """One quantity: over the whole range, and at the rows of its target.

    Attributes
    ----------
    name : str
    kind : "point", "coordinate", "angle", "slide" or "effort"
    turning : bool
        Whether the input is an angle.
    q : array (k,)
        The range, rad or m.
    after, before : array (k,)
        x + iy in m, rad or m.
    inputs, target : array (n,)
    """

    name: str
    kind: str
    turning: bool
    q: Reals
    after: NDArray[Any]
    before: NDArray[Any]
    inputs: Reals
    target: NDArray[Any]


def fitted(quantities: Sequence[Fitted], figure: FigureBase | None = None) -> list[Axes]:
    """Draw a panel for each quantity of a fit.

    Parameters
    ----------
    quantities
        The request and its result.
    figure
        See `dalembert.drawing.sheet`.
    """
    count = len(quantities)
    paper = sheet(5.6 * count, 5.0, figure)
    result = []
    for i, each in enumerate(quantities):
        axes = paper.add_subplot(1, count, i + 1)
        if each.kind == "point":
            x, y, unit = _path(axes, each)
        else:
            x, y, unit = _function(axes, each)
        axes.plot(x, y, "+", color="black", ms=9, mew=1.3, label="target")
        if len(x) <= NUMBERED:
            for k, place in enumerate(zip(x, y, strict=True), 1):
                axes.annotate(str(k), place, (4, 4), textcoords="offset points", fontsize=7, color="0.35")
        axes.set_title(f"{each.name}, {unit}", fontsize=9)
        axes.legend(fontsize=8, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=3)
        plain(axes)
        result.append(axes)
    return result


def _path(axes: Axes, each: Fitted) -> tuple[Reals, Reals, str]:
    """The path of a point, to scale."""
    scale, unit = _lengths(np.abs(each.target - each.target.mean()))
    for z, style in ((each.before, {"color": "0.7", "lw": 1.0, "label": "before"}), (each.after, AFTER)):
        axes.plot(z.real * scale, z.imag * scale, **style)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    return each.target.real * scale, each.target.imag * scale, f"path in {unit}"


def _function(axes: Axes, each: Fitted) -> tuple[Reals, Reals, str]:
    """A coordinate, an angle, a travel or an effort over the input."""
    along, of = (np.degrees(each.inputs), "deg") if each.turning else (each.inputs, "m")
    q = np.degrees(each.q) if each.turning else each.q
    if each.kind == "angle":
        scale, unit = 180 / np.pi, "deg"
        # angles go on over the half turn, and a target stands at the curve's own turn
        after, before = (np.unwrap(values, period=2 * np.pi) for values in (each.after, each.before))
        near = np.interp(each.inputs, each.q, np.where(np.isfinite(after), after, 0.0))
        target = unwound(each.target, near)
        start = np.nanmean(after) - np.nanmean(before)
        if np.isfinite(start):
            before = before + 2 * np.pi * np.round(start / (2 * np.pi))
    else:
        after, before, target = each.after, each.before, each.target
        if each.kind == "effort":
            scale, unit = 1.0, "N·m" if each.turning else "N"
        else:
            scale, unit = _lengths(np.abs(target))
    axes.plot(q, before * scale, color="0.7", lw=1.0, label="before")
    axes.plot(q, after * scale, **AFTER)
    axes.set_xlabel(f"input, {of}")
    effort = "torque" if each.turning else "force"
    words = {"coordinate": each.name, "angle": "angle", "slide": "travel", "effort": effort}
    axes.set_ylabel(f"{words[each.kind]}, {unit}")
    return along, target * scale, f"{unit} over the input"


AFTER: dict[str, Any] = {"color": "#0072b2", "lw": 1.6, "label": "fitted"}


def _lengths(sizes: Reals) -> tuple[float, str]:
    return dimensioned(float(sizes.max(initial=0.0)), 2e-4)
