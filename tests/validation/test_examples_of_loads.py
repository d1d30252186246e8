"""The worked examples with friction, torques, torsion springs, motors and dampers against their closed forms."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Callable
from math import cos, pi, radians, sin
from pathlib import Path

import pytest

from cli.examples import EXAMPLES, describe, names
from tests.conftest import Dalembert
from virtualwork.describe.keys import table_keys
from virtualwork.describe.parts import TABLES

G = 9.81


def door(row: dict[str, str]) -> dict[str, float]:
    """Spring, oil, draught, and the door's own inertia."""
    spring = 12 * radians(float(row["input_deg"]) + 40)
    return {"input_torque_N_m": spring + 18 * 0.5 + 3 + (5.75 + 85 * 0.45**2) * 0.2}


def arm(row: dict[str, str]) -> dict[str, float]:
    """Weights; the motor's with the upper arm, its torque between the two."""
    one, two = (radians(float(row[f"{name}_input_deg"])) for name in ("upper", "fore"))
    elbow = 2.5 * G * 0.2 * cos(one + two)
    shoulder = elbow + G * cos(one) * (4 * 0.25 + 1.8 * 0.56 + 2.5 * 0.6)
    return {"upper_input_torque_N_m": shoulder, "fore_input_torque_N_m": elbow}


def sledge(row: dict[str, str]) -> dict[str, float]:
    """Weight and friction along the incline, spring, damper, the child that pulls; what acts on the runners."""
    x = float(row["input_m"])
    across, along = 60 * G * cos(pi / 6), 0.2 * 60 * G * cos(pi / 6)
    return {
        "input_force_N": 60 * G * sin(pi / 6) + along + 150 * (x + 0.4 - 0.6) + 40 * 0.8 - 20,
        "B_ground_on_sledge_fx_N": -across * sin(pi / 6) - along * cos(pi / 6),
        "B_ground_on_sledge_fy_N": across * cos(pi / 6) - along * sin(pi / 6),
    }


def grindstone(row: dict[str, str]) -> dict[str, float]:
    """The circle of friction, μ·r·N, and the blade."""
    moment = 0.1 * 0.015 * 40 * G
    return {"input_torque_N_m": moment + 2.5, "O_ground_on_stone_moment_N_m": -moment}


@pytest.mark.parametrize(
    ("name", "expected"),
    [("door-closer", door), ("robot-arm", arm), ("sledge", sledge), ("grindstone", grindstone)],
)
def test_closed_form(
    name: str, expected: Callable[[dict[str, str]], dict[str, float]], dalembert: Dalembert, tmp_path: Path
) -> None:
    words = describe(name)["command"].split()[1:]
    assert dalembert("examples", name).returncode == 0
    rows = list(csv.DictReader(dalembert(*words).stdout.splitlines()))
    assert len(rows) >= 4
    for row in rows:
        for column, value in expected(row).items():
            assert float(row[column]) == pytest.approx(value, rel=1e-12, abs=1e-12)
    # what is shipped says the same
    with (tmp_path / "expected.csv").open() as stream:
        shipped = list(csv.DictReader(stream))
    assert len(shipped) == len(rows)
    for row in shipped:
        for column, value in expected(row).items():
            assert float(row[column]) == pytest.approx(value, rel=1e-9, abs=1e-9)
    checked = dalembert(*words, "--expect", "expected.csv", "--rtol", "1e-9")
    assert checked.returncode == 0, checked.stdout


def test_every_load_stands_in_an_example() -> None:
    used: set[str] = set()
    for name in names():
        for file in EXAMPLES.joinpath(name).iterdir():
            if file.name.endswith(".toml") and file.name != "example.toml":
                document = tomllib.loads(file.read_text(encoding="utf-8"))
                for table in TABLES:
                    entries = document.get(table, [])
                    keys = [entries] if isinstance(entries, dict) else entries
                    used |= {f"{table}.{key}" for entry in keys for key in entry}
    loads = ("forces", "torques", "springs", "torsion_springs", "motors", "friction")
    missed = {f"{table}.{key}" for table in loads for key in table_keys(TABLES[table], table)} - used
    assert not missed
