"""Readings at several positions of a rotor on its mandrel: the part of each; tables, picture and worked solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing import index_balancing
from balancing.indexing import Indexed
from balancing.runs.vectors import parted_cells
from dalembert.angles import degrees, phasor
from dalembert.decimals import Scaled
from dalembert.errors import DataError, quote
from dalembert.results.columns import Column, Table, apart, listed, names, number
from dalembert.results.way import Topic, figures, vector_text
from dalembert.tables.table import Table as ReadTable
from dalembert.tables.table import read
from dalembert.units import from_si, to_si, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False, repr=False)
class Positions:
    """The readings and their two parts: unbalances in kg·m, amplitudes in the unit of the file."""

    table: ReadTable
    quantity: Literal["unbalance", "amplitude"]
    unit: str
    turned: Real
    """Angles of the rotor on the mandrel, degrees."""
    readings: Complex
    parts: Indexed
    phase_lag: bool

    @cached_property
    def exact(self) -> Any:
        """The parts in 32 digits, with the decimals of the file exact."""
        from dalembert.tables.exact import column, vectors

        numbers = self.table.numbers
        size, angle = numbers[self.quantity], numbers["angle" if self.quantity == "unbalance" else "phase"]
        sizes = size.exact if self.quantity == "unbalance" else size.decimals
        read = vectors(sizes, angle)
        exact: Any = (
            read.conj() if self.phase_lag else read,
            column(numbers["turned"], range(len(self.turned))),
        )
        return index_balancing(*exact)

    def shown(self, value: Scaled) -> Scaled:
        """Return a value in the unit of the file."""
        return from_si(value, "unbalance", self.unit) if self.quantity == "unbalance" else value

    @property
    def unit_text(self) -> str:
        """The unit as people write it."""
        return written(self.unit)


def read_positions(path: str, phase_lag: bool) -> Positions:
    """Read turned_deg with unbalance_* and angle_*, or amplitude_* and phase_deg, and separate the parts.

    Raises
    ------
    DataError
        Columns that are missing or mixed, a negative size, several planes, fewer than two positions.
    """
    dimensions = {
        "turned": "angle",
        "unbalance": "unbalance",
        "angle": "angle",
        "amplitude": "amplitude",
        "phase": "angle",
    }
    texts = ["rotor", "plane", "sensor"]
    needed = [("turned",), ("unbalance", "amplitude"), ("angle", "phase")]
    table = read(path, numbers=dimensions, texts=texts, needed=needed, layout=parted_cells)
    turned = table.require("turned", "angle")
    if "unbalance" in table.numbers and "amplitude" in table.numbers:
        both = " and ".join(table.numbers[name].header for name in ("unbalance", "amplitude"))
        raise DataError(f"{table.file}: mixed columns {both}: expected unbalances or amplitudes, one of them")
    quantity: Literal["unbalance", "amplitude"] = "amplitude" if "amplitude" in table.numbers else "unbalance"
    if quantity not in table.numbers:
        raise DataError(
            f"{table.file}: no column unbalance_g_mm (or amplitude_um …): expected unbalance_* with angle_*, or "
            f"amplitude_* with phase_deg {table.hint}"
        )
    size, angle = (
        table.numbers[quantity],
        table.require("angle" if quantity == "unbalance" else "phase", "angle"),
    )
    table.reject(
        size.values < 0, quantity, f"a reading that is not negative: its {angle.header} says the direction"
    )
    for name in ("rotor", "plane", "sensor"):
        if len(several := table.numbered(name)[0]) > 1:
            raise DataError(
                f"{table.file}: column {name}: found {quote(several[0])} and {quote(several[1])}, expected the "
                f"readings of one {name}: a table for each"
            )
    sense = -1.0 if phase_lag else 1.0
    values = size.si if quantity == "unbalance" else size.values
    readings = phasor(values, sense * angle.values, angle.unit)
    try:
        parts = index_balancing(readings, to_si(turned.values, "angle", turned.unit))
    except ValueError as error:
        raise DataError(f"{table.file}: column {turned.header}: {error}") from None
    in_degrees = turned.values if turned.unit == "deg" else np.degrees(turned.si)
    return Positions(table, quantity, size.unit, in_degrees, readings, parts, phase_lag)


NEAR = 3.0
"""Positions with a larger growth of errors are close to each other."""

METHOD = (
    "Each reading is v = mandrel + rotor·e^{iφ}, φ the angle by which the rotor was turned on the mandrel; both parts by "
    "least squares over all positions (ISO 21940-14:2012, index balancing)."
)


def tables(p: Positions) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    return {
        "parts": lambda: parts(p),
        "readings": lambda: readings(p),
        "rotor": lambda: document_part(p, "rotor", p.parts.rotor),
        "mandrel": lambda: document_part(p, "mandrel", p.parts.mounting),
    }


def size(
    p: Positions, name: str, values: ArrayLike, place: str | None, exact: Callable[[], Doubled] | None = None
) -> Column:
    """A column of sizes in the unit of the file; JSON has unbalances in kg·m, amplitudes in the unit of the file."""
    result = np.asarray(values, dtype=float)
    if p.quantity == "unbalance":
        return number(name, "unbalance", result, p.unit, place=place, exact=exact)
    return Column(name, p.unit, result, None if exact is None else apart(result, "number", "", exact), place)


def direction(
    p: Positions, values: Complex, place: str | None, exact: Callable[[], Vectors] | None = None
) -> Column:
    """A column of directions: angles of unbalances, phases of vibrations."""
    name = "angle" if p.quantity == "unbalance" else "phase"
    error = None if exact is None else lambda: exact().turned(values)
    return number(name, "angle", degrees(values), error=error, place=place and place.format(name))


def parts(p: Positions) -> Table:
    """A row for the rotor, a row for the mandrel."""
    both = np.array([complex(p.parts.rotor), complex(p.parts.mounting)])

    def exact() -> Vectors:
        both: Any = np.stack([p.exact.rotor, p.exact.mounting])
        return both  # type: ignore[no-any-return]

    columns = [
        names("part", ["rotor", "mandrel"], None),
        size(p, p.quantity, np.abs(both), None, lambda: exact().size),
        direction(p, both, None, exact),
    ]
    if np.isfinite(p.parts.uncertainty):
        uncertainty = np.full(2, p.parts.uncertainty)
        columns.append(size(p, "uncertainty", uncertainty, None, lambda: p.exact.uncertainty))
    if p.quantity == "unbalance":
        opposite = float(degrees(-both[0]))
        amount = f"{p.shown(abs(both[0])):.6g} {p.unit_text}"
        below = (
            f"correction of the rotor: add {amount} at {opposite:.6g}°, in the rotor's position turned = 0"
        )
    else:
        below = "balance the rotor's part alone; the mandrel's is in every reading"
    return Table(columns, ("part",), None, below=below)


def readings(p: Positions) -> Table:
    """A row for each position: the reading and its residual."""
    residuals = p.parts.residuals
    shown = np.abs(residuals)
    columns = [
        number("turned", "angle", p.turned),
        size(p, p.quantity, np.abs(p.readings), p.quantity),
        direction(p, p.readings, "{}"),
        size(p, "residual", shown, "residual", lambda: p.exact.residuals.size),
        number(
            "residual_angle",
            "angle",
            np.where(shown > 0, degrees(residuals), np.nan),
            error=lambda: np.where(shown > 0, p.exact.residuals.turned(residuals), 0.0),
        ),
    ]
    below = ""
    if np.isfinite(p.parts.residual_sd):
        below = f"scatter of a reading: {p.shown(float(p.parts.residual_sd)):.3g} {p.unit_text} (one standard deviation)"
    return Table(columns, ("turned_deg",), "readings[]", below=below)


def document_part(p: Positions, place: str, part: Complex) -> Table:
    """A part for JSON."""
    one = np.array([complex(part)])
    columns = [
        size(p, p.quantity, np.abs(one), p.quantity),
        number("angle", "angle", degrees(one), place="angle"),
        size(p, "uncertainty", [float(p.parts.uncertainty)], "uncertainty"),
    ]
    if p.quantity == "amplitude":
        columns.insert(2, direction(p, one, "{}"))
    return Table([], place=place, documented=columns)


def warnings(p: Positions) -> list[str]:
    """Warn of positions that are close to each other."""
    growth = float(p.parts.amplification)
    if growth < NEAR:
        return []
    return [
        f"the positions of the rotor are close to each other: errors of the readings grow by a factor of {growth:.3g}; "
        "add a reading with the rotor turned by half a turn"
    ]


def way(p: Positions) -> list[Topic]:
    """The worked solution."""
    read = p.shown(p.readings)
    rotor, mandrel = complex(p.shown(p.parts.rotor)), complex(p.shown(p.parts.mounting))
    e = phasor(np.ones(len(p.turned)), p.turned, "deg")
    mean, turn = complex(read.mean()), complex(e.mean())
    spread = float((np.abs(e - turn) ** 2).sum())
    table = Table(
        [
            number("turned", "angle", p.turned),
            size(p, p.quantity, np.abs(p.readings), p.quantity),
            number("angle", "angle", degrees(p.readings)),
            size(p, "x", p.readings.real, "x"),
            size(p, "y", p.readings.imag, "y"),
        ],
        ("turned_deg",),
        "readings[]",
    )
    text: list[str | Table] = [
        "v = mandrel + rotor·e^{i·turned} (ISO 21940-14); ē and v̄ are the means over all positions, D = Σ|e − ē|²:",
        table,
        f"  v̄ = {vector_text(mean)}, ē = {vector_text(turn)}, D = {figures(spread)}",
    ]
    numbers = [
        f"rotor = Σ (e − ē)*·v/D = {vector_text(rotor)} {p.unit_text}: {figures(abs(rotor))} at {figures(degrees(rotor))}°",
        f"mandrel = v̄ − ē·rotor = {vector_text(mandrel)} {p.unit_text}: {figures(abs(mandrel))} at {figures(degrees(mandrel))}°",
    ]
    si = "_kg_m" if p.quantity == "unbalance" else ""
    both = {"rotor": complex(p.parts.rotor), "mandrel": complex(p.parts.mounting)}
    return [
        Topic("vectors", text, "Vectors of the readings"),
        Topic(
            "parts",
            numbers,
            "Rotor and mandrel",
            {f"{name}{si}": listed(part) for name, part in both.items()},
        ),
    ]


def draw(p: Positions) -> Figure:
    """Draw the readings, their residuals, and the two parts."""
    from balancing.picture import indexed
    from dalembert.drawing.sheet import blank

    figure = blank()
    indexed(
        p.shown(p.readings),
        p.shown(p.parts.residuals),
        complex(p.shown(p.parts.rotor)),
        complex(p.shown(p.parts.mounting)),
        p.quantity,
        p.unit_text,
        figure=figure,
    )
    return figure
