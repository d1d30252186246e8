"""What the worked solutions of `dalembert balance` share: how equations show an unbalance, and the last step of each plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cli.balance.rotors import Balancing
from dalembert.angles import degrees, in_turn
from dalembert.results.columns import Table, names, number
from dalembert.results.way import Topic, figures
from dalembert.units import from_si


def quadrant(x: float, y: float) -> int | None:
    """Return the quadrant of a vector, an axis with the quadrant that it begins; None of nothing.

    >>> [quadrant(*v) for v in ((1, 0), (0, 1), (-1, 0), (0, -1), (-328.3, -1402.0))], quadrant(0, 0)
    ([1, 2, 3, 4, 3], None)
    """
    if x == 0 and y == 0:
        return None
    if y >= 0:
        return 1 if x > 0 and y >= 0 else 2 if y > 0 else 3
    return 4 if x >= 0 else 3


class Scale:
    """How the equations show an unbalance: as the document does, W·r in N·mm where the table has weights."""

    def __init__(self, b: Balancing) -> None:
        unit = b.rotors.unbalance_unit
        self.length = b.length_unit
        self.letter = "m"
        if b.rotors.weights:
            self.letter = "W"
            length = self.length if self.length in ("mm", "m", "in") else "mm"
            self.length, self.name = length, f"N·{length}"
            self.factor = b.request.gravity * float(from_si(1.0, "length", length))
        else:
            self.name, self.factor = unit.replace("_", "·"), float(from_si(1.0, "unbalance", unit))
        self.reach = float(from_si(1.0, "length", self.length))

    def of(self, value: float) -> str:
        return figures(value * self.factor)

    def moment(self, value: float) -> str:
        return figures(value * self.factor * self.reach)


def labels(b: Balancing, mine: Any) -> list[str]:
    """Return what the masses are called."""
    every = b.rotors.table.texts.get("name") or [str(k + 1) for k in range(b.rotors.table.rows)]
    return [every[k] for k in mine]


def plane_topic(
    b: Balancing, row: int, name: str, made: complex, text: Sequence[str], scale: Scale, heading: str = ""
) -> Topic:
    """The topic of a correction: its equations, its size, its mass and the quadrant of its angle."""
    radius = float(b.radius[row])
    mass = abs(made) / radius if radius else 0.0
    x, y = (value + 0.0 for value in (made.real, made.imag))
    q = quadrant(x, y)
    angle = float(degrees(np.array([made]))[0])
    amount = (
        f"W = {figures(mass * b.request.gravity)} N"
        if b.rotors.weights
        else f"m = {figures(float(from_si(mass, 'mass', b.rotors.mass_unit)))} {b.rotors.mass_unit}"
    )
    length = b.length_unit
    lines = [
        *text,
        f"  √(x² + y²) = {scale.of(abs(made))} {scale.name}; at r = {figures(float(from_si(radius, 'length', length)))} {length}: {amount}",
    ]
    if q is not None:
        signs = (
            f"x {'<' if x < 0 else '>' if x > 0 else '='} 0, y {'<' if y < 0 else '>' if y > 0 else '='} 0"
        )
        lines.append(f"  tan θ = y/x; {signs}: quadrant {q}, θ = {figures(angle)}°")
    if b.request.remove:
        lines.append(f"  to remove instead: on the other side, at {figures(in_turn(angle + 180.0))}°")
    unit = b.rotors.unbalance_unit
    table = Table(
        [],
        (),
        "",
        documented=[
            number("x", "unbalance", [x], unit),
            number("y", "unbalance", [y], unit),
            names("quadrant", [q]),
            number("unbalance", "unbalance", [abs(made)], unit),
            number("mass", "mass", [mass], b.rotors.mass_unit),
            number("angle", "angle", [angle]),
        ],
    )
    return Topic(f"plane {name}", [*lines, table], heading)
