"""A closed form's radicand along the input: where it touches zero, and where it crosses it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from virtualwork.branch.roots import chebyshev_nodes, real_roots
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.numbers import EPS, Number, Reals

# of a group, at inputs (n,)
Radicand = Callable[[Reals], Reals]


def lowest(margin: Radicand, a: float, b: float, rounding: float) -> tuple[float, float, float] | None:
    """The lowest point of a radicand near a sampled dip: where, how low, and the rounding in that depth.

    The radicand is smooth: it is fitted at Chebyshev points, and its slope's root is free of cancellation.
    """
    centre, half = (a + b) / 2, (b - a) / 2
    for widen in (1.0, 4.0):
        nodes = chebyshev_nodes(14)
        m = margin(centre + widen * half * nodes)
        if not np.isfinite(m).all():
            if widen == 1.0:
                return None
            break
        fit = np.polynomial.Chebyshev.fit(nodes, m, 11, domain=[-1, 1])
        real = real_roots(fit.deriv(), 1.2)
        if not len(real):
            return None
        best = real[np.argmin(np.abs(fit(real)))]
        where, depth = centre + widen * half * float(best), float(fit(best))
        level = float(np.abs(m).max())
        centre = where
    return where, depth, rounding + 1e-9 * EPS * level


def crossing(margin: Radicand, a: float, b: float) -> tuple[float, int]:
    """The radicand's crossing between a and b: regula falsi (Illinois), then the last bits by bisection.

    Returns it, and on which side of it the group is assembled, ±1.
    """
    fa, fb = (float(margin(np.array([q]))[0]) for q in (a, b))
    side = -1 if fa >= 0 else 1
    for _ in range(200):
        if fa == 0 or fb == 0 or abs(b - a) <= 2 * EPS * max(abs(a), abs(b)):
            break
        q = b - fb * (b - a) / (fb - fa)
        if not min(a, b) < q < max(a, b):
            q = (a + b) / 2
            if q in (a, b):
                break
        f = float(margin(np.array([q]))[0])
        if (f >= 0) != (fb >= 0):
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = q, f
    return (a if abs(fa) < abs(fb) else b), side


def rounding(case: Case, size: float) -> float:
    """The rounding of a group's radicand, by its shortest arm and the mechanism's size."""
    shortest = min((abs(a) for a in case.arms if a), default=size)
    return 256 * EPS * (1 + (size / shortest) ** 2 if shortest else 1)


def vanishes(margin: Number, noise: float) -> bool:
    """Whether a radicand is zero to rounding wherever there is one."""
    m = np.abs(np.atleast_1d(margin))
    m = m[np.isfinite(m)]
    return len(m) > 4 and bool((m <= noise).all())
