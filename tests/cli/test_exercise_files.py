"""The TOML file of an exercise: its command, draws and questions, and what is refused in them."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

from tests.cli.exercises import EXERCISE, PENDULUM, ROTOR, rotor_exercise, rows, rows_of
from tests.conftest import Dalembert


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an exercise."""
    return rotor_exercise(tmp_path)


def test_a_question_names_its_quantity_as_only_does(dalembert: Dalembert, tmp_path: Path) -> None:
    """The coordinate of a point, a motor's torque and the force of a pin: the columns that `--only` gives these names."""
    assert dalembert("examples", "exercise-robot-arm").returncode == 0
    for command, only in (
        ("mechanism arm.toml --at upper=20deg,fore=75deg", ("T.x", "fore.angle")),
        ("forces arm.toml --at upper=20deg,fore=75deg", ("upper.torque", "E.fore.fy")),
    ):
        table = dalembert(*command.split(), "--only", ",".join(only)).stdout
        (row,) = csv.DictReader(table.splitlines())
        columns = list(row)[-len(only) :]
        asks = "".join(f'[[ask]]\nquantity = "{name}"\n' for name in only)
        (tmp_path / "e.toml").write_text(f'command = "{command}"\n{asks}')
        out = command.split()[0]
        assert dalembert("exercise", "e.toml", "-o", out).returncode == 0
        key = rows(tmp_path / out / "key.csv")
        assert [each["quantity"] for each in key] == columns
        assert [float(each["value"]) for each in key] == [float(row[column]) for column in columns]
        answers = (tmp_path / out / "answers.csv").read_text().splitlines()
        filled = [
            answers[0],
            *(line + each["answer"] for line, each in zip(answers[1:], key, strict=True)),
        ]
        (tmp_path / out / "answers.csv").write_text("\n".join(filled) + "\n")
        marks = rows_of(dalembert("grade", "e.toml", f"{out}/answers.csv").stdout)
        assert [mark["verdict"] for mark in marks] == ["right", "right"]


def test_a_name_that_is_no_quantity_is_refused(dalembert: Dalembert, tmp_path: Path) -> None:
    assert dalembert("examples", "exercise-robot-arm").returncode == 0
    for name in ("T", "T.q", "Q.x"):
        (tmp_path / "e.toml").write_text(f'command = "mechanism arm.toml"\n[[ask]]\nquantity = "{name}"\n')
        done = dalembert("exercise", "e.toml", "-o", "out")
        assert done.returncode == 1
        assert f"[[ask]] 1, key quantity: found '{name}', expected a column of the result: " in done.stderr


def test_a_column_in_another_dimension_is_refused(dalembert: Dalembert, folder: Path) -> None:
    """The key `unit` does not make metres of a mass right."""
    for unit in ("", 'unit = "kg"\n'):
        (folder / "e.toml").write_text(EXERCISE.replace('"mass_kg"\n', f'"mass_m"\n{unit}', 1))
        done = dalembert("exercise", "e.toml", "-o", "out")
        assert done.returncode == 1
        assert "key quantity: found 'mass_m', expected a unit of mass_kg" in done.stderr
        assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('title = "A rotor"', 'titel = "A rotor"', ["key titel", "did you mean 'title'"]),
        ("quantity = \"angle_deg\"", "quantity = \"angel_deg\"", ["[[ask]] 2", "'angel_deg'", "did you mean 'angle_deg'"]),
        ("figures = 3", "figures = 0", ["[[ask]] 1", "figures", "found 0", "a whole number from 1"]),
        ('plane = "B" }\nfigures', 'plane = "C" }\nfigures', ["[[ask]] 1", "where", "plane C"]),
        ('"60N:120N:5N"', '"60N:120N"', ["[draw]", "FROM:TO:STEP"]),
        ('"60N:120N:5N"', '"60kg:120kg:5kg"', ["[draw]", "weight_N"]),
        ('"60N:120N:5N"', '"120N:60N:5N"', ["[draw]", "a step above zero"]),
        ("rotor.csv:W1.weight_N\" =", "rotor.csv:W9.weight_N\" =", ["[draw]", "'W9'", "W1, W2"]),
        ("rotor.csv:W1.weight_N\" =", "rotors.csv:W1.weight_N\" =", ["[draw]", "'rotors.csv'", "did you mean 'rotor.csv'"]),
        ("rotor.csv:W1.weight_N\" =", "rotor.csv:W1.wieght_N\" =", ["[draw]", "'wieght_N'", "did you mean 'weight_N'"]),
        ("{rotor.csv:W1.radius_mm}", "{rotor.csv:W1.radius}", ["text", "'{rotor.csv:W1.radius}'"]),
        ("balance rotor.csv", "balanse rotor.csv", ["command", "'balanse'", "did you mean 'balance'"]),
        ("balance rotor.csv", "balance nothing.csv", ["nothing.csv"]),
        ("--gravity 10", "--gravety 10", ["command", "--gravety"]),
        ("[[ask]]", "[[asked]]", ["asked", "did you mean 'ask'"]),
        ('command = "', 'command = "\n', ["e.toml", "TOML"]),
    ],
)  # fmt: skip
def test_a_bad_exercise_is_one_line_and_writes_nothing(
    dalembert: Dalembert, folder: Path, old: str, new: str, said: list[str]
) -> None:
    (folder / "e.toml").write_text(EXERCISE.replace(old, new))
    done = dalembert("exercise", "e.toml", "--students", 2, "-o", "out")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("dalembert: e.toml")
    for part in said:
        assert part in done.stderr
    assert {path.name for path in folder.iterdir()} == {"rotor.csv", "e.toml"}


