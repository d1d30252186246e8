"""Rotation in time: the closed form against integration, by the attitude, not only by what is conserved."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.bench.measure import Measurement, measured, peak, reference
from rigidbody3d import FreeBody, Top, integrate
from rigidbody3d.attitude import angle_between

Real = NDArray[np.float64]

DOMAIN = "rotation"


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of free rotation: five bodies, many states, up to 10⁵ revolutions."""
    known = reference("rotation")
    for i, body in enumerate(known["bodies"]):
        tolerances = (1e-3, 1e-6, 1e-9, 1e-12) if not quick else (1e-6, 1e-12) if i < 2 else ()
        yield from _short(body, tolerances)
    yield from _many((1, 100, 10_000) if quick else (1, 10, 100, 1000, 10_000, 100_000, 1_000_000))
    yield from _top(1000 if quick else 10_000)
    yield from _long(known["long"], 100 if quick else 1000)


def attitude_error(found: Real, true: Real) -> float:
    """Return the largest distance of unit quaternions, of which q and -q are one attitude."""
    return float(
        np.minimum(np.linalg.norm(found - true, axis=-1), np.linalg.norm(found + true, axis=-1)).max()
    )


def _exact(inertia: Any, omega: Any, times: Real) -> Real:
    return FreeBody(inertia, omega).at(times).attitude


def _integrated(inertia: Any, omega: Any, times: Real, method: str, rtol: float) -> Real:
    return integrate(inertia, omega, t=times, method=method, rtol=rtol).attitude


def _plain(inertia: Any, omega: Any, times: Real, method: str, rtol: float) -> Real:
    """Euler's equations and q' = q·(0, ω)/2 handed to solve_ivp as they stand in the texts."""
    from scipy.integrate import solve_ivp

    a, b, c = inertia
    first, second, third = (b - c) / a, (c - a) / b, (a - b) / c

    def rates(_: float, y: Real) -> list[float]:
        p, q, r, w, i, j, k = y.tolist()
        return [
            first * q * r,
            second * r * p,
            third * p * q,
            (-i * p - j * q - k * r) / 2,
            (w * p + j * r - k * q) / 2,
            (w * q - i * r + k * p) / 2,
            (w * r + i * q - j * p) / 2,
        ]

    start = [*omega, 1.0, 0.0, 0.0, 0.0]
    run = solve_ivp(rates, (0.0, float(times.max())), start, method, times, rtol=rtol, atol=rtol * 1e-3)
    return np.asarray(run.y[3:].T)


def _short(body: Any, tolerances: tuple[float, ...]) -> Iterator[Measurement]:
    work = f"attitude to 20 s, {body['name']}"
    times = np.array([a["t_s"] for a in body["answers"]])
    true = np.array([a["attitude"] for a in body["answers"]])
    call = partial(_exact, body["inertia"], body["omega"], times)
    yield measured(DOMAIN, work, "closed form", call, error=attitude_error(call(), true), budget=0.1)
    ways = (
        (f"{how}, {m}", solve, m)
        for how, solve in (("integrated", _integrated), ("plain solve_ivp", _plain))
        for m in ("DOP853", "RK45")
    )
    for name, solve, method in ways:
        for rtol in tolerances:
            if method == "RK45" and rtol < 1e-10:
                continue
            step = partial(solve, body["inertia"], body["omega"], times, method, rtol)
            error = attitude_error(step(), true)
            yield measured(DOMAIN, work, name, step, error=error, budget=0.02)


def _many(sizes: tuple[int, ...]) -> Iterator[Measurement]:
    body = FreeBody([1.0, 2.0, 3.0], [1.0, 0.1, 0.5])
    for states in sizes:
        times = np.linspace(0.0, 100.0, states)

        def both(times: Real = times) -> tuple[Real, Real]:
            state = body.at(times)
            return state.omega, state.attitude

        aim, held = 2000.0 if states == sizes[-1] else None, float(peak(both))
        work = "ω and attitude of many states"
        yield measured(DOMAIN, work, "closed form", both, size=states, aim_ns=aim, bytes=held)


