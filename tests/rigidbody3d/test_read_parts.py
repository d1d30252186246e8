"""A table of parts read by the library: the body that they make."""

from __future__ import annotations

from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest

from dalembert.errors import DataError
from rigidbody3d import read_parts


def written(folder: Path, text: str) -> Path:
    file = folder / "parts.csv"
    file.write_text(text)
    return file


@pytest.mark.parametrize("angle", [60, -60, 0])
def test_a_turned_rod_and_its_mirror_image(tmp_path: Path, angle: float) -> None:
    """I = m l²/12 (1 − u uᵀ), u along the rod (Riul, unit II, example of the rod on a shaft)."""
    parts = read_parts(written(tmp_path, f"part,shape,mass_kg,length_m,ry_deg\nrod,rod,4,1,{angle}\n"))
    u = np.array([sin(radians(angle)), 0.0, cos(radians(angle))])
    assert parts.whole.mass == 4
    np.testing.assert_allclose(parts.whole.inertia, 4 / 12 * (np.eye(3) - np.outer(u, u)), atol=1e-16)
    assert (parts.name, parts.shape, parts.warnings) == (["rod"], ["rod"], [])


def test_a_hole_and_a_part_of_no_mass(tmp_path: Path) -> None:
    table = "part,shape,mass_kg,x_m,radius_m\na,sphere,3,0,1\nhole,sphere,-1,0.3,0.1\nnothing,point,0,5,\n"
    parts = read_parts(str(written(tmp_path, table)))
    np.testing.assert_allclose(parts.whole.center, [-0.15, 0, 0], rtol=1e-15)
    assert parts.name == ["a", "hole"]
    (warning,) = parts.warnings
    assert "mass 0: left out" in warning


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("body,shape,mass_kg\na,point,1\nb,point,2\n", "expected one body"),
        ("shape,mass_kg\n", "no rows"),
        ("shape,mass_kg\npoint,-1\n", "expected a positive total"),
        ("shape,mass_kg\ncube,1\n", "expected one of point"),
    ],
)
def test_what_makes_no_body(tmp_path: Path, table: str, message: str) -> None:
    with pytest.raises(DataError, match=message):
        read_parts(written(tmp_path, table))


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(DataError, match=r"none\.csv"):
        read_parts("none.csv")
