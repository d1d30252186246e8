"""An exercise on a rotor, a pendulum, and how their tables are read."""

from __future__ import annotations

import csv
from pathlib import Path

ROTOR = """name,weight_N,radius_mm,angle_deg,z_mm
W1,90,30,60,20
W2,60,50,210,65
"""
EXERCISE = """
command = "balance rotor.csv --plane A:0mm:20mm --plane B:90mm:20mm --gravity 10"
title = "A rotor"
text = "W1 = {rotor.csv:W1.weight_N} at {rotor.csv:W1.radius_mm}, W2 at {rotor.csv:W2.angle_deg}."
[draw]
"rotor.csv:W1.weight_N" = "60N:120N:5N"
"rotor.csv:W2.angle_deg" = [200, 210, 220]
[[ask]]
quantity = "mass_kg"
where = { plane = "B" }
figures = 3
points = 2
[[ask]]
quantity = "angle_deg"
where = { plane = "B" }
[[ask]]
quantity = "mass_kg"
where = { plane = "A" }
"""
PENDULUM = """
gravity = [0, -10]
[ground]
O = [0, 0]
[links.arm]
points = { O = [0, 0] }
mass = 2
center = [0.5, 0]
inertia = 0.3
[input]
link = "arm"
angle = "-90 deg"
"""


def rotor_exercise(folder: Path) -> Path:
    """Write the exercise on a rotor into a folder."""
    (folder / "rotor.csv").write_text(ROTOR)
    (folder / "e.toml").write_text(EXERCISE)
    return folder


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))
