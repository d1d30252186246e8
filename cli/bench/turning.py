"""Stress of rotations in time: free bodies and heavy tops near every special case, against Taylor series of 40 digits."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidbody3d import FreeBody, FreeState, Top, TopState, Trajectory

Real = NDArray[np.float64]
Pairs = list[tuple[float, float]]
State = list[int]

BITS = 160
ONE = 1 << BITS
ORDER = 34


def _fixed(x: Any) -> int:
    return round(Fraction(x) * ONE)


def _power_of_two(x: float) -> Fraction:
    return Fraction(2) ** int(np.floor(np.log2(float(x))))


def _step(inertia: list[int], mgl: int, state: State, left: int) -> tuple[State, int]:
    """Advance ω and q by the power series of Euler's equations and q' = q·(0, ω)/2, as far as 40 digits reach."""
    c = [[x] for x in state]
    w, q = c[:3], c[3:]

    def product(x: list[int], y: list[int]) -> int:
        total: int = sum(map(mul, x, reversed(y)))
        return total >> BITS

    for n in range(ORDER):
        torque = [0, 0, 0]
        if mgl:  # of the weight, in body axes
            torque[0] = mgl * (2 * (product(q[2], q[3]) + product(q[0], q[1]))) >> BITS
            torque[1] = mgl * (2 * (product(q[0], q[2]) - product(q[1], q[3]))) >> BITS
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
    inertia: Any, omega: Any, time: Any, attitude: Any = (1, 0, 0, 0), mgl: float = 0.0
) -> tuple[list[Fraction], list[Fraction]]:
    """Return ω and q at a time from exact data, as fractions of some 40 digits; in units that are powers of two."""
    heavy, fast = (
        _power_of_two(max(inertia)),
        _power_of_two(max(float(np.linalg.norm(np.array(omega, dtype=float))), 1e-300)),
    )
    if mgl:
        fast = max(fast, _power_of_two(np.sqrt(abs(mgl) / max(inertia))))
    moments = [_fixed(Fraction(x) / heavy) for x in inertia]
    state = [*(_fixed(Fraction(x) / fast) for x in omega), *map(_fixed, attitude)]
    left, push = _fixed(Fraction(time) * fast), _fixed(Fraction(mgl) / (heavy * fast * fast))
    length = sum(x * x for x in state[3:])
    while left:
        state, left = _step(moments, push, state, left)
    if abs(sum(x * x for x in state[3:]) - length) > length >> 100:
        raise ArithmeticError("the series has lost the length of the quaternion")
    return [Fraction(x, ONE) * fast for x in state[:3]], [Fraction(x, ONE) for x in state[3:]]


def exact_period(inertia: Any, omega: Any) -> Fraction:
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


def compare(found: FreeState | TopState | Trajectory, omega: list[Fraction], q: list[Fraction]) -> Pairs:
    """Return errors and bounds of a state at one time: its attitude, and the component of ω worst for its bound."""
    mine = [Fraction(float(x)) for x in found.attitude[0]]
    length = Fraction(float(sum(x * x for x in q)) ** 0.5)
    sign = 1 if sum(x * y for x, y in zip(mine, q, strict=True)) > 0 else -1
    # the angle between two attitudes is twice that between their quaternions
    apart = sum((sign * x - y / length) ** 2 for x, y in zip(mine, q, strict=True))
    off = [float(abs(Fraction(float(x)) - y)) for x, y in zip(found.omega[0], omega, strict=True)]
    bound = found.error_estimate("omega")[0].tolist()
    worst = max(range(3), key=lambda i: off[i] / bound[i] if bound[i] > 0 else np.inf * (off[i] > 0))
    return [(2 * float(apart) ** 0.5, float(found.error_estimate()[0])), (off[worst], bound[worst])]


def _free(inertia: Real, omega: Real, time: float) -> Pairs:
    moments, w = inertia.tolist(), omega.tolist()
    return compare(FreeBody(moments, w).at(np.array([time])), *taylor(moments, w, time))


def _time(rng: np.random.Generator, omega: Real) -> float:
    return float(10.0 ** rng.uniform(-1, 1) / np.linalg.norm(omega))


def _anybody(rng: np.random.Generator) -> Pairs:
    scale = 10.0 ** rng.uniform(-12, 12)
    a, b = rng.uniform(0.1, 2, 2)
    c = rng.uniform(max(abs(a - b), 0.02), a + b)
    omega = rng.normal(size=3) * 10.0 ** rng.uniform(-6, 0, 3) * 10.0 ** rng.uniform(-6, 6)
    return _free(scale * np.array([a, b, c]), omega, _time(rng, omega))


def _nearly_symmetric(rng: np.random.Generator) -> Pairs:
    """Two moments all but equal; in half the cases turning so that the momentum crosses the separatrix's neighbourhood."""
    near, other = 10.0 ** rng.uniform(-15, -1), rng.uniform(0.1, 1.9)
    moments = np.array([1.0, 1 + near, other])
    omega = rng.normal(size=3)
    if rng.integers(2):
        omega[2] *= np.sqrt(near) * 10.0 ** rng.uniform(-2, 1)
    turn = rng.permutation(3)
    return _free(moments[turn], omega[turn], _time(rng, omega))


