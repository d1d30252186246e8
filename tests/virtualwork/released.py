"""Mechanisms that the tests of motion under forces release, and what is asked of a run."""

from __future__ import annotations

import math

from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.intime.run import Run

G = 9.81


def pendulum(**more: object) -> Mechanism:
    """A point of 1 kg on a massless bar of 1 m."""
    return Mechanism(
        {"O": 0j},
        {"bob": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j)},
        inputs=Input(link="bob"),
        gravity=-1j * G,
        **more,  # type: ignore[arg-type]
    )


def block(**more: object) -> Mechanism:
    """A block of 1 kg on a horizontal guide."""
    return Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=1)},
        guides=[Guide("P", "block", turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        **more,  # type: ignore[arg-type]
    )


def rotor(inertia: float = 2.0, **more: object) -> Mechanism:
    return Mechanism(
        {"O": 0j},
        {"rotor": Link({"O": 0j}, inertia=inertia)},
        inputs=Input(link="rotor"),
        **more,  # type: ignore[arg-type]
    )


def four_bar(driver: str = "crank", **more: object) -> Mechanism:
    """A crank-rocker with masses; its driver is free to choose."""
    at = {"crank": math.radians(60), "rocker": math.radians(98.95026226818)}
    others = {"crank": 1.05, "coupler": 0.47, "rocker": 1.73}
    return Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {
            "crank": Link({"A": 0j, "B": 0.1 + 0j}, mass=1, center=0.05 + 0j, inertia=0.1),
            "coupler": Link({"B": 0j, "C": 0.35 + 0j}, mass=2, center=0.175 + 0j, inertia=0.02),
            "rocker": Link({"D": 0j, "C": 0.25 + 0j}, mass=1.5, center=0.125 + 0j, inertia=0.008),
        },
        inputs=Input(link=driver, value=at[driver]),
        guess=Guess(at[driver], {name: a for name, a in others.items() if name != driver}),
        gravity=-1j * G,
        **more,  # type: ignore[arg-type]
    )


def holds(run: Run, error: float, accuracy: float) -> None:
    """The error is what was asked for, and what is said of it is true."""
    assert error <= accuracy
    assert error <= run.error_estimate.max() + 1e-15
    assert not run.warnings


def double_pendulum(**more: object) -> Mechanism:
    return Mechanism(
        {"O": 0j},
        {
            "upper": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j),
            "lower": Link({"P": 0j, "Q": 1 + 0j}, mass=1, center=1 + 0j),
        },
        inputs=[Input(link="upper", value=0.0), Input(link="lower", value=-0.5)],
        **({"gravity": -1j * G} | more),  # type: ignore[arg-type]
    )
