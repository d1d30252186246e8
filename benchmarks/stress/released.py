"""Stress of motion under forces: random linkages released from rest, against every body's own coordinates."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.stress.pairs import Pairs
from benchmarks.truth.bodies_in_time import Bodies
from virtualwork import Guess, Guide, Input, Link, Mechanism, MechanismError

Places = dict[str, complex]
# links by the points they join, ground's last
LINKAGES = {
    "four-bar": (["AB", "BC", "CD"], "AD"),
    "Watt six-bar": (["AB", "BC", "CDE", "EF", "FG"], "ADG"),
    "Stephenson six-bar": (["AB", "BCE", "CD", "EF", "FG"], "ADG"),
    "five-bar": (["AB", "BC", "CD", "DE"], "AE"),
}


# the tolerance of the reference
FINE = 1e-13


def _linkage(rng: np.random.Generator, kind: str) -> Mechanism:
    """A linkage through points anywhere in a square of 1 m, any of its links as the input."""
    bars, ground = LINKAGES[kind]
    places: Places = {name: complex(*rng.uniform(-0.5, 0.5, 2)) for name in "ABCDEFG"}
    links, angles = {}, {}
    for bar in bars:
        origin, angle = places[bar[0]], float(rng.uniform(-math.pi, math.pi))
        own = {name: (places[name] - origin) * complex(math.cos(angle), -math.sin(angle)) for name in bar}
        center = sum(own.values()) / len(own) * rng.uniform(0.5, 1.5)
        mass, radius = 10.0 ** rng.uniform(-1, 1), rng.uniform(0.02, 0.3)
        links[bar], angles[bar] = Link(own, mass=mass, center=center, inertia=mass * radius**2), angle
    count = 2 if kind == "five-bar" else 1
    drivers = rng.choice(len(bars), count, replace=False)
    inputs = [Input(link=bars[i], value=angles[bars[i]]) for i in drivers]
    at = [angles[bars[i]] for i in drivers]
    return Mechanism(
        {name: places[name] for name in ground},
        links,
        inputs=inputs,
        guess=Guess(at, angles, {name: places[name] for bar in bars for name in bar if name not in ground}),
        gravity=-9.81j,
    )


def _slider_crank(rng: np.random.Generator) -> Mechanism:
    """A slider-crank, in line or not, released by its crank or its rod."""
    crank, rod = (10.0 ** rng.uniform(-1, 0, 2)).tolist()
    turned = float(rng.uniform(-math.pi, math.pi))
    middle = crank * complex(math.cos(turned), math.sin(turned))
    leaning = float(rng.uniform(-0.9, 0.9))
    height = middle.imag + rod * math.sin(leaning)
    driver, at = [("crank", turned), ("rod", leaning)][int(rng.integers(2))]
    return Mechanism(
        {"A": 0j},
        {
            "crank": Link({"A": 0j, "B": complex(crank)}, mass=1, center=complex(crank / 2), inertia=0.02),
            "rod": Link({"B": 0j, "C": complex(rod)}, mass=1, center=complex(rod / 2), inertia=0.03),
            "slider": Link({"C": 0j}, mass=float(rng.uniform(0.1, 3))),
        },
        guides=[Guide("C", "slider", through=complex(0, height), turned=0.0)],
        inputs=Input(link=driver, value=at),
        guess=Guess(at, {"crank": turned, "rod": leaning}),
        gravity=-9.81j,
    )


def pairs_of(m: Mechanism, end: float, accuracy: float) -> Pairs:
    """The error of the inputs and its estimate at some times; what the reference itself may err by is no error."""
    run = m.simulate(np.linspace(0, end, 5), accuracy=accuracy)
    if len(run.t) < 2:
        return []
    start = [float(e.value or 0.0) for e in m.inputs]
    fine, coarse = (
        Bodies(m).angles(start, [0.0] * len(start), run.t, tolerance) for tolerance in (FINE, 1e-11)
    )
    found: Pairs = []
    for j, entry in enumerate(m.inputs):
        name = str(entry.link)
        turned = run.angle[:, j] - run.angle[0, j]
        # two references may agree by chance: they say nothing below their tolerance
        own = np.maximum(np.abs(fine[name] - coarse[name]), FINE)
        error = np.abs(turned - (fine[name] - fine[name][0])) - np.maximum.accumulate(own)
        found += zip(np.maximum(error, 0.0)[1:].tolist(), run.error_estimate[1:, j].tolist(), strict=True)
    return found


def _released(rng: np.random.Generator) -> Pairs:
    """Any kind, from rest anywhere, for a second or so at any accuracy."""
    kind = [*LINKAGES, "slider-crank"][int(rng.integers(len(LINKAGES) + 1))]
    accuracy = 10.0 ** rng.uniform(-10, -2)
    try:
        m = _slider_crank(rng) if kind == "slider-crank" else _linkage(rng, kind)
        return pairs_of(m, float(rng.uniform(0.3, 1.5)), accuracy)
    except MechanismError:
        # not to be told which assembly, or at a limit
        return []


CAMPAIGNS = {
    "released linkages": ("from rest anywhere, against bodies with joint forces as multipliers", _released)
}
