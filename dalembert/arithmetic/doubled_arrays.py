"""Arrays of numbers of 32 digits with which formulas written for numpy run as they stand.

numpy gives its functions over to an array that is not its own (its protocols `__array_ufunc__` and `__array_function__`):
`np.sqrt`, `np.cross`, `np.stack` or `@` of a doubled array are those below. A formula that runs on floats is so its own second
run.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_functions import (
    DOUBLED,
    constant,
    direction,
    exponential,
    hypot,
    logarithm,
    rint,
    root,
)
from dalembert.arithmetic.doubled_operations import chosen, compared, cross, power, product, running
from dalembert.arithmetic.doubled_vectors import OWN, Vectors, total

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
        """These numbers for functions of `Doubled`."""
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

    @property
    def real(self) -> DoubledArray:
        """Itself, as of numpy's real arrays."""
        return self

    def conj(self) -> DoubledArray:
        """Itself, as of numpy's real arrays."""
        return self

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
        """These numbers in another shape."""
        return DoubledArray(self.high.reshape(*shape), self.low.reshape(*shape))

    def sum(self, axis: int = -1, keepdims: bool = False) -> DoubledArray:
        """The sum along an axis, in pairs."""
        summed = DoubledArray.of(total(Doubled(self.high, self.low), axis))
        return _each(np.expand_dims, summed, axis) if keepdims else summed

    def __float__(self) -> float:
        return float(self.value)

    def astype(self, kind: Any) -> NDArray[Any]:
        """The nearest numbers of a kind of numpy's."""
        return self.value.astype(kind)

    def max(self, axis: Any = None, keepdims: bool = False) -> Array:
        """The largest, to 16 digits: sizes."""
        return np.asarray(self.high.max(axis=axis, keepdims=keepdims))

    def argmax(self, axis: int | None = None) -> Any:
        """Where the largest is."""
        largest = self.high == self.high.max(axis=axis, keepdims=True)
        return np.where(largest, self.low, -np.inf).argmax(axis=axis)

    def argmin(self, axis: int | None = None) -> Any:
        """Where the smallest is."""
        return (-self).argmax(axis)

    def any(self) -> bool:
        """Whether one is not zero."""
        return bool(self.high.any())

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **_: Any) -> Any:
        if any(map(_is_complex, inputs)):
            work = _COMPLEX.get(ufunc)
            return NotImplemented if work is None else work(*map(_complex, inputs))
        work = _UFUNCS.get(ufunc)
        if work is None or method != "__call__":
            return NotImplemented
        result = work(*map(_entering, inputs))
        if out is None:
            return result
        out[0][...] = result
        return out[0]

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if DoubledComplex in types:
            return NotImplemented
        if function in _OWN:
            return _OWN[function](*args, **kwargs)
        if function in _LAYOUT:
            return _each(function, *args, **kwargs)
        return NotImplemented


class DoubledComplex(NDArrayOperatorsMixin):
    """x + iy of doubled arrays, for formulas of complex arrays.

    >>> z = DoubledComplex(DoubledArray(1.0), DoubledArray(2.0))
    >>> (z * z.conj()).real.value, (1j * z).value
    (array(5.), array(-2.+1.j))
    """

    dtype = np.dtype(object)

    def __init__(self, real: Any, imag: Any) -> None:
        self.real, self.imag = real, imag

    @classmethod
    def of(cls, z: Vectors | ArrayLike) -> DoubledComplex:
        """Vectors of 32 digits, or complex floats exactly."""
        z = z if isinstance(z, Vectors) else Vectors.of(z)
        return cls(DoubledArray.of(z.x), DoubledArray.of(z.y))

    @property
    def high(self) -> NDArray[np.complex128]:
        """The upper parts."""
        return self.value

    @property
    def value(self) -> NDArray[np.complex128]:
        """The nearest complex floats."""
        z = np.empty(self.shape, dtype=complex)
        z.real, z.imag = self.real.value, self.imag.value
        return z

    @property
    def vectors(self) -> Vectors:
        """These numbers for functions of `Vectors`."""
        return Vectors(self.real.doubled, self.imag.doubled)

    @property
    def shape(self) -> tuple[int, ...]:
        return np.broadcast_shapes(self.real.shape, self.imag.shape)

    @property
    def ndim(self) -> int:
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> DoubledComplex:
        return DoubledComplex(self.real[index], self.imag[index])

    def __setitem__(self, index: Any, value: Any) -> None:
        new = _complex(value)
        self.real[index], self.imag[index] = new.real, new.imag

    def conj(self) -> DoubledComplex:
        """The conjugate."""
        return DoubledComplex(self.real, -self.imag)

    def sum(self, axis: int = -1) -> DoubledComplex:
        """The sum along an axis, in pairs."""
        return DoubledComplex(self.real.sum(axis), self.imag.sum(axis))

    def any(self) -> bool:
        """Whether one is not zero."""
        return bool(self.real.any() or self.imag.any())

    def off(self, value: ArrayLike) -> Array:
        """Return by how much complex floats differ from these, and what 32 digits do not tell."""
        z = np.asarray(value, dtype=complex)
        return np.asarray(np.hypot(self.real.off(z.real), self.imag.off(z.imag)))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **_: Any) -> Any:
        work = _COMPLEX.get(ufunc)
        return NotImplemented if work is None or method != "__call__" else work(*map(_complex, inputs))

    def __array_function__(self, function: Any, _: Any, args: Any, kwargs: Any) -> Any:
        if function is np.sum:
            return args[0].sum(**kwargs)
        if function is np.shape:
            return args[0].shape
        if function not in _LAYOUT:
            return NotImplemented
        return DoubledComplex(*(_each(function, *_parts(args, name), **kwargs) for name in ("real", "imag")))


