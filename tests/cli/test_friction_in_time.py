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


@pytest.mark.parametrize("pull", [0, 2, -2])
def test_joint_forces_of_a_block_at_rest(dalembert: Dalembert, tmp_path: Path, pull: int) -> None:
    """It slides for v/(μ g − F/m); then friction is what the pull needs."""
    path = tmp_path / "block.toml"
    pulled = f"[[forces]]\nlink = 'block'\npoint = 'P'\nforce = [{pull}, 0]\n" if pull else ""
    path.write_text(BLOCK.replace("SPEED", "3") + pulled)
    done = dalembert("simulate", str(path), "--time", "0:3:0.5", "--forces", "--json", "--digits")
    assert not done.stderr
    rows = json.loads(done.stdout)["time"]
    along = [row["reactions"][0]["fx_N"] for row in rows]
    stops = 3 / (0.3 * 9.81 - pull / 2)
    assert along == pytest.approx(
        [-0.3 * 2 * 9.81 if row["t_s"] < stops else -pull for row in rows], abs=1e-13
    )
    assert all(row["reactions"][0]["fy_N"] == pytest.approx(2 * 9.81, rel=1e-15) for row in rows)


@pytest.mark.parametrize("second", ["", "[[friction]]\njoint = 'D'\ncoefficient = 0.2\nradius = 10\n"])
def test_what_statics_does_not_determine_at_rest_has_a_warning(
    dalembert: Dalembert, tmp_path: Path, second: str
) -> None:
    """One pin that holds a four-bar bears what balances the weights; of two pins nobody knows which does."""
    assert dalembert("examples", "falling-four-bar").returncode == 0
    path = tmp_path / "falling.toml"
    path.write_text(path.read_text().replace("coefficient = 0.2", "coefficient = 0.8") + second)
    # without --forces there is nothing to warn of
    assert not dalembert("simulate", str(path), "--time", "0:60:20").stderr
    done = dalembert("simulate", str(path), "--time", "0:60:20", "--forces", "--json")
    rows = json.loads(done.stdout)["time"]
    assert rows[-1]["inputs"]["crank"]["speed_rad_s"] == 0
    assert ("joint forces at" in done.stderr) == bool(second)
    torque = next(r["moment_N_m"] for r in rows[-1]["reactions"] if r["joint"] == "A")
    assert bool(torque) != bool(second)
