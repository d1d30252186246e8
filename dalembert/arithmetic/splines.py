"""Cubic splines through the rows of a table, in numbers of 40 digits.

Second derivatives divide differences of neighbours by the square of their distance: of rows a hundredth of a second apart a
float keeps twelve digits of an acceleration. The decimals of a table are exact, and so is its spline.

A spline's second derivatives M at its rows solve a system of three diagonals (C. de Boor, A Practical Guide to Splines,
rev. ed., Springer 2001, ch. IV).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import Context, Decimal, localcontext
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dalembert.decimals import Factor

    Decimals = list[Decimal]

DIGITS = 40
# relative: four digits for the rounding of the terms themselves; decimals of 17 digits differ by more
ROUNDED = Decimal("1e-36")


def decimals(numbers: Iterable[str], factor: Factor = (1, 1)) -> Decimals:
    """Return numbers as they are written, times the factor of their unit, to 40 digits.

    >>> from math import pi
    >>> decimals(["0.1", "30"], (pi, 180))[1]
    Decimal('0.5235987755982988730771072305465838140329')
    """
    from dalembert.quantities import exactly

    with localcontext(Context(prec=DIGITS)):
        exact = exactly("1", factor)
        unit = Decimal(exact.numerator) / Decimal(exact.denominator)
        return [Decimal(number) * unit for number in numbers]


def sums(floats: Iterable[float], rests: Iterable[float]) -> Decimals:
    """Return floats and what they lack, together to 40 digits.

    >>> sums([0.1], [-5.551115123125783e-18])[0].normalize(Context(prec=30))
    Decimal('0.1')
    """
    with localcontext(Context(prec=DIGITS)):
        return [Decimal(high) + Decimal(low) for high, low in zip(floats, rests, strict=True)]


def periodic(x: Sequence[Decimal], y: Sequence[Decimal]) -> Decimals:
    """Return the second derivatives of the periodic spline at its rows.

    Parameters
    ----------
    x : sequence of Decimal, (n,)
        Rising, n ≥ 4; the last is a period after the first.
    y : sequence of Decimal, (n,)
        The last is the first.

    Returns
    -------
    list of Decimal, (n − 1,)
        Without the last, which is the first.
    """
    with localcontext(Context(prec=DIGITS)):
        n, h, slope = len(x) - 1, *_steps(x, y)
        # of the last row and the first, each in the other's corner: a system without corners, and one of rank one
        corner, diagonal = h[-1], [2 * (h[i - 1] + h[i]) for i in range(n)]
        split = -diagonal[0]
        diagonal[0] -= split
        diagonal[-1] -= corner * corner / split
        right = [6 * _sum(slope[i], -slope[i - 1]) for i in range(n)]
        bends = _solved(h, diagonal, h, right)
        ends = _solved(h, diagonal, h, [split, *(0 * x for x in h[2:]), corner])
        share = (bends[0] + corner * bends[-1] / split) / (1 + ends[0] + corner * ends[-1] / split)
        return [_sum(bend, -share * end) for bend, end in zip(bends, ends, strict=True)]


def rates(x: Sequence[Decimal], y: Sequence[Decimal]) -> tuple[Decimals, Decimals]:
    """Return the first and the second derivatives at its rows of the spline whose third is continuous at the second row and the last but one.

    Parameters
    ----------
    x, y : sequence of Decimal, (n,)
        n ≥ 4, x rising.

    Examples
    --------
    A cubic is its own spline.

    >>> x = [Decimal(i) for i in range(5)]
    >>> first, second = rates(x, [t**3 for t in x])
    >>> [float(t) for t in first], [float(t) for t in second]
    ([0.0, 3.0, 12.0, 27.0, 48.0], [0.0, 6.0, 12.0, 18.0, 24.0])
    """
    with localcontext(Context(prec=DIGITS)):
        h, slope = _steps(x, y)
        diagonal = [2 * (a + b) for a, b in pairwise(h)]
        above, below = h[1:-1], h[1:-1]
        right = [6 * _sum(b, -a) for a, b in pairwise(slope)]
        # M at both ends by the two next to it
        for at, beside, (end, following) in ((0, above, h[:2]), (-1, below, h[:-3:-1])):
            diagonal[at] += end + end * end / following
            beside[at] -= end * end / following
        inner = _solved(below, diagonal, above, right)
        first = _sum(inner[0], inner[0] * h[0] / h[1], -inner[1] * h[0] / h[1])
        last = _sum(inner[-1], inner[-1] * h[-1] / h[-2], -inner[-2] * h[-1] / h[-2])
        bends = [first, *inner, last]
        speeds = [
            _sum(s, -w * a / 3, -w * b / 6) for s, w, (a, b) in zip(slope, h, pairwise(bends), strict=True)
        ]
        return [*speeds, _sum(slope[-1], h[-1] * bends[-2] / 6, h[-1] * bends[-1] / 3)], bends


def _sum(*terms: Decimal) -> Decimal:
    """Add terms of 40 digits; a sum that is no more than their rounding is zero."""
    total, size = sum(terms, Decimal(0)), sum(map(abs, terms), Decimal(0))
    return total if abs(total) > ROUNDED * size else Decimal(0)


def _steps(x: Sequence[Decimal], y: Sequence[Decimal]) -> tuple[Decimals, Decimals]:
    """Return the steps from row to row, and the slopes of the chords."""
    h = [b - a for a, b in pairwise(x)]
    return h, [(b - a) / step for step, (a, b) in zip(h, pairwise(y), strict=True)]


def _solved(
    below: Sequence[Decimal], diagonal: Sequence[Decimal], above: Sequence[Decimal], right: Sequence[Decimal]
) -> Decimals:
    """Solve a system of three diagonals, of which that in the middle dominates."""
    pivots, values = [diagonal[0]], [right[0]]
    for i in range(1, len(diagonal)):
        share = below[i - 1] / pivots[-1]
        pivots.append(diagonal[i] - share * above[i - 1])
        values.append(_sum(right[i], -share * values[-1]))
    result = [values[-1] / pivots[-1]]
    for i in range(len(diagonal) - 2, -1, -1):
        result.append(_sum(values[i], -above[i] * result[-1]) / pivots[i])
    return result[::-1]
