"""Integrators of other packages on equations written by hand, and another program: one way through, no estimate.

A double pendulum in its two angles; Andrews' mechanism and a falling four-bar in the angles of all links, with the forces
of their loops (`linkages`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.peers.linkages import Linkage, andrews, exudyn_system, four_bar
from benchmarks.speed.in_time import (
    DOMAIN,
    PENDULUMS,
    G,
    Work,
    accuracies,
    andrews_work,
    falling_work,
    pendulum_error,
)
from benchmarks.speed.measure import Measurement, measured

START = [0.0, -0.5, 0.0, 0.0]
# of the accuracy that ours is asked for: these are asked for the error of a step; what they can be asked for at least
STEP, LEAST, FORCES = 1e-2, 2.9e-15, 1e3


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
    for work, linkage in _linkages(quick):
        for method, least in (("DOP853", LEAST), ("LSODA", LEAST), ("Radau", 3e-12)):
            if quick and method != "DOP853":
                continue

            def end(
                tolerance: float, method: str = method, of: Linkage = linkage, to: float = work.end
            ) -> float:
                found = integrate.solve_ivp(
                    of.rates, (0.0, to), of.start, method=method, rtol=tolerance, atol=tolerance
                )
                return float(found.y[0, -1])

            yield from _of_linkage(work, f"solve_ivp {method}", end, least)


def by_sundials(quick: bool) -> Iterator[Measurement]:
    """SUNDIALS: CVODE, Adams' methods of variable order; IDA on the differential-algebraic equations of index one."""
    solver_of = import_module("sksundae.cvode").CVODE

    def rates(t: float, y: Any, yp: Any) -> None:
        yp[:] = by_hand(t, y.tolist())

    def solve(tolerance: float) -> Any:
        solver = solver_of(rates, method="Adams", rtol=tolerance, atol=tolerance, max_num_steps=10**6)
        return solver.solve(np.array([0.0, 10.0]), np.array(START)).y[-1]

    yield from _measured("CVODE Adams", solve, quick)
    algebraic_solver = import_module("sksundae.ida").IDA
    for work, linkage in _linkages(quick):
        acceleration, forces = linkage.solved(linkage.start)
        begin = np.concatenate([linkage.start, forces])
        slopes = np.concatenate([linkage.start[linkage.k :], acceleration, 0 * forces])

        def end(
            tolerance: float,
            of: Linkage = linkage,
            to: float = work.end,
            begin: Any = begin,
            slopes: Any = slopes,
        ) -> float:
            places = list(range(2 * of.k, len(begin)))
            # the forces of the loops, N, need not be as accurate as angles
            allowed = np.where(np.arange(len(begin)) < 2 * of.k, 1.0, FORCES) * tolerance
            solver = algebraic_solver(
                of.residual, rtol=tolerance, atol=allowed, algebraic_idx=places, max_num_steps=10**6
            )
            return float(solver.solve(np.array([0.0, to]), begin, slopes).y[-1, 0])

        yield from _of_linkage(work, "IDA", end, 3e-12)


def by_exudyn(quick: bool) -> Iterator[Measurement]:
    """EXUDYN: Newmark's method (generalized-α of spectral radius one) on constraints of index two, by steps."""
    exu, items = import_module("exudyn"), import_module("exudyn.itemInterface")
    for work, steps in ((andrews_work(quick), (1000, 10_000)), (falling_work(), (2000, 20_000))):
        for count in steps[:1] if quick else steps:

            def end(count: int = count, work: Work = work) -> float:
                return exudyn_system(exu, items, work.mechanism, work.end, count)

            method = f"generalized-α, {count} steps"
            for accuracy in work.accuracies:
                yield measured(
                    DOMAIN, work.name(accuracy), method, end, error=abs(end() - work.true), budget=0.1
                )


def _linkages(quick: bool) -> Iterator[tuple[Work, Linkage]]:
    for work, written in ((andrews_work(quick), andrews), (falling_work(), four_bar)):
        yield work, written(work.mechanism)


def _of_linkage(work: Work, name: str, end: Callable[[float], float], least: float) -> Iterator[Measurement]:
    """Over the work's accuracies; what would need tolerances below the least takes minutes, and is left out."""
    for accuracy in work.accuracies:
        tolerance = STEP * accuracy
        if tolerance < 0.99 * least:
            continue
        off = abs(end(tolerance) - work.true)
        yield measured(
            DOMAIN,
            work.name(accuracy),
            f"{name}, tolerance {tolerance:g}",
            partial(end, tolerance),
            error=off,
            budget=0.1,
        )


def _measured(name: str, solve: Callable[[float], Any], quick: bool) -> Iterator[Measurement]:
    for accuracy in accuracies(quick):
        tolerance = STEP * accuracy
        off = pendulum_error(solve(tolerance))
        yield measured(
            DOMAIN, PENDULUMS, f"{name}, tolerance {tolerance:g}", partial(solve, tolerance), error=off
        )
