"""`dalembert field` with limits: the limit that is named can be met, and what is not proven is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import Dalembert

INITIAL = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_kg,trial_angle_deg\n0,1,1,0,,,\n0,2,2,0,,,\n0,3,5,90,,,\n"


def coefficients(apart: float) -> str:
    """Three sensors, two planes that act alike but for `apart`."""
    rows = [
        (1, "A", 1.0),
        (1, "B", 1.0),
        (2, "A", 1.0),
        (2, "B", 1 + apart),
        (3, "A", 2.0),
        (3, "B", 2 - apart),
    ]
    lines = (f"{sensor},{plane},{size!r},0" for sensor, plane, size in rows)
    return "\n".join(["sensor,plane,magnitude_per_kg,phase_deg", *lines]) + "\n"


@pytest.mark.whole
@pytest.mark.parametrize("objective", ["least-squares", "minimax"])
def test_planes_too_much_alike_are_refused_or_warned_of_in_one_line(
    objective: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    """Where rounding decides, the last bits of a machine's own libraries prove some answers: these have a warning instead."""
    for apart in (1e-11, 1e-12, 3e-13, 1e-13):
        (tmp_path / "c.csv").write_text(coefficients(apart))
        words = (
            "field",
            "-",
            "--influence",
            "c.csv",
            "--objective",
            objective,
            "--max-mass",
            f"{1 / apart:g}kg",
        )
        done = dalembert(*words, "--json", stdin=INITIAL)
        (line,) = done.stderr.splitlines()
        assert "nearly dependent" in line
        assert "condition number" in line
        assert done.returncode in (0, 1)
        assert bool(done.stdout) == (done.returncode == 0)


def test_what_is_not_proven_is_refused(dalembert: Dalembert, tmp_path: Path) -> None:
    """Which of these the last bits of a machine's own libraries prove to all digits is not the same everywhere."""
    proven, refused = 0, []
    for apart in (1e-6, 1e-8, 3e-9, 1e-9, 3e-10):
        (tmp_path / "c.csv").write_text(coefficients(apart))
        words = ("field", "-", "--influence", "c.csv", "--max-mass", f"{1 / apart:g}kg", "--json")
        for objective in ("least-squares", "minimax"):
            done = dalembert(*words, "--objective", objective, stdin=INITIAL)
            proven += done.returncode == 0
            refused += [done.stderr] * done.returncode
    assert proven
    assert refused
    assert all("the corrections cannot be proven" in text for text in refused)


def test_the_limit_that_is_named_can_be_met(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(coefficients(0.5))
    for cap in ((), ("--max-mass", "1kg")):
        words = ("field", "-", "--influence", "c.csv", *cap, "--json", "--max-residual")
        refused = dalembert(*words, "0.1um", stdin=INITIAL)
        assert refused.returncode == 1
        named = refused.stderr.split("can be met is ")[1].split()[0]
        met = dalembert(*words, f"{named}um", stdin=INITIAL)
        assert met.returncode == 0, met.stderr
        result = json.loads(met.stdout)
        assert result["rotors"][0]["residual_max"] <= float(named)
        (warning,) = [text for text in result["warnings"] if "minimax" in text] or [""]
        assert warning in ("", "the limits leave the minimax corrections alone")
        just_below = f"{float(named) * (1 - 1e-5):.8g}um"
        assert dalembert(*words, just_below, stdin=INITIAL).returncode == 1


DEPENDENT = """run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg
0,1,34,116,,,
1,1,18,42,A,2,0
2,1,25,200,B,2,90
3,1,20,100,A;B,2;1,30;10
"""


def test_fewer_readings_than_planes_within_limits(dalembert: Dalembert, tmp_path: Path) -> None:
    """The corrections are chosen among many; no run, no page and no digits can be had of one choice alone."""
    (tmp_path / "runs.csv").write_text(DEPENDENT)
    command = ("field", "runs.csv", "--max-mass", "5g")
    plain = dalembert(*command)
    assert plain.returncode == 0, plain.stderr
    suggested = dalembert(*command, "--suggest", "--json")
    assert json.loads(suggested.stdout)["rotors"][0]["suggest"] is None, suggested.stderr
    assert dalembert(*command, "--report", "report.html").stdout == plain.stdout
    digits = dalembert(*command, "--digits")
    assert digits.stdout == plain.stdout
    assert (
        "the readings cannot distinguish the planes: other corrections leave the same residual"
        in digits.stderr
    )
    robust = dalembert(*command, "--robust", "--json")
    assert (robust.returncode, "the readings cannot distinguish the planes A and B" in robust.stderr) == (
        1,
        True,
    )
    page = dalembert(*command, "--page", "page.html")
    assert (page.returncode, "the readings cannot distinguish the planes" in page.stderr) == (2, True)


def test_a_ridge_damps_what_is_added_to_the_masses_that_stand(dalembert: Dalembert, tmp_path: Path) -> None:
    """To first order as drawn readings scatter; the uncertainties were those of a ridge on all masses."""
    rows = [
        "0,1,34,116,,,",
        "0,2,20,16,,,",
        "1,1,18,42,A,2,0",
        "1,2,28,142,A,2,0",
        "2,1,25,200,B,2,90",
        "2,2,10,220,B,2,90",
    ]
    (tmp_path / "runs.csv").write_text("\n".join([DEPENDENT.splitlines()[0], *rows]) + "\n")
    command = ("field", "runs.csv", "--from-here", "--ridge", "0.5", "--reading-error", "2%,2deg", "--json")
    of_first_order, drawn = (
        [
            (one["mass_uncertainty_kg"], one["angle_uncertainty_deg"])
            for one in json.loads(dalembert(*command, *words).stdout)["rotors"][0]["corrections"]
        ]
        for words in ((), ("--monte-carlo", "4000"))
    )
    for one, other in zip(of_first_order, drawn, strict=True):
        assert one == pytest.approx(other, rel=0.05)


def test_a_page_of_a_plane_without_effect_is_refused(dalembert: Dalembert, tmp_path: Path) -> None:
    """Also with a ridge, which gives it a correction of zero."""
    rows = ["0,1,0,0,,,", "1,1,0,0,A,2,0"]
    (tmp_path / "runs.csv").write_text("\n".join([DEPENDENT.splitlines()[0], *rows]) + "\n")
    done = dalembert(
        "field", "runs.csv", "--ridge", "0.3", "--reading-error", "2%,2deg", "--page", "page.html"
    )
    assert (done.returncode, "--page" in done.stderr) == (2, True), done.stderr


def test_the_angle_of_the_first_blade_needs_blades(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "runs.csv").write_text(DEPENDENT)
    done = dalembert("field", "runs.csv", "--first", "10deg")
    assert (done.returncode, "--first: goes with --blades" in done.stderr) == (2, True), done.stderr