def _is_complex(x: Any) -> bool:
    return isinstance(x, (complex, DoubledComplex)) or (isinstance(x, np.ndarray) and x.dtype.kind == "c")


def _complex(x: Any) -> DoubledComplex:
    if isinstance(x, DoubledComplex):
        return x
    if _is_complex(x):
        return DoubledComplex.of(x)
    return DoubledComplex(_entering(x), DoubledArray(np.zeros(np.shape(x))))


def _parts(x: Any, name: str) -> Any:
    """The real or the imaginary parts of what a function of arrays is called with."""
    if isinstance(x, (list, tuple)):
        return [_parts(each, name) for each in x]
    return getattr(x, name) if isinstance(x, DoubledComplex) else x


def _of_vectors(function: Callable[..., Vectors]) -> Callable[..., DoubledComplex]:
    """An operation of vectors, of complex arrays."""

    def work(*z: DoubledComplex) -> DoubledComplex:
        with np.errstate(all="ignore"):
            return DoubledComplex.of(function(*(each.vectors for each in z)))

    return work


_COMPLEX: dict[Any, Callable[..., Any]] = {
    np.add: _of_vectors(operator.add),
    np.subtract: _of_vectors(operator.sub),
    np.multiply: _of_vectors(operator.mul),
    np.true_divide: _of_vectors(operator.truediv),
    np.negative: _of_vectors(operator.neg),
    np.conjugate: lambda z: z.conj(),
    np.absolute: lambda z: np.hypot(z.real, z.imag),
}


def _entering(x: Any) -> Any:
    if isinstance(x, DoubledArray):
        return x
    if type(x) is float:
        return DoubledArray.of(constant(x))
    if isinstance(x, Doubled):
        return DoubledArray.of(x)
    return DoubledArray(x)


def _each(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """A function that lays numbers out anew, of the upper and of the lower parts."""
    places = _PLACES.get(function, (0,))
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


def _zeros(like: DoubledArray, dtype: Any = float, shape: Any = None) -> Any:
    shape = like.shape if shape is None else shape
    real, imag = (DoubledArray(np.zeros(shape), np.zeros(shape)) for _ in range(2))
    return DoubledComplex(real, imag) if dtype is complex else real


_UFUNCS: dict[Any, Callable[..., Any]] = {
    np.add: _of(lambda a, b: a + b),
    np.subtract: _of(lambda a, b: a - b),
    np.multiply: _of(lambda a, b: a * b),
    np.true_divide: _of(lambda a, b: a / b),
    np.negative: lambda x: DoubledArray(-x.high, -x.low),
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
    np.remainder: lambda x, y: DoubledArray(np.remainder(x.high, y.high)),
    np.isfinite: lambda x: np.isfinite(x.high),
    np.isinf: lambda x: np.isinf(x.high),
    np.isnan: lambda x: np.isnan(x.high),
    np.matmul: product,
    **{
        each: compared(each)
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
    np.choose,
}

_PLACES: dict[Any, Iterable[int]] = {
    np.where: (1, 2),
    np.choose: (1,),
    np.broadcast_arrays: range(99),
}

_OWN: dict[Any, Callable[..., Any]] = {
    np.cross: cross,
    np.sum: lambda x, axis=-1, **_: x.sum(axis),
    np.empty_like: _zeros,
    np.zeros_like: _zeros,
    np.diff: lambda x: x[1:] - x[:-1],
    np.cumsum: lambda x: running(lambda a, b: a + b, x),
    np.cumprod: lambda x: running(lambda a, b: a * b, x),
    np.shape: lambda x: x.shape,
    np.ndim: lambda x: x.ndim,
}
