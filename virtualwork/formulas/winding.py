"""With several inputs: whole turns of angles, counted along a straight line of inputs from the guess to each pose."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from virtualwork.describe.description import Description
from virtualwork.formulas.numbers import Complexes, Number, Reals
from virtualwork.formulas.positions import FAR, SHORTEST, principal

# steps in a turn of an input, or in one mechanism's size of a slide: longer ones are not tried
NODES = 120


def straight_lines(
    m: Description, inputs: Sequence[Number], start: Sequence[float] | None = None
) -> tuple[Reals, Reals, Reals]:
    """From the guess, or other inputs, to each pose: the inputs there, the ways (n, k), the longest steps as shares of them."""
    n = max(np.size(v) for v in inputs)
    at = np.array(m.at if start is None else start)
    way = np.array([np.broadcast_to(np.asarray(v, dtype=float), n) for v in inputs]).T - at
    unit = np.array([m.size if e.is_slide else 2 * np.pi for e in m.inputs])
    return at, way, 1 / np.maximum(1.0, np.abs(way / unit).max(axis=1) * NODES)


def counted(
    rotations: Callable[[list[Reals]], Complexes],
    m: Description,
    inputs: Sequence[Number],
    start: Sequence[float] | None = None,
) -> tuple[Reals, NDArray[np.bool_]]:
    """Angles with their whole turns; at the start of every line they are `principal`.

    Parameters
    ----------
    rotations : function of inputs, (n,) each, to e^{iθ} of every angle, (angles, n); NaN where it is not assembled
    m : Description
    inputs : sequence of float or array (n,)
    start : sequence of float, optional
        The inputs where every line begins: without it those of the guess.

    Returns
    -------
    angles : array (angles, n)
        To some digits: the pose itself has the others.
    reached : array (n,) of bool
        Where False the line leads through places that cannot be assembled: no number of turns is known.
    """
    at, way, longest = straight_lines(m, inputs, start)
    last = np.repeat(rotations([np.array([x]) for x in at]), len(way), axis=1)
    total = principal(np.angle(last))
    # of each pose: the share of its way that is gone, and the next step
    gone, step = np.zeros(len(way)), longest.copy()
    reached = np.isfinite(way).all(axis=1) & np.isfinite(total).all(axis=0)
    while (left := np.flatnonzero(reached & (gone < 1))).size:
        to = np.minimum(gone[left] + step[left], 1.0)
        there = rotations(list((at + to[:, None] * way[left]).T))
        closed = np.isfinite(there).all(axis=0)
        turned = np.angle(there / last[:, left])
        divide = (np.abs(turned).max(axis=0) > FAR) & closed & (step[left] > SHORTEST * longest[left])
        reached[left[~closed]] = False
        step[left[divide]] /= 2
        some = closed & ~divide
        on = left[some]
        total[:, on] += turned[:, some]
        last[:, on] = there[:, some]
        gone[on], step[on] = to[some], np.minimum(2 * step[on], longest[on])
    return total, reached
