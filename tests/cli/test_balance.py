"""`dalembert balance` as a user runs it."""

from __future__ import annotations

import cmath
import json
import math
import subprocess
from pathlib import Path

import pytest

from tests.cli.printed import document as answer
from tests.cli.printed import rows
from tests.conftest import Dalembert

ROTOR = "name,mass_kg,radius_mm,angle_deg,z_mm\nm1,9,30,60,20\nm2,6,50,210,65\n"
TWO = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")


@pytest.fixture
def rotor(tmp_path: Path) -> Path:
    path = tmp_path / "rotor.csv"
    path.write_text(ROTOR)
    return path


def test_the_document_has_the_promised_keys(dalembert: Dalembert, rotor: Path) -> None:
    document = answer(
        dalembert(
            "balance", rotor, *TWO, "--json", "--grade", "G2.5", "--speed", "3000rpm", "--rotor-mass", "12kg"
        )
    )
    assert set(document) >= {"rotors", "warnings"}
    (one,) = document["rotors"]
    assert one["rotor"] == "1"
    assert set(one["initial"]) >= {
        "static_unbalance_kg_m",
        "static_angle_deg",
        "couple_unbalance_kg_m2",
        "couple_angle_deg",
    }
    keys = {"plane", "z_m", "radius_m", "unbalance_kg_m", "mass_kg", "weight_N", "angle_deg"}
    assert all(set(c) == keys for c in one["corrections"])
    assert set(one["residual"]) == {"static_unbalance_kg_m", "couple_unbalance_kg_m2"}
    assert one["tolerance"]["grade"] == "G2.5"
    assert one["tolerance"]["permissible_kg_m"] == pytest.approx(12 * 0.0025 / (100 * math.pi), rel=1e-15)
    assert set(one["tolerance"]["planes"][0]) >= {"plane", "permissible_kg_m", "initial_kg_m", "within"}
    assert one["tolerance"]["planes"][0]["within"] is False


def test_csv_when_piped_table_on_request_json_to_file(
    dalembert: Dalembert, rotor: Path, tmp_path: Path
) -> None:
    piped = dalembert("balance", rotor, *TWO)
    assert piped.stdout.splitlines()[0] == "rotor,plane,z_mm,radius_mm,unbalance_g_mm,mass_kg,angle_deg"
    mass = float(rows(piped.stdout)[0]["mass_kg"])
    assert mass == pytest.approx(7.199575562487884, rel=1e-14)
    table = dalembert("balance", rotor, *TWO, "--text").stdout
    assert "7.19958" in table
    assert "static unbalance           150346" in table
    done = dalembert("balance", rotor, *TWO, "-o", "out.csv")
    assert done.stdout == ""
    assert (tmp_path / "out.csv").read_text() == piped.stdout
    dalembert("balance", rotor, *TWO, "-o", "out.JSON")
    assert json.loads((tmp_path / "out.JSON").read_text())["rotors"][0]["corrections"][0]["mass_kg"] == mass


IN_INCHES = ("--plane", "A:0in:2in", "--plane", "B:4in:2in")


def test_output_units_are_the_input_units(dalembert: Dalembert) -> None:
    inch = "weight_lbf,radius_in,angle_rad,z_in\n2,3,0.5,1\n"
    done = dalembert("balance", "-", *IN_INCHES, stdin=inch)
    assert (
        done.stdout.splitlines()[0]
        == "rotor,plane,z_in,radius_in,unbalance_oz_in,mass_lb,weight_lbf,angle_deg"
    )
    first = rows(done.stdout)[0]
    assert float(first["unbalance_oz_in"]) == pytest.approx(2 * 16 * 3 * 3 / 4, rel=1e-14)
    for column in ("mass_lb", "weight_lbf"):
        assert float(first[column]) == pytest.approx(2 * 3 * 3 / 4 / 2, rel=1e-14)
    assert "W = 2.25 lbf" in dalembert("balance", "-", *IN_INCHES, "--steps", stdin=inch).stdout
    document = answer(dalembert("balance", "-", *IN_INCHES, "--json", stdin=inch))["rotors"][0][
        "corrections"
    ][0]
    assert document["mass_kg"] == pytest.approx(2.25 * 0.45359237, rel=1e-14)
    assert document["weight_N"] == pytest.approx(2.25 * 0.45359237 * 9.80665, rel=1e-14)
    newton = dalembert("balance", "-", "--plane", "A:2mm", stdin="weight_kN,radius_mm,angle_deg\n1,2,30\n")
    assert newton.stdout.splitlines()[0] == "rotor,plane,radius_mm,unbalance_g_mm,mass_kg,weight_kN,angle_deg"
    direct = "unbalance_g_mm,angle_deg\n500,90\n"
    done = dalembert("balance", "-", "--plane", "fan:25mm", stdin=direct)
    assert (
        done.stdout == "rotor,plane,radius_mm,unbalance_g_mm,mass_g,angle_deg\n1,fan,25.0,500.0,20.0,270.0\n"
    )