def _top(states: int) -> Iterator[Measurement]:
    top = Top([1, 1, 0.6], 1.2, [0.5, 1.0, 3.0], [0.8, 0.6, 0, 0])
    times = np.linspace(0.0, 20.0, states)

    def attitude() -> Real:
        return np.asarray(top.at(times).attitude)

    work = "heavy top, attitude of many states"
    yield measured(DOMAIN, work, "closed form", attitude, size=states, aim_ns=2000.0)


def _long(known: Any, integrated_periods: int) -> Iterator[Measurement]:
    """Yield the attitude's error after up to 10⁵ periods; the aim is ε times the phase, 2π per period."""
    work = "attitude after many revolutions"
    for answer in known["answers"]:
        times, true = np.array([answer["t_s"]]), np.array([answer["attitude"]])
        periods = max(1, answer["periods"])
        call = partial(_exact, known["inertia"], known["omega"], times)
        yield measured(
            DOMAIN,
            work,
            "closed form",
            call,
            size=periods,
            error=attitude_error(call(), true),
            aim_error=float(np.finfo(float).eps) * 2 * np.pi * periods,
            budget=0.05,
        )
        if answer["periods"] <= integrated_periods:
            for name, solve in (("integrated", _integrated), ("plain solve_ivp", _plain)):
                step = partial(solve, known["inertia"], known["omega"], times, "DOP853", 1e-13)
                error = attitude_error(step(), true)
                yield measured(
                    DOMAIN, work, f"{name}, DOP853 at 1e-13", step, size=periods, error=error, budget=0.0
                )


# --- random campaigns at singular places: the error, and the bound that the program itself gives ---


def _there_and_back(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Momentum and energy from the state itself, at moments and motions near every special case."""
    moments = np.sort(rng.uniform(0.05, 1, 3))
    moments = np.array([moments[0] + moments[1], moments[1] + moments[2], moments[2] + moments[0]])
    near = 10.0 ** rng.uniform(-16, 0)
    if rng.integers(2):
        moments[1] = moments[0] * (1 + near)
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


def _back_again(rng: np.random.Generator) -> list[tuple[float, float]]:
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


def _closure(rng: np.random.Generator) -> list[tuple[float, float]]:
    """After 1, 10 and 1000 periods: ω as at the start, the body turned about its momentum by as many equal angles."""
    from cli.bench.turning import compare, exact_period, taylor

    x, y, z = rng.uniform(0.05, 1, 3)
    moments = [y + z, x + z, x + y]
    omega = (rng.normal(size=3) * 10.0 ** rng.uniform(-2, 0, 3) * 10.0 ** rng.uniform(-6, 6)).tolist()
    body = FreeBody(moments, omega)
    period = exact_period(moments, omega)
    pairs = [(float(abs(Fraction(float(body.period)) - period)), float(body.error_estimate("period")))]
    one = taylor(moments, omega, period)[1]
    for count in (1, 10, 1000):
        time = float(count * body.period)
        turned = _power(one, count)
        true = taylor(moments, omega, Fraction(time) - count * period, turned)
        pairs += compare(body.at(np.array([time])), *true)
    return pairs


def _power(q: list[Fraction], count: int) -> list[Fraction]:
    """Return a quaternion of 50 digits multiplied with itself."""
    result = [Fraction(1), Fraction(0), Fraction(0), Fraction(0)]
    for digit in bin(count)[2:]:
        result = _times(result, result)
        if digit == "1":
            result = _times(result, q)
    return result


def _times(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    w, x, y, z = a
    W, X, Y, Z = b
    product = (
        w * W - x * X - y * Y - z * Z,
        w * X + x * W + y * Z - z * Y,
        w * Y - x * Z + y * W + z * X,
        w * Z + x * Y - y * X + z * W,
    )
    return [Fraction(round(v * 2**180), 2**180) for v in product]


def _by_steps(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Integrated rotation, free or of a top, against the series: what the integrator says of itself."""
    from cli.bench.turning import compare, taylor

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


CAMPAIGNS = {
    "free rotation, kept quantities": ("near symmetric, near the separatrix, near the axes", _there_and_back),
    "free rotation in two spans": ("random bodies, phases to 60 rad", _back_again),
    "free rotation, closure": ("1, 10 and 1000 periods, scales of time 1e-6 … 1e6", _closure),
    "integrated rotation": ("DOP853 at 1e-13 … 1e-7, splitting at 20 … 60 steps a turn", _by_steps),
}
