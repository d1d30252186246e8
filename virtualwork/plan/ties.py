"""Linear relations between angles and slides, solved for some of them: Gauss and Jordan."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial

from virtualwork.describe.description import Description, known_by_guess, slide_by_guess
from virtualwork.describe.meshes import Coordinate
from virtualwork.plan.steps import Angle

# Σ c·x of what is not known yet = what is known
Row = tuple[dict[Coordinate, float], Angle]
# below this share of its largest coefficient anywhere an unknown is not in a row
ABSENT = 1e-13


def guessed(m: Description) -> dict[Coordinate, float]:
    """The angles of the guess, and the slides of racks, as far as it says them."""
    angles, points = known_by_guess(m)
    result: dict[Coordinate, float] = dict(angles.items())
    for i in (mesh.guide for mesh in m.meshes if mesh.guide is not None):
        driver = m.driver_of(i)
        slide = m.at[driver] if driver is not None else slide_by_guess(m, i, angles, points)
        if slide is not None:
            result[i] = slide
    return result


def eliminated(
    rows: Sequence[Row], fresh: Sequence[Coordinate], wheels: Collection[str]
) -> dict[Coordinate, Row]:
    """What is tied in terms of what stays free.

    A slide is tied to angles only where it has to be: the wheel of a rack turns with its slide, of which no whole turns
    have to be known.

    Parameters
    ----------
    rows : sequence of Row
    fresh : sequence of str or int
        Angles and slides that are not known yet.
    wheels : collection of str
        The wheels of racks.

    Returns
    -------
    dict of what is tied to (share of each free one, what is known)

    Examples
    --------
    >>> eliminated([({"pinion": -0.03, 0: 1.0}, Angle(0.06))], [0, "pinion"], ["pinion"])["pinion"][0]
    {0: 33.333333333333336}
    """
    sizes: dict[Coordinate, float] = {}
    for unknown, _ in rows:
        for x, f in unknown.items():
            sizes[x] = max(sizes.get(x, 0.0), abs(complex(f)))
    solved: dict[Coordinate, Row] = {}
    for unknown, value_of in rows:
        for body, (others, value) in solved.items():
            if body in unknown:
                f = unknown.pop(body)
                value_of = value_of.plus(value, -f)
                for other, o in others.items():
                    unknown[other] = unknown.get(other, 0.0) + f * o
        unknown = {b: f for b, f in unknown.items() if abs(f) > ABSENT * sizes[b]}
        if not unknown:
            continue
        pivot = max(unknown, key=partial(_suits, unknown, fresh, wheels))
        p = unknown.pop(pivot)
        others = {b: -f / p for b, f in unknown.items()}
        value = Angle().plus(value_of, 1 / p)
        for body, (was, val) in list(solved.items()):
            if pivot in was:
                f = was.pop(pivot)
                for other, o in others.items():
                    was[other] = was.get(other, 0.0) + f * o
                solved[body] = (was, val.plus(value, f))
        solved[pivot] = (others, value)
    return solved


def _suits(
    row: Mapping[Coordinate, float], fresh: Sequence[Coordinate], wheels: Collection[str], x: Coordinate
) -> tuple[bool, bool, bool, int]:
    """How well an angle or a slide suits to be worked out of a row: the largest is taken."""
    rack = any(isinstance(other, int) for other in row)
    return isinstance(x, str), rack and x in wheels, abs(abs(row[x]) - 1) < 1e-12, fresh.index(x)