def test_every_unit_of_mass_gives_the_same_answer(dalembert: Dalembert) -> None:
    grams = {"kg": 1e-3, "g": 1.0, "lb": 1 / 453.59237, "oz": 16 / 453.59237}
    for unit, factor in grams.items():
        done = dalembert(
            "balance",
            "-",
            "--plane",
            "A:1in",
            "--json",
            stdin=f"mass_{unit},radius_m,angle_deg\n{20 * factor!r},0.1,45\n",
        )
        (correction,) = answer(done)["rotors"][0]["corrections"]
        assert correction["mass_kg"] == pytest.approx(0.02 * 0.1 / 0.0254, rel=1e-14)
        assert correction["angle_deg"] == 225


def test_one_plane_is_static_balancing(dalembert: Dalembert, rotor: Path) -> None:
    (one,) = answer(dalembert("balance", rotor, "--plane", "A:20mm", "--json"))["rotors"]
    (correction,) = one["corrections"]
    assert correction["z_m"] is None
    assert correction["mass_kg"] == pytest.approx(
        math.hypot(1.2480762113533160, 0.8382685902179843) / 10 / 0.02, rel=1e-13
    )
    assert one["initial"]["couple_unbalance_kg_m2"] is None
    (one,) = answer(dalembert("balance", rotor, "--plane", "A:20mm", "--center-z", "45mm", "--json"))[
        "rotors"
    ]
    couple = 0.27 * cmath.rect(1, math.pi / 3) * -0.025 + 0.3 * cmath.rect(1, math.radians(210)) * 0.020
    assert one["initial"]["couple_unbalance_kg_m2"] == pytest.approx(abs(couple), rel=1e-13)
    assert one["initial"]["couple_about_z_m"] == 0.045


def test_a_mass_in_a_plane_is_corrected_there_alone(dalembert: Dalembert) -> None:
    table = "mass_g,radius_mm,angle_deg,z_mm\n5,20,90,90\n"
    one, other = answer(dalembert("balance", "-", *TWO, "--json", stdin=table))["rotors"][0]["corrections"]
    assert one["mass_kg"] == 0
    assert one["angle_deg"] == 0
    assert other["mass_kg"] == pytest.approx(0.005, rel=1e-15)
    assert other["angle_deg"] == 270


def test_three_planes_share_by_least_norm(dalembert: Dalembert) -> None:
    table = "unbalance_kg_m,angle_deg,z_m\n6,0,1\n"
    three = ("--plane", "A:0m:1m", "--plane", "B:1m:1m", "--plane", "C:2m:1m")
    one = answer(dalembert("balance", "-", *three, "--json", stdin=table))["rotors"][0]
    assert [c["unbalance_kg_m"] for c in one["corrections"]] == pytest.approx([2, 2, 2], rel=1e-15)
    assert [c["angle_deg"] for c in one["corrections"]] == [180, 180, 180]


