"""`dalembert grade`: verdicts, likely mistakes, answers that follow from earlier ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cli.exercise.marks import scale_of
from tests.cli.exercises import EXERCISE, ROTOR
from tests.conftest import Dalembert

STATES = """link,mass_kg,inertia_kg_m2,vx_m_s,vy_m_s,ax_m_s2,ay_m_s2,omega_rad_s,alpha_rad_s2,fx_N,fy_N,torque_N_m
2,5,0.05,0,0,0,0,20,0,,,?
3,3,0.1,300,200,900,-600,-50,-800,,,
4,2,,-500,0,900,0,0,0,5000,0,
"""
WORK = """
command = "work states.csv --gravity 0,-10"
title = "Riul, example 1"
[[ask]]
quantity = "torque_N_m"
figures = 4
points = 2
"""


def marks(dalembert: Dalembert, *words: object) -> list[dict[str, Any]]:
    done = dalembert("grade", *words, "--json")
    assert done.returncode == 0, done.stderr
    found: list[dict[str, Any]] = json.loads(done.stdout)["marks"]
    return found


@pytest.fixture
def work(tmp_path: Path) -> Path:
    """Riul's example as an exercise."""
    (tmp_path / "states.csv").write_text(STATES)
    (tmp_path / "w.toml").write_text(WORK)
    return tmp_path


def test_82350_is_answered_by_its_two_slips(dalembert: Dalembert, work: Path) -> None:
    """Riul, unit II, example 1: right is 103 000; 4 000 stands for −4 000, and 45 000 for 450 000."""
    (work / "a.csv").write_text("student,quantity,answer\n7,torque_N_m,82350\n")
    done = dalembert("grade", "w.toml", "a.csv", "--json")
    document = json.loads(done.stdout)
    (mark,) = document["marks"]
    assert (mark["student"], mark["quantity"], mark["given"], mark["figures"]) == (
        "7",
        "torque_N_m",
        "82350",
        4,
    )
    assert mark["right"] == pytest.approx(103000, rel=1e-14)
    assert (mark["verdict"], mark["points"]) == ("wrong", 0)
    assert mark["mistake"].startswith("the inertia torque of link 3 has the wrong sign and ")
    assert "inertia force of link 3" in mark["mistake"]
    assert "450 000 W taken as 45 000 W" in mark["mistake"]
    assert document["totals"] == [{"student": "7", "points": 0, "of": 2}]


@pytest.mark.parametrize(
    ("answer", "verdict", "mistake"),
    [
        ("103000", "right", None), ("1.030e5", "right", None), ("103 kN m", "right", None), ("103,0 kNm", "right", None),
        ("102999.7", "right", None), ("103100", "rounding", None), ("100000", "figures", None), ("", "blank", None), ("-", "blank", None),
        ("-103000", "wrong", "the answer has the wrong sign"), ("99000", "wrong", None), ("many", "wrong", "'many' is no number"),
        ("103000 kg", "wrong", "the unit 'kg' does not fit"), ("102800", "wrong", "the inertia torque of link 3 is left out"),
        ("102600", "wrong", "the inertia torque of link 3 has the wrong sign"), ("148000", "wrong", "the inertia force of link 4 is left out"),
        ("102700", "wrong", "the weight of link 3 is left out"), ("102994.3", "right", None),
        ("N/A", "blank", None), ("??", "blank", None), ("T2 = 103000 Nm", "right", None), ("≈103000", "right", None), ("1.03", "wrong", None),
        ("206000/2", "wrong", "'206000/2' is no decimal number"), ("3 ½", "wrong", "'3 ½' is no decimal number"),
        ("103000 ± 500", "wrong", "'103000 ± 500' is no decimal number"), ("103000°", "wrong", "the unit '°' does not fit"),
        ("1e999", "wrong", None), ("-1e-999", "wrong", None), ("0e999", "wrong", None), ("9" * 400, "wrong", None),
    ],
)  # fmt: skip
def test_verdicts(dalembert: Dalembert, work: Path, answer: str, verdict: str, mistake: str | None) -> None:
    (work / "a.csv").write_text(f'student,quantity,answer\n1,torque_N_m,"{answer}"\n')
    (mark,) = marks(dalembert, "w.toml", "a.csv")
    assert (mark["verdict"], mark["mistake"]) == (verdict, mistake)
    assert mark["points"] == {"right": 2, "rounding": 1, "figures": 1}.get(verdict, 0)


def test_g_981_for_10_is_named(dalembert: Dalembert, work: Path) -> None:
    heavy = STATES.replace("3,3,0.1,300,200", "3,3,0.1,300,20000")
    (work / "states.csv").write_text(heavy)
    right = json.loads(dalembert("work", "states.csv", "--gravity", "0,-10", "--json").stdout)
    other = json.loads(dalembert("work", "states.csv", "--gravity", "0,-9.81", "--json").stdout)
    values = [each["steps"][0]["unknowns"][0]["value"] for each in (right, other)]
    (work / "w.toml").write_text(WORK.replace("figures = 4", "figures = 6"))
    (work / "a.csv").write_text(f"student,quantity,answer\n1,torque_N_m,{values[1]:.6f}\n")
    (mark,) = marks(dalembert, "w.toml", "a.csv")
    assert mark["right"] == pytest.approx(values[0])
    assert mark["mistake"] == "g = 9.81 in place of 10"


