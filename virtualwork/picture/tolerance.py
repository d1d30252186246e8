"""The picture of tolerances: bands of the worst case across the paths of points, and the shares of the dimensions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.drawing.amounts import NOISE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from virtualwork.describe.dimensions import Dimension
    from virtualwork.formulas.kinematics import Point
    from virtualwork.formulas.quantity import Quantity

    Reals = NDArray[np.float64]
    Complex = NDArray[np.complex128]

# of the picture's width: a band that is narrower is drawn wider
SEEN = 0.02
BARS = 10


class Band(NamedTuple):
    """A number over the input, with its worst case."""

    key: Quantity
    header: str
    input_header: str
    q: Reals
    values: Reals
    worst: Reals


def draw(
    name: str,
    size: float,
    paths: Mapping[Point, Complex],
    limits: Mapping[Dimension, float],
    slopes: Mapping[Quantity, Sequence[Any]],
    band: Band | None = None,
) -> Figure:
    """Draw the band of the path of each point, and the shares of the dimensions; without points, a band over the input.

    Parameters
    ----------
    name : str
    size : float
        Of the mechanism, m.
    paths : mapping of Point to array (n,)
        The points that are drawn, x + iy in m; none where `band` is.
    limits : mapping of Dimension to float
        The limit of each dimension, SI.
    slopes : mapping of Quantity to sequence of array (n,)
        The derivative of each quantity to each dimension, in the order of `limits`.
    band : Band, optional
        A number over the input.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    if paths:
        _paths(left, size, paths, limits, slopes)
        _shares(right, limits, slopes, list(paths), "variance of the position")
    elif band is not None:
        _over_input(left, band)
        _shares(right, limits, slopes, [band.key], f"variance of {band.header}")
    figure.suptitle(name, fontsize=10)
    return figure


def _paths(
    axes: Axes,
    size: float,
    points: Mapping[Point, Complex],
    limits: Mapping[Dimension, float],
    slopes_of: Mapping[Quantity, Sequence[Any]],
) -> None:
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    scale, unit = (1e3, "mm") if size < 2 else (1.0, "m")
    sizes = np.array(list(limits.values()))
    paths = {key: z * scale for key, z in points.items()}
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    if len(next(iter(paths.values()))) == 1:
        worst = {}
        for key in points:
            slopes = np.array(slopes_of[key]) * scale
            worst[key] = [sizes @ np.abs(part) for part in (slopes.real, slopes.imag)]
        enlarged, much = _enlarged(np.nan_to_num(list(worst.values())).max(), size * scale)
        for key, z in paths.items():
            x, y = (enlarged * part for part in worst[key])
            axes.errorbar(z.real, z.imag, y, x, fmt="o", ms=3, capsize=4, label=key.node)
        axes.set_title(f"points with their worst case in x and y{much}", fontsize=9)
        axes.legend(fontsize=8)
        return
    parts = [z[np.isfinite(z)] for z in paths.values()]
    width = max((abs(z - z.mean()).max() for z in parts if len(z)), default=1.0) or 1.0
    bands = {}
    for key, z in paths.items():
        slopes = np.array(slopes_of[key]) * scale
        normal = 1j * _directions(z)
        bands[key] = normal, (np.abs((slopes * normal.conj()).real) * sizes[:, None]).sum(axis=0)
    widest = max((np.nanmax(band, initial=0.0) for _, band in bands.values()), default=0.0)
    enlarged, much = _enlarged(widest, width)
    for i, (key, z) in enumerate(paths.items()):
        normal, band = bands[key]
        good = np.isfinite(z) & np.isfinite(band)
        outer, inner = ((z + side * enlarged * band * normal)[good] for side in (1, -1))
        corners = np.stack([outer[:-1], outer[1:], inner[1:], inner[:-1]], axis=1)
        light = [1 - 0.3 * (1 - part) for part in to_rgb(f"C{i}")]
        quads = PolyCollection(
            list(np.stack([corners.real, corners.imag], axis=-1)), facecolor=light, edgecolor=light
        )
        axes.add_collection(quads)
        axes.plot(z.real, z.imag, color=f"C{i}", lw=1.2, label=key.node)
    axes.set_title(f"paths with their worst case across{much}", fontsize=9)
    axes.legend(fontsize=8)


def _enlarged(widest: float, width: float) -> tuple[float, str]:
    """Return how many times as wide a worst case is drawn to be seen in a picture so wide, and what its title says of it."""
    # a path across which nothing moves has a band of rounding
    if not NOISE * width < widest < SEEN * width:
        return 1.0, ""
    times = 10.0 ** np.ceil(np.log10(SEEN * width / widest))
    return times, f", drawn {times:g} times as wide"


def _directions(path: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the direction of a path at each pose; where it turns back, or has no pose, that of the poses before."""
    along = np.gradient(path)
    size = np.nan_to_num(np.abs(along))
    clear = size > NOISE * size.max(initial=0.0)
    if not clear.any():
        return np.ones(len(path), complex)
    before = np.maximum.accumulate(np.where(clear, np.arange(len(path)), np.argmax(clear)))
    return np.asarray(along[before] / size[before])


def _over_input(axes: Axes, band: Band) -> None:
    """Draw a number over the input, with its worst case."""
    q, values, worst = band.q, band.values, band.worst
    if len(q) == 1:
        axes.errorbar(q, values, worst, fmt="o", ms=3, capsize=4)
    axes.fill_between(q, values - worst, values + worst, color="C0", alpha=0.3, lw=0)
    axes.plot(q, values, color="C0", lw=1.2)
    axes.set_xlabel(band.input_header)
    axes.set_ylabel(band.header)
    axes.set_title("with its worst case", fontsize=9)
    axes.grid(color="0.9", lw=0.6)


def _shares(
    axes: Axes,
    limits: Mapping[Dimension, float],
    slopes_of: Mapping[Quantity, Sequence[Any]],
    keys: Sequence[Quantity],
    of: str,
) -> None:
    """Draw bars of the shares, means over the poses."""
    variances = np.zeros(len(limits))
    for key in keys:
        slopes = np.abs(np.array(slopes_of[key])) * np.array(list(limits.values()))[:, None]
        variances += np.nansum(slopes**2, axis=1)
    shares = variances / variances.sum() if variances.sum() > 0 else variances
    order = np.argsort(shares, kind="stable")[-BARS:]
    names = [list(limits)[i].path for i in order]
    bars = axes.barh(range(len(order)), shares[order] * 100, color="0.45")
    axes.bar_label(bars, [f"{shares[i] * 100:.3g} %" for i in order], padding=3, fontsize=8)
    axes.set_yticks(range(len(order)), names, fontsize=8)
    axes.set_xlim(0, 118)
    axes.set_xticks(range(0, 101, 20))
    axes.set_xlabel(f"share of the {of}, %")
    axes.set_title("shares of the dimensions", fontsize=9)