def test_many_rotors_are_each_balanced(dalembert: Dalembert) -> None:
    table = "rotor,mass_g,radius_mm,angle_deg,z_mm\n07,1,10,0,10\nNA,2,10,90,20\n07,3,10,45,30\n7,1,10,0,10\n"
    found = rows(dalembert("balance", "-", *TWO, stdin=table).stdout)
    assert [(row["rotor"], row["plane"]) for row in found] == [
        (r, p) for r in ("07", "NA", "7") for p in "AB"
    ]
    for rotor in ("07", "NA", "7"):
        alone = "\n".join(
            line for i, line in enumerate(table.splitlines()) if i == 0 or line.startswith(rotor + ",")
        )
        assert rows(dalembert("balance", "-", *TWO, stdin=alone).stdout) == [
            r for r in found if r["rotor"] == rotor
        ]


def test_remove_is_half_a_turn_away(dalembert: Dalembert, rotor: Path) -> None:
    add = rows(dalembert("balance", rotor, *TWO).stdout)
    remove = rows(dalembert("balance", rotor, *TWO, "--remove").stdout)
    for one, other in zip(add, remove, strict=True):
        assert one["mass_kg"] == other["mass_kg"]
        assert abs(float(one["angle_deg"]) - float(other["angle_deg"])) == pytest.approx(180, abs=1e-12)


@pytest.mark.parametrize("remove", [False, True])
def test_the_residual_is_that_of_the_rounded_corrections(
    remove: bool, dalembert: Dalembert, rotor: Path
) -> None:
    options = [
        "--round-mass",
        "0.1g",
        "--round-angle",
        "5deg",
        "--center-z",
        "30mm",
        *(["--remove"] if remove else []),
    ]
    one = answer(dalembert("balance", rotor, *TWO, "--json", *options))["rotors"][0]
    given = rows(dalembert("balance", rotor, *TWO, *options).stdout)
    assert [row["mass_kg"] for row in given] == ["7.1996", "8.3708"]
    assert [row["angle_deg"] for row in given] == (["75.0", "200.0"] if remove else ["255.0", "20.0"])
    sign = -1 if remove else 1
    vectors = [(0.27, 60, 0.02), (0.3, 210, 0.065)]
    vectors += [
        (sign * float(r["mass_kg"]) * 0.02, float(r["angle_deg"]), float(r["z_mm"]) / 1e3) for r in given
    ]
    terms = [(u * cmath.exp(1j * math.radians(a)), z) for u, a, z in vectors]
    assert one["residual"]["static_unbalance_kg_m"] == pytest.approx(abs(sum(u for u, _ in terms)), rel=1e-12)
    couple = abs(sum(u * (z - 0.03) for u, z in terms))
    assert one["residual"]["couple_unbalance_kg_m2"] == pytest.approx(couple, rel=1e-11)


def test_tolerance_in_the_bearings(dalembert: Dalembert) -> None:
    """The turbine of the annex of ISO 21940-11, with an unbalance in the plane of its centre of mass."""
    table = "unbalance_g_mm,angle_deg,z_mm\n28000,30,1500\n"
    planes = ("--plane", "A:500mm:100mm", "--plane", "B:2000mm:100mm")
    options = ("--grade", "G2.5", "--speed", "3000rpm", "--rotor-mass", "3600kg", "--bearings", "0mm:2400mm")
    one = answer(dalembert("balance", "-", *planes, *options, "--center-z", "1500mm", "--json", stdin=table))[
        "rotors"
    ][0]
    tolerance = one["tolerance"]
    assert tolerance["permissible_kg_m"] == pytest.approx(0.02864788975654116, rel=1e-14)
    shares = [plane["permissible_kg_m"] for plane in tolerance["planes"]]
    assert shares == pytest.approx([0.010742958658702935, 0.017904931097838227], rel=1e-14)
    assert [plane["initial_kg_m"] for plane in tolerance["planes"]] == pytest.approx(
        [0.0105, 0.0175], rel=1e-13
    )
    assert [plane["within"] for plane in tolerance["planes"]] == [True, True]
    halves = answer(dalembert("balance", "-", *planes, *options, "--json", stdin=table))
    assert any("shared equally" in warning for warning in halves["warnings"])
    assert [p["within"] for p in halves["rotors"][0]["tolerance"]["planes"]] == [True, False]
    three = (*planes, "--plane", "C:2200mm:100mm", *options[:-2])
    for more in ((), ("--center-z", "1500mm")):
        third = answer(dalembert("balance", "-", *three, *more, "--json", stdin=table))
        assert any("more than two planes share" in warning for warning in third["warnings"])
        parts = [p["permissible_kg_m"] for p in third["rotors"][0]["tolerance"]["planes"]]
        assert parts == pytest.approx([0.02864788975654116 / 3] * 3, rel=1e-14)


