"""Tables of a class as a school has them: foreign headers, units in brackets, other columns; and what the sheets make of them."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from tests.cli.exercises import PENDULUM, rotor_exercise
from tests.conftest import Dalembert

GERMAN = "Name;Masse [g];Radius [mm];Winkel [°];z [mm]\nÄ1;120;40,5;30;50\nÖ2;90;35;150;200\n"
EXERCISE = """
command = "balance rotor.csv --plane L:0mm:60mm --plane R:360mm:60mm --column mass_g='Masse [g]' --column angle_deg='Winkel [°]'"
[draw]
"rotor.csv:Ä1.Masse [g]" = "100g:140g:10g"
"rotor.csv:Ö2.Winkel [°]" = "100deg:180deg:10deg"
[[ask]]
quantity = "mass_g"
where = { plane = "R" }
"""


@pytest.fixture
def german(tmp_path: Path) -> Path:
    """An exercise whose table has German headers with units in brackets."""
    (tmp_path / "rotor.csv").write_text(GERMAN, encoding="utf-8")
    (tmp_path / "e.toml").write_text(EXERCISE, encoding="utf-8")
    return tmp_path


def test_a_key_of_values_with_units_in_brackets_is_read_again(dalembert: Dalembert, german: Path) -> None:
    """The key's columns are called as [draw] calls its values, `rotor.csv:Ä1.Masse [g]`."""
    assert dalembert("exercise", "e.toml", "--students", 2, "-o", "out").returncode == 0
    header = (german / "out" / "key.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.endswith("rotor.csv:Ä1.Masse [g],rotor.csv:Ö2.Winkel [°]")
    done = dalembert("grade", "e.toml", "out/key.csv", "--json")
    assert done.returncode == 0, done.stderr
    assert {mark["verdict"] for mark in json.loads(done.stdout)["marks"]} == {"right"}


def test_a_table_stands_on_the_sheet_under_its_own_headers(dalembert: Dalembert, german: Path) -> None:
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    sheet = (german / "out" / "sheet-1.html").read_text(encoding="utf-8")
    assert re.findall("<th>(.*?)</th>", sheet)[:5] == [
        "Name",
        "Masse [g]",
        "Radius [mm]",
        "Winkel [°]",
        "z [mm]",
    ]


def test_headers_with_a_suffix_have_their_unit_in_brackets(dalembert: Dalembert, tmp_path: Path) -> None:
    rotor_exercise(tmp_path)
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    sheet = (tmp_path / "out" / "sheet-1.html").read_text()
    assert re.findall("<th>(.*?)</th>", sheet)[:3] == ["name", "weight [N]", "radius [mm]"]


@pytest.mark.parametrize("column", ["Gruppe (A)", "Vorname, Name", "size [m]", "E-Mail"])
def test_other_columns_of_a_roster_keep_their_names(
    dalembert: Dalembert, tmp_path: Path, column: str
) -> None:
    rotor_exercise(tmp_path)
    with (tmp_path / "class.csv").open("w", encoding="utf-8") as stream:
        csv.writer(stream).writerows([[" Student", column], ["王芳", "x"], ["07", ""]])
    done = dalembert("exercise", "e.toml", "--students", "class.csv", "-o", "out")
    assert done.returncode == 0, done.stderr
    for name in ("key.csv", "answers.csv"):
        with (tmp_path / "out" / name).open(encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        assert {(row["student"], row[column]) for row in rows} == {("王芳", "x"), ("07", "")}
    assert dalembert("grade", "e.toml", "out/answers.csv", "-o", "marks.csv").returncode == 0
    with (tmp_path / "marks-totals.csv").open(encoding="utf-8") as stream:
        assert next(csv.reader(stream)) == ["student", column, "points", "of"]


@pytest.mark.parametrize("empty", [";", ";;", ";;;"])
def test_columns_that_a_spreadsheet_leaves_empty(dalembert: Dalembert, tmp_path: Path, empty: str) -> None:
    """Of a roster and of the answers: they have no header, and none is missed."""
    rotor_exercise(tmp_path)
    (tmp_path / "class.csv").write_text(f"student;name{empty}\n1;a{empty}\n2;b{empty}\n")
    done = dalembert("exercise", "e.toml", "--students", "class.csv", "-o", "out")
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "out" / "answers.csv").read_text().splitlines()
    assert lines[0] == "student,name,plane,quantity,unit,answer"
    (tmp_path / "a.csv").write_text("".join(f"{line.replace(',', ';')}{empty}\n" for line in lines))
    done = dalembert("grade", "e.toml", "a.csv", "--key", "out/key.csv")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0].startswith("student,name,plane,quantity")


def test_a_table_that_the_command_cannot_read_is_no_matter_of_the_drawn_values(
    dalembert: Dalembert, german: Path
) -> None:
    (german / "e.toml").write_text(EXERCISE.replace(" --column mass_g='Masse [g]'", ""), encoding="utf-8")
    table = german / "rotor.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("z [mm]", "w [mm]"), encoding="utf-8")
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 1
    assert done.stderr.startswith("dalembert: e.toml: key command: rotor.csv: no column z_m"), done.stderr
    assert not (german / "out").exists()
    # words that are known are read
    table.write_text(table.read_text(encoding="utf-8").replace("w [mm]", "Abstand [mm]"), encoding="utf-8")
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0


def test_the_figure_of_a_motion_has_its_first_instant(dalembert: Dalembert, tmp_path: Path) -> None:
    """A pendulum released at 0° lies level; the file's own angle is −90°."""
    (tmp_path / "p.toml").write_text(PENDULUM.replace("O = [0, 0] }\nmass", "O = [0, 0], P = [1, 0] }\nmass"))
    (tmp_path / "e.toml").write_text(
        'command = "simulate p.toml --time 0:1:0.5 --only P"\n[draw]\n"input.angle" = ["0deg"]\n'
        '[[ask]]\nquantity = "P_vx_m_s"\nwhere = { t_s = 0.5 }\nunit = "km/h"\n'
    )
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 0, done.stderr
    sheet = (tmp_path / "out" / "sheet-1.html").read_text()
    across = [
        [float(x) for x in pair.split(",")]
        for line in re.findall('<polyline points="([^"]*)"[^>]*stroke="#3b82f6"', sheet)
        for pair in line.split()
    ]
    assert max(y for _, y in across) - min(y for _, y in across) < 1
    assert max(x for x, _ in across) - min(x for x, _ in across) > 100
    # the question in words, its unit as people write it
    assert "<td>P vx (t 0.5 s)</td><td>km/h</td>" in sheet


def test_the_force_on_the_other_link_needs_its_name_in_the_command(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    (tmp_path / "p.toml").write_text(PENDULUM)
    ask = '[[ask]]\nquantity = "O.ground.fy"\n'
    (tmp_path / "e.toml").write_text(f'command = "forces p.toml --at 0deg"\n{ask}')
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 1
    assert "expected --only O.ground.fy with the other quantities in the command" in done.stderr
    (tmp_path / "e.toml").write_text(f'command = "forces p.toml --at 0deg --only O.ground.fy"\n{ask}')
    done = dalembert("exercise", "e.toml", "-o", "out", "--json")
    assert done.returncode == 0, done.stderr
    # a weight of 20 N at 0.5 m, held still by the input's torque, rests on the pin
    assert json.loads(done.stdout)["key"][0]["value"] == pytest.approx(-20)