def test_a_dimension_in_the_text_that_is_none_is_answered_by_the_nearest(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    """It was answered by three kinds of names, and no name."""
    assert dalembert("examples", "exercise-klann").returncode == 0
    file = tmp_path / "exercise-klann.toml"
    file.write_text(file.read_text().replace("{links.crank.B.x}", "{links.crnak.B.x}"))
    done = dalembert("exercise", "exercise-klann.toml", "-o", "out")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "'{links.crnak.B.x}'" in done.stderr
    assert done.stderr.endswith("; did you mean 'links.crank.B.x'?\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "option",
    [
        "--help",
        "-h",
        "-ox.csv",
        "--output=x.csv",
        "--plot=x.png",
        "--json",
        "--save-influence=x.csv",
        "--steps",
    ],
)
def test_a_command_that_shows_or_writes_is_refused(dalembert: Dalembert, folder: Path, option: str) -> None:
    (folder / "e.toml").write_text(EXERCISE.replace("--gravity 10", f"--gravity 10 {option}"))
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert f"key command: found '{option.partition('=')[0]}'" in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        "balance --gravity 10 --plane A:0mm:20mm --plane B:90mm:20mm rotor.csv",
        "balance rotor.csv --gravity=10 --plane=A:0mm:20mm --plane=B:90mm:20mm",
        "balance --planes=planes.csv --gravity=10 rotor.csv",
        "dalembert balance rotor.csv --planes planes.csv --gravity 10",
    ],
)
def test_the_order_of_a_commands_words_does_not_matter(
    dalembert: Dalembert, folder: Path, command: str
) -> None:
    (folder / "planes.csv").write_text("plane,z_mm,radius_mm\nA,0,20\nB,90,20\n")
    asks = '[[ask]]\nquantity = "mass_kg"\nwhere = { plane = "B" }\n'
    (folder / "e.toml").write_text(f'command = "{command}"\n{asks}')
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert [row["answer"] for row in rows(folder / "out" / "key.csv")] == ["8.37"]
    # W1 with the other sign: (−90·30·20·e^{i60°} + 60·50·65·e^{i210°})/(90·20·10), found among the slips of the rotor
    (folder / "a.csv").write_text("student,plane,quantity,answer\n1,B,mass_kg,13.515\n")
    done = dalembert("grade", "e.toml", "a.csv", "--json")
    (mark,) = json.loads(done.stdout)["marks"]
    assert mark["mistake"] == "the term of W1 has the wrong sign", done.stderr


def test_a_radius_that_is_sought(dalembert: Dalembert, folder: Path) -> None:
    """m·r = 8.371 kg · 20 mm = 8 kg · 20.93 mm."""
    command = "balance rotor.csv --gravity 10 --plane A:0mm:? --plane B:90mm:? --mass A:7kg --mass B:8kg"
    ask = '[[ask]]\nquantity = "radius_mm"\nwhere = { plane = "B" }\n'
    (folder / "e.toml").write_text(f'command = "{command}"\n{ask}')
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert [row["answer"] for row in rows(folder / "out" / "key.csv")] == ["20.9"]


