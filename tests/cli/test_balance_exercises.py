"""Kinds of exercise: the mass is given and the radius or the angle sought; the forces in the bearings of a rotor's table."""

from __future__ import annotations

import json
from math import hypot, pi
from pathlib import Path
from typing import Any

import pytest


def rotor(run: Any, *words: str) -> Any:
    done = run("balance", "r.csv", *words, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    return document["rotors"][0], document["warnings"]


@pytest.fixture
def one(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("mass_kg,radius_mm,angle_deg,z_mm\n2,30,10,50\n")


@pytest.fixture
def riul(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("weight_N,radius_mm,angle_deg,z_mm\n90,30,60,20\n60,50,210,65\n")


@pytest.mark.usefixtures("one")
def test_the_radius_of_a_given_mass(dalembert: Any) -> None:
    """2 kg at 30 mm is balanced by 3 kg at 20 mm, opposite."""
    found, warnings = rotor(dalembert, "--plane", "P:?", "--mass", "P:3kg")
    (c,) = found["corrections"]
    assert (c["radius_m"], c["mass_kg"]) == (pytest.approx(0.02), pytest.approx(3.0))
    assert c["angle_deg"] == pytest.approx(190.0)
    assert found["residual"]["static_unbalance_kg_m"] == pytest.approx(0, abs=1e-15)
    assert not warnings


@pytest.mark.usefixtures("riul")
def test_riuls_rotor_with_4_kg_in_plane_b(dalembert: Any) -> None:
    """W_B·r_B = 1674.15 N·mm: 4 kg at 41.85 mm; plane A as it was, 7.1996 kg at 256.8°."""
    words = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:?", "--mass", "B:4kg", "--gravity", "10")
    a, b = rotor(dalembert, *words)[0]["corrections"]
    assert b["radius_m"] == pytest.approx(0.0418538, abs=1e-7)
    assert b["mass_kg"] * b["radius_m"] == pytest.approx(b["unbalance_kg_m"])
    assert (a["mass_kg"], a["angle_deg"]) == (
        pytest.approx(7.1996, abs=5e-5),
        pytest.approx(256.82, abs=5e-3),
    )
    text = dalembert("balance", "r.csv", *words, "--steps").stdout
    assert "at r = 41.8538 mm: W = 40 N" in text


@pytest.mark.usefixtures("one")
def test_mass_and_radius_given_leave_the_angle(dalembert: Any) -> None:
    found, warnings = rotor(dalembert, "--plane", "P:20mm", "--mass", "P:1kg")
    (c,) = found["corrections"]
    assert (c["mass_kg"], c["radius_m"], c["angle_deg"]) == (1.0, 0.02, pytest.approx(190.0))
    assert found["residual"]["static_unbalance_kg_m"] == pytest.approx(0.06 - 0.02)
    assert "only the angle is computed" in warnings[0]


@pytest.mark.usefixtures("one")
def test_what_cannot_be_sought(dalembert: Any) -> None:
    for words, text in (
        (("--plane", "P:?"), "expected --mass P:MASS too"),
        (("--plane", "P:20mm", "--mass", "Q:1kg"), "one of the planes P"),
        (("--plane", "P:20mm", "--mass", "P:0kg"), "positive"),
        (("--plane", "P:20mm", "--mass", "P:1kg", "--mass", "P:2kg"), "given twice"),
        (("--plane", "P:20mm", "--bearings", "0mm:100mm", "--speed", "100rad_s"), "place of the plane"),
    ):
        done = dalembert("balance", "r.csv", *words)
        assert done.returncode == 2
        assert text in " ".join(done.stderr.split())


@pytest.mark.usefixtures("one")
def test_forces_in_the_bearings_of_a_mass_midway(dalembert: Any) -> None:
    """m·r·ω²/2 in each, towards the axis; the weight's half in each; nothing once it is balanced in two planes."""
    words = (
        "--plane",
        "A:0mm:20mm",
        "--plane",
        "B:100mm:20mm",
        "--bearings",
        "0mm:100mm",
        "--speed",
        "100rad_s",
    )
    found, warnings = rotor(dalembert, *words, "--rotor-mass", "8kg", "--center-z", "50mm", "--gravity", "10")
    for k, bearing in enumerate(found["bearings"]):
        assert bearing["z_m"] == (0.0, 0.1)[k]
        assert (
            hypot(*bearing["dynamic_N"]) == pytest.approx(2 * 0.03 * 100**2 / 2) == bearing["dynamic_size_N"]
        )
        assert bearing["dynamic_N"][0] < 0
        assert bearing["static_N"] == pytest.approx([0, 40])
        assert bearing["corrected_N"] == [0, 0]
    assert not warnings


@pytest.mark.usefixtures("riul")
def test_forces_in_the_bearings_are_those_of_the_shaft(dalembert: Any, tmp_path: Path) -> None:
    """The same masses as points of `body --shaft` ask for the same forces."""
    words = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm", "--gravity", "10")
    found, _ = rotor(dalembert, *words, "--bearings=-10mm:100mm", "--speed", "3000rpm")
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,x_mm,y_mm,z_mm\na,point,9,15,25.98076211353316,20\nb,point,6,-43.30127018922193,-25,65\n"
    )
    done = dalembert("body", "p.csv", "--shaft=-10mm:100mm", "--speed", "3000rpm", "--json")
    for ours, theirs in zip(found["bearings"], json.loads(done.stdout)["shaft"]["bearings"], strict=True):
        assert ours["dynamic_N"] == pytest.approx(theirs["dynamic_N"], rel=1e-9)
        assert "static_N" not in ours
    assert sum(b["dynamic_N"][0] for b in found["bearings"]) == pytest.approx(
        0.1248076 * (100 * pi) ** 2, rel=1e-5
    )


@pytest.mark.parametrize("radius", ["20mm", "?"])
def test_a_mass_that_is_given_is_not_rounded(radius: str, dalembert: Any, tmp_path: Path) -> None:
    table = "mass_kg,radius_mm,angle_deg\n1,60,30\n"
    options = ("--plane", f"A:{radius}", "--mass", "A:2.4kg", "--round-mass", "1kg")
    (tmp_path / "r.csv").write_text(table)
    one, _ = rotor(dalembert, *options)
    (fix,) = one["corrections"]
    assert fix["mass_kg"] == 2.4
    left = 0.0 if radius == "?" else 0.060 - 2.4 * 0.020
    assert fix["radius_m"] == pytest.approx(0.060 / 2.4 if radius == "?" else 0.020, rel=1e-15)
    assert abs(one["residual"]["static_unbalance_kg_m"] - left) <= 1e-15 * 0.060


@pytest.mark.parametrize("planes", [("A:20mm",), ("A:0mm:20mm", "B:90mm:20mm")])
def test_equal_masses_evenly_around_need_no_correction(
    planes: tuple[str, ...], dalembert: Any, tmp_path: Path
) -> None:
    """A rounding of sin 120° gave 9e-17 kg at 180°."""
    table = "mass_kg,radius_mm,angle_deg,z_mm\n1,10,0,10\n1,10,120,10\n1,10,240,10\n"
    options = [word for plane in planes for word in ("--plane", plane)]
    (tmp_path / "r.csv").write_text(table)
    one, _ = rotor(dalembert, *options)
    assert all((fix["mass_kg"], fix["angle_deg"]) == (0.0, 0.0) for fix in one["corrections"])
    assert one["initial"]["static_unbalance_kg_m"] == one["initial"]["static_angle_deg"] == 0.0
    assert one["residual"]["static_unbalance_kg_m"] == 0.0
    assert one["initial"]["couple_unbalance_kg_m2"] == one["residual"]["couple_unbalance_kg_m2"]
    assert one["residual"]["couple_unbalance_kg_m2"] in (None, 0.0)
    way = json.loads(dalembert("balance", "r.csv", *options, "--steps", "--json").stdout)["way"]
    assert set(way[0]["sum"].values()) <= {0.0, None}
