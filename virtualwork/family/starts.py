"""Where a fit begins: points of a low-discrepancy sequence, and inputs at which poses come near a target in its order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.numbers import Reals

# poses of the coarse sweep
COARSE = 120
# of those, the nearest ones to the first row with which an order may begin
FIRSTS = 24
# rad: inputs that are one
EQUAL = 1e-9


def shares(own: Reals, count: int, seed: int) -> Reals:
    """Places between the bounds, 0 to 1, (count, d): the file's own, as near as the bounds let them, then Sobol's."""
    from scipy.stats import qmc

    drawn = qmc.Sobol(len(own), seed=seed).random_base2(max(0, int(np.ceil(np.log2(max(count, 1))))))
    return np.vstack([np.clip(own, 0.0, 1.0), drawn])[:count]


def along(away: Reals, q: Reals, turning: bool) -> list[tuple[float, Reals]]:
    """The inputs (n,) of places that meet a target's rows in their order, either way round, with what is left.

    Parameters
    ----------
    away : array (poses, n)
        How far each pose is from each row, squared.
    q : array (poses,)
        Evenly spaced; of a turning input over a whole turn.
    """
    span = len(q) * float(q[1] - q[0])
    found = []
    for sense in (1, -1):
        cost, places = _in_order(away[::sense], turning)
        # past the end of the turn the input goes on
        turns, k = np.divmod(places, len(q))
        found.append((cost, q[::sense][k] + sense * turns * span))
    return sorted(found, key=lambda each: each[0])


def _in_order(away: Reals, cyclic: bool) -> tuple[float, NDArray[np.intp]]:
    """Which pose goes to which row, (n,), so that poses never go back and Σ away (poses, n) is least.

    Around a turn any pose near the first row may be the first, and poses past the last go on from the first.

    >>> _in_order(np.array([[9.0, 0.0], [0.0, 9.0], [4.0, 4.0]]), True)
    (0.0, array([1, 3]))
    """
    m, n = away.shape
    firsts = np.argsort(away[:, 0], kind="stable")[:FIRSTS] if cyclic else np.zeros(1, dtype=int)
    around = (firsts[:, None] + np.arange(m)) % m
    total = away[around, 0].copy()
    if cyclic:
        total[:, 1:] = np.inf
    before = []
    for j in range(1, n):
        least = np.minimum.accumulate(total, axis=1)
        # where the least so far was
        here = np.where(total == least, np.arange(m), 0)
        before.append(np.maximum.accumulate(here, axis=1))
        total = least + away[around, j]
    first, k = np.unravel_index(np.argmin(total), total.shape)
    cost = float(total[first, k])
    places = [int(k)]
    for back in reversed(before):
        places.append(int(back[first, places[-1]]))
    return cost, firsts[first] + np.array(places[::-1])


def in_turn(q: Reals, at: float) -> Reals:
    """Inputs a whole turn or more from others, one after the other within a turn, where that can be, and next to `at`.

    >>> in_turn(np.array([6.2, 0.1, 0.2]), 0.0)
    array([-0.08318531,  0.1       ,  0.2       ])
    """
    turn = 2 * np.pi
    steps = np.diff(q)
    if not ((steps >= 0).all() or (steps <= 0).all()):
        ways = []
        for sense in (1.0, -1.0):
            # a step back of a rounding is none around the turn
            on = (sense * steps + EQUAL) % turn - EQUAL
            ways.append((on.sum(), q[0] + sense * np.concatenate([[0.0], np.cumsum(on)])))
        travel, found = min(ways, key=lambda way: way[0])
        q = found if travel <= turn else q
    return np.asarray(q - turn * np.round((q[0] - at) / turn))
