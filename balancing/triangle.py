"""The triangle R of A = Q R, as LAPACK leaves it."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T", np.float64, np.complex128)


def triangle(a: NDArray[T]) -> NDArray[T]:
    """Return R (..., min(m, n), n) of a = Q R.

    Of small matrices numpy's own modes take four times as long as LAPACK, whose answer is that of "raw": they copy.

    Examples
    --------
    >>> np.abs(triangle(np.array([[3.0, 1.0], [4.0, 1.0]]))).round(12)
    array([[5. , 1.4],
           [0. , 0.2]])
    """
    r = np.linalg.qr(a, mode="raw")[0].swapaxes(-1, -2)[..., : min(a.shape[-2:]), :]
    return np.asarray(r * _above(*r.shape[-2:]))


@lru_cache(maxsize=64)
def _above(rows: int, columns: int) -> NDArray[np.float64]:
    """Ones on the diagonal and above it."""
    ones = np.triu(np.ones((rows, columns)))
    ones.flags.writeable = False
    return ones
