"""One measurement: its time in this run's own units, and its error."""

from __future__ import annotations

import math
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Measurement:
    """The time of one method on one piece of work, and the worst error of its answer."""

    domain: str
    work: str
    method: str
    size: int
    """How many items one call works on; times are per item."""
    ns: float
    units: float
    """The time as a multiple of the calibration loop's, measured side by side."""
    error: float | None = None
    """The worst error, over the size of what is sought."""
    aim_ns: float | None = None
    aim_error: float | None = None
    floor: str | None = None
    """What `ratio` is over: the same work's least possible time on this machine, measured in the same run."""
    ratio: float | None = None
    aim_ratio: float | None = None
    condition: float | None = None
    """The condition number of the problem, where that is what varies."""
    bytes: float | None = None
    """The most memory that a call held at once, its answer included."""
    operations: int | None = None
    """How many operations on real numbers a pose costs: all that is left on its tape."""
    peer: bool = False
    """Another package's time and error, for comparison."""


patience = 1.0
"""How much of its budget each measurement takes; less is sooner done, and noisier."""


def seconds(call: Callable[[], Any], budget: float, clock: Callable[[], float] = time.process_time) -> float:
    """Return the CPU time of one call: the least over repetitions that fill `budget` seconds."""
    return beside_the_unit(call, budget, clock)[0]


def beside_the_unit(
    call: Callable[[], Any], budget: float, clock: Callable[[], float] = time.process_time
) -> tuple[float, float]:
    """Return the least time of a call, s, and the least of the calibration loop in between its repetitions, ns.

    A machine that others use too is slower in one second than in the next: measured side by side, both are slow alike.
    """
    budget *= patience
    _keep_memory()
    unit = _unit()
    start = clock()
    call()
    once = clock() - start
    if once > max(budget, 2.0):
        return once, min(unit, _unit())
    start = clock()
    call()
    once = max(clock() - start, 1e-7)
    repeat = max(1, int(2e-3 / once))
    best, end = once, time.perf_counter() + budget - once
    while time.perf_counter() < end:
        start = clock()
        for _ in range(repeat):
            call()
        best = min(best, (clock() - start) / repeat)
        unit = min(unit, _unit(4))
    return best, min(unit, _unit())


@cache
def _keep_memory() -> None:
    """Let the C library keep what is freed.

    Else each call of a repetition gets its memory anew from the system, page by page, which glibc stops doing once
    the process has freed a block as large as this one.
    """
    bytearray(31 << 20)


def peak(call: Callable[[], Any]) -> int:
    """Return the most bytes that a call held at once (numpy's and Python's own), its answer included."""
    call()  # what a first call imports and keeps is not counted
    running = tracemalloc.is_tracing()
    if not running:
        tracemalloc.start()
    try:
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        answer = call()
        held = tracemalloc.get_traced_memory()[1] - before
        del answer
        return held
    finally:
        if not running:
            tracemalloc.stop()


X, Y = np.linspace(0.0, 1.0, 4096), np.linspace(1.0, 2.0, 4096)


def _unit(times: int = 32) -> float:
    """Return the least of some times of the calibration loop, ns an element."""
    best = math.inf
    for _ in range(times):
        start = time.process_time_ns()
        np.sqrt(X * X + Y * Y)
        best = min(best, (time.process_time_ns() - start) / len(X))
    return best


@cache
def calibration() -> float:
    """Return the nanoseconds that one element of √(x² + y²) over 4096 doubles takes on this machine, in this run."""
    return min(_unit(1000) for _ in range(10))


def measured(
    domain: str,
    work: str,
    method: str,
    call: Callable[[], Any],
    *,
    size: int = 1,
    budget: float = 0.2,
    **known: Any,
) -> Measurement:
    """Time a call that works on `size` items; `known` are further fields of the measurement."""
    least, unit = beside_the_unit(call, budget)
    ns = least / size * 1e9
    return Measurement(domain, work, method, size, ns, ns / unit, **known)


def exponent(sizes: ArrayLike, values: ArrayLike) -> float:
    """Return p of value ~ size^p, fitted to the last three sizes.

    >>> round(exponent([1, 10, 100, 1000], [50, 60, 600, 6000]), 12)
    1.0
    """
    return float(np.polyfit(np.log(np.asarray(sizes)[-3:]), np.log(np.asarray(values)[-3:]), 1)[0])


def worst(found: Any, true: Any, scale: float | None = None) -> float:
    """Return the largest deviation of an answer from the reference, over the reference's largest entry or `scale`."""
    true = np.asarray(true)
    found = np.asarray(found).reshape(true.shape)
    off = np.abs(found - true).max()
    return float(off / (np.abs(true).max() if scale is None else scale))


def around(found: Any, true: Any) -> float:
    """Return the largest deviation of angles, rad, whole turns apart left out."""
    off = np.asarray(found) - np.asarray(true)
    return float(np.abs(off - 2 * np.pi * np.round(off / (2 * np.pi))).max())
