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
from virtualwork import Mechanism
from virtualwork.formulas.kinematics import Angle
from virtualwork.motion import Motion

Real = NDArray[np.float64]
DOMAIN = "evaluators"
FLOOR = "hand-written C"
# (numpy, LLVM), ns a pose, and LLVM's over C
AIMS = {
    "position": (28.0, 4.0, 1.6),
    "both angles, ω, α": (50.0, 10.0, 1.6),
    "torque and 8 reactions": (70.0, 10.0, 1.6),
    "Klann": (95.0, 25.0, 1.6),
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
    floor = _four_bar_floor(loaded, angles, speed, float(known["rocker_torque_N_m"]))
    yield from _sweep("position", bare.evaluator("points.C"), angles, (), of_position, floor)
    yield from _sweep("both angles, ω, α", bare.evaluator(*rates), angles, (speed,), of_rates, floor)
    yield from _sweep("torque and 8 reactions", loaded.evaluator(*forces), angles, (speed,), of_forces, floor)
    leg, truth = klann(), reference("klann")
    around_leg, every = sweep(truth, poses)
    links = tuple(name for name in leg.links if name != leg.inputs[0].name)
    wanted = tuple(f"links.{name}.{what}" for name in links for what in ("angle", "omega", "alpha"))

    def of_leg(found: dict[str, Real]) -> float:
        return max(around(found[f"links.{n}.angle"][::every], np.array(truth[n])[:, 0]) for n in links)

    omega = float(truth["omega_rad_s"])
    floor = _klann_floor(leg, around_leg, omega)
    yield from _sweep("Klann", leg.evaluator(*wanted), around_leg, (omega,), of_leg, floor)
    yield from _one_by_one(leg, around_leg, omega, links)
    for what, at, given, aim in (
        ("position", bare.evaluator("points.C"), (1.0,), 3e3),
        ("torque and 8 reactions", loaded.evaluator(*forces), (1.0, speed), 8e3),
    ):
        yield measured(DOMAIN, f"one pose: {what}", "evaluator", partial(at, *given), aim_ns=aim)
    for what, ask, aim in (
        ("position", lambda: bare.motion(1.0).point("C").position, 3e3),
        ("torque and 8 reactions", lambda: _forces_of(loaded.motion(1.0, speed), pins), 8e3),
    ):
        # as in a loop: what is often requested is made ready
        for _ in range(200):
            ask()
        yield measured(DOMAIN, f"one pose: {what}", "motion", ask, aim_ns=aim)


def _forces_of(motion: Motion, pins: tuple[str, ...]) -> list[Real]:
    """The effort and joint forces of a motion, one after the other."""
    joints = (pin.split(".") for pin in pins)
    return [motion.effort, *(motion.reaction(joint, on) for joint, on in joints)]


def _sweep(
    work: str,
    evaluator: Any,
    angles: Real,
    rates: tuple[float, ...],
    error: Callable[[dict[str, Real]], float],
    floors: dict[str, Callable[[], dict[str, Real]]],
) -> Iterator[Measurement]:
    aims = AIMS[work]
    size = len(angles)
    known = {"size": size}
    least = None
    if work in floors:
        least = measured(DOMAIN, work, FLOOR, floors[work], error=error(floors[work]()), **known)
        yield least
    for name, aim, over in (("numpy", aims[0], None), ("llvm", aims[1], aims[2])):
        if name == "llvm" and not compiled_code():
            continue
        with engine(name):
            off = error(evaluator(angles, *rates))
            found = measured(
                DOMAIN, work, name, lambda: evaluator(angles, *rates), error=off, aim_ns=aim, **known
            )
        if least is not None:
            found = replace(found, floor=FLOOR, ratio=found.units / least.units, aim_ratio=over)
        yield found


def _one_by_one(leg: Mechanism, angles: Real, speed: float, links: tuple[str, ...]) -> Iterator[Measurement]:
    """Yield three points, angles, ω and α of a new motion, together and one by one as a notebook asks."""
    keys: list[Any] = [leg.motion(0.0).point(name).key() for name in "CGH"]
    keys += [Angle(link, order) for order in (0, 1, 2) for link in links]

    def request(*parts: list[Any]) -> list[list[Real]]:
        motion = leg.motion(angles, speed=speed, acceleration=0.0)
        return [motion.values(part) for part in parts]

    work = "Klann, three points, angles, ω and α of a motion"
    for name in ("numpy", "llvm") if compiled_code() else ("numpy",):
        least = None
        for method, parts in (
            (f"{name}, together", [keys]),
            (f"{name}, one by one", [[key] for key in keys]),
        ):
            with engine(name):
                result = measured(DOMAIN, work, method, partial(request, *parts), size=len(angles))
            if least is not None:
                result = replace(result, floor=least.method, ratio=result.units / least.units, aim_ratio=1.5)
            least = least or result
            yield result


@contextmanager
def engine(name: str) -> Iterator[None]:
    """Run every tape by one engine."""
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


def _at(a: Real) -> ctypes.c_void_p:
    return ctypes.c_void_p(a.ctypes.data)


def _four_bar_floor(
    m: Mechanism, angles: Real, speed: float, torque: float
) -> dict[str, Callable[[], dict[str, Real]]]:
    """Each work in C on Norton's four-bar, under the names of what an evaluator gives."""
    library = _library()
    if library is None:
        return {}
    n = len(angles)
    lengths = np.array([0.04, 0.12, 0.08, 0.1])
    masses = np.array([[x.mass, x.center.real, x.center.imag, x.inertia] for x in m.links.values()])
    place, out, loads = np.empty((2, n)), np.empty((6, n)), np.empty(9 * n)
    count, w = ctypes.c_ssize_t(n), ctypes.c_double(speed)
    given = ctypes.c_double(-m.gravity.imag), ctypes.c_double(torque)
    # what the rows of `rates` are
    turning = [
        f"links.{link}.{what}" for what in ("angle", "omega", "alpha") for link in ("coupler", "rocker")
    ]

    def position() -> dict[str, Real]:
        library.position(count, _at(angles), _at(lengths), _at(place[0]), _at(place[1]))
        return {"points.C": place.T}

    def rates() -> dict[str, Real]:
        library.rates(count, _at(angles), _at(lengths), w, _at(out))
        return dict(zip(turning, out, strict=True))

    def forces() -> dict[str, Real]:
        library.forces(count, _at(angles), _at(lengths), w, _at(masses), *given, _at(loads))
        return {"effort": loads[:n]}

    return {"position": position, "both angles, ω, α": rates, "torque and 8 reactions": forces}


def _klann_floor(leg: Mechanism, angles: Real, speed: float) -> dict[str, Callable[[], dict[str, Real]]]:
    library = _library()
    if library is None:
        return {}
    links, a = leg.links, leg.ground["A"]
    ends = [leg.ground["D"] - a, leg.ground["E"] - a]
    known = [part for z in ends for part in (z.real, z.imag)]
    known += [abs(links[link].points[p]) for link, p in (("crank", "B"), ("coupler", "C"), ("rocker", "C"))]
    wing = links["coupler"].points["G"]
    known += [wing.real, wing.imag, abs(links["arm"].points["F"]), abs(links["leg"].points["G"])]
    numbers, out = np.array(known), np.empty((12, len(angles)))
    names = [f"links.{link}.angle" for link in ("coupler", "rocker", "arm", "leg")]

    def rates() -> dict[str, Real]:
        count, w = ctypes.c_ssize_t(len(angles)), ctypes.c_double(speed)
        library.klann(count, _at(angles), _at(numbers), w, _at(out))
        return dict(zip(names, out[::3], strict=True))

    return {"Klann": rates}
