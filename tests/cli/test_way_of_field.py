"""`field --steps`: vectors of the runs, effects of the trials, coefficients, system and solution hold together."""

from __future__ import annotations

import cmath
import json
import tomllib
from math import radians
from pathlib import Path
from typing import Any

import pytest

from cli.examples import EXAMPLES

FIELD = sorted(f.parent.name for f in EXAMPLES.glob("*/example.toml") if '"dalembert field ' in f.read_text())


def vector(entry: Any, key: str = "amplitude") -> complex:
    return cmath.rect(entry[key], radians(entry["phase_deg"] or 0.0))


def place(entry: Any) -> tuple[Any, Any]:
    return entry["sensor"], entry.get("speed_rad_s")


def mass(entry: Any) -> complex:
    return cmath.rect(
        entry.get("mass_kg", entry.get("unbalance_kg_m", 0.0)), radians(entry["angle_deg"] or 0.0)
    )


@pytest.mark.parametrize("name", FIELD)
def test_every_worked_example_holds_together(name: str, dalembert: Any, tmp_path: Path) -> None:
    for file in (EXAMPLES / name).iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    command = tomllib.loads((EXAMPLES / name / "example.toml").read_text())["command"].split()
    done = dalembert(*command[1:], "--steps", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    topics = {topic["topic"]: topic for topic in document["way"]}
    assert next(iter(topics)) == "vectors"
    assert list(topics)[-3:] == ["coefficients", "system", "solution"]
    runs = {run["run"]: run for run in topics["vectors"]["runs"]}
    for run in runs.values():
        for reading in run["readings"]:
            if reading["x"] is not None:
                assert complex(reading["x"], reading["y"]) == pytest.approx(vector(reading), abs=1e-9)
    for effect in topics.get("effects", {"effects": []})["effects"]:
        v, w = (
            next(r for r in runs[effect[key]]["readings"] if place(r) == place(effect))
            for key in ("run", "against")
        )
        assert vector(effect) == pytest.approx(vector(v) - vector(w), abs=1e-9)
        (on,) = effect["masses"]
        (coefficient,) = (
            c
            for c in topics["coefficients"]["coefficients"]
            if (*place(c), c["plane"]) == (*place(effect), on["plane"])
        )
        # each trial of these examples stands in one plane: α = T/m
        assert complex(coefficient["x"], coefficient["y"]) * mass(on) == pytest.approx(
            vector(effect), abs=1e-9
        )
    system, solution = topics["system"], topics["solution"]
    made = [mass(c) for c in solution["corrections"]]
    assert [c["plane"] for c in solution["corrections"]] == system["planes"]
    for row, right, left in zip(system["matrix"], system["right"], solution["residual"], strict=True):
        total = sum(complex(*a) * w for a, w in zip(row, made, strict=True)) - complex(*right)
        assert total == pytest.approx(complex(left["x"], left["y"]), abs=1e-9 * (1 + abs(complex(*right))))
    for ours, theirs in zip(solution["corrections"], document["rotors"][0]["corrections"], strict=True):
        assert ours["angle_deg"] == pytest.approx(theirs["angle_deg"])


def test_one_plane_by_hand(dalembert: Any, tmp_path: Path) -> None:
    """2 g at 0° turn 4 ∠ 0° into 4 ∠ 90°: T = 4√2 ∠ 135°; w = −V0/α = 2/√2 g at 45°."""
    (tmp_path / "r.csv").write_text(
        "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n1,A,4,0,,,\n2,A,4,90,P,2,0\n"
    )
    text = dalembert("field", "r.csv", "--steps").stdout
    assert "A: (0, 4) − (4, 0) = 5.65685 ∠ 135° = (−4, 4)" in text.replace("2.44929e−16", "0")
    assert "w_P = 1.41421 g ∠ 45°" in text


def test_several_rotors_are_told_apart(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text(
        "rotor,run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
        "a,1,A,4,0,,,\na,2,A,4,90,P,2,0\nb,1,A,3,0,,,\nb,2,A,4,90,P,2,0\n"
    )
    topics = json.loads(dalembert("field", "r.csv", "--steps", "--json").stdout)["way"]
    assert {topic["rotor"] for topic in topics} == {"a", "b"}
