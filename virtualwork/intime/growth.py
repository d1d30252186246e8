"""How far the motion itself carries the rounding of its steps apart.

What rounds in one step is a small change of the state (q, q̇), which the motion makes grow or shrink as the linear equation
along it says, δ̈ = ∂a/∂q δ + ∂a/∂q̇ δ̇: about an upper rest e times in every √(l/g). Two solutions do not tell how far: both have
rounded, each in its own way, and what they differ by is one sample. So the variance of the state goes along the motion,
P → Φ P Φᵀ + R in every step, with Φ the flow of the equation and R what rounds (A. H. Jazwinski, Stochastic Processes and
Filtering Theory, 1970, §4.2). Φ is the exponential of Magnus's exponent of order 4, from Gauss's two nodes of the step
(S. Blanes et al., Physics Reports 470 (2009) 151, eq. 254). Where nothing depends on the time, the rates (q̇, q̈) are themselves a
solution of it, and Φ is made to take them along: else what it is off by grows anew at every upper rest.

Numbers of the mechanism and of the method are rounded too, and are off the same way in every step: a share of what changes over
it, D. Its sum goes along the motion as S → Φ S + D: about a lower rest it grows with the time, and not with its square.

Matrices stand with their rows and columns first, (2k, 2k, n, …), so that products are done for all steps at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.passing import DEGREE, offsets, speeds, weights

# halvings of a step for its exponential, and terms of the series
HALVINGS, TERMS = 2, 5
# Gauss's two nodes of a step
GAUSS = 0.5 - math.sqrt(3) / 6, 0.5 + math.sqrt(3) / 6
# of the arguments of the accelerations in a stage
ROUNDINGS = 3.0
# of what changes over a step, for what is off the same way in every step
SAME = 4.0
# of the changes of speed more: the weights of the method's stages are large numbers that cancel
STAGES = 2.0
# how far from a state accelerations are looked at for their slopes, as a share of what errors of the inputs are relative to
BESIDE = 2.0**-24
Rates = Callable[[Reals, Reals, Reals], Reals]
"""The accelerations (k, m, …) at states: times (m, …), inputs and speeds (k, m, …)."""


class Rounded(NamedTuple):
    """What rounding has made of a state (q, q̇): at random, a covariance (2k, 2k, …), and the same way in every step, (2k, 3k, …).

    The latter has a column for what is off in the speed of each input, one for what is off in its acceleration, and one for what is
    off in the sum of its loads.
    """

    spread: Reals
    same: Reals

    def onto(self, other: Reals) -> Rounded:
        """In other coordinates, by the derivatives (2k, 2k) of their state to this one."""
        return Rounded(other @ self.spread @ other.T, other @ self.same)


def grown(
    flow: Reals,
    h: Reals,
    rounds: Reals,
    ways: Reals,
    start: Rounded,
    seen: Reals | None = None,
    local: Reals | None = None,
    stiff: bool = False,
) -> tuple[Reals, Rounded]:
    """How far the inputs may be off at the nodes of a way, (k, n, …), for what has rounded before, and the state at the last.

    Parameters
    ----------
    flow : array (2k, 2k, n − 1, …)
        Of every step: what it makes of a small change of the state.
    h : array (n − 1, …)
        The lengths of the steps.
    rounds : array (k, n − 1, …)
        What rounding makes of the speeds over each step, by itself.
    ways : array (3k, n − 1, …)
        By how much q and q̇ change over each step, and what q̇ would change by if all loads acted one way (see `ways_of`): a share
        of it is off the same way in every step, for numbers of the mechanism and of the method that are rounded.
    start : Rounded
        At the first node.
    seen : array (k, k, n, …), optional
        Where the way has other coordinates: the derivatives of the inputs to these.
    local : array (2k, n − 1, …), optional
        What else every step is off by, one way or the other.
    stiff : bool
        Whether what is off shrinks within a step by far.

    Examples
    --------
    q̈ = q: a rounding of the start grows with the hyperbolic cosine of the time.

    >>> t = np.linspace(0, 20, 41)
    >>> q, v = np.cosh(t)[None], np.sinh(t)[None]
    >>> flow, rounds = flows(lambda t, q, v: q, np.ones(1), t, q, v, q)
    >>> off, _ = grown(flow, np.diff(t), rounds, ways_of(np.diff(t), q, v), at_start(q[:, 0], v[:, 0]))
    >>> bool(0.5 < off[0, -1] / (EPS * np.cosh(20)) < 200)
    True
    """
    k, shape = len(rounds), (ways.shape[1] + 1, *ways.shape[2:])
    unit = np.broadcast_to(np.eye(k).reshape(k, k, *[1] * len(shape)), (k, k, *shape))
    # what is off in an acceleration moves the inputs within the step too
    inside = 0.0 * h if stiff else h
    stirred, each = _diagonal(np.concatenate([inside * rounds, rounds]) ** 2), _diagonal(ways)
    sums = each[k : 2 * k, 2 * k :] = each[2 * k :, 2 * k :]
    each[:k, 2 * k :] = 0.5 * inside * sums
    same = each[: 2 * k]
    if stiff:
        # as far as what pulls it back lets it
        stirred, same = _moved(flow, stirred), _times(flow, same)
    if local is not None:
        stirred += np.einsum("i...,j...->ij...", local, local)
    with np.errstate(all="ignore"):
        return _along(flow, stirred, SAME * EPS * same, start, unit if seen is None else seen)


def differences(flow: Reals, apart: Reals) -> Reals:
    """By how much two ways part over each step, (m, n − 1, …), less what their distance before has become; they lie `apart` (m, n, …) at its ends."""
    return np.asarray(apart[:, 1:] - np.einsum("ij...,j...->i...", flow, apart[:, :-1]))


def ways_of(h: Reals, q: Reals, v: Reals, sizes: Reals | float = 0.0) -> Reals:
    """By how much q and q̇ (k, n, …) change over steps of length h, and what loads of these sizes change q̇ by, (3k, n − 1, …).

    Sizes (k, n, …) are those of the accelerations that the loads bring about, each by itself: where they cancel, what they have
    rounded remains.
    """
    sums = h * np.broadcast_to(sizes, q.shape)[:, 1:]
    change = np.diff(v, axis=1)
    return np.concatenate([np.diff(q, axis=1), change, np.maximum(sums, STAGES * np.abs(change))])


def at_start(q: Reals, v: Reals) -> Rounded:
    """What has rounded at the start, for q and q̇ (k, …)."""
    spread = _diagonal(np.square(0.5 * EPS * np.concatenate([q, v])))
    return Rounded(spread, np.zeros((len(spread), 3 * len(q), *q.shape[1:])))


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
) -> tuple[Reals, Reals]:
    """The flows of small changes (q, q̇) along the motion over each step, (2k, 2k, n − 1, …), and what rounding of the arguments makes of the speeds over it, (k, n − 1, …).

    Parameters
    ----------
    f : Rates
    scale : array (k,) or (k, …)
        What errors of the inputs are relative to.
    t : array (n, …)
    q, v, a : array (k, n, …)
        The inputs, their speeds and accelerations.
    steady : bool
        Whether the accelerations depend on the inputs and their speeds alone, and not on the time.
    stiff : bool
        Whether what is off shrinks within a step by far: Padé's fraction of degrees 1 and 2 stands for the exponential.
    """
    h = np.diff(t, axis=0)
    early, late = (_inside(share, t, q, v, a) for share in GAUSS)
    # all accelerations in one request
    at = [np.concatenate(both, axis=both[0].ndim - h.ndim) for both in zip(early, late, strict=True)]
    matrices, stirred = _linear(f, scale, at[0], at[1], at[2])
    first, last = np.split(matrices, 2, axis=2)
    mean = 0.5 * h * (first + last)
    if stiff:
        flow = _fraction(mean)
    else:
        turning = math.sqrt(3) / 12 * h * h * (_times(last, first) - _times(first, last))
        flow = _exponential(mean + turning)
        if steady:
            with np.errstate(all="ignore"):
                flow = _along_itself(flow, np.concatenate([v, a]), h, scale)
    return flow, ROUNDINGS * EPS * h * np.maximum(*np.split(stirred, 2, axis=1))


def _inside(share: float, t: Reals, q: Reals, v: Reals, a: Reals) -> tuple[Reals, Reals, Reals]:
    """Times, inputs and speeds at a share of every step, by Hermite's polynomial of degree 5."""
    h = np.diff(t, axis=0)
    # a step of no length moves nothing, whatever stands inside
    h = np.where(h > 0, h, 1.0)
    ends = v[:, :-1], a[:, :-1], v[:, 1:], a[:, 1:]
    c = offsets(*ends[:2], h, np.diff(q, axis=1), *ends[2:])
    of = weights(np.array(share), DEGREE)
    place, speed = (np.tensordot(of, np.array(x), 1) for x in (c, speeds(*ends[:2], h, c, *ends[2:])))
    return np.asarray(t[:-1] + share * h), np.asarray(q[:, :-1] + place), speed


