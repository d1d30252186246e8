"""Angles with their whole turns, counted along the one input from the guess outwards."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from virtualwork.formulas.numbers import Number, Reals

# rad: what turns farther than this between two samples is looked at in between
FAR = 1.0
# of the whole way, or of a turn of the input: samples this near are not divided again
SHORTEST = 1e-9
# nodes and angles, (n,) each; NaN where there is no angle
Samples = tuple[Reals, Reals]
NONE: Samples = np.empty(0), np.empty(0)


def principal(angle: Number) -> Number:
    """An angle in (−π, π]: what stands at half a turn but for its rounding is at +π.

    >>> float(principal(-math.pi + 1e-15) - math.pi) < 2e-15
    True
    """
    return angle - 2 * math.pi * np.ceil((angle - math.pi - 1e-9) / (2 * math.pi))


def follow(
    angle: Callable[[Reals], Reals], q: Reals, start: float, turn: float, known: Samples = NONE
) -> Samples:
    """Count the whole turns of an angle from the start, where it is `principal`, over inputs q.

    Parameters
    ----------
    angle : function of inputs (n,) to an angle (n,) modulo a turn; NaN where there is none
    q : array
    start : float
    turn : float
        A turn of the input, or the mechanism's size of a slide.
    known : pair of arrays, optional
        What was counted before.

    Returns
    -------
    nodes, angles : array (m,)
        More than asked for where the angle turns far between two of them, and towards the end of a branch.

    Examples
    --------
    >>> nodes, angles = follow(lambda q: np.angle(1 + 1.001 * np.exp(1j * q)), np.linspace(0, 13, 300), 0.0, 6.28)
    >>> round(float(angles[-1]), 2), len(nodes) > 300
    (12.78, True)
    """

    def more(samples: Samples, q: Reals) -> Samples:
        nodes, first = np.unique(np.append(samples[0], q), return_index=True)
        return nodes, np.append(samples[1], angle(q))[first]

    nodes, angles = more(known, np.append(start, q))
    for _ in range(64):
        there = np.isfinite(angles)
        turned = np.abs(np.exp(1j * angles[1:]) - np.exp(1j * angles[:-1]))
        # the end of a branch lies between a sample that is there and one that is not
        divide = ((turned > FAR) | (there[1:] != there[:-1])) & (np.diff(nodes) > SHORTEST * turn)
        if not divide.any():
            break
        nodes, angles = more((nodes, angles), ((nodes[1:] + nodes[:-1]) / 2)[divide])
    good = np.isfinite(angles)
    angles[good] = np.unwrap(angles[good])
    here = np.searchsorted(nodes, start)
    if good[here]:
        angles += principal(angles[here]) - angles[here]
    elif good.any():
        # a guess that is not assembled stands between two samples
        near = np.interp(start, nodes[good], angles[good])
        angles += principal(near) - near
    return nodes, angles


def whole(samples: Samples, q: Number, angle: Number) -> Number:
    """An angle at inputs q, known modulo a turn, with its whole turns by what was counted."""
    nodes, counted = samples
    good = np.isfinite(counted)
    if not good.any():
        return angle
    near = np.interp(np.asarray(q, dtype=float), nodes[good], counted[good])
    return angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi))
