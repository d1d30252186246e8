"""Arrays of numbers of 32 digits with which formulas written for numpy run as they stand.

numpy gives its functions over to an array that is not its own (its protocols `__array_ufunc__` and `__array_function__`):
`np.sqrt`, `np.cross`, `np.stack` or `@` of a doubled array are those below. A formula that runs on floats is so its own second
run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.doubled import PI, Doubled
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.doubled_vectors import OWN, total

Array = NDArray[np.float64]

ROUNDING = 2.0**-98
"""Relative size of what some operations on doubled numbers round off."""


HIDDEN = 2.0**-103
"""Relative size of what two floats cannot hold of a number."""


class DoubledArray(NDArrayOperatorsMixin):
    """high + low, two arrays of one shape: some 32 digits each.

    Arrays of floats enter operations exactly as they are. A plain number of Python is a constant of the formula, and is
    taken as it is written there: 0.3 is three tenths, `math.pi` is π.

    Examples
    --------
    >>> x = DoubledArray([1.0, 4.0]) / 3
    >>> np.sqrt(x * x).off([1 / 3, 4 / 3]).round(19)
    array([1.87e-17, 7.48e-17])
    """

    __slots__ = ("high", "low")

    dtype = np.dtype(object)

    def __init__(self, high: ArrayLike, low: ArrayLike = 0.0) -> None:
        self.high: Array = np.asarray(high, dtype=float)
        rest = np.asarray(low, dtype=float)
        self.low: Array = rest if rest.shape == self.high.shape else np.broadcast_to(rest, self.high.shape)

    @classmethod
    def of(cls, x: Doubled) -> DoubledArray:
        """A doubled number or array of them."""
        return cls(x.high, x.low)

    def __array__(self, *_: Any, **__: Any) -> Array:
        raise TypeError("doubled numbers are no floats: .value are the nearest")

    def __repr__(self) -> str:
        return f"DoubledArray({self.high!r}, {self.low!r})"

    @property
    def doubled(self) -> Doubled:
        """The same for functions of `Doubled`."""
        return Doubled(self.high[()], self.low[()])

    @property
    def value(self) -> Array:
        """The nearest floats."""
        return np.asarray(self.high + self.low)

    def off(self, value: ArrayLike) -> Array:
        """Return by how much floats differ from these, and what 32 digits do not tell."""
        difference = np.abs((self - np.asarray(value, dtype=float)).value)
        return np.asarray(OWN * difference + HIDDEN * np.abs(self.high))

    @property
    def shape(self) -> tuple[int, ...]:
        return self.high.shape

    @property
    def ndim(self) -> int:
        return self.high.ndim

    @property
    def size(self) -> int:
        return self.high.size

    @property
    def T(self) -> DoubledArray:
        return DoubledArray(self.high.T, self.low.T)

    def __len__(self) -> int:
        return len(self.high)

    def __iter__(self) -> Iterator[DoubledArray]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: Any) -> DoubledArray:
        return DoubledArray(self.high[index], self.low[index])

    def __setitem__(self, index: Any, value: Any) -> None:
        new = _entering(value)
        if not self.low.flags.writeable:
            self.low = self.low.copy()
        self.high[index], self.low[index] = new.high, new.low

    def reshape(self, *shape: Any) -> DoubledArray:
        """The same numbers laid out in another shape."""
        return DoubledArray(self.high.reshape(*shape), self.low.reshape(*shape))

    def sum(self, axis: int = -1, keepdims: bool = False) -> DoubledArray:
        """The sum along an axis, in pairs."""
        summed = DoubledArray.of(total(Doubled(self.high, self.low), axis))
        return _each(np.expand_dims, summed, axis) if keepdims else summed

    def max(self, axis: Any = None, keepdims: bool = False) -> Array:
        """The largest, to 16 digits: sizes."""
        return np.asarray(self.high.max(axis=axis, keepdims=keepdims))

    def argmax(self, axis: int | None = None) -> Any:
        """Where the largest is."""
        return self.high.argmax(axis=axis)

    def any(self) -> bool:
        """Whether one is not zero."""
        return bool(self.high.any())

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **_: Any) -> Any:
        work = _UFUNCS.get(ufunc)
        if work is None or method != "__call__":
            return NotImplemented
        result = work(*map(_entering, inputs))
        if out is None:
            return result
        out[0][...] = result
        return out[0]

    def __array_function__(self, function: Any, _: Any, args: Any, kwargs: Any) -> Any:
        if function in _OWN:
            return _OWN[function](*args, **kwargs)
        if function in _LAYOUT:
            return _each(function, *args, **kwargs)
        return NotImplemented


class DoubledComplex:
    """x + iy of doubled arrays, for formulas of complex arrays.

    >>> z = DoubledComplex(DoubledArray(1.0), DoubledArray(2.0))
    >>> (z * z.conj()).real.value
    array(5.)
    """

    def __init__(self, real: Any, imag: Any) -> None:
        self.real, self.imag = real, imag

    def conj(self) -> DoubledComplex:
        """The conjugate."""
        return DoubledComplex(self.real, -self.imag)

    def __mul__(self, other: DoubledComplex | DoubledArray) -> DoubledComplex:
        if isinstance(other, DoubledComplex):
            return DoubledComplex(
                self.real * other.real - self.imag * other.imag,
                self.real * other.imag + self.imag * other.real,
            )
        return DoubledComplex(self.real * other, self.imag * other)


@lru_cache(maxsize=256)
def _constant(x: float) -> Doubled:
    """A constant of a formula as it is written: a short decimal, or π times a power of two."""
    if x and abs(math.frexp(x / math.pi)[0]) == 0.5:
        return PI * (x / math.pi)
    return Doubled.of(Fraction(repr(x))) if len(repr(x)) < 9 and math.isfinite(x) else Doubled(x)


def _entering(x: Any) -> Any:
    if isinstance(x, DoubledArray):
        return x
    if type(x) is float:
        return DoubledArray.of(_constant(x))
    if isinstance(x, Doubled):
        return DoubledArray.of(x)
    return DoubledArray(x)


def _each(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """A function that lays numbers out anew, of the upper and of the lower parts."""
    places = (1, 2) if function is np.where else range(len(args)) if function is np.broadcast_arrays else (0,)
    both = []
    for upper in (True, False):
        parts = [_part(x, upper) if i in places else x for i, x in enumerate(args)]
        both.append(function(*parts, **kwargs))
    if isinstance(both[0], (list, tuple)):
        return [DoubledArray(*pair) for pair in zip(*both, strict=True)]
    return DoubledArray(*both)


def _part(x: Any, upper: bool) -> Any:
    if isinstance(x, (list, tuple)):
        return [_part(each, upper) for each in x]
    each = _entering(x)
    return each.high if upper else each.low


def _of(function: Callable[..., Doubled]) -> Callable[..., DoubledArray]:
    """A function of doubled numbers, of arrays of them."""

    def work(*x: DoubledArray) -> DoubledArray:
        with np.errstate(all="ignore"):
            return DoubledArray.of(function(*(Doubled(each.high, each.low) for each in x)))

    return work


def _compared(ufunc: Any) -> Callable[..., Any]:
    """A comparison, by the sign of the difference."""

    def work(a: DoubledArray, b: DoubledArray) -> Any:
        same = a.high == b.high
        return ufunc(np.where(same, a.low, a.high), np.where(same, b.low, b.high))

    return work


def _chosen(a: DoubledArray, b: DoubledArray, first: Any) -> DoubledArray:
    return DoubledArray(np.where(first, a.high, b.high), np.where(first, a.low, b.low))


def _root(x: Doubled) -> Doubled:
    return DOUBLED.sqrt(Doubled(np.asarray(x.high), x.low))


def _hypot(a: DoubledArray, b: DoubledArray) -> DoubledArray:
    # by a power of two near the larger: no square underflows
    size = np.exp2(np.floor(np.log2(np.maximum(np.maximum(np.abs(a.high), np.abs(b.high)), 1e-290))))
    x, y = a / size, b / size
    return np.sqrt(x * x + y * y) * size  # type: ignore[no-any-return]


def _angle(y: Doubled, x: Doubled) -> Doubled:
    angle = DOUBLED.atan2(*(Doubled(np.asarray(part.high), part.low) for part in (y, x)))
    # on the axes, and with the sign of a zero, as floats have it
    plain = np.arctan2(y.high, x.high)
    turns = plain / np.pi
    exact = PI * turns
    whole = (y.high == 0) | (x.high == 0)
    return Doubled(np.where(whole, exact.high, angle.high), np.where(whole, exact.low, angle.low))


def _power(x: DoubledArray, y: DoubledArray) -> Any:
    result = x
    for _ in range(int(y.high) - 1):
        result = result * x
    return result


def _product(a: DoubledArray, b: DoubledArray) -> Any:
    """The product of matrices and vectors."""
    rows, columns = (a[None, :] if a.ndim == 1 else a), (b[:, None] if b.ndim == 1 else b)
    result = (rows[..., :, :, None] * columns[..., None, :, :]).sum(axis=-2)
    if b.ndim == 1:
        result = result[..., 0]
    if a.ndim == 1:
        result = result[..., 0, :] if b.ndim > 1 else result[..., 0]
    return result


def _cross(a: Any, b: Any) -> Any:
    a, b = _entering(a), _entering(b)
    (x, y, z), (X, Y, Z) = ([v[..., i] for i in range(3)] for v in (a, b))
    return np.stack([y * Z - z * Y, z * X - x * Z, x * Y - y * X], axis=-1)


def _rint(x: DoubledArray) -> DoubledArray:
    near = np.rint(x.high)
    rest = x - near
    return DoubledArray(near + np.where(rest > 0.5, 1.0, np.where(rest < -0.5, -1.0, 0.0)))


def exponential(x: Any) -> Any:
    """e to the power of doubled numbers (...): 2ᵏ times the 2¹⁰-th power of a short series.

    >>> float(exponential(DoubledArray(1.0)).low)
    1.4456468917292502e-16
    """
    x = _entering(x)
    k = np.rint(x.high / math.log(2))
    # less k·ln 2, in 2¹⁰ parts
    r = (x - LN2 * k) / 1024.0
    # e^r - 1, so that no digit of a small r is lost
    less = r
    for n in range(9, 1, -1):
        less = r + less * r / n if n == 9 else r * (1.0 + less / n)
    for _ in range(10):
        less = less * (less + 2.0)
    power = np.exp2(np.clip(k, -1022, 1022))
    e = less + 1.0
    return DoubledArray(e.high * power, e.low * power)


LN2 = DoubledArray(0.6931471805599453, 2.3190468138462996e-17)


def logarithm(x: Any) -> Any:
    """The natural logarithm of positive doubled numbers (...), by a step of Newton's."""
    near = np.log(x.high)
    left = x * exponential(DoubledArray(-near)) - 1.0
    return left - left * left / 2.0 + near


