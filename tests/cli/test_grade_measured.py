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
