"""Stress of rotations in time: free bodies and heavy tops near every special case, against power series of 40 digits."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from benchmarks.stress.pairs import Pairs
from benchmarks.truth.rotation import period_of, power, taylor
from rigidbody3d import FreeBody, FreeState, Top, TopState, Trajectory, integrate
from rigidbody3d.attitude import angle_between

Real = NDArray[np.float64]


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
        moments[2] = min(moments[2], moments[0] + moments[1])
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
    """Released without precession, but for a push of 1e-15 … 0.1: the axis comes to rest at the top of each nod."""
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


# --- what is kept, what comes back, what is integrated ---


def _there_and_back(rng: np.random.Generator) -> Pairs:
    """Momentum and energy from the state itself, at moments and motions near every special case."""
    moments = np.sort(rng.uniform(0.05, 1, 3))
    moments = np.array([moments[0] + moments[1], moments[1] + moments[2], moments[2] + moments[0]])
    near = 10.0 ** rng.uniform(-16, 0)
    if rng.integers(2):
        moments[1] = moments[0] * (1 + near)
        # no body has a moment above the sum of the others
        moments[2] = min(moments[2], moments[0] + moments[1])
    omega = rng.normal(size=3) * 10.0 ** rng.uniform(-12, 0, 3) * 10.0 ** rng.uniform(-6, 6)
    if rng.integers(2):  # near the separatrix
        I1, I2, I3 = np.sort(moments)
        order = np.argsort(moments)
        if I3 > I2 > I1:
            ratio = np.sqrt(I1 * (I2 - I1) / (I3 * (I3 - I2)))
            omega[order[2]] = ratio * omega[order[0]] * (1 + near * rng.normal())
    size = float(np.linalg.norm(omega))
    body = FreeBody(moments, omega)
    state = body.at(rng.uniform(-100, 100) / size)
    H = [Fraction(a) * Fraction(b) for a, b in zip(moments.tolist(), omega.tolist(), strict=True)]
    E = sum((a * Fraction(b) for a, b in zip(H, omega.tolist(), strict=True)), Fraction(0)) / 2
    off = max(abs(Fraction(float(a)) - b) for a, b in zip(state.momentum, H, strict=True))
    return [
        (float(off), float(state.error_estimate("momentum").max())),
        (float(abs(Fraction(float(state.energy)) - E)), float(state.error_estimate("energy"))),
        (abs(float(np.linalg.norm(state.attitude)) - 1), float(state.error_estimate())),
    ]


def _back_again(rng: np.random.Generator) -> Pairs:
    """Two spans of time are one: the attitude after both against that after their sum."""
    moments = np.sort(rng.uniform(0.2, 1, 3))
    moments[2] = min(moments[2], moments[0] + moments[1])
    omega = rng.normal(size=3)
    size = float(np.linalg.norm(omega))
    first, second = rng.uniform(0, 30, 2) / size
    body = FreeBody(moments, omega)
    middle, whole = body.at(first), body.at(first + second)
    after = FreeBody(moments, middle.omega, middle.attitude).at(second)
    bound = float(middle.error_estimate() + after.error_estimate() + whole.error_estimate())
    # and what the rounding of the velocity in the middle, and of the sum of the times, does afterwards
    for axis, off in enumerate(middle.error_estimate("omega")):
        other = FreeBody(moments, middle.omega + off * np.eye(3)[axis], middle.attitude).at(second)
        bound += float(angle_between(other.attitude, after.attitude))
    bound += float(np.finfo(float).eps) * (first + second) * size
    return [(float(angle_between(after.attitude, whole.attitude)), bound)]


def _closure(rng: np.random.Generator) -> Pairs:
    """After 1, 10, 1000 and 10⁴ periods: ω as at the start, the body turned about its momentum by as many equal angles."""
    x, y, z = rng.uniform(0.05, 1, 3)
    moments = [y + z, x + z, x + y]
    omega = (rng.normal(size=3) * 10.0 ** rng.uniform(-2, 0, 3) * 10.0 ** rng.uniform(-6, 6)).tolist()
    body = FreeBody(moments, omega)
    period = period_of(moments, omega)
    pairs = [(float(abs(Fraction(float(body.period)) - period)), float(body.error_estimate("period")))]
    one = taylor(moments, omega, period)[1]
    for count in (1, 10, 1000, 10_000):
        time = float(count * body.period)
        turned = power(one, count)
        true = taylor(moments, omega, Fraction(time) - count * period, turned)
        pairs += compare(body.at(np.array([time])), *true)
    return pairs


def _by_steps(rng: np.random.Generator) -> Pairs:
    """Integrated rotation, free or of a top, against the series: what the integrator says of itself."""
    inertia = np.array([1.0, 1.0, rng.uniform(0.2, 1.9)]) if rng.integers(2) else rng.uniform(0.6, 1, 3)
    omega = rng.normal(size=3)
    mgl = float(rng.normal()) if inertia[0] == inertia[1] else 0.0
    splitting = bool(mgl) and bool(rng.integers(2))
    rtol = 10.0 ** rng.uniform(-13, -7)
    time = float(rng.uniform(0.5, 6))
    run = integrate(
        inertia,
        omega,
        t=np.array([time]),
        mgl=mgl,
        method="splitting" if splitting else "DOP853",
        rtol=rtol,
        steps_per_turn=float(rng.integers(20, 60)),
    )
    return compare(run, *taylor(inertia.tolist(), omega.tolist(), time, mgl=mgl))


CAMPAIGNS: dict[str, tuple[str, Callable[[np.random.Generator], Pairs]]] = {
    "free bodies": ("random moments and velocities, scales 1e-12 … 1e12", _anybody),
    "nearly symmetric bodies": ("two moments that differ by 1e-1 … 1e-15", _nearly_symmetric),
    "nearly flat bodies": ("the triangle inequality met to 1e-1 … 1e-15", _nearly_flat),
    "bodies near the separatrix": ("the middle axis missed by 1e-1 … 1e-15", _separatrix),
    "bodies in oblique axes": ("tensors with products of inertia, moments that are nearly equal", _oblique),
    "heavy tops": ("random tops, either side up, scales 1e-12 … 1e12", _any_top),
    "tops near sleeping": ("upright or hanging to 1e-1 … 1e-9 rad, near the threshold", _near_sleeping),
    "tops near a cusp": ("released with a push of 1e-1 … 1e-15", _near_cusp),
    "tops that pass the vertical": ("missing it by 1e-1 … 1e-15", _near_vertical),
    "free rotation, kept quantities": ("near symmetric, near the separatrix, near the axes", _there_and_back),
    "free rotation in two spans": ("random bodies, phases to 60 rad", _back_again),
    "free rotation, closure": ("1, 10, 1000 and 10⁴ periods, scales of time 1e-6 … 1e6", _closure),
    "integrated rotation": ("DOP853 at 1e-13 … 1e-7, splitting at 20 … 60 steps a turn", _by_steps),
}
