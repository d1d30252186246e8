"""Corrections made of whole weights: from stock at given positions, with the least error, or of fixed mass at any angle."""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.placement import Placement, checked_positions
from dalembert.arithmetic.shapes import in_32_digits, is_doubled

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
ENOUGH = 0.01
"""Largest error of weights that come near enough, as a share of the correction."""
FEW = 3
"""Largest number of weights that `fewest_from_stock` uses."""
SUMS = 300_000
"""Largest number of sums that are searched for one half of the positions."""


def place_from_stock(
    target: complex,
    angles: ArrayLike,
    stock: ArrayLike,
    max_mass: ArrayLike | None = None,
    *,
    pieces: int = 1,
    max_pieces: int | None = None,
) -> Placement:
    """Choose weights from stock for given positions, with the least error of their sum.

    Parameters
    ----------
    target, angles, max_mass
        As for `place`.
    stock
        The weights there are, (k,), kg, as many of each as wanted.
    pieces
        How many may go on one position.
    max_pieces
        How many may be used altogether; None for any number.

    Returns
    -------
    Placement
        `.masses` (n,) sums of stock weights, of the least |error| there is, and among equals of the least total
        mass. Where there are too many choices to search (some 18 positions with three weights, some 60 with
        `max_pieces` 3) only the positions nearest to the target's direction are used, and `.bound` is 0.

    Raises
    ------
    ValueError
        No weights in stock, one that is not positive, or less than one piece for a position.

    Notes
    -----
    Exact, by meeting in the middle (Horowitz and Sahni, J. ACM 21 (1974) 277-292): all sums of one half of the
    positions, and for each the nearest complement among the sums of the other half, by a k-d tree.

    Examples
    --------
    >>> choice = place_from_stock(0.007, np.radians([0, 90, 180, 270]), [0.001, 0.002, 0.005], pieces=2)
    >>> choice.masses.round(3)
    array([0.007, 0.   , 0.   , 0.   ])
    """
    from scipy.spatial import KDTree

    theta, cap = checked_positions(angles, max_mass)
    weights = np.unique(np.asarray(stock, dtype=float))
    goal = complex(target)
    if not len(weights) or not (weights > 0).all() or not np.isfinite(weights).all():
        raise ValueError("expected the weights in stock, positive")
    if pieces < 1 or (max_pieces is not None and max_pieces < 0):
        raise ValueError("expected at least one piece a position")
    loads, counts = _loads(weights, pieces)
    away = np.abs(np.angle(np.exp(1j * theta) * np.conj(goal))) if goal else np.zeros(len(theta))
    room = _room(len(loads), len(theta), max_pieces)
    used = np.argsort(away, kind="stable")[:room]
    arms = np.exp(1j * theta)
    # every other one: both halves reach in all directions
    parts = used[0::2], used[1::2]
    halves = [_sums(arms[part], cap[part], loads, counts, max_pieces) for part in parts]
    (sa, ma, ca, xa), (sb, mb, cb, xb) = halves
    best: tuple[float, float, int, int] | None = None
    slack = 1e-12 * float(max(abs(goal), weights[-1]))
    # no further than weights are used at all: a limit may be any number
    for level in range(min(max_pieces, int(cb.max())) + 1) if max_pieces is not None else [None]:
        b = np.arange(len(sb)) if level is None else np.flatnonzero(cb == level)
        a = (
            np.arange(len(sa))
            if level is None or max_pieces is None
            else np.flatnonzero(ca <= max_pieces - level)
        )
        if not (len(a) and len(b)):
            continue
        # of sums that coincide the lightest
        grid = np.round(np.stack([sb[b].real, sb[b].imag]) / (slack * 100))
        order = np.lexsort((mb[b], grid[1], grid[0]))
        new = np.append(True, (np.diff(grid[:, order], axis=1) != 0).any(axis=0))
        b = b[order[new]]
        tree = KDTree(np.stack([sb[b].real, sb[b].imag], axis=1))
        wanted = goal - sa[a]
        distance, _ = tree.query(np.stack([wanted.real, wanted.imag], axis=1))
        least = float(distance.min())
        if best is not None and least > best[0] + slack:
            continue
        for i in np.flatnonzero(distance <= least * (1 + 1e-9) + slack)[:1000]:
            near = tree.query_ball_point([wanted[i].real, wanted[i].imag], least * (1 + 1e-9) + slack)
            for j in near:
                pair = (least, float(ma[a[i]] + mb[b[j]]), int(a[i]), int(b[j]))
                if best is None or pair[0] < best[0] - slack or pair[1] < best[1] - slack:
                    best = pair
    # no weight anywhere is always a choice
    assert best is not None
    masses = np.zeros(len(theta))
    for part, codes in ((parts[0], xa[best[2]]), (parts[1], xb[best[3]])):
        place, load = np.divmod(codes[codes > 0], len(loads))
        masses[part[len(part) - place]] = loads[load]
    return Placement(goal, theta, masses, best[0] if room >= len(theta) else 0.0)


