"""The mechanisms that the tests of `dalembert export` write, and how they are written and taken back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.four_bars import body, four_bar
from virtualwork import Mechanism
from virtualwork.exchange.export import file_bytes

EXAMPLES = Path(__file__).parents[2] / "cli" / "examples"
FOUR_BAR = four_bar(
    body(0.4, (20, 3), "80 kg mm2"),
    body(0.6, (55, 10), "700 kg mm2"),
    body(0.5, (40, 0), "300 kg mm2"),
    lengths=(40, 110, 80, 100),
    points=", P = [60, 40]",
    head='name = "Four-bar <A & B>"\ngravity = [0, -9.81]',
    at=60,
    rates='speed = "300 rpm"',
    guess={"coupler": 20, "rocker": 90},
)
SLIDER_CRANK = """
gravity = [0, -9.81]
[units]
length = "mm"
angle = "deg"
[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], A = [45, 0] }
mass = 0.5
center = [10, 0]
inertia = 1e-4
[links.rod]
points = { A = [0, 0], B = [150, 0] }
mass = 0.7
center = [50, 0]
inertia = 1e-3
[links.piston]
points = { B = [0, 0] }
mass = 0.9
[[sliders]]
point = "B"
link = "piston"
through = [10, -20]
angle = 30
turned = -30
[input]
link = "crank"
angle = 40
speed = "600 rpm"
[guess]
at = 40
rod = -10
"""
PLANETARY = """
gravity = [0, -9.81]
[ground]
O = [0, 0]
[links.sun]
points = { O = [0, 0] }
mass = 1
inertia = 0.01
[links.arm]
points = { O = [0, 0], C = [0.12, 0] }
mass = 0.5
center = [0.06, 0]
inertia = 0.002
[links.planet]
points = { C = [0, 0], T = [0.04, 0] }
mass = 0.3
center = [0.01, 0]
inertia = 0.0005
[[gears]]
links = ["sun", "planet"]
ratio = -2.0
arm = "arm"
[[gears]]
links = ["planet", "ground"]
ratio = 0.25
arm = "arm"
[input]
link = "sun"
angle = "20 deg"
speed = "100 rad/s"
[guess]
at = "20 deg"
arm = 0.3
planet = 0
"""
SPRINGS = (
    FOUR_BAR
    + """
[[springs]]
between = ["coupler.P", "ground.D"]
stiffness = "4 N/mm"
free_length = 60
damping = 15
[[torsion_springs]]
links = ["ground", "rocker"]
stiffness = 2.5
free_angle = 90
damping = 0.01
[[torsion_springs]]
links = ["coupler", "crank"]
stiffness = 1.5
free_angle = 70
"""
)
MASSIVE = {"four-bar": FOUR_BAR, "springs": SPRINGS, "slider-crank": SLIDER_CRANK, "planetary": PLANETARY}
FILES = sorted(p for p in EXAMPLES.glob("*/*.toml") if "[links." in p.read_text())


def home(m: Mechanism) -> tuple[float, ...]:
    return tuple(at if e.value is None else e.value for e, at in zip(m.inputs, m.at, strict=True))


def exported(m: Mechanism, suffix: str, inputs: tuple[float, ...] | None = None) -> bytes:
    units = {"length": "mm", "angle": "deg"}
    return file_bytes(m, home(m) if inputs is None else inputs, suffix, "file.toml", units)[0]


def moved(m: Mechanism, inputs: Any) -> Any:
    return m.motion(inputs if len(m.inputs) > 1 else np.asarray(inputs)[:, 0])
