"""`--steps` of all other commands: every worked example has a way, and the simplest cases add up."""

from __future__ import annotations

import json
import shlex
import tomllib
from math import cos, hypot, pi, radians, sin
from pathlib import Path
from typing import Any

import pytest

from cli.examples import EXAMPLES

OTHERS = (
    "place",
    "engine",
    "flywheel",
    "index",
    "spin",
    "trial",
    "signal",
    "equilibrium",
    "inspect",
    "fit",
    "simulate",
    "tolerance",
)
CALLS = {
    f.parent.name: shlex.split(tomllib.loads(f.read_text())["command"])
    for f in sorted(EXAMPLES.glob("*/example.toml"))
    if shlex.split(tomllib.loads(f.read_text())["command"])[1] in OTHERS
}


@pytest.mark.parametrize("name", list(CALLS))
def test_every_worked_example_has_a_way(name: str, dalembert: Any, tmp_path: Path) -> None:
    for file in (EXAMPLES / name).iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    words, skip = [], False
    for word in CALLS[name][1:]:
        skip = word == "--plot"
        if (
            not skip
            and not (words and words[-1] == "--plot")
            and word != "--text"
            and not word.endswith(".png")
        ):
            words.append(word)
    done = dalembert(*words, "--steps", "--json")
    assert done.returncode == 0, done.stderr
    way = json.loads(done.stdout)["way"]
    assert way
    assert all(topic["topic"] for topic in way)
    text = dalembert(*words, "--steps")
    assert text.returncode == 0
    assert "nan" not in text.stdout.lower().replace("finance", "")


def topics(run: Any, *words: str) -> dict[str, Any]:
    done = run(*words, "--steps", "--json")
    assert done.returncode == 0, done.stderr
    return {topic["topic"]: topic for topic in json.loads(done.stdout)["way"]}


def test_two_blades_carry_a_mass_between_them(dalembert: Any) -> None:
    way = topics(dalembert, "place", "10g@45deg", "--positions", "0deg,90deg")
    masses = way["places"]["masses"]
    for k, axis in ((0, cos), (1, sin)):
        total = sum(m["mass_kg"] * axis(radians(m["angle_deg"])) for m in masses)
        assert total == pytest.approx(way["places"]["wanted_kg"][k]) == pytest.approx(0.01 * cos(pi / 4))


def test_a_trial_mass_by_hand(dalembert: Any) -> None:
    """100 kg in two planes, 1500 rpm, 200 mm: 9.94 g."""
    call = ("trial", "--rotor-mass", "100kg", "--speed", "1500rpm", "--radius", "200mm", "--planes", "2")
    (trial,) = topics(dalembert, *call).values()
    assert trial["mass_kg"] == pytest.approx(9.94e-3, abs=5e-6)
    assert trial["force_N"] == pytest.approx(0.1 * trial["static_load_N"])


