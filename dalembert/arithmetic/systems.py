"""Small linear systems of any kind of number, recorded ones above all: Householder's QR, which needs no pivoting.

Which row an elimination should take first depends on the numbers; a recorded elimination must do without looking at
them. Reflections are stable for any (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002,
§19.3), and what is exactly nothing costs nothing.
"""

from __future__ import annotations

from typing import Any

from dalembert.arithmetic.recorded import RECORDED, Number
from dalembert.arithmetic.tape import Kind


def _nothing(x: Number) -> bool:
    return isinstance(x, (int, float)) and x == 0


def solved(
    matrix: list[list[Number]], right: list[Number], kind: Kind = RECORDED, least: float = 0.0
) -> list[Number]:
    """Solve matrix·x = right; of more equations than unknowns, in the sense of least squares.

    Parameters
    ----------
    matrix : rows of real numbers, equations × unknowns
    right : real numbers, one for each equation
    kind : Kind
        The functions of these numbers.
    least : float
        The solution is NaN where a diagonal entry of R is below this share of the largest.

    Examples
    --------
    >>> [round(x, 15) for x in solved([[0.0, 2.0], [1.0, 1.0]], [4.0, 5.0])]
    [3.0, 2.0]
    """
    a = _reflected([[*row, b] for row, b in zip(matrix, right, strict=True)], kind)
    n = len(matrix[0])
    x: list[Number] = [0.0] * n
    for k in range(n - 1, -1, -1):
        rest = a[k][n]
        for j in range(k + 1, n):
            rest = rest - (0.0 if _nothing(a[k][j]) or _nothing(x[j]) else a[k][j] * x[j])
        x[k] = 0.0 if _nothing(rest) else rest / a[k][k]
    if not least:
        return x
    enough = kind.select(regularity(matrix, kind) - least, 1.0, float("nan"))
    return [value * enough for value in x]


def regularity(matrix: list[list[Number]], kind: Kind = RECORDED) -> Number:
    """The least diagonal entry of R over the largest, in size: about the least singular value over the largest.

    >>> regularity([[2.0, 0.0], [0.0, 1e-3]])
    0.0005
    """
    n = len(matrix[0])
    a = _reflected([[*row, 0.0] for row in matrix], kind)
    least = largest = abs(a[0][0])
    for k in range(1, n):
        size = abs(a[k][k])
        least, largest = kind.select(least - size, size, least), kind.select(size - largest, size, largest)
    return least / largest


def _reflected(a: list[list[Number]], kind: Kind) -> list[list[Number]]:
    """R and the right side, which is the last column."""
    n = len(a[0]) - 1
    for k in range(n):
        rows = [i for i in range(k + 1, len(a)) if not _nothing(a[i][k])]
        if not rows:
            continue
        top = a[k][k]
        size = kind.sqrt(sum((a[i][k] * a[i][k] for i in rows), top * top))
        sign = kind.select(top, 1.0, -1.0)
        mirror: dict[int, Any] = {k: top + sign * size} | {i: a[i][k] for i in rows}
        # |v|²/2 = size·(size + |top|)
        factor = 1.0 / (size * (size + abs(top)))
        a[k][k] = -(sign * size)
        for j in range(k + 1, n + 1):
            along: Number = 0.0
            for i, v in mirror.items():
                along = along + (0.0 if _nothing(a[i][j]) else v * a[i][j])
            if _nothing(along):
                continue
            along = along * factor
            for i, v in mirror.items():
                a[i][j] = a[i][j] - v * along
    return a
