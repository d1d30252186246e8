"""A rate that a singular pose does not determine is left out, and a warning says why."""

from __future__ import annotations

import json

import pytest

from tests.four_bars import four_bar

CRANK = """[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], A = [1, 0] }
[links.rod]
points = { A = [0, 0], B = [2, 0] }
[[slots]]
point = "B"
link = "rod"
[input]
slider = "B"
position = 2.5
SPEED
[guess]
crank = 1
rod = -0.5
"""
WHY = "the pose is singular: the speed of the input does not determine the other rates, which have no value"


@pytest.mark.parametrize(
    ("options", "where"),
    [
        (["--at", "3m"], "at input 3 m: "),  # stretched
        (["--at", "1m"], "at input 1 m: "),  # folded
        (["--at", "1m", "--at", "2m", "--at", "3m"], "at input 1 m, 3 m: "),
        (["--at", "2.9m"], None),
        (["--at", "3m", "--order", "position"], None),
        (["--at", "3m", "--only", "B.speed"], None),  # the slide's speed is the input's
        (["--at", "3m", "--over", "links.rod.B.x=1.9:2.1:0.1"], "variant 2: at input 3 m: "),
    ],
)
def test_at_the_ends_of_a_stroke(dalembert, tmp_path, options, where):
    (tmp_path / "m.toml").write_text(CRANK.replace("SPEED", "speed = 1"))
    found = json.loads(dalembert("mechanism", "m.toml", *options, "--json").stdout)
    said = [w for w in found["warnings"] if "cannot be assembled" not in w]
    assert said == ([f"{where}{WHY}"] if where else [])


def test_at_rest_nothing_is_missing(dalembert, tmp_path):
    (tmp_path / "m.toml").write_text(CRANK.replace("SPEED", "speed = 0"))
    found = dalembert("mechanism", "m.toml", "--at", "3m", "--only", "crank.omega")
    assert (found.stdout.splitlines()[1], found.stderr) == ("1,3.0,0.0", "")


def test_links_that_fit_in_one_pose_alone(dalembert, tmp_path):
    """Crank 2, coupler 3, rocker 6, ground 1: 6 = 2 + 3 + 1, all in line."""
    (tmp_path / "m.toml").write_text(
        four_bar(
            lengths=(2, 3, 6, 1), length="m", at=180, rates="speed = 1", guess={"coupler": 180, "rocker": 180}
        )
    )
    found = dalembert("mechanism", "m.toml", "--only", "rocker.omega")
    assert found.stdout.splitlines()[1] == "1,180.0,"
    assert f"at input 180 deg: {WHY}" in found.stderr
