"""Engines, flywheels and trial runs with many digits, by other ways than the product's."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import mpmath as mp


def piston_orders(ratio: Any, highest: int) -> list[Any]:
    """Return the orders of −s̈/(r ω²), by the trapezoidal rule over the differentiated position of the slider-crank."""
    points = 96 if ratio < 0.4 else 256
    turn = [2 * mp.pi * i / points for i in range(points)]
    values = []
    for phi in turn:
        s, c = mp.sin(phi), mp.cos(phi)
        root = mp.sqrt(1 / ratio**2 - s**2)
        values.append(c + (c**2 - s**2) / root + (s * c) ** 2 / root**3)
    # a half turn later the piston goes as it does now, but for the first order: the other odd ones vanish
    return [
        2 * mp.fsum(v * mp.cos(k * phi) for v, phi in zip(values, turn, strict=True)) / points
        if k == 1 or k % 2 == 0
        else mp.mpf(0)
        for k in range(1, highest + 1)
    ]


def shaking(cylinders: Sequence[Sequence[Any]], speed: Any, highest: int) -> list[list[list[Any]]]:
    """Return cos and sin of each order along x and y of the forces, and of the couples: (2, K, 4).

    Of cylinders (crank, bank in degrees, z, throw, rod, mass): each force lies along the bank's axis.
    """
    result = [[[mp.mpf(0)] * 4 for _ in range(highest)] for _ in range(2)]
    for crank, bank, z, throw, rod, mass in cylinders:
        axis = mp.cos(mp.radians(bank)), mp.sin(mp.radians(bank))
        ahead = mp.radians(crank - bank)
        for k, order in enumerate(piston_orders(throw / rod, highest), 1):
            size = mass * throw * speed**2 * order
            # cos k(θ + ahead)
            parts = size * mp.cos(k * ahead), -size * mp.sin(k * ahead)
            for arm, row in zip((1, z), result, strict=True):
                for i in range(4):
                    row[k - 1][i] += arm * axis[i // 2] * parts[i % 2]
    return result


def even_marks(low: Sequence[Any], high: Sequence[Any]) -> list[Any]:
    """Return even marks in intervals, as far from all their ends as can be, by trying all pairs of lines; else the middles."""
    n = len(low)
    middles = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
    if n < 3:
        return middles
    k = [mp.mpf(2 * i - n + 1) / 2 for i in range(n)]

    def room(slope: Any) -> tuple[Any, Any, Any]:
        first = max(a - slope * i for a, i in zip(low, k, strict=True))
        last = min(b - slope * i for b, i in zip(high, k, strict=True))
        return last - first, first, last

    # the room is bent where two lower ends, or two upper ones, bound it alike
    bends = [(e[j] - e[i]) / (k[j] - k[i]) for e in (low, high) for i in range(n) for j in range(i)]
    most = max(room(slope)[0] for slope in bends)
    # where one interval bounds it alone, the middle of where it does
    level = [slope for slope in bends if most - room(slope)[0] <= mp.mpf(10) ** -40 * most]
    best = (min(level) + max(level)) / 2
    width, first, last = room(best)
    return [(first + last) / 2 + best * i for i in k] if width > 0 else middles


def _lagrange(marks: Sequence[Any], among: Sequence[int], at: Any) -> Any:
    """Return the polynomial that is k at marks[k], for k `among` some."""
    return mp.fsum(
        k * mp.fprod((at - marks[j]) / (marks[k] - marks[j]) for j in among if j != k) for k in among
    )


def once_per_turn(
    t: Sequence[Any], x: Sequence[Any], marks: Sequence[Any], harmonics: int
) -> tuple[Any, Any]:
    """Return the mean over turns of the first order of a signal, and its standard deviation, by normal equations."""
    vectors = []
    for k, (start, end) in enumerate(pairwise(marks)):
        rows, right = [], []
        # turns by Lagrange's parabolas through the mark before and through the one after
        before = range(max(k - 1, 0), min(max(k - 1, 0) + 3, len(marks)))
        after = range(max(min(k, len(marks) - 3), 0), min(k, len(marks) - 3) + 3)
        for at, value in zip(t, x, strict=True):
            if start <= at < end:
                share = (at - start) / (end - start)
                turns = (1 - share) * _lagrange(marks, before, at) + share * _lagrange(marks, after, at)
                angle = 2 * mp.pi * turns
                orders = range(1, harmonics + 1)
                rows.append(
                    [mp.mpf(1), *(mp.cos(j * angle) for j in orders), *(mp.sin(j * angle) for j in orders)]
                )
                right.append(value)
        a, b = mp.matrix(rows), mp.matrix(right)
        c = mp.lu_solve(a.T * a, a.T * b)
        vectors.append(mp.mpc(c[1], -c[1 + harmonics]))
    mean = mp.fsum(vectors) / len(vectors)
    if len(vectors) < 2:
        return mean, None
    return mean, mp.sqrt(mp.fsum(abs(v - mean) ** 2 for v in vectors) / (len(vectors) - 1) / 2 / len(vectors))


def turning_moments(angle: Sequence[Any], torque: Sequence[Any]) -> dict[str, Any]:
    """Return mean, work, and the range of the energy of a torque between rows, by the areas between its zeros."""
    steps = [b - a for a, b in pairwise(angle)]
    work = mp.fsum((a + b) * h / 2 for a, b, h in zip(torque, torque[1:], steps, strict=False))
    mean = work / (angle[-1] - angle[0])
    energy, levels, at_rows = mp.mpf(0), [mp.mpf(0)], [mp.mpf(0)]
    for a, b, h in zip(torque, torque[1:], steps, strict=False):
        first, last = a - mean, b - mean
        if first * last < 0:
            # a triangle on either side of the zero
            levels.append(energy + first * h * first / (first - last) / 2)
        energy += (first + last) * h / 2
        levels.append(energy)
        at_rows.append(energy)
    at_rows[-1] = mp.mpf(0)
    return {"mean": mean, "work": work, "fluctuation": max(levels) - min(levels), "energy": at_rows}
