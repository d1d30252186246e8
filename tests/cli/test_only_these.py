"""--only of `inspect` and `spin`: nothing but the quantities that are named is computed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cli.spin import tables
from cli.spin.rotation import Rotation, read_body

RACKET = "inertia = [1, 2, 3]\nomega = [0.01, 1, 0.01]\n"
ALL = ("omega", "attitude", "momentum", "energy")


def rotation(folder, toml: str = RACKET) -> Rotation:
    path = folder / "body.toml"
    path.write_text(toml)
    return Rotation(read_body(str(path)), np.array([0.0, 2.5]), None, "DOP853")


def test_a_rotation_computes_what_is_named_and_shows_the_same_numbers(tmp_path) -> None:
    every = tables.states(rotation(tmp_path)).cells
    for only, needs in (
        ({"omega"}, {"omega"}),
        ({"attitude"}, {"attitude"}),
        ({"energy"}, {"omega", "energy"}),
        ({"momentum", "omega"}, {"omega", "attitude", "momentum"}),
    ):
        of = rotation(tmp_path)
        cells = tables.states(of, only).cells
        assert {name for name in ALL if name in vars(of.states)} == needs
        assert {name.split("_")[0] for name in cells} == {"t", *only}
        assert all(list(cells[name]) == list(every[name]) for name in cells)
    # a period is that of ω alone: four quarter periods of the elliptic functions, and no state
    of = rotation(tmp_path)
    assert tables.constants(of, {"period"}).cells["period_s"][0] == of.period
    assert not {*ALL} & {*vars(of.states)}


def test_spin_names_what_there_is(dalembert, tmp_path) -> None:
    (tmp_path / "body.toml").write_text(RACKET)
    done = dalembert("spin", "body.toml", "--only", "period,cones", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout).keys() == {"method", "period_s", "cones", "warnings"}
    assert dalembert("spin", "body.toml", "--only", "period").stdout.startswith("period_s\n")
    for wrong in ("omega.x", "", ",", "omega,Energy"):
        done = dalembert("spin", "body.toml", "--only", wrong)
        assert done.returncode == 2
        assert "--only" in done.stderr
        assert "omega, attitude" in done.stderr


FOUR_BAR = """
[ground]
A = [0, 0]
D = [0.4, 0]
[links.crank]
points = { A = [0, 0], B = [0.1, 0] }
mass = 1
[links.coupler]
points = { B = [0, 0], C = [0.3, 0], P = [0.1, 0.1] }
mass = 2
[links.rocker]
points = { D = [0, 0], C = [0.25, 0] }
[input]
link = "crank"
speed = 3
[guess]
coupler = 0.5
rocker = 1.5
"""


@pytest.mark.parametrize("only", ["B", "P.x", "P.x,rocker.omega", "crank.torque"])
def test_operations_are_those_of_what_is_named(dalembert, tmp_path, only: str) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("inspect", "m.toml", "--text", "--only", only)
    assert done.returncode == 0, done.stderr
    lines = done.stdout[done.stdout.index("Operations a pose") :].splitlines()[2:8]
    cost = {line.rpartition(" ")[0].strip(): float(line.split()[-1]) for line in lines if line}
    here = cost[only.replace(",", ", ")]
    assert 0 < here < cost["with accelerations"] + cost["forces"]
    if only == "P.x":
        assert here < cost["positions"]
    if only == "crank.torque":
        assert here < cost["forces"]
    if only == "B":
        # x and y of the crank's end with their two rates: from one cosine and one sine
        assert here < 20


def test_inspect_refuses_a_name_that_is_none(dalembert, tmp_path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("inspect", "m.toml", "--only", "nix")
    assert done.returncode == 1
    assert "no link or point is named 'nix'" in done.stderr
