"""How large the error of an answer is, from a second solution whose steps are halves of the first one's.

The errors of the steps add up, and the motion itself makes them grow. With steps half as long those of a method of
order 8 add up to 1/256 of what they were (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations
I, §II.4 and II.8), so the distance of the two solutions is 255 times the error of the finer one. The estimate is ten
times what follows, for the steps are not small without end; rounding, which halves do not make smaller, is added, as the
motion makes it grow (`growth`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.travel import Travel

# the tolerance of a step over the requested accuracy; the accuracy beyond which steps are so long that halves gain less than
# the method's order
FIRST, COARSE = 0.1, 1e-7
# what the error of steps half as long is less by, one; of the estimate
GAIN, SAFETY, ALONE = 255.0, 4.0, 10.0
# the tolerance below which steps have errors of rounding alone
LEAST = 1e-15
# an error of the inputs beyond which nothing is known of what depends on them
UNKNOWN = 0.1
# solutions at most, until the estimate meets the accuracy
TRIES = 4


def first_tolerance(accuracy: float, crosses: bool = False) -> float:
    """That of a step of the first solution; where it crosses change points halves gain less anyhow, and their distance counts whole.

    >>> [f"{first_tolerance(accuracy):.0e}" for accuracy in (1e-3, 1e-9, 1e-20)]
    ['1e-08', '1e-10', '1e-15']
    """
    return max(LEAST, FIRST * (accuracy if crosses else min(accuracy, COARSE)))


def share(followed: bool) -> float:
    """Of the distance of two solutions what the finer may err by; less where their distance over each step is `followed` too.

    >>> round(share(True), 4), round(share(False), 4)
    (0.0157, 0.0392)
    """
    return (SAFETY if followed else ALONE) / GAIN


def apart(t: Reals, q: Reals, v: Reals) -> Reals:
    """How far two solutions lie apart at times (…, n), from the differences of their inputs and speeds, (…, n, k).

    They may meet by chance and be at different speeds: what these come to within a step counts as well.

    >>> apart(np.array([0.0, 0.5]), np.array([[0.0], [0.0]]), np.array([[0.0], [2e-9]])).tolist()
    [[0.0], [1e-09]]
    """
    step = np.diff(t, axis=-1, prepend=t[..., :1])[..., None]
    return np.asarray(np.maximum(np.abs(q), step * np.abs(v)))


def spread(fine: Reals, apart: Reals, of: Any) -> Reals:
    """The error of a quantity over times, the last axis but the inputs', from how far two solutions lie apart: the largest so far, and its rounding."""
    return np.asarray(np.maximum.accumulate(apart * of, axis=-2) + 4 * EPS * np.abs(fine))


def infinite_where_lost(error: Reals, scale: Reals) -> Reals:
    """The errors of the inputs, (n, k); infinite where no digit holds, for two solutions that have parted may be whole turns off.

    >>> infinite_where_lost(np.array([[1e-9], [0.5]]), np.array([1.0])).tolist()
    [[1e-09], [inf]]
    """
    return np.where((error / scale).max(axis=-1, keepdims=True) > UNKNOWN, np.inf, error)


# --- of two solutions ---------------------------------------------------------------------------------------------
def input_error(fine: Travel, coarse: Travel, t: Reals, part: float) -> Reals:
    """How far the inputs may be from the truth at times, (n, k): between two nodes that of the one after both, for in a single step halves gain by chance."""
    nodes = coarse.nodes[coarse.nodes <= fine.end]
    error = spread(*solutions_apart(fine, coarse, nodes)[:2], part) + besides(fine, coarse, nodes, part)
    after = np.searchsorted(nodes, t)
    return np.asarray(error[np.minimum(after + (after > 0), len(nodes) - 1)])


def solutions_apart(fine: Travel, coarse: Travel, nodes: Reals) -> tuple[Reals, Reals, Reals]:
    """The inputs of the finer solution at nodes of the coarser, how far the two lie apart there, and their speeds, (n, k) each."""
    (q, v, *_), (other, rate, *_) = fine.at(nodes), coarse.at(nodes)
    return q, apart(nodes, q - other, v - rate), np.abs(v - rate)


def besides(fine: Travel, coarse: Travel, t: Reals, part: float) -> Reals:
    """What is off besides a part of their distance, (n, k): for rounding, and where small changes are followed, for their distance over each step."""
    return np.asarray(fine.grown(t, part if coarse.followed else 0.0) + fine.blur(t)[:, None])


def unavoidable(fine: Travel, t: Reals) -> Reals:
    """The error that no shorter steps make smaller, (n, k): rounding, as the motion makes it grow, and interpolation near change points."""
    return np.asarray(fine.grown(t) + fine.blur(t)[:, None])
