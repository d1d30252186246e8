"""Cams at the command line: what inspect and forces say, and the profile for a workshop."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

from tests.conftest import Dalembert


@pytest.fixture
def valve(dalembert: Dalembert) -> str:
    """The valve's cam of the examples."""
    assert dalembert("examples", "cam-valve").returncode == 0
    return "cam-valve.toml"


def test_inspect_names_pressure_angle_radius_and_lift_off(dalembert: Dalembert, valve: str) -> None:
    done = dalembert("inspect", valve, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    (cam,) = found["check"]["cams"]
    # of v/s with s = 35 mm + 25 (1 − cos 3u) mm, v = 75 sin 3u mm: where cos 3u = 25/60 the tangent is 75/√(60² − 25²)
    assert abs(cam["pressure_angle_deg"]) == pytest.approx(
        math.degrees(math.atan(75 / math.sqrt(60**2 - 25**2))), rel=1e-12
    )
    # above the dwell at the top: (34 + 3.924) N / (0.4 kg · 25 mm · 9) = ω²
    assert cam["lift_off_speed_rad_s"] == pytest.approx(math.sqrt(37.924 / (0.4 * 0.025 * 9)), rel=1e-9)
    assert cam["lift_off_at_deg"] == pytest.approx(150, abs=1e-4)
    assert cam["undercut"] is False
    assert "acceleration has a step at 0, 120, 150, 210 deg" in done.stderr + str(found["warnings"])


def test_forces_warn_where_contact_is_lost(dalembert: Dalembert, valve: str) -> None:
    quiet = dalembert("forces", valve, "--over", "0deg:360deg:5deg")
    assert "contact" not in quiet.stderr
    fast = dalembert("forces", valve, "--over", "0deg:360deg:5deg", "--set", "input.speed=21")
    assert fast.returncode == 0
    assert "contact lost" in fast.stderr
    assert "from 20.527" in fast.stderr


def test_json_has_the_pressure_angle_beside_the_contact_force(dalembert: Dalembert, valve: str) -> None:
    call = ["forces", valve, "--at", "60deg", "--only", "V.pressure_angle,V.curvature_radius,V.contact_force"]
    (row,) = csv.DictReader(dalembert(*call).stdout.splitlines())
    (pose,) = json.loads(dalembert(*call, "--json").stdout)["poses"]
    assert {f"V_{name}": value for name, value in pose["cams"]["V"].items()} == {
        name: float(row[name]) for name in row if name.startswith("V_")
    }


def test_the_profile_as_a_table_touches_the_base_circle(
    dalembert: Dalembert, valve: str, tmp_path: Path
) -> None:
    done = dalembert("export", valve, "--profile", "V", "-o", "profile.csv")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "profile.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) >= 1440
    near = min(math.hypot(float(row["profile_x_mm"]), float(row["profile_y_mm"])) for row in rows)
    assert near == pytest.approx(25, rel=1e-12)
    for row in rows:
        apart = math.hypot(*(float(row[f"profile_{a}_mm"]) - float(row[f"pitch_{a}_mm"]) for a in "xy"))
        assert apart == pytest.approx(10, rel=1e-12)


def test_the_profile_as_a_drawing(dalembert: Dalembert, valve: str, tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    assert dalembert("export", valve, "--profile", "V", "-o", "profile.dxf").returncode == 0
    drawn = ezdxf.readfile(tmp_path / "profile.dxf")
    profile = next(line for line in drawn.modelspace() if line.dxf.layer == "GEARS")
    assert profile.closed
    assert len(profile) >= 1440
    assert drawn.header["$INSUNITS"] == 4


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--profile", "W", "-o", "p.csv"], "expected one of the followers V"),
        (["--profile", "V", "-o", "p.urdf"], "expected -o .csv, .dxf, .svg"),
        (["--profile", "V", "--at", "3deg", "-o", "p.csv"], "leave --at out"),
    ],
)
def test_what_has_no_profile(dalembert: Dalembert, valve: str, more: list[str], words: str) -> None:
    done = dalembert("export", valve, *more)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
