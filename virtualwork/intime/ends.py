"""Where lanes end: the step in which an input first passes a level, and its time to rounding.

`path.Node` asks the same of one motion's watches, step by step.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.marching import over
from virtualwork.intime.powers import names
from virtualwork.intime.watch import APART, SMALL, Levels, between

Nodes = Mapping[str, Reals]
# of a step, in which it is looked whether a level has been passed; halvings, and Newton's steps
QUARTERS, HALVINGS, NEWTONS = (0.25, 0.5, 0.75, 1.0), 24, 12


class _Steps(NamedTuple):
    """Steps of many lanes: (k, …) each, `h` (…)."""

    q: Any
    v: Any
    rates: Any
    h: Any
    dq: Any
    dv: Any
    after: Any

    def place(self, j: int, share: Any) -> Reals:
        """An input within the steps."""
        with np.errstate(all="ignore"):
            return np.asarray(between(*self, share)[0][j])


def _steps(nodes: Nodes, k: int) -> _Steps:
    q, v, rates = (np.stack([nodes[name] for name in of]) for of in names(k))
    before, after = slice(None, -1), slice(1, None)
    h = np.diff(nodes["t"], axis=0)
    return _Steps(
        q[:, before],
        v[:, before],
        rates[:, before],
        h,
        np.diff(q, axis=1),
        np.diff(v, axis=1),
        rates[:, after],
    )


def _quarters(steps: _Steps, j: int, level: float) -> NDArray[np.intp]:
    """In which quarter of each step input j first passes a level, 1 to 4; 0 where it does not."""
    before = steps.q[j]
    found = np.zeros(before.shape, dtype=np.intp)
    for i, share in enumerate(QUARTERS, 1):
        after = steps.place(j, share)
        low, high = np.minimum(before, after), np.maximum(before, after)
        size = np.maximum(np.maximum(np.abs(low), np.abs(high)), SMALL)
        hit = (low <= level) & (level <= high) & (np.abs(level - before) > APART * size)
        found[hit & (found == 0)] = i
    return found


def passed(nodes: Nodes, levels: Levels, k: int) -> NDArray[np.bool_]:
    """Which steps pass a level, (rounds − 1, lanes)."""
    steps = _steps(nodes, k)
    found = np.zeros(steps.h.shape, dtype=bool)
    for j, level in levels.items():
        found |= _quarters(steps, j, level) > 0
    return found


def events(k: int, rates: Tape, given: Mapping[str, Any], nodes: Nodes, levels: Levels) -> Reals:
    """When each lane first meets a level, (lanes,) s; NaN where it does not.

    Parameters
    ----------
    rates : Tape
        The accelerations.
    given : mapping of name to array (lanes,)
        What further enters them.
    nodes : mapping of name to array (rounds, lanes)
    levels : mapping of an input's number to its level
    """
    steps = _steps(nodes, k)
    found = np.full(nodes["t"].shape[1], np.nan)
    for j, level in levels.items():
        quarter = _quarters(steps, j, level)
        lanes = np.flatnonzero(quarter.any(axis=0))
        if not len(lanes):
            continue
        at = np.argmax(quarter[:, lanes] > 0, axis=0)
        here = _Steps(*(x[..., at, lanes] for x in steps))
        high = 0.25 * quarter[at, lanes]
        low, up = high - 0.25, here.place(j, high) > level
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            beyond = (here.place(j, middle) > level) == up
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        t, h = nodes["t"][at, lanes], 0.5 * (low + high) * here.h
        some = {name: x[lanes] for name, x in given.items()}
        # Newton's method over the method's own steps
        for _ in range(NEWTONS):
            dq, dv, _ = over(k, rates, some, t, here.q.T, here.v.T, here.rates.T, h)
            rate = here.v[j] + dv[:, j]
            with np.errstate(all="ignore"):
                change = np.where(rate == 0, 0.0, (level - here.q[j] - dq[:, j]) / rate)
            going = (np.abs(change) > 2 * EPS * np.maximum(np.abs(t), np.abs(h))) & (h + change > 0)
            if not going.any():
                break
            h = np.where(going, h + change, h)
        found[lanes] = np.fmin(found[lanes], t + h)
    return found
