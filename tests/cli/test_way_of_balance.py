"""`balance --steps`: components and their sums, moments about a plane, forces, the quadrant (Riul, eqs. 6 to 21)."""

from __future__ import annotations

import json
import re
from math import atan2, cos, degrees, hypot, radians, sin
from pathlib import Path
from random import Random
from typing import Any

import pytest

from cli.balance.way import quadrant

RIUL = "name,weight_N,radius_mm,angle_deg,z_mm\nW1,90,30,60,20\nW2,60,50,210,65\n"
PLANES = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")


def way(run: Any, *words: str) -> Any:
    done = run("balance", *words, "--steps", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_riuls_example_2_has_every_number_that_it_prints(dalembert: Any, tmp_path: Path) -> None:
    """(1.b) to (1.n): −1248.1, 838.3, 1576.4, 563.7, −328.3, −1402 N·mm; 83.7 N at 19.7°, 72 N at 256.8°."""
    (tmp_path / "r.csv").write_text(RIUL)
    whole = way(dalembert, "r.csv", *PLANES, "--gravity", "10")
    components, b, a = whole["way"]
    assert [t["topic"] for t in whole["way"]] == ["components", "plane B", "plane A"]
    in_n_mm = 10 * 1000
    assert components["about_z_m"] == 0
    assert components["sum"]["x_kg_m"] * in_n_mm == pytest.approx(-1248.1, abs=0.05)
    assert components["sum"]["y_kg_m"] * in_n_mm == pytest.approx(838.3, abs=0.05)
    assert [b["x_kg_m"] * in_n_mm, b["y_kg_m"] * in_n_mm] == pytest.approx([1576.4, 563.7], abs=0.05)
    assert [a["x_kg_m"] * in_n_mm, a["y_kg_m"] * in_n_mm] == pytest.approx([-328.3, -1402], abs=0.05)
    assert (b["quadrant"], a["quadrant"]) == (1, 3)
    assert [b["angle_deg"], a["angle_deg"]] == pytest.approx([19.7, 256.8], abs=0.05)
    text = dalembert("balance", "r.csv", *PLANES, "--gravity", "10", "--steps").stdout
    for line in (
        "= 1 576.39 N·mm",
        "= 563.718 N·mm",
        "d1 = −(1 576.39",
        "quadrant 3, θ = 256.82°",
        "W = 83.7075 N",
    ):
        assert line in text


def check(topics: Any, rotor: Any) -> None:
    """The identities of one rotor: rows add up, planes balance forces and moments, quadrants are those of angles."""
    components, *planes = topics
    rows, total, about = components["rows"], components["sum"], components["about_z_m"]
    size = sum(row["unbalance_kg_m"] for row in rows) or 1.0
    for row in rows:
        u, t = row["unbalance_kg_m"], radians(row["angle_deg"])
        assert [row["x_kg_m"], row["y_kg_m"]] == pytest.approx([u * cos(t), u * sin(t)], abs=1e-12 * size)
        if about is not None:
            moments = [(row["z_m"] - about) * row[f"{c}_kg_m"] for c in "xy"]
            assert [row["zx_kg_m2"], row["zy_kg_m2"]] == pytest.approx(moments, abs=1e-12 * size)
    for key, value in total.items():
        if value is not None:
            assert value == pytest.approx(sum(row[key] for row in rows), abs=1e-12 * size)
    made = {c["plane"]: c for c in rotor["corrections"]}
    for c in "xy":
        force = total[f"{c}_kg_m"] + sum(p[f"{c}_kg_m"] for p in planes)
        assert abs(force) < 1e-11 * size
        if about is not None:
            moment = total[f"z{c}_kg_m2"] + sum(
                (made[p["topic"].removeprefix("plane ")]["z_m"] - about) * p[f"{c}_kg_m"] for p in planes
            )
            assert abs(moment) < 1e-10 * size or len(planes) == 1
    for p in planes:
        its = made[p["topic"].removeprefix("plane ")]
        x, y = p["x_kg_m"], p["y_kg_m"]
        assert hypot(x, y) == pytest.approx(its["unbalance_kg_m"], abs=1e-12 * size)
        if p["quadrant"] is not None and hypot(x, y) > 1e-9 * size:
            assert (degrees(atan2(y, x)) - its["angle_deg"] + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)
            assert p["quadrant"] == quadrant(x, y)


def test_one_mass_in_one_plane_and_its_mirror_images(dalembert: Any, tmp_path: Path) -> None:
    for angle, expected in ((10, 3), (100, 4), (190, 1), (280, 2)):
        (tmp_path / "r.csv").write_text(f"mass_kg,radius_mm,angle_deg\n2,30,{angle}\n")
        whole = way(dalembert, "r.csv", "--plane", "P:60mm")
        assert [t["topic"] for t in whole["way"]] == ["components", "plane P"]
        assert whole["way"][1]["quadrant"] == expected
        assert whole["way"][0]["sum"]["zx_kg_m2"] is None
        check(whole["way"], whole["rotors"][0])


@pytest.mark.parametrize(
    ("angle", "text"),
    [
        (0, "x < 0, y = 0: along −x, θ = 180°"),
        (90, "x = 0, y < 0: along −y, θ = 270°"),
        (180, "x > 0, y = 0: along x, θ = 0°"),
        (270, "x = 0, y > 0: along y, θ = 90°"),
        (10, "tan θ = y/x; x < 0, y < 0: quadrant 3, θ = 190°"),
    ],
)
def test_on_an_axis_there_is_no_quadrant(dalembert: Any, tmp_path: Path, angle: int, text: str) -> None:
    (tmp_path / "r.csv").write_text(f"mass_kg,radius_mm,angle_deg\n2,30,{angle}\n")
    done = dalembert("balance", "r.csv", "--plane", "P:60mm", "--steps", "--text")
    assert done.stdout.splitlines()[-1].strip() == text


def test_levers_below_zero_stand_in_brackets(dalembert: Any, tmp_path: Path) -> None:
    """Two signs beside each other are none of a formula; a component that is zero has none."""
    (tmp_path / "r.csv").write_text("mass_kg,radius_mm,angle_deg,z_mm\n1,10,90,20\n2,30,0,-40\n")
    done = dalembert("balance", "r.csv", *PLANES, "--steps", "--text")
    assert "20·0 + (−40)·60 000" in done.stdout
    assert "+ −" not in done.stdout
    assert re.search(r"(?m) -0( |$)", done.stdout) is None


def test_many_rotors_and_planes(dalembert: Any, tmp_path: Path) -> None:
    random = Random(4)
    lines = ["rotor,name,mass_g,radius_mm,angle_deg,z_mm"]
    for rotor in range(5):
        lines += [
            f"{rotor},m{k},{random.uniform(0, 50):.3f},40,{random.uniform(0, 360):.2f},{random.uniform(-50, 200):.1f}"
            for k in range(random.randint(1, 6))
        ]
    (tmp_path / "r.csv").write_text("\n".join(lines) + "\n")
    for planes in (
        PLANES,
        ("--plane", "B:90mm:20mm", "--plane", "A:-5mm:20mm"),
        (*PLANES, "--plane", "C:50mm:30mm"),
    ):
        whole = way(dalembert, "r.csv", *planes)
        for rotor in whole["rotors"]:
            topics = [t for t in whole["way"] if t["rotor"] == rotor["rotor"]]
            assert len(topics) == 1 + len(planes) // 2
            check(topics, rotor)


@pytest.mark.slow
def test_the_polygons_are_in_the_picture_and_in_the_report(dalembert: Any, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "r.csv").write_text(RIUL)
    done = dalembert("balance", "r.csv", *PLANES, "--steps", "--plot", "p.svg", "--report", "r.html")
    assert done.returncode == 0, done.stderr
    plain = dalembert("balance", "r.csv", *PLANES, "--plot", "q.svg")
    assert plain.returncode == 0
    counts = [
        (tmp_path / file).read_text().count("<!-- moments about plane A")
        for file in ("p.svg", "r.html", "q.svg")
    ]
    assert counts == [1, 1, 0]
