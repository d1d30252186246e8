"""`--expect`: rows by their keys, units of choice, names kept aside, and a check that can be collected."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

from cli.examples import EXAMPLES
from tests.conftest import Dalembert

ROTOR = "name,mass_kg,radius_mm,angle_deg,z_mm\nm1,9,30,60,20\nm2,6,50,210,65\n"
TWO = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")
BATCH = "rotor,unbalance_g_mm,angle_deg\n1,500,90\n2,300,180\n"


@pytest.fixture
def rotor(tmp_path: Path) -> Path:
    (tmp_path / "rotor.csv").write_text(ROTOR)
    return tmp_path / "rotor.csv"


@pytest.mark.whole
@pytest.mark.parametrize(
    ("expected", "status", "says"),
    [
        ("plane,mass_kg,angle_deg\nB,8.3708,19.677\nA,7.1996,256.82\n", 0, "4 of 4 values within"),
        ("plane,mass_g\nA,7199.6\nB,8370.8\n", 0, "2 of 2 values within"),
        ("plane,z_in,mass_lb\nB,3.543307,18.4544\n", 0, "2 of 2 values within"),
        ("plane,angle_rad\nA,4.48236\nB,0.343430\n", 0, "2 of 2 values within"),
        ("student,plane,mass_kg\nAnna,A,7.1996\nAnna,B,8.3708\n", 0, "2 of 2 values within"),
        ("plane,mass_kg\nA,7.1996\nB,\n", 0, "1 of 1 values within 0.001, 1 blank"),
        ("plane,mass_kg\nA,7.3\nB,8.3708\n", 1, "1 of 2 values within"),
        ("plane,masss_kg\nA,7.1996\n", 1, "did you mean 'mass_kg'?"),
        ("student\nAnna\n", 1, "no column of the result"),
    ],
)
def test_keys_units_and_further_columns(
    dalembert: Dalembert, rotor: Path, expected: str, status: int, says: str
) -> None:
    (rotor.parent / "e.csv").write_text(expected)
    done = dalembert("balance", rotor, *TWO, "--expect", "e.csv")
    assert done.returncode == status, done.stdout + done.stderr
    assert says in done.stdout + done.stderr


def test_what_is_left_aside_is_named(dalembert: Dalembert, rotor: Path) -> None:
    (rotor.parent / "e.csv").write_text("student,plane,mass_kg\nAnna,A,7.1996\n")
    done = dalembert("balance", rotor, *TWO, "--expect", "e.csv")
    assert done.stderr == "warning: e.csv: not compared: student\n"


def test_of_several_rotors_the_file_says_which(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_text("plane,unbalance_g_mm\nA,500\n")
    call = ("balance", "-", "--plane", "A:25mm", "--expect", "e.csv")
    done = dalembert(*call, stdin=BATCH)
    assert done.returncode == 1
    assert "expected a column rotor" in done.stderr
    (tmp_path / "e.csv").write_text("rotor,plane,unbalance_g_mm\n2,A,300\n")
    assert dalembert(*call, stdin=BATCH).returncode == 0


def test_the_check_is_collected(dalembert: Dalembert, rotor: Path) -> None:
    (rotor.parent / "e.csv").write_text("plane,mass_kg\nA,7.1996\nB,8.4\n")
    call = ("balance", rotor, *TWO, "--expect", "e.csv")
    done = dalembert(*call, "--json")
    assert done.returncode == 1
    first, second = json.loads(done.stdout)["check"]
    assert (first["row"], first["column"], first["expected"], first["verdict"]) == (
        "1/A",
        "mass_kg",
        7.1996,
        "ok",
    )
    assert second["verdict"] == "WRONG"
    assert second["error"] == pytest.approx(abs(second["value"] - 8.4) / 8.4, rel=1e-12)
    done = dalembert(*call, "-o", "check.csv")
    assert done.returncode == 1
    with (rotor.parent / "check.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["verdict"] for row in rows] == ["ok", "WRONG"]


def test_a_number_that_is_a_key_is_matched_to_its_digits(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    call = ("mechanism", "klann.toml", "--only", "H")
    poses = list(csv.DictReader(dalembert(*call, "--at", "60deg").stdout.splitlines()))
    x = next(name for name in poses[0] if name.startswith("H_x"))
    (tmp_path / "e.csv").write_text(f"input_deg,{x}\n60.0,{poses[0][x]}\n")
    assert (
        dalembert(*call, "--at", "40deg", "--at", "60.00000000000001deg", "--expect", "e.csv").returncode == 0
    )


def test_many_rows_need_their_keys(dalembert: Dalembert, tmp_path: Path) -> None:
    """Where the result has several rows, a file of fewer says which they are."""
    (tmp_path / "bar.toml").write_text(
        '[units]\nlength = "mm"\nangle = "deg"\n[ground]\nA = [0, 0]\n[links.crank]\npoints = { A = [0, 0], B = [100, 0] }\n'
        '[input]\nlink = "crank"\nangle = 0\n'
    )
    command = ("mechanism", "bar.toml", "--over", "0deg:90deg:30deg", "--only", "B")
    (tmp_path / "e.csv").write_text("B_x_mm\n100\n")
    done = dalembert(*command, "--expect", "e.csv")
    assert done.returncode == 1
    assert "1 of the result's 4 rows" in done.stderr
    assert "input_deg" in done.stderr
    (tmp_path / "e.csv").write_text("input_deg,B_x_mm\n60,50\n")
    assert dalembert(*command, "--expect", "e.csv").returncode == 0
    (tmp_path / "e.csv").write_text("B_x_mm\n100\n86.6025\n50\n0\n")
    assert dalembert(*command, "--expect", "e.csv").returncode == 0
    variants = (
        "mechanism",
        "bar.toml",
        "--over",
        "links.crank.B.x=50mm:100mm:50mm",
        "--at",
        "0deg",
        "--only",
        "B",
    )
    (tmp_path / "e.csv").write_text("student,B_x_mm\nAna,50\n")
    done = dalembert(*variants, "--expect", "e.csv")
    assert done.returncode == 1
    assert "variant" in done.stderr


def test_names_stand_beside_the_verdicts(dalembert: Dalembert, rotor: Path) -> None:
    rotor.with_name("e.csv").write_text("student,plane,angle_deg\nAna,A,1\nBo,B,2\n")
    done = dalembert("balance", "rotor.csv", *TWO, "--expect", "e.csv", "-o", "check.csv")
    assert done.returncode == 1
    lines = rotor.with_name("check.csv").read_text().splitlines()
    assert lines[0] == "row,column,value,expected,error,verdict,student"
    assert [line.rpartition(",")[2] for line in lines[1:]] == ["Ana", "Bo"]


def test_expected_values_in_units_of_choice(dalembert: Dalembert, tmp_path: Path, rotor: Path) -> None:
    """What --units printed was refused as no column of the result, where its unit is not one of the usual ones."""
    (tmp_path / "expected.csv").write_text(
        dalembert("balance", str(rotor), *TWO, "--units", "mg_mm,t").stdout.replace(
            "unbalance_mg", "Unbalance_mg"
        )
    )
    done = dalembert("balance", str(rotor), *TWO, "--expect", str(tmp_path / "expected.csv"))
    assert done.returncode == 0, done.stderr


def test_energies_and_torques_have_units_of_their_own(dalembert: Dalembert) -> None:
    """`--units kJ` made kilojoules of torques, and left energies in joules."""
    table = "angle_deg,torque_N_m\n0,10\n180,30\n360,10\n"
    for units, headers in (("kJ,kW", "N_m kJ kW"), ("N_mm", "N_mm J W")):
        done = dalembert(
            "flywheel", "-", "--speed", "600rpm", "--fluctuation", "0.02", "--units", units, stdin=table
        )
        shown = dict(zip(*csv.reader(done.stdout.splitlines()), strict=True))
        torque, energy, power = headers.split()
        assert float(shown[f"mean_torque_{torque}"]) == (20 if torque == "N_m" else 20e3)
        joules = float(shown[f"work_{energy}"]) * (1000 if energy == "kJ" else 1)
        watts = float(shown[f"mean_power_{power}"]) * (1000 if power == "kW" else 1)
        assert (joules, watts) == pytest.approx((40 * math.pi, 400 * math.pi), rel=1e-15)


def test_the_check_of_an_inspection_stands_beside_its_own(dalembert: Dalembert, tmp_path: Path) -> None:
    klann = EXAMPLES / "klann" / "klann.toml"
    (tmp_path / "e.csv").write_text("quantity,value\nmobility,1\nmobility_by_rank,2\n")
    call = ("inspect", klann, "--expect", "e.csv")
    done = dalembert(*call, "--json")
    assert done.returncode == 1
    document = json.loads(done.stdout)
    assert document["check"]["mobility"] == 1
    assert [row["verdict"] for row in document["expected"]] == ["ok", "WRONG"]
    dalembert(*call, "-o", "check.csv")
    with (tmp_path / "check.csv").open() as stream:
        assert [row["verdict"] for row in csv.DictReader(stream)] == ["ok", "WRONG"]