def _linear(f: Rates, scale: Reals, t: Reals, q: Reals, v: Reals) -> tuple[Reals, Reals]:
    """The matrix of the linear equation at states, (2k, 2k, m, …), and what rounding of these makes of the accelerations, (k, m, …)."""
    k = len(q)
    state = np.concatenate([q, v])
    by, moved = [BESIDE * scale[j % k] for j in range(2 * k)], np.stack([state] * (2 * k + 1), axis=1)
    for j in range(2 * k):
        moved[j, j + 1] += by[j]
    rates = f(np.concatenate([t] * (2 * k + 1)), *moved.reshape(2, k, -1, *state.shape[2:]))
    here, *others = rates.reshape(k, 2 * k + 1, *state.shape[1:]).swapaxes(0, 1)
    result = np.zeros((2 * k, *state.shape))
    for j, (there, apart) in enumerate(zip(others, by, strict=True)):
        # a place that cannot be assembled says nothing
        slope = (there - here) / apart
        result[k:, j] = np.where(np.isfinite(slope), slope, 0.0)
        if j >= k:
            result[j - k, j] = 1.0
    return result, np.einsum("ij...,j...->i...", np.abs(result[k:]), np.abs(state))


def _along_itself(flow: Reals, rates: Reals, h: Reals, scale: Reals) -> Reals:
    """The flows, changed least so that they take the rates (q̇, q̈) at each node to those at the next, as the true ones do."""
    unit = np.broadcast_to(scale[:, None], rates[: len(scale), 1:].shape)
    units = np.concatenate([unit, unit / np.where(h > 0, h, 1.0)])
    here = rates[:, :-1] / units
    square = np.square(here).sum(axis=0)
    off = differences(flow, rates)
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


