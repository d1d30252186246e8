"""A pose as a small picture in SVG, as a notebook shows a mechanism."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from virtualwork.describe.parts import GROUND
from virtualwork.drawing import Circle, Drawing, Label, Line, standing
from virtualwork.formulas.poses import Poses

WIDTH, HEIGHT, EDGE = 520.0, 360.0, 26.0
"""Pixels at most, and around the drawing."""
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
AROUND = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1], [1, 0], [-1, 0], [0, -1], [0, 1]])
"""Sides on which a name may stand, y downwards; the first that is free is taken."""
Real = NDArray[np.float64]


def svg(poses: Poses, drawing: Drawing) -> str | None:
    """Return the picture of the first pose; None where it cannot be assembled.

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
    scale = min((WIDTH - 2 * EDGE) / (wide or 1e-300), (HEIGHT - 2 * EDGE) / (high or 1e-300))
    width, height = scale * wide + 2 * EDGE, scale * high + 2 * EDGE

    def xy(z: complex) -> tuple[float, float]:
        on = (z - low) * scale
        return round(on.real + EDGE, 2), round(height - on.imag - EDGE, 2)

    title = escape(poses.mechanism.name or "mechanism")
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.2f} {height:.2f}" '
        f'role="img" style="max-width:100%" font-family="sans-serif" font-size="12"><title>{title}</title>'
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
        x, y = xy(at(label.body, label.at))
        middle, own = _free(label.text, np.array([x, y]), taken, np.array([width, height]))
        taken = np.concatenate([taken, own])
        parts.append(_name(label, float(middle[0]), float(middle[1]), _color(order, label.body)))
    return "".join([*parts, "</svg>"])


def _marks(shape: Circle | Line, xy: Callable[[complex], tuple[float, float]]) -> Real:
    """Where a shape is drawn: pixels (k, 2) along its lines, or around its circle and in the middle."""
    if isinstance(shape, Circle):
        around = shape.radius * np.exp(1j * np.linspace(0, 2 * np.pi, 32))
        return np.array([xy(shape.centre + complex(z)) for z in (0, *around)])
    ends = np.array([xy(z) for z in (*shape.points, *shape.points[: shape.closed])])
    return np.concatenate([ends[:1], *(_along(a, b) for a, b in pairwise(ends))])


def _along(a: Real, b: Real) -> Real:
    """Pixels (k, 2) some 4 apart from a to b."""
    return a + np.linspace(0, 1, 2 + int(np.hypot(*(b - a)) / 4))[:, None] * (b - a)


def _free(text: str, at: Real, taken: Real, size: Real) -> tuple[Real, Real]:
    """Return the middle of a name beside its place, where least is drawn, and the pixels (k, 2) that the name takes."""
    half = np.array([3.3 * len(text), 7.0])
    # the edge of the name is as far from its place as these
    middles = np.concatenate([at + AROUND * (half + gap) for gap in (3.0, 9.0, 16.0)])
    hits = (np.abs(taken - middles[:, None]) < half + 2).all(axis=2).sum(axis=1)
    beyond = np.maximum(0, np.maximum(half - middles, middles + half - size)).sum(axis=1)
    middle = middles[np.argmin(hits + beyond)]
    corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return np.round(middle, 2), np.concatenate(
        [_along(middle - (half[0], 0), middle + (half[0], 0)), middle + corners]
    )


def _color(order: list[str], body: str) -> str:
    return INK if body == GROUND else COLORS[(order.index(body) - 1) % len(COLORS)]


def _name(label: Label, x: float, y: float, color: str) -> str:
    look = f'fill="{INK}"' if label.of == "point" else f'font-size="11" fill="{color}"'
    return f'<text x="{x}" y="{y}" text-anchor="middle" dominant-baseline="central" {look}>{escape(label.text)}</text>'
