"""A rotor's masses as SVG, for sheets: seen along its axis, and from the side where they have axial positions."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.drawing.beside import along, around, beside

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Reals = NDArray[np.float64]

WIDTH, LETTERS = 430.0, 15.0
"""Width of the figure, and the size of letters, pixels."""


def svg(
    names: Sequence[str],
    radius: ArrayLike,
    angle: ArrayLike,
    z: ArrayLike | None = None,
    plane_names: Sequence[str] = (),
    plane_z: ArrayLike = (),
) -> str:
    """Draw masses on their arms, the longest of which fills the picture.

    Parameters
    ----------
    names : sequence of str
        Of the masses.
    radius, angle : array (n,)
        m, rad.
    z : array (n,), optional
        Axial positions, m: then the rotor is drawn from the side too.
    plane_names : sequence of str
        Of the correction planes seen from the side.
    plane_z : array (p,)
        Their axial positions, m.

    Examples
    --------
    >>> picture = svg(["W1", "W2"], [0.02, 0.01], [0.0, 2.0])
    >>> picture[:4], picture.count("W1"), svg(["W1"], [0.02], [0.0], [0.1], ["A"], [0.0]).count("from the side")
    ('<svg', 1, 1)
    """
    radius, angle = np.asarray(radius, dtype=float), np.asarray(angle, dtype=float)
    size = 330.0
    big = 88.0 if z is not None else 110.0
    cx, cy, r = (128.0 if z is not None else WIDTH / 2), 178.0, big
    parts = [
        f'<circle cx="{cx}" cy="{cy}" r="{r * 1.12:.1f}" stroke="#999" fill="#fafafa"/>',
        f'<circle cx="{cx}" cy="{cy}" r="7" stroke="#444" fill="#ddd"/>',
        f'<path d="M{cx - r * 1.2} {cy}H{cx + r * 1.2}M{cx} {cy + r * 1.2}V{cy - r * 1.2}" stroke="#bbb" stroke-dasharray="7 3 1 3"/>',
        _text(cx + r * 1.2 + 6, cy + 5, "x"),
        _text(cx + 12, cy - r * 1.2 + 5, "y"),
        _text(cx, 20, "seen against +z", more='font-size="13"'),
    ]
    far = float(radius.max()) or 1.0
    sizes = radius / far * r
    lines = [[(cx - r * 1.2, cy), (cx + r * 1.2 + 12, cy)], [(cx, cy - r * 1.2), (cx, cy + r * 1.2)]]
    drawn = [*map(along, lines), around((cx, cy), r * 1.12), around((cx + 12, cy - r * 1.2), 5)]
    x, y = cx + sizes * np.cos(angle), cy - sizes * np.sin(angle)
    parts += _masses(names, x, y, cx + 0 * sizes, cy, drawn, size)
    if z is not None:
        parts += _side(names, np.asarray(z), sizes * np.sin(angle), plane_names, np.asarray(plane_z), size)
    return _svg(size, parts, "rotor with its masses")


def _svg(height: float, parts: Sequence[str], label: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}" width="{WIDTH:.0f}" height="{height:.0f}" '
        f'role="img" aria-label="{html.escape(label)}" font-family="Arial, Liberation Sans, sans-serif" font-size="{LETTERS:g}" fill="none" '
        f'stroke-linejoin="round" stroke-linecap="round">{"".join(parts)}</svg>'
    )


def _text(x: float, y: float, text: str, more: str = "") -> str:
    # a white rim keeps a name readable upon lines
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle" fill="#111" stroke="#fff" stroke-width="4" '
        f'paint-order="stroke" {more}>{html.escape(text)}</text>'
    )


def _masses(
    names: Sequence[str], x: Reals, y: Reals, x0: Reals, y0: float, drawn: Sequence[Any], height: float
) -> Iterator[str]:
    """Masses at (x, y) on their arms from (x0, y0), and their names, which keep clear of what is drawn."""
    places = list(zip(names, x.tolist(), y.tolist(), x0.tolist(), strict=True))
    for _, a, b, a0 in places:
        yield f'<path d="M{a0:.1f} {y0}L{a:.1f} {b:.1f}" stroke="#1d4f91" stroke-width="1.4"/>'
        yield f'<circle cx="{a:.1f}" cy="{b:.1f}" r="7" fill="#1d4f91" stroke="#fff"/>'
    marks = [part for _, a, b, a0 in places for part in (along([(a0, y0), (a, b)]), around((a, b), 7))]
    taken = np.concatenate([*drawn, *marks])
    for name, a, b, _ in places:
        middle, own = beside(name, (a, b), taken, (WIDTH, height), LETTERS)
        taken = np.concatenate([taken, own])
        yield _text(middle[0], middle[1] + LETTERS / 3, name)


def _side(
    names: Sequence[str], z: Reals, up: Reals, plane_names: Sequence[str], plane_z: Reals, height: float
) -> Iterator[str]:
    """The rotor from the side: masses and correction planes at their axial positions."""
    at = plane_z
    low, high = float(min(z.min(), at.min())), float(max(z.max(), at.max()))
    left, right, cy, r = 285.0, WIDTH - 24, 178.0, 88.0
    scale = (right - left) / ((high - low) or 1.0)
    yield f'<rect x="{left - 14}" y="{cy - 7}" width="{right - left + 28}" height="14" fill="#ddd" stroke="#888"/>'
    drawn = [along([(left - 14, cy + side), (right + 14, cy + side)]) for side in (-7, 7)]
    for k, (name, place) in enumerate(zip(plane_names, at.tolist(), strict=True)):
        x = left + (place - low) * scale
        yield f'<path d="M{x:.1f} {cy - 1.22 * r:.1f}V{cy + 1.22 * r:.1f}" stroke="#b35900" stroke-dasharray="6 4" stroke-width="1.5"/>'
        drawn.append(along([(x, cy - 1.5 * r), (x, cy + 1.22 * r)]))
        yield _text(
            x, cy - 1.3 * r - (17 if k % 2 and len(plane_names) > 3 else 0), name, more='font-weight="bold"'
        )
    x = left + (z - low) * scale
    yield from _masses(names, x, cy - up, x, cy, drawn, height)
    yield _text((left + right) / 2, cy + 1.22 * r + 24, "z →", more='font-size="13"')
    yield _text((left + right) / 2, 20, "from the side", more='font-size="13"')
