"""Where lanes end: the step in which an input first passes a level, and its time to rounding.

`path.Walk` asks the same of one motion's watches, step by step.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.marching import Nodes, over
from virtualwork.intime.watch import APART, HALVINGS, NEWTONS, QUARTERS, SMALL, Levels, between


def _place(before: Nodes, after: Nodes, j: int, share: Any) -> Reals:
    """An input within steps of lanes, roughly."""
    q, v, rate = (of[..., j] for of in (before.q, before.v, before.rates))
    dq, dv, there = after.q[..., j] - q, after.v[..., j] - v, after.rates[..., j]
    with np.errstate(all="ignore"):
        return np.asarray(between([q], [v], [rate], after.t - before.t, [dq], [dv], [there], share)[0][0])


def _quarters(nodes: Nodes, j: int, level: float) -> NDArray[np.intp]:
    """In which quarter of each step input j first passes a level, 1 to 4; 0 where it does not."""
    steps = nodes.at(np.s_[:-1]), nodes.at(np.s_[1:])
    before = steps[0].q[..., j]
    found = np.zeros(before.shape, dtype=np.intp)
    for i, share in enumerate(QUARTERS, 1):
        after = _place(*steps, j, share)
        low, high = np.minimum(before, after), np.maximum(before, after)
        size = np.maximum(np.maximum(np.abs(low), np.abs(high)), SMALL)
        hit = (low <= level) & (level <= high) & (np.abs(level - before) > APART * size)
        found[hit & (found == 0)] = i
    return found


def passed(nodes: Nodes, levels: Levels) -> NDArray[np.bool_]:
    """Which steps pass a level, (rounds − 1, lanes)."""
    found = np.zeros(nodes.t[1:].shape, dtype=bool)
    for j, level in levels.items():
        found |= _quarters(nodes, j, level) > 0
    return found


def events(rates: Tape, given: Mapping[str, Any], nodes: Nodes, levels: Levels) -> Reals:
    """When each lane first meets a level, (lanes,) s; NaN where it does not.

    Parameters
    ----------
    rates : Tape
        The accelerations.
    given : mapping of name to array (lanes,)
        What further enters them.
    nodes : Nodes (rounds, lanes)
    levels : mapping of an input's number to its level
    """
    found = np.full(nodes.t.shape[1], np.nan)
    for j, level in levels.items():
        quarter = _quarters(nodes, j, level)
        lanes = np.flatnonzero(quarter.any(axis=0))
        if not len(lanes):
            continue
        at = np.argmax(quarter[:, lanes] > 0, axis=0)
        here, after = nodes.at((at, lanes)), nodes.at((at + 1, lanes))
        high = 0.25 * quarter[at, lanes]
        low, up = high - 0.25, _place(here, after, j, high) > level
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            beyond = (_place(here, after, j, middle) > level) == up
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        t, h = here.t, 0.5 * (low + high) * (after.t - here.t)
        some = {name: x[lanes] for name, x in given.items()}
        # Newton's method over the method's own steps
        for _ in range(NEWTONS):
            dq, dv, _ = over(rates, some, here, h)
            rate = here.v[:, j] + dv[:, j]
            with np.errstate(all="ignore"):
                change = np.where(rate == 0, 0.0, (level - here.q[:, j] - dq[:, j]) / rate)
            going = (np.abs(change) > 2 * EPS * np.maximum(np.abs(t), np.abs(h))) & (h + change > 0)
            if not going.any():
                break
            h = np.where(going, h + change, h)
        found[lanes] = np.fmin(found[lanes], t + h)
    return found