def test_permissible_unbalance_in_place_of_a_grade(dalembert: Dalembert) -> None:
    table = "unbalance_g_mm,angle_deg\n28,30\n"
    for whole, within in (("30g_mm", True), ("20 g_mm", False)):
        done = dalembert("balance", "-", "--plane", "A:25mm", "--permissible", whole, "--json", stdin=table)
        tolerance = answer(done)["rotors"][0]["tolerance"]
        assert tolerance["grade"] is None
        assert tolerance["planes"][0]["within"] is within
        assert tolerance["planes"][0]["residual_within"] is True
    done = dalembert(
        "balance",
        "-",
        "--plane",
        "A:25mm",
        "--grade",
        "G1.7",
        "--speed",
        "50Hz",
        "--rotor-mass",
        "1kg",
        "--json",
        stdin=table,
    )
    assert answer(done)["rotors"][0]["tolerance"]["permissible_kg_m"] == pytest.approx(
        1.7e-3 / (100 * math.pi), rel=1e-14
    )
    assert any("is not a grade of ISO 21940-11" in warning for warning in answer(done)["warnings"])


def test_planes_from_a_table(dalembert: Dalembert, tmp_path: Path) -> None:
    table = "rotor,unbalance_g_mm,angle_deg,z_mm\nx,10,0,5\ny,10,0,5\nx,4,90,8\n"
    (tmp_path / "planes.csv").write_text(
        "rotor,plane,z_mm,radius_mm\ny,L,0,10\nx,1,0,20\ny,R,10,10\nx,2,10,20\nx,3,5,20\n"
    )
    found = rows(dalembert("balance", "-", "--planes", "planes.csv", stdin=table).stdout)
    assert [(r["rotor"], r["plane"]) for r in found] == [
        ("x", "1"),
        ("x", "2"),
        ("x", "3"),
        ("y", "L"),
        ("y", "R"),
    ]
    assert [float(r["mass_g"]) for r in found[3:]] == pytest.approx([0.5, 0.5])
    (tmp_path / "planes.csv").write_text("plane,z_mm,radius_mm\nL,0,10\nR,10,10\n")
    assert len(rows(dalembert("balance", "-", "--planes", "planes.csv", stdin=table).stdout)) == 4


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        (
            "rotor,plane,z_mm,radius_mm\nx,L,0,10\nx,L,5,10\ny,L,0,10\n",
            "row 2 (line 3), column plane: found 'L', expected each plane once for rotor 'x'",
        ),
        ("rotor,plane,z_mm,radius_mm\nx,L,0,10\n", "no plane for rotor 'y'"),
        (
            "rotor,plane,z_mm,radius_mm\nx,L,0,10\ny,L,0,10\nz,L,0,10\n",
            "planes for rotor 'z', which standard input lacks",
        ),
        (
            "rotor,plane,z_mm,radius_mm\nx,L,0,10\ny,L,0,10\ny,R,0,10\n",
            "planes L and R of rotor 'y' lie at the same place",
        ),
        ("plane,z_mm,radius_mm\nL,0,10\nR,10,0\n", "row 2 (line 3), column radius_mm: found '0'"),
        ("plane,radius_mm\nL,10\nR,10\n", "no column z_m"),
        ("z_mm,radius_mm\n1,10\n", "no column plane"),
    ],
)
def test_bad_tables_of_planes(planes: str, message: str, dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "planes.csv").write_text(planes)
    done = dalembert(
        "balance",
        "-",
        "--planes",
        "planes.csv",
        stdin="rotor,unbalance_g_mm,angle_deg,z_mm\nx,1,0,5\ny,1,0,5\n",
    )
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stdout == ""


