"""A figure as the bytes of a file; what polar pictures share."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.errors import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes


def drawn(draw: Callable[[], Figure], suffix: str) -> bytes:
    """Return a picture as a file of this kind holds it."""
    try:
        import matplotlib
    except ImportError:
        raise DataError(
            "--plot needs matplotlib: install dalembert with its extra, dalembert[plot]"
        ) from None
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "dalembert"  # the same picture is the same file
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(suffix)
    draw().savefig(stream, format=suffix, dpi=150, metadata=metadata)
    return stream.getvalue()


def arrow(
    axes: PolarAxes, value: complex, scale: float, color: str, width: float, style: str, label: str
) -> None:
    if not abs(value) > 1e-9 * scale:
        return
    angle, size = float(np.angle(value)), abs(value)
    axes.annotate(
        "",
        xy=(angle, size),
        xytext=(0, 0),
        arrowprops={
            "arrowstyle": "-|>,head_width=0.25,head_length=0.5",
            "color": color,
            "lw": width,
            "ls": style,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    if label:
        axes.annotate(
            label,
            xy=(angle, size),
            xytext=(7 * np.cos(angle), 7 * np.sin(angle)),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
        )


def free_direction(vectors: Sequence[complex]) -> float:
    """Return the direction, in degrees, in the middle of the widest gap between vectors: room for the scale."""
    angles = np.sort(np.degrees(np.angle([v for v in vectors if v])) % 360)
    if not len(angles):
        return 22.5
    gaps = np.diff(np.append(angles, angles[0] + 360))
    widest = int(np.argmax(gaps))
    return float((angles[widest] + gaps[widest] / 2) % 360)
