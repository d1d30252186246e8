"""Through a change point: what is smooth in the input there, from both sides.

Where two branches of a loop cross its Jacobian vanishes, and close by its rates have few digits left. What the motion
depends on, M and h, is smooth along the branch, which is known on both sides: close to the point it is interpolated
between poses farther off, by Lagrange's polynomial in its barycentric form (J.-P. Berrut, L. N. Trefethen,
SIAM Review 46, 2004, eq. 4.2).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from operator import mul

from virtualwork.intime.watch import Floats

# rad, or of a slide's size: from how far off is interpolated at most; which share of it is left out
REACH, INNER = 0.6, 0.2
# on each side
NODES = 8
# of how far off as many others are tried, until one misses by no more than rounding does anyway
NARROWER, NARROWINGS, ENOUGH = 0.75, 12, 1e-12
# of the gap of poses farther off, what that of nearer ones must come to: a gap of truncation falls so, one of rounding
# does not, and the nearer the poses are the more of their digits are lost
BETTER = 0.1
# of how far off other poses are taken, to see how much depends on that; where on the inner part they are compared
OTHER = 0.85
WITHIN = (-0.9, -0.3, 0.3, 0.9)
# the gap of a pole is the same from all poses, and larger
SMOOTH = 1e-3


class Crossing:
    """A change point at an input, and the poses on both sides that stand for those close to it.

    Examples
    --------
    >>> import math
    >>> crossing = Crossing(0.0, 0.3)
    >>> values = [[math.sin(q) / q] for q in crossing.nodes]
    >>> abs(crossing.interpolated(values, 1e-4)[0] - (1 - 1e-8 / 6)) < 1e-15
    True
    """

    def __init__(self, at: float, reach: float) -> None:
        self.at, self.inner = at, INNER * reach
        # whether quantities are smooth there: at a pole nothing leads through
        self.smooth = True
        # how far it has been seen to miss each quantity
        self.missed: Floats = []
        # the quantities at the nodes, once they were computed
        self._values: list[Floats] = []
        # Chebyshev's points in the square of the distance: the extrapolation inwards makes least of what is rounded
        middle, half = 0.5 * (1 + INNER**2), 0.5 * (1 - INNER**2)
        turns = (math.pi * (i + 0.5) / NODES for i in range(NODES))
        steps = [math.sqrt(middle - half * math.cos(turn)) for turn in turns]
        places = [*(-x for x in reversed(steps)), *steps]
        self.nodes = [at + reach * x for x in places]
        self._weights = []
        for x in places:
            weight = 1.0
            for y in places:
                weight *= x - y if x != y else 1.0
            self._weights.append(1.0 / weight)

    def interpolated(self, values: Sequence[Floats], q: float) -> Floats:
        """Quantities at an input within `inner` of the point, from those at the nodes."""
        shares = [w / (q - x) for w, x in zip(self._weights, self.nodes, strict=True)]
        total = sum(shares)
        return [sum(map(mul, shares, of)) / total for of in zip(*values, strict=True)]

    def values(self, f: Callable[[float], Floats]) -> list[Floats]:
        """The quantities at the nodes."""
        self._values = self._values or [f(x) for x in self.nodes]
        return self._values

    def compare(self, f: Callable[[float], Floats], other: Crossing) -> None:
        """Note as `missed` too how far another crossing, from other poses, lies from this one within both of their inner parts.

        Two ends are few: rounding there may be small by chance.
        """
        mine, others = self.values(f), other.values(f)
        for share in WITHIN:
            q = self.at + share * min(self.inner, other.inner)
            pairs = zip(self.interpolated(mine, q), other.interpolated(others, q), strict=True)
            apart = (abs(x - y) for x, y in pairs)
            self.missed = [max(x, y if y == y else math.inf) for x, y in zip(self.missed, apart, strict=True)]

    def gaps(self, f: Callable[[float], Floats], least: Floats) -> Floats:
        """How far interpolation lies from each quantity at the ends of what it replaces, relative to its size; noted as `missed`.

        That is the largest at the nodes, or the `least` that it is relative to: what vanishes is rounding there. From
        poses too far off interpolation misses, for what is smooth here has an end (a limit, a fast turn) not far away;
        from poses too near they have lost their digits.
        """
        nodes, ends = self.values(f), (self.at - self.inner, self.at + self.inner)
        pairs = [(f(q), self.interpolated(nodes, q)) for q in ends]
        sizes = [
            max(map(abs, of)) for of in zip(least, *nodes, *(values for values, _ in pairs), strict=True)
        ]
        apart = [[abs(x - y) for x, y in zip(*pair, strict=True)] for pair in pairs]
        # NaN is the worst
        self.missed = [max(x if x == x else math.inf for x in of) for of in zip(*apart, strict=True)]
        return [x / size if size else 0.0 for x, size in zip(self.missed, sizes, strict=True)]


def narrowed(f: Callable[[float], Floats], at: float, widest: float, least: Floats) -> Crossing:
    """The crossing at an input whose poses know most of quantities close to it; from no farther off than `widest`.

    Gaps are relative to at least `least` of each quantity; where that is 0, what vanishes cannot be distinguished from rounding.
    """
    best, lowest, smooth = Crossing(at, widest), math.inf, False
    for j in range(NARROWINGS):
        result = Crossing(at, widest * NARROWER**j)
        gaps = result.gaps(f, least)
        smooth = smooth or all(gap < SMOOTH for gap, size in zip(gaps, least, strict=True) if size)
        if max(gaps) < BETTER * lowest:
            best, lowest = result, max(gaps)
        if lowest <= ENOUGH:
            break
    if smooth:
        best.compare(f, Crossing(at, OTHER * best.inner / INNER))
        return best
    # what is not smooth there is left as it is, but for the nearest poses
    result.smooth, result.missed = False, [0.0] * len(least)
    return result


def crossings(
    points: Iterable[float], unit: float, settled: Callable[[float, float], Crossing], share: float = 1.0
) -> list[Crossing]:
    """The crossings at change points, those within rounding of each other as one; `unit`: 1 rad, or a size.

    `settled` makes one at an input, with poses from no farther off than `widest`; `share` of how far off poses are taken as
    a rule: with others the interpolation errs in another way.
    """
    places: list[float] = []
    for at in sorted(points):
        if not places or at - places[-1] > 1e-6 * unit:
            places.append(at)
    crossings = []
    for i, at in enumerate(places):
        apart = [abs(at - other) for other in (*places[max(0, i - 1) : i], *places[i + 1 : i + 2])]
        widest = min([REACH * unit, *(0.6 * x for x in apart)])
        crossings.append(settled(at, share * widest))
    return crossings


def nearest(crossings: list[Crossing], q: float) -> Crossing | None:
    """The crossing next to an input; None where there is none."""
    if not crossings:
        return None
    i = bisect_left([c.at for c in crossings], q)
    return min(crossings[max(0, i - 1) : i + 1], key=lambda c: abs(c.at - q))
