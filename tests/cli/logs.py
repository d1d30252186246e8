"""Logs that the tests of `dalembert field LOG` read, and what is asked of the answer."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from typing import Any

import numpy as np


def polar(size: float, degrees: float) -> complex:
    return size * complex(np.exp(1j * np.radians(degrees)))


# the invented machine: two states of one sensor
STATES = {"100%n": (polar(80, 40), polar(2, 150)), "100%U": (polar(60, 55), polar(2.5, 140))}
BEST = -sum(v * a.conjugate() for v, a in STATES.values()) / sum(abs(a) ** 2 for _, a in STATES.values())


def number(value: float) -> str:
    return f"{value:.17g}".replace(".", ",")


def vector(value: complex) -> str:
    return f"{number(abs(value))};{number(float(np.degrees(np.angle(value))))}"


def log(
    masses: Sequence[tuple[float, float]], *, lagging: bool = False, skip: Sequence[tuple[int, str]] = ()
) -> str:
    """Write layout 1: one row a reading, masses as they are on the rotor."""
    lines = [" ;DoubleA;phase;mass;phase"]
    for k, (size, angle) in enumerate(masses):
        for state, (v0, alpha) in STATES.items():
            v = v0 + alpha * polar(size, angle)
            if (k + 1, state) not in skip:
                read = vector(v.conjugate() if lagging else v)
                lines.append(f"{state};{read};{number(size)};{number(angle)}")
    return "\n".join(lines) + "\n"


THREE = [(0, 0), (10, -90), (30, -60)]


def found(done: subprocess.CompletedProcess[str]) -> tuple[Any, list[str]]:
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    return document["rotors"][0], document["warnings"]


def correction(rotor: Any, plane: int = 0) -> complex:
    one = rotor["corrections"][plane]
    return polar(one["mass_kg"], one["angle_deg"])


TABLE = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"


def standard(masses: Sequence[complex], error: Sequence[complex], sensors: int = 2) -> str:
    """Write a table of runs, in g and µm."""
    lines = [TABLE]
    for k, (w, e) in enumerate(zip(masses, error, strict=True)):
        for s in range(sensors):
            v = polar(80 + s, 40) + polar(2, 150 - 20 * s) * w + e * (1 + s)
            on = f"A,{abs(w):.17g},{np.degrees(np.angle(w)):.17g}" if w else ",,"
            lines.append(f"{k},{s},{abs(v):.17g},{np.degrees(np.angle(v)):.17g},{on}\n")
    return "".join(lines)


MASSES = [0, 10j, 12, -9 - 9j, 8 - 8j, 0]
ERRORS = [0.2, -0.1j, 0.15j, -0.2, 0.1 + 0.1j, -0.05]
