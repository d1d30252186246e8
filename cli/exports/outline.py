"""What a link looks like: a stroke between two points, a polygon around more."""

from __future__ import annotations

import cmath


def outline(points: list[complex]) -> list[tuple[complex, complex]]:
    """Return the strokes of a link with these points: each of some length.

    >>> len(outline([0j, 1 + 0j, 1j, 1 + 1j])), outline([0j]), outline([0j, 0j, 2j])
    (4, [], [(0j, 2j)])
    """
    found = list(dict.fromkeys(points))
    if len(found) < 2:
        return []
    if len(found) == 2:
        return [(found[0], found[1])]
    middle = sum(found) / len(found)
    found.sort(key=lambda z: cmath.phase(z - middle))
    return list(zip(found, found[1:] + found[:1], strict=True))
