"""A four-bar in closed form, on numbers of any kind of mpmath."""

from __future__ import annotations

from typing import Any

import mpmath as mp


def circles(p: Any, r1: Any, q: Any, r2: Any, side: int) -> tuple[Any, Any]:
    """Return the point at r1 from p and r2 from q, left of p → q (`side` 1) or right (−1); and (height / |q − p|)².

    Where the circles do not meet the second is negative, and the point None.
    """
    base = q - p
    s = abs(base) ** 2
    along = (s + r1**2 - r2**2) / (2 * s)
    h2 = r1**2 / s - along**2
    return (p + base * mp.mpc(along, side * mp.sqrt(h2)) if h2 > 0 else None), h2


def coupler_point(a: Any, b: Any, c: Any, d: Any, angle: Any, side: int, omega: Any) -> Any:
    """Return C, its velocity and acceleration, and (h/size)²; None where the circles do not meet."""
    crank = a * mp.expj(angle)
    pin, h2 = circles(crank, b, d, c, side)
    if pin is None:
        return None
    v, w = mp.mpc(0, omega) * crank, -(omega**2) * crank
    p, q = pin - crank, pin - d
    # C turns about B and about D: v + iω₃p = iω₄q, then the accelerations likewise
    w3, w4 = two_rates(p, q, -v)
    rest = -w + w3**2 * p - w4**2 * q
    _, a4 = two_rates(p, q, rest)
    return pin, mp.mpc(0, w4) * q, mp.mpc(0, a4) * q - w4**2 * q, h2


def two_rates(p: Any, q: Any, right: Any) -> tuple[Any, Any]:
    """Solve i·x·p - i·y·q = right for real x, y."""
    cross = mp.im(mp.conj(p) * q)
    r = right / mp.mpc(0, 1)
    return mp.im(mp.conj(r) * q) / cross, mp.im(mp.conj(r) * p) / cross
