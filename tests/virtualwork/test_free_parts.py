"""A part that floats though the count of joints says mobility 1, and what has no number: named, never an inner error."""

from __future__ import annotations

import numpy as np
import pytest

from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.describe import AssemblyError, MobilityError

# A gripper of ten links: a swivelling cylinder swings the upper arm, a gear the lower one, a parallelogram keeps the jaw
# level, and the palm's plate stands on three posts that are parallel and equal: by the count it is held.
GRIPPER = """
units = { length = "mm", angle = "deg" }
ground = { O = [-100, 0], A = [0, 40], P = [0, 60], D = [0, -40], U = [20, -10], V = [40, -10], W = [60, -15] }
input = { slider = "S" }
gears = [{ links = ["upper", "lower"], ratio = -1 }]
sliders = [{ point = "S", link = "rod", on = "cylinder", through = [0, 0], angle = 0 }]
[links]
cylinder.points = { O = [0, 0] }
rod.points = { S = [0, 0], B = [60, 0] }
upper.points = { A = [0, 0], B = [-30, 10], J = [100, 0] }
jaw.points = { J = [0, 0], K = [0, 20] }
bar.points = { P = [0, 0], K = [100, 0] }
lower.points = { D = [0, 0], M = [100, 0] }
plate.points = { X = [0, 0], Y = [20, 0], Z = [40, -5] }
post1.points = { U = [0, 0], X = [20, 0] }
post2.points = { V = [0, 0], Y = [20, 0] }
post3.points = { W = [0, 0], Z = [20, 0] }
[guess]
at = AT
cylinder = SWIVEL
rod = SWIVEL
upper = 0
jaw = 0
bar = 0
lower = 0
plate = 0
post1 = 80
post2 = 80
post3 = 80
"""


def gripper() -> str:
    """Upper arm level: its pin B stands at (−30, 50), 70 mm and 50 mm from the cylinder's pivot."""
    reach, swivel = abs(70 + 50j), float(np.degrees(np.angle(70 + 50j)))
    return GRIPPER.replace("AT", repr(reach - 60)).replace("SWIVEL", repr(swivel))


def test_the_plate_of_a_gripper_is_named() -> None:
    m = Mechanism.from_toml_text(gripper())
    assert len(m.links) == 10
    with pytest.raises(MobilityError, match=r"freedom: plate, post1, post2, post3 can .* mobility is 1"):
        m.motion(np.linspace(0.0, 0.03, 40)).assembled  # noqa: B018


def test_a_plate_on_one_pin_is_named() -> None:
    """The count is made up by a bar too many elsewhere: the joints' own graph shows it."""
    text = gripper().replace(
        "post1.points = { U = [0, 0], X = [20, 0] }", "post1.points = { U = [0, 0], J = [80, 50] }"
    )
    with pytest.raises(MobilityError, match="plate"):
        Mechanism.from_toml_text(text).motion().assembled  # noqa: B018


def test_the_command_names_it_too(dalembert, tmp_path) -> None:
    file = tmp_path / "gripper.toml"
    file.write_text(gripper())
    for command, *options in (["inspect"], ["mechanism", "--over", "20mm:30mm:10mm"]):
        run = dalembert(command, str(file), *options)
        assert run.returncode != 0
        assert "plate, post1, post2, post3 can still move" in run.stderr


def test_without_the_plate_it_moves() -> None:
    lines = [line for line in gripper().splitlines() if not line.startswith(("plate", "post"))]
    m = Mechanism.from_toml_text("\n".join(lines))
    motion = m.motion(m.at[0] + np.linspace(-0.005, 0.005, 11))
    assert motion.assembled.all()
    assert np.abs(np.sin(motion.link("jaw").angle)).max() < 1e-12
    upper, lower = motion.link("upper").angle, motion.link("lower").angle
    assert np.ptp(upper) > 0.05
    assert np.abs(upper + lower).max() < 1e-12


def test_counterweights_where_nothing_is_assembled() -> None:
    m = Mechanism(
        ground={"A": (0, 0), "D": (0.1, 0)},
        links={
            "crank": Link({"A": (0, 0), "B": (0.06, 0)}, mass=1, center=0.02),
            "coupler": Link({"B": (0, 0), "C": (0.04, 0)}, mass=1, center=0.02),
            "rocker": Link({"D": (0, 0), "C": (0.03, 0)}, mass=1, center=0.01),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=(0.2,), angles={"coupler": 0.3, "rocker": 1.0}),
    )
    with pytest.raises(AssemblyError, match="assembled at no pose"):
        m.motion(np.array([3.0, 3.2]), 10.0).counterweights(["crank"])
