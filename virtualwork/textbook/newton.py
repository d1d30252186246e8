"""Newton and Raphson's method for one equation f(x) = 0, with its table of iterates (R. Nicoletti, SEM 104, lecture 7)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.arithmetic.records import record

if TYPE_CHECKING:
    import pandas as pd

EPS = float(np.finfo(float).eps)
STEP = 1e-100
"""The imaginary step: f(x + ih) has no difference in which digits could be lost."""


class Row(NamedTuple):
    """A row of the table: x_k, f(x_k), f′(x_k) and the step −f/f′."""

    k: int
    x: float
    f: float
    slope: float
    step: float


@record
@dataclass(frozen=True, eq=False, repr=False)
class NewtonTable:
    """The iterates of Newton-Raphson, computed by `newton`.

    Attributes
    ----------
    rows : tuple of Row
        x1, x2, … from the first guess on, with f, f′ and the step of each.
    converged : bool
    reason : str
        Why it did not converge; empty where it did.
    """

    rows: tuple[Row, ...]
    converged: bool
    reason: str = ""

    @property
    def root(self) -> float:
        """The last x; NaN where it did not converge."""
        return self.rows[-1].x if self.converged else float("nan")

    def to_frame(self) -> pd.DataFrame:
        """Return the table: k, x, f, slope, step."""
        import pandas as pd

        return pd.DataFrame(self.rows).set_index("k")

    def __repr__(self) -> str:
        lines = [f"{'k':>3}  {'x':>22}  {'f(x)':>12}  {'f′(x)':>12}  {'step':>12}"]
        lines += [
            f"{r.k:>3}  {r.x:>22.16g}  {r.f:>12.5g}  {r.slope:>12.5g}  {r.step:>12.5g}" for r in self.rows
        ]
        return "\n".join(
            [*lines, f"root {self.root!r}" if self.converged else f"not converged: {self.reason}"]
        )


def newton(
    f: Callable[[Any], Any],
    x0: float,
    derivative: Callable[[float], Any] | None = None,
    limit: int = 50,
    accuracy: float = 4 * EPS,
) -> NewtonTable:
    """Solve f(x) = 0 from a first guess by x_{k+1} = x_k − f(x_k)/f′(x_k), with the table of iterates.

    Parameters
    ----------
    f : function of a number
        Made of arithmetic and numpy's functions.
    x0 : float
        The first guess, x1 of the table.
    derivative : function, optional
        f′; without it f′ is taken exactly from f at x + ih (for that f must take complex numbers, and have no |x| in it).
    limit : int
        Steps at most.
    accuracy : float
        The last step over the size of x (or of the first guess, where x is zero).

    Returns
    -------
    NewtonTable
        `.root` is NaN, and `.reason` says why, where the iteration did not converge.

    Raises
    ------
    ValueError
        A first guess that is not finite; an f whose derivative cannot be taken from it, without `derivative`.

    Notes
    -----
    R. Nicoletti, SEM 104, lecture 7 (the method of Newton and Raphson). The imaginary step loses no digit: Im f(x + ih)/h
    with h = 10⁻¹⁰⁰ (W. Squire, G. Trapp, SIAM Rev. 40 (1998) 110).

    Examples
    --------
    The square root of 2 from 1:

    >>> table = newton(lambda x: x * x - 2, 1.0)
    >>> table.converged, table.root
    (True, 1.4142135623730951)
    >>> [round(row.x, 6) for row in table.rows[:4]]
    [1.0, 1.5, 1.416667, 1.414216]
    >>> newton(lambda x: x * x + 1, 1.0).reason
    'f′(0) = 0 at x2: the tangent meets no axis'
    """
    x = float(x0)
    if not isfinite(x):
        raise ValueError(f"x0 = {x0!r}: expected a finite number")
    rows: list[Row] = []
    size = abs(x)
    for k in range(1, limit + 2):
        value = float(np.real(f(x)))
        slope = float(derivative(x)) if derivative is not None else _slope(f, x)
        if not (isfinite(value) and isfinite(slope)):
            rows.append(Row(k, x, value, slope, float("nan")))
            return NewtonTable(tuple(rows), False, f"f or f′ is not finite at x{k} = {x:.6g}")
        if value == 0:
            rows.append(Row(k, x, value, slope, 0.0))
            return NewtonTable(tuple(rows), True)
        if slope == 0:
            rows.append(Row(k, x, value, slope, float("nan")))
            return NewtonTable(tuple(rows), False, f"f′({x:.6g}) = 0 at x{k}: the tangent meets no axis")
        step = -value / slope
        rows.append(Row(k, x, value, slope, step))
        if abs(step) <= accuracy * (abs(x) or size or 1.0):
            return NewtonTable(tuple(rows), True)
        x += step
    return NewtonTable(tuple(rows), False, f"after {limit} steps the last one is still {rows[-1].step:.3g}")


def _slope(f: Callable[[Any], Any], x: float) -> float:
    try:
        moved: Any = f(complex(x, STEP))
    except TypeError:
        moved = None
    value = float(np.real(f(x)))
    # |x|, and a root beyond its cut, are no functions of a complex number near x
    if not np.iscomplexobj(moved) or (np.isfinite(moved) and abs(np.real(moved) - value) > 1e-9 * abs(value)):
        raise ValueError(
            "f′ cannot be taken from f (it has math.sin in place of numpy.sin, |x|, or a root of a negative number): "
            "expected derivative= too"
        )
    return float(np.imag(moved)) / STEP
