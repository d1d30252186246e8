"""How large the error of an answer is, from what its steps are off by, or from a second solution in steps twice as long.

The errors of the steps (`defect`) add up as the motion makes them grow (`growth`), and so does what they have rounded. Where the
motion is not smooth, or a step is longer than what it follows (a stiff damper), steps half as long tell: the errors of a method of
order 8 add up to 1/256 of what they were (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, §II.4 and
II.8), so the distance of the two solutions is 255 times the error of the finer one. There the estimate is ten times what follows,
for the steps are not small without end.
"""

from __future__ import annotations

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.travel import Travel

# the tolerance of a step over the requested accuracy; the accuracy beyond which steps are so long that halves gain less than
# the method's order
FIRST, COARSE = 0.1, 1e-7
# what the error of steps half as long is less by, one; of the estimate by the errors of the steps; of that by the distance of two
# solutions, beside the former and alone
GAIN, SAFETY, BOTH, ALONE = 255.0, 2.0, 8.0, 10.0
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


def infinite_where_lost(error: Reals, scale: Reals) -> Reals:
    """The errors of the inputs, (n, k); infinite where no digit holds, for two solutions that have parted may be whole turns off.

    >>> infinite_where_lost(np.array([[1e-9], [0.5]]), np.array([1.0])).tolist()
    [[1e-09], [inf]]
    """
    return np.where((error / scale).max(axis=-1, keepdims=True) > UNKNOWN, np.inf, error)


def apart(t: Reals, q: Reals, v: Reals) -> Reals:
    """How far two solutions lie apart at times (n,), from the differences of their inputs and speeds, (n, k).

    They may meet by chance and be at different speeds: what these come to within a step counts as well.

    >>> apart(np.array([0.0, 0.5]), np.array([[0.0], [0.0]]), np.array([[0.0], [2e-9]])).tolist()
    [[0.0], [1e-09]]
    """
    return np.asarray(np.maximum(np.abs(q), np.diff(t, prepend=t[:1])[:, None] * np.abs(v)))


def share(fine: Travel, coarse: Travel) -> float:
    """Of the distance of two solutions what the finer may err by beside the errors of its steps.

    Where these say all, nothing; where a loop nearly folds quantities change fast within a step, and where steps pass kinks halves gain little.
    """
    rough = coarse.rough or fine.rough
    if fine.judged:
        return BOTH / GAIN if rough else 0.0
    return 1.0 if rough or coarse.legs[0].equations.crosses else ALONE / GAIN


def errors(fine: Travel, coarse: Travel, t: Reals) -> tuple[Reals, Reals]:
    """How far the inputs and their speeds may be from the truth at times, (n, k) each: between two nodes that of the one after, which holds within the step too."""
    nodes, rounded, stepped = fine.off
    (q, v, *_), part = fine.at(nodes), share(fine, coarse)
    error, rates = np.split(rounded + SAFETY * stepped, 2, axis=1)
    error = error + fine.blur(nodes)[:, None] + 4 * EPS * np.abs(q)
    if part:
        other, rate, *_ = coarse.at(nodes)
        gap, faster = (
            np.maximum.accumulate(x) for x in (apart(nodes, q - other, v - rate), np.abs(v - rate))
        )
        rates = np.maximum(rates, faster * np.divide(error, gap, out=np.zeros_like(gap), where=gap > 0))
        error, rates = error + part * gap, rates + part * faster
    after = np.searchsorted(nodes, t)
    # by two solutions alone nothing is known of what is between two nodes
    rows = np.minimum(after + (after > 0) * bool(part), len(nodes) - 1)
    return error[rows], rates[rows]


def unavoidable(fine: Travel) -> Reals:
    """The error that no shorter steps make smaller, (n, k): rounding, as the motion makes it grow, and interpolation near change points."""
    nodes, rounded, _ = fine.off
    return np.asarray(rounded[:, : rounded.shape[1] // 2] + fine.blur(nodes)[:, None])
