"""A change point: the tangents through it, and every higher derivative there.

Where the Jacobian Φ of a group vanishes while its loops still close on both sides, two branches cross. With the left
null vector n of Φ, the n-component of the k-th derivative of the loops holds no k-th derivative of the unknowns:
at k = 2 it is a quadratic in the free rate along Φ's null vector, whose two roots are the tangents of the two
branches; at k > 2 it is linear in the free (k−1)-th rate. So the branch goes on smoothly, with exact derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np

from virtualwork.formulas.linear import stack, stack_rows
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Group


@dataclass(frozen=True)
class ChangePoint:
    """Where a group's two branches cross: the input, the unknowns there, and their derivatives.

    `turn` and `slide` are the unknowns at the point; `rates[k−1]` their k-th derivatives along the branch taken.
    """

    group: str
    input: float
    turn: tuple[complex, ...]
    slide: tuple[float, ...]
    rates: Any
    reach: float
    # first rates of the branch not taken
    other: Any = None

    def unknown(self, delta: Number, order: int) -> Any:
        """The unknowns' derivatives of one order at a distance from the point (order 0: their change)."""
        n = len(self.rates)
        total = np.zeros((*np.shape(delta), len(self.rates[0])))
        for j in range(n - order, -1, -1):
            k = order + j
            if k == 0:
                continue
            total = total + np.multiply.outer(delta**j, self.rates[k - 1]) / factorial(j)
        return total


def branches(group: Group, start: Callable[[], Rates], order: int) -> list[list[Reals]]:
    """The derivatives [x′, x″, ... x⁽ᵒʳᵈᵉʳ⁾] of a group's unknowns on each branch through a change point.

    Parameters
    ----------
    start : callable
        Gives fresh `Rates` at the change point, with everything the group hangs on known to order + 1.

    Returns
    -------
    list of branches
        Two where two tangents cross; one where both fall together; none where the tangent is not determined.
    """
    d = start()
    jacobian = stack(d.columns(group), 1)[0]
    if not np.isfinite(jacobian).all():
        return []  # what the group hangs on is not assembled here
    u, s, vt = np.linalg.svd(jacobian)
    left, null = u[:, -1], vt[-1]
    span = len(s) - 1

    def particular(right: Reals) -> Reals:
        """The solution of Φ·x = −right without a component along the null vector."""
        return np.asarray(vt[:span].T @ ((u[:, :span].T @ -right) / s[:span]))

    def gap(d: Rates, k: int) -> Reals:
        return np.asarray(stack_rows(d.right_side(group, k), 1)[0])

    base = particular(gap(d, 1))

    def second(rate: float) -> float:
        trial = start()
        trial.right_side(group, 1)
        trial.write(group, 1, list(base + rate * null))
        return float(left @ gap(trial, 2))

    c, plus, minus = second(0.0), second(1.0), second(-1.0)
    a, b = (plus + minus) / 2 - c, (plus - minus) / 2
    found = []
    for rate in _roots(a, b, c):
        trial = start()
        trial.right_side(group, 1)
        series = [base + rate * null]
        trial.write(group, 1, list(series[0]))
        slope = 2 * a * rate + b
        for k in range(2, order + 1):
            x = particular(gap(trial, k))
            trial.write(group, k, list(x))
            rest = float(left @ gap(trial, k + 1))
            # the (k+1)-th derivative holds (k+1)·n·(f_xx x′ + f_xq)·x⁽ᵏ⁾; at k = 1 it is twice, which is the slope
            mu = -rest / (slope * (k + 1) / 2) if slope != 0 else np.nan
            x = x + mu * null
            trial.write(group, k, list(x))
            series.append(x)
        found.append(series)
    return found


def _roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a·x² + b·x + c without cancellation."""
    scale = max(abs(a), abs(b), abs(c))
    if scale == 0:
        return []
    if abs(a) <= 1e-14 * scale:
        return [-c / b] if b else []
    inside = b * b - 4 * a * c
    if inside < -1e-9 * scale * scale:
        return []
    q = -0.5 * (b + np.copysign(np.sqrt(max(inside, 0.0)), b))
    roots = [q / a, c / q] if q else [0.0, -b / a]
    return [float(r) for r in roots]
