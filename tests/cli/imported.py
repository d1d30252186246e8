"""What the tests of `dalembert import` ask of a mechanism that was taken over."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cli.formats import read
from virtualwork import Mechanism
from virtualwork.exchange.description import described
from virtualwork.exchange.settled import settle

FORMATS = Path(__file__).parents[1] / "data" / "formats"


def taken(text: str | bytes, kind: str | None = None) -> tuple[list[Mechanism], list[str]]:
    """Import a text: the mechanisms, and everything that is said."""
    data = text.encode() if isinstance(text, str) else text
    found, notes = [], []
    for drawing in read("file", data, kind)[1]:
        parts = settle(drawing)
        notes += drawing.notes
        for part in parts:
            found.append(Mechanism.from_toml_text(described(part, "test")))
            notes += part.notes
    return found, notes


def only(text: str | bytes, kind: str | None = None) -> Mechanism:
    (m,) = taken(text, kind)[0]
    return m


def at(m: Mechanism, point: str, turned: float = 0.0) -> tuple[float, float]:
    """Where a point stands, m, its input moved on from the drawn pose."""
    inputs = [a + turned for a in m.at]
    x, y = m.motion(np.array([inputs]) if len(inputs) > 1 else inputs[0]).point(point).position[0]
    return float(x), float(y)


def moves(m: Mechanism, way: float) -> None:
    """It is assembled where it is drawn, and a little way to one side of it at least."""
    inputs = np.array([[a + k * way for a in m.at] for k in (-1, 0, 1)])
    ok = m.motion(inputs if len(m.at) > 1 else inputs[:, 0]).assembled
    assert ok[1]
    assert ok[0] or ok[2]


# --- PMKS text ----------------------------------------------------------------------------------------------
FOUR_BAR = (
    "ground input R 0 0 0 ffft|input coupler r 0 2 ffff|coupler rocker R 3 4|rocker gnd R 4 0|coupler R 1 5"
)
