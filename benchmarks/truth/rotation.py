"""Free bodies and heavy tops in time, in 40 digits: power series of nothing but the equations of motion, in integers."""

from __future__ import annotations

import math
from decimal import Decimal, localcontext
from fractions import Fraction
from math import isqrt
from operator import mul
from typing import Any

import numpy as np

State = list[int]

BITS = 160
ONE = 1 << BITS
ORDER = 34


def _fixed(x: Any) -> int:
    return round(Fraction(x) * ONE)


def _power_of_two(x: float) -> Fraction:
    return Fraction(2) ** int(np.floor(np.log2(float(x))))


def _step(inertia: list[int], mgl: int, given: list[int], state: State, left: int) -> tuple[State, int]:
    """Advance ω and q by the power series of Euler's equations and q' = q·(0, ω)/2, as far as 40 digits reach."""
    c = [[x] for x in state]
    w, q = c[:3], c[3:]

    def product(x: list[int], y: list[int]) -> int:
        total: int = sum(map(mul, x, reversed(y)))
        return total >> BITS

    for n in range(ORDER):
        torque = given if n == 0 else [0, 0, 0]
        if mgl:  # of the weight, in body axes
            torque = torque.copy()
            torque[0] += mgl * (2 * (product(q[2], q[3]) + product(q[0], q[1]))) >> BITS
            torque[1] += mgl * (2 * (product(q[0], q[2]) - product(q[1], q[3]))) >> BITS
        # all products of order n before anything of order n + 1 is appended
        new = []
        for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            rise = ((inertia[i] - inertia[j]) * product(w[i], w[j]) >> BITS) + torque[k]
            new.append((rise << BITS) // inertia[k])
        new += [
            (-product(q[1], w[0]) - product(q[2], w[1]) - product(q[3], w[2])) // 2,
            (product(q[0], w[0]) + product(q[2], w[2]) - product(q[3], w[1])) // 2,
            (product(q[0], w[1]) + product(q[3], w[0]) - product(q[1], w[2])) // 2,
            (product(q[0], w[2]) + product(q[1], w[1]) - product(q[2], w[0])) // 2,
        ]
        for series, value in zip(c, new, strict=True):
            series.append(value // (n + 1))
    # by several of the last terms: one alone may happen to be next to nothing
    reach = np.inf
    for n in range(ORDER - 3, ORDER + 1):
        size = max(abs(series[n]) for series in c) / ONE
        reach = min(reach, (1e-42 / size) ** (1 / n) if size > 0 else np.inf)
    h = left if abs(left) <= reach * ONE else _fixed(np.copysign(reach, left))
    advanced = []
    for series in c:
        total = 0
        for value in reversed(series):
            total = (total * h >> BITS) + value
        advanced.append(total)
    return advanced, left - h


def taylor(
    inertia: Any,
    omega: Any,
    time: Any,
    attitude: Any = (1, 0, 0, 0),
    mgl: float = 0.0,
    torque: Any = (0, 0, 0),
) -> tuple[list[Fraction], list[Fraction]]:
    """Return ω and q at a time from exact data, as fractions of some 40 digits; in units that are powers of two."""
    heavy, fast = (
        _power_of_two(max(inertia)),
        _power_of_two(max(float(np.linalg.norm(np.array(omega, dtype=float))), 1e-300)),
    )
    if mgl:
        fast = max(fast, _power_of_two(math.sqrt(abs(mgl) / max(inertia))))
    moments = [_fixed(Fraction(x) / heavy) for x in inertia]
    direction = [_fixed(x) for x in attitude]
    # the weight's torque would feel a length of 1 + 1e-16
    size = isqrt(sum(x * x for x in direction))
    state = [*(_fixed(Fraction(x) / fast) for x in omega), *((x << BITS) // size for x in direction)]
    left, push = _fixed(Fraction(time) * fast), _fixed(Fraction(mgl) / (heavy * fast * fast))
    given = [_fixed(Fraction(x) / (heavy * fast * fast)) for x in torque]
    length = sum(x * x for x in state[3:])
    while left:
        state, left = _step(moments, push, given, state, left)
    if abs(sum(x * x for x in state[3:]) - length) > length >> 100:
        raise ArithmeticError("the series has lost the length of the quaternion")
    return [Fraction(x, ONE) * fast for x in state[:3]], [Fraction(x, ONE) for x in state[3:]]


def period_of(inertia: Any, omega: Any) -> Fraction:
    """Return the period of ω of a free body to 50 digits: 4 K/λ, by the arithmetic-geometric mean."""
    pairs = sorted(zip(map(Fraction, inertia), map(Fraction, omega), strict=True))
    (I1, w1), (I2, w2), (I3, w3) = pairs
    # in units of ω, whose powers would overflow the digits
    fast = _power_of_two(max(abs(float(w)) for w in (w1, w2, w3)))
    w1, w2, w3 = w1 / fast, w2 / fast, w3 / fast
    low, high = I1 * (I2 - I1) * w1**2, I3 * (I3 - I2) * w3**2
    c3 = (I1 * (I3 - I1) * w1**2 + I2 * (I3 - I2) * w2**2) / I3
    c1 = (I3 * (I3 - I1) * w3**2 + I2 * (I2 - I1) * w2**2) / I1
    big = max(c3 * (I2 - I1) / (I1 * I2), c1 * (I3 - I2) / (I2 * I3))
    m1 = (I3 - I1) / (I1 * I3) * abs(low - high) / I2 / big
    with localcontext() as context:
        context.prec = 60
        a, b = Decimal(1), _decimal(m1).sqrt()
        while abs(a - b) > Decimal(10) ** -55:
            a, b = (a + b) / 2, (a * b).sqrt()
        pi = Decimal("3.14159265358979323846264338327950288419716939937510582097494")
        return Fraction(2 * pi / a / _decimal(big).sqrt()) / fast


def _decimal(x: Fraction) -> Decimal:
    return Decimal(x.numerator) / Decimal(x.denominator)


def power(q: list[Fraction], count: int) -> list[Fraction]:
    """Return a quaternion of 50 digits multiplied with itself."""
    result = [Fraction(1), Fraction(0), Fraction(0), Fraction(0)]
    for digit in bin(count)[2:]:
        result = product(result, result)
        if digit == "1":
            result = product(result, q)
    return result


def product(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    w, x, y, z = a
    W, X, Y, Z = b
    product = (
        w * W - x * X - y * Y - z * Z,
        w * X + x * W + y * Z - z * Y,
        w * Y - x * Z + y * W + z * X,
        w * Z + x * Y - y * X + z * W,
    )
    return [Fraction(round(v * 2**180), 2**180) for v in product]
