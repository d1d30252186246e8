"""Bare numbers in options: in the units of a mechanism's file, degrees behind `@`, refused with the units elsewhere."""

from __future__ import annotations

from pathlib import Path

import openpyxl
import pytest

from tests.conftest import Dalembert

KLANN = ("mechanism", "klann.toml", "--only", "H")
SLIDE = """
[units]
length = "mm"
[ground]
O = [0, 0]
[links.block]
points = { A = [0, 0] }
[[sliders]]
point = "A"
link = "block"
on = "ground"
through = "O"
angle = "30 deg"
[input]
slider = "A"
position = 250
[guess]
at = 250
"""


@pytest.mark.parametrize(
    ("bare", "named"),
    [
        (("--at", "60"), ("--at", "60deg")),
        (("--at", "60°"), ("--at", "60deg")),
        (("--at", "crank=-7.25"), ("--at", "-7.25deg")),
        (("--over", "0:360:30"), ("--over", "0deg:360deg:30deg")),
        (("--over", "0:360/7"), ("--over", "0deg:360deg/7")),
        (("--over", "0:360deg:30"), ("--over", "0deg:360deg:30deg")),
    ],
)
def test_angles_of_a_file_in_degrees(
    bare: tuple[str, ...], named: tuple[str, ...], dalembert: Dalembert
) -> None:
    dalembert("examples", "klann")
    done = dalembert(*KLANN, *bare)
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert(*KLANN, *named).stdout


def test_lengths_of_a_file_in_millimetres(dalembert: Dalembert) -> None:
    done = dalembert("mechanism", "-", "--at", "20", "--only", "A", stdin=SLIDE)
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert("mechanism", "-", "--at", "20mm", "--only", "A", stdin=SLIDE).stdout
    inches = dalembert("mechanism", "-", "--at", "2", "--only", "A", stdin=SLIDE.replace('"mm"', '"in"'))
    assert inches.stdout.splitlines()[1].split(",")[1] == "0.0508"


def test_angles_of_a_file_in_turns(dalembert: Dalembert) -> None:
    dalembert("examples", "klann")
    text = 'units = {{ angle = "{}" }}\nground = {{ O = [0, 0] }}\n[links.a]\npoints = {{ O = [0, 0], P = [1, 0] }}\n[input]\nlink = "a"\nangle = 0\n'
    turns = dalembert("mechanism", "-", "--at", "0.25", "--only", "P", stdin=text.format("rev"))
    degrees = dalembert("mechanism", "-", "--at", "90", "--only", "P", stdin=text.format("deg"))
    assert turns.returncode == degrees.returncode == 0, turns.stderr + degrees.stderr
    assert turns.stdout == degrees.stdout


def test_a_correction_in_degrees(dalembert: Dalembert) -> None:
    for bare in ("83.5g@308.87", "83.5g@308.87°"):
        done = dalembert("place", bare, "--blades", "16")
        assert done.returncode == 0, done.stderr
        assert done.stdout == dalembert("place", "83.5g@308.87deg", "--blades", "16").stdout


@pytest.mark.parametrize(
    ("arguments", "units"),
    [
        (("mechanism", "-", "--at", "20"), "m, mm, cm"),
        (("place", "10@30"), "kg, g, mg, lb, oz"),
        (("place", "10g@30", "--blades", "4", "--first", "30"), "deg, rad"),
        (("balance", "x.csv", "--plane", "A:20"), "m, mm, cm"),
        (("balance", "x.csv", "--plane", "A:20mm", "--rotor-mass", "12"), "kg, g, mg"),
    ],
)
def test_elsewhere_the_units_that_fit_are_named(
    arguments: tuple[str, ...], units: str, dalembert: Dalembert
) -> None:
    without = SLIDE.replace('[units]\nlength = "mm"\n', "")
    done = dalembert(*arguments, stdin=without)
    assert done.returncode == 2
    assert f"has no unit (units: {units}" in " ".join(done.stderr.split())


def test_the_tables_beside_a_mechanism_as_people_have_them(dalembert: Dalembert, tmp_path: Path) -> None:
    toml = """
ground = { O = [0, 0] }
[links.crank]
points = { O = [0, 0], P = [1, 0] }
[input]
link = "crank"
law = "law.csv"
[[forces]]
link = "crank"
point = "P"
table = "gas.csv"
"""
    (tmp_path / "law.csv").write_text("time_s,angle_deg\n0,0\n0.5,10\n1,25.5\n2,60\n")
    (tmp_path / "gas.csv").write_text("angle_deg,fx_N\n0,-1.5\n90,3\n")
    plain = dalembert("forces", "-", stdin=toml)
    assert plain.returncode == 0, plain.stderr
    (tmp_path / "law.csv").write_text("Law\n\nTime [ms];Angle\n;°\n0;0\n500;10,0\n1000;25,5\n2000;60\n")
    made = openpyxl.Workbook()
    sheet = made.active
    for row in (("angle (deg)", "fx [kN]", "note"), (0, "-0,0015", "=1+1"), (90, 0.003, None)):
        sheet.append(row)
    made.save(tmp_path / "gas.xlsx")
    done = dalembert("forces", "-", stdin=toml.replace("gas.csv", "gas.xlsx#Sheet"))
    assert done.returncode == 0, done.stderr
    assert done.stdout == plain.stdout
    assert "law.csv: the header is in line 3" in done.stderr
    assert "gas.xlsx: ignored the column 'note'" in done.stderr
    over = dalembert("forces", "-", "-o", "gas.xlsx", stdin=toml.replace("gas.csv", "gas.xlsx"))
    assert over.returncode == 2
    sheet["B3"] = "=A3"
    made.save(tmp_path / "gas.xlsx")
    done = dalembert("forces", "-", stdin=toml.replace("gas.csv", "gas.xlsx"))
    assert done.returncode == 1
    assert "gas.xlsx: sheet 'Sheet', cell B3: found the formula '=A3' without a stored value" in done.stderr
