"""A pose as a small picture in SVG, as a notebook and the sheet of an exercise show a mechanism."""

from __future__ import annotations

from collections.abc import Callable
from html import escape

import numpy as np
from numpy.typing import NDArray

from dalembert.drawing.beside import along, around, beside
from virtualwork.describe.parts import GROUND
from virtualwork.drawing import Circle, Drawing, Label, Line, standing
from virtualwork.formulas.poses import Poses

EDGE = 2.2
"""Sizes of a letter around the drawing."""
# as visible on white as on black
COLORS = ("#3b82f6", "#e0662a", "#2fa15a", "#a259e6", "#e0484f", "#1ba3b3", "#b98a16", "#dd4f93")
INK = "currentColor"
# role -> width of the stroke, and how it is filled: with its own colour so far, or with that of the paper
LOOK = {
    "link": (4.5, 0.16),
    "wheel": (1.6, 0.07),
    "belt": (2.2, 0.0),
    "rack": (1.8, 0.0),
    "cam": (2.2, 0.12),
    "roller": (1.6, 0.0),
    "block": (1.6, 0.3),
    "hatch": (0.7, 0.0),
    "mass": (0.9, 0.0),
    "tip": (1.0, 1.0),
}
Real = NDArray[np.float64]


def svg(
    poses: Poses,
    drawing: Drawing,
    *,
    most: tuple[float, float] = (520.0, 360.0),
    letters: float = 12.0,
) -> str | None:
    """Return the picture of the first pose, `most` pixels wide and high, its names in `letters` of so many; None where it cannot be assembled.

    Colours are those of a page in the dark as in the light: what is no link has the colour of the text around.

    >>> from virtualwork import Input, Link, Mechanism
    >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank", value=0.5))
    >>> motion = crank.motion()
    >>> str(svg(motion.poses, motion.drawing))[:4]
    '<svg'
    """
    order = list(poses.mechanism.bodies)

    def at(body: str, z: complex) -> complex:
        return complex(poses.point(body, z)[0])

    drawn = [(shape, standing(shape, at)) for shape in drawing.shapes]
    every = np.array([z for _, shape in drawn for z in shape.reach])
    if not np.isfinite(every).all():
        return None
    low = complex(every.real.min(), every.imag.min())
    wide, high = np.ptp(every.real), np.ptp(every.imag)
    edge = EDGE * letters
    scale = min((most[0] - 2 * edge) / (wide or 1e-300), (most[1] - 2 * edge) / (high or 1e-300))
    width, height = scale * wide + 2 * edge, scale * high + 2 * edge

    def xy(z: complex) -> tuple[float, float]:
        on = (z - low) * scale
        return round(on.real + edge, 2), round(height - on.imag - edge, 2)

    title = escape(poses.mechanism.name or "mechanism")
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.2f} {height:.2f}" '
        f'role="img" style="max-width:100%" font-family="sans-serif" font-size="{letters:g}"><title>{title}</title>'
    ]
    for shape, stood in drawn:
        color = (
            INK if shape.body == GROUND or shape.role in ("pin", "tip", "mass") else _color(order, shape.body)
        )
        stroke, filled = LOOK.get(shape.role, (1.3, 0.0))
        fill, filled = ("white", 1) if shape.role == "pin" else (color, filled if shape.body != GROUND else 0)
        closed = isinstance(stood, Circle) or stood.closed
        look = f'stroke="{color}" stroke-width="{stroke}" stroke-linejoin="round" stroke-linecap="round" '
        look += f'fill="{fill}" fill-opacity="{filled}"' if closed else 'fill="none"'
        if isinstance(stood, Circle):
            x, y = xy(stood.centre)
            parts.append(f'<circle cx="{x}" cy="{y}" r="{max(stood.radius * scale, 2.5):.2f}" {look}/>')
            continue
        points = " ".join(f"{x},{y}" for x, y in map(xy, stood.points))
        parts.append(f'<{"polygon" if closed else "polyline"} points="{points}" {look}/>')
    taken = np.concatenate([_marks(stood, xy) for _, stood in drawn])
    # names of links give way to those of points
    for label in sorted(drawing.labels, key=lambda label: label.of == "link"):
        at_label = xy(at(label.body, label.at))
        middle, own = beside(label.text, at_label, taken, (width, height), letters)
        taken = np.concatenate([taken, own])
        parts.append(_name(label, middle, _color(order, label.body), letters))
    return "".join([*parts, "</svg>"])


def _marks(shape: Circle | Line, xy: Callable[[complex], tuple[float, float]]) -> Real:
    """Where a shape is drawn: pixels (k, 2) along its lines, or around its circle and in the middle."""
    if isinstance(shape, Circle):
        middle, right = (np.array(xy(shape.centre + z)) for z in (0, shape.radius))
        return around(middle, float(right[0] - middle[0]))
    return along([xy(z) for z in (*shape.points, *shape.points[: shape.closed])])


def _color(order: list[str], body: str) -> str:
    return INK if body == GROUND else COLORS[(order.index(body) - 1) % len(COLORS)]


def _name(label: Label, middle: Real, color: str, letters: float) -> str:
    x, y = middle
    look = f'fill="{INK}"' if label.of == "point" else f'font-size="{letters - 1:g}" fill="{color}"'
    return f'<text x="{x}" y="{y}" text-anchor="middle" dominant-baseline="central" {look}>{escape(label.text)}</text>'
