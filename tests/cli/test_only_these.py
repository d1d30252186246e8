"""--only of `inspect`, `spin` and `body`: nothing but the quantities that are named is computed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cli.body import states
from rigidbody3d.rotation_in_time import Rotation
from rigidbody3d.turning_body import read_body

RACKET = "inertia = [1, 2, 3]\nomega = [0.01, 1, 0.01]\n"
ALL = ("omega", "attitude", "momentum", "energy")


def rotation(folder, toml: str = RACKET) -> Rotation:
    path = folder / "body.toml"
    path.write_text(toml)
    return Rotation(read_body(str(path)), np.array([0.0, 2.5]), None, "DOP853")


def test_a_rotation_computes_what_is_named_and_shows_the_same_numbers(tmp_path) -> None:
    every = states.states(rotation(tmp_path)).cells
    for only, needs in (
        ({"omega"}, {"omega"}),
        ({"attitude"}, {"attitude"}),
        ({"energy"}, {"omega", "energy"}),
        ({"momentum", "omega"}, {"omega", "attitude", "momentum"}),
    ):
        of = rotation(tmp_path)
        cells = states.states(of, only).cells
        assert {name for name in ALL if name in vars(of.states)} == needs
        assert {name.split("_")[0] for name in cells} == {"t", *only}
        assert all(list(cells[name]) == list(every[name]) for name in cells)
    # a period is that of ω alone: four quarter periods of the elliptic functions, and no state
    of = rotation(tmp_path)
    assert states.constants(of, {"period"}).cells["period_s"][0] == of.period
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
    if only in ("P.x", "crank.torque"):
        # the torque is that of the crank's end alone: the coupler's mass lies there
        assert here < cost["positions"]
    if only == "B":
        # x and y of the crank's end with their two rates: from one cosine and one sine
        assert here < 20


def test_inspect_refuses_a_name_that_is_none(dalembert, tmp_path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("inspect", "m.toml", "--only", "nix")
    assert done.returncode == 2
    assert "no link or point is named 'nix'" in done.stderr


PARTS = """part,shape,mass_kg,x_mm,y_mm,z_mm,length_mm,axis_x,axis_y,axis_z
rod,rod,2,30,10,100,200,1,0,1
ball,point,0.5,-40,20,300,,,,
"""
SHAFT = ("--shaft", "0mm:400mm", "--speed", "600rpm", "--correct", "A:50mm:20mm", "--correct", "B:350mm:20mm")


def test_a_body_shows_what_is_named_with_the_same_numbers(dalembert, tmp_path) -> None:
    (tmp_path / "parts.csv").write_text(PARTS)

    def columns(*options: str) -> dict[str, list[str]]:
        done = dalembert("body", "parts.csv", *SHAFT, *options)
        assert done.returncode == 0, done.stderr
        rows = [line.split(",") for line in done.stdout.splitlines()]
        return {name: list(cells) for name, *cells in zip(*rows, strict=True)}

    every = columns()
    for only, names in (
        ("mass,energy", {"mass_kg", "energy_J"}),
        ("inertia", {"inertia_x_kg_m2", "inertia_y_kg_m2", "inertia_z_kg_m2"}),
        ("momentum", {"momentum_kg_m2_s"}),
        ("bearing2", {"bearing2_static_N", "bearing2_dynamic_N", "bearing2_corrected_N"}),
        ("corrections", {name for name in every if name.startswith("correction_")}),
    ):
        shown = columns("--only", only)
        assert shown.keys() - {"axis"} == names
        assert all(every[name][: len(cells)] == cells for name, cells in shown.items())
    done = dalembert("body", "parts.csv", *SHAFT, "--only", "momentum,drive_torque,bearing1", "--json")
    document = json.loads(done.stdout)
    assert document.keys() == {"momentum_kg_m2_s", "shaft", "warnings"}
    assert document["shaft"].keys() == {"drive_torque_N_m", "bearings"}
    whole = json.loads(dalembert("body", "parts.csv", *SHAFT, "--json").stdout)
    assert document["momentum_kg_m2_s"] == whole["momentum_kg_m2_s"]
    assert document["shaft"]["bearings"] == whole["shaft"]["bearings"]
    assert document["shaft"]["drive_torque_N_m"] == whole["shaft"]["drive_torque_N_m"]
    done = dalembert("body", "parts.csv", "--only", "bearing1")
    assert done.returncode == 2
    assert "expected mass, center, inertia" in done.stderr


def test_principal_axes_are_not_computed_for_a_momentum(tmp_path, monkeypatch) -> None:
    from cli.body import tables as of_body
    from cli.body.moving import MovingBody, Request
    from rigidbody3d import Body
    from rigidbody3d.parts import read_bodies

    (tmp_path / "parts.csv").write_text(PARTS)
    body = MovingBody(read_bodies(str(tmp_path / "parts.csv"))[0], Request(omega=(0.0, 1.0, 2.0)))
    monkeypatch.setattr(Body, "principal", property(lambda _: pytest.fail("not requested")))
    assert len(of_body.axes(body, {"momentum"}).cells) == 2
    with pytest.raises(pytest.fail.Exception):
        of_body.axes(body, {"principal_axes"})