@pytest.fixture
def rotor(tmp_path: Path, dalembert: Dalembert) -> Path:
    """A class with a rotor each."""
    (tmp_path / "rotor.csv").write_text(ROTOR)
    asks = '[[ask]]\nquantity = "angle_deg"\nwhere = { plane = "A" }\n'
    (tmp_path / "e.toml").write_text(EXERCISE + asks)
    assert dalembert("exercise", "e.toml", "--students", 2, "-o", "out").returncode == 0
    return tmp_path


def answer(folder: Path, given: dict[tuple[str, str, str], str], extra: str = "") -> Path:
    lines = ["student,plane,quantity,answer" + (",name" if extra else "")]
    lines += [
        f"{student},{plane},{quantity},{text}{f',{extra}' if extra else ''}"
        for (student, plane, quantity), text in given.items()
    ]
    path = folder / "out" / "mine.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def key(folder: Path) -> dict[tuple[str, str, str], float]:
    import csv

    with (folder / "out" / "key.csv").open() as stream:
        return {(r["student"], r["plane"], r["quantity"]): float(r["value"]) for r in csv.DictReader(stream)}


def test_the_key_itself_is_all_right(dalembert: Dalembert, rotor: Path) -> None:
    done = dalembert("grade", "e.toml", "out/key.csv", "--json")
    document = json.loads(done.stdout)
    assert {mark["verdict"] for mark in document["marks"]} == {"right"}
    assert document["totals"] == [{"student": str(k), "points": 5, "of": 5} for k in (1, 2)]
    assert all(mark["plane"] in "AB" for mark in document["marks"])


def test_angles_count_modulo_a_turn_and_in_radians(dalembert: Dalembert, rotor: Path) -> None:
    right = key(rotor)["1", "A", "angle_deg"]
    for text in (
        f"{right - 360:.2f}",
        f"{right + 720:.2f}",
        f"{right * 3.141592653589793 / 180:.5f} rad",
        f"{right:.1f}°",
    ):
        (mark,) = [
            m
            for m in marks(dalembert, "e.toml", answer(rotor, {("1", "A", "angle_deg"): text}))
            if m["student"] == "1" and m["verdict"] != "blank"
        ]
        assert mark["verdict"] == "right", text


def test_plane_a_follows_from_plane_b_as_it_was_given(dalembert: Dalembert, rotor: Path) -> None:
    """U_A = −ΣU − U_B with the wrong U_B is carried forward; with another one it is wrong."""
    import cmath

    right = key(rotor)
    u_b = right["1", "B", "mass_kg"] * cmath.exp(1j * cmath.pi / 180 * right["1", "B", "angle_deg"])
    u_a = right["1", "A", "mass_kg"] * cmath.exp(1j * cmath.pi / 180 * right["1", "A", "angle_deg"])
    wrong = 1.3 * u_b
    after = u_a + u_b - wrong
    degrees = cmath.phase(after) * 180 / cmath.pi % 360
    given = {
        ("1", "B", "mass_kg"): f"{abs(wrong):.4g}", ("1", "B", "angle_deg"): f"{right['1', 'B', 'angle_deg']:.4g}",
        ("1", "A", "mass_kg"): f"{abs(after):.4g}", ("1", "A", "angle_deg"): f"{degrees:.4g}",
    }  # fmt: skip
    found = {
        (m["plane"], m["quantity"]): m
        for m in marks(dalembert, "e.toml", answer(rotor, given))
        if m["student"] == "1"
    }
    assert found["B", "mass_kg"]["verdict"] == "wrong"
    assert found["B", "angle_deg"]["verdict"] == "right"
    assert found["A", "mass_kg"]["verdict"] == found["A", "angle_deg"]["verdict"] == "carried"
    assert found["A", "mass_kg"]["points"] == 1
    # a right plane B carries nothing
    given["1", "B", "mass_kg"] = f"{abs(u_b):.4g}"
    found = {
        (m["plane"], m["quantity"]): m
        for m in marks(dalembert, "e.toml", answer(rotor, given))
        if m["student"] == "1"
    }
    assert found["A", "mass_kg"]["verdict"] == "wrong"


def test_180_degrees_and_the_weight_are_named(dalembert: Dalembert, rotor: Path) -> None:
    right = key(rotor)
    given = {
        ("2", "B", "mass_kg"): f"{10 * right['2', 'B', 'mass_kg']:.5g}",
        ("2", "B", "angle_deg"): f"{right['2', 'B', 'angle_deg'] + 180:.4g}",
    }
    found = [m for m in marks(dalembert, "e.toml", answer(rotor, given)) if m["given"]]
    assert "weight in place of the mass" in found[0]["mistake"]
    assert "180°" in found[1]["mistake"]


