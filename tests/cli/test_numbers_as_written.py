"""What is read comes back as it was written; counts are whole numbers; --digits cuts the numbers of every table."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import openpyxl
import pytest

from cli.show.commands import ShowOptions
from cli.show.output import show
from dalembert.results.columns import Column, Table
from dalembert.results.result import Result
from tests.conftest import Dalembert

MASSES = "name,mass_g,radius_mm,angle_deg,z_mm\na,13.5,20,{0},10\nb,7.1,15,{1},30\n"


@pytest.mark.whole
@pytest.mark.parametrize("angles", [(30, 120), (-30, -120), (0, 0), (180, 90), (12.3, 299.9)])
def test_steps_of_balance_show_the_masses_as_they_are_read(
    angles: tuple[float, float], dalembert: Dalembert
) -> None:
    planes = ("--plane", "A:0mm:20mm", "--plane", "B:40mm:20mm")
    done = dalembert("balance", "-", *planes, "--steps", "--json", stdin=MASSES.format(*angles))
    (components, *_) = json.loads(done.stdout)["way"]
    rows = components["rows"]
    assert [row["angle_deg"] for row in rows] == [round(angle % 360, 9) for angle in angles]
    assert [row["unbalance_kg_m"] for row in rows] == pytest.approx([0.00027, 0.0001065], rel=3e-16)


@pytest.mark.whole
@pytest.mark.parametrize("angle", [0, 30, 60, 120, 330, 45.6])
def test_one_mass_in_one_plane_is_opposed_exactly(angle: float, dalembert: Dalembert) -> None:
    table = f"mass_g,radius_mm,angle_deg\n10,20,{angle}\n"
    for options, shift in (((), 180), (("--remove",), 0)):
        done = dalembert("balance", "-", "--plane", "A:20mm", *options, stdin=table)
        (row,) = csv.DictReader(io.StringIO(done.stdout))
        assert float(row["angle_deg"]) == round((angle + shift) % 360, 9)
        assert float(row["mass_g"]) == 10.0


@pytest.mark.whole
@pytest.mark.parametrize("angle", [0, 30, 120, 240, 292.5])
def test_a_correction_that_is_placed_keeps_its_angle(angle: float, dalembert: Dalembert) -> None:
    done = dalembert(
        "place", f"7g@{angle}deg", "--drill", "10mm", "--density", "7850kg_m3", "--steps", "--json"
    )
    document = json.loads(done.stdout)
    assert document["target"] == {"mass_kg": 0.007, "angle_deg": angle}
    (mass,) = document["masses"]
    assert mass["angle_deg"] == (angle + 180) % 360
    vectors = document["way"][0]["vectors"]
    assert [vector["angle_deg"] for vector in vectors] == [angle]


@pytest.mark.whole
@pytest.mark.parametrize("step", ["0.3g", "0.7g", "1.1g", "0.1g", "2.5g"])
def test_rounded_masses_are_decimals(step: str, dalembert: Dalembert) -> None:
    done = dalembert(
        "balance",
        "-",
        "--plane",
        "A:20mm",
        "--round-mass",
        step,
        stdin="mass_g,radius_mm,angle_deg\n7.9,20,5\n",
    )
    (row,) = csv.DictReader(io.StringIO(done.stdout))
    decimals = len(step[:-1].partition(".")[2])
    assert len(row["mass_g"].partition(".")[2]) <= decimals
    assert float(row["unbalance_g_mm"]) == round(float(row["mass_g"]) * 20, 6)
    assert abs(float(row["mass_g"]) - 7.9) <= float(step[:-1]) / 2 * (1 + 1e-12)


def test_a_step_of_a_turn_and_of_an_ounce(dalembert: Dalembert) -> None:
    options = ("--round-mass", "0.1oz", "--round-angle", "0.01rev")
    done = dalembert(
        "balance", "-", "--plane", "A:20mm", *options, stdin="mass_g,radius_mm,angle_deg\n7.9,20,5\n"
    )
    (row,) = csv.DictReader(io.StringIO(done.stdout))
    # three tenths of an ounce of 28.349523125 g
    assert (row["mass_g"], row["angle_deg"]) == ("8.5048569375", "183.6")


def test_places_in_turns_and_radians(dalembert: Dalembert) -> None:
    done = dalembert("place", "5g@0.1rev", "--positions", "0rev,0.25rev,1.5rad", "--json")
    document = json.loads(done.stdout)
    assert document["target"]["angle_deg"] == 36.0
    assert {mass["angle_deg"] for mass in document["masses"]} <= {0.0, 90.0, 85.94366926962348}


def _shown(capsys: pytest.CaptureFixture[str], **options: bool) -> str:
    rough = Column("x", "m", [1.23456], error=lambda: [0.004])
    tables = {"first": lambda: Table([rough]), "second": lambda: Table([rough, rough], place="second")}
    show(Result(document=lambda: {"x": 1.23456}, tables=tables), ShowOptions(text=True, **options), {})
    return capsys.readouterr().out


def test_digits_cut_every_table_of_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert _shown(capsys).count("1.23456") == 3
    cut = _shown(capsys, digits=True)
    assert cut.count("1.23456") == 0
    assert cut.count("1.2") == 3
    assert "1.23456" in _shown(capsys, digits=True, json=True)


FOUR_BAR = """
name = "four-bar"
units = { length = "mm" }
ground = { A = [0, 0], D = [800, 0] }
input = { link = "crank" }
guess = { at = "60 deg", coupler = "20 deg", rocker = "70 deg" }
[links]
crank = { points = { A = [0, 0], B = [350, 0] } }
coupler = { points = { B = [0, 0], C = [900, 0], P = [400, 300] } }
rocker = { points = { D = [0, 0], C = [700, 0] } }
"""


def test_counts_of_a_fit_and_its_digits(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("mechanism", "m.toml", "--over", "0deg:90deg:30deg", "--only", "P.x,P.y")
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    lines = [f"{float(row['P_x_m']):.5f},{float(row['P_y_m']):.5f}" for row in rows]
    (tmp_path / "path.csv").write_text("\n".join(["x_m,y_m", *lines]))
    call = ("fit", "m.toml", "path.csv", "--want", "P", "--free", "links.crank.B.x=300:400", "--starts", "2")
    (row,) = csv.DictReader(io.StringIO(dalembert(*call).stdout))
    assert row["starts"] == "2"
    assert row["evaluations"].isdecimal()
    (cut,) = csv.DictReader(io.StringIO(dalembert(*call, "--digits").stdout))
    for name in ("rms_m", "max_m"):
        assert len(cut[name]) < len(row[name])
        assert float(cut[name]) == pytest.approx(float(row[name]), rel=1e-7)
    document = json.loads(dalembert(*call, "--json").stdout)["fit"]
    assert type(document["starts"]) is int
    assert type(document["evaluations"]) is int
    dalembert(*call, "-o", "fit.xlsx", "--report", "fit.md")
    (sheet, *_) = openpyxl.load_workbook(tmp_path / "fit.xlsx").worksheets
    heads, values = (list(cells) for cells in sheet.iter_rows(max_row=2, values_only=True))
    assert 2 in values
    assert any("starts" in str(head) for head in heads)
    assert "| 2 |" in (tmp_path / "fit.md").read_text()


def test_units_in_capitals_are_those_of_the_second_run_too(dalembert: Dalembert, tmp_path: Path) -> None:
    places = ("--positions", "30DEG,60deg")
    drill = ("--drill", "10MM", "--density", "7850KG_m3", "--drill-point", "118DEG")
    for options in (places, drill):
        same = [option.replace("DEG", "deg").replace("MM", "mm").replace("KG", "kg") for option in options]
        done = dalembert("place", "5G@40DEG", *options, "--digits")
        assert done.returncode == 0, done.stderr
        assert done.stdout == dalembert("place", "5g@40deg", *same, "--digits").stdout
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    ways = [("--set", f"input.speed={text}") for text in ("30 RPM", "30rpm", "0.5 HZ")]
    shown = {dalembert("mechanism", "m.toml", *way, "--at", "60DEG", "--only", "P.vx").stdout for way in ways}
    assert len(shown) == 1
    assert "P_vx_m_s" in shown.pop()
