"""Records: frozen data that prints itself in one line, compares by what it holds, pickles and copies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np


def same(a: Any, b: Any) -> bool:
    """Say whether two values hold the same: arrays by their entries, where NaN is like NaN.

    >>> same((1.0, np.array([np.nan])), (1.0, np.array([np.nan])))
    True
    """
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        exact = np.asarray(a).dtype.kind in "OSU" or np.asarray(b).dtype.kind in "OSU"
        return bool(np.array_equal(a, b, equal_nan=not exact))
    if isinstance(a, tuple | list) and isinstance(b, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)


def short(value: Any) -> str:
    """A value in a few characters.

    >>> short(np.zeros((3, 2))), short(2.0), short({"a": 1, "b": 2})
    ('array(3, 2)', '2.0', '2 a, b')
    """
    if isinstance(value, np.ndarray):
        return repr(value.item()) if value.size == 1 else f"array{value.shape}"
    if isinstance(value, Mapping):
        return f"{len(value)} {', '.join(map(str, value))}" if value else "0"
    if isinstance(value, tuple | list) and len(value) > 3:
        return str(len(value))
    return repr(value)


def rebuilt(kind: Callable[..., Any], values: Mapping[str, Any]) -> Any:
    """Make a record again from its fields, as pickles and copies do."""
    return kind(**values)


class Record:
    """Base of the frozen dataclasses whose fields are mappings or arrays."""

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = [f.name for f in fields(self) if f.compare]  # type: ignore[arg-type]
        return all(same(getattr(self, name), getattr(other, name)) for name in names)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        shown = (f"{f.name}={short(getattr(self, f.name))}" for f in fields(self) if f.repr)  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(shown)})"

    def __reduce__(self) -> tuple[Any, ...]:
        def plain(value: Any) -> Any:
            return dict(value) if isinstance(value, Mapping) else value

        values = {f.name: plain(getattr(self, f.name)) for f in fields(self)}  # type: ignore[arg-type]
        return rebuilt, (type(self), values)
