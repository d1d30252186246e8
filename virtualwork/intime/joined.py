"""A motion in parts, each of its own coordinates, that answers as one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Joined:
    """What `Motion` has, asked of every part and put together row by row.

    Arrays are joined along their poses, pairs, lists and mappings of them part by part; whatever else a motion gives is joined in the same way.

    Examples
    --------
    >>> from virtualwork import Input, Link, Mechanism
    >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 2})}, inputs=Input(link="crank"))
    >>> parts = [(np.array([1, 2]), crank.motion([0.0, 1.0], speed=3.0)), (np.array([0]), crank.motion(0.5, speed=1.0))]
    >>> Joined(parts, 3).link("crank").omega
    array([1., 3., 3.])
    """

    def __init__(self, parts: Sequence[tuple[NDArray[np.intp], Any]], n: int) -> None:
        self._parts, self._n = parts, n

    def __repr__(self) -> str:
        return f"Joined({self._parts[0][1]!r}, {self._n} poses)"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self._joined([getattr(of, name) for _, of in self._parts])

    def __call__(self, *args: Any, **keywords: Any) -> Any:
        """Call what was asked of every part."""
        return self._joined([of(*args, **keywords) for _, of in self._parts])

    def _joined(self, answers: list[Any]) -> Any:
        first = answers[0]
        if isinstance(first, np.ndarray):
            out = np.empty((self._n, *first.shape[1:]), first.dtype)
            for (rows, _), part in zip(self._parts, answers, strict=True):
                out[rows] = part
            return out
        if isinstance(first, (tuple, list)) and all(isinstance(part, np.ndarray) for part in first):
            return type(first)(self._joined(list(parts)) for parts in zip(*answers, strict=True))
        if isinstance(first, dict):
            return {key: self._joined([part[key] for part in answers]) for key in first}
        if first is None or isinstance(first, (bool, str, float, list)):
            return first
        return Joined([(rows, of) for (rows, _), of in zip(self._parts, answers, strict=True)], self._n)
