"""How long a step is, on any kind of number: what is tried, what is allowed, what is tried next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.recorded import RECORDED, Number
from virtualwork.formulas.numbers import EPS

# of a step's error, by its power law: how much of the allowed one is aimed at
SAFETY, SHRINK, GROW = 0.9, 0.2, 6.0
# steps in a row that the method's stability limits, not its accuracy
STIFF = 15
Numbers = list[Number]
Several = Sequence[Any] | NDArray[np.float64]
"""A number, or an array over lanes, of each input."""


def least(a: Number, b: Number) -> Number:
    """The smaller one; the first where either is NaN."""
    return RECORDED.select(a - b, b, a)


def most(a: Number, b: Number) -> Number:
    """The larger one; the first where either is NaN."""
    return RECORDED.select(b - a, b, a)


def tried(h: Number, whole: Number) -> Number:
    """The length of the next step on a way that is `whole` long: all of it, or so much that no sliver is left.

    >>> tried(1.0, 10.0), tried(7.0, 10.0), tried(9.95, 10.0)
    (1.0, 5.0, 10.0)
    """
    part = least(h, most(0.5 * whole, 0.5 * h))
    return RECORDED.select(h - 0.99 * whole, whole, part)


def shortest(t: Number, span: Number) -> Number:
    """The length of a step below which time does not go on."""
    return 16 * EPS * most(abs(t), span * 1e-3)


def allowed(
    tolerance: Number, scale: Numbers, q: Numbers, fastest: Numbers, v: Numbers, dv: Numbers
) -> Numbers:
    """The errors allowed of q and q̇ over a step: of an input relative to its `scale`, of a speed to the largest so far."""
    places = [tolerance * s + 4 * EPS * abs(x) for s, x in zip(scale, q, strict=True)]
    ends = [most(f, abs(x + d)) for f, x, d in zip(fastest, v, dv, strict=True)]
    return [*places, *(tolerance * x for x in ends)]


def shorter(h: Number, wanted: Number) -> Number:
    """The length that is tried instead of one that is refused; `wanted` is what its error says of the length, over it.

    >>> shorter(1.0, 0.5), shorter(1.0, 0.01), shorter(1.0, float("nan"))
    (0.5, 0.2, 0.2)
    """
    return h * RECORDED.select(wanted - SHRINK, wanted, SHRINK)


def longer(h: Number, wanted: Number, before: Number, grow: Number) -> Number:
    """The length tried after a step that holds; `before` is what would have been tried, had it not ended at a stop."""
    after = h * least(wanted, grow)
    return RECORDED.select(before - h, most(after, before), after)


def added(x: Number, low: Number, d: Number) -> tuple[Number, Number]:
    """x + d with the rounding of earlier sums (Kahan), and the rounding of this one."""
    d = d + low
    total = x + d
    return total, d - (total - x)


def stiffer(count: Number, stiffness: Number, stable: float) -> Number:
    """How many more steps the method's stability has limited than its accuracy."""
    return RECORDED.select(stiffness - stable, count + 1.0, most(count - 1.0, 0.0))


def first_steps(
    span: float,
    tolerance: Any,
    scale: Several,
    q: Several,
    v: Several,
    rates: Several,
) -> tuple[list[Any], Any]:
    """The largest speeds to begin with, and the length of the first step: floats, or arrays over lanes.

    Over a first step nothing changes by more than a method of order 8 may err.
    """
    fastest = [
        np.maximum(np.abs(x), np.asarray(s) / span if span else 1.0) for x, s in zip(v, scale, strict=True)
    ]
    errors = [tolerance * np.asarray(s) + 4 * EPS * np.abs(x) for s, x in zip(scale, q, strict=True)]
    errors += [tolerance * x for x in fastest]
    steep = np.max([np.abs(x) / s for x, s in zip((*v, *rates), errors, strict=False)], axis=0)
    h = np.minimum(span, (0.01 / np.maximum(steep, 1e-300)) ** (1 / 9))
    return fastest, h
