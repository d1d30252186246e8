"""Mechanisms: positions, angles, velocities and accelerations of a four-bar and of the Klann leg, single and swept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.bench.measure import Measurement, measured, reference
from virtualwork import Guess, Input, Link, Mechanism

DOMAIN = "mechanisms"
Real = NDArray[np.float64]


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time per pose and error against answers of 50 digits."""
    four, klann = four_bar(), klann_leg()
    sizes = (1, 100, 10_000) if quick else (1, 100, 10_000, 100_000)
    known = {"C": (four, reference("four_bar")), "H": (klann, reference("klann"))}
    errors = {point: errors_of(m, data, point) for point, (m, data) in known.items()}
    works: list[tuple[str, Mechanism, Callable[[Mechanism, Real], Any], float, float | None]] = [
        ("four-bar, positions", four, partial(position, point="C"), errors["C"][0], 30),
        ("four-bar, positions and both angles", four, angles, errors["C"][0], 40),
        ("four-bar, angles, velocities and accelerations", four, rates, errors["C"][2], 60),
        ("Klann leg, four angles", klann, angles, errors["H"][0], 70),
        ("Klann leg, angles, velocities and accelerations", klann, rates, errors["H"][2], 130),
    ]
    for work, m, call, error, aim in works:
        for size in sizes:
            q = np.linspace(0, 2 * np.pi, size)
            yield measured(
                DOMAIN,
                work,
                "closed form",
                partial(call, m, q),
                size=size,
                error=error,
                aim_ns=60e3 if size == 1 else aim if size == sizes[-1] else None,
            )
    first = next(iter(works))[1]
    angles_of = np.linspace(0, 2 * np.pi, 100)
    from virtualwork.newton import all_at_once

    yield measured(
        DOMAIN,
        "four-bar, one pose",
        "Newton-Raphson from the guess",
        partial(all_at_once, first.assembly, (0.9,)),
    )
    yield measured(
        DOMAIN,
        "four-bar, plan and branch from the file",
        "closed form",
        lambda: four_bar().motion(angles_of).point("C").position,
    )


def four_bar() -> Mechanism:
    """Norton's four-bar of example 4-1."""
    return Mechanism(
        {"A": (0, 0), "D": (0.1, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (0.04, 0)}),
            "coupler": Link({"B": (0, 0), "C": (0.12, 0)}),
            "rocker": Link({"D": (0, 0), "C": (0.08, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(0.7, {"coupler": 0.35, "rocker": 1.0}),
    )


def klann_leg() -> Mechanism:
    """The Klann leg of the examples."""
    return Mechanism.from_toml(str(files("cli") / "examples" / "klann" / "klann.toml"))


def position(m: Mechanism, q: Real, point: str) -> Any:
    """Where one point is."""
    return m.motion(q).point(point).position


def angles(m: Mechanism, q: Real) -> Any:
    """The angle of every link but the driven one."""
    motion = m.motion(q)
    return [motion.link(name).angle for name in m.links if name != "crank"]


def rates(m: Mechanism, q: Real) -> Any:
    """Angle, angular velocity and acceleration of every link but the driven one."""
    motion = m.motion(q, speed=10.0)
    links = [motion.link(name) for name in m.links if name != "crank"]
    return [(link.alpha, link.omega, link.angle) for link in links]


def errors_of(m: Mechanism, data: dict[str, Any], point: str) -> list[float]:
    """Worst relative error of position, velocity and acceleration of a point, against the stored answers."""
    motion = m.motion(np.array(data["angle_rad"]), speed=float(data["omega_rad_s"]))
    true = np.array(data[point])[:, :3]
    found = [motion.point(point).position, motion.point(point).velocity, motion.point(point).acceleration]
    return [float(np.abs(f - true[:, k]).max() / np.abs(true[:, k]).max()) for k, f in enumerate(found)]
