"""Names in a picture of SVG: each beside its place, where least is drawn."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

AROUND = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1], [1, 0], [-1, 0], [0, -1], [0, 1]])
"""Sides on which a name may stand, y downwards; the first that is free is taken."""
GAPS = (3.0, 9.0, 16.0, 26.0)
"""Distances of a name's edge from its place, of letters of 12 pixels."""
HALF = 3.3, 7.0
"""Half the width of a letter and half the height of a line, of letters of 12 pixels."""
Real = NDArray[np.float64]


def along(corners: ArrayLike) -> Real:
    """Return pixels (k, 2) some 4 apart along a line through corners (n, 2).

    >>> along([[0, 0], [8, 0]]).tolist()
    [[0.0, 0.0], [2.6666666666666665, 0.0], [5.333333333333333, 0.0], [8.0, 0.0]]
    """
    ends = np.asarray(corners, dtype=float)
    pieces = [
        a + np.linspace(0, 1, 2 + int(np.hypot(*(b - a)) / 4))[:, None] * (b - a) for a, b in pairwise(ends)
    ]
    return np.concatenate([ends[:1], *pieces])[1 if pieces else 0 :]


def around(middle: ArrayLike, radius: float) -> Real:
    """Return pixels (33, 2) around a circle, and its middle."""
    angle = np.linspace(0, 2 * np.pi, 32)
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.asarray(np.asarray(middle, dtype=float) + np.concatenate([np.zeros((1, 2)), ring]))


def beside(
    text: str, at: ArrayLike, taken: Real, size: ArrayLike, letters: float = 12.0
) -> tuple[Real, Real]:
    """Return the middle of a name beside its place, where least is drawn, and the pixels (k, 2) that the name takes.

    Parameters
    ----------
    text
        The name.
    at
        Its place, pixels, y downwards.
    taken
        The pixels (k, 2) that are drawn so far.
    size
        Width and height of the picture, within which the name stands.
    letters
        The size of its letters, pixels.

    >>> middle, own = beside("A", [50, 50], along([[20, 20], [50, 50]]), [100, 100])
    >>> middle.tolist()
    [56.3, 40.0]
    """
    place, whole = np.asarray(at, dtype=float), np.asarray(size, dtype=float)
    part = letters / 12.0
    half = part * np.array([HALF[0] * len(text), HALF[1]])
    middles = np.concatenate([place + AROUND * (half + part * gap) for gap in GAPS])
    hits = (np.abs(taken - middles[:, None]) < half + 2).all(axis=2).sum(axis=1)
    beyond = np.maximum(0, np.maximum(half - middles, middles + half - whole)).sum(axis=1)
    middle = np.round(middles[np.argmin(hits + beyond)], 2)
    corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    across = along([middle - (half[0], 0), middle + (half[0], 0)])
    return middle, np.concatenate([across, middle + corners])
