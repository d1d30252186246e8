"""Results of index balancing: the two parts, how well the readings agree; the picture, the worked solution."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from dalembert.angles import degrees
from dalembert.results.columns import Column, Table, apart, names, number
from dalembert.results.way import Topic, figures, vector_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from cli.index.readings import Complex, Positions
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_vectors import Vectors


NEAR = 3.0  # from this growth of errors on the positions are named as near each other

METHOD = (
    "Each reading is v = mandrel + rotor·e^{iφ}, φ the angle by which the rotor was turned on the mandrel; both parts by "
    "least squares over all positions (ISO 21940-14:2012, index balancing)."
)


def tables(p: Positions) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    return {
        "parts": lambda: parts(p),
        "readings": lambda: readings(p),
        "rotor": lambda: documented(p, "rotor", p.parts.rotor),
        "mandrel": lambda: documented(p, "mandrel", p.parts.mounting),
    }


def size(
    p: Positions, name: str, values: ArrayLike, place: str | None, exact: Callable[[], Doubled] | None = None
) -> Column:
    """Sizes in the unit of the file; JSON has unbalances in kg·m, amplitudes in the unit of the file."""
    result = np.asarray(values, dtype=float)
    if p.quantity == "unbalance":
        return number(name, "unbalance", result, p.unit, place=place, exact=exact)
    return Column(name, p.unit, result, None if exact is None else apart(result, "number", "", exact), place)


def direction(
    p: Positions, values: Complex, place: str | None, exact: Callable[[], Vectors] | None = None
) -> Column:
    """Directions: of an unbalance its angle, of a vibration its phase."""
    name = "angle" if p.quantity == "unbalance" else "phase"
    error = None if exact is None else lambda: exact().turned(values)
    return number(name, "angle", degrees(values), error=error, place=place and place.format(name))


def parts(p: Positions) -> Table:
    """A row for the rotor, a row for the mandrel."""
    both = np.array([complex(p.parts.rotor), complex(p.parts.mounting)])

    def exact() -> Vectors:
        return p.exact.parts

    columns = [
        names("part", ["rotor", "mandrel"], None),
        size(p, p.quantity, np.abs(both), None, lambda: exact().size),
        direction(p, both, None, exact),
    ]
    if np.isfinite(p.parts.uncertainty):
        doubt = np.full(2, p.parts.uncertainty)
        columns.append(size(p, "uncertainty", doubt, None, lambda: p.exact.uncertainty))
    if p.quantity == "unbalance":
        opposite = float(degrees(-both[0]))
        amount = f"{p.shown(abs(both[0])):.6g} {p.spoken_unit}"
        below = (
            f"correction of the rotor: add {amount} at {opposite:.6g}°, in the rotor's position turned = 0"
        )
    else:
        below = "the rotor's part alone is to be balanced; the mandrel's is in every reading"
    return Table(columns, ("part",), None, below=below)


def readings(p: Positions) -> Table:
    """A row for each position: the reading, and what the two parts do not explain of it."""
    left = p.parts.residuals
    # two readings are met exactly
    shown = np.where(np.abs(left) > p.noise, np.abs(left), 0.0)
    columns = [
        number("turned", "angle", p.turned),
        size(p, p.quantity, np.abs(p.readings), p.quantity),
        direction(p, p.readings, "{}"),
        size(p, "residual", shown, "residual", lambda: p.exact.residuals.size),
        number(
            "residual_angle",
            "angle",
            np.where(shown > 0, degrees(left), np.nan),
            error=lambda: np.where(shown > 0, p.exact.residuals.turned(left), 0.0),
        ),
    ]
    below = ""
    if np.isfinite(p.parts.residual_sd):
        below = f"scatter of a reading: {p.shown(float(p.parts.residual_sd)):.3g} {p.spoken_unit} (one standard deviation)"
    return Table(columns, ("turned_deg",), "readings[]", below=below)


def documented(p: Positions, place: str, part: Complex) -> Table:
    """A part as JSON has it."""
    one = np.array([complex(part)])
    columns = [
        size(p, p.quantity, np.abs(one), p.quantity),
        direction(p, one, "{}"),
        size(p, "uncertainty", [float(p.parts.uncertainty)], "uncertainty"),
    ]
    return Table([], place=place, documented=columns)


def warnings(p: Positions) -> list[str]:
    """What a reader of the parts has to know."""
    growth = float(p.parts.amplification)
    if growth < NEAR:
        return []
    return [
        f"the positions of the rotor are close to each other: errors of the readings grow by a factor of {growth:.3g}; "
        "add a reading with the rotor turned by half a turn"
    ]


def way(p: Positions) -> list[Topic]:
    """The topics."""
    read = p.shown(p.readings)
    rotor, mandrel = complex(p.shown(p.parts.rotor)), complex(p.shown(p.parts.mounting))
    e = np.exp(1j * np.radians(p.turned))
    mean, turn = complex(read.mean()), complex(e.mean())
    spread = float((np.abs(e - turn) ** 2).sum())
    unit = p.unit
    table = Table(
        [
            Column("turned", "deg", p.turned, place="turned_deg"),
            Column(p.quantity, unit, np.abs(read), place=p.quantity),
            Column("angle", "deg", degrees(read), place="angle_deg"),
            Column("x", unit, read.real, place="x"),
            Column("y", unit, read.imag, place="y"),
        ],
        ("turned_deg",),
        "readings[]",
    )
    text: list[str | Table] = [
        "v = mandrel + rotor·e^{i·turned} (ISO 21940-14); ē and v̄ are the means over all positions, D = Σ|e − ē|²:",
        table,
        f"  v̄ = {vector_text(mean.real, mean.imag)}, ē = {vector_text(turn.real, turn.imag)}, D = {figures(spread)}",
    ]
    numbers = [
        f"rotor = Σ (e − ē)*·v/D = {vector_text(rotor.real, rotor.imag)} {p.spoken_unit}: {figures(abs(rotor))} at {figures(float(degrees(np.array([rotor]))[0]))}°",
        f"mandrel = v̄ − ē·rotor = {vector_text(mandrel.real, mandrel.imag)} {p.spoken_unit}: {figures(abs(mandrel))} at {figures(float(degrees(np.array([mandrel]))[0]))}°",
    ]
    head = {"unit": unit, "rotor": [rotor.real, rotor.imag], "mandrel": [mandrel.real, mandrel.imag]}
    return [
        Topic("vectors", text, "Vectors of the readings", {"unit": unit}),
        Topic("parts", numbers, "Rotor and mandrel", head),
    ]


def draw(p: Positions) -> Figure:
    """Draw the readings, their residuals, and the two parts."""
    from balancing.picture import indexed
    from cli.show.picture import blank

    figure = blank()
    indexed(
        p.shown(p.readings),
        p.shown(p.parts.residuals),
        complex(p.shown(p.parts.rotor)),
        complex(p.shown(p.parts.mounting)),
        p.quantity,
        p.spoken_unit,
        figure=figure,
    )
    return figure
