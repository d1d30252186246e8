"""Rotation in time: the closed form against integration, by the attitude, not only by what is conserved."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.measure import Measurement, measured, peak
from benchmarks.truth import reference
from benchmarks.truth.rotation import taylor
from rigidbody3d import FreeBody, Top, integrate

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
    # one state after many nods: what the closed form is worth, and what the splitting keeps
    inertia, mgl, omega, start = [1.0, 1.0, 0.6], 1.2, [0.5, 1.0, 3.0], [0.8, 0.6, 0.0, 0.0]
    last = np.array([20.0 if states < 10_000 else 2000.0])
    true = np.array([[float(x) for x in taylor(inertia, omega, float(last[0]), start, mgl)[1]]])
    work = f"heavy top, attitude after {last[0]:g} s"
    for method, options in (
        ("closed form", None),
        ("integrated, DOP853", {"rtol": 1e-13}),
        ("splitting, 15 steps a turn", {"method": "splitting", "steps_per_turn": 15.0}),
        ("splitting, 60 steps a turn", {"method": "splitting", "steps_per_turn": 60.0}),
    ):
        call = partial(_top_once, inertia, mgl, omega, start, last, options)
        yield measured(DOMAIN, work, method, call, error=attitude_error(call(), true), budget=0.02)


def _top_once(inertia: Any, mgl: float, omega: Any, start: Any, time: Real, options: Any) -> Real:
    if options is None:
        return np.asarray(Top(inertia, mgl, omega, start).at(time).attitude)
    return integrate(inertia, omega, start, time, mgl=mgl, **options).attitude


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
