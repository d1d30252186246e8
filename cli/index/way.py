"""The worked solution of `dalembert index`: the readings as vectors, their means, rotor and mandrel apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dalembert.angles import degrees
from dalembert.results.columns import Column, Table
from dalembert.results.way import Topic, figures, vector_text

if TYPE_CHECKING:
    from cli.index.readings import Positions


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
