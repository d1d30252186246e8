"""Operations on doubled arrays that are made of others: parts, sums, comparisons, whole powers, products of matrices.

Of `Doubled` numbers with arrays as their parts; from `compared` on they ask only what `DoubledArray` and numpy's functions give.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.doubled import Doubled, doubled, settled
from dalembert.arithmetic.doubled_functions import (
    DOUBLED,
    direction,
    exponential,
    hypot,
    logarithm,
    rint,
    root,
)

Real = NDArray[np.float64]
Step = Callable[[Any, Any], Any]

OWN = 1.01
"""What the second run itself may be off by, of the difference."""


def joined(parts: list[Doubled], axis: int) -> Doubled:
    """Doubled arrays behind each other along an axis."""
    return Doubled(
        np.concatenate([x.high for x in parts], axis),
        np.concatenate([x.low + 0.0 * x.high for x in parts], axis),
    )


def part(x: Doubled, index: Any) -> Doubled:
    """Entries of a doubled array."""
    return Doubled(x.high[index], x.low[index] if np.ndim(x.low) else x.low)


def total(x: Doubled, axis: int | tuple[int, ...] = -1) -> Doubled:
    """The sum of a doubled array along an axis, or axes counted from the last one, in pairs."""
    if isinstance(axis, tuple):
        return reduce(total, sorted(axis), x)
    shape = x.high.shape
    before: tuple[Any, ...] = (slice(None),) * (axis % len(shape))
    if not (many := shape[axis]):
        nothing = np.zeros(np.delete(shape, axis))
        return Doubled(nothing, nothing)
    while many > 1:
        half = many // 2
        pairs = part(x, (*before, slice(half))) + part(x, (*before, slice(half, 2 * half)))
        x = joined([pairs, part(x, (*before, slice(2 * half, many)))], axis) if many % 2 else pairs
        many -= half
    x = part(x, (*before, 0))
    return settled(x.high, x.low)


def doubled_array(exact: Iterable[Fraction], shape: tuple[int, ...]) -> Doubled:
    """Exact numbers as a doubled array of this shape."""
    numbers = [Doubled.of(x) for x in exact]
    high, low = np.array([x.high for x in numbers]), np.array([x.low for x in numbers])
    return Doubled(high.reshape(shape), low.reshape(shape))


def off(value: ArrayLike, exact: Doubled, turn: float | Doubled = 0.0) -> Real:
    """Return by how much floats differ from doubled numbers; of angles by what but whole turns."""
    difference = exact - np.asarray(value, dtype=float)
    whole = doubled(turn)
    if whole.high:
        difference = difference - Doubled(np.rint(difference.high / whole.high)) * whole
    return np.asarray(OWN * np.abs(difference.value))


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


def _of(function: Callable[..., Doubled]) -> Callable[..., Any]:
    """A function of doubled numbers, of arrays of them."""

    def work(*x: Any) -> Any:
        with np.errstate(all="ignore"):
            return type(x[0]).of(function(*(Doubled(each.high, each.low) for each in x)))

    return work


UFUNCS: dict[Any, Callable[..., Any]] = {
    np.add: _of(lambda a, b: a + b),
    np.subtract: _of(lambda a, b: a - b),
    np.multiply: _of(lambda a, b: a * b),
    np.true_divide: _of(lambda a, b: a / b),
    np.negative: lambda x: type(x)(-x.high, -x.low),
    np.absolute: _of(abs),
    np.square: _of(lambda x: x * x),
    np.power: power,
    np.sqrt: _of(root),
    np.hypot: _of(hypot),
    np.sin: _of(DOUBLED.sin),
    np.cos: _of(DOUBLED.cos),
    np.arctan2: _of(direction),
    np.arctan: _of(lambda x: direction(x, Doubled(1.0 + 0.0 * x.high))),
    np.copysign: lambda x, y: chosen(x, -x, np.signbit(x.high) == np.signbit(y.high)),
    np.minimum: lambda a, b: chosen(a, b, a < b),
    np.maximum: lambda a, b: chosen(a, b, a > b),
    np.exp: _of(exponential),
    np.log: _of(logarithm),
    np.arcsinh: lambda x: np.copysign(np.log(np.abs(x) + np.sqrt(x * x + 1.0)), x),
    np.cosh: lambda x: (np.exp(x) + np.exp(-x)) / 2.0,
    np.tanh: lambda x: np.copysign(1.0 - 2.0 / (np.exp(np.abs(x) * 2.0) + 1.0), x),
    np.degrees: lambda x: x * 180.0 / math.pi,
    np.rint: _of(rint),
    np.fmod: lambda x, y: x - y * np.trunc((x / y).value),
    # of whole numbers
    np.remainder: lambda x, y: type(x)(np.remainder(x.high, y.high)),
    np.isfinite: lambda x: np.isfinite(x.high),
    np.isinf: lambda x: np.isinf(x.high),
    np.isnan: lambda x: np.isnan(x.high),
    np.matmul: product,
    **{
        each: compared(each)
        for each in (np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal)
    },
}

LAYOUT = {
    np.stack,
    np.concatenate,
    np.moveaxis,
    np.swapaxes,
    np.broadcast_to,
    np.broadcast_arrays,
    np.take_along_axis,
    np.where,
    np.diagonal,
    np.expand_dims,
    np.atleast_1d,
    np.choose,
}

PLACES: dict[Any, Iterable[int]] = {
    np.where: (1, 2),
    np.choose: (1,),
    np.broadcast_arrays: range(99),
}

FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.cross: cross,
    np.sum: lambda x, axis=-1, **_: x.sum(axis),
    np.diff: lambda x: x[1:] - x[:-1],
    np.cumsum: lambda x: running(lambda a, b: a + b, x),
    np.cumprod: lambda x: running(lambda a, b: a * b, x),
    np.linalg.norm: lambda x, axis: np.sqrt((x.real * x.real + x.imag * x.imag).sum(axis)),
    np.shape: lambda x: x.shape,
    np.ndim: lambda x: x.ndim,
}


def contracted(subscripts: str, a: Any, b: Any) -> Any:
    """The sum of products of the entries of two arrays as `np.einsum` writes it, their first axes being alike: "...ij,...jk->...k"."""
    names, result = subscripts.replace("...", "").split("->")
    each = names.split(",")
    order = result + "".join(sorted({*names} - {*result, ","}))
    parts = []
    for x, own in zip((a, b), each, strict=True):
        here = [name for name in order if name in own]
        x = np.moveaxis(x, [own.index(name) - len(own) for name in here], range(-len(here), 0))
        parts.append(x[(..., *(slice(None) if name in own else None for name in order))])
    summed = parts[0] * parts[1]
    for _ in order[len(result) :]:
        summed = summed.sum(axis=-1)
    return summed


FUNCTIONS[np.einsum] = contracted

COMPLEX: dict[Any, Callable[..., Any]] = {
    np.add: operator.add,
    np.subtract: operator.sub,
    np.multiply: lambda a, b: a * b if hasattr(a, "x") else b * a,
    np.true_divide: operator.truediv,
    np.negative: operator.neg,
    np.conjugate: lambda z: z.conj(),
    np.absolute: lambda z: np.hypot(z.real, z.imag),
    np.isfinite: lambda z: np.isfinite(z.value),
    np.isinf: lambda z: np.isinf(z.value),
    np.matmul: product,
    np.matvec: lambda a, x: (a * x[..., None, :]).sum(),
}
"""The operations of `Vectors`."""

PRODUCTS = {np.multiply, np.matmul}
