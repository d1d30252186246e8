"""Pages that compute what tables beside the file say: loads, laws of motion in time; and sweeps of many poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.computed_pages import machines, script_and_data
from tests.node import needs_node
from virtualwork import Mechanism
from virtualwork.describe.dimensions import changed
from virtualwork.motion import Motion

pytestmark = needs_node

PARALLELOGRAM = """
[ground]
A = [0, 0]
D = [0.3, 0]
[links.crank]
points = { A = [0, 0], B = [0.1, 0] }
mass = 1
inertia = 0.01
[links.coupler]
points = { B = [0, 0], C = [0.3, 0] }
mass = 2
[links.rocker]
points = { D = [0, 0], C = [0.1, 0] }
[input]
link = "crank"
speed = 3
acceleration = 1
[guess]
at = 60
coupler = 0
rocker = 60
[units]
angle = "deg"
"""
FOUR_BAR = PARALLELOGRAM.replace("C = [0.1, 0]", "C = [0.25, 0]").replace("coupler = 0", "coupler = 40")
LOADS = {
    "rocker's angle": ("[[torques]]\nlink = \"rocker\"\ntorque = \"t.csv\"\n", "angle_deg,torque_N_m\n-180,3\n20,-4\n180,3\n"),
    "coupler's speed": ("[[torques]]\nlink = \"coupler\"\ntorque = \"t.csv\"\n", "speed_rad_s,torque_N_m\n-9,3\n-1,-4\n0,0.5\n9,7\n"),
    "crank's angle": ("[[torques]]\nlink = \"crank\"\ntorque = \"t.csv\"\n", "angle_rad,torque_N_m\n0.5,3\n2,-4\n5,3\n"),
    "input": ("[[forces]]\nlink = \"coupler\"\npoint = \"C\"\nframe = \"link\"\ntable = \"t.csv\"\n", "angle_deg,fx_N,fy_N\n10,3,1\n170,-4,2\n190,7,-5\n370,3,1\n"),
}  # fmt: skip
NAMES = ("crank.torque", "B.coupler.fx", "C.coupler.fy", "rocker.omega")


def read(text: str, folder: Path, table: str = "") -> Mechanism:
    (folder / "t.csv").write_text(table)
    (folder / "m.toml").write_text(text)
    return Mechanism.from_toml(str(folder / "m.toml"))


def program(motion: Motion) -> list[Any]:
    forces = [motion.reaction(joint, on="coupler")[:, k] for joint, k in (("B", 0), ("C", 1))]
    return [motion.effort, *forces, motion.link("rocker").omega]


def apart(page: Any, true: list[Any]) -> float:
    """The largest difference as a share of the largest value of its kind; inf where one alone has a number."""
    worst = 0.0
    for kind in (slice(0, 1), slice(1, 3), slice(3, 4)):
        shown, right = np.array(page[kind], dtype=float), np.array(true[kind])
        if (np.isnan(shown) != np.isnan(right)).any():
            return float("inf")
        if shown.size:
            worst = max(worst, float(np.nanmax(np.abs(shown - right)) / np.nanmax(np.abs(right))))
    return worst


@pytest.mark.parametrize("shape", [PARALLELOGRAM, FOUR_BAR], ids=["parallelogram", "four-bar"])
@pytest.mark.parametrize("load", LOADS)
def test_loads_by_tables(load: str, shape: str, tmp_path: Path) -> None:
    part, table = LOADS[load]
    m = read(shape + part, tmp_path, table)
    q = np.linspace(-1.0, 6.9, 101)
    change = {"links.coupler.mass": 2.5, "ground.D.x": 0.3 if shape is PARALLELOGRAM else 0.29}
    page = m.motion(q).page(forces=True).html
    assert "const tapes" in page
    (shown,) = machines([page], tmp_path, [[{}, change]], [list(NAMES)], curves=True)
    for row, of in zip(shown, (m, changed(m, change)), strict=True):
        assert apart(row, program(of.motion(q))) < 1e-12


@pytest.mark.parametrize("shape", [PARALLELOGRAM, FOUR_BAR], ids=["parallelogram", "four-bar"])
def test_rates_that_follow_a_law(shape: str, tmp_path: Path) -> None:
    m = read(shape, tmp_path)
    t = np.linspace(0, 2, 61)
    motion = m.motion(4 * t - t**3 / 3, 4 - t**2, -2 * t)
    (shown,) = machines([motion.page(forces=True).html], tmp_path, [[{}]], [list(NAMES)], curves=True)
    assert apart(shown[0], program(motion)) < 1e-12


def test_ten_thousand_poses(tmp_path: Path) -> None:
    m = read(FOUR_BAR, tmp_path)
    motion = m.motion(np.linspace(0, 6, 10_000))
    (shown,) = machines([motion.page(forces=True).html], tmp_path, [[{}]], [["crank.torque"]], curves=True)
    assert apart(shown[0], [motion.effort]) < 1e-12


def test_the_file_names_its_tables(tmp_path: Path) -> None:
    m = read(PARALLELOGRAM + LOADS["input"][0], tmp_path, LOADS["input"][1])
    _, data = script_and_data(m.motion([1.0]).page().html)
    lines = [
        "".join(p if isinstance(p, str) else "" for p in line["of"])
        for line in data["model"]["toml"]
        if line["needed"]
    ]
    assert 'table = "t.csv"' in lines
    assert data["model"]["files"] == ["t.csv"]
