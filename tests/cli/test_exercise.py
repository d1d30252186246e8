"""`dalembert exercise`: a class's variants, sheets, key and solutions."""

from __future__ import annotations

import csv
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from tests.cli.exercises import EXERCISE, ROTOR, rotor_exercise, rows
from tests.cli.pages import Opened
from tests.conftest import Dalembert
from tests.svg_names import svg_faults, svg_names
from virtualwork import Mechanism


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an exercise."""
    return rotor_exercise(tmp_path)


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


def test_the_names_of_many_masses_keep_clear_of_each_other(dalembert: Dalembert, folder: Path) -> None:
    """Twelve masses close together, seen along the axis and from the side."""
    masses = "".join(f"M{k},{50 + k},{40 + k},{37 * k % 360},{20 * k}\n" for k in range(1, 13))
    (folder / "rotor.csv").write_text("name,weight_N,radius_mm,angle_deg,z_mm\n" + masses)
    (folder / "e.toml").write_text(
        'command = "balance rotor.csv --plane A:0mm:20mm --plane B:250mm:20mm"\n'
        '[[ask]]\nquantity = "mass_kg"\nwhere = { plane = "A" }\n'
    )
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    sheet = (folder / "out" / "sheet-1.html").read_text()
    names = re.findall(
        r'<text x="([\d.]+)" y="([\d.]+)" text-anchor="middle"[^>]*>(M\d+|[xyAB])</text>', sheet
    )
    assert len(names) == 2 * 12 + 4
    places = [(float(x), float(y), 4.3 * len(name)) for x, y, name in names]
    for k, (x, y, half) in enumerate(places):
        assert half <= x <= 430 - half
        assert all(abs(x - a) >= half + other or abs(y - b) >= 15 for a, b, other in places[:k]), names[k]


def test_angles_of_measured_vibration_count_as_the_instrument_does(
    dalembert: Dalembert, folder: Path
) -> None:
    """Those of a rotor's masses count counter-clockwise from x."""
    (folder / "runs.csv").write_text(
        "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,3.4,116,,,\n1,1,1.8,42,A,2,30\n"
    )
    for command, has_sense in (
        ("balance rotor.csv --plane A:0mm:20mm --plane B:90mm:20mm", True),
        ("field runs.csv", False),
    ):
        (folder / "e.toml").write_text(
            f'command = "{command}"\n[[ask]]\nquantity = "angle_deg"\nwhere = {{ plane = "A" }}\n'
        )
        assert dalembert("exercise", "e.toml", "-o", command[:5]).returncode == 0
        sheet = (folder / command[:5] / "sheet-1.html").read_text()
        assert "A whole turn more or less is the same angle." in sheet
        assert ("Angles count counter-clockwise from x." in sheet) is has_sense


@pytest.mark.parametrize("name", ["rack-lift", "belt-drive"])
def test_a_mechanism_of_every_kind_has_a_figure(dalembert: Dalembert, tmp_path: Path, name: str) -> None:
    assert dalembert("examples", name).returncode == 0
    (file,) = tmp_path.glob("*.toml")
    (tmp_path / "e.toml").write_text(
        f'command = "inspect {file.name}"\n[[ask]]\nquantity = "value"\nwhere = {{ quantity = "mobility" }}\n'
    )
    done = dalembert("exercise", "e.toml", "-o", "out")
    assert done.returncode == 0, done.stderr
    sheet = (tmp_path / "out" / "sheet-1.html").read_text()
    assert "<svg" in sheet
    # every point and link has its name
    m = Mechanism.from_toml(file)
    assert all(f">{name}</text>" in sheet for name in (*m.points, *m.links))


@pytest.mark.slow
def test_names_of_a_sheet_s_mechanism_stand_beside_the_lines(dalembert: Dalembert, tmp_path: Path) -> None:
    """Names of the Klann leg's links and points stood on its lines; a tall mechanism is not stretched to the page's width."""
    assert dalembert("examples", "exercise-klann").returncode == 0
    assert dalembert("exercise", "exercise-klann.toml", "--students", 6, "-o", "out").returncode == 0
    for k in range(1, 7):
        (picture,) = re.findall(r"<svg.*?</svg>", (tmp_path / "out" / f"sheet-{k}.html").read_text())
        assert len(svg_names(picture)) == 13
        assert svg_faults(picture) == []
        root = ET.fromstring(picture)
        assert float(root.get("width", "")) <= 500
        assert float(root.get("height", "")) <= 440


def test_names_of_a_sheet_s_rotor_stand_beside_the_arms(dalembert: Dalembert, tmp_path: Path) -> None:
    """None of the middles of two names, and no mass, is within a name."""
    (tmp_path / "rotor.csv").write_text(
        "name,mass_kg,radius_mm,angle_deg,z_mm\n"
        + "".join(f"W{k},1,{40 - k},{10 * k},{20 + k}\n" for k in range(6))
    )
    (tmp_path / "e.toml").write_text(
        'command = "balance rotor.csv --plane A:0mm:20mm --plane B:90mm:20mm"\n'
        '[[ask]]\nquantity = "mass_kg"\nwhere = { plane = "A" }\n'
    )
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    (picture,) = re.findall(r"<svg.*?</svg>", (tmp_path / "out" / "sheet-1.html").read_text())
    root = ET.fromstring(picture)
    svg = "{http://www.w3.org/2000/svg}"
    texts = [(str(t.text), float(t.get("x", "")), float(t.get("y", "")) - 5) for t in root.iter(f"{svg}text")]
    masses = [
        (float(c.get("cx", "")), float(c.get("cy", "")))
        for c in root.iter(f"{svg}circle")
        if c.get("r") == "7" and c.get("stroke") == "#fff"
    ]
    assert len(masses) == 12
    for k, (name, x, y) in enumerate(texts):
        if name.startswith("W"):
            assert not any(abs(x - a) < 8 and abs(y - b) < 6 for a, b in masses), name
            assert not any(
                abs(x - a) < 14 and abs(y - b) < 11 for other, a, b in texts[:k] if other[0] == "W"
            )
