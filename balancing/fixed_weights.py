"""Weights of fixed mass that may stand at any angle, as in the groove of a wheel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.placement import Placement

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_vectors import Vectors

Real = NDArray[np.float64]


def place_weights(target: complex, weights: ArrayLike) -> Placement:
    """Find the angles of weights of fixed mass that together are a correction.

    Parameters
    ----------
    target
        The correction, complex kg.
    weights
        The weights, (n,), kg; all of them are used.

    Returns
    -------
    Placement
        `.angles` (n,), rad, in the order of the weights: two weights on either side of the correction, three equal ones
        one on it and two symmetric, more of them spread likewise. Where no angles reach the correction the error is the
        least there is (`.bound`): all weights on it, or the heaviest on it and the others opposite.

    Raises
    ------
    ValueError
        No weights, or one that is not positive.

    Notes
    -----
    Weights and correction are the sides of a closed polygon. There is one iff no side is longer than the others together,
    and then exactly one that lies on a circle (I. Pinelis, Cyclic polygons with given edge lengths, J. Geom. 82 (2005)
    156-171): of diameter d the side s takes an arc of 2 asin(s/d), and all arcs are a whole turn, or, where the centre
    lies outside, the arc of the longest side is that of the others. Equal weights have equal angles between them.

    Examples
    --------
    >>> np.degrees(place_weights(0.006, [0.004, 0.004]).angles).round(2)
    array([-41.41,  41.41])
    >>> np.degrees(place_weights(0.008, [0.004, 0.004, 0.004]).angles).round(2) + 0.0
    array([-60.,   0.,  60.])
    """
    masses = np.atleast_1d(np.asarray(weights, dtype=float))
    goal = complex(target)
    if masses.ndim != 1 or not len(masses) or not ((masses > 0) & np.isfinite(masses)).all():
        raise ValueError("expected weights, positive")
    if not np.isfinite(goal):
        raise ValueError("the target must be finite")
    size, longest = abs(goal), int(masses.argmax())
    whole, rest = float(masses.sum()), float(np.delete(masses, longest).sum())
    toward = float(np.angle(goal)) if goal else 0.0
    if size >= whole:
        return Placement(goal, np.full(len(masses), toward), masses, size - whole)
    if size <= masses[longest] - rest:
        angles = np.where(np.arange(len(masses)) == longest, toward, toward + np.pi)
        return Placement(goal, angles, masses, float(masses[longest] - rest - size))
    arcs = _arcs(np.append(masses, size))[:-1]
    return Placement(goal, toward + np.cumsum(arcs) - arcs / 2 - arcs.sum() / 2, masses)


def angles_again(placed: Placement, target: Vectors, weights: Doubled) -> Doubled:
    """Return the angles (n,) of `place_weights` in 32 digits, rad; NaN where the polygon is so flat that they are not reached."""
    from dalembert.arithmetic.doubled import PI, Doubled
    from dalembert.arithmetic.doubled_vectors import part, total

    size, masses = abs(placed.target), placed.masses
    toward = target[None].angle if size else Doubled(np.zeros(1))
    ones = np.ones(len(masses))
    longest = int(masses.argmax())
    whole, rest = float(masses.sum()), float(np.delete(masses, longest).sum())
    if size >= whole:
        return toward + 0.0 * ones
    if size <= masses[longest] - rest:
        opposite = np.where(np.arange(len(masses)) == longest, 0.0, 1.0)
        return toward + PI * opposite
    goal = target.size
    sides = Doubled(np.append(weights.high, goal.high), np.append(weights.low + 0 * ones, goal.low))
    arcs = _arcs_again(sides, _arcs(np.append(masses, size)))
    # the sum before each, exactly
    before = [Doubled(0.0)]
    for k in range(len(masses)):
        before.append(before[-1] + part(arcs, k))
    middles = [(before[k] + before[k + 1]) / 2.0 for k in range(len(masses))]
    half = total(part(arcs, slice(len(masses)))) / 2.0
    return toward + Doubled(np.array([x.high for x in middles]), np.array([x.low for x in middles])) - half


def _arcs_again(sides: Doubled, arcs: Real) -> Doubled:
    """Return the arcs in 32 digits, by Newton's method from those in 16; NaN where it does not converge."""
    from dalembert.arithmetic.doubled import PI, Doubled
    from dalembert.arithmetic.doubled_functions import DOUBLED
    from dalembert.arithmetic.doubled_vectors import part, total

    longest = int(sides.high.argmax())
    share = part(sides, np.delete(np.arange(len(arcs)), longest)) / part(sides, longest)
    square = (1.0 - share) * (share + 1.0)
    outside = float(np.arcsin(share.high).sum()) < np.pi / 2
    own = (PI if outside else Doubled(0.0)) + (-0.5 if outside else 0.5) * float(arcs[longest])
    last = np.inf
    for _ in range(60):
        sine, cosine = DOUBLED.sincos(own)
        rest = DOUBLED.sqrt(cosine * cosine + square * sine * sine)
        halves = DOUBLED.atan2(share * sine, rest)
        slope = float((share.high * cosine.high / rest.high).sum())
        miss = total(halves) + (-own if outside else own - PI)
        step = float(miss.value) / (slope + (-1 if outside else 1))
        if abs(step) <= 1e-30 or (abs(step) >= last / 2 and last < 1e-22):
            every = (PI - own if outside else own) * 2.0
            parts = ((halves.high * 2, every.high), (halves.low * 2, every.low))
            return Doubled(*(np.insert(of_others, longest, of_longest) for of_others, of_longest in parts))
        if not abs(step) < last:
            break
        own, last = own - step, abs(step)
    return Doubled(np.full(len(arcs), np.nan))


def _arcs(sides: Real) -> Real:
    """Return the arcs of the sides of a polygon on a circle, rad; no side is as long as the others together."""
    longest = int(sides.argmax())
    share = np.delete(sides, longest) / sides[longest]
    slope = np.sqrt((1 - share) * (1 + share))

    def halves(own: float) -> Real:
        """Half the arcs of the others, asin(share sin own), of half the arc of the longest: exact near a quarter turn too."""
        return np.asarray(np.arctan2(share * np.sin(own), np.hypot(np.cos(own), slope * np.sin(own))))

    # with the longest side as the diameter the others take less than half a turn: the centre lies outside
    outside = float(halves(np.pi / 2).sum()) < np.pi / 2
    low, high = 0.0, np.pi / 2
    while low < (middle := (low + high) / 2) < high:
        others = float(halves(middle).sum())
        beyond = middle > others if outside else middle + others > np.pi
        low, high = (low, middle) if beyond else (middle, high)
    return np.asarray(np.insert(2 * halves(high), longest, 2 * (np.pi - high if outside else high)))
