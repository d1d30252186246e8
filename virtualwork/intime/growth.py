"""How far the motion itself carries the rounding of its steps apart.

What rounds in one step is a small change of the state (q, q̇), which the motion makes grow or shrink as the linear equation
along it says, δ̈ = ∂a/∂q δ + ∂a/∂q̇ δ̇: about an upper rest e times in every √(l/g). Two solutions do not tell how far: both have
rounded, each in its own way, and what they differ by is one sample. So the variance of the state goes along the motion,
P → Φ P Φᵀ + R in every step, with Φ the flow of the equation and R what rounds (A. H. Jazwinski, Stochastic Processes and
Filtering Theory, 1970, §4.2). Φ is the exponential of Magnus's exponent of order 4, from beginning, middle and end of the step by
Simpson's rule (S. Blanes et al., Physics Reports 470 (2009) 151, eq. 257). Where nothing depends on the time, the rates (q̇, q̈)
are themselves a solution of it, and Φ is made to take them along: else what it is off by grows anew at every upper rest.

Numbers of the mechanism and of the method are rounded too, and are off the same way in every step: a share of what changes over
it, D. Its sum goes along the motion as S → Φ S + D: about a lower rest it grows with the time, and not with its square. So do the
errors of the steps (`defect`), with their signs.

Matrices stand with their rows and columns first, (2k, 2k, n, …), so that products are done for all steps at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.defect import Rates

# halvings of a step for its exponential, and terms of the series
HALVINGS, TERMS = 2, 5
# of the arguments of the accelerations in a stage
ROUNDINGS = 3.0
# of what changes over a step, for what is off the same way in every step
SAME = 4.0
# of the changes of speed more: the weights of the method's stages are large numbers that cancel
STAGES = 2.0
# how far from a state accelerations are looked at for their slopes, as a share of what errors of the inputs are relative to
BESIDE = 2.0**-24


class Off(NamedTuple):
    """What a state (q, q̇) is off by: at random, a covariance (2k, 2k, …), and the same way in every step, (2k, 3k + 1, …).

    The latter has a column for what is off in the speed of each input, one for what is off in its acceleration, one for what is
    off in the sum of its loads, and a last one for the errors of the steps.
    """

    spread: Reals
    same: Reals

    def onto(self, other: Reals) -> Off:
        """In other coordinates, by the derivatives (2k, 2k, …) of their state to this one."""
        return Off(_moved(other, self.spread), _times(other, self.same))

    def at(self, i: int) -> Off:
        """At one of many states."""
        return Off(self.spread[:, :, i], self.same[:, :, i])

    @property
    def rounded(self) -> Reals:
        """How far q and q̇ are off for what has rounded, (2k, …): the deviation of what is so at random, and the sum of the rest."""
        at = range(len(self.spread))
        return np.asarray(
            np.sqrt(np.maximum(self.spread[at, at], 0.0)) + np.abs(self.same[:, :-1]).sum(axis=1)
        )

    @property
    def stepped(self) -> Reals:
        """How far q and q̇ are off for the errors of the steps, (2k, …)."""
        return np.abs(self.same[:, -1])


def grown(
    flow: Reals,
    h: Reals,
    rounds: Reals,
    ways: Reals,
    start: Off,
    local: Reals | float = 0.0,
    stiff: bool = False,
) -> Off:
    """What the states between the steps of a way are off by, for what is off in the steps before.

    Parameters
    ----------
    flow : array (2k, 2k, n, …)
        Of every step: what it makes of a small change of the state.
    h : array (n, …)
        The lengths of the steps.
    rounds : array (k, n, …)
        What rounding makes of the speeds over each step, by itself.
    ways : array (3k, n, …)
        By how much q and q̇ change over each step, and what q̇ would change by if all loads acted one way (see `ways_of`): a share
        of it is off the same way in every step, for numbers of the mechanism and of the method that are rounded.
    start : Off
        At the first state.
    local : array (2k, n, …), optional
        The errors of the steps at their ends; see `defect`.
    stiff : bool
        Whether what is off shrinks within a step by far.

    Returns
    -------
    Off
        With an axis of n + 1 states before those of lanes.

    Examples
    --------
    q̈ = q: a rounding of the start grows with the hyperbolic cosine of the time.

    >>> t = np.linspace(0, 20, 81)
    >>> q, v = np.cosh(t)[None], np.sinh(t)[None]
    >>> flow, rounds, _ = flows(lambda t, q, v: q, np.ones(1), t, q, v, q)
    >>> h, ways = np.diff(t[::2]), ways_of(np.diff(t[::2]), q[:, ::2], v[:, ::2])
    >>> off = grown(flow, h, rounds, ways, at_start(q[:, 0], v[:, 0])).rounded
    >>> bool(0.5 < off[0, -1] / (EPS * np.cosh(20)) < 200)
    True
    """
    k = len(rounds)
    # what is off in an acceleration moves the inputs within the step too
    inside = 0.0 * h if stiff else h
    stirred, each = _diagonal(np.concatenate([inside * rounds, rounds]) ** 2), _diagonal(ways)
    sums = each[k : 2 * k, 2 * k :] = each[2 * k :, 2 * k :]
    each[:k, 2 * k :] = 0.5 * inside * sums
    same = SAME * EPS * each[: 2 * k]
    if stiff:
        # as far as what pulls it back lets it
        stirred, same = _moved(flow, stirred), _times(flow, same)
    errors = np.broadcast_to(local, (2 * k, *ways.shape[1:]))[:, None]
    with np.errstate(all="ignore"):
        return _along(flow, stirred, np.concatenate([same, errors], axis=1), start)


def within(stepped: Reals, middle: Reals, h: Reals) -> Reals:
    """What states are off by for the errors of the steps (2k, n + 1, …), or within the step of length h before them if that is more.

    Between its ends and its middle what is off in q is a cubic, which the speeds at both move by up to 4/27 of half the step each.

    >>> within(np.array([[0.0, 1.0, 2.0], [0.0, 0.0, 0.0]]), np.array([[-3.0, 0.5], [0.0, 0.0]]), np.ones(2)).tolist()
    [[0.0, 3.0, 2.0], [0.0, 0.0, 0.0]]
    """
    off = np.maximum(stepped[:, 1:], stepped[:, :-1] + np.abs(middle))
    places, speeds = np.split(off, 2)
    with np.errstate(invalid="ignore"):
        places = places + np.where(h > 0, 4 / 27 * h * speeds, 0.0)
    return np.concatenate([stepped[:, :1], np.concatenate([places, speeds])], axis=1)


def ways_of(h: Reals, q: Reals, v: Reals, sizes: Reals | float = 0.0) -> Reals:
    """By how much q and q̇ (k, n, …) change over steps of length h, and what loads of these sizes change q̇ by, (3k, n − 1, …).

    Sizes (k, n, …) are those of the accelerations that the loads bring about, each by itself: where they cancel, what they have
    rounded remains.
    """
    sums = h * np.broadcast_to(sizes, q.shape)[:, 1:]
    change = np.diff(v, axis=1)
    return np.concatenate([np.diff(q, axis=1), change, np.maximum(sums, STAGES * np.abs(change))])


def at_start(q: Reals, v: Reals) -> Off:
    """What has rounded at the start, for q and q̇ (k, …)."""
    spread = _diagonal(np.square(0.5 * EPS * np.concatenate([q, v])))
    return Off(spread, np.zeros((len(spread), 3 * len(q) + 1, *q.shape[1:])))


def free(h: Reals, k: int) -> Reals:
    """The flow of small changes where nothing pulls them back or apart, of steps of length h (n − 1, …): (2k, 2k, n − 1, …)."""
    flow = _diagonal(np.ones((2 * k, *h.shape)))
    flow[range(k), range(k, 2 * k)] = h
    return flow


def flows(
    f: Rates,
    scale: Reals,
    t: Reals,
    q: Reals,
    v: Reals,
    a: Reals,
    steady: bool = True,
    stiff: bool = False,
) -> tuple[Reals, Reals, Reals]:
    """The flows of small changes (q, q̇) along the motion over each step, (2k, 2k, n, …), what rounding of the arguments makes of the speeds over it, (k, n, …), and the derivatives of the accelerations to the state, (k, 2k, 2 n + 1, …).

    Parameters
    ----------
    f : Rates
    scale : array (k,) or (k, …)
        What errors of the inputs are relative to.
    t : array (2 n + 1, …)
        Between steps, and in the middle of each.
    q, v, a : array (k, 2 n + 1, …)
        The inputs, their speeds and accelerations.
    steady : bool
        Whether the accelerations depend on the inputs and their speeds alone, and not on the time.
    stiff : bool
        Whether what is off shrinks within a step by far: Padé's fraction of degrees 1 and 2 stands for the exponential.
    """
    k, h = len(q), np.diff(t[::2], axis=0)
    slopes = _slopes(f, scale, t, q, v, a)
    state = np.abs(np.concatenate([q, v]))
    stirred = np.einsum("ij...,j...->i...", np.abs(slopes), state)
    matrices = np.zeros((2 * k, *slopes.shape[1:]))
    matrices[range(k), range(k, 2 * k)], matrices[k:] = 1.0, slopes
    first, middle, last = matrices[:, :, :-1:2], matrices[:, :, 1::2], matrices[:, :, 2::2]
    mean = h / 6 * (first + 4 * middle + last)
    if stiff:
        flow = _fraction(mean)
    else:
        change = h / 12 * (last - first)
        flow = _exponential(mean + _times(change, mean) - _times(mean, change))
        if steady:
            with np.errstate(all="ignore"):
                flow = _along_itself(flow, np.concatenate([v, a])[:, ::2], h, scale)
    return flow, ROUNDINGS * EPS * h * np.maximum(stirred[:, :-1:2], stirred[:, 1::2]), slopes


def _slopes(f: Rates, scale: Reals, t: Reals, q: Reals, v: Reals, a: Reals) -> Reals:
    """The derivatives of the accelerations to the state, (k, 2k, m, …), by differences."""
    k, state = len(q), np.concatenate([q, v])
    by, moved = [BESIDE * scale[j % k] for j in range(2 * k)], np.stack([state] * (2 * k), axis=1)
    for j in range(2 * k):
        moved[j, j] += by[j]
    rates = f(np.concatenate([t] * (2 * k)), *moved.reshape(2, k, -1, *state.shape[2:]))
    there = rates.reshape(k, 2 * k, *state.shape[1:])
    slopes = np.stack([(there[:, j] - a) / by[j] for j in range(2 * k)], axis=1)
    # a place that cannot be assembled says nothing
    return np.where(np.isfinite(slopes), slopes, 0.0)


def _along_itself(flow: Reals, rates: Reals, h: Reals, scale: Reals) -> Reals:
    """The flows, changed least so that they take the rates (q̇, q̈) at each node to those at the next, as the true ones do."""
    unit = np.broadcast_to(scale[:, None], rates[: len(scale), 1:].shape)
    units = np.concatenate([unit, unit / np.where(h > 0, h, 1.0)])
    here = rates[:, :-1] / units
    square = np.square(here).sum(axis=0)
    off = rates[:, 1:] - np.einsum("ij...,j...->i...", flow, rates[:, :-1])
    return np.asarray(
        flow + np.einsum("i...,j...->ij...", off, here / units / np.where(square > 0, square, 1.0))
    )


def _times(a: Reals, b: Reals) -> Reals:
    return np.asarray(np.einsum("ij...,jk...->ik...", a, b))


def _exponential(a: Reals) -> Reals:
    """The exponential of matrices, by its series for a quarter of them."""
    one = np.zeros_like(a)
    one[range(len(a)), range(len(a))] = 1.0
    part, term = one + a / 2**HALVINGS, a / 2**HALVINGS
    for i in range(2, TERMS + 1):
        term = _times(term, a) / (2**HALVINGS * i)
        part = part + term
    for _ in range(HALVINGS):
        part = _times(part, part)
    return np.asarray(part)


def _fraction(a: Reals) -> Reals:
    """(1 − ⅔ a + ⅙ a²)⁻¹ (1 + ⅓ a) of matrices: near their exponentials, and none where these are (Hairer and Wanner, II, §IV.3)."""
    one = np.zeros_like(a)
    one[range(len(a)), range(len(a))] = 1.0
    below, above = one - 2 / 3 * a + _times(a, a) / 6, one + a / 3
    solved = np.linalg.solve(*(np.moveaxis(x, (0, 1), (-2, -1)) for x in (below, above)))
    return np.asarray(np.moveaxis(solved, (-2, -1), (0, 1)))


def _along(flow: Reals, rounds: Reals, ways: Reals, start: Off) -> Off:
    """What states are off by, by P → Φ P Φᵀ + R and S → Φ S + D from the start on.

    Steps are taken side by side in as many runs as there are steps in each, from nothing; what each run begins with follows.
    """
    n, *lanes = flow.shape[2:]
    if not n:
        return Off(*(of[:, :, None] for of in start))
    length, size = max(1, math.isqrt(n)), len(flow)
    runs = -(-n // length)
    rest = (0, runs * length - n), *[(0, 0)] * len(lanes)
    flow, rounds, ways = (
        np.pad(x, ((0, 0), (0, 0), *rest)).reshape(*x.shape[:2], runs, length, *lanes)
        for x in (flow, rounds, ways)
    )
    # Φ of all steps so far, and S beside it
    going, spread = [np.concatenate([flow, ways], axis=1)[:, :, :, 0]], [rounds[:, :, :, 0]]
    for i in range(1, length):
        step = flow[:, :, :, i]
        going.append(_times(step, going[-1]))
        going[-1][:, size:] += ways[:, :, :, i]
        spread.append(_moved(step, spread[-1]) + rounds[:, :, :, i])
    begin = [start]
    for j in range(runs - 1):
        flow, p, s = going[-1][:, :size, j], spread[-1][:, :, j], going[-1][:, size:, j]
        begin.append(Off(_moved(flow, begin[-1].spread) + p, _times(flow, begin[-1].same) + s))
    begins = (np.stack(of, axis=2)[:, :, :, None] for of in zip(*begin, strict=True))
    whole, spreads = (np.stack(x, axis=3) for x in (going, spread))
    moved = Off(*begins).onto(whole[:, :size])
    parts = zip(start, (moved.spread + spreads, moved.same + whole[:, size:]), strict=True)
    each = (
        np.concatenate([of[:, :, None], x.reshape(*x.shape[:2], runs * length, *lanes)[:, :, :n]], axis=2)
        for of, x in parts
    )
    # beyond all numbers it is infinite
    return Off(*(np.where(np.isnan(x), np.inf, x) for x in each))


def _diagonal(x: Reals) -> Reals:
    out = np.zeros((len(x), *x.shape))
    out[range(len(x)), range(len(x))] = x
    return out


def _moved(flow: Reals, spread: Reals) -> Reals:
    """Φ P Φᵀ."""
    return np.asarray(np.einsum("ij...,kj...->ik...", _times(flow, spread), flow))
