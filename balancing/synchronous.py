"""The vibration at once per turn, out of a signal and a mark on the shaft."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

HARMONICS = 3
"""So many orders are fitted beside one another, where a turn has samples enough."""


@record
class OncePerTurn(NamedTuple):
    """V of V e^{iωt}, t = 0 at the mark, and the turns it is the mean of."""

    vector: Complex
    """Mean over the turns, complex (s,)."""
    deviation: Real
    """Standard deviation of each component of the mean as the turns scatter, (s,); NaN with one turn."""
    speed: float
    """Mean speed, rad/s."""
    speed_deviation: float
    """Standard deviation of the speeds of single turns, rad/s; NaN with one turn."""
    turns: int
    phase_resolution: float = 0.0
    """By how much the phases may be off, either way, as samples tell the edge of a mark of two levels, rad."""


class Marks(NamedTuple):
    """When a mark rises."""

    at: Real
    """(n,), s."""
    resolution: float
    """By how much all of them together may be earlier or later, s."""


def marks(t: ArrayLike, mark: ArrayLike) -> Marks:
    """Find the times at which a mark rises through half its height.

    A mark of two levels rises somewhere between its last low sample and its first high one: in the middle, half an interval
    either way. Where the marks come as evenly as the samples can tell they are taken as even, in the middle of what all of
    them allow. Any other mark rises between two samples by linear interpolation.

    >>> marks([0, 1, 2, 3], [0, 0, 1, 0]), marks([0, 1, 2, 3], [0, 0, 3, 4])
    (Marks(at=array([1.5]), resolution=0.5), Marks(at=array([1.66666667]), resolution=0.0))
    """
    time, level = np.asarray(t, dtype=float), np.asarray(mark, dtype=float)
    low, high = float(level.min()), float(level.max())
    half = (low + high) / 2
    rises = np.flatnonzero((level[:-1] < half) & (level[1:] >= half))
    if ((level == low) | (level == high)).all():
        rises = rises + 1
        falls = np.flatnonzero((level[:-1] >= half) & (level[1:] < half)) + 1
        whole = rises[rises < falls[-1:].max(initial=0)]
        pulses = falls[np.searchsorted(falls, whole, side="right")] - whole
        if level[0] >= half and len(pulses) and falls[0] >= pulses.min():
            # the recording begins with a whole pulse
            rises = np.concatenate([[0], rises])
        step = np.diff(time, prepend=2 * time[0] - time[1])
        return _even(time[rises] - step[rises], time[rises])
    share = (half - level[rises]) / (level[rises + 1] - level[rises])
    return Marks(np.asarray(time[rises] + share * (time[rises + 1] - time[rises])), 0.0)


def _even(low: Real, high: Real) -> Marks:
    """Return marks that each lie in an interval as even ones, where they can be."""
    middle = (low + high) / 2
    each = Marks(middle, float(np.max(high - low, initial=0.0)) / 2)
    if len(middle) < 3:
        return each
    k = np.arange(len(middle)) - (len(middle) - 1) / 2

    def room(slope: float) -> tuple[float, float]:
        return float((low - slope * k).max()), float((high - slope * k).min())

    # the distance from mark to mark that leaves most room: concave, so that thirds of its range close in on it
    slope, apart = float(k @ middle / (k @ k)), each.resolution / len(k)
    least, most = slope - 4 * apart, slope + 4 * apart
    for _ in range(80):
        one, other = least + (most - least) / 3, most - (most - least) / 3
        (a, b), (c, d) = room(one), room(other)
        least, most = (one, most) if b - a < d - c else (least, other)
    slope = (least + most) / 2
    first, last = room(slope)
    return Marks(np.asarray((first + last) / 2 + slope * k), (last - first) / 2) if first < last else each


def once_per_turn(
    t: ArrayLike, signal: ArrayLike, mark: ArrayLike, pulses: int = 1, tacho: ArrayLike | None = None
) -> OncePerTurn:
    """Find the once-per-turn vectors of signals, turn by turn between marks, and their mean.

    Parameters
    ----------
    t
        Times, rising, (n,), s.
    signal
        Vibration, (n, s).
    mark
        Any unit, (n,): it rises `pulses` times in a turn.
    pulses
        With several pulses in a turn, evenly spaced, t = 0 is the first one of the recording: which it is of the shaft's
        nobody can tell.
    tacho
        A second signal with several pulses in a turn, (n,), beside a mark that comes once: it tells the angle, and the mark
        where it is zero.

    Raises
    ------
    ValueError
        Times that do not rise, not finite, fewer pulses than one turn has, turns with other numbers of pulses, or fewer than
        four samples in a turn.

    Notes
    -----
    The angle grows evenly from pulse to pulse. In each turn the signal is fitted by a constant and up to three orders of
    cos and sin of that angle (least squares), so that neither the sampling nor other orders leak into the first;
    the mean over turns is the synchronous average of the first order.

    Examples
    --------
    >>> t = np.arange(0, 1, 0.001) + 0.0005
    >>> found = once_per_turn(t, 3 * np.cos(2 * np.pi * 20 * t + 0.5)[:, None], np.arange(1000) % 50 == 0)
    >>> np.abs(found.vector).round(9), np.angle(found.vector).round(9), round(found.speed / np.pi, 9), found.turns
    (array([3.]), array([0.5]), 40.0, 19)
    >>> round(float(np.degrees(found.phase_resolution)), 9)  # half a sample of 7.2 degrees
    3.6
    """
    time, x = np.asarray(t, dtype=float), np.asarray(signal, dtype=float)
    level = np.asarray(mark, dtype=float)
    if time.ndim != 1 or x.ndim != 2 or x.shape[0] != len(time) or level.shape != time.shape or len(time) < 2:
        raise ValueError(f"shapes do not fit: t {time.shape}, signal {x.shape}, mark {level.shape}")
    if not (np.isfinite(time).all() and np.isfinite(x).all() and np.isfinite(level).all()):
        raise ValueError("times, signal and mark must be finite")
    if not (np.diff(time) > 0).all():
        raise ValueError("the times must rise from row to row")
    if pulses < 1:
        raise ValueError(f"{pulses} pulses in a turn: expected one at least")
    knots, resolution = marks(time, level)
    if len(knots) < pulses + 1:
        expected = (
            "two at least, a turn apart" if pulses == 1 else f"{pulses + 1} at least, a turn of {pulses}"
        )
        raise ValueError(f"the mark rises {len(knots)} time{'s' * (len(knots) != 1)}: expected {expected}")
    at = knots[::pulses]
    if tacho is not None:
        if pulses != 1:
            raise ValueError("the pulses of a turn are counted from mark to mark, beside a tacho")
        knots, at, pulses = _counted(time, np.asarray(tacho, dtype=float), at)
    angle = np.asarray(2 * np.pi / pulses * np.arange(len(knots)), dtype=float)
    each = np.diff(at)
    vectors = np.array([_turn(time, x, start, end, knots, angle) for start, end in pairwise(at.tolist())])
    turns = len(each)
    mean = vectors.mean(axis=0)
    deviation, of_speed = np.full(mean.shape, np.nan), np.nan
    if turns > 1:
        scatter = np.square(np.abs(vectors - mean)).sum(axis=0) / (turns - 1)
        deviation = np.sqrt(scatter / 2 / turns)
        of_speed = float(np.std(2 * np.pi / each, ddof=1))
    speed = float(2 * np.pi * turns / (at[-1] - at[0]))
    return OncePerTurn(mean, deviation, speed, of_speed, turns, speed * resolution)


def _counted(time: Real, tacho: Real, at: Real) -> tuple[Real, Real, int]:
    """Return the times of a tacho's pulses, the marks between the first and the last of them, and how many a turn has."""
    if tacho.shape != time.shape or not np.isfinite(tacho).all():
        raise ValueError("the tacho must be finite, a value for each time")
    knots = marks(time, tacho).at
    if len(knots) < 2:
        raise ValueError(f"the tacho rises {len(knots)} times: expected several pulses in each turn")
    at = at[(at >= knots[0]) & (at <= knots[-1])]
    if len(at) < 2:
        raise ValueError("the tacho has no whole turn from mark to mark")
    # pulses and marks may coincide: between marks their whole number is told by the mean
    passed = np.interp(at, knots, np.arange(len(knots)))
    pulses = round(float(passed[-1] - passed[0]) / (len(at) - 1))
    odd = np.flatnonzero(np.abs(np.diff(passed) - pulses) > 0.5)
    if pulses < 1 or len(odd):
        k = int(odd[0]) if len(odd) else 0
        period = float(passed[k + 1] - passed[k])
        raise ValueError(
            f"the turn at {at[k]:g} s has {period:.3g} pulses of the tacho: expected {max(pulses, 1)}, as others"
        )
    return knots, at, pulses


def _turn(t: Real, x: Real, start: float, end: float, knots: Real, angles: Real) -> Complex:
    """Return the first order of one turn, (s,), the angles known at some times."""
    first, last = np.searchsorted(t, [start, end])
    samples = int(last - first)
    if samples < 4:
        raise ValueError(f"the turn at {start:g} s has {samples} samples: expected four at least")
    angle = np.interp(t[first:last], knots, angles) - np.interp(start, knots, angles)
    orders = np.arange(1, min(HARMONICS, (samples - 1) // 2) + 1)
    grown = angle[:, None] * orders
    rows = np.concatenate([np.ones((samples, 1)), np.cos(grown), np.sin(grown)], axis=1)
    q, r = np.linalg.qr(rows)
    coefficients = np.linalg.solve(r, q.T @ x[first:last])
    return np.asarray(coefficients[1] - 1j * coefficients[1 + len(orders)])
