"""A figure as the bytes of a file, and what a moving page shows."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cli.read import options
from cli.show.result import chosen_units, in_units
from dalembert.errors import needs
from dalembert.units import UNITS, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.page import Shown
    from dalembert.results.columns import Table


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


# what a scene is drawn from: of these alone the page must know the unit
DRAWN = ("length", "angle", "velocity", "acceleration", "speed", "force", "time")


def refuse_long(count: int) -> None:
    """Refuse --page of more poses than a page can hold."""
    from dalembert.page import fits

    try:
        fits(count)
    except ValueError as error:
        raise options.bad("--page", str(error)) from None


def shown(table: Table, units: str | None) -> dict[str, Shown]:
    """Return the columns of numbers under their SI headers, in the units that --units names."""
    # loaded where a page is written
    from dalembert.page import Shown

    chosen = {} if units is None else chosen_units(units)
    pairs = zip(table.columns, in_units(table, chosen).columns, strict=True)
    return {
        column.header: Shown(np.array(other.values, dtype=float), other.header, _si(other.unit))
        for column, other in pairs
        if column.unit or not any(isinstance(value, str) for value in column.values)
    }


def _si(unit: str) -> float:
    """Return what one of a unit is in SI; 1 where the page need not know."""
    return next((float(to_si(1.0, d, unit)) for d in DRAWN if unit in UNITS[d]), 1.0)
