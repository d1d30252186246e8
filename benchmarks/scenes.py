"""The mechanisms that are measured: Norton's four-bar, the Klann leg of 003, and a chain of four-bars."""

from __future__ import annotations

import math
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.truth import reference
from virtualwork import Force, Guess, Input, Link, Mechanism, Torque

if TYPE_CHECKING:
    Real = NDArray[np.float64]

EVERY = 63  # the references are at 64 angles: a sweep of EVERY·k + 1 poses runs through all of them


def sweep(known: Any, poses: int) -> tuple[Real, int]:
    """Return a uniform sweep of about `poses` poses through the reference's angles, and the stride between those."""
    angles = np.array(known["angle_rad"])
    stride = max(1, poses // EVERY)
    out = np.linspace(angles[0], angles[-1], EVERY * stride + 1)
    out[::stride] = angles
    return out, stride


def four_bar(*, loaded: bool = False) -> Mechanism:
    """Return Norton's four-bar of example 4-1; `loaded` with masses, gravity and a torque on the rocker."""
    known = reference("four_bar")
    mass, inertia, center = (
        (known[key] for key in ("mass_kg", "inertia_kg_m2", "center_m"))
        if loaded
        else ([0.0] * 3, [0.0] * 3, [(0.0, 0.0)] * 3)
    )
    points: list[dict[str, Any]] = [
        {"A": (0, 0), "B": (0.04, 0)},
        {"B": (0, 0), "C": (0.12, 0)},
        {"D": (0, 0), "C": (0.08, 0)},
    ]
    links = [Link(points[i], mass[i], center[i], inertia[i]) for i in range(3)]
    return Mechanism(
        ground={"A": (0, 0), "D": (0.1, 0)},
        links=dict(zip(("crank", "coupler", "rocker"), links, strict=True)),
        inputs=Input(link="crank"),
        guess=Guess(at=math.radians(40), angles={"coupler": 0.3, "rocker": 1.0}),
        gravity=(0, -known["gravity_m_s2"]) if loaded else 0j,
        torques=[Torque("rocker", known["rocker_torque_N_m"])] if loaded else [],
    )


def klann() -> Mechanism:
    """Return the Klann leg, from the worked example's own file."""
    return Mechanism.from_toml(str(files("cli") / "examples" / "klann" / "klann.toml"))


def loaded_klann(*, masses: bool = True, gravity: bool = True) -> Mechanism:
    """Return the Klann leg with a force at its foot, with or without masses and gravity."""
    bare = klann()
    links = {
        name: Link(dict(link.points), 1.0, sum(link.points.values()) / len(link.points), 0.01)
        if masses
        else link
        for name, link in bare.links.items()
    }
    foot = bare.links["leg"].points["H"]
    return Mechanism(
        ground=dict(bare.ground),
        links=links,
        inputs=bare.inputs,
        guess=bare.guess,
        gravity=(0, -9.81) if gravity else 0j,
        forces=[Force("leg", foot, 5 + 40j)],
    )


def chain(bars: int) -> Mechanism:
    """Return a chain of four-bars: the first is Norton's, each next one a parallelogram whose rocker turns as its crank.

    Every rocker has the angle of the first, so that the last one's error is known.
    """
    ground = {"A": (0.0, 0.0)} | {f"D{i}": (0.1 * (i + 1), 0.0) for i in range(bars)}
    links = {"crank": Link({"A": (0, 0), "B": (0.04, 0)})}
    angles = {}
    before = "B"
    for i in range(bars):
        links[f"coupler{i}"] = Link({before: (0, 0), f"C{i}": (0.12 if i == 0 else 0.1, 0)})
        links[f"rocker{i}"] = Link({f"D{i}": (0, 0), f"C{i}": (0.08, 0)})
        angles[f"coupler{i}"], angles[f"rocker{i}"] = (0.3 if i == 0 else 0.0), 1.0
        before = f"C{i}"
    return Mechanism(
        ground=ground,
        links=links,
        inputs=Input(link="crank"),
        guess=Guess(at=math.radians(40), angles=angles),
    )
