"""The tape: evaluators on each engine beside the same formulas in hand-written C, and one pose through the interface."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import four_bar, klann, sweep
from benchmarks.speed.measure import Measurement, around, measured, worst
from benchmarks.truth import reference
from dalembert.arithmetic.engines import compiled_code

Real = NDArray[np.float64]
DOMAIN = "evaluators"
FLOOR = "hand-written C"
# (numpy, LLVM), ns a pose, and LLVM's over C
AIMS = {
    "position": (28.0, 4.0, 1.6),
    "both angles, ω, α": (50.0, 10.0, 1.6),
    "torque and 8 reactions": (70.0, 10.0, None),
    "Klann": (95.0, 25.0, None),
}


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of evaluators over a sweep and for one pose."""
    poses = 10_000 if quick else 100_000
    known = reference("four_bar")
    angles, stride = sweep(known, poses)
    speed = float(known["omega_rad_s"])
    bare, loaded = four_bar(), four_bar(loaded=True)
    turns = np.array([known["coupler"], known["rocker"]])  # link, pose, order

    def of_position(found: dict[str, Real]) -> float:
        return worst(found["points.C"][::stride], np.array(known["C"])[:, 0], 0.12)

    def of_rates(found: dict[str, Real]) -> float:
        names = ("coupler", "rocker")
        angle = max(around(found[f"links.{n}.angle"][::stride], turns[k, :, 0]) for k, n in enumerate(names))
        rates = (
            worst(found[f"links.{n}.{what}"][::stride], turns[k, :, order])
            for k, n in enumerate(names)
            for order, what in ((1, "omega"), (2, "alpha"))
        )
        return max(angle, *rates)

    def of_forces(found: dict[str, Real]) -> float:
        return worst(found["effort"][::stride], known["torque"])

    pins = ("A.crank", "B.coupler", "C.rocker", "D.rocker")
    rates = tuple(f"links.{n}.{what}" for n in ("coupler", "rocker") for what in ("angle", "omega", "alpha"))
    forces = ("effort", *(f"reactions.{pin}" for pin in pins))
    floor = _floor(angles, speed)
    yield from _sweep("position", bare.evaluator("points.C"), angles, (), of_position, floor.get("position"))
    work = "both angles, ω, α"
    yield from _sweep(work, bare.evaluator(*rates), angles, (speed,), of_rates, floor.get("rates"))
    yield from _sweep("torque and 8 reactions", loaded.evaluator(*forces), angles, (speed,), of_forces)
    leg, truth = klann(), reference("klann")
    around_leg, every = sweep(truth, poses)
    links = tuple(name for name in leg.links if name != leg.inputs[0].name)
    wanted = tuple(f"links.{name}.{what}" for name in links for what in ("angle", "omega", "alpha"))

    def of_leg(found: dict[str, Real]) -> float:
        return max(around(found[f"links.{n}.angle"][::every], np.array(truth[n])[:, 0]) for n in links)

    omega = float(truth["omega_rad_s"])
    yield from _sweep("Klann", leg.evaluator(*wanted), around_leg, (omega,), of_leg)
    for what, at, given, aim in (
        ("position", bare.evaluator("points.C"), (1.0,), 3e3),
        ("torque and 8 reactions", loaded.evaluator(*forces), (1.0, speed), 8e3),
    ):
        yield measured(DOMAIN, f"one pose: {what}", "evaluator", partial(at, *given), aim_ns=aim)


def _sweep(
    work: str,
    evaluator: Any,
    angles: Real,
    rates: tuple[float, ...],
    error: Callable[[dict[str, Real]], float],
    floor: Callable[[], Any] | None = None,
) -> Iterator[Measurement]:
    aims = AIMS[work]
    size = len(angles)
    known = {"size": size}
    least = None if floor is None else measured(DOMAIN, work, FLOOR, floor, **known)
    if least is not None:
        yield least
    for engine, aim, over in (("numpy", aims[0], None), ("llvm", aims[1], aims[2])):
        if engine == "llvm" and not compiled_code():
            continue
        with on_engine(engine):
            off = error(evaluator(angles, *rates))
            found = measured(
                DOMAIN, work, engine, lambda: evaluator(angles, *rates), error=off, aim_ns=aim, **known
            )
        if least is not None:
            found = replace(found, floor=FLOOR, ratio=found.units / least.units, aim_ratio=over)
        yield found


@contextmanager
def on_engine(name: str) -> Iterator[None]:
    """Within it every tape runs on this engine."""
    before = os.environ.get("DALEMBERT_ENGINE")
    os.environ["DALEMBERT_ENGINE"] = name
    try:
        yield
    finally:
        if before is None:
            del os.environ["DALEMBERT_ENGINE"]
        else:
            os.environ["DALEMBERT_ENGINE"] = before


@cache
def _library() -> ctypes.CDLL | None:
    """The C of `floor.c`, compiled for this machine; None where there is no compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return None
    source = Path(__file__).with_name("floor.c")
    target = Path(tempfile.mkdtemp()) / "floor.so"
    flags = ["-O3", "-march=native", "-mprefer-vector-width=512", "-ffast-math", "-shared", "-fPIC"]
    done = subprocess.run(
        [compiler, *flags, str(source), "-o", str(target), "-lmvec", "-lm"], capture_output=True, check=False
    )
    return ctypes.CDLL(str(target)) if done.returncode == 0 else None


def _floor(angles: Real, speed: float) -> dict[str, Callable[[], Any]]:
    library = _library()
    if library is None:
        return {}
    n = len(angles)
    lengths = np.array([0.04, 0.12, 0.08, 0.1])
    out = np.empty((6, n))

    def at(a: Real) -> ctypes.c_void_p:
        return ctypes.c_void_p(a.ctypes.data)

    count = ctypes.c_ssize_t(n)
    return {
        "position": lambda: library.position(count, at(angles), at(lengths), at(out[0]), at(out[1])),
        "rates": lambda: library.rates(count, at(angles), at(lengths), ctypes.c_double(speed), at(out)),
    }