def _along(flow: Reals, rounds: Reals, ways: Reals, start: Rounded, seen: Reals) -> tuple[Reals, Rounded]:
    """How far the inputs are off, (k, n, …), by P → Φ P Φᵀ + R and S → Φ S + D from the start on; both at the end.

    `seen` (k, k, n, …) are the derivatives of the inputs to the coordinates. Steps are taken side by side in as many runs as there
    are steps in each, from nothing; what each run begins with follows.
    """
    n, *lanes = flow.shape[2:]
    if not n:
        return _off(seen[:, :, 0], *(of[: len(seen)] for of in start))[:, None], start
    length = max(1, math.isqrt(n))
    runs = -(-n // length)
    rest = (0, runs * length - n), *[(0, 0)] * len(lanes)

    def parted(x: Reals, axes: int) -> Reals:
        return np.pad(x, (*[(0, 0)] * axes, *rest)).reshape(*x.shape[:axes], runs, length, *lanes)

    flow, rounds, ways, rows = parted(flow, 2), parted(rounds, 2), parted(ways, 2), parted(seen[:, :, 1:], 2)
    through, spread, same = [flow[:, :, :, 0]], [rounds[:, :, :, 0]], [ways[:, :, :, 0]]
    for i in range(1, length):
        step = flow[:, :, :, i]
        through.append(_times(step, through[-1]))
        spread.append(_moved(step, spread[-1]) + rounds[:, :, :, i])
        same.append(_times(step, same[-1]) + ways[:, :, :, i])
    begin = [start]
    for j in range(runs):
        phi, p, s = (of[-1][:, :, j] for of in (through, spread, same))
        begin.append(Rounded(_moved(phi, begin[-1].spread) + p, _times(phi, begin[-1].same) + s))
    begins, k = Rounded(*(np.stack(of, axis=2) for of in zip(*begin[:-1], strict=True))), len(seen)
    off = [_off(seen[:, :, 0], *(of[:k] for of in start))[:, None]]
    inside = []
    for row, phi, p, s in zip(np.moveaxis(rows, 3, 0), through, spread, same, strict=True):
        part = phi[:k]
        inside.append(_off(row, _moved(part, begins.spread) + p[:k, :k], _times(part, begins.same) + s[:k]))
    off.append(np.stack(inside, axis=2).reshape(k, runs * length, *lanes)[:, :n])
    run, i = divmod(n - 1, length)
    phi, p, s = (of[i][:, :, run] for of in (through, spread, same))
    last = Rounded(_moved(phi, begin[run].spread) + p, _times(phi, begin[run].same) + s)
    whole = np.concatenate(off, axis=1)
    # beyond all numbers it is infinite
    return np.where(np.isnan(whole), np.inf, whole), last


def _off(row: Reals, spread: Reals, same: Reals) -> Reals:
    """How far W of a state is off: the deviation of what rounds at random, and the sum of what is off the same way."""
    spread = spread[:, : len(spread)]
    variance = np.einsum("ij...,jk...,ik...->i...", row, spread, row)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)) + np.abs(_times(row, same)).sum(axis=1))


def _diagonal(x: Reals) -> Reals:
    out = np.zeros((len(x), *x.shape))
    out[range(len(x)), range(len(x))] = x
    return out


def _moved(flow: Reals, spread: Reals) -> Reals:
    """Φ P Φᵀ."""
    return np.asarray(np.einsum("ij...,kj...->ik...", _times(flow, spread), flow))