_UFUNCS: dict[Any, Callable[..., Any]] = {
    np.add: _of(lambda a, b: a + b),
    np.subtract: _of(lambda a, b: a - b),
    np.multiply: _of(lambda a, b: a * b),
    np.true_divide: _of(lambda a, b: a / b),
    np.negative: lambda x: DoubledArray(-x.high, -x.low),
    np.absolute: _of(abs),
    np.square: _of(lambda x: x * x),
    np.power: _power,
    np.sqrt: _of(_root),
    np.hypot: _hypot,
    np.sin: _of(DOUBLED.sin),
    np.cos: _of(DOUBLED.cos),
    np.arctan2: _of(_angle),
    np.arctan: _of(lambda x: _angle(x, Doubled(1.0 + 0.0 * x.high))),
    np.copysign: lambda x, y: _chosen(x, -x, np.signbit(x.high) == np.signbit(y.high)),
    np.minimum: lambda a, b: _chosen(a, b, a < b),
    np.maximum: lambda a, b: _chosen(a, b, a > b),
    np.arcsinh: lambda x: np.copysign(logarithm(np.abs(x) + np.sqrt(x * x + 1.0)), x),
    np.cosh: lambda x: (exponential(x) + exponential(-x)) / 2.0,
    np.tanh: lambda x: np.copysign(1.0 - 2.0 / (exponential(np.abs(x) * 2.0) + 1.0), x),
    np.degrees: lambda x: x * 180.0 / math.pi,
    np.rint: _rint,
    # of whole numbers
    np.fmod: lambda x, y: DoubledArray(np.fmod(x.high, y.high)),
    np.remainder: lambda x, y: DoubledArray(np.remainder(x.high, y.high)),
    np.isfinite: lambda x: np.isfinite(x.high),
    np.isinf: lambda x: np.isinf(x.high),
    np.isnan: lambda x: np.isnan(x.high),
    np.matmul: _product,
    **{
        each: _compared(each)
        for each in (np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal)
    },
}

