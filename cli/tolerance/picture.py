"""The picture of tolerances: the band of a point's path, and which dimension has which share of its variance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cli.cases.analysis import Analysis
    from cli.cases.quantities import Quantity
    from dalembert.results.columns import Table
    from virtualwork.describe.dimensions import Dimension
    from virtualwork.family.tolerance import Spread
    from virtualwork.formulas.asked import Key

# of the picture's width: a band that is narrower is drawn wider
SEEN = 0.02
BARS = 10


class Tolerances(Protocol):
    """What the picture shows: the spread of each quantity, and its slopes to each dimension."""

    analysis: Analysis

    @property
    def limits(self) -> Mapping[Dimension, float]:
        """The limit of each dimension, SI."""

    @property
    def numbers(self) -> Sequence[Quantity]:
        """What is shown."""

    @property
    def slopes(self) -> Mapping[Key, Sequence[Any]]:
        """The slopes of each quantity to each dimension."""

    @property
    def linear(self) -> Mapping[str, Spread]:
        """To first order, by header."""

    def table(self) -> Table:
        """A row for each pose."""


def draw(found: Tolerances) -> Figure:
    """The band of the path of each point beside the shares; without points, bands over the input."""
    from matplotlib.figure import Figure

    points = [number.key for number in found.numbers if number.key[0] == "point" and number.key[4] == 0]
    points = list(dict.fromkeys(key for key in points if key[3] not in found.analysis.mechanism.ground))
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    if points:
        _paths(left, found, points)
        _shares(right, found, points, "variance of the position")
    else:
        header = found.numbers[0].header
        _over_input(left, found, header)
        _shares(right, found, [found.numbers[0].key], f"variance of {header}")
    figure.suptitle(found.analysis.mechanism.name, fontsize=10)
    return figure


def _paths(axes: Axes, found: Tolerances, points: list[Key]) -> None:
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    analysis = found.analysis
    scale, unit = (1e3, "mm") if analysis.mechanism.size < 2 else (1.0, "m")
    sizes = np.array(list(found.limits.values()))
    paths = {key: analysis.motions[0].point(key[3]).complex(0) * scale for key in points}
    width = max((np.nanmax(abs(z - np.nanmean(z)), initial=0.0) for z in paths.values()), default=1.0) or 1.0
    bands = {}
    for key, z in paths.items():
        slopes = np.array(found.slopes[key]) * scale
        along = np.gradient(z) if len(z) > 1 else np.ones(1, complex)
        with np.errstate(invalid="ignore", divide="ignore"):
            normal = 1j * along / np.abs(along)
        normal = np.where(np.isfinite(normal), normal, 1j)
        bands[key] = normal, (np.abs((slopes * normal.conj()).real) * sizes[:, None]).sum(axis=0)
    widest = max((np.nanmax(band, initial=0.0) for _, band in bands.values()), default=0.0)
    enlarged = 1.0
    if 0 < widest < SEEN * width:
        enlarged = 10.0 ** np.ceil(np.log10(SEEN * width / widest))
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
        axes.plot(z.real, z.imag, color=f"C{i}", lw=1.2, label=key[3])
    much = "" if enlarged == 1 else f", drawn {enlarged:g} times as wide"
    axes.set_title(f"paths, and their worst case across{much}", fontsize=9)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.legend(fontsize=8)


def _over_input(axes: Axes, found: Tolerances, header: str) -> None:
    """A number over the input, with its worst case."""
    base = next(c for c in found.table().columns if c.header == header)
    q = found.analysis.inputs.shown[:, 0]
    values = np.array([np.nan if v is None else float(v) for v in base.values])
    worst = found.linear[header].worst
    axes.fill_between(q, values - worst, values + worst, color="C0", alpha=0.3, lw=0)
    axes.plot(q, values, color="C0", lw=1.2)
    axes.set_xlabel(found.analysis.input_columns[0])
    axes.set_ylabel(header)
    axes.set_title("with its worst case", fontsize=9)
    axes.grid(color="0.9", lw=0.6)


def _shares(axes: Axes, found: Tolerances, keys: list[Key], of: str) -> None:
    """Bars of the shares, means over the poses."""
    variances = np.zeros(len(found.limits))
    for key in keys:
        slopes = np.abs(np.array(found.slopes[key])) * np.array(list(found.limits.values()))[:, None]
        variances += np.nansum(slopes**2, axis=1)
    shares = variances / variances.sum() if variances.sum() > 0 else variances
    order = np.argsort(shares, kind="stable")[-BARS:]
    names = [list(found.limits)[i].path for i in order]
    bars = axes.barh(range(len(order)), shares[order] * 100, color="0.45")
    axes.bar_label(bars, [f"{shares[i] * 100:.3g} %" for i in order], padding=3, fontsize=8)
    axes.set_yticks(range(len(order)), names, fontsize=8)
    axes.set_xlim(0, 118)
    axes.set_xticks(range(0, 101, 20))
    axes.set_xlabel(f"share of the {of}, %")
    axes.set_title("which dimension matters", fontsize=9)
