"""Numbers that carry a bound of their own error: a formula worked out on them bounds its rounding.

Each operation passes on what the errors of its operands become and adds half an ε of its own result: the running
error analysis of J. H. Wilkinson (N. J. Higham, Accuracy and Stability of Numerical Algorithms, §3.3). It follows
cancellation where it happens.
"""

from __future__ import annotations

from collections.abc import Callable
from types import EllipsisType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import UNIT

Array = NDArray[np.float64]
Index = int | slice | EllipsisType | None


class Bounded:
    """Numbers (...) and bounds of their errors (...); numpy's functions of them are such numbers again.

    Examples
    --------
    >>> x = Bounded(1.0) / 3.0
    >>> bool(x.error == UNIT / 3)
    True
    >>> bool((x - 1 / 3).error > UNIT / 4)  # what is left of a difference is all error
    True
    """

    def __init__(self, value: ArrayLike, error: ArrayLike = 0.0) -> None:
        self.value = np.asarray(value, dtype=float)
        self.error = np.broadcast_to(np.asarray(error, dtype=float), self.value.shape)

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Bounded | ArrayLike, **_: object
    ) -> object:
        if method != "__call__" or ufunc not in _SPREAD:
            return NotImplemented
        return apply(ufunc, *inputs)

    def __add__(self, other: Bounded | ArrayLike) -> Bounded:
        return apply(np.add, self, other)

    def __radd__(self, other: ArrayLike) -> Bounded:
        return apply(np.add, other, self)

    def __sub__(self, other: Bounded | ArrayLike) -> Bounded:
        return apply(np.subtract, self, other)

    def __rsub__(self, other: ArrayLike) -> Bounded:
        return apply(np.subtract, other, self)

    def __mul__(self, other: Bounded | ArrayLike) -> Bounded:
        return apply(np.multiply, self, other)

    def __rmul__(self, other: ArrayLike) -> Bounded:
        return apply(np.multiply, other, self)

    def __truediv__(self, other: Bounded | ArrayLike) -> Bounded:
        return apply(np.divide, self, other)

    def __rtruediv__(self, other: ArrayLike) -> Bounded:
        return apply(np.divide, other, self)

    def __pow__(self, other: float) -> Bounded:
        return apply(np.power, self, other)

    def __neg__(self) -> Bounded:
        return apply(np.negative, self)

    def __abs__(self) -> Bounded:
        return apply(np.absolute, self)

    def __getitem__(self, index: Index | tuple[Index, ...]) -> Bounded:
        return Bounded(self.value[index], self.error[index])

    def sum(self, axis: int = -1) -> Bounded:
        """Return the sum along an axis, added up in whatever order."""
        rounded = UNIT * max(self.value.shape[axis] - 1, 0) * np.abs(self.value).sum(axis=axis)
        return Bounded(self.value.sum(axis=axis), self.error.sum(axis=axis) + rounded)

    def moved(self, move: Callable[[Array], Array]) -> Bounded:
        """Return what only puts the numbers in another order or place."""
        return Bounded(move(self.value), move(self.error))


def read(given: ArrayLike, relative: float) -> Bounded:
    """Return numbers that may be off by as much of themselves."""
    value = np.asarray(given, dtype=float)
    return Bounded(value, relative * np.abs(value))


def stack(parts: list[Bounded], axis: int = -1) -> Bounded:
    """Put numbers side by side along a new axis."""
    values, errors = (np.broadcast_arrays(*(getattr(x, name) for x in parts)) for name in ("value", "error"))
    return Bounded(np.stack(values, axis=axis), np.stack(errors, axis=axis))


def apply(ufunc: np.ufunc, *inputs: Bounded | ArrayLike) -> Bounded:
    """Return a function of numbers with errors: sums, products, quotients, powers, roots, sine, cosine, arctangent."""
    given = [x if isinstance(x, Bounded) else Bounded(x) for x in inputs]
    with np.errstate(all="ignore"):
        value = ufunc(*(x.value for x in given))
        return Bounded(value, _SPREAD[ufunc](value, *given) + UNIT * np.abs(value))


def _divide(v: Array, a: Bounded, b: Bounded) -> Array:
    size = np.abs(b.value)
    return np.asarray(np.where(b.error < size, (a.error + np.abs(v) * b.error) / (size - b.error), np.inf))


def _power(v: Array, a: Bounded, n: Bounded) -> Array:
    spread = (np.abs(a.value) + a.error) ** (n.value - 1) * a.error
    return np.asarray(np.abs(n.value) * (spread + UNIT * np.abs(v)))


def _sqrt(v: Array, a: Bounded) -> Array:
    return np.where(a.error < a.value, a.error / np.where(v > 0, v, 1.0), np.sqrt(a.error))


def _arctan2(v: Array, a: Bounded, b: Bounded) -> Array:
    square = np.where(v == v, a.value**2 + b.value**2, 1.0)
    turned = (np.abs(b.value) * a.error + np.abs(a.value) * b.error) / square
    return np.where((a.error > 0) | (b.error > 0), turned, 0.0) + UNIT * np.abs(v)


_SPREAD: dict[np.ufunc, Callable[..., Array]] = {
    np.add: lambda v, a, b: a.error + b.error,
    np.subtract: lambda v, a, b: a.error + b.error,
    np.multiply: lambda v, a, b: np.abs(a.value) * b.error + (np.abs(b.value) + b.error) * a.error,
    np.divide: _divide,
    np.power: _power,
    np.negative: lambda v, a: a.error,
    np.absolute: lambda v, a: a.error,
    np.sqrt: _sqrt,
    np.sin: lambda v, a: a.error + UNIT * np.abs(v),
    np.cos: lambda v, a: a.error + UNIT * np.abs(v),
    np.hypot: lambda v, a, b: a.error + b.error + UNIT * v,
    np.arctan2: _arctan2,
}
