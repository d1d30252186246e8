"""Cycles of `dalembert forces` as a user sees them: laws with dwells, sweeps that are no cycle, peaks."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import Dalembert
from tests.four_bars import body, four_bar

FOUR_BAR = four_bar(
    body(1, (10, 3), 1e-3),
    body(2, (40, 10), 2e-3),
    body(1.5, (30, -10), 1e-3),
    head="gravity = [0, -9.81]",
    rates='speed = "30 rad/s"',
)
KEYS = {
    "mean_torque_N_m", "peak_torque_N_m", "peak_at_deg", "rms_torque_N_m", "peak_power_W", "work_J",
    "energy_closure_J", "flywheel_inertia_kg_m2",
}  # fmt: skip


def document(dalembert: Dalembert, *options: str, text: str = FOUR_BAR) -> Any:
    done = dalembert("forces", "-", *options, "--json", stdin=text)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def law(rows: int, digits: int) -> str:
    """A law that rises by 90°, dwells, returns and dwells within 1 s, or is smooth, as people write one."""
    lines = ["time_s,crank_deg"]
    for i in range(rows):
        t = i / (rows - 1)
        u = min(max((t - 0.2) / 0.3, 0), 1) - min(max((t - 0.7) / 0.3, 0), 1)
        lines.append(f"{t:.{digits}f},{45 * (1 - math.cos(math.pi * u)):.{digits}f}")
    return "\n".join(lines)


@pytest.mark.parametrize(("rows", "digits"), [(41, 12), (2001, 6)])
def test_a_dwell_and_a_return_over_time(dalembert: Dalembert, tmp_path: Path, rows: int, digits: int) -> None:
    (tmp_path / "law.csv").write_text(law(rows, digits))
    found = document(dalembert, "--cases", "law.csv")
    assert not found["warnings"]
    cycle = found["cycle"]
    assert set(cycle) == KEYS
    torque = np.array([p["effort"]["virtual_work_torque_N_m"] for p in found["poses"]])
    speed = np.array([p["links"]["crank"]["omega_rad_s"] for p in found["poses"]])
    # of a coarse law the torque jumps with the acceleration at the dwells: the mean of rows and rows between
    rough = 1e-3 if rows == 2001 else 0.02
    assert cycle["mean_torque_N_m"] == pytest.approx(
        np.trapezoid(torque, dx=1 / (rows - 1)), abs=rough * np.abs(torque).max()
    )
    assert np.abs(torque).max() <= cycle["peak_torque_N_m"] <= (1 + 10 * rough) * np.abs(torque).max()
    assert np.abs(torque * speed).max() <= cycle["peak_power_W"] * (1 + 1e-12)
    # the law ends where it begins: what goes in comes out
    assert abs(cycle["work_J"]) <= 1e-3 * cycle["peak_power_W"]
    assert abs(cycle["energy_closure_J"]) <= 1e-3 * cycle["peak_power_W"]
    for form in (["--text"], []):
        done = dalembert("forces", "-", "--cases", "law.csv", *form, stdin=FOUR_BAR)
        assert done.returncode == 0, done.stderr


NONE = {
    "0deg:100deg:1deg": "the sweep covers 100 deg of the input crank, and a whole cycle is 360 deg: sweep from 0deg to 360deg",
    "0deg:355deg:5deg": "sweep from 0deg to 360deg",
    "30deg:-90deg:-5deg": "sweep from 30deg to -330deg",
    "0deg:0deg:1deg": "one pose is no cycle",
}


@pytest.mark.parametrize("sweep", NONE)
def test_a_sweep_that_is_no_cycle_has_one_warning_and_no_numbers(dalembert: Dalembert, sweep: str) -> None:
    found = document(dalembert, "--over", sweep)
    (warning,) = found["warnings"]
    assert NONE[sweep] in warning
    assert found["cycle"] == dict.fromkeys(KEYS)
    done = dalembert("forces", "-", "--flywheel", "0.02", "--over", sweep, stdin=FOUR_BAR)
    assert done.returncode == 0
    assert NONE[sweep] in done.stderr
    # its table is that of the poses
    assert len(list(csv.DictReader(io.StringIO(done.stdout)))) == len(found["poses"])
    found = document(dalembert, "--flywheel", "0.02", "--over", sweep)
    assert found["cycle"] == dict.fromkeys(KEYS)
    text = dalembert("forces", "-", "--text", "--over", sweep, stdin=FOUR_BAR)
    assert text.stdout.rstrip().splitlines()[-1].startswith("no cycle: ")
    assert "mean" not in text.stdout
    # a table alone shows no cycle, and says nothing of it
    assert dalembert("forces", "-", "--over", sweep, stdin=FOUR_BAR).stderr == ""


def test_the_peak_does_not_depend_on_the_rows(dalembert: Dalembert) -> None:
    cycles = [document(dalembert, "--over", f"0deg:360deg/{n}")["cycle"] for n in (20, 100, 2000)]
    for cycle in cycles:
        for key in ("peak_torque_N_m", "peak_power_W", "rms_torque_N_m", "peak_at_deg"):
            assert cycle[key] == pytest.approx(cycles[0][key], rel=1e-8), key
    at = cycles[0]["peak_at_deg"]
    (pose,) = document(dalembert, "--at", f"{at!r}deg")["poses"]
    assert abs(pose["effort"]["input_torque_N_m"]) == pytest.approx(cycles[0]["peak_torque_N_m"], rel=1e-12)
    assert cycles[0]["peak_power_W"] == pytest.approx(30 * cycles[0]["peak_torque_N_m"], rel=1e-12)


def test_a_law_with_a_dwell_has_no_flywheel(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "law.csv").write_text(law(41, 12))
    done = dalembert("forces", "-", "--cases", "law.csv", "--flywheel", "0.02", stdin=FOUR_BAR)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "the input stands or turns back" in done.stderr


def test_rows_without_a_time_that_return(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "there.csv").write_text("crank_deg\n0\n40\n40\n0\n")
    found = document(dalembert, "--cases", "there.csv")
    (warning,) = found["warnings"]
    assert "needs a column time_s" in warning


BARE = four_bar()
WITHOUT = {
    "nothing": (BARE, "no mass and no load: all forces are zero"),
    "gravity alone": (four_bar(head="gravity = [0, -9.81]", rates="speed = 3"), "no mass and no load"),
    "masses at rest": (
        four_bar(body(1, (10, 3), 1e-3)),
        "masses at rest without gravity or a load: all forces are zero; add gravity, or speed",
    ),
}


@pytest.mark.parametrize("case", WITHOUT)
@pytest.mark.parametrize("count", [0, 3, 40])
def test_forces_without_any_load_have_one_warning(dalembert: Dalembert, case: str, count: int) -> None:
    text, expected = WITHOUT[case]
    more = ["--over", "0deg:360deg:90deg"]
    more += ["--over", f"links.crank.B.x=30mm:40mm:{10 / (count - 1)}mm"] if count else []
    found = document(dalembert, *more, text=text)
    assert [w for w in found["warnings"] if expected in w] == found["warnings"]
    assert len(found["warnings"]) == 1
    variants = found["variants"] if count else [found]
    assert len(variants) == max(count, 1)
    assert {pose["effort"]["input_torque_N_m"] for v in variants for pose in v["poses"]} == {0.0}
    done = dalembert("forces", "-", stdin=text)
    assert done.returncode == 0
    assert done.stderr.count("\n") == 1
    assert expected in done.stderr


@pytest.mark.parametrize(
    "more",
    [
        "[[torques]]\nlink = 'rocker'\ntorque = 2",
        "[[forces]]\nlink = 'rocker'\npoint = 'C'\nforce = [0, 1]",
        "[[springs]]\nbetween = ['coupler.C', 'ground.A']\nstiffness = 3",
    ],
)
def test_any_load_gives_forces(dalembert: Dalembert, more: str) -> None:
    found = document(dalembert, text=four_bar(more=more))
    assert found["poses"][0]["effort"]["input_torque_N_m"]
    assert not found["warnings"]


def test_a_varied_mass_is_a_load(dalembert: Dalembert) -> None:
    text = four_bar(head="gravity = [0, -9.81]").replace(
        "points = { A", "mass = 0\ncenter = [20, 0]\npoints = { A"
    )
    found = document(dalembert, "--over", "links.crank.mass=0:1:0.5", text=text)
    efforts = [v["poses"][0]["effort"]["virtual_work_torque_N_m"] for v in found["variants"]]
    exact = [m * 9.81 * 0.02 * math.cos(math.radians(40)) for m in (0, 0.5, 1)]
    assert efforts == pytest.approx(exact, rel=1e-12)


def test_rates_without_a_speed_have_one_warning(dalembert: Dalembert) -> None:
    for order in ("velocity", "acceleration", "jerk"):
        done = dalembert("mechanism", "-", "--order", order, "--only", "C", stdin=BARE)
        assert done.returncode == 0
        (row,) = csv.DictReader(io.StringIO(done.stdout))
        assert float(row["C_vx_m_s"]) == 0
        assert done.stderr.count("\n") == 1
        assert "no input has a speed: all rates are zero" in done.stderr
    for speed in (
        ["--set", "input.speed=2"],
        ["--over", "input.speed=1:2:1"],
        ["--over", "input.speed=1:40:1"],
    ):
        done = dalembert("mechanism", "-", "--order", "velocity", "--only", "C", *speed, stdin=BARE)
        assert "C_vx_m_s" in done.stdout
        assert done.stderr == ""


def test_the_closure_of_energy_has_no_digit_that_rounding_leaves(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    """Of 427 J of work 8e-15 J are rounding: once printed as six digits that hold."""
    assert dalembert("examples", "engine").returncode == 0
    done = dalembert("forces", "engine.toml", "--over", "0deg:720deg:5deg", "--digits", "-o", "cycle.md")
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "cycle.md").read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if "energy_closure_J" in line)
    heads, cells = ([cell.strip() for cell in lines[k].strip("|").split("|")] for k in (at, at + 2))
    row = dict(zip(heads, cells, strict=True))
    assert row["work_J"] == "-426.84"
    assert row["energy_closure_J"] in ("", "0")
