"""`dalembert exercise`: variants, sheets, key, solutions and Moodle's questions."""

from __future__ import annotations

import csv
import json
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from tests.cli.pages import Opened
from tests.conftest import Dalembert

ROTOR = """name,weight_N,radius_mm,angle_deg,z_mm
W1,90,30,60,20
W2,60,50,210,65
"""
EXERCISE = """
command = "balance rotor.csv --plane A:0mm:20mm --plane B:90mm:20mm --gravity 10"
title = "A rotor"
text = "W1 = {rotor.csv:W1.weight_N} at {rotor.csv:W1.radius_mm}, W2 at {rotor.csv:W2.angle_deg}."
[draw]
"rotor.csv:W1.weight_N" = "60N:120N:5N"
"rotor.csv:W2.angle_deg" = [200, 210, 220]
[[ask]]
quantity = "mass_kg"
where = { plane = "B" }
figures = 3
points = 2
[[ask]]
quantity = "angle_deg"
where = { plane = "B" }
[[ask]]
quantity = "mass_kg"
where = { plane = "A" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an exercise."""
    (tmp_path / "rotor.csv").write_text(ROTOR)
    (tmp_path / "e.toml").write_text(EXERCISE)
    return tmp_path


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_what_a_class_gets(dalembert: Dalembert, folder: Path) -> None:
    done = dalembert("exercise", "e.toml", "--students", 4, "--seed", 7, "-o", "out")
    assert done.returncode == 0, done.stderr
    out = folder / "out"
    names = {path.name for path in out.iterdir()}
    assert names == {
        "answers.csv",
        "key.csv",
        "solutions.html",
        "moodle.xml",
        *(f"sheet-{k}.html" for k in range(1, 5)),
    }
    answers, key = rows(out / "answers.csv"), rows(out / "key.csv")
    assert list(answers[0]) == ["student", "plane", "quantity", "unit", "answer"]
    assert len(answers) == 12
    assert {row["answer"] for row in answers} == {""}
    assert len({row["rotor.csv:W1.weight_N"] + row["rotor.csv:W2.angle_deg"] for row in key}) == 4
    for k in range(1, 5):
        sheet = (out / f"sheet-{k}.html").read_text()
        own = next(row for row in key if row["student"] == str(k))
        assert f"W1 = {own['rotor.csv:W1.weight_N']} at 30 mm" in sheet
        assert "<svg" in sheet
        # nothing of the answers
        assert not any(
            row["answer"] in re.sub(r"<svg.*?</svg>", "", sheet) for row in key if len(row["answer"]) > 3
        )


def test_the_key_is_what_the_command_says_of_each_students_numbers(
    dalembert: Dalembert, folder: Path
) -> None:
    dalembert("exercise", "e.toml", "--students", 3, "-o", "out")
    for student in ("1", "2", "3"):
        own = [row for row in rows(folder / "out" / "key.csv") if row["student"] == student]
        weight, angle = own[0]["rotor.csv:W1.weight_N"].removesuffix(" N"), own[0]["rotor.csv:W2.angle_deg"]
        (folder / "mine.csv").write_text(
            ROTOR.replace("W1,90", f"W1,{weight}").replace("50,210", f"50,{angle}")
        )
        done = dalembert(
            "balance", "mine.csv", "--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm", "--gravity", 10
        )
        found = {row["plane"]: row for row in csv.DictReader(done.stdout.splitlines())}
        for row in own:
            assert float(row["value"]) == pytest.approx(
                float(found[row["plane"]][row["quantity"]]), rel=1e-14
            )


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


def test_the_same_seed_is_the_same_folder_and_another_is_not(dalembert: Dalembert, folder: Path) -> None:
    for name, seed in (("one", 5), ("two", 5), ("three", 6)):
        assert dalembert("exercise", "e.toml", "--students", 3, "--seed", seed, "-o", name).returncode == 0
    one, two, three = (
        {p.name: p.read_bytes() for p in (folder / name).iterdir()} for name in ("one", "two", "three")
    )
    assert one == two
    assert one["key.csv"] != three["key.csv"]


