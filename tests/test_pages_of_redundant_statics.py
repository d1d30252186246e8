"""Pages of redundant statics: what the program determines, to the same digits; NaN where no statics can tell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.computed_pages import machines
from tests.node import needs_node
from tests.virtualwork.test_redundant_statics import parallelogram
from virtualwork import Mechanism
from virtualwork.describe.dimensions import changed, dimensions, value
from virtualwork.motion import Motion
from virtualwork.quantities import Component, forces

pytestmark = needs_node


def everything(motion: Motion) -> tuple[dict[str, Component], str]:
    """The forces of a motion by their names, and its page."""
    every: dict[str, Component] = {}
    for each in forces(motion.mechanism, motion.dynamics.reactions.pairs):
        if each.key and not each.less:
            every.setdefault(each.names[0], each)
    page = motion.page(forces=True).html
    assert "const tapes" in page
    return every, page


def compare(rows: Any, motion: Motion, every: dict[str, Component]) -> None:
    """Hold the curves of a page against the program's."""
    right = []
    for each in every.values():
        z = np.ravel(motion.value(each.key))
        right.append(z.imag if each.imaginary else z.real)
    found, expected = np.array(rows, dtype=float), np.array(right, dtype=float)
    assert found.shape == expected.shape
    assert (np.isnan(found) == np.isnan(expected)).all()
    assert np.isnan(expected).any()
    assert np.nanmax(np.abs(found - expected)) < 1e-12 * np.nanmax(np.abs(expected))


THREE_CRANKS = """
[ground]
A = [0, 0]
F = [0.1, 0]
D = [0.3, 0]
[links.crank]
points = { A = [0, 0], B = [0.1, 0] }
mass = 1
[links.coupler]
points = { B = [0, 0], E = [0.1, 0], C = [0.3, 0] }
mass = 2
[links.middle]
points = { F = [0, 0], E = [0.1, 0] }
[links.rocker]
points = { D = [0, 0], C = [0.1, 0] }
[input]
link = "crank"
[guess]
at = 1
coupler = 0
middle = 1
rocker = 1
"""


HEAD, REST = THREE_CRANKS.split("[links.crank]", 1)
# with a bar of 3 kg that the crank drives as a rack
RACK = (
    "gravity = [0, -9.81]"
    + HEAD
    + """T = [0, -0.05]
[links.bar]
points = { S = [0, 0] }
mass = 3
center = [0.02, 0.01]
[links.crank]"""
    + REST.replace(
        "[input]",
        """[[sliders]]
point = "S"
link = "bar"
through = "T"
angle = 0
[[racks]]
gear = "crank"
slider = "S"
radius = 0.05
[input]""",
    )
)
# with a valve of 0.4 kg that a cam on the crank lifts
CAM = (
    "gravity = [0, -9.81]"
    + HEAD
    + """[links.valve]
points = { V = [0, 0] }
mass = 0.4
center = [0.01, 0.1]
[links.crank]"""
    + REST.replace(
        "[input]",
        """[[sliders]]
point = "V"
link = "valve"
through = "A"
angle = 90
[[cams]]
cam = "crank"
slider = "V"
face = "roller"
base_radius = 0.03
roller_radius = 0.01
law = [{ to = 2.0, rise = 0.02, motion = "cycloidal" }, { to = 4.0, motion = "cycloidal" }, { motion = "dwell" }]
[input]""",
    )
)


def test_the_simplest(tmp_path: Path) -> None:
    m = Mechanism.from_toml_text(THREE_CRANKS)
    motion = m.motion([0.5, 1.0], 3.0, 1.0)
    every, page = everything(motion)
    (shown,) = machines([page], tmp_path, [[{}]], [list(every)], curves=True)
    compare(shown[0], motion, every)


@pytest.mark.slow
def test_three_cranks_of_a_parallelogram(tmp_path: Path) -> None:
    m = parallelogram(third_crank=True)
    q = np.linspace(0.9, 1.1, 3)
    change = {"links.coupler.mass": 3.5, "links.arm.center.x": 0.7}
    every, page = everything(m.motion(q, 2.0, -1.5))
    (shown,) = machines([page], tmp_path, [[{}, change]], [list(every)], curves=True)
    for rows, of in zip(shown, (m, changed(m, change)), strict=True):
        compare(rows, of.motion(q, 2.0, -1.5), every)


@pytest.mark.slow
def test_random_dimensions(tmp_path: Path, first_seed: int) -> None:
    """Masses, centres and loads at random, over a wide sweep: the same forces, the same ones undetermined."""
    m, rng = parallelogram(third_crank=True), np.random.default_rng(first_seed)
    q = np.linspace(0.4, 2.2, 9)
    numbers = [
        d for d in dimensions(m).values() if d.where[0] != "inputs" and d.kind not in ("length", "angle")
    ]
    tries = [
        {d.path: float(np.real(value(m, d.path))) * rng.uniform(0.5, 2) for d in rng.choice(numbers, 4)}
        for _ in range(20)
    ]
    every, page = everything(m.motion(q, 2.0, -1.5))
    (shown,) = machines([page], tmp_path, [tries], [list(every)], curves=True)
    for rows, change in zip(shown, tries, strict=True):
        compare(rows, changed(m, change).motion(q, 2.0, -1.5), every)


@pytest.mark.slow
@pytest.mark.parametrize("text", [RACK, CAM], ids=["rack", "cam"])
def test_racks_and_cams(text: str, tmp_path: Path) -> None:
    m = Mechanism.from_toml_text(text)
    motion = m.motion([0.5, 1.0, 2.5], 3.0, 1.0)
    every, page = everything(motion)
    change = {"links.coupler.mass": 3.5}
    (shown,) = machines([page], tmp_path, [[{}, change]], [list(every)], curves=True)
    for rows, of in zip(shown, (m, changed(m, change)), strict=True):
        compare(rows, of.motion([0.5, 1.0, 2.5], 3.0, 1.0), every)


def test_a_cam_presses_whether_or_not_other_joints_are_redundant() -> None:
    """The third crank bears nothing of the valve; the effort by Newton and Euler is that by virtual work."""
    m = Mechanism.from_toml_text(CAM)
    middle = CAM.index("[links.middle]"), CAM.index("[links.rocker]")
    plain = Mechanism.from_toml_text(
        (CAM[: middle[0]] + CAM[middle[1] :]).replace("F = [0.1, 0]", "").replace("middle = 1", "")
    )
    own, other = (each.motion([0.5, 1.0, 2.5], 3.0, 1.0).dynamics for each in (m, plain))
    assert own.reactions.redundant
    assert not other.reactions.redundant
    assert own.contact(0) == pytest.approx(other.contact(0), rel=1e-12)
    assert own.newton_euler == pytest.approx(own.effort, rel=1e-12)
