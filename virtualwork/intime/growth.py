"""How far the motion itself carries the rounding of its steps apart.

What rounds in one step is a small change of the state (q, q̇), which the motion makes grow or shrink as the linear equation
along it says, δ̈ = ∂a/∂q δ + ∂a/∂q̇ δ̇: about an upper rest e times in every √(l/g). Two solutions do not tell how far: both have
rounded, each in its own way, and what they differ by is one sample. So the variance of the state goes along the motion,
P → Φ P Φᵀ + R in every step, with Φ the flow of the equation and R what rounds (A. H. Jazwinski, Stochastic Processes and
Filtering Theory, 1970, §4.2). Φ is the exponential of Magnus's exponent of order 4, from Gauss's two nodes of the step
(S. Blanes et al., Physics Reports 470 (2009) 151, eq. 254). Where nothing depends on the time, the rates (q̇, q̈) are themselves a
solution of it, and Φ is made to take them along: else what it is off by grows anew at every upper rest.

Matrices stand with their rows and columns first, (2k, 2k, n, …), so that products are done for all steps at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.passing import DEGREE, offsets, speeds, weights

# halvings of a step for its exponential, and terms of the series
HALVINGS, TERMS = 2, 5
# Gauss's two nodes of a step
GAUSS = 0.5 - math.sqrt(3) / 6, 0.5 + math.sqrt(3) / 6
# of the arguments of the accelerations in a stage
ROUNDINGS = 3.0
# how far from a state accelerations are looked at for their slopes, as a share of what errors of the inputs are relative to
BESIDE = 2.0**-24
Rates = Callable[[Reals, Reals, Reals], Reals]
"""The accelerations (k, m, …) at states: times (m, …), inputs and speeds (k, m, …)."""


def grown(
    f: Rates,
    scale: Reals,
    t: Reals,
    q: Reals,
    v: Reals,
    a: Reals,
    noise: Reals | float = 0.0,
    steady: bool = True,
    start: Reals | None = None,
    seen: Reals | None = None,
) -> tuple[Reals, Reals]:
    """The standard deviation of the inputs at the nodes of a way, (k, n, …), as rounding in all steps before leaves it.

    And the covariance of the state (q, q̇) at the last node, (2k, 2k, …). Beyond the `scale` the equation is not linear: two
    solutions lie as far apart as they can.

    Parameters
    ----------
    f : Rates
    scale : array (k,) or (k, …)
        What errors of the inputs are relative to.
    t : array (n, …)
    q, v, a : array (k, n, …)
        The inputs, their speeds and accelerations.
    noise : array (k, n − 1, …), optional
        What rounding of the accelerations makes of the speeds over each step, in addition to that of their arguments.
    steady : bool
        Whether the accelerations depend on the inputs and their speeds alone, and not on the time.
    start : array (2k, 2k, …), optional
        The covariance of the state at the first node, in addition to its rounding there.
    seen : array (k, k, n, …), optional
        Where the way has other coordinates: the derivatives of the inputs to these.

    Examples
    --------
    q̈ = q: a rounding of the start grows with the hyperbolic cosine of the time.

    >>> t = np.linspace(0, 20, 41)
    >>> q, v = np.cosh(t)[None], np.sinh(t)[None]
    >>> size = grown(lambda t, q, v: q, np.ones(1), t, q, v, q)[0][0, -1] / (EPS * np.cosh(20))
    >>> bool(0.5 < size < 20)
    True
    """
    k, h = len(q), np.diff(t, axis=0)
    early, late = (_inside(share, t, q, v, a) for share in GAUSS)
    # all accelerations in one request
    at = [np.concatenate(both, axis=both[0].ndim - h.ndim) for both in zip(early, late, strict=True)]
    matrices, stirred = _linear(f, scale, at[0], at[1], at[2])
    first, last = np.split(matrices, 2, axis=2)
    rounds = np.hypot(noise, ROUNDINGS * EPS * h * np.maximum(*np.split(stirred, 2, axis=1)))
    turning = math.sqrt(3) / 12 * h * h * (_times(last, first) - _times(first, last))
    flow = _exponential(0.5 * h * (first + last) + turning)
    begin = _diagonal(np.square(0.5 * EPS * np.concatenate([q[:, 0], v[:, 0]])))
    if start is not None:
        begin = begin + start
    with np.errstate(all="ignore"):
        if steady:
            flow = _along_itself(flow, np.concatenate([v, a]), h, scale)
        unit = np.broadcast_to(np.eye(k).reshape(k, k, *[1] * t.ndim), (k, k, *t.shape))
        seen = unit if seen is None else seen
        variances, last = _along(flow, np.concatenate([0.0 * rounds, rounds]) ** 2, begin, seen)
    return np.sqrt(variances), last


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


def _along(flow: Reals, rounds: Reals, start: Reals, seen: Reals) -> tuple[Reals, Reals]:
    """The variances of the inputs (k, n, …) by P → Φ P Φᵀ + R from the start (m, m, …) on, of the flows (m, m, n − 1, …); P at the end.

    `seen` (k, k, n, …) are the derivatives of the inputs to the coordinates. Steps are taken side by side in as many runs as there
    are steps in each, from nothing; what each run begins with follows.
    """
    n, *lanes = flow.shape[2:]
    length = max(1, math.isqrt(n))
    runs = -(-n // length)
    rest = (0, runs * length - n), *[(0, 0)] * len(lanes)

    def parted(x: Reals, axes: int) -> Reals:
        return np.pad(x, (*[(0, 0)] * axes, *rest)).reshape(*x.shape[:axes], runs, length, *lanes)

    flow, rounds, rows = parted(flow, 2), parted(rounds, 1), parted(seen[:, :, 1:], 2)
    through, spread = [flow[:, :, :, 0]], [_diagonal(rounds[:, :, 0])]
    for i in range(1, length):
        through.append(_times(flow[:, :, :, i], through[-1]))
        spread.append(_moved(flow[:, :, :, i], spread[-1]) + _diagonal(rounds[:, :, i]))
    begin = [start]
    for j in range(runs - 1):
        begin.append(_moved(through[-1][:, :, j], begin[-1]) + spread[-1][:, :, j])
    begins, k = np.stack(begin, axis=2), len(seen)
    variances = [_variances(seen[:, :, 0], start[:k, :k])[:, None]]
    inside = [
        _variances(_times(row, phi[:k]), begins) + _variances(row, p[:k, :k])
        for row, phi, p in zip(np.moveaxis(rows, 3, 0), through, spread, strict=True)
    ]
    variances.append(np.stack(inside, axis=2).reshape(k, runs * length, *lanes)[:, :n])
    run, i = divmod(n - 1, length)
    last = _moved(through[i][:, :, run], begin[run]) + spread[i][:, :, run]
    whole = np.concatenate(variances, axis=1)
    # beyond all numbers it is infinite
    return np.where(np.isnan(whole), np.inf, np.maximum(whole, 0.0)), last


def _variances(row: Reals, spread: Reals) -> Reals:
    """The diagonal of W P Wᵀ."""
    return np.asarray(np.einsum("ij...,jk...,ik...->i...", row, spread, row))


def _diagonal(x: Reals) -> Reals:
    out = np.zeros((len(x), *x.shape))
    out[range(len(x)), range(len(x))] = x
    return out


def _moved(flow: Reals, spread: Reals) -> Reals:
    """Φ P Φᵀ."""
    return np.asarray(np.einsum("ij...,kj...->ik...", _times(flow, spread), flow))
