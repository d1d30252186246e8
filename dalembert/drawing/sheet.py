"""The sheet that a picture is drawn on, axes that print their numbers plainly, and the bytes of its file."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING

from dalembert.errors import needs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase


def sheet(width: float, height: float, figure: FigureBase | None = None) -> FigureBase:
    """Return the figure to draw into.

    Parameters
    ----------
    width, height
        What the picture needs, inches.
    figure
        A figure or subfigure of the caller's; an empty figure is made as large as the picture needs. None: a new
        figure of pyplot's, which a notebook shows and `pyplot.savefig` stores.

    Raises
    ------
    ImportError
        matplotlib is missing; the message names the extra that brings it.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ImportError(
            "a picture needs matplotlib: install dalembert with its extra, dalembert[plot]"
        ) from None
    if figure is None:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=(width, height))
    elif isinstance(figure, Figure) and not (figure.axes or figure.subfigs):
        figure.set_size_inches(width, height)
    if isinstance(figure, Figure) and figure.get_layout_engine() is None:
        figure.set_layout_engine("constrained")
    return figure


def plain(axes: Axes, which: str = "both") -> None:
    """Let axes print whole numbers, without a power of ten or an offset, on a faint grid."""
    from matplotlib.ticker import ScalarFormatter

    for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
        if which in (name, "both"):
            formatter = ScalarFormatter(useOffset=False)
            formatter.set_scientific(False)
            axis.set_major_formatter(formatter)
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)


def zero_alone(axes: Axes, which: str = "y") -> None:
    """Let axes of what is zero everywhere print this one number: a scale about it would be made up."""
    for name in which:
        getattr(axes, f"set_{name}lim")(-1, 1)
        getattr(axes, f"set_{name}ticks")([0])


def empty(axes: Axes, why: str, which: str = "xy") -> None:
    """Let axes that have nothing to show say why; they have no numbers: a scale would be made up."""
    for name in which:
        getattr(axes, f"set_{name}ticks")([])
    axes.text(0.5, 0.5, why, transform=axes.transAxes, ha="center", va="center", color="0.3", fontsize=9)


def blank() -> Figure:
    """Return an empty figure, which takes the size that its picture needs."""
    from matplotlib.figure import Figure

    return Figure()


def drawn(draw: Callable[[], Figure], suffix: str) -> bytes:
    """Return a picture as a file of this kind holds it."""
    try:
        import matplotlib
    except ImportError:
        raise needs("--plot", "matplotlib", "plot") from None
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "dalembert"  # the same picture is the same file
    matplotlib.rcParams["text.parse_math"] = False  # names are names, with $ too
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(suffix)
    draw().savefig(stream, format=suffix, dpi=150, metadata=metadata)
    return stream.getvalue()
