"""What `dalembert field` wrote is placed by `dalembert place`; the tables that go beside a file."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from tests.conftest import Dalembert


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as stream:
        return list(csv.DictReader(stream))


def vector(row: dict[str, str]) -> complex:
    return float(row["mass_g"]) * np.exp(1j * np.radians(float(row["angle_deg"])))


@pytest.fixture
def solved(dalembert: Dalembert, tmp_path: Path) -> Path:
    dalembert("examples", "pump-trials-left-on")
    for suffix in ("csv", "json", "xlsx"):
        done = dalembert("field", "pump.csv", "--blades", "12", "-o", f"fix.{suffix}")
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
    return tmp_path


@pytest.mark.parametrize("file", ["fix.csv", "fix.json", "fix.xlsx", "fix.xlsx#corrections"])
def test_every_plane_of_a_file_is_placed(file: str, dalembert: Dalembert, solved: Path) -> None:
    done = dalembert("place", file, "--blades", "12", "--units", "g", "-o", "placed.csv")
    assert done.returncode == 0, done.stderr
    placed = rows(solved / "placed.csv")
    assert [row["plane"] for row in placed] == ["aft", "aft", "forward", "forward"]
    for fix in rows(solved / "fix.csv"):
        together = sum(vector(row) for row in placed if row["plane"] == fix["plane"])
        assert abs(together - vector(fix)) < 1e-12 * abs(vector(fix))
    # as field itself splits them
    for row, split in zip(placed, rows(solved / "fix-split.csv"), strict=True):
        assert (row["plane"], row["position"]) == (split["plane"], split["position"])
        assert float(row["mass_g"]) == pytest.approx(float(split["mass_g"]), rel=1e-12)


def test_one_plane_is_as_if_it_were_typed(dalembert: Dalembert, solved: Path) -> None:
    (fix,) = [row for row in rows(solved / "fix.csv") if row["plane"] == "aft"]
    typed = dalembert("place", f"{fix['mass_g']}g@{fix['angle_deg']}deg", "--blades", "12", "--json")
    found = dalembert("place", "fix.csv", "--plane", "aft", "--blades", "12", "--json")
    assert json.loads(found.stdout) == json.loads(typed.stdout)
    several = json.loads(dalembert("place", "fix.csv", "--blades", "12", "--json").stdout)
    assert several["placements"][0] == {"rotor": "1", "plane": "aft"} | {
        key: value for key, value in json.loads(typed.stdout).items() if key != "warnings"
    }


def test_what_cannot_be_placed(dalembert: Dalembert, solved: Path) -> None:
    (solved / "u.csv").write_text("plane,unbalance_g_mm,angle_deg\nA,5,20\n")
    (solved / "n.csv").write_text("plane,mass_g,angle_deg\nA,-5,20\n")
    (solved / "bad.json").write_text('{"rotors": [{"rotor": "1"}]}')
    (solved / "cut.json").write_text('{"rotors": [')
    for options, status, said in (
        (["fix.csv", "--plane", "fore"], 1, "no plane 'fore': expected one of aft, forward"),
        (["fix.csv", "--rotor", "2"], 1, "no rotor '2': expected one of 1"),
        (["fix.csv", "5g@20deg"], 2, "expected nothing in addition to a file"),
        (["5g@20deg", "--plane", "A"], 2, "expected a file"),
        (["fix.csv", "--plot", "p.svg"], 2, "expected --rotor and --plane too"),
        (["u.csv"], 1, "corrections as unbalances: expected masses"),
        (["n.csv"], 1, "a mass that is not negative"),
        (["bad.json"], 1, "expected the JSON of dalembert field"),
        (["cut.json"], 1, "no valid JSON"),
        (["none.csv"], 1, "No such file"),
    ):
        done = dalembert("place", *options, "--blades", "12")
        assert done.returncode == status, options
        assert said in " ".join(done.stderr.replace("│", " ").split()), done.stderr
        assert status == 2 or done.stderr.count("\n") == 1


def test_two_corrections_of_one_plane_are_placed_apart(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "two.csv").write_text("mass_g,angle_deg\n3,0\n4,90\n")
    done = dalembert("place", "two.csv", "--blades", "4", "--json")
    placements = json.loads(done.stdout)["placements"]
    assert [[m["position"] for m in each["masses"]] for each in placements] == [["1"], ["2"]]
    assert [each["target"]["mass_kg"] for each in placements] == pytest.approx([0.003, 0.004])
    assert {(each["rotor"], each["plane"]) for each in placements} == {("1", "1")}


def test_the_prediction_goes_beside_the_corrections(dalembert: Dalembert, solved: Path) -> None:
    document = json.loads((solved / "fix.json").read_text())["rotors"][0]
    predicted = rows(solved / "fix-prediction.csv")
    assert [row["sensor"] for row in predicted] == ["1", "2", "3", "4"]
    for row, residual in zip(predicted, document["residual"], strict=True):
        assert float(row["predicted_amplitude_mil"]) == pytest.approx(residual["amplitude"], rel=1e-12)
        assert float(row["predicted_phase_deg"]) == pytest.approx(residual["phase_deg"], abs=1e-9)
    assert [float(row["before_amplitude_mil"]) for row in predicted] == pytest.approx(
        [0.68, 0.56, 1.94, 2.07]
    )
    book = openpyxl.load_workbook(solved / "fix.xlsx")
    assert book.sheetnames[:4] == ["corrections", "influence", "prediction", "split"]
    # a pipe has the corrections alone
    plain = dalembert("field", "pump.csv", "--blades", "12").stdout
    assert plain == (solved / "fix.csv").read_text()


def test_what_goes_beside_is_not_put_over_an_input(dalembert: Dalembert, solved: Path) -> None:
    (solved / "pump-prediction.csv").symlink_to("pump.csv")
    before = (solved / "pump.csv").read_bytes()
    # pump-prediction.csv is what is read, and would be written
    done = dalembert("field", "pump-prediction.csv", "-o", "pump.parquet")
    assert done.returncode == 0
    done = dalembert("field", "pump.csv", "-o", "pump-prediction.csv")
    assert done.returncode == 2
    (solved / "x-prediction.csv").symlink_to("pump.csv")
    done = dalembert("field", "pump.csv", "-o", "x.csv")
    assert done.returncode == 2
    assert not (solved / "x.csv").exists()
    assert (solved / "pump.csv").read_bytes() == before


def test_material_to_remove_is_drilled_where_it_stands(dalembert: Dalembert, tmp_path: Path) -> None:
    """The JSON of `balance --remove` was read as masses to add: the hole came out half a turn off."""
    table = "unbalance_g_mm,angle_deg\n100,60\n"
    for remove in ((), ("--remove",)):
        done = dalembert("balance", "-", "--plane", "A:10mm", *remove, "-o", "fix.json", stdin=table)
        assert done.returncode == 0, done.stderr
        drilled = json.loads(
            dalembert("place", "fix.json", "--drill", "10mm", "--density", "7850kg_m3", "--json").stdout
        )
        (hole,) = drilled["masses"]
        assert (hole["angle_deg"], hole["mass_kg"]) == (pytest.approx(60), pytest.approx(0.01))
    on_blades = json.loads(dalembert("place", "fix.json", "--blades", "6", "--json").stdout)
    assert (on_blades["action"], on_blades["warnings"]) == (
        "remove",
        ["fix.json: its corrections are material to remove"],
    )
