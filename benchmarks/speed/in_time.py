"""Motion under forces: run time against error, with the estimate of the error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.evaluators import engine
from benchmarks.speed.measure import Measurement, measured
from dalembert.arithmetic.engines import compiled_code
from virtualwork import Guess, Input, Link, Mechanism

Real = NDArray[np.float64]
DOMAIN = "in-time"
G = 9.81
PENDULUMS = "double pendulum, 10 s"
# both angles after 10 s, from rest at 0 and −0.5 rad (benchmarks.truth.double_pendulum)
PENDULUM = (-2.684057329739153252662475, -3.090668097315319789813611)
# β of Andrews' squeezing mechanism after 0.03 s
ANDREWS = 15.81077119515370709712
# the crank's angle of the falling four-bar after 10 s (benchmarks.truth.falling_four_bar)
FALLING = 0.3742396000070687573915523
# ns: on Python and numpy, and compiled
AIMS = {"Andrews": (40e6, 2e6), "four-bar": (150e6, 15e6), "family": (None, 60e3)}


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of simulations, with the estimate of their error."""
    yield from _double_pendulum(accuracies(quick))
    works = (andrews_work(quick), AIMS["Andrews"]), (falling_work(), AIMS["four-bar"])
    for work, aims in works:
        for accuracy in work.accuracies:
            call = partial(work.error, accuracy)
            aimed = aims if accuracy in (3e-10, 1e-11) else (None, None)
            yield from _engines(work.name(accuracy), call, aimed, error=call())
    falling = falling_work().mechanism
    count = 100 if quick else 1000
    family = falling.vary({"links.crank.B.x": np.linspace(0.09, 0.11, count)})
    yield from _engines(
        "variants of a falling four-bar, 1 s, accuracy 1e-9",
        lambda: family.simulate([0.0, 1.0]),
        AIMS["family"],
        size=count,
    )


@dataclass(frozen=True)
class Work:
    """A mechanism that is released, and what its first input is at the end."""

    title: str
    mechanism: Mechanism
    end: float
    true: float
    accuracies: tuple[float, ...]

    def name(self, accuracy: float) -> str:
        """What the work is called."""
        return f"{self.title}, accuracy {accuracy:g}"

    def error(self, accuracy: float) -> float:
        """How far the input is off at the end."""
        return abs(
            float(self.mechanism.simulate([0.0, self.end], accuracy=accuracy).angle[-1, 0]) - self.true
        )


def andrews_work(quick: bool) -> Work:
    """Andrews' squeezing mechanism."""
    m = Mechanism.from_toml(Path(str(files("cli"))) / "examples" / "andrews" / "andrews.toml")
    return Work("Andrews' mechanism, 0.03 s", m, 0.03, ANDREWS, (3e-10,) if quick else (1e-6, 3e-10, 3e-13))


def falling_work() -> Work:
    """The four-bar that falls without friction."""
    return Work("falling four-bar, 10 s", four_bar(), 10.0, FALLING, (1e-11,))


def accuracies(quick: bool) -> tuple[float, ...]:
    """The requests of the double pendulum."""
    return (1e-6, 1e-9) if quick else (1e-4, 1e-6, 1e-8, 1e-10)


def _engines(
    work: str, call: Callable[[], Any], aims: tuple[float | None, float | None], **known: Any
) -> Iterator[Measurement]:
    for name, aim in (("numpy", aims[0]), ("llvm", aims[1])):
        if name == "llvm" and not compiled_code():
            continue
        with engine(name):
            call()
            yield measured(DOMAIN, work, name, call, aim_ns=aim, **known)


def four_bar() -> Mechanism:
    """A crank-rocker with masses, released at 60°."""
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

    for accuracy in tolerances:
        run = m.simulate([0.0, 10.0], accuracy=accuracy)
        call = partial(m.simulate, [0.0, 10.0], accuracy=accuracy)
        for found in _engines(PENDULUMS, call, (None, None), error=pendulum_error(run.angle[-1])):
            yield replace(found, method=f"{found.method}, with its estimate, accuracy {accuracy:g}")


def pendulum_error(end: Any) -> float:
    """How far the double pendulum's angles are off after 10 s, rad."""
    return float(np.abs(np.asarray(end)[:2] - PENDULUM).max())
