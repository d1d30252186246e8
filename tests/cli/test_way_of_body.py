"""`body --steps`: H and Ω × H by component, ω and H in principal axes, |H| and its angle to ω."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

RIUL = "part,shape,mass_kg,radius_m\ndisk,disk,3.63,0.2\n"


def way(run: Any, *words: str) -> tuple[Any, dict[str, Any]]:
    done = run("body", *words, "--steps", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    return document, {topic["topic"]: topic for topic in document["way"]}


def check(document: Any, topics: dict[str, Any]) -> None:
    axes = np.array(topics["principal axes"]["principal_axes"])
    moments = np.array(topics["principal axes"]["principal_kg_m2"])
    tensor = np.array(document["inertia_kg_m2"])
    size = np.abs(tensor).max()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    np.testing.assert_allclose(axes @ tensor @ axes.T, np.diag(moments), atol=1e-8 * size)
    total = np.zeros(3)
    for part in topics["inertia"]["parts"]:
        total += [part["inertia_about_whole"][f"{a}{a}_kg_m2"] for a in "xyz"]
    np.testing.assert_allclose(total, np.diag(tensor), atol=1e-12 * size)
    if "momentum" not in topics:
        return
    omega, h = np.array(topics["momentum"]["omega_rad_s"]), np.array(topics["momentum"]["momentum_kg_m2_s"])
    np.testing.assert_allclose(tensor @ omega, h, atol=1e-12 * size * np.abs(omega).max(initial=1))
    rate = topics["rate of momentum"]
    np.testing.assert_allclose(rate["transport_N_m"], np.cross(rate["frame_omega_rad_s"], h), atol=1e-9)
    np.testing.assert_allclose(
        np.add(rate["relative_N_m"], rate["transport_N_m"]), rate["rate_N_m"], atol=1e-9
    )
    turned = topics["principal axes"]
    np.testing.assert_allclose(turned["omega_rad_s"], axes @ omega, atol=1e-12)
    np.testing.assert_allclose(
        turned["momentum_kg_m2_s"], moments * (axes @ omega), atol=1e-8 * np.abs(h).max()
    )
    if omega.any():
        angle = topics["angle"]
        assert angle["momentum_kg_m2_s"] == pytest.approx(np.linalg.norm(h))
        cosine = omega @ h / np.linalg.norm(omega) / np.linalg.norm(h)
        assert np.cos(np.radians(angle["angle_deg"])) == pytest.approx(cosine)


def test_riuls_example_3(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text(RIUL)
    document, topics = way(dalembert, "d.csv", "--omega", "0,4,12", "--frame-omega", "0,4,0")
    check(document, topics)
    assert topics["rate of momentum"]["transport_N_m"] == pytest.approx([3.63 * 0.02 * 12 * 4, 0, 0])
    assert topics["principal axes"]["free"] is True
    assert topics["principal axes"]["principal_axes"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    text = dalembert("body", "d.csv", "--omega", "0,4,12", "--frame-omega", "0,4,0", "--steps").stdout
    assert "(Ω × H)_x = Ω_y·H_z − Ω_z·H_y = (4)·(0.8712) − (0)·(0.1452) = 3.4848 N·m" in text


def test_a_ball_has_its_own_axes_and_no_angle(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text("part,shape,mass_kg,radius_m\nball,sphere,2,0.1\n")
    document, topics = way(dalembert, "b.csv", "--omega", "1,2,3")
    check(document, topics)
    assert topics["principal axes"]["principal_axes"] == np.eye(3).tolist()
    assert topics["angle"]["angle_deg"] == pytest.approx(0, abs=1e-6)
    assert "momentum" not in way(dalembert, "b.csv")[1]


def test_a_box_has_no_free_axes_and_turned_bodies_keep_the_identities(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text(
        "part,shape,mass_kg,width_m,height_m,depth_m,radius_m,x_m,rx_deg,ry_deg\n"
        "box,box,2,0.1,0.2,0.3,,0,20,40\ndisk,disk,1,,,,0.1,0.3,70,10\n"
    )
    document, topics = way(dalembert, "b.csv", "--omega", "1,-2,3", "--alpha", "4,5,6")
    check(document, topics)
    assert topics["principal axes"]["free"] is False
    (tmp_path / "d.csv").write_text("part,shape,mass_kg,radius_m,rx_deg,ry_deg\ndisk,disk,1,0.1,35,20\n")
    document, topics = way(dalembert, "d.csv", "--omega", "1,-2,3", "--frame-omega", "0,1,0")
    check(document, topics)
    assert topics["principal axes"]["free"] is True


def test_a_shaft_has_the_moments_about_its_bearings(dalembert: Any, tmp_path: Path) -> None:
    """A point mass m at r, midway: each bearing m·r·ω²/2."""
    (tmp_path / "p.csv").write_text("part,shape,mass_kg,x_m,z_m\nm,point,2,0.1,0\n")
    _, topics = way(dalembert, "p.csv", "--shaft=-500mm:500mm", "--speed", "10rad_s")
    one, other = topics["bearings"]["bearings"]
    assert one["dynamic_N"] == other["dynamic_N"] == pytest.approx([-10, 0])
