"""When a mark on the shaft passes: the times at which a signal of two levels, or a smooth one, rises through half its height."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dalembert.arithmetic.shapes import as_array, floats

FEWEST, MOST = 7, 255
"""Marks in a row that one cubic is fitted to."""


class Marks(NamedTuple):
    """When a mark rises."""

    at: Any
    """(n,), s."""
    low: Any
    """When it rises at the earliest, (n,), s: the last low sample."""
    high: Any
    """When it rises at the latest, (n,), s: the first high sample."""
    even: bool = False
    """Whether the distances from each to the next are alike."""

    def slack(self, place: float) -> Any:
        """Return by how much they may all be shifted at a place among them, to either side, s; the first one is at 0."""
        if not len(self.at):
            return 0.0
        if not self.even:
            apart = self.high - self.low
            return apart[apart.argmax()] / 2
        # other even marks lie elsewhere there
        last, k = len(self.at) - 1, np.arange(len(self.at)) - place
        line = self.at[0] + (self.at[-1] - self.at[0]) * (place / last)
        return max(line - _envelope(k, self.low), -_envelope(k, -self.high) - line, key=float)

    def resolution(self, middle: float, pulses: int) -> Any:
        """Return by how much they may shift the vectors of turns of so many marks, to either side, s; `middle`: that of all turns.

        The vector of a turn is shifted as its middle is. A distance that is wrong by δ shifts it by pulses/(4π) δ more, as the mean
        of (θ − π) sin²(θ + φ) over a turn is −sin(2φ)/4.
        """
        beside = pulses / (4 * np.pi)
        return max(self.slack(middle - beside), self.slack(middle + beside), key=float)


def marks(t: ArrayLike, mark: ArrayLike) -> Marks:
    """Find the times at which a mark rises through half its height.

    A mark of two levels, noise aside, rises somewhere between its last low sample and its first high one: in the middle, half
    an interval either way. Where the marks are even within the samples they are taken as even, in the middle of what all of
    them allow; where they lie on cubics within the samples, on these. Any other mark rises between two samples by linear
    interpolation, which a bend of the mark puts in doubt.

    >>> one, other = marks([0, 1, 2, 3], [0, 0, 1, 0]), marks([0, 1, 2, 3], [0, 0, 3, 4])
    >>> one.at, float(one.slack(0)), other.at.round(9), float(other.slack(0))
    (array([1.5]), 0.5, array([1.66666667]), 0.125)
    """
    time, level = as_array(t), as_array(mark)
    nearest = floats(level)
    low, high = level[nearest.argmin()], level[nearest.argmax()]
    half = (low + high) / 2
    # decisions are those of floats
    rises = np.flatnonzero((nearest[:-1] < float(half)) & (nearest[1:] >= float(half)))
    share = (nearest - float(low)) / (float(high - low) or 1.0)
    if ((share > 0.1) & (share < 0.9)).sum() <= 0.2 * len(rises):
        rises = rises + 1
        falls = np.flatnonzero((nearest[:-1] >= float(half)) & (nearest[1:] < float(half))) + 1
        whole = rises[rises < falls[-1:].max(initial=0)]
        lengths = falls[np.searchsorted(falls, whole, side="right")] - whole
        first = 1.0
        if nearest[0] >= float(half) and len(lengths) and falls[0] >= lengths.min():
            # the recording begins with a whole pulse; as short as any other, it may lack its first sample
            rises = np.concatenate([[0], rises])
            first += float(falls[0] == lengths.min())
        before = np.concatenate([time[:1] - (time[1:2] - time[:1]) * first, time[:-1]])
        return _even(before[rises], time[rises])
    # a line errs by up to an eighth of the second differences beside it
    last = len(level) - 1
    rise, long = level[rises + 1] - level[rises], time[rises + 1] - time[rises]
    before, after = level[np.maximum(rises - 1, 0)], level[np.minimum(rises + 2, last)]
    bend = np.maximum(abs(rise - level[rises] + before), abs(after - level[rises + 1] - rise))
    at, off = time[rises] + (half - level[rises]) / rise * long, np.minimum(bend / rise / 8, 0.5) * long
    return Marks(at, at - off, at + off)


def _even(low: Any, high: Any) -> Marks:
    """Return marks that each lie in an interval as even ones, where they can be."""
    middle = (low + high) / 2
    each = Marks(middle, low, high)
    if len(middle) < 3:
        return each
    k = np.arange(len(middle)) - (len(middle) - 1) / 2
    start, wide = float(k @ floats(middle) / (k @ k)), 4 * float(each.slack(0)) / len(k)
    slope = _roomiest(k, low, high, start - wide, start + wide)
    below, above = low - slope * k, high - slope * k
    first, last = below[below.argmax()], above[above.argmin()]
    if not first < last:
        return _on_cubics(each, slope * k)
    return Marks((first + last) / 2 + slope * k, low, high, even=True)


def _on_cubics(marks: Marks, line: Any) -> Marks:
    """Return marks where cubics through the middles of their intervals pass, if all pass these, rounding of samples aside.

    Each mark has a cubic of its own, through the most marks around it (A. Savitzky, M. J. E. Golay, Anal. Chem. 36 (1964)
    1627-1639). The cubics are fitted to the distances from a `line`.
    """
    n = len(line)
    wide, off = min(n, MOST), marks.at - line
    room = floats(marks.high - marks.low) / 2
    while wide >= FEWEST:
        q = np.linalg.qr(np.vander(np.linspace(-1, 1, wide), 4))[0]
        begin = np.clip(np.arange(n) - wide // 2, 0, n - wide)
        weights = (q @ q.T)[np.arange(n) - begin]
        fitted = (off[begin[:, None] + np.arange(wide)] * weights).sum(axis=-1)
        if (np.abs(floats(fitted - off)) <= 1.5 * room).all():
            return marks._replace(at=np.minimum(np.maximum(fitted + line, marks.low), marks.high))
        wide //= 2
    return marks


def _envelope(k: Any, y: Any) -> Any:
    """Return the height over k = 0 of the upper hull of points (k, y): no line above all of them passes lower."""
    height = floats(y)
    left, right = 0, len(k) - 1
    for _ in k:
        slope = (height[right] - height[left]) / (k[right] - k[left])
        top = int((height - slope * k).argmax())
        # a point above the line through two of them takes the place of the one on its side
        if top in (left, right) or not height[top] - slope * k[top] > height[left] - slope * k[left]:
            break
        left, right = (top, right) if k[top] <= 0 else (left, top)
    return (y[left] * k[right] - y[right] * k[left]) / (k[right] - k[left])


def _roomiest(k: Any, low: Any, high: Any, least: float, most: float) -> Any:
    """Return the distance from mark to mark, between two, that leaves most room: min (high − slope·k) − max (low − slope·k).

    It is concave, and linear between bends: the lines of both sides meet above it, and closer with each line there (J. E.
    Kelley, J. SIAM 8 (1960) 703-712).
    """

    def edges(slope: Any) -> tuple[int, int]:
        return int((low - slope * k).argmax()), int((high - slope * k).argmin())

    def room(ends: tuple[int, int], slope: Any) -> Any:
        i, j = ends
        return (high[j] - low[i]) - slope * (k[j] - k[i])

    def fall(ends: tuple[int, int]) -> float:
        return float(k[ends[1]] - k[ends[0]])

    zero = 0.0 * low[0]

    def meeting(a: tuple[int, int], b: tuple[int, int]) -> Any:
        return (room(a, zero) - room(b, zero)) / (fall(a) - fall(b))

    def bend(side: tuple[int, int], top: tuple[int, int]) -> Any:
        """Where the room stops to be that of a level line, on one side."""
        slope = meeting(side, top)
        for _ in k:
            here = edges(slope)
            if not room(side, slope) - room(here, slope) > 0 or not fall(here):
                break
            side, slope = here, meeting(here, top)
        return slope

    left, right = edges(least + zero), edges(most + zero)
    if fall(left) >= 0 or fall(right) <= 0:
        return (least if fall(left) >= 0 else most) + zero
    slope = zero
    for _ in range(4 * len(k)):
        slope = meeting(left, right)
        here = edges(slope)
        if not room(left, slope) - room(here, slope) > 0:
            break
        if not fall(here):
            # one interval bounds the room alone: the middle of where it does
            return (bend(left, here) + bend(right, here)) / 2
        if fall(here) < 0:
            left = here
        else:
            right = here
    return slope
