"""Operations on doubled arrays that are made of others: comparisons, whole powers, running sums, products of matrices.

They ask of their arrays only what `DoubledArray` and numpy's functions give.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Step = Callable[[Any, Any], Any]


def compared(ufunc: Any) -> Callable[..., Any]:
    """A comparison, by the sign of the difference."""

    def work(a: Any, b: Any) -> Any:
        same = a.high == b.high
        return ufunc(np.where(same, a.low, a.high), np.where(same, b.low, b.high))

    return work


def chosen(a: Any, b: Any, first: Any) -> Any:
    """The numbers of a where `first` is true, else those of b."""
    return type(a)(np.where(first, a.high, b.high), np.where(first, a.low, b.low))


def power(x: Any, y: Any) -> Any:
    """Whole powers, by squares."""
    left = np.abs(y.high).astype(np.int64)
    result: Any = x * 0.0 + np.ones(np.shape(left))
    square = x
    while left.any():
        result = chosen(result * square, result, left % 2 > 0)
        square, left = square * square, left // 2
    return chosen(1.0 / result, result, y.high < 0) if (y.high < 0).any() else result


def running(step: Step, x: Any) -> Any:
    """The running sums or products along the first axis: of 1, 2, 4 … numbers before each."""
    apart = 1
    while apart < len(x):
        x = np.concatenate([x[:apart], step(x[apart:], x[:-apart])])
        apart *= 2
    return x


def product(a: Any, b: Any) -> Any:
    """The product of matrices and vectors."""
    rows, columns = (a[None, :] if a.ndim == 1 else a), (b[:, None] if b.ndim == 1 else b)
    result = (rows[..., :, :, None] * columns[..., None, :, :]).sum(axis=-2)
    if b.ndim == 1:
        result = result[..., 0]
    if a.ndim == 1:
        result = result[..., 0, :] if b.ndim > 1 else result[..., 0]
    return result


def cross(a: Any, b: Any) -> Any:
    """The vector product a × b, (..., 3)."""
    (x, y, z), (X, Y, Z) = ([v[..., i] for i in range(3)] for v in (a, b))
    return np.stack([y * Z - z * Y, z * X - x * Z, x * Y - y * X], axis=-1)
