"""Pages of gears behind loops: angles with their whole turns, and constants that follow from the links that the guess places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.stress.topologies import generate
from tests.computed_pages import machines
from tests.node import needs_node
from tests.stress.test_pages_agree import Tried, faults, regular, tried
from virtualwork import Mechanism
from virtualwork.describe import MechanismError
from virtualwork.describe.dimensions import changed
from virtualwork.motion import Motion

pytestmark = needs_node
# a ground link shorter than the others: crank and rocker both turn round and round
DRAG_LINK = """
[ground]
A = [0, 0]
D = [0.1, 0]
G = [0.1, 0.5]
[links.crank]
points = { A = [0, 0], B = [0.3, 0] }
[links.coupler]
points = { B = [0, 0], C = [0.35, 0] }
[links.rocker]
points = { D = [0, 0], C = [0.32, 0] }
[links.wheel]
points = { G = [0, 0], H = [0.1, 0] }
[[gears]]
links = ["rocker", "wheel"]
ratio = RATIO
[input]
link = "crank"
[guess]
at = 0.5
coupler = 1.9
rocker = 1.2
wheel = 0.3
"""
# two cranks, each with an input; a wheel geared to what lies between
FIVE_BAR = """
[ground]
A = [0, 0]
E = [0.3, 0]
G = [0.1, 0.9]
[links.left]
points = { A = [0, 0], B = [0.2, 0] }
[links.first]
points = { B = [0, 0], C = [0.3, 0] }
[links.second]
points = { D = [0, 0], C = [0.3, 0] }
[links.right]
points = { E = [0, 0], D = [0.15, 0] }
[links.wheel]
points = { G = [0, 0], H = [0.1, 0] }
[[gears]]
links = ["first", "wheel"]
ratio = -1.3
[[input]]
link = "left"
[[input]]
link = "right"
[guess]
at = [1.8, 1.2]
first = 0.8
second = 2.2
"""


def apart(m: Mechanism, poses: list[float], changes: list[dict[str, float]], folder: Path) -> float:
    """How far the wheel of a page stands from the program's over poses, after changes; of a radius of 0.1 m."""
    page = Motion(m.assembly, poses).page().html
    assert "const tapes" in page
    (shown,) = machines([page], folder, [changes], [["H.x", "H.y"]], curves=True)
    places = [Motion(changed(m, change).assembly, poses).point("H").position for change in changes]
    return float(np.abs(np.array(shown, dtype=float).transpose(0, 2, 1) - places).max())


def test_the_simplest(tmp_path: Path) -> None:
    """Beyond a turn of the rocker, of a fractional ratio."""
    m = Mechanism.from_toml_text(DRAG_LINK.replace("RATIO", "0.4"))
    assert apart(m, [-1.0, 9.0], [{}], tmp_path) < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [-2.0, 0.4, 11.3])
def test_several_turns(ratio: float, tmp_path: Path) -> None:
    """Over four turns of the rocker, forwards and back from the guess; a ratio that is no longer a whole number."""
    m = Mechanism.from_toml_text(DRAG_LINK.replace("RATIO", str(ratio)))
    changes: list[dict[str, float]] = [{}, {"gears.1.ratio": ratio + 0.25, "links.rocker.C.x": 0.33}]
    assert apart(m, np.linspace(-13.0, 14.0, 41).tolist(), changes, tmp_path) < 1e-12


@pytest.mark.slow
def test_several_inputs(tmp_path: Path) -> None:
    """Each pose on its own straight line of inputs from the guess; beyond a place that is not assembled there is none."""
    m = Mechanism.from_toml_text(FIVE_BAR)
    rows = [[1.8, 1.2], [2.5, 0.7], [8.0, 1.2], [1.0, 7.0], [1.8, 9.0]]
    motion = Motion(m.assembly, rows)
    (shown,) = machines([motion.page().html], tmp_path, [[{}]], [["H.x", "H.y"]], curves=True)
    page = np.array(shown[0], dtype=float).T
    place = motion.point("H").position
    assert np.isfinite(place).any()
    assert (np.isfinite(page) == np.isfinite(place)).all()
    assert np.nanmax(np.abs(page - place)) < 1e-13


@pytest.mark.slow
def test_random_mechanisms(tmp_path: Path, first_seed: int) -> None:
    """With gears, belts and racks behind loops, near the guess and turns away from it."""
    rng, every = np.random.default_rng(first_seed), list[Tried]()
    for seed in range(first_seed, first_seed + 150):
        m = generate(seed).mechanism
        try:
            if not m.assembly.geared or not regular(m):
                continue
        except MechanismError:
            continue
        near = tried(f"topology {seed}", m, rng, 3, 0.003)
        far = tried(f"topology {seed}, turns away", m, rng, 3, 0.003, turns=3) if len(m.inputs) == 1 else None
        every += [t for t in (near, far) if t is not None]
    assert len(every) > 15
    assert faults(every, tmp_path, 1e-12) == []
