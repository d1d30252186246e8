"""The constants of a heavy top's motion, from its cubic's three roots: computed with 200 digits."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.shapes import is_doubled

Array = NDArray[np.float64]

DIGITS = 200


def constants(I: Array, mgl: Array, omega: Array, q: Array) -> dict[str, Decimal]:
    """The roots of the cubic and what follows from them, to 200 digits; of moments (3,), floats or doubled numbers."""
    with localcontext() as context:
        context.prec = DIGITS
        A, _, C = _decimals(I)
        a = abs(_decimals(mgl)[0])
        w1, w2, w3 = _decimals(omega)
        w, x, y, z = _decimals(q)
        norm = w * w + x * x + y * y + z * z
        # (1 ± u)/2
        up, down = (w * w + z * z) / norm, (x * x + y * y) / norm
        g1, g2 = 2 * (x * z - w * y) / norm, 2 * (y * z + w * x) / norm
        across = A * (w1 * g1 + w2 * g2)
        # Lz ± L3
        plus, minus = across + 2 * C * w3 * up, across - 2 * C * w3 * down
        swing = w1 * w1 + w2 * w2
        u = up - down
        still = swing == 0 and (up == 0 or down == 0)
        if still or a == 0:
            return _uniform(up, down)
        L3, Lz = C * w3, (plus + minus) / 2
        k = 1 / (2 * a * A)
        e = A * swing / (2 * a) + u
        c2, c1, c0 = -e - k * L3 * L3, -1 + 2 * k * Lz * L3, e - k * Lz * Lz
        u3 = _largest_root(c2, c1, c0)
        s = -c2 - u3
        product = c1 - u3 * s
        half = max(s * s / 4 - product, Decimal(0)).sqrt()
        u1, u2 = max(s / 2 - half, Decimal(-1)), min(s / 2 + half, Decimal(1))
        u1, u2, u3 = min(u1, u), max(u2, u), max(u3, Decimal(1))
        above, below, beyond = 1 + u1, 1 - u2, u3 - 1
        tiny = Decimal(10) ** (-DIGITS // 2 + 5)
        if plus == 0:
            above = Decimal(0)
        if minus == 0:
            if below < beyond or below < tiny:
                below = Decimal(0)
            if beyond < below or beyond < tiny:
                beyond = Decimal(0)
        u1, u2, u3 = above - 1, 1 - below, 1 + beyond
        span, wide = u2 - u1, u3 - u1
        # steady precession
        if span < tiny:
            span = Decimal(0)
        m, m1 = span / wide, (below + beyond) / wide
        rate = (a * wide / (2 * A)).sqrt()
        scale = 2 * A * rate
        sn2 = min(max((u - u1) / span, Decimal(0)), Decimal(1)) if span else Decimal(0)
        rising = g1 * w2 - g2 * w1 >= 0
        sn, cn = sn2.sqrt(), (1 - sn2).sqrt()
        return {
            "still": Decimal(0),
            "m": m,
            "m1": m1,
            "rate": rate,
            "span": span,
            "above": above,
            "below": below,
            "plus": plus,
            "minus": minus,
            "sn": sn if rising else -sn,
            "cn": cn,
            **_phase(plus, above, span, m * above / span if span else Decimal(0), m, scale, "plus"),
            **_phase(minus, below, m * beyond, below / beyond if beyond else Decimal(0), m, scale, "minus"),
        }


def _decimals(numbers: Array) -> list[Decimal]:
    """Numbers as they are exactly."""
    if is_doubled(numbers):
        pairs = zip(numbers.high.ravel().tolist(), numbers.low.ravel().tolist(), strict=True)
        return [Decimal(high) + Decimal(low) for high, low in pairs]
    return [Decimal(x) for x in np.ravel(numbers).tolist()]


def _phase(
    push: Decimal, least: Decimal, wide: Decimal, inverse: Decimal, m: Decimal, scale: Decimal, name: str
) -> dict[str, Decimal]:
    """The weights of one phase: push/(scale·least) ∫ du/(1 + n sn²), n = wide/least, and m/n = inverse."""
    root = (least * (least + wide) * (1 + inverse)).sqrt()
    line = push / (scale * least) if least else Decimal(0)
    if name == "plus":
        arc = push / (scale * root) if root else Decimal(1)
        rest = push * m / (scale * wide) if wide else Decimal(0)
    else:
        # (1 + m/n)/G, and the weight of the straight part where the turn is sharp: m/n of `line`
        arc = push * (1 + inverse) / (scale * root) if root else Decimal(1)
        rest = Decimal(0)
        if wide and least * least * m < wide * wide:
            line = push * m / (scale * wide)
    most = Decimal(10) ** 290
    n = wide / least if least and wide < least * most else most if wide else Decimal(0)
    steep = Decimal(10) ** 200
    g = steep if n >= most else ((1 + wide / least) * (1 + inverse)).sqrt() if least else Decimal(1)
    # on the way to the sleeping position β keeps its direction
    if not wide and not least:
        arc = Decimal(0)
    return {
        f"n_{name}": n,
        f"{name}_g": g,
        f"{name}_line": line,
        f"{name}_arc": arc,
        f"{name}_rest": rest,
    }


def _uniform(up: Decimal, down: Decimal) -> dict[str, Decimal]:
    """The constants of a top that needs none: its weight has no lever, or it stands or hangs still."""
    zero = ["m1", "span", "sn", "plus", "minus", "n_plus", "n_minus"]
    zero += [f"{sign}_{name}" for name in ("g", "line", "arc", "rest") for sign in ("plus", "minus")]
    one = dict.fromkeys(("still", "m", "rate", "cn"), Decimal(1))
    return dict.fromkeys(zero, Decimal(0)) | one | {"above": 2 * up, "below": 2 * down}


def _largest_root(c2: Decimal, c1: Decimal, c0: Decimal) -> Decimal:
    """The largest root of u³ + c2 u² + c1 u + c0 with three real ones: Newton from the right never overshoots."""
    u = 1 + max(abs(c2), abs(c1), abs(c0))
    for _ in range(1000):
        slope = (3 * u + 2 * c2) * u + c1
        value = ((u + c2) * u + c1) * u + c0
        if slope <= 0 or value <= 0:
            break
        step = value / slope
        u -= step
        if step <= abs(u) * Decimal(10) ** (5 - DIGITS):
            break
    return u
