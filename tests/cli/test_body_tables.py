"""`dalembert body`: points by radius and angle, several bodies in one table, shafts along any axis."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidbody3d import Body, Shaft
from rigidbody3d.shaft import shaft_axes
from tests.cli.printed import document

POLAR = "part,shape,mass_g,radius_mm,angle_deg,z_mm\nW1,point,100,50,30,0\nW2,point,200,40,120,100\n"


@pytest.fixture
def body(dalembert: Any, tmp_path: Any) -> Any:
    def run(parts: str, *options: object) -> Any:
        (tmp_path / "parts.csv").write_text(parts)
        return dalembert("body", "parts.csv", *options)

    return run


def test_a_point_by_radius_and_angle(body: Any) -> None:
    """x = r·cos θ, y = r·sin θ; a quarter turn is exact."""
    one = "part,shape,mass_kg,radius_m,angle_deg\np,point,2,3,90\n"
    assert document(body(one, "--json"))["center_m"] == [0.0, 3.0, 0.0]
    result = document(body(POLAR, "--json"))
    x = (0.1 * 0.05 * math.cos(math.pi / 6) - 0.2 * 0.04 * 0.5) / 0.3
    y = (0.1 * 0.05 * 0.5 + 0.2 * 0.04 * math.sin(2 * math.pi / 3)) / 0.3
    assert result["center_m"] == pytest.approx([x, y, 0.2 / 3], rel=1e-14)
    mixed = "part,shape,mass_kg,radius_m,angle_deg,x_m\ndisk,disk,3,0.2,,\nhole,point,-1,0.1,180,\nknob,point,1,,,0.1\n"
    assert document(body(mixed, "--json"))["center_m"] == pytest.approx([0.2 / 3, 0, 0], abs=1e-17)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("p,point,1,,30,", ("row 1", "angle_deg", "no radius")),
        ("p,point,1,2,,", ("row 1", "radius_m", "no angle")),
        ("p,point,1,2,30,1", ("row 1", "x_m", "not both")),
        ("p,point,1,-2,30,", ("row 1", "radius_m", "not negative")),
    ],
)
def test_half_a_polar_place_is_one_line(body: Any, row: str, words: tuple[str, ...]) -> None:
    done = body(f"part,shape,mass_kg,radius_m,angle_deg,x_m\n{row}\n")
    assert done.returncode == 1
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert all(word in done.stderr for word in words), done.stderr


def test_each_body_of_a_table_is_that_of_a_table_of_its_own(body: Any) -> None:
    header, *rows = POLAR.splitlines()
    third = "W3,point,50,45,200,20"
    of = {"07": [rows[0], third], "7": [rows[1], third], "NA": [third]}
    mixed = [f"{name},{of[name][k]}" for k in (0, 1) for name in of if k < len(of[name])]
    whole = "\n".join([f"body,{header}", *mixed]) + "\n"
    options = (
        "--shaft",
        "0mm:200mm",
        "--speed",
        "1200rpm",
        "--correct",
        "A:0m:20mm",
        "--correct",
        "B:0.2m:20mm",
    )
    several = document(body(whole, *options, "--json"))
    assert [each["body"] for each in several["bodies"]] == ["07", "7", "NA"]
    for each in several["bodies"]:
        alone = document(body("\n".join([header, *of[each.pop("body")]]) + "\n", *options, "--json"))
        alone.pop("warnings")
        assert each == alone
    table = [line.split(",") for line in body(whole, *options).stdout.splitlines()]
    assert [tuple(line[:2]) for line in table[1:6]] == [("07", a) for a in ("x", "y", "z", "A", "B")]
    assert len(table) == 1 + 3 * 5
    way = document(body(whole, "--steps", "--json"))["way"]
    assert [topic["body"] for topic in way] == [name for name in of for _ in range(2)]


def test_a_body_that_cannot_be_is_named(body: Any) -> None:
    done = body("body,part,shape,mass_kg\nA,p,point,1\nB,q,point,1\nB,r,point,-1\n")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "body 'B'" in done.stderr
    assert "positive total" in done.stderr


def test_a_shaft_along_x_is_one_along_z_turned(body: Any) -> None:
    """One mass of 2 kg at r = 0.1 m in the middle: each bearing pulls it with m·r·ω²/2 = 10 N; the mirror image too."""
    for axis, place, along in (("x", "0.5,0.1,0", "y"), ("-x", "-0.5,0.1,0", "y"), ("y", "0,0.5,0.1", "z")):
        table = f"part,shape,mass_kg,x_m,y_m,z_m\np,point,2,{place}\n"
        options = ("--shaft", "0m:1m", f"--axis={axis}", "--speed", "10rad_s", "--gravity", "0,0,-10")
        result = document(body(table, *options, "--json"))
        for bearing in result["shaft"]["bearings"]:
            force = dict(zip("xyz", bearing["dynamic_N"], strict=True))
            assert force.pop(along) == pytest.approx(-10, rel=1e-14)
            assert list(force.values()) == [0.0, 0.0]
            assert bearing["static_N"] == pytest.approx([0, 0, 10])
    z = document(body(POLAR, "--shaft", "0m:1m", "--speed", "10rad_s", "--json"))
    assert document(body(POLAR, "--shaft", "0m:1m", "--axis", "z", "--speed", "10rad_s", "--json")) == z


@pytest.mark.parametrize("axis", ["w", "0,0,0", "1,2", "", "--x", "nan,0,0"])
def test_an_axis_that_is_none(body: Any, axis: str) -> None:
    done = body(POLAR, "--shaft", "0m:1m", f"--axis={axis}")
    assert done.returncode == 2
    assert "--axis" in done.stderr


def test_an_axis_without_a_shaft(body: Any) -> None:
    assert body(POLAR, "--axis", "x").returncode == 2


def against_newton(seed: int) -> None:
    """Point masses on a shaft along any vector: Σ F and Σ M of Newton's law for each mass, in the axes drawn."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=3) * 10.0 ** rng.integers(-3, 4)
    n = np.eye(3)[seed % 3] * n if seed % 5 == 0 else n
    mass, place = rng.uniform(0.1, 3, 4), rng.normal(size=(4, 3))
    bearings, speed, rate, gravity = (
        np.sort(rng.normal(size=2)),
        *rng.normal(size=2) * 10,
        rng.normal(size=3) * 10,
    )
    axes = shaft_axes(n)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1, rel=1e-14)
    e = n / np.linalg.norm(n)
    center = mass @ place / mass.sum()
    arm = place - center
    tensor = np.einsum(
        "i,ijk->jk", mass, (arm**2).sum(1)[:, None, None] * np.eye(3) - arm[:, :, None] * arm[:, None]
    )
    whole = Body(mass.sum(), center, tensor).turned(axes, (0.0, 0.0, 0.0))
    shaft = Shaft(whole, bearings, speed, rate, axes @ gravity)
    forces = np.zeros((2, 3))
    forces[:, :2] = shaft.static + shaft.dynamic
    forces[0, 2] = shaft.axial
    forces = forces @ axes
    w = speed * e
    pull = mass[:, None] * (np.cross(rate * e, place) + np.cross(w, np.cross(w, place)) - gravity)
    size = np.abs(pull).sum() * (1 + 1 / np.ptp(bearings))
    # the centre of mass of an axial acceleration: none, so the forces of the bearings alone move the masses
    np.testing.assert_allclose(forces.sum(axis=0), pull.sum(axis=0), atol=1e-12 * size)
    moment = np.cross(bearings[:, None] * e, forces).sum(axis=0) + float(shaft.drive_torque) * e
    reach = np.abs(place).max() + np.abs(bearings).max()
    np.testing.assert_allclose(moment, np.cross(place, pull).sum(axis=0), atol=1e-12 * size * reach)


def test_shafts_along_any_vector_obey_newton() -> None:
    for seed in range(20):
        against_newton(seed)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(4))
def test_many_shafts_along_any_vector_obey_newton(block: int) -> None:
    for seed in range(1000 * (block + 1), 1000 * (block + 2)):
        against_newton(seed)