def _nearly_flat(rng: np.random.Generator) -> Pairs:
    a, b = rng.uniform(0.05, 2, 2)
    moments = np.array([a, b, (a + b) * (1 - 10.0 ** rng.uniform(-15, -1))])
    omega = rng.normal(size=3) * 10.0 ** rng.uniform(-3, 0, 3)
    return _free(moments, omega, _time(rng, omega))


def _separatrix(rng: np.random.Generator) -> Pairs:
    """Near the middle axis, and anywhere on the separatrix, to 1e-1 … 1e-15."""
    x, y, z = rng.uniform(0.1, 1, 3)
    I1, I2, I3 = np.sort([y + z, x + z, x + y])
    omega = rng.normal(size=3)
    if rng.integers(2):
        omega[[0, 2]] *= 10.0 ** rng.uniform(-15, -1)
    omega[2] = (
        omega[0]
        * np.sqrt(I1 * (I2 - I1) / (I3 * (I3 - I2)))
        * (1 + rng.normal() * 10.0 ** rng.uniform(-16, 0))
    )
    return _free(np.array([I1, I2, I3]), omega, _time(rng, omega))


def _dot(a: list[Fraction], b: list[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def _oblique(rng: np.random.Generator) -> Pairs:
    """Tensors in oblique axes, two moments in half the cases nearly equal: against principal axes in fractions."""
    # a rational rotation, so that the tensor of doubles has doubles as principal moments all but exactly
    w, x, y, z = (int(v) for v in rng.integers(-3, 4, 4) * 2 + 1)
    size = w * w + x * x + y * y + z * z
    R = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    # moments with few bits: size² R D Rᵀ is exact, and so is the tensor in these units
    small = rng.integers(1, 2**20, 3)
    moments = np.array([small[1] + small[2], small[0] + small[2], small[0] + small[1]])
    if rng.integers(2):
        moments[1] = moments[0] + 1
    tensor = (R @ np.diag(moments) @ R.T).astype(float)
    spin = rng.normal(size=3)
    time = _time(rng, spin)
    found = FreeBody(tensor, spin).at(np.array([time]))
    inward = [[Fraction(int(R[j, i]), size) for j in range(3)] for i in range(3)]
    omega = [_dot(row, [Fraction(float(x)) for x in spin]) for row in inward]
    own, q = taylor([Fraction(int(m)) * size**2 for m in moments], omega, time)
    back = [_dot([row[i] for row in inward], own) for i in range(3)]
    # the turn of the principal axes, seen in the given ones: the same angle about the turned axis
    vector = [_dot([row[i] for row in inward], q[1:]) for i in range(3)]
    return compare(found, back, [q[0], *vector])


# --- tops ---


def _top(rng: np.random.Generator, omega: Real, tilt: float, I3: float, mgl: float) -> Pairs:
    """A top at a tilt, ω in axes of which the first is level, anywhere in azimuth and in scales of mass and time."""
    heavy, pace = 10.0 ** rng.uniform(-12, 12), 10.0 ** rng.uniform(-6, 6)
    turn = rng.uniform(0, np.pi)
    q = np.array(
        [
            np.cos(tilt / 2) * np.cos(turn),
            np.sin(tilt / 2) * np.cos(turn),
            np.sin(tilt / 2) * np.sin(turn),
            np.cos(tilt / 2) * np.sin(turn),
        ]
    )
    q /= np.linalg.norm(q)
    inertia, w = (heavy * np.array([1.0, 1.0, I3])).tolist(), (pace * omega).tolist()
    weight = float(heavy * pace**2 * mgl)
    time = _time(rng, np.array([*omega, np.sqrt(abs(mgl))])) / pace
    found = Top(inertia, weight, w, q).at(np.array([time]))
    # the data are the quaternion's direction
    return compare(found, *taylor(inertia, w, time, q.tolist(), weight))


def _any_top(rng: np.random.Generator) -> Pairs:
    omega = rng.normal(size=3) * 10.0 ** rng.uniform(-2, 1, 3)
    return _top(
        rng, omega, rng.uniform(0, np.pi), rng.uniform(0.05, 2), rng.normal() * 10.0 ** rng.uniform(-2, 1)
    )


def _near_sleeping(rng: np.random.Generator) -> Pairs:
    """Upright to 1e-9 … 0.1 rad, the spin near the sleeping threshold, or hanging."""
    I3 = rng.uniform(0.2, 2)
    mgl = rng.uniform(0.3, 2)
    spin = 2 * np.sqrt(mgl) / I3 * (1 + rng.normal() * 10.0 ** rng.uniform(-15, 0))
    small = 10.0 ** rng.uniform(-9, -1, 3) * [1, rng.integers(2), rng.integers(2)]
    return _top(rng, np.array([small[1], small[2], spin]), small[0], I3, mgl * rng.choice([-1, 1]))


def _near_cusp(rng: np.random.Generator) -> Pairs:
    """Let go without precession, but for a push of 1e-15 … 0.1: the axis comes to rest at the top of each nod."""
    I3, mgl = rng.uniform(0.2, 2), rng.uniform(0.3, 2)
    push = rng.normal(size=2) * 10.0 ** rng.uniform(-15, -1)
    return _top(rng, np.array([*push, rng.normal() * 4]), rng.uniform(0.05, 3), I3, mgl)


def _near_vertical(rng: np.random.Generator) -> Pairs:
    """The momenta about the vertical and about the axis all but equal: each nod passes close to the vertical."""
    I3, mgl, tilt, spin = rng.uniform(0.2, 2), rng.uniform(0.3, 2), rng.uniform(0.2, 2.9), rng.normal() * 2
    # L_z = ± L_3, where ω2 is about the axis across that rises
    side = rng.choice([-1, 1])
    level = (
        I3 * spin * (side - np.cos(tilt)) / np.sin(tilt) * (1 + rng.normal() * 10.0 ** rng.uniform(-15, -1))
    )
    return _top(rng, np.array([rng.normal(), level, spin]), tilt, I3, mgl)


CAMPAIGNS: dict[str, tuple[str, Callable[[np.random.Generator], Pairs]]] = {
    "free bodies": ("random moments and velocities, scales 1e-12 … 1e12", _anybody),
    "nearly symmetric bodies": ("two moments that differ by 1e-1 … 1e-15", _nearly_symmetric),
    "nearly flat bodies": ("the triangle inequality met to 1e-1 … 1e-15", _nearly_flat),
    "bodies near the separatrix": ("the middle axis missed by 1e-1 … 1e-15", _separatrix),
    "bodies in oblique axes": ("tensors with products of inertia, moments that are nearly equal", _oblique),
    "heavy tops": ("random tops, either side up, scales 1e-12 … 1e12", _any_top),
    "tops near sleeping": ("upright or hanging to 1e-1 … 1e-9 rad, near the threshold", _near_sleeping),
    "tops near a cusp": ("let go with a push of 1e-1 … 1e-15", _near_cusp),
    "tops that pass the vertical": ("missing it by 1e-1 … 1e-15", _near_vertical),
}
