"""J. A. Riul, Dinâmica das Máquinas, unit II, example 1: every term, and the two slips of its printed result."""

from __future__ import annotations

import json

import pytest

from tests.conftest import Dalembert

# eq. (1.a)-(1.g) with the printed data; the inertia torque is −0.1·(−800) = +80, and +80·(−50) = −4 000
POWERS = {
    ("4", "applied force"): -2_500_000.0,
    ("3", "weight"): -6_000.0,
    ("4", "inertia force"): 900_000.0,
    ("3", "inertia force"): -450_000.0,
    ("3", "inertia torque"): -4_000.0,
    ("2", "unknown"): 2_060_000.0,
}


def test_example_1(dalembert: Dalembert) -> None:
    dalembert("examples", "riul-slider-crank")
    done = dalembert("work", "states.csv", "--gravity", "0,-10", "--json")
    assert done.returncode == 0
    (step,) = json.loads(done.stdout)["steps"]
    assert step["unknowns"] == [
        {"link": "2", "quantity": "torque_N_m", "value": pytest.approx(103_000.0, rel=1e-15)}
    ]
    assert {(term["link"], term["kind"]): term["power_W"] for term in step["terms"]} == pytest.approx(
        POWERS, rel=1e-15
    )
    assert step["sum_W"] == 0.0
    # W4, W2, FI2 and TI2 do no work: those that are not zero are listed apart
    assert step["workless"] == ["2: weight", "4: weight"]
    assert dalembert("work", "states.csv", "--gravity", "0,-10", "--expect", "expected.csv").returncode == 0


def test_the_printed_result_comes_from_two_slips() -> None:
    force, weight, inertia_4, inertia_3, torque_3 = (
        POWERS[key]
        for key in (
            ("4", "applied force"),
            ("3", "weight"),
            ("4", "inertia force"),
            ("3", "inertia force"),
            ("3", "inertia torque"),
        )
    )
    # −450 000 taken for −45 000, and the inertia torque's power with the wrong sign
    printed = -(force + weight + inertia_4 + inertia_3 / 10 - torque_3) / 20
    assert printed == 82_350.0
    assert -(force + weight + inertia_4 + inertia_3 + torque_3) / 20 == 103_000.0