def test_names_are_kept_and_decimal_commas_read(dalembert: Dalembert, rotor: Path) -> None:
    text = (
        "student;name;plane;quantity;unit;answer\n2;Ana;B;mass_kg;g;"
        + f"{1000 * key(rotor)['2', 'B', 'mass_kg']:.4f}".replace(".", ",")
        + "\n"
    )
    (rotor / "out" / "mine.csv").write_text(text)
    done = dalembert("grade", "e.toml", "out/mine.csv", "-o", "marks.csv")
    assert done.returncode == 0, done.stderr
    lines = (rotor / "marks.csv").read_text().splitlines()
    assert lines[0] == "student,name,plane,quantity,unit,given,right,figures,verdict,points,mistake"
    assert any(line.startswith("2,Ana,B,mass_kg") and ",right,2.0," in line for line in lines)
    assert (rotor / "marks-totals.csv").read_text().splitlines()[0] == "student,name,points,of"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("student,plane,quantity\n1,B,mass_kg\n", ["no column answer"]),
        ("student,plane,quantity,answer\n9,B,mass_kg,1\n", ["row 1", "'9'", "a student of the key"]),
        ("student,plane,quantity,answer\n1,B,mass,1\n", ["row 1", "'mass'", "mass_kg, angle_deg"]),
        ("student,plane,quantity,answer\n1,C,mass_kg,1\n", ["row 1", "'C'"]),
        ("student,plane,quantity,answer\n1,B,mass_kg,1\n1,B,mass_kg,2\n", ["row 2", "once"]),
        ("student,quantity,answer\n1,mass_kg,1\n", ["no column plane"]),
    ],
)  # fmt: skip
def test_bad_answers_are_one_line(dalembert: Dalembert, rotor: Path, text: str, said: list[str]) -> None:
    (rotor / "out" / "mine.csv").write_text(text)
    done = dalembert("grade", "e.toml", "out/mine.csv", "-o", "marks.csv")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert all(part in done.stderr for part in said), done.stderr
    assert not (rotor / "marks.csv").exists()


def test_without_a_key_there_are_no_numbers(dalembert: Dalembert, rotor: Path) -> None:
    (rotor / "elsewhere.csv").write_text("student,plane,quantity,answer\n1,B,mass_kg,1\n")
    done = dalembert("grade", "e.toml", "elsewhere.csv")
    assert done.returncode == 1
    assert "--key" in done.stderr
    assert dalembert("grade", "e.toml", "elsewhere.csv", "--key", "out/key.csv").returncode == 0


def test_an_answer_in_its_own_unit_counts_as_in_the_other(dalembert: Dalembert, work: Path) -> None:
    """STACK judges 18.1 kJ and 18100 J differently."""
    (work / "w.toml").write_text(WORK.replace("figures = 4", 'figures = 4\nunit = "kN m"'))
    answers = ("103000 N m", "103.0", "103.0 kN·m", "103", "102.9", "103 kJ")
    (work / "a.csv").write_text(
        "student,quantity,answer\n" + "".join(f"{k},torque_N_m,{a}\n" for k, a in enumerate(answers))
    )
    verdicts = [mark["verdict"] for mark in marks(dalembert, "w.toml", "a.csv")]
    assert verdicts == ["right", "right", "right", "right", "rounding", "right"]


@pytest.mark.parametrize(
    ("unit", "question", "scale"),
    [
        ("Nm", "N_m", 1), ("N-m", "N_m", 1), ("kNm", "N_m", 1000), ("Ncm", "N_m", 0.01), ("MNm", "N_m", 1e6), ("J", "N_m", 1),
        ("m·s⁻¹", "m_s", 1), ("rad s⁻²", "rad_s2", 1), ("1/s", "rad_s", 1), ("s^-2", "rad_s2", 1), ("1/s", "m_s", None),
        ("rad/sec", "rad_s", 1), ("RPM", "rpm", 1), ("Kg", "kg", 1), ("KG", "g", 1000), ("kgm²/s", "kg_m2_s", 1), ("gmm", "kg_m", 1e-6),
        ("g-mm", "kg_m", 1e-6), ("oz-in", "oz_in", 1), ("Nm/s", "W", 1), ("degrees", "deg", 1), ("kg", "N", None), ("ft-lb", "N_m", None),
    ],
)  # fmt: skip
def test_units_as_people_spell_them(unit: str, question: str, scale: float | None) -> None:
    found = scale_of(unit, question)
    assert (None if found is None else float(found)) == scale


def test_a_report_of_the_marks(dalembert: Dalembert, rotor: Path) -> None:
    done = dalembert("grade", "e.toml", "out/key.csv", "--report", "marks.html")
    assert done.returncode == 0, done.stderr
    text = (rotor / "marks.html").read_text()
    assert "Marks: A rotor" in text
    assert text.count("right") > 5


def test_numbers_in_another_unit_than_the_column(dalembert: Dalembert, rotor: Path) -> None:
    path = rotor / "out" / "key.csv"
    path.write_text(path.read_text().replace(" N,", " kg,"))
    done = dalembert("grade", "e.toml", "out/key.csv")
    assert done.returncode == 1
    assert "[draw], rotor.csv:W1.weight_N: found '" in done.stderr
    assert "expected a value in the unit of the column weight_N (student 1: " in done.stderr