def test_a_roster_names_the_sheets_and_keeps_its_columns(dalembert: Dalembert, folder: Path) -> None:
    (folder / "class.csv").write_text("student,group\nAna Sá,1\n07,2\n7,2\n")
    done = dalembert("exercise", "e.toml", "--students", "class.csv", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert (folder / "out" / "sheet-Ana-Sá.html").exists()
    assert [(row["student"], row["group"]) for row in rows(folder / "out" / "answers.csv")][::3] == [
        ("Ana Sá", "1"),
        ("07", "2"),
        ("7", "2"),
    ]


@pytest.mark.parametrize("name", ["quantity", "Answer", "plane", "points", "rotor.csv:W1.weight_N"])
def test_a_roster_has_no_column_of_the_answers(dalembert: Dalembert, folder: Path, name: str) -> None:
    """Two columns of one name could not be read again."""
    (folder / "class.csv").write_text(f"student,{name}\n1,2\n")
    done = dalembert("exercise", "e.toml", "--students", "class.csv", "-o", "out")
    assert done.returncode == 1
    assert f"class.csv: column {name}: " in done.stderr
    assert not (folder / "out").exists()


def test_variants_keep_away_from_what_cannot_be_assembled(dalembert: Dalembert, folder: Path) -> None:
    (folder / "bar.toml").write_text(
        '[units]\nlength = "mm"\nangle = "deg"\n[ground]\nA = [0, 0]\nD = [300, 0]\n[links.crank]\npoints = { A = [0, 0], B = [100, 0] }\n'
        "[links.bar]\npoints = { B = [0, 0], C = [250, 0] }\n[links.rocker]\npoints = { D = [0, 0], C = [150, 0] }\n"
        '[input]\nlink = "crank"\nangle = 60\n[guess]\nat = 60\nbar = 20\nrocker = 80\n'
    )
    (folder / "m.toml").write_text(
        'command = "mechanism bar.toml --at 60deg"\ntitle = "m"\n[draw]\n"links.bar.C.x" = "20mm:400mm:20mm"\n'
        '[[ask]]\nquantity = "rocker_angle_deg"\n'
    )
    done = dalembert("exercise", "m.toml", "--students", 8, "-o", "out")
    assert done.returncode == 0, done.stderr
    lengths = {float(row["links.bar.C.x"].removesuffix(" mm")) for row in rows(folder / "out" / "key.csv")}
    # B stands at (50, 86.6), D at (300, 0): 264.6 apart; the bar and the rocker of 150 reach from 114.6 to 414.6
    assert len(lengths) == 8
    assert all(120 < length < 410 for length in lengths)


def moodle_takes(question: ET.Element, value: float) -> tuple[float, str]:
    """Moodle's rule: the first answer that is at most its tolerance away gives fraction and feedback (nominal tolerance)."""
    for answer in question.findall("answer"):
        nominal, tolerance = float(answer.findtext("text", "")), abs(float(answer.findtext("tolerance", "")))
        slack = 1e-14 * max(1.0, abs(nominal))
        if nominal - tolerance - slack <= value <= nominal + tolerance + slack:
            return float(answer.get("fraction", "")), answer.findtext("feedback/text") or ""
    return 0.0, ""


def test_a_slash_of_a_title_parts_no_category_of_moodle(dalembert: Dalembert, folder: Path) -> None:
    """Of the bank's path each part is a category, and two slashes are one of its name; an empty title is the file's name."""
    for title, name in (("Balance 1/2", "Balance 1//2"), ("", "e")):
        (folder / "e.toml").write_text(EXERCISE.replace('title = "A rotor"', f'title = "{title}"'))
        assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
        quiz = ET.parse(folder / "out" / "moodle.xml").getroot()
        path = quiz.findtext("question[@type='category']/category/text")
        assert path == f"$course$/top/{name}/1 mass (plane B)"


def test_moodles_questions(dalembert: Dalembert, folder: Path) -> None:
    """Elements and their meaning as question/format/xml of Moodle reads them."""
    dalembert("exercise", "e.toml", "--students", 3, "-o", "out")
    quiz = ET.parse(folder / "out" / "moodle.xml").getroot()
    assert quiz.tag == "quiz"
    kinds = [question.get("type") for question in quiz]
    assert kinds.count("category") == 3
    assert kinds.count("numerical") == 9
    key = {(row["student"], row["plane"], row["quantity"]): row for row in rows(folder / "out" / "key.csv")}
    for question in quiz.findall("question[@type='numerical']"):
        for name in (
            "name/text",
            "questiontext/text",
            "defaultgrade",
            "penalty",
            "hidden",
            "unitgradingtype",
            "unitpenalty",
            "showunits",
            "unitsleft",
        ):
            assert question.find(name) is not None, name
        assert question.find("questiontext").get("format") == "html"  # type: ignore[union-attr]
        # 3: no unit is typed, the number alone is graded
        assert question.findtext("showunits") == "3"
        name = question.findtext("name/text", "")
        student = re.search(r"\((\d+)\)$", name)[1]  # type: ignore[index]
        plane = re.search(r"plane ([AB])", name)[1]  # type: ignore[index]
        row = key[student, plane, "angle_deg" if "angle" in name else "mass_kg"]
        right = float(row["answer"])
        assert question.findtext("defaultgrade") == row["points"]
        half = 0.5 * 10.0 ** -len(row["answer"].partition(".")[2])
        assert moodle_takes(question, right)[0] == 100
        assert moodle_takes(question, float(row["value"]))[0] == 100
        for side in (-1, 1):
            assert moodle_takes(question, right + side * 0.999 * half)[0] == 100
            assert moodle_takes(question, right + side * 2 * half)[0] == 0
        if "angle" in name:
            assert moodle_takes(question, right - 360)[0] == 100
        feedbacks = [
            answer.findtext("feedback/text") or "" for answer in question.findall("answer[@fraction='0']")
        ]
        assert len(feedbacks) > 3
        assert all(text.startswith("Likely mistake: ") for text in feedbacks)
        for answer in question.findall("answer[@fraction='0']"):
            assert moodle_takes(question, float(answer.findtext("text", "")))[1] == answer.findtext(
                "feedback/text"
            )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('title = "A rotor"', 'titel = "A rotor"', ["key titel", "did you mean 'title'"]),
        ("quantity = \"angle_deg\"", "quantity = \"angel_deg\"", ["[[ask]] 2", "'angel_deg'", "did you mean 'angle_deg'"]),
        ("figures = 3", "figures = 0", ["[[ask]] 1", "figures", "'0'", "a whole number from 1"]),
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


PENDULUM = """
gravity = [0, -10]
[ground]
O = [0, 0]
[links.arm]
points = { O = [0, 0] }
mass = 2
center = [0.5, 0]
inertia = 0.3
[input]
link = "arm"
angle = "-90 deg"
"""


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


def test_braces_of_a_formula_are_its_own(dalembert: Dalembert, folder: Path) -> None:
    text = r"U = $\\frac{m}{2}$ of {rotor.csv:W1.weight_N}, \\(x^{2}\\) < 3 & 4"
    (folder / "e.toml").write_text(re.sub('text = ".*"', lambda _: f'text = "{text}"', EXERCISE))
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 0, done.stderr
    weight = rows(folder / "out" / "key.csv")[0]["rotor.csv:W1.weight_N"]
    quiz = ET.parse(folder / "out" / "moodle.xml").getroot()
    for page in ((folder / "out" / "sheet-1.html").read_text(), quiz.findtext("question/questiontext/text")):
        assert page is not None
        assert rf"U = $\frac{{m}}{{2}}$ of {weight}, \(x^{{2}}\) &lt; 3 &amp; 4" in page


def test_a_row_of_the_table_that_is_too_short(dalembert: Dalembert, folder: Path) -> None:
    (folder / "rotor.csv").write_text(ROTOR.replace("W2,60,50,210,65", "W2,60,50"))
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 1
    assert "row 2 (line 3), column z_mm: found ''" in done.stderr
    assert not (folder / "out").exists()


def test_wrong_usage_is_status_2(dalembert: Dalembert, folder: Path) -> None:
    assert dalembert("exercise", "e.toml").returncode == 2
    assert dalembert("exercise", "e.toml", "--students", "0", "-o", "out").returncode == 2
    assert dalembert("exercise", "e.toml", "--students", "2.5", "-o", "out").returncode == 2
    assert dalembert("exercise", "e.toml", "-o", "").returncode == 2
    assert not (folder / "out").exists()


def test_answers_that_are_filled_in_are_never_lost(dalembert: Dalembert, folder: Path) -> None:
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    answers = folder / "out" / "answers.csv"
    answers.write_text(answers.read_text().replace("kg,\n", "kg,8.55\n", 1))
    before = {path.name: path.read_bytes() for path in (folder / "out").iterdir()}
    done = dalembert("exercise", "e.toml", "--seed", 9, "-o", "out")
    assert done.returncode == 1
    assert "answers.csv" in done.stderr
    assert before == {path.name: path.read_bytes() for path in (folder / "out").iterdir()}


def test_prairielearns_question(dalembert: Dalembert, folder: Path) -> None:
    """The element grades by |a − right| ≤ atol; server.py names mistakes and takes an angle a turn off."""
    done = dalembert("exercise", "e.toml", "--students", 3, "-o", "out", "--for", "prairielearn")
    assert done.returncode == 0, done.stderr
    question = folder / "out" / "prairielearn" / "a-rotor"
    info = json.loads((question / "info.json").read_text())
    assert info["type"] == "v3"
    assert {"uuid", "title", "topic"} <= info.keys()
    page = (question / "question.html").read_text()
    assert re.findall(r'answers-name="(\w+)"', page) == ["answer1", "answer2", "answer3"]
    assert re.findall(r' weight="(\d+)"', page) == ["2", "1", "1"]
    assert page.count('comparison="relabs" rtol="0"') == 3
    server: dict[str, Any] = {}
    exec((question / "server.py").read_text(), server)
    data: dict[str, Any] = {
        "params": {}, "correct_answers": {}, "variant_seed": 17, "options": {"question_path": str(question)},
        "submitted_answers": {}, "partial_scores": {},
    }  # fmt: skip
    server["generate"](data)
    assert "<svg" in data["params"]["problem"]
    right = data["correct_answers"]
    mistake = data["params"]["answer1"]["mistakes"][0]
    data["submitted_answers"] = {
        "answer1": mistake["value"],
        "answer2": right["answer2"] - 360,
        "answer3": right["answer3"],
    }
    for name, weight in (("answer1", 2), ("answer2", 1), ("answer3", 1)):
        off = abs(data["submitted_answers"][name] - right[name])
        data["partial_scores"][name] = {
            "score": float(off <= data["params"][name]["tolerance"]),
            "weight": weight,
        }
    assert [each["score"] for each in data["partial_scores"].values()] == [0, 0, 1]
    server["grade"](data)
    assert [each["score"] for each in data["partial_scores"].values()] == [0, 1, 1]
    assert data["partial_scores"]["answer1"]["feedback"] == f"Likely mistake: {mistake['text']}."
    assert data["score"] == 0.5


def test_numbas_exam(dalembert: Dalembert, folder: Path) -> None:
    done = dalembert("exercise", "e.toml", "--students", 3, "-o", "out", "--for", "numbas")
    assert done.returncode == 0, done.stderr
    head, _, body = (folder / "out" / "numbas.exam").read_text().partition("\n")
    assert head.startswith("// Numbas version: ")
    exam = json.loads(body)
    (group,) = exam["question_groups"]
    assert (group["pickingStrategy"], group["pickQuestions"], len(group["questions"])) == (
        "random-subset",
        1,
        3,
    )
    key = rows(folder / "out" / "key.csv")
    for k, question in enumerate(group["questions"]):
        # braces would be variables, dollars formulas; within nosubvars it looks for neither, after HTML is read either
        assert not set("{}$") & set(question["statement"])
        for text in (question["statement"], *(part["prompt"] for part in question["parts"])):
            assert text.startswith('<div nosubvars="nosubvars" class="mathjax_ignore ')
        for part, row in zip(question["parts"], key[3 * k : 3 * k + 3], strict=True):
            assert part["type"] == "numberentry"
            assert part["marks"] == float(row["points"])
            assert float(part["minValue"]) < float(row["answer"]) < float(part["maxValue"])
            assert float(part["minValue"]) <= float(row["value"]) <= float(part["maxValue"])
            named = [each for each in part["alternatives"] if each["marks"] == 0]
            assert all(each["alternativeFeedbackMessage"] for each in named)
            assert len(named) > 3


def test_an_unknown_system_is_status_2(dalembert: Dalembert, folder: Path) -> None:
    done = dalembert("exercise", "e.toml", "-o", "out", "--for", "canvas")
    assert done.returncode == 2
    assert "prairielearn or numbas" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["exercise-rotor", "exercise-klann"])
