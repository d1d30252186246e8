"""The tolerance of `dalembert field` speaks of the rotor, whatever is asked of the corrections."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import Dalembert

HEAD = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg,trial_kept\n"
TOLERANCE = ["--grade", "G6.3", "--speed", "2960rpm", "--rotor-mass", "85kg", "--radius", "200mm"]
ALPHA = np.array([[3 + 1j, 1 - 1j], [1 + 1j, 2 + 2j], [1 + 0j, 1j]])
UNBALANCE = np.array([22 * np.exp(0.5j), 31 * np.exp(2j)])  # g at 200 mm: 4400 and 6200 g·mm


def table(alpha: Any, unbalance: Any = UNBALANCE, trial: float = 20.0, kept: str = "") -> str:
    """An initial run, and a trial run for each plane, read without error."""
    alpha = np.asarray(alpha)
    loads = [("", np.zeros(alpha.shape[1], dtype=complex))]
    for p in range(alpha.shape[1]):
        before = loads[-1][1] if kept else 0
        loads.append((f"{'ABC'[p]},{trial},0,{kept}", before + trial * np.eye(alpha.shape[1])[p]))
    rows = []
    for run, (cells, mass) in enumerate(loads):
        for sensor, v in enumerate(alpha @ (np.asarray(unbalance) + mass)):
            size, turn = float(abs(v)), float(np.degrees(np.angle(v)))
            rows.append(f"{run},{sensor},{size!r},{turn!r},{cells or ',,,'}")
    return HEAD + "\n".join(rows) + "\n"


def planes(done: subprocess.CompletedProcess[str]) -> tuple[list[Any], list[Any], list[str]]:
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    given = found["rotors"][0]["tolerance"]["planes"]
    return [p["initial_kg_m"] for p in given], [p["within"] for p in given], found["warnings"]


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--max-mass", "4g"),
        ("--max-mass", "A=4g"),
        ("--ridge", "2"),
        ("--objective", "minimax", "--max-mass", "4g"),
        ("--max-residual", "60um"),
        ("--from-here",),
    ],
)
def test_the_initial_unbalance_is_the_rotors_own(options: tuple[str, ...], dalembert: Dalembert) -> None:
    initial, within, warnings = planes(
        dalembert("field", "-", "--json", *TOLERANCE, *options, stdin=table(ALPHA))
    )
    assert initial == pytest.approx([4.4e-3, 6.2e-3], rel=1e-12)
    assert within == [False, False]
    assert not any("stop" in w for w in warnings)


def test_text_and_report_say_the_same(dalembert: Dalembert, tmp_path: Path) -> None:
    options = ["--max-mass", "4g", "--report", "report.html", "--text"]
    done = dalembert("field", "-", *TOLERANCE, *options, stdin=table(ALPHA))
    assert done.returncode == 0, done.stderr
    for plane, size in (("A", 4400), ("B", 6200)):
        assert re.search(rf"{plane} .* {size} .*beyond", done.stdout)
    page = (tmp_path / "report.html").read_text()
    assert ">4400</td>" in page
    assert ">6200</td>" in page
    assert "stop" not in done.stderr


def test_a_good_rotor_is_left_alone(dalembert: Dalembert) -> None:
    small = UNBALANCE / 20
    for options in ((), ("--ridge", "2"), ("--max-mass", "4g")):
        initial, within, warnings = planes(
            dalembert("field", "-", "--json", *TOLERANCE, *options, stdin=table(ALPHA, small))
        )
        assert initial == pytest.approx([2.2e-4, 3.1e-4], rel=1e-10)
        assert within == [True, True]
        assert any("stop" in w for w in warnings)


def test_kept_trial_masses_are_no_reason_to_stop(dalembert: Dalembert) -> None:
    text = table(ALPHA, UNBALANCE / 20, kept="yes")
    initial, within, warnings = planes(
        dalembert("field", "-", "--json", *TOLERANCE, "--from-here", stdin=text)
    )
    assert initial == pytest.approx([2.2e-4, 3.1e-4], rel=1e-10)
    assert within == [True, True]
    assert not any("stop" in w for w in warnings)


@pytest.mark.parametrize(
    ("alpha", "known", "why"),
    [
        # B does what A does: only C is determined
        ([[1, 2, 0], [2, 4, 0], [1j, 2j, 0], [0, 0, 1]], [None, None, 2e-3], "cannot distinguish them"),
        # two sensors for three planes
        ([[1, 2, 1], [2, 1, 1j]], [None, None, None], "2 readings for 3 planes"),
    ],
)
def test_an_unbalance_that_the_readings_do_not_determine(
    alpha: Any, known: list[Any], why: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    text = table(alpha, [30, 20j, -10])
    options = [*TOLERANCE, "--max-mass", "4g"]
    initial, within, warnings = planes(dalembert("field", "-", "--json", *options, stdin=text))
    assert initial == [None if u is None else pytest.approx(u, rel=1e-9) for u in known]
    assert within == [None if u is None else False for u in known]
    assert any("not determined" in w and why in w for w in warnings)
    assert not any("stop" in w for w in warnings)
    done = dalembert("field", "-", "--text", *options, "--report", "r.html", stdin=text)
    assert "not determined" in done.stdout
    assert ">not determined</td>" in (tmp_path / "r.html").read_text()


def test_a_sensor_that_the_first_run_lacks(dalembert: Dalembert, tmp_path: Path) -> None:
    """A mean of no reading is no number; numpy's warning of it is none to show."""
    log = """run,sensor,speed_rpm,amplitude_um_pp,phase_deg,trial_plane,trial_unbalance_g_mm,trial_angle_deg
0,1,1500,70,40,,,
A,1,1500,95,60,A,500,30
A,2,1500,40,100,A,500,30
B,1,1500,60,10,A;B,400;100,90;120
B,2,1500,80,140,A;B,400;100,90;120
C,1,1500,20,10,,,
C,2,1500,50,120,,,
"""
    (tmp_path / "runs.csv").write_text(log)
    done = dalembert("field", "runs.csv", "--report", "out.html", *TOLERANCE)
    assert done.returncode == 0, done.stderr
    assert "RuntimeWarning" not in done.stderr
    assert "nan" not in (tmp_path / "out.html").read_text()
