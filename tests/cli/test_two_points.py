"""`--only P-Q`: the vector R_PQ from Q to P, Cartesian and polar; its reversal is 180° further on (Ibrahim §1.2)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BAR = (
    "[ground]\nO = [0, 0]\n[links.bar]\npoints = { O = [0, 0], P = [3, 0], Q = [3, 4] }\n"
    '[input]\nlink = "bar"\nangle = "0 deg"\nspeed = 2\n'
)


def test_three_four_five(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(BAR)
    done = dalembert("mechanism", "b.toml", "--only", "Q-O,O-Q,Q-P", "--json")
    vectors = json.loads(done.stdout)["poses"][0]["vectors"]
    assert vectors["Q-O"] == {
        "x_m": 3.0, "y_m": 4.0, "length_m": 5.0, "angle_deg": pytest.approx(np.degrees(np.arctan2(4, 3))),
        "vx_m_s": -8.0, "vy_m_s": 6.0,
    }  # fmt: skip
    assert vectors["O-Q"]["angle_deg"] == pytest.approx(vectors["Q-O"]["angle_deg"] + 180)
    assert vectors["Q-P"]["angle_deg"] == pytest.approx(90)


def test_one_number_over_a_sweep_and_its_digits(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(BAR)
    done = dalembert(
        "mechanism", "b.toml", "--over", "0deg:360deg:90deg", "--only", "P-O.angle,P-O.length", "--digits"
    )
    header, *rows = done.stdout.splitlines()
    assert header.split(",")[2:] == ["P-O_length_m", "P-O_angle_deg"]
    angles = [float(row.split(",")[-1]) for row in rows]
    assert np.allclose((np.array(angles) - [0, 90, 180, 270, 0] + 180) % 360, 180)


def test_a_vector_without_length_has_no_direction(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(BAR)
    done = dalembert("mechanism", "b.toml", "--only", "P-P", "--json")
    assert json.loads(done.stdout)["poses"][0]["vectors"]["P-P"]["angle_deg"] is None


def test_points_with_hyphens_and_unknown_ones(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(BAR.replace("Q =", '"tip-2" ='))
    done = dalembert("mechanism", "b.toml", "--only", "tip-2-P.length", "--json")
    assert json.loads(done.stdout)["poses"][0]["vectors"]["tip-2-P"] == {"length_m": 4.0}
    done = dalembert("mechanism", "b.toml", "--only", "P-Z")
    assert done.returncode == 2
    assert "P-Z" in done.stderr