def test_a_sheet_carries_its_page(name: str, dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """The page in the sheet's frame has the student's numbers and answers, on a phone too; it is not printed."""
    assert dalembert("examples", name).returncode == 0
    done = dalembert("exercise", f"{name}.toml", "--students", "2", "--page", "-o", "week")
    assert done.returncode == 0, done.stderr
    phone = {"width": 360, "height": 740, "deviceScaleFactor": 2, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
    try:
        for student in ("1", "2"):
            opened = Opened(browser, tmp_path / "week" / f"sheet-{student}.html")
            opened("document.querySelector('details').open = true")
            assert opened("return document.documentElement.scrollWidth") <= 360
            browser.switch_to.frame(0)
            assert opened("return document.documentElement.scrollWidth <= innerWidth")
            for row in rows(tmp_path / "week" / "key.csv"):
                if row["student"] != student:
                    continue
                quantity, plane = row["quantity"], row.get("plane", "")
                name_of = {"mass_kg": f"{plane}.mass", "angle_deg": f"{plane}.angle"}.get(quantity)
                asked = name_of or quantity.replace("_angle_deg", ".angle").replace("_m", "").replace(
                    "_", "."
                )
                shown = float(opened("return dalembert.get(arguments[0])", asked))
                value, unit = float(row["value"]), row["unit"]
                if unit in ("deg", "°"):
                    assert math.cos(shown - math.radians(value)) == pytest.approx(1, abs=1e-12)
                else:
                    scale = {"kg": 1, "g": 1e-3, "m": 1, "mm": 1e-3}[unit]
                    assert shown == pytest.approx(value * scale, rel=1e-9)
            browser.switch_to.default_content()
            assert opened.faults() == []
    finally:
        browser.switch_to.default_content()
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_page_where_the_command_has_none(dalembert: Dalembert, tmp_path: Path) -> None:
    assert dalembert("examples", "exercise-rod").returncode == 0
    done = dalembert("exercise", "exercise-rod.toml", "--page", "-o", "week")
    assert done.returncode == 2
    assert "which has no page" in " ".join(done.stderr.split())
    assert not (tmp_path / "week").exists()


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
