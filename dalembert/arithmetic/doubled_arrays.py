"""Arrays of numbers of 32 digits with which formulas written for numpy run as they stand.

numpy gives its functions over to an array that is not its own (its protocols `__array_ufunc__` and `__array_function__`):
`np.sqrt`, `np.cross`, `np.stack` or `@` of a doubled array are those below. A formula that runs on floats is so its own second
run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

from dalembert.angles import degrees
from dalembert.arithmetic.doubled import PI, Doubled
from dalembert.arithmetic.doubled_functions import DOUBLED, constant
from dalembert.arithmetic.doubled_operations import (
    COMPLEX,
    FUNCTIONS,
    LAYOUT,
    OWN,
    PLACES,
    PRODUCTS,
    UFUNCS,
    joined,
    off,
    part,
    total,
)

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

    def sum(self, axis: Any = -1, keepdims: bool = False) -> DoubledArray:
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
            return _of_complex(ufunc, method, inputs)
        work = UFUNCS.get(ufunc)
        if work is None or method != "__call__":
            return NotImplemented
        result = work(*map(_entering, inputs))
        if out is None:
            return result
        out[0][...] = result
        return out[0]

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if Vectors in types:
            return NotImplemented
        if function in _OWN:
            return _OWN[function](*args, **kwargs)
        if function in LAYOUT:
            return _each(function, *args, **kwargs)
        return NotImplemented


class Vectors(NDArrayOperatorsMixin):
    """x + iy of two doubled arrays (...), for formulas of complex arrays.

    Examples
    --------
    What a quotient of floats leaves:

    >>> third = Vectors.of(np.array([1 + 3j])) / Vectors.of(np.array([3 + 0j]))
    >>> third.off(np.array([1 / 3 + 1j])).round(19)
    array([1.87e-17])
    >>> (1j * third.real).value
    array([0.+0.33333333j])
    """

    __slots__ = ("x", "y")

    dtype = np.dtype(object)

    def __init__(self, x: Doubled, y: Doubled) -> None:
        self.x, self.y = x, y

    @classmethod
    def of(cls, z: ArrayLike) -> Vectors:
        """Complex floats, exactly."""
        array = np.asarray(z, dtype=complex)
        return cls(Doubled(array.real.copy()), Doubled(array.imag.copy()))

    @classmethod
    def of_parts(cls, real: DoubledArray, imag: DoubledArray) -> Vectors:
        """Arrays of real numbers as the two parts."""
        return cls(real.doubled, imag.doubled)

    @property
    def real(self) -> DoubledArray:
        """The real parts; to be set, too."""
        return DoubledArray.of(self.x)

    @real.setter
    def real(self, x: Any) -> None:
        self.x = _entering(x).doubled

    @property
    def imag(self) -> DoubledArray:
        """The imaginary parts; to be set, too."""
        return DoubledArray.of(self.y)

    @imag.setter
    def imag(self, y: Any) -> None:
        self.y = _entering(y).doubled

    @property
    def high(self) -> NDArray[np.complex128]:
        """The upper parts."""
        return self.value

    @property
    def shape(self) -> tuple[int, ...]:
        return np.shape(self.x.high)

    @property
    def ndim(self) -> int:
        return np.ndim(self.x.high)

    def __len__(self) -> int:
        return len(self.x.high)

    @property
    def value(self) -> NDArray[np.complex128]:
        """The nearest complex floats."""
        z = np.empty(self.shape, dtype=complex)
        z.real, z.imag = self.x.value, self.y.value
        return z

    def conj(self) -> Vectors:
        """The conjugate."""
        return Vectors(self.x, -self.y)

    @property
    def square(self) -> Doubled:
        """|z|²."""
        return self.x * self.x + self.y * self.y

    @property
    def size(self) -> Doubled:
        """|z|."""
        return DOUBLED.sqrt(self.square)

    @property
    def angle(self) -> Doubled:
        """The angle, [0, 2π)."""
        angle = DOUBLED.atan2(self.y, self.x)
        below = angle.high < 0
        turned = angle + PI * 2.0
        return Doubled(np.where(below, turned.high, angle.high), np.where(below, turned.low, angle.low))

    @property
    def degrees(self) -> Doubled:
        """The angle in degrees, [0, 360)."""
        return self.angle * 180.0 / PI

    def __add__(self, other: Any) -> Vectors:
        other = _vectors(other)
        return Vectors(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Any) -> Vectors:
        other = _vectors(other)
        return Vectors(self.x - other.x, self.y - other.y)

    def __neg__(self) -> Vectors:
        return Vectors(-self.x, -self.y)

    def __mul__(self, other: Any) -> Vectors:
        if not _is_complex(other):
            other = _plain(other)
            return Vectors(self.x * other, self.y * other)
        other = _vectors(other)
        return Vectors(self.x * other.x - self.y * other.y, self.x * other.y + self.y * other.x)

    def __truediv__(self, other: Any) -> Vectors:
        if _is_complex(other):
            other = _vectors(other)
            self, other = self * other.conj(), other.square
        other = _plain(other)
        return Vectors(self.x / other, self.y / other)

    def __getitem__(self, index: Any) -> Vectors:
        return Vectors(part(self.x, index), part(self.y, index))

    def __setitem__(self, index: Any, value: Any) -> None:
        value = _vectors(value)
        for own, other in ((self.x, value.x), (self.y, value.y)):
            if not np.ndim(own.low):
                own.low = np.zeros(self.shape)
            own.high[index], own.low[index] = other.high, other.low

    def sum(self, axis: int = -1) -> Vectors:
        """The sum along an axis, in pairs."""
        return Vectors(total(self.x, axis), total(self.y, axis))

    def reshape(self, *shape: Any) -> Vectors:
        """These numbers in another shape."""
        return Vectors.of_parts(self.real.reshape(*shape), self.imag.reshape(*shape))

    def copy(self) -> Vectors:
        """These numbers again, to be changed."""
        return Vectors.of_parts(*(DoubledArray(x.high.copy(), x.low.copy()) for x in (self.real, self.imag)))

    def any(self) -> bool:
        """Whether one is not zero."""
        return bool(self.value.any())

    def off(self, value: ArrayLike) -> Array:
        """Return by how much complex floats differ from these."""
        difference = self - Vectors.of(value)
        return np.asarray(OWN * np.hypot(difference.x.value, difference.y.value))

    def turned(self, value: ArrayLike) -> Array:
        """Return by how much the angles of complex floats differ, degrees; half a turn where no direction holds."""
        size, error = np.abs(np.asarray(value)), self.off(value)
        turn = off(degrees(np.asarray(value, dtype=complex)), self.degrees, 360.0)
        return np.where(error < size, turn, np.where(error > 0, 180.0, 0.0))

    @classmethod
    def joined(cls, parts: Iterable[Vectors], axis: int = 0) -> Vectors:
        """Arrays behind each other along an axis."""
        each = list(parts)
        return cls(*(joined([getattr(z, name) for z in each], axis) for name in ("x", "y")))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **_: Any) -> Any:
        return _of_complex(ufunc, method, inputs)

    def __array_function__(self, function: Any, _: Any, args: Any, kwargs: Any) -> Any:
        if function in FUNCTIONS:
            return FUNCTIONS[function](*args, **kwargs)
        if function is np.zeros_like:
            return Vectors.of(np.zeros(args[0].shape))
        if function not in LAYOUT:
            return NotImplemented
        places = PLACES.get(function, (0,))
        return Vectors.of_parts(
            *(
                _each(
                    function, *(_parts(x, name) if i in places else x for i, x in enumerate(args)), **kwargs
                )
                for name in ("real", "imag")
            )
        )


def _is_complex(x: Any) -> bool:
    return isinstance(x, (complex, Vectors)) or (isinstance(x, np.ndarray) and x.dtype.kind == "c")


def _vectors(x: Any) -> Vectors:
    if isinstance(x, Vectors):
        return x
    if _is_complex(x):
        return Vectors.of(x)
    real = _entering(x)
    return Vectors(real.doubled, Doubled(np.zeros(np.shape(real.high))))


def _of_complex(ufunc: Any, method: str, inputs: tuple[Any, ...]) -> Any:
    if ufunc not in COMPLEX or method != "__call__":
        return NotImplemented
    # a real factor stays real
    inputs = tuple(x if ufunc in PRODUCTS and not _is_complex(x) else _vectors(x) for x in inputs)
    with np.errstate(all="ignore"):
        return COMPLEX[ufunc](*inputs)


def _plain(x: Any) -> Any:
    return x.doubled if isinstance(x, DoubledArray) else constant(x) if type(x) is float else x


def _parts(x: Any, name: str) -> Any:
    """The real or the imaginary parts of what a function of arrays is called with."""
    if isinstance(x, (list, tuple)):
        return [_parts(each, name) for each in x]
    return getattr(_vectors(x), name)


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
    places = PLACES.get(function, (0,))
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


def _zeros(like: DoubledArray, dtype: Any = float, shape: Any = None) -> Any:
    shape = like.shape if shape is None else shape
    real, imag = (DoubledArray(np.zeros(shape), np.zeros(shape)) for _ in range(2))
    return Vectors.of_parts(real, imag) if dtype is complex else real


_OWN: dict[Any, Any] = {**FUNCTIONS, np.empty_like: _zeros, np.zeros_like: _zeros}
