"""Where a load lies outside the rows of its table, what depends on it has no value, and the reason is that table."""

from __future__ import annotations

import json

import pytest

ARM = """gravity = [0, -10]
[units]
angle = "deg"
[ground]
O = [0, 0]
[links.arm]
points = {{ O = [0, 0], P = [1, 0] }}
mass = 2
center = [0.5, 0]
[input]
link = "arm"
angle = 60
speed = {speed}
{load}
"""
TORQUE = '[[torques]]\nlink = "arm"\ntorque = "t.csv"'
FORCE = '[[forces]]\nlink = "arm"\npoint = "P"\ntable = "t.csv"'


@pytest.mark.parametrize(
    ("load", "table", "speed", "over"),
    [
        (TORQUE, "speed_rad_s,torque_N_m\n0,8\n10,3\n", -1, "speed has rows from 0 to 10 rad/s"),
        (TORQUE, "angle_deg,torque_N_m\n0,8\n45,3\n", 1, "angle has rows from 0 to 45 deg"),
        (FORCE, "angle_deg,fx_N,fy_N\n-90,8,1\n45,3,2\n", 1, "input has rows from -90 to 45 deg"),
    ],
)
@pytest.mark.parametrize("more", [(), ("--at", "61deg")])
def test_the_reason_is_the_table(dalembert, tmp_path, load, table, speed, over, more):
    (tmp_path / "arm.toml").write_text(ARM.format(speed=speed, load=load))
    (tmp_path / "t.csv").write_text(table)
    done = dalembert("forces", "arm.toml", "--at", "60deg", *more, "--json", "--steps")
    found = json.loads(done.stdout)
    assert found["poses"][0]["effort"]["input_torque_N_m"] is None
    (said,) = found["warnings"]
    assert said.startswith("at input 60 deg")
    assert over in said
    assert "on arm has no value" in said
    # the worked solution stands, with a dash for what has no value
    text = dalembert("forces", "arm.toml", "--at", "60deg", "--steps", "--text")
    assert text.returncode == 0
    assert "= – W" in text.stdout


def test_within_its_rows_nothing_is_said(dalembert, tmp_path):
    (tmp_path / "arm.toml").write_text(ARM.format(speed=5, load=TORQUE))
    (tmp_path / "t.csv").write_text("speed_rad_s,torque_N_m\n0,8\n10,3\n")
    done = dalembert("forces", "arm.toml", "--at", "60deg", "--only", "arm.torque")
    assert done.stderr == ""
    # 2·10·0.5·cos 60° less 5.5 of the table
    assert float(done.stdout.split(",")[-1]) == pytest.approx(5 - 5.5)
