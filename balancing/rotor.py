"""Rotors of different numbers of masses, side by side as rectangular arrays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

# masses in one pass: its temporaries stay in the cache
BLOCK = 16384


def by_size(rotor: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield groups of rotors with nearly equal numbers of masses, each for one vectorised pass.

    Parameters
    ----------
    rotor
        For each mass the number of its rotor, (n,), from 0 without gaps.

    Yields
    ------
    rotors, masses
        The numbers of the group's rotors (g,), and the places of their masses (g, k), where -1 fills up rows:
        k is a power of two, so that there are few groups and less than half of each is filling. A group holds
        some 16 000 masses at the most (or one rotor), so that what is computed of it stays in the cache.

    Examples
    --------
    >>> import numpy as np
    >>> for rotors, masses in by_size(np.array([0, 1, 0, 0])):
    ...     print(rotors, masses.tolist())
    [1] [[1]]
    [0] [[0, 2, 3, -1]]
    """
    order = np.argsort(rotor, kind="stable")
    count = np.bincount(rotor)
    start = np.cumsum(count) - count
    width = np.maximum(count, 1)
    # ⌈log₂ width⌉
    exponent = np.frexp(width - 0.5)[1]
    # np.unique would import numpy.ma
    for e in np.flatnonzero(np.bincount(exponent)):
        size = 2 ** int(e)
        alike = np.flatnonzero(exponent == e)
        step = np.arange(size)
        for rotors in np.split(alike, np.arange(max(BLOCK // size, 1), len(alike), max(BLOCK // size, 1))):
            inside = step < count[rotors, None]
            yield rotors, np.where(inside, order[np.minimum(start[rotors, None] + step, len(order) - 1)], -1)