def test_near_planes_are_warned_of_with_the_growth_of_errors(dalembert: Dalembert, rotor: Path) -> None:
    done = dalembert("balance", rotor, "--plane", "A:0mm:20mm", "--plane", "B:0.1mm:20mm")
    assert done.returncode == 0
    assert "errors grow by a factor of 1.3e+03" in done.stderr


USAGE = [
    ([], "--plane"),
    (["--plane", "A:0mm:20mm", "--plane", "B:0mm:30mm"], "same place"),
    (["--plane", "A:20mm", "--plane", "B:30mm"], "axial position"),
    (["--plane", "A:20"], "no unit"),
    (["--plane", "A:20furlong"], "unknown length unit 'furlong'"),
    (["--plane", "A:0mm"], "positive radius"),
    (["--plane", "20mm"], "expected NAME:Z:RADIUS"),
    (["--plane", "A:0mm:20mm", "--plane", "A:9mm:20mm"], "given twice"),
    (["--plane", "A:20mm", "--planes", "x.csv"], "--planes"),
    (["--plane", "A:20mm", "--grade", "G2.5"], "--speed"),
    (
        ["--plane", "A:20mm", "--grade", "fine", "--speed", "1rpm", "--rotor-mass", "1kg"],
        "no balance quality grade",
    ),
    (["--plane", "A:20mm", "--grade", "G2.5", "--speed", "-1rpm", "--rotor-mass", "1kg"], "positive"),
    (
        ["--plane", "A:20mm", "--grade", "G2.5", "--speed", "1 parsec", "--rotor-mass", "1kg"],
        "unknown speed unit",
    ),
    (["--plane", "A:20mm", "--bearings", "1mm:1mm"], "same place"),
    (["--plane", "A:20mm", "--round-mass", "0g"], "positive"),
    (["--plane", "A:20mm", "--gravity", "0"], "positive"),
    (["--plane", "A:20mm", "-o", "out.xls"], "suffix"),
    (["--plane", "A:20mm", "--plot", "out.gif"], "suffix"),
    (["--plane", "A:20mm", "--frobnicate"], "No such option"),
]


@pytest.mark.parametrize(("options", "message"), USAGE)
def test_wrong_usage_is_status_2(
    options: list[str], message: str, dalembert: Dalembert, rotor: Path, tmp_path: Path
) -> None:
    done = dalembert("balance", rotor, *options)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["rotor.csv"]