def test_rows_without_a_key_and_a_key_that_is_called_quantity(dalembert: Dalembert, tmp_path: Path) -> None:
    """A compound pendulum: T = 2π √((I + m·r²)/(m·g·r)); its mobility is a row of a table that has a column quantity."""
    (tmp_path / "p.toml").write_text(PENDULUM)
    period = f"{2 * math.pi * math.sqrt(0.8 / 10):.3g}"
    for command, quantity, where, answer in (
        ("equilibrium", "period_s", 'stable = "true"', period),
        ("inspect", "value", 'quantity = "mobility"', "1.00"),
    ):
        (tmp_path / "e.toml").write_text(
            f'command = "{command} p.toml"\n[[ask]]\nquantity = "{quantity}"\nwhere = {{ {where} }}\n'
        )
        done = dalembert("exercise", "e.toml", "-o", command)
        assert done.returncode == 0, done.stderr
        (row,) = rows(tmp_path / command / "key.csv")
        assert (row["quantity"], row["answer"]) == (quantity, answer)
        done = dalembert("grade", "e.toml", f"{command}/key.csv", "--json")
        assert [mark["verdict"] for mark in json.loads(done.stdout)["marks"]] == ["right"], done.stderr
    assert row["row_quantity"] == "mobility"


def test_a_zero_that_computing_has_moved_is_zero(dalembert: Dalembert, tmp_path: Path) -> None:
    """The torque that holds the hanging pendulum is m·g·r·cos(−90°), which computing makes 6e-16."""
    (tmp_path / "p.toml").write_text(PENDULUM)
    ask = '[[ask]]\nquantity = "input_torque_N_m"\n'
    for angle, zero in (("-90deg", True), ("-89.99999999deg", False)):
        (tmp_path / "e.toml").write_text(f'command = "forces p.toml --at {angle}"\n{ask}')
        assert dalembert("exercise", "e.toml", "-o", angle).returncode == 0
        (row,) = rows(tmp_path / angle / "key.csv")
        assert (float(row["value"]) == 0) is zero
    (tmp_path / "a.csv").write_text("student,quantity,answer\n1,input_torque_N_m,0\n")
    (tmp_path / "e.toml").write_text(f'command = "forces p.toml --at -90deg"\n{ask}')
    done = dalembert("grade", "e.toml", "a.csv", "--json")
    assert [mark["verdict"] for mark in json.loads(done.stdout)["marks"]] == ["right"]


def test_a_row_of_the_table_that_is_too_short(dalembert: Dalembert, folder: Path) -> None:
    (folder / "rotor.csv").write_text(ROTOR.replace("W2,60,50,210,65", "W2,60,50"))
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 1
    assert "row 2 (line 3), column z_mm: found ''" in done.stderr
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("table", "column"),
    [
        ("name;weight_N;radius_mm;angle_deg;z_mm\nW1;90,5;30;60;20\nW2;60;50;210;65\n", "weight_N"),
        ("name,weight [N],radius [mm],angle [deg],z [mm]\nW1,90.5,30,60,20\nW2,60,50,210,65\n", "weight_N"),
        ("name,weight [N],radius [mm],angle [deg],z [mm]\nW1,90.5,30,60,20\nW2,60,50,210,65\n", "weight [N]"),
    ],
)
def test_tables_as_people_have_them(dalembert: Dalembert, folder: Path, table: str, column: str) -> None:
    """A drawn weight stands in a table with decimal commas, and below a header with its unit in brackets."""
    (folder / "rotor.csv").write_text(table)
    (folder / "e.toml").write_text(
        'command = "balance rotor.csv --plane A:0mm:20mm --plane B:90mm:20mm --gravity 10"\n'
        f'text = "W1 = {{rotor.csv:W1.{column}}}"\n[draw]\n"rotor.csv:W1.{column}" = "80.5N:90.5N:5N"\n'
        '[[ask]]\nquantity = "mass_kg"\nwhere = { plane = "B" }\nfigures = 5\n'
    )
    done = dalembert("exercise", "e.toml", "--students", 3, "-o", "out")
    assert done.returncode == 0, done.stderr
    for row in rows(folder / "out" / "key.csv"):
        weight = row[f"rotor.csv:W1.{column}"]
        sheet = (folder / "out" / f"sheet-{row['student']}.html").read_text()
        assert f"W1 = {weight}" in sheet
        # in N·mm²: two moments at 60° and 210°
        first, second = float(weight.removesuffix(" N")) * 30 * 20, 60 * 50 * 65
        moment = math.sqrt(first**2 + second**2 + 2 * first * second * math.cos(math.radians(150)))
        assert float(row["answer"]) == pytest.approx(moment / (90 * 20 * 10), rel=1e-4)
