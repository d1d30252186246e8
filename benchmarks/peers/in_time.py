"""Integrators of other packages on a double pendulum's equations written by hand: one way through, no estimate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.speed.in_time import DOMAIN, PENDULUMS, G, accuracies, pendulum_error
from benchmarks.speed.measure import Measurement, measured

START = [0.0, -0.5, 0.0, 0.0]
# of the accuracy that ours is asked for: these are asked for the error of a step
STEP = 1e-2


def by_hand(t: float, y: Any) -> list[float]:
    """Lagrange's equations of two points of 1 kg on bars of 1 m, angles from the horizontal, solved for the accelerations."""
    a, b, u, w = y
    c, s = math.cos(a - b), math.sin(a - b)
    first, second = -s * w * w - 2 * G * math.cos(a), s * u * u - G * math.cos(b)
    whole = 2.0 - c * c
    return [u, w, (first - c * second) / whole, (2.0 * second - c * first) / whole]


def by_scipy(quick: bool) -> Iterator[Measurement]:
    """`solve_ivp`, explicit of order 8 and of variable order."""
    integrate = import_module("scipy.integrate")
    for method in ("DOP853", "LSODA"):

        def solve(tolerance: float, method: str = method) -> Any:
            found = integrate.solve_ivp(
                by_hand, (0.0, 10.0), START, method=method, rtol=tolerance, atol=tolerance
            )
            return found.y[:, -1]

        yield from _measured(f"solve_ivp {method}", solve, quick)


def by_sundials(quick: bool) -> Iterator[Measurement]:
    """CVODE of SUNDIALS, Adams' methods of variable order."""
    solver_of = import_module("sksundae.cvode").CVODE

    def rates(t: float, y: Any, yp: Any) -> None:
        yp[:] = by_hand(t, y.tolist())

    def solve(tolerance: float) -> Any:
        solver = solver_of(rates, method="Adams", rtol=tolerance, atol=tolerance, max_num_steps=10**6)
        return solver.solve(np.array([0.0, 10.0]), np.array(START)).y[-1]

    yield from _measured("CVODE Adams", solve, quick)


def _measured(name: str, solve: Callable[[float], Any], quick: bool) -> Iterator[Measurement]:
    for accuracy in accuracies(quick):
        tolerance = STEP * accuracy
        off = pendulum_error(solve(tolerance))
        yield measured(
            DOMAIN, PENDULUMS, f"{name}, tolerance {tolerance:g}", partial(solve, tolerance), error=off
        )