def test_the_exercise_check(dalembert: Dalembert, rotor: Path, tmp_path: Path) -> None:
    answers = tmp_path / "answers.csv"
    answers.write_text("plane,mass_kg,angle_deg\nB,8.37,19.7\nA,7.2,-103.2\n")
    done = dalembert("balance", rotor, *TWO, "--expect", "answers.csv")
    assert done.returncode == 0
    assert done.stdout.count("ok") == 4
    answers.write_text("mass_kg,angle_deg\n7.2,76.8\n8.37,\n")
    done = dalembert("balance", rotor, *TWO, "--expect", "answers.csv")
    assert done.returncode == 1
    assert "WRONG" in next(line for line in done.stdout.splitlines() if "1/A  angle_deg" in line)
    assert "2 of 3 values" in done.stdout
    assert dalembert("balance", rotor, *TWO, "--expect", "answers.csv", "--rtol", "4").returncode == 0
    for text, message in (
        ("mass_stone\n7\n", "the result has no column 'mass_stone'"),
        ("plane,mass_kg\nC,7\n", "no (further) row with plane C"),
        ("plane\nA\n", "no expected value"),
        ("mass_kg\n1\n2\n3\n", "expected 2 rows"),
    ):
        answers.write_text(text)
        done = dalembert("balance", rotor, *TWO, "--expect", "answers.csv")
        assert done.returncode == 1
        assert message in done.stderr


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
@pytest.mark.slow
def test_pictures(suffix: str, dalembert: Dalembert, rotor: Path, tmp_path: Path) -> None:
    done = dalembert("balance", rotor, *TWO, "--plot", f"rotor.{suffix}")
    assert done.returncode == 0
    data = (tmp_path / f"rotor.{suffix}").read_bytes()
    assert data.startswith({"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix])
    dalembert("balance", rotor, *TWO, "--plot", f"again.{suffix}")
    assert (tmp_path / f"again.{suffix}").read_bytes() == data
    if suffix == "svg":
        assert {b"plane A", b"plane B", b"correction to add"} <= {
            label for label in (b"plane A", b"plane B", b"correction to add") if label in data
        }


def test_a_file_that_cannot_be_written(dalembert: Dalembert, rotor: Path) -> None:
    done = dalembert("balance", rotor, *TWO, "-o", "no/such/folder/out.csv")
    assert done.returncode == 1
    assert "cannot write" in done.stderr


def test_a_closed_pipe_is_no_fault(rotor: Path) -> None:
    import sys

    command = Path(sys.executable).with_name("dalembert")
    line = f"{command} balance {rotor} {' '.join(TWO)} --json | head -c 1"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert done.stderr == ""


def test_residual_couple_of_a_correction_whose_place_is_not_stated(dalembert: Dalembert) -> None:
    """The plane was taken to lie at z = 0; with its place, 0.27 kg·m at 10 mm and at 30 mm leave 0.0054 kg·m²."""
    table = "mass_kg,radius_mm,angle_deg,z_mm\n9,30,10,10\n"
    asked = ("balance", "-", "--center-z", "20mm", "--json")
    couples = [
        (rotor["initial"]["couple_unbalance_kg_m2"], rotor["residual"]["couple_unbalance_kg_m2"])
        for plane in ("A:20mm", "A:30mm:20mm")
        for rotor in json.loads(dalembert(*asked, "--plane", plane, stdin=table).stdout)["rotors"]
    ]
    assert couples == [(pytest.approx(0.0027), None), (pytest.approx(0.0027), pytest.approx(0.0054))]


@pytest.mark.parametrize("gravity", ["9.81", "9.81m_s2", "9810 mm/s2"])
def test_gravity_takes_a_unit(gravity: str, dalembert: Dalembert) -> None:
    """As other options do: 9.81 N at 10 mm is 1 kg, in `work` too."""
    table = "weight_N,radius_mm,angle_deg\n9.81,10,0\n"
    done = dalembert("balance", "-", "--plane", "A:10mm", "--gravity", gravity, "--json", stdin=table)
    (row,) = json.loads(done.stdout)["rotors"][0]["corrections"]
    assert row["mass_kg"] == pytest.approx(1, rel=1e-15)
    states = "link,mass_kg,vy_m_s,torque_N_m,omega_rad_s\n2,1,1,?,1\n"
    done = dalembert("work", "-", "--gravity", f"0,-{gravity}", "--json", stdin=states)
    (unknown,) = json.loads(done.stdout)["steps"][0]["unknowns"]
    assert unknown["value"] == pytest.approx(9.81, rel=1e-15)


@pytest.mark.parametrize(
    ("angle", "step", "mark"),
    # marks of 7 deg are 0, 7, … 357: 0 is nearer to 359; of 11 deg 0, 11, … 352, and 3 is none of them
    [
        (359, "7deg", 0),
        (358, "7deg", 357),
        (359, "11deg", 0),
        (358, "100deg", 0),
        (354, "11deg", 352),
        (42, "5deg", 40),
    ],
)
def test_angles_are_rounded_to_marks_on_a_circle(
    angle: float, step: str, mark: float, dalembert: Dalembert
) -> None:
    table = f"mass_g,radius_mm,angle_deg\n10,20,{angle - 180}\n"
    done = dalembert("balance", "-", "--plane", "A:20mm", "--round-angle", step, stdin=table)
    assert [float(row["angle_deg"]) for row in rows(done.stdout)] == [mark]
