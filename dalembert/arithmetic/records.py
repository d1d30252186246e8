"""Records of arrays: compared by their numbers, shown in one line, laid out as a table.

numpy is loaded by what needs it: the description of a mechanism is made of records without it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import ArrayLike, NDArray

Kind = TypeVar("Kind", bound=type)

FEW = 9
"""So many numbers are shown one by one."""


def record(kind: Kind) -> Kind:
    """Let a frozen dataclass or a named tuple compare by its numbers and tell itself in one line.

    One that has a `to_frame` shows that table in a notebook. A dataclass is expected with `eq=False, repr=False`; a
    `__repr__` of its own stays.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> import numpy as np
    >>> @record
    ... class Wrench(NamedTuple):
    ...     force: np.ndarray
    ...     moment: float
    >>> Wrench(np.array([1.0, 0.1 + 0.2]), 2.0)
    Wrench(force=[1 0.3], moment=2)
    >>> Wrench(np.ones(2), 0.0) == Wrench(np.ones(2), 0.0), Wrench(np.ones(2), 0.0) == Wrench(np.ones(3), 0.0)
    (True, False)
    """
    own: dict[str, Callable[..., object] | None] = {"__eq__": _equal, "__ne__": _unequal, "__hash__": None}
    if issubclass(kind, tuple) or "__repr__" not in vars(kind):
        own["__repr__"] = _told
    if hasattr(kind, "to_frame"):
        own["_repr_html_"] = _html
    for name, method in own.items():
        setattr(kind, name, method)
    return kind


def numbers(value: object) -> str:
    """Tell numbers in one line: a few one by one, complex ones as size and angle, many by their shape.

    >>> import numpy as np
    >>> numbers([0.5, 2j]), numbers(np.zeros((1000, 3)))
    ('[0.5∠0° 2∠90°]', '(1000, 3) numbers from 0 to 0')
    """
    import numpy as np

    x = np.asarray(value)
    if x.dtype.kind not in "biufc":
        return str(value) if isinstance(value, str) else repr(value)
    if x.size > FEW:
        size = np.abs(x) if x.dtype.kind == "c" else x
        return f"{x.shape} numbers from {np.nanmin(size):.6g} to {np.nanmax(size):.6g}"
    if x.ndim:
        return f"[{' '.join(numbers(part) for part in x)}]"
    number = x.item()
    if isinstance(number, complex):
        return f"{abs(number):.6g}∠{round(float(np.degrees(np.angle(number))), 3) + 0:g}°"
    return str(number) if isinstance(number, bool) else f"{number + 0:.6g}"


def table(columns: Mapping[str, ArrayLike], axes: Iterable[str]) -> pd.DataFrame:
    """Return a table of columns (...) that broadcast, a row an element, indexed by its place along each named axis.

    Of columns with fewer axes than names the last names count; several leading axes are numbered.
    """
    import numpy as np
    import pandas as pd

    arrays = dict(zip(columns, np.broadcast_arrays(*columns.values()), strict=True))
    shape = next(iter(arrays.values())).shape
    if not shape:
        return pd.DataFrame({name: [array.item()] for name, array in arrays.items()})
    lead, *rest = axes
    leading = len(shape) - len(rest)
    leads = [lead] if leading == 1 and not rest else [f"{lead}{i}" for i in range(leading)]
    names = [*leads, *rest]
    index = pd.RangeIndex(shape[0], name=names[0])
    if len(shape) > 1:
        index = pd.MultiIndex.from_product([range(n) for n in shape], names=names)
    return pd.DataFrame({name: array.ravel() for name, array in arrays.items()}, index=index)


def components(name: str, vector: ArrayLike, of: str = "xyz") -> dict[str, NDArray[np.float64]]:
    """Return a vector's (..., k) components as columns; `*` in the name stands for the component's letter.

    >>> components("omega_*_rad_s", [1.0, 2.0, 3.0])["omega_y_rad_s"]
    array(2.)
    """
    import numpy as np

    v = np.asarray(vector)
    return {name.replace("*", letter): v[..., i] for i, letter in enumerate(of)}


def _values(of: object) -> dict[str, object]:
    if is_dataclass(of):
        return {f.name: getattr(of, f.name) for f in fields(of) if f.compare}
    return {name: getattr(of, name) for name in getattr(of, "_fields", ())}


def _equal(self: object, other: object) -> bool:
    if isinstance(self, tuple):
        # a named tuple is the plain one of the same values
        return isinstance(other, tuple) and len(self) == len(other) and all(map(alike, self, other))
    if type(self) is not type(other):
        return False
    here, there = _values(self), _values(other)
    return all(alike(here[name], there[name]) for name in here)


def _unequal(self: object, other: object) -> bool:
    return not _equal(self, other)


def alike(a: object, b: object) -> bool:
    """Say whether two values are the same, arrays by all their numbers; NaN is NaN."""
    if (
        hasattr(a, "__array__")
        or hasattr(b, "__array__")
        or (isinstance(a, list | tuple) and not hasattr(a, "_fields"))
    ):
        import numpy as np

        x, y = np.asarray(a), np.asarray(b)
        return bool(np.array_equal(x, y, equal_nan=x.dtype.kind in "fc" and y.dtype.kind in "fc"))
    return bool(a == b)


def _told(self: object) -> str:
    values = (f"{name}={numbers(value)}" for name, value in _values(self).items() if value is not None)
    return f"{type(self).__name__}({', '.join(values)})"


def _html(self: object) -> str:
    frame: pd.DataFrame = self.to_frame()  # type: ignore[attr-defined]
    return str(frame.to_html(max_rows=20))


def rebuilt(kind: Callable[..., Any], values: Mapping[str, Any]) -> Any:
    """Make a record again from its fields."""
    return kind(**values)


class Record:
    """Base of frozen dataclasses with frozen mappings: a pickle or a copy holds the fields, and nothing worked out."""

    def __reduce__(self) -> tuple[Any, ...]:
        values = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        return rebuilt, (type(self), {k: dict(v) if isinstance(v, Mapping) else v for k, v in values.items()})