class FewestWeights(NamedTuple):
    """The choice of the fewest weights from stock."""

    placed: Placement
    used: int
    """The number of weights."""
    tried: int
    """The largest number of weights that was tried; one more may leave a smaller error."""


def fewest_from_stock(
    target: complex,
    angles: ArrayLike,
    stock: ArrayLike,
    max_mass: ArrayLike | None = None,
    *,
    pieces: int = 1,
) -> FewestWeights:
    """Choose the fewest weights from stock that come within 1 % of a correction, at most three.

    Parameters
    ----------
    target, angles, stock, max_mass, pieces
        As of `place_from_stock`.

    Returns
    -------
    FewestWeights
        Where no choice comes within 1 %, the fewest weights of the least error.

    Examples
    --------
    >>> choice = fewest_from_stock(0.007, np.radians([0, 90, 180, 270]), [0.001, 0.002, 0.005], pieces=2)
    >>> choice.placed.masses.round(3).tolist(), choice.used, choice.tried
    ([0.007, 0.0, 0.0, 0.0], 2, 2)
    """

    def choose(most: int) -> Placement:
        return place_from_stock(target, angles, stock, max_mass, pieces=pieces, max_pieces=most)

    placed = [choose(0)]
    while abs(placed[-1].error) > ENOUGH * abs(target) and len(placed) <= FEW:
        placed.append(choose(len(placed)))
    # of those that do not come nearer the fewest
    least = abs(placed[-1].error) + 1e-12 * abs(target)
    used = next(k for k, one in enumerate(placed) if abs(one.error) <= least)
    return FewestWeights(placed[used], used, len(placed) - 1)


def _sums(
    arms: Complex, cap: Real, loads: Real, counts: NDArray[np.intp], most: int | None
) -> tuple[Complex, Real, NDArray[np.intp], NDArray[np.int32]]:
    """Return all sums of loads on positions with at most this number of pieces: sum, mass, pieces, places.

    What stands where is a row of codes, one for each position that bears a load: (positions from here on)·(number of loads) + load;
    then zeros. The sums are in the order of these codes.
    """
    n = len(arms)
    sums, mass, count = np.zeros(1, dtype=complex), np.zeros(1), np.zeros(1, dtype=np.intp)
    codes = np.zeros((1, n if most is None else min(most, n)), dtype=np.int32)
    occupied = np.zeros(1, dtype=np.intp)
    full = []
    for column in range(n if codes.shape[1] else 0):
        fit = np.flatnonzero(loads <= cap[column] * (1 + 1e-12))
        parent, load = np.repeat(np.arange(len(sums)), len(fit)), np.tile(fit, len(sums))
        if most is not None:
            few = count[parent] + counts[load] <= most
            parent, load = parent[few], load[few]
        sums, mass = sums[parent] + loads[load] * arms[column], mass[parent] + loads[load]
        count, codes, occupied = count[parent] + counts[load], codes[parent], occupied[parent]
        there = np.flatnonzero(load)
        codes[there, occupied[there]] = (n - column) * len(loads) + load[there]
        occupied[there] += 1
        if most is not None:
            # to these nothing can be added
            whole = count == most
            full.append((sums[whole], mass[whole], count[whole], codes[whole]))
            sums, mass, count, codes, occupied = (x[~whole] for x in (sums, mass, count, codes, occupied))
    if not full:
        return sums, mass, count, codes
    sums, mass, count, codes = (
        np.concatenate(each) for each in zip(*full, (sums, mass, count, codes), strict=True)
    )
    order = np.lexsort(codes.T[::-1])
    return sums[order], mass[order], count[order], codes[order]


def _room(loads: int, positions: int, max_pieces: int | None) -> int:
    """Return the number of positions for which all choices can be searched: half of them have at most SUMS."""
    if max_pieces is None:
        return max(2 * int(np.log(SUMS) / np.log(loads)), 2)
    half = 1
    while 2 * half < positions:
        many = sum(comb(half + 1, k) * (loads - 1) ** k for k in range(min(max_pieces, half + 1) + 1))
        if many > SUMS:
            break
        half += 1
    return 2 * half


