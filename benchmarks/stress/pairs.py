"""What a trial of a campaign gives: pairs of an error and the bound that the program itself states for it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

Pairs = list[tuple[float, float]]


def pairs(found: Iterable[Any], true: Iterable[Any], bound: Any) -> Pairs:
    """Return (error, bound) of each number."""
    return [
        (float(abs(mp.mpmathify(f) - t)), float(b))
        for f, t, b in zip(list(found), list(true), list(bound), strict=True)
    ]


def noise(rng: np.random.Generator, *shape: int) -> NDArray[np.complex128]:
    """Draw complex normal numbers."""
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))
