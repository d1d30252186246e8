"""Motion under forces: run time against error, beside integrators of other packages on equations written by hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.evaluators import on_engine
from benchmarks.speed.measure import Measurement, measured
from dalembert.arithmetic.engines import compiled_code
from virtualwork import Guess, Input, Link, Mechanism

Real = NDArray[np.float64]
DOMAIN = "in-time"
G = 9.81
# both angles after 10 s, from rest at 0 and −0.5 rad (benchmarks.truth.double_pendulum)
PENDULUM = (-2.684057329739153252662475, -3.090668097315319789813611)
# β of Andrews' squeezing mechanism after 0.03 s
ANDREWS = 15.81077119515370709712
# ns: on Python and numpy, and compiled
AIMS = {"Andrews": (40e6, 2e6), "four-bar": (150e6, 15e6), "family": (None, 60e3)}


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of simulations, with the estimate of their error, and of one way by other integrators."""
    yield from _double_pendulum((1e-6, 1e-9) if quick else (1e-4, 1e-6, 1e-8, 1e-10))
    andrews = Mechanism.from_toml(Path(str(files("cli"))) / "examples" / "andrews" / "andrews.toml")

    def of_andrews(accuracy: float) -> float:
        return abs(float(andrews.simulate([0.0, 0.03], accuracy=accuracy).angle[-1, 0]) - ANDREWS)

    for accuracy in (3e-10,) if quick else (1e-6, 3e-10, 3e-13):
        aims = AIMS["Andrews"] if accuracy == 3e-10 else (None, None)
        work = f"Andrews' mechanism, 0.03 s, accuracy {accuracy:g}"
        yield from _engines(work, partial(of_andrews, accuracy), aims, error=of_andrews(accuracy))
    falling = four_bar()
    yield from _engines(
        "falling four-bar, 10 s, accuracy 1e-11",
        lambda: falling.simulate([0.0, 10.0], accuracy=1e-11),
        AIMS["four-bar"],
    )
    count = 100 if quick else 1000
    family = falling.vary({"links.crank.B.x": np.linspace(0.09, 0.11, count)})
    yield from _engines(
        "variants of a falling four-bar, 1 s, accuracy 1e-9",
        lambda: family.simulate([0.0, 1.0]),
        AIMS["family"],
        size=count,
    )


def _engines(
    work: str, call: Callable[[], Any], aims: tuple[float | None, float | None], **known: Any
) -> Iterator[Measurement]:
    for engine, aim in (("numpy", aims[0]), ("llvm", aims[1])):
        if engine == "llvm" and not compiled_code():
            continue
        with on_engine(engine):
            call()
            yield measured(DOMAIN, work, engine, call, aim_ns=aim, **known)


def four_bar() -> Mechanism:
    """A crank-rocker with masses, let go at 60°."""
    at = math.radians(60)
    return Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {
            "crank": Link({"A": 0j, "B": 0.1 + 0j}, mass=1, center=0.05 + 0j, inertia=0.1),
            "coupler": Link({"B": 0j, "C": 0.35 + 0j}, mass=2, center=0.175 + 0j, inertia=0.02),
            "rocker": Link({"D": 0j, "C": 0.25 + 0j}, mass=1.5, center=0.125 + 0j, inertia=0.008),
        },
        inputs=Input(link="crank", value=at),
        guess=Guess(at, {"coupler": 0.47, "rocker": 1.73}),
        gravity=-1j * G,
    )


# --- the double pendulum --------------------------------------------------------------------------------------------
def _double_pendulum(tolerances: tuple[float, ...]) -> Iterator[Measurement]:
    work = "double pendulum, 10 s"
    bars = {
        "upper": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j),
        "lower": Link({"P": 0j, "Q": 1 + 0j}, mass=1, center=1 + 0j),
    }
    m = Mechanism(
        {"O": 0j},
        bars,
        inputs=[Input(link="upper", value=0.0), Input(link="lower", value=-0.5)],
        gravity=-1j * G,
    )

    def off(end: Any) -> float:
        return float(np.abs(np.asarray(end)[:2] - PENDULUM).max())

    for accuracy in tolerances:
        run = m.simulate([0.0, 10.0], accuracy=accuracy)
        call = partial(m.simulate, [0.0, 10.0], accuracy=accuracy)
        for found in _engines(work, call, (None, None), error=off(run.angle[-1])):
            yield replace(found, method=f"{found.method}, with its estimate, accuracy {accuracy:g}")
    for name, solve, least in _others():
        for accuracy in tolerances:
            # what these are asked for is the error of a step: their answers err by some hundred times that
            tolerance = max(accuracy * 1e-2, least)
            yield measured(
                DOMAIN,
                work,
                f"{name}, tolerance {tolerance:g}",
                partial(solve, tolerance),
                error=off(solve(tolerance)),
                peer=True,
            )


def by_hand(t: float, y: Any) -> list[float]:
    """Lagrange's equations of two points of 1 kg on bars of 1 m, angles from the horizontal, solved for the accelerations."""
    a, b, u, w = y
    c, s = math.cos(a - b), math.sin(a - b)
    first, second = -s * w * w - 2 * G * math.cos(a), s * u * u - G * math.cos(b)
    whole = 2.0 - c * c
    return [u, w, (first - c * second) / whole, (2.0 * second - c * first) / whole]


def _others() -> Iterator[tuple[str, Callable[[float], Any], float]]:
    """Other integrators of the equations by hand: name, the state after 10 s at a tolerance, the least tolerance."""
    from scipy.integrate import solve_ivp

    start = [0.0, -0.5, 0.0, 0.0]

    def by_scipy(method: str, tolerance: float) -> Any:
        return solve_ivp(by_hand, (0.0, 10.0), start, method=method, rtol=tolerance, atol=tolerance).y[:, -1]

    for method in ("DOP853", "LSODA"):
        yield f"scipy solve_ivp {method}, equations by hand", partial(by_scipy, method), 3e-14
    if find_spec("sksundae") is None:
        return
    from sksundae.cvode import CVODE

    def rates(t: float, y: Real, yp: Real) -> None:
        yp[:] = by_hand(t, y.tolist())

    def by_sundials(tolerance: float) -> Any:
        solver = CVODE(rates, method="Adams", rtol=tolerance, atol=tolerance, max_num_steps=10**6)
        return solver.solve(np.array([0.0, 10.0]), np.array(start)).y[-1]

    yield "SUNDIALS CVODE (scikit-sundae), equations by hand", by_sundials, 1e-14
