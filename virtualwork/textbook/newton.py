"""Newton and Raphson's method for one equation f(x) = 0, with its table of iterates (R. Nicoletti, SEM 104, lecture 7)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite, isnan, nan, sqrt
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
        A first guess that is not finite; a negative limit or accuracy; an f whose derivative cannot be taken from it, without
        `derivative`.

    Notes
    -----
    R. Nicoletti, SEM 104, lecture 7 (the method of Newton and Raphson). The imaginary step loses no digit: Im f(x + ih)/h
    with h = 10⁻¹⁰⁰ (W. Squire, G. Trapp, SIAM Rev. 40 (1998) 110). A small step alone is no proof: beside a pole f/f′ is as
    small as beside a root. What counts as a root has |f| grow on both sides of it.

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
    for name, bound in (("limit", limit), ("accuracy", accuracy)):
        if not bound >= 0:
            raise ValueError(f"{name} = {bound}: expected 0 or more")
    rows: list[Row] = []
    first = abs(x) or 1.0
    for k in range(1, limit + 2):
        value, slope, fault, size = nan, nan, "", abs(x) or first
        try:
            value = _value(f, x)
            slope = nan if derivative is None else float(derivative(x))
        except (ArithmeticError, ValueError) as error:
            fault = str(error)
        if derivative is None and isfinite(value):
            slope = _slope(f, x, value, size)
        step = 0.0 if value == 0 else -value / slope if isfinite(slope) and slope else nan
        rows.append(Row(k, x, value, slope, step))
        if fault:
            reason = f"f or f′ cannot be computed at x{k} = {x:.6g}: {fault}"
        elif slope == 0 and value != 0:
            reason = f"f′({x:.6g}) = 0 at x{k}: the tangent meets no axis"
        elif not isfinite(step):
            reason = f"f or f′ is not finite at x{k} = {x:.6g}"
        elif abs(step) > accuracy * size:
            x += step
            continue
        elif not _crosses(f, x, value, sqrt(max(accuracy, EPS)) * size):
            reason = f"the step is small at x{k} = {x:.6g}, but |f| does not grow on both sides: a pole, or f is zero all around"
        else:
            reason = ""
        return NewtonTable(tuple(rows), not reason, reason)
    return NewtonTable(tuple(rows), False, f"after {limit} steps the last one is still {rows[-1].step:.3g}")


def _value(f: Callable[[Any], Any], x: float) -> float:
    with np.errstate(all="ignore"):
        value = f(x)
    if np.imag(value):
        raise ValueError("f is not real there")
    return float(np.real(value))


def _crosses(f: Callable[[Any], Any], x: float, value: float, apart: float) -> bool:
    """Whether |f| grows from x to both sides, or to the one where it has a number."""
    beside = []
    for near in (x - apart, x + apart):
        with suppress(ArithmeticError, ValueError):
            beside.append(abs(_value(f, near)))
    numbers = [v for v in beside if not isnan(v)]
    return any(numbers) and min(numbers) >= 2 * abs(value)


def _slope(f: Callable[[Any], Any], x: float, value: float, size: float) -> float:
    try:
        with np.errstate(all="ignore"):
            moved: Any = f(complex(x, STEP))
    except TypeError:
        moved = None
    if np.iscomplexobj(moved):
        slope = float(np.imag(moved)) / STEP
        # at a root f is rounding alone, and its scale is what it reaches over the size of x; a slope goes with h
        reach = abs(slope) * size if abs(np.imag(moved)) < sqrt(STEP) * abs(value) else 0.0
    # |x|, and a root beyond its cut, are no functions of a complex number near x
    if not np.iscomplexobj(moved) or (value and abs(np.real(moved) - value) > 1e-9 * max(abs(value), reach)):
        raise ValueError(
            "f′ cannot be taken from f (it has math.sin in place of numpy.sin, |x|, or a root of a negative number): "
            "expected derivative= too"
        )
    return slope