def _loads(weights: Real, pieces: int) -> tuple[Real, NDArray[np.intp]]:
    """Return the masses of up to this number of pieces, ascending from 0, and the fewest pieces for each."""
    fewest = {"0": (0.0, 0)}
    for number in range(1, pieces + 1):
        for load in [load for load, count in fewest.values() if count == number - 1]:
            for weight in weights.tolist():
                # 1 + 1 + 1 and 1 + 2 weigh the same, whatever the last digit
                total = load + weight
                fewest.setdefault(f"{total:.12g}", (total, number))
        if len(fewest) > 2000:
            raise ValueError("too many combinations of weights: expected fewer pieces a position")
    loads, counts = zip(*sorted(fewest.values()), strict=True)
    return np.array(loads), np.array(counts, dtype=np.intp)


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
    angles, bound = _angles(float(np.angle(goal)) if goal else 0.0, masses, abs(goal), masses, abs(goal))
    return Placement(goal, angles, masses, bound)


def angles_again(placed: Placement, target: Vectors, weights: DoubledArray) -> Any:
    """Return the angles (n,) of `place_weights` in 32 digits, rad; NaN where the polygon is so flat that they are not reached."""
    length, exact = abs(placed.target), cast("Any", target)
    toward = np.arctan2(exact.imag, exact.real) if length else 0.0
    return _angles(toward, weights, np.abs(exact), placed.masses, length)[0]


def _angles(toward: Any, weights: Any, size: Any, masses: Real, length: float) -> tuple[Any, float]:
    """Return the angles (n,) of weights whose sum is of a size in a direction, and the least error.

    Of floats or of numbers in 32 digits; `masses` and `length`, the floats of weights and size, decide.
    """
    longest = int(masses.argmax())
    whole, rest = float(masses.sum()), float(np.delete(masses, longest).sum())
    nothing = 0.0 * weights
    if length >= whole:
        return toward + nothing, length - whole
    if length <= masses[longest] - rest:
        opposite = nothing + (np.arange(len(masses)) != longest)
        return toward + opposite * np.pi, float(masses[longest] - rest - length)
    sides = np.concatenate([weights, np.stack([size])])
    arcs = _arcs(sides, np.append(masses, length))[:-1]
    return toward + np.cumsum(arcs) - arcs / 2 - arcs.sum(axis=-1) / 2, 0.0


def _arcs(sides: Any, lengths: Real) -> Any:
    """Return the arcs of the sides of a polygon on a circle, rad; no side is as long as the others together.

    `lengths` are the floats of the sides.
    """
    longest = int(lengths.argmax())
    others = np.arange(len(lengths)) != longest

    def shares(sides: Any) -> tuple[Any, Any]:
        """The others as shares of the longest, and √(1 - share²)."""
        share = sides[others] / sides[longest]
        return share, np.sqrt((1 - share) * (1 + share))

    def halves(own: Any, share: Any, slope: Any) -> Any:
        """Half the arcs of the others, asin(share sin own), of half the arc of the longest: exact near a quarter turn too."""
        return np.arctan2(share * np.sin(own), np.hypot(np.cos(own), slope * np.sin(own)))

    decided, exact = shares(lengths), shares(sides)
    # with the longest side as the diameter the others take less than half a turn: the centre lies outside
    outside = float(halves(np.pi / 2, *decided).sum()) < np.pi / 2
    low, own = 0.0, np.pi / 2
    while low < (middle := (low + own) / 2) < own:
        whole = float(halves(middle, *decided).sum())
        beyond = middle > whole if outside else middle + whole > np.pi
        low, own = (low, middle) if beyond else (middle, own)
    if is_doubled(sides):
        own = _refined(own, lambda own: halves(own, *exact), outside)
    arcs = np.zeros_like(sides)
    arcs[others], arcs[longest] = 2 * halves(own, *exact), 2 * (np.pi - own if outside else own)
    return arcs


def _refined(start: float, halves: Callable[[Any], Any], outside: bool) -> Any:
    """Return half the arc of the longest side in 32 digits, by Newton's method; NaN where it does not converge."""
    own, last = in_32_digits(start), np.inf
    for _ in range(60):
        half = halves(own)
        miss = float(half.sum() + (-own if outside else own - np.pi))
        slope = float((np.tan(half.high) / np.tan(own.high)).sum())
        step = miss / (slope + (-1 if outside else 1))
        if abs(step) <= 1e-30 or (abs(step) >= last / 2 and last < 1e-22):
            return own
        if not abs(step) < last:
            break
        own, last = own - np.array(step), abs(step)
    return in_32_digits(np.nan)