_LAYOUT = {
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
    np.zeros_like,
    np.empty_like,
}

_OWN: dict[Any, Callable[..., Any]] = {
    np.cross: _cross,
    np.sum: lambda x, axis=-1, **_: x.sum(axis),
    np.shape: lambda x: x.shape,
    np.ndim: lambda x: x.ndim,
}


def exactly(numbers: Iterable[Fraction], shape: tuple[int, ...]) -> DoubledArray:
    """Exact numbers as a doubled array of this shape."""
    each = [Doubled.of(x) for x in numbers]
    return DoubledArray(
        np.array([x.high for x in each]).reshape(shape), np.array([x.low for x in each]).reshape(shape)
    )


def by_fractions(formula: Callable[..., Fraction], *numbers: DoubledArray) -> DoubledArray:
    """A formula of arrays of one shape in fractions, number by number: what cancels in it is exact.

    >>> by_fractions(lambda a, b: a - b, DoubledArray([1.0], [1e-30]), DoubledArray([1.0])).value
    array([1.e-30])
    """
    rows = [
        [Fraction(a) + Fraction(b) for a, b in zip(x.high.flat, x.low.flat, strict=True)] for x in numbers
    ]
    return exactly([formula(*row) for row in zip(*rows, strict=True)], numbers[0].shape)