def test_a_torque_that_falls_stores_a_quarter_of_its_work(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("angle_deg,torque_N_m\n0,20\n360,0\n")
    way = topics(dalembert, "flywheel", "t.csv", "--speed", "50rad_s", "--fluctuation", "0.02")
    assert way["mean torque"]["mean_torque_N_m"] == pytest.approx(10)
    assert way["energy"]["energy_fluctuation_J"] == pytest.approx(5 * pi)
    assert way["inertia"]["flywheel_inertia_kg_m2"] == pytest.approx(0.314159, rel=1e-6)


def test_even_positions_have_no_mean(dalembert: Any, tmp_path: Path) -> None:
    """Four quarter turns add up to nothing, without rounding; a unit is written as people write it."""
    (tmp_path / "i.csv").write_text(
        "turned_deg,amplitude_mm_s,phase_deg\n0,5,0\n90,3,10\n180,1,0\n270,2,200\n"
    )
    done = dalembert("index", "i.csv", "--steps", "--text")
    assert "ē = (0, 0), D = 4" in done.stdout
    dalembert("examples", "fan-signal")
    done = dalembert("signal", "recording.csv", "--steps", "--text")
    assert "= 3.4 ∠ 116° mm/s\n" in done.stdout


def test_half_the_sum_and_half_the_difference(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "i.csv").write_text("turned_deg,unbalance_g_mm,angle_deg\n0,5,0\n180,1,0\n")
    way = topics(dalembert, "index", "i.csv")
    assert way["parts"]["rotor_kg_m"] == pytest.approx([2e-6, 0], abs=1e-18)
    assert way["parts"]["mandrel_kg_m"] == pytest.approx([3e-6, 0], abs=1e-18)
    assert [row["unbalance_kg_m"] for row in way["vectors"]["readings"]] == [5e-6, 1e-6]


def test_the_shares_of_cylinders_add_up(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(
        "cylinder,crank_deg,bank_deg,z_mm,throw_mm,rod_mm,reciprocating_kg\n1,0,90,0,40,140,0.5\n2,180,90,80,40,140,0.5\n"
    )
    shares = topics(dalembert, "engine", "c.csv", "--speed", "3000rpm")["forces"]["shares"]
    orders = {row["order"] for row in shares}
    for order in orders:
        for key in ("x_cos_N", "x_sin_N", "y_cos_N", "y_sin_N"):
            each = [row[key] for row in shares if row["order"] == order and row["cylinder"] != "sum"]
            (total,) = [row[key] for row in shares if row["order"] == order and row["cylinder"] == "sum"]
            assert total == pytest.approx(sum(each), abs=1e-6 * hypot(*each, 1.0))
    first = next(row for row in shares if row["cylinder"] == "1" and row["order"] == 1)
    assert first["y_sin_N"] == pytest.approx(0.5 * 0.04 * (100 * pi) ** 2)


ARM = (
    "gravity = [0, -10]\n[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], P = [1, 0] }\nmass = 2\ncenter = [0.5, 0]\n"
    'inertia = 0.1\n[input]\nlink = "arm"\nangle = 0\n[tolerances]\n"links.arm.P.x" = "3 mm"\n'
)


def test_a_pendulum_rests_where_its_weight_does_no_work(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(ARM)
    way = topics(dalembert, "equilibrium", "arm.toml")
    assert way["condition"]["positions"] == 2
    for pose in way["ledger"]["poses"]:
        assert pose["input_deg"] in (pytest.approx(90), pytest.approx(270))
        (weight,) = pose["terms"]
        assert (weight["kind"], weight["power_W"]) == ("weight", pytest.approx(0, abs=1e-12))


def test_a_pendulum_begins_with_its_angular_acceleration(dalembert: Any, tmp_path: Path) -> None:
    """q̈ = −m·g·s/(I + m·s²) = −10/0.6; its energy stays."""
    (tmp_path / "arm.toml").write_text(ARM)
    way = topics(dalembert, "simulate", "arm.toml", "--time", "0:1:0.5")
    assert way["start"]["acceleration"] == pytest.approx([-10 / 0.6])
    assert way["energy"]["start_J"] == pytest.approx(way["energy"]["end_J"], abs=1e-6)


def test_a_length_carries_its_tolerance_to_the_tip(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(ARM)
    way = topics(dalembert, "tolerance", "arm.toml", "--only", "P.x")
    (term,) = way["terms"]["terms"]
    assert (term["slope"], term["term"], term["share"]) == (1.0, pytest.approx(0.003), 1.0)
    (total,) = way["terms"]["sums"]
    assert (total["worst"], total["sd"]) == (pytest.approx(0.003), pytest.approx(0.001))


def test_a_four_bar_has_one_degree_of_freedom(dalembert: Any, tmp_path: Path) -> None:
    for file in (EXAMPLES / "klann").iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    way = topics(dalembert, "inspect", "klann.toml")
    # five links, seven pins
    assert way["mobility"] == {
        "topic": "mobility", "links": 5, "pins_and_slots": 14, "sliders_and_gears": 0, "mobility": 1,
    }  # fmt: skip
