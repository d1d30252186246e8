"""`dalembert grade` on questions that the command is run again for: field balancing, mechanisms, bodies."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from tests.conftest import Dalembert

RUNS = """run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg,trial_kept
0,1,80,40,,,,
0,2,60,55,,,,
1,1,70,75,A,10,0,yes
1,2,66,80,A,10,0,yes
2,1,95,60,B,12,90,
2,2,40,100,B,12,90,
"""
FIELD = """
command = "field runs.csv"
[[ask]]
quantity = "mass_g"
where = { plane = "A" }
figures = 4
[[ask]]
quantity = "angle_deg"
where = { plane = "A" }
figures = 4
"""
BAR = """
[units]
length = "mm"
angle = "deg"
[ground]
A = [0, 0]
D = [300, 0]
[links.crank]
points = { A = [0, 0], B = [100, 0] }
[links.bar]
points = { B = [0, 0], C = [250, 0] }
[links.rocker]
points = { D = [0, 0], C = [150, 0] }
[input]
link = "crank"
angle = 60
speed = "300 rpm"
[guess]
at = 60
bar = 20
rocker = 80
"""


def mistakes(dalembert: Dalembert, folder: Path, exercise: str, rows: str) -> list[str | None]:
    (folder / "e.toml").write_text(exercise)
    (folder / "a.csv").write_text(rows)
    done = dalembert("grade", "e.toml", "a.csv", "--json")
    assert done.returncode == 0, done.stderr
    return [mark["mistake"] for mark in json.loads(done.stdout)["marks"]]


def solved(dalembert: Dalembert, *words: object) -> list[dict[str, str]]:
    done = dalembert(*words)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader(done.stdout.splitlines()))


def test_a_trial_mass_left_on_and_the_phase_the_other_way(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "runs.csv").write_text(RUNS)
    (tmp_path / "removed.csv").write_text(RUNS.replace(",yes", ","))
    removed = solved(dalembert, "field", "removed.csv")[0]
    lagging = solved(dalembert, "field", "runs.csv", "--phase-lag")[0]
    head = "student,plane,quantity,answer\n"
    for given, said in ((removed, "left on"), (lagging, "the phase is counted the other way")):
        rows = head + "".join(f"1,A,{name},{float(given[name]):.6g}\n" for name in ("mass_g", "angle_deg"))
        named = mistakes(dalembert, tmp_path, FIELD, rows)
        assert any(text is not None and said in text for text in named), named


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--branch", "2"), "the other assembly"),
        (("--at", "60rad"), "degrees taken as radians"),
        (("--set", "input.speed=300rad_s"), "rpm in place of rad/s"),
        (("--set", "links.bar.C.x=25mm"), None),
    ],
)
def test_slips_in_a_mechanism(
    dalembert: Dalembert, tmp_path: Path, words: tuple[str, ...], said: str | None
) -> None:
    (tmp_path / "bar.toml").write_text(BAR)
    exercise = (
        'command = "mechanism bar.toml --at 60deg"\ntext = "{input.speed}, {links.crank.B.x}"\n'
        '[[ask]]\nquantity = "rocker_omega_rad_s"\nfigures = 4\n'
    )
    if said is None:
        rows = "student,quantity,answer\n1,rocker_omega_rad_s,1234.5\n"
    else:
        at = () if "--at" in words else ("--at", "60deg")
        value = float(solved(dalembert, "mechanism", "bar.toml", *at, *words)[0]["rocker_omega_rad_s"])
        rows = f"student,quantity,answer\n1,rocker_omega_rad_s,{value:.6g}\n"
    (named,) = mistakes(dalembert, tmp_path, exercise, rows)
    assert named is None if said is None else named is not None and said in named


def test_the_other_assembly_of_one_that_the_command_names(dalembert: Dalembert, tmp_path: Path) -> None:
    """With its fixed points on the x-axis the mirrored input and angle make the same number: one slip goes before two."""
    (tmp_path / "bar.toml").write_text(BAR)
    other = solved(dalembert, "mechanism", "bar.toml", "--at", "60deg", "--branch", "2")[0]
    exercise = (
        'command = "mechanism bar.toml --at 60deg --branch 1"\n'
        '[[ask]]\nquantity = "bar_angle_deg"\nfigures = 4\n[[ask]]\nquantity = "rocker_omega_rad_s"\n'
    )
    rows = "student,quantity,answer\n"
    rows += f"1,bar_angle_deg,{float(other['bar_angle_deg']):.4g}\n"
    rows += f"1,rocker_omega_rad_s,{float(other['rocker_omega_rad_s']):.3g}\n"
    assert mistakes(dalembert, tmp_path, exercise, rows) == ["the other assembly", None]


@pytest.mark.parametrize(("speed", "verdict"), [("100rad_s", "carried"), ("103rad_s", "wrong")])
def test_zeros_that_rounding_leaves_carry_as_other_figures_do(
    dalembert: Dalembert, tmp_path: Path, speed: str, verdict: str
) -> None:
    """To three figures −5468.7 mm/s is −5470, as −5.47 m/s: an earlier answer with the same rpm for rad/s carries it."""
    (tmp_path / "bar.toml").write_text(BAR.replace("300 rpm", "100 rpm"))
    turned = ("mechanism", "bar.toml", "--at", "60deg")
    first = solved(dalembert, *turned, "--set", "input.speed=100rad_s")[0]
    later = solved(dalembert, *turned, "--set", f"input.speed={speed}")[0]
    (tmp_path / "e.toml").write_text(
        'command = "mechanism bar.toml --at 60deg"\ntext = "{input.speed}, {links.crank.B.x}"\n'
        '[[ask]]\nquantity = "bar_omega_rad_s"\n[[ask]]\nquantity = "C_vx_m_s"\nunit = "mm/s"\n'
    )
    typed = float(f"{1000 * float(later['C_vx_m_s']):.3g}")
    (tmp_path / "a.csv").write_text(
        f"student,quantity,answer\n1,bar_omega_rad_s,{float(first['bar_omega_rad_s']):.3g}\n1,C_vx_m_s,{typed:.0f}\n"
    )
    done = dalembert("grade", "e.toml", "a.csv", "--json")
    assert [mark["verdict"] for mark in json.loads(done.stdout)["marks"]] == ["wrong", verdict]


WEIGHTS = """
gravity = [0, -10]
[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], A = [0.1, 0] }
mass = 2
center = [0.04, 0.01]
[links.rod]
points = { A = [0, 0], B = [0.4, 0] }
mass = 1.5
center = [0.15, 0]
[links.piston]
points = { B = [0, 0] }
mass = 1
[[sliders]]
point = "B"
link = "piston"
on = "ground"
through = [0, 0]
angle = 0
[[forces]]
link = "piston"
point = "B"
force = [-30, 0]
[input]
link = "crank"
angle = "60 deg"
[guess]
at = "60 deg"
B = [0.4, 0]
"""


@pytest.mark.parametrize(
    ("g", "mistake"),
    [
        ("0", "the weights are left out"),
        ("10", "the weights have the wrong sign"),
        ("-9.81", "g = 9.81 in place of 10"),
    ],
)
def test_all_weights_together(dalembert: Dalembert, tmp_path: Path, g: str, mistake: str) -> None:
    """The torque without any weight, with weights upwards, and with another g; of several links."""
    (tmp_path / "w.toml").write_text(WEIGHTS)
    slipped = solved(dalembert, "forces", "w.toml", "--at", "60deg", "--set", f"gravity.y={g}")[0]
    exercise = 'command = "forces w.toml --at 60deg"\n[[ask]]\nquantity = "input_torque_N_m"\nfigures = 5\n'
    rows = f"student,quantity,answer\n1,input_torque_N_m,{float(slipped['input_torque_N_m']):.5g}\n"
    assert mistakes(dalembert, tmp_path, exercise, rows) == [mistake]


def test_files_are_relative_to_the_exercise(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "bar.toml").write_text(BAR)
    (tmp_path / "sub" / "m.toml").write_text(
        'command = "mechanism bar.toml --at 60deg"\n[draw]\n"links.crank.B.x" = "90mm:110mm:5mm"\n'
        '[[ask]]\nquantity = "rocker_angle_deg"\n'
    )
    done = dalembert("exercise", "sub/m.toml", "--students", 3, "-o", "out", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["variants"] == 3
    for row in document["key"]:
        assert row["quantity"] == "rocker_angle_deg"
    assert dalembert("grade", "sub/m.toml", "out/answers.csv").returncode == 0
