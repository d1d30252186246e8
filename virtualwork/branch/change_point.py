"""The tangent through a change point, and every higher derivative there.

Where the Jacobian Φ of a group vanishes while its loops still close on both sides, two branches cross. With the left
null vector n of Φ, the n-component of the k-th derivative of the loops holds no k-th derivative of the unknowns:
at k = 2 it is a quadratic in the free rate along Φ's null vector, whose two roots are the tangents of the two
branches; at k > 2 it is linear in the free (k−1)-th rate. So the branch goes on smoothly, with exact derivatives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from virtualwork.formulas.newton import stack, stack_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from virtualwork.assur import Group
    from virtualwork.formulas.positions import Jets

    Reals = NDArray[np.float64]


def branches(group: Group, jets: Callable[[], Jets], order: int) -> list[list[Reals]]:
    """The derivatives [x′, x″, ... x⁽ᵒʳᵈᵉʳ⁾] of a group's unknowns on each branch through a change point.

    Parameters
    ----------
    jets : callable
        Gives fresh `Jets` at the change point, with everything the group hangs on known to order + 1.

    Returns
    -------
    list of branches
        Two where two tangents cross; one where both fall together; none where the tangent is not determined.
    """
    d = jets()
    jacobian = stack(d.columns(group), 1)[0]
    if not np.isfinite(jacobian).all():
        return []  # what the group hangs on is not assembled here
    u, s, vt = np.linalg.svd(jacobian)
    left, null = u[:, -1], vt[-1]
    span = len(s) - 1

    def particular(right: Reals) -> Reals:
        """The solution of Φ·x = −right without a component along the null vector."""
        return np.asarray(vt[:span].T @ ((u[:, :span].T @ -right) / s[:span]))

    def gap(d: Jets, k: int) -> Reals:
        return np.asarray(stack_rows(d.right_side(group, k), 1)[0])

    base = particular(gap(d, 1))

    def second(rate: float) -> float:
        trial = jets()
        trial.right_side(group, 1)
        trial.write(group, 1, list(base + rate * null))
        return float(left @ gap(trial, 2))

    c, plus, minus = second(0.0), second(1.0), second(-1.0)
    a, b = (plus + minus) / 2 - c, (plus - minus) / 2
    found = []
    for rate in _roots(a, b, c):
        trial = jets()
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
