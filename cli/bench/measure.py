"""One measurement: its time in this run's own units, and its error."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np


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
    """The time as a multiple of the calibration loop's, measured in the same run."""
    error: float | None = None
    aim_ns: float | None = None
    aim_error: float | None = None


def seconds(call: Callable[[], Any], budget: float) -> float:
    """Return the CPU time of one call: the least over repetitions that fill `budget` seconds."""
    call()
    start = time.process_time()
    call()
    once = max(time.process_time() - start, 1e-7)
    repeat = max(1, int(2e-3 / once))
    best, end = float("inf"), time.perf_counter() + budget
    while True:
        start = time.process_time()
        for _ in range(repeat):
            call()
        best = min(best, (time.process_time() - start) / repeat)
        if time.perf_counter() > end:
            return best


@cache
def calibration() -> float:
    """Return the nanoseconds that one element of √(x² + y²) over 4096 doubles takes on this machine, in this run."""
    x, y = np.linspace(0.0, 1.0, 4096), np.linspace(1.0, 2.0, 4096)
    return seconds(lambda: np.sqrt(x * x + y * y), 0.3) / 4096 * 1e9


def measured(
    domain: str,
    work: str,
    method: str,
    call: Callable[[], Any],
    *,
    size: int = 1,
    error: float | None = None,
    budget: float = 0.2,
    aim_ns: float | None = None,
    aim_error: float | None = None,
) -> Measurement:
    """Time a call that works on `size` items."""
    ns = seconds(call, budget) / size * 1e9
    return Measurement(domain, work, method, size, ns, ns / calibration(), error, aim_ns, aim_error)


def reference(name: str) -> Any:
    """Return stored answers of extended precision."""
    return json.loads((files("cli") / "bench" / "references" / f"{name}.json").read_text(encoding="utf-8"))
