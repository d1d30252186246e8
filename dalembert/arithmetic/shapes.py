"""What a caller hands in as arrays: numbers, whose shapes go together; else one sentence says which do not."""

from __future__ import annotations

from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

Shape = tuple[int, ...]


def is_doubled(x: object) -> TypeGuard[Any]:
    """Return whether these are numbers of 32 digits (`doubled_arrays`), in which a formula runs the second time."""
    return hasattr(x, "high")


def as_array(x: ArrayLike) -> NDArray[np.float64]:
    """Return an array of floats; one of 32 digits stays as it is."""
    if is_doubled(x):
        doubled: NDArray[np.float64] = x
        return doubled
    return np.asarray(x, dtype=float)


def as_vectors(x: Any) -> NDArray[np.complex128]:
    """Return an array of complex numbers x + iy; one of 32 digits stays as it is."""
    if is_doubled(x):
        doubled: NDArray[np.complex128] = x
        return doubled
    return np.asarray(x, dtype=complex)


def in_32_digits(x: ArrayLike) -> Any:
    """Return the same numbers as a `DoubledArray`; complex ones as a `Vectors`."""
    from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors

    if is_doubled(x):
        return x
    return Vectors.of(x) if np.iscomplexobj(x) else DoubledArray(x)


def floats(x: Any) -> Any:
    """Return the floats nearest to numbers: what decides is taken from them in the second run too."""
    return x.value if is_doubled(x) else x


def filled(shape: Shape, value: float, like: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an array of one value, of numbers of the kind of another array.

    >>> filled((2,), 0.5, np.zeros(3))
    array([0.5, 0.5])
    """
    numbers = np.full(shape, value)
    return as_array(in_32_digits(numbers)) if is_doubled(like) else numbers


def sorting(x: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the order in which the numbers of the last axis ascend."""
    if is_doubled(x):
        order: NDArray[np.intp] = np.lexsort((x.low, x.high), axis=-1)
        return order
    return np.argsort(x, axis=-1, kind="stable")


def as_numbers(name: str, value: ArrayLike, kind: type = float) -> NDArray[Any]:
    """Return an array of float or complex numbers.

    Raises
    ------
    ValueError
        It holds other things than numbers, or rows of different lengths.

    Examples
    --------
    >>> as_numbers("omega", [1, 2, 3])
    array([1., 2., 3.])
    >>> as_numbers("omega", "fast")
    Traceback (most recent call last):
    ...
    ValueError: omega must be an array of numbers, found 'fast'
    """
    if is_doubled(value):
        return as_array(value)
    try:
        return np.asarray(value, dtype=kind)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be an array of numbers, found {repr(value)[:60]}") from None


def common_shape(**shapes: Shape) -> Shape:
    """Return the shape that arrays of these shapes have together (numpy's broadcasting).

    Raises
    ------
    ValueError
        They do not go together; the sentence has the name and the shape of each.

    Examples
    --------
    >>> common_shape(inertia=(4, 1), omega=(3,))
    (4, 3)
    >>> common_shape(inertia=(4,), omega=(3,))
    Traceback (most recent call last):
    ...
    ValueError: shapes do not fit: inertia (4,), omega (3,)
    """
    different = {*shapes.values()} - {()}
    if len(different) < 2:
        # mostly one: numpy takes longer than some sums do
        return different.pop() if different else ()
    try:
        return np.broadcast_shapes(*different)
    except ValueError:
        pairs = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"shapes do not fit: {pairs}") from None


def spread_to(name: str, value: ArrayLike, shape: Shape) -> NDArray[np.float64]:
    """Return numbers as an array of a shape that is wanted, repeated where there are fewer (numpy's broadcasting).

    Examples
    --------
    >>> spread_to("max_mass", 2.0, (3,))
    array([2., 2., 2.])
    >>> spread_to("max_mass", [1.0, 2.0], (3,))
    Traceback (most recent call last):
    ...
    ValueError: max_mass must have the shape (3,), or be one number, found the shape (2,)
    """
    numbers = as_numbers(name, value)
    try:
        return np.broadcast_to(numbers, shape)
    except ValueError:
        raise ValueError(
            f"{name} must have the shape {shape}, or be one number, found the shape {numbers.shape}"
        ) from None
