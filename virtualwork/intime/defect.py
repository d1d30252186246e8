"""By how much each step of a motion is off: the polynomial through its states does not quite fulfil the equation of motion.

Through the inputs, speeds and accelerations at the beginning, the middle and the end of a step goes a polynomial of degree 8. What
it fails the equation of motion by, its defect, tells by how much the states are off (P. E. Zadunaisky, Numerische Mathematik 27
(1976) 21): the accelerations along it are integrated over the step by Lobatto's rule of order 20 with 11 nodes, three of which are
these states; and by as much as that moves the nodes, the linear equation along the motion, δ̈ = ∂a/∂q δ + ∂a/∂q̇ δ̇, moves the
accelerations. What is then missing in the middle and at the end is the error there, with its sign and nearly all of its size: what
the polynomial itself is off by between its states has a defect of degree 7 and more, which 11 nodes integrate up to the middle too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from virtualwork.formulas.numbers import Reals

Rates = Callable[[Reals, Reals, Reals], Reals]
"""The accelerations (k, m, …) at states: times (m, …), inputs and speeds (k, m, …)."""

# nodes of a step where its states are, and the others
ENDS, INSIDE = [0, 5, 10], [1, 2, 3, 4, 6, 7, 8, 9]
# how often the linear equation moves the accelerations
SWEEPS = 3


class Rule(NamedTuple):
    """Over a step of length 1: nodes (11,), integrals up to these of a polynomial by its values there, (11, 11).

    And of the polynomial of degree 8 its values and slopes there, (11, 8) each, by the changes until middle and end, the speeds and
    the accelerations at beginning, middle and end; and of one of degree 2 its values there by those at these three, (11, 3).
    """

    c: Reals
    integrals: Reals
    place: Reals
    speed: Reals
    between: Reals


@cache
def rule() -> Rule:
    """Of Lobatto, with the roots of P₁₀′ (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 1965, 25.4.32).

    Examples
    --------
    >>> c, a, place, *_ = rule()
    >>> bool(abs(a[-1] @ c**19 - 1 / 20) < 1e-15)
    True
    >>> [float(x) for x in place[5]]
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """
    inner = np.real(np.polynomial.Legendre.basis(10).deriv().roots())
    # as far on one side as on the other
    x = np.concatenate([[-1.0], 0.5 * (inner - inner[::-1]), [1.0]])
    power, end = np.arange(9), np.array([-1.0, 0.0, 1.0])[:, None]
    # from −1 to 1: values, slopes and second derivatives of powers at the three states, and the powers by these
    slopes = power * end ** np.maximum(power - 1, 0)
    seconds = power * (power - 1) * end ** np.maximum(power - 2, 0)
    # whole sixteenths
    by = np.round(16 * np.linalg.inv(np.concatenate([end**power, slopes, seconds]))) / 16
    # a step is half as long as from −1 to 1
    by *= np.repeat([1.0, 0.5, 0.25], 3)
    place, speed = x[:, None] ** power @ by, 2 * (power * x[:, None] ** np.maximum(power - 1, 0)) @ by
    every = np.arange(len(x))
    powers = x[:, None] ** every
    sums = 0.5 * (x[:, None] * powers - (-1.0) ** (every + 1)) / (every + 1)
    inverse = np.linalg.inv(powers)
    integrals = sums @ inverse
    # once more, for what has rounded
    integrals += (sums - integrals @ powers) @ inverse
    between = np.stack([0.5 * x * (x - 1), 1 - x * x, 0.5 * x * (x + 1)], axis=1)
    return Rule(0.5 * (1 + x), integrals, place[:, 1:], speed[:, 1:], between)


def step_errors(f: Rates, slopes: Reals, t: Reals, q: Reals, v: Reals, a: Reals) -> Reals:
    """By how much the true motion from the beginning of each step is elsewhere in its middle and at its end, (2, 2k, n, …).

    Parameters
    ----------
    f : Rates
    slopes : array (k, 2k, 2 n + 1, …)
        The derivatives of the accelerations to the state (q, q̇).
    t : array (2 n + 1, …)
        Between steps, and in the middle of each.
    q, v, a : array (k, 2 n + 1, …)
        The inputs, their speeds and accelerations.

    Examples
    --------
    q̈ = −q, whose speed is a millionth too large at the end of a step:

    >>> t = np.array([0.0, 0.25, 0.5])
    >>> q, v = np.sin(t)[None], np.cos(t)[None] + [0.0, 0.0, 1e-6]
    >>> off = step_errors(lambda t, q, v: -q, np.tile([[[-1.0], [0.0]]], 3), t, q, v, -q)
    >>> [float(x) for x in abs(off[:, 1, 0]).round(12)]
    [0.0, 1e-06]
    """
    c, once, place, speed, between = rule()
    both, h = np.concatenate([once @ once, once]), np.diff(t[::2], axis=0)
    # a step of no length is not off
    unit = np.where(h > 0, h, 1.0)

    def three(x: Reals, axis: int) -> Reals:
        """At the beginning, the middle and the end of each step, (3, …)."""
        before, last = (np.s_[:],) * axis, x.shape[axis] - 2
        return np.stack([x[(*before, np.s_[i : last + i : 2])] for i in range(3)])

    first, fast, pull = (three(x, 1) for x in (q, v, a))
    # the time of a middle is rounded: what moves until it is no error
    late = t[1::2] - t[:-1:2] - 0.5 * h
    first[1], fast[1] = first[1] - late * fast[1], fast[1] - late * pull[1]
    ways = np.concatenate([first[1:] - first[0], h * fast, h * h * pull])
    there, faster = np.tensordot(place, ways, 1), np.tensordot(speed, ways, 1) / unit
    at = (first[0] + there[INSIDE], faster[INSIDE])
    times = t[:-1:2] + np.multiply.outer(c[INSIDE], h)
    # the nodes of a step one after the other along its axis
    n, k = len(h), len(q)
    states = (np.moveaxis(x, 0, 1).reshape(k, len(INSIDE) * n, *x.shape[3:]) for x in at)
    rates = f(times.reshape(-1, *h.shape[1:]), *states)
    values = np.empty_like(there)
    values[ENDS] = pull
    values[INSIDE] = np.moveaxis(rates.reshape(k, len(INSIDE), n, *h.shape[1:]), 1, 0)

    def integrated(x: Reals) -> Reals:
        """By how much accelerations (11, k, n, …) change inputs and speeds until each node, (11, 2k, n, …)."""
        sums, result = np.tensordot(both, x, 1), np.empty((len(c), 2 * k, *x.shape[2:]))
        np.multiply(sums[: len(c)], h * h, out=result[:, :k])
        np.multiply(sums[len(c) :], h, out=result[:, k:])
        return result

    off = missing = integrated(values) + np.concatenate(
        [np.multiply.outer(c, h * fast[0]) - there, fast[0] - faster], axis=1
    )
    bent = np.tensordot(between, three(slopes, 2), 1)
    for _ in range(SWEEPS):
        off = integrated(np.einsum("pij...,pj...->pi...", bent, off))
        off += missing
    return np.where(h > 0, off[ENDS[1:]], 0.0)
