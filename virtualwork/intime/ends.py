"""Where lanes end: the step in which an input first passes a level, and its time to rounding.

`meeting` asks the same of one motion's watches, step by step. A lane whose input turns close to the level is left to
it: there the polynomial of a step is not exact enough to say whether the level is met.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.marching import Nodes, over
from virtualwork.intime.meeting import NEAR, NEWTONS
from virtualwork.intime.passing import at, offsets, turns, zero
from virtualwork.intime.watch import Levels, noise

Mask = NDArray[np.bool_]


def sides(node: Nodes, levels: Levels, scale: Reals) -> dict[int, Reals]:
    """On which side of its level each input lies until it meets it, (lanes,): 1 above, −1 below; 0 where it rests there.

    Parameters
    ----------
    node : Nodes (lanes,)
        Where lanes begin.
    levels : mapping of an input's number to its level
    scale : array (lanes, k)
        What an error of each input is relative to.
    """
    sides = {}
    for j, level in levels.items():
        gap = node.q[:, j] - level
        gap = np.where(np.abs(gap) <= noise(level, scale[:, j]), 0.0, gap)
        speed, rate = node.v[:, j], node.rates[:, j]
        sides[j] = np.sign(np.where(gap != 0, gap, np.where(speed != 0, speed, rate)))
    return sides


def _gaps(nodes: Nodes, j: int, level: float, side: Reals) -> Reals:
    """Control values of how far input j lies from a level over each step, (rounds − 1, lanes, 6): positive on its side."""
    before, after = nodes.at(np.s_[:-1]), nodes.at(np.s_[1:])
    q, v, a = (of[..., j] for of in (before.q, before.v, before.rates))
    with np.errstate(all="ignore"):
        changes = offsets(v, a, after.t - before.t, after.q[..., j] - q, after.v[..., j], after.rates[..., j])
        return np.asarray(side[:, None] * (np.stack(changes, axis=-1) + (q - level)[..., None]))


def passed(nodes: Nodes, levels: Levels, sides: Mapping[int, Reals]) -> Mask:
    """Which steps pass a level, or come so near one that it is not sure, (rounds − 1, lanes)."""
    result = np.zeros(nodes.t[1:].shape, dtype=bool)
    for j, level in levels.items():
        rounds, lanes, *_ = _pieces(_gaps(nodes, j, level, sides[j]))
        result[rounds, lanes] = True
    return result


def _pieces(g: Reals) -> tuple[Any, ...]:
    """Steps whose polynomials may come to zero inside: round, lane, whether it is not sure, and between which shares."""
    with np.errstate(all="ignore"):
        low, high = g.min(axis=-1), g.max(axis=-1)
        rounds, lanes = np.nonzero((low <= NEAR * (high - low)) & (high > low) & np.isfinite(high - low))
    b = g[rounds, lanes]
    if not len(b):
        none = np.empty(0)
        return rounds, lanes, none.astype(bool), none, none
    shares = turns(b)
    values, spread = at(b, shares), NEAR * (high - low)[rounds, lanes]
    # what begins at its level is on its own side of it until its first turn
    inner = (shares > 0) & (shares < 1)
    doubtful, beyond = inner & (np.abs(values) < spread[:, None]), (values <= 0) & (shares > 0)
    some = doubtful | beyond
    first = np.argmax(some, axis=1)
    rows = np.flatnonzero(some.any(axis=1))
    first = first[rows]
    # rounds, lanes and the shares between which it passes
    return (
        rounds[rows],
        lanes[rows],
        doubtful[rows, first],
        shares[rows, first - 1],
        shares[rows, first],
    )


def events(
    rates: Tape, entering: Mapping[str, Any], nodes: Nodes, levels: Levels, sides: Mapping[int, Reals]
) -> tuple[Reals, Mask]:
    """When each lane first meets a level, (lanes,) s, NaN where it does not; and in which lanes that is not sure.

    Parameters
    ----------
    rates : Tape
        The accelerations.
    entering : mapping of name to array (lanes,)
        What further enters them.
    nodes : Nodes (rounds, lanes)
    levels : mapping of an input's number to its level
    sides : mapping of an input's number to array (lanes,)
        See `sides`.
    """
    times, doubt = np.full(nodes.t.shape[1], np.nan), np.zeros(nodes.t.shape[1], dtype=bool)
    for j, level in levels.items():
        g = _gaps(nodes, j, level, sides[j])
        rounds, lanes, doubtful, low, high = _pieces(g)
        # the first of each lane; they come round by round
        lane, first = np.unique(lanes, return_index=True)
        doubt[lane] |= doubtful[first]
        doubt |= sides[j] == 0
        if not len(lane):
            continue
        begin = rounds[first]
        here, after = nodes.at((begin, lane)), nodes.at((begin + 1, lane))
        whole = after.t - here.t
        h = guess = zero(g[begin, lane], low[first], high[first]) * whole
        some = {name: x[lane] for name, x in entering.items()}
        # Newton's method over the method's own steps
        for _ in range(NEWTONS):
            dq, dv, _ = over(rates, some, here, h)
            rate = here.v[:, j] + dv[:, j]
            with np.errstate(all="ignore"):
                change = np.where(rate == 0, 0.0, (level - here.q[:, j] - dq[:, j]) / rate)
            going = (np.abs(change) > 2 * EPS * np.maximum(np.abs(here.t), np.abs(h))) & (h + change > 0)
            h = np.where(h + change > 0, h + change, h)
            if not going.any():
                break
        doubt[lane] |= going | ~(np.abs(h - guess) <= NEAR * whole)
        times[lane] = np.fmin(times[lane], here.t + h)
    return times, doubt
