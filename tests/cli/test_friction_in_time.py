"""A block on level ground with dry friction, through the command: it stops, and stands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import Dalembert

BLOCK = """
gravity = [0, -9.81]
[ground]
O = [0, 0]
[links.block]
points = { P = [0, 0] }
mass = 2
[[sliders]]
point = "P"
[input]
slider = "P"
position = 0.1
speed = "SPEED m/s"
[[friction]]
joint = "P"
coefficient = 0.3
"""


@pytest.mark.parametrize("speed", [3, -3, 1, -1])
def test_the_textbook_block_stands_where_it_should(dalembert: Dalembert, tmp_path: Path, speed: int) -> None:
    path = tmp_path / "block.toml"
    path.write_text(BLOCK.replace("SPEED", str(speed)))
    done = dalembert("simulate", str(path), "--time", "0:3:0.5", "--json")
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)["time"]
    assert [row["t_s"] for row in rows] == [0, 0.5, 1, 1.5, 2, 2.5, 3]
    last = rows[-1]["inputs"]["P"]
    assert last["position_m"] == pytest.approx(0.1 + speed * abs(speed) / (2 * 0.3 * 9.81), rel=1e-12)
    assert last["speed_m_s"] == 0


@pytest.mark.parametrize(("speed", "warned"), [(3, "joint forces at 1.5 s and 3 later times:"), (9, "")])
def test_joint_forces_of_a_block_at_rest(
    dalembert: Dalembert, tmp_path: Path, speed: int, warned: str
) -> None:
    """It slides for v/(μ g); then friction is what the other loads need, and no joint force has it."""
    path = tmp_path / "block.toml"
    path.write_text(BLOCK.replace("SPEED", str(speed)))
    done = dalembert("simulate", str(path), "--time", "0:3:0.5", "--forces")
    assert warned in done.stderr
    assert ("without the friction" in done.stderr) == bool(warned)
    # without --forces there is nothing to warn of
    assert not dalembert("simulate", str(path), "--time", "0:3:0.5").stderr
