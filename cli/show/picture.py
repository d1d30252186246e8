"""A figure as the bytes of a file."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING

from dalembert.errors import needs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(suffix)
    draw().savefig(stream, format=suffix, dpi=150, metadata=metadata)
    return stream.getvalue()
