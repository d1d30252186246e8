"""`dalembert spin` as a user runs it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.cli.printed import document

RACKET = "inertia = [1, 2, 3]\nomega = [0.01, 1, 0.01]\n"
TOP = "inertia = [1, 1, 0.6]\nomega = [0.5, 1, 3]\nattitude = [0.8, 0.6, 0, 0]\n[top]\nmgl = 1.2\n"


@pytest.fixture
def spin(dalembert, tmp_path):
    def run(toml: str, *options: object):
        (tmp_path / "body.toml").write_text(toml)
        return dalembert("spin", "body.toml", *options)

    return run


def test_times(spin) -> None:
    for option, times in (
        (("--time", "0:1:0.25"), [0, 0.25, 0.5, 0.75, 1.0]),
        (("--time", "0:1:0.3"), [0, 0.3, 0.6, 0.9]),
        (("--time", "0:1/4"), [0, 0.25, 0.5, 0.75, 1.0]),
        (("--time", "1s:0:-500ms"), [1.0, 0.5, 0.0]),
        (("--at", 5, "--at", "2"), [5, 2]),
        ((), [0]),
    ):
        found = [state["t_s"] for state in document(spin(RACKET, *option, "--json"))["states"]]
        assert found == pytest.approx(times, rel=1e-15)


def test_integration_agrees_with_the_closed_form_and_states_its_drift(spin) -> None:
    for toml in (RACKET, TOP):
        exact = document(spin(toml, "--time", "0:4:1", "--json"))
        run = document(spin(toml, "--time", "0:4:1", "--method", "integrate", "--json"))
        assert exact["method"] == "exact"
        assert run["method"] == "DOP853"
        for a, b in zip(exact["states"], run["states"], strict=True):
            np.testing.assert_allclose(a["omega_rad_s"], b["omega_rad_s"], atol=1e-12)
            assert (
                min(
                    np.abs(np.add(a["attitude"], b["attitude"])).max(),
                    np.abs(np.subtract(a["attitude"], b["attitude"])).max(),
                )
                < 1e-12
            )
        assert exact["drift"]["momentum"] < 1e-14
        assert exact["drift"]["energy"] < 1e-14
        assert run["drift"]["energy"] < 1e-11
    split = document(spin(TOP, "--at", 3, "--method", "integrate", "--integrator", "splitting", "--json"))
    assert split["method"] == "splitting"


def test_a_body_of_revolution_has_cones_and_no_other_has(spin) -> None:
    found = document(spin("inertia = [2, 1, 1]\nomega = [2, 1, 0]\n", "--json"))
    # axis x: H = (4, 1, 0)
    assert found["cones"]["body_half_angle_deg"] == pytest.approx(math.degrees(math.atan2(1, 2)))
    assert found["cones"]["space_half_angle_deg"] == pytest.approx(
        math.degrees(math.atan2(1, 2) - math.atan2(1, 4))
    )
    assert found["cones"]["precession_rad_s"] == pytest.approx(math.sqrt(17))
    assert found["cones"]["spin_rad_s"] == pytest.approx(-2)
    assert found["period_s"] == pytest.approx(math.pi)
    for inertia in ("[1, 2, 3]", "[2, 2, 2]"):
        assert document(spin(f"inertia = {inertia}\nomega = [2, 1, 0]\n", "--json"))["cones"] is None
    assert document(spin("inertia = [1, 2, 3]\nomega = [0, 1, 0]\n", "--json"))["period_s"] is None


def test_a_body_of_parts_and_a_tensor(spin, tmp_path) -> None:
    (tmp_path / "parts.csv").write_text("part,shape,mass_kg,width_m,height_m,depth_m\nb,box,12,1,2,3\n")
    parts = document(spin('parts = "parts.csv"\nomega = [1, 2, 3]\n', "--at", 1, "--json"))
    moments = document(spin("inertia = [13, 10, 5]\nomega = [1, 2, 3]\n", "--at", 1, "--json"))
    assert parts["states"] == moments["states"]
    tensor = document(spin("inertia = [[13,0,0],[0,10,0],[0,0,5]]\nomega = [1, 2, 3]\n", "--at", 1, "--json"))
    assert tensor["states"] == moments["states"]


def test_a_torque_is_integrated(spin) -> None:
    toml = 'inertia = [2, 3, 4]\nomega = [0, 0, 0]\ntorque = [0, 0, 2]\nframe = "space"\n'
    found = document(spin(toml, "--at", 3, "--json"))
    assert found["states"][0]["omega_rad_s"] == pytest.approx([0, 0, 1.5], abs=1e-13)
    assert found["drift"] == {"momentum": None, "energy": None}
    done = spin(toml, "--method", "exact")
    assert done.returncode == 1
    assert "no closed form" in done.stderr


def test_a_top_of_two_different_moments_is_integrated_and_said_so(spin) -> None:
    done = spin(TOP.replace("[1, 1, 0.6]", "[1, 1.2, 0.6]"), "--at", 1, "--json")
    assert document(done)["method"] == "DOP853"
    assert "no closed form" in done.stderr


@pytest.mark.slow
def test_csv_and_pictures(spin, tmp_path) -> None:
    done = spin(RACKET, "--time", "0:2:1")
    lines = done.stdout.splitlines()
    assert lines[0].startswith("t_s,omega_x_rad_s")
    assert len(lines) == 4
    for toml, name in (
        (RACKET, "a.svg"),
        (TOP, "b.png"),
        ("inertia = [0, 1, 1]\nomega = [1, 1, 0]\n", "c.pdf"),
    ):
        assert spin(toml, "--at", 2, "--plot", name).returncode == 0
        assert (tmp_path / name).stat().st_size > 10_000


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        ("inertia = [1, 1, 3]\nomega = [1, 2, 3]\n", ("inertia", "triangle inequality")),
        ("inertia = [1, -1, 3]\nomega = [1, 2, 3]\n", ("negative",)),
        ("inertia = [0, 0, 0]\nomega = [1, 2, 3]\n", ("no moment of inertia",)),
        ("inertia = [1, 2]\nomega = [1, 2, 3]\n", ("inertia", "3 or 3×3")),
        ("inertia = [[1,2,0],[0,1,0],[0,0,1]]\nomega = [1, 2, 3]\n", ("symmetric",)),
        ("inertia = [1, 2, 3]\n", ("no omega",)),
        ("inertia = [1, 2, 3]\nomega = [1, 2]\n", ("omega", "3 finite numbers")),
        ("inertia = [1, 2, 3]\nomega = [1, 2, nan]\n", ("omega",)),
        ('inertia = [1, 2, 3]\nomega = [1, 2, "x"]\n', ("omega",)),
        ("inertia = [1, 2, 3]\nomega = [1, 2, 3]\nattitude = [0, 0, 0, 0]\n", ("attitude",)),
        ("inertia = [1, 2, 3]\nomegas = [1, 2, 3]\n", ("omegas", "did you mean 'omega'?")),
        ("inertia = [1, 2, 3]\nomega = [1, 2, 3]\n[top]\nmass = 3\n", ("[top]", "mgl")),
        ('inertia = [1, 2, 3]\nomega = [1, 2, 3]\nframe = "moon"\n', ("frame",)),
        ('inertia = [1, 2, 3]\nomega = [1, 2, "3 kg"]\n', ("3 finite numbers in rad/s", "'700 rpm'")),
        ('inertia = [1, 2, 3]\nomega = [1, 2, 3]\nattitude = ["1 deg", 0, 0, 0]\n', ("4 finite numbers",)),
        ("omega = [1, 2, 3]\n", ("inertia",)),
        ('parts = "none.csv"\nomega = [1, 2, 3]\n', ("none.csv",)),
        ("inertia = [1, 2, 3\n", ("body.toml",)),
    ],
)
def test_bad_bodies_are_one_line(spin, toml: str, words) -> None:
    done = spin(toml)
    assert done.returncode == 1, done.stdout
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize(
    "options",
    [
        ("--time", "0:1"),
        ("--time", "0:1:0"),
        ("--time", "0:1:-0.1"),
        ("--time", "0:1/x"),
        ("--time", "0:1:0.1", "--at", "3"),
        ("--at", "soon"),
        ("--method", "guess"),
        ("--integrator", "euler"),
        ("--integrator", "splitting"),
        ("--method", "exact", "--integrator", "splitting"),
        ("--time", "0:1e12:1e-6"),
    ],
)
def test_wrong_usage(spin, options) -> None:
    assert spin(RACKET, *options).returncode == 2


def test_the_splitting_refuses_what_is_no_top(spin) -> None:
    done = spin(RACKET, "--method", "integrate", "--integrator", "splitting")
    assert done.returncode == 1
    assert "symmetric top" in done.stderr


def test_an_absurd_phase_is_refused_not_integrated(dalembert, tmp_path) -> None:
    (tmp_path / "body.toml").write_text("inertia = [1, 2, 3]\nomega = [1e59, 1, 2]\n")
    done = dalembert("spin", "body.toml", "--at", "5", "--method", "integrate")
    assert done.returncode == 1
    assert "steps" in done.stderr
    (tmp_path / "body.toml").write_text("inertia = [1, 2, 3]\nomega = [1e61, 1, 2]\n")
    done = dalembert("spin", "body.toml", "--at", "5")
    assert done.returncode == 1
    assert "omega" in done.stderr


def test_numbers_of_the_file_in_other_units(spin) -> None:
    bare = document(spin("inertia = [1, 1, 1.5]\nomega = [0, 3, 4]\n[top]\nmgl = 2\n", "--json"))
    text = 'inertia = ["1e6 kg mm2", 1, 1.5]\nomega = [0, "180 deg/s", "30 rpm"]\n[top]\nmgl = "2 kN mm"\n'
    units = document(spin(text, "--json"))
    assert units["states"][0]["omega_rad_s"] == pytest.approx([0, np.pi, np.pi], rel=4e-16)
    assert units["steady"]["sleeping_threshold_rad_s"] == bare["steady"]["sleeping_threshold_rad_s"]
    # 30 rpm are π rad/s, whatever is printed of it
    late = spin(text, "--at", "1000", "--digits", "--only", "omega")
    assert late.stdout.splitlines()[1].split(",")[3] == "3.141592653589793"


def test_what_a_rotation_does_not_have_is_said(spin) -> None:
    free = 'inertia = [1, 2, 3]\nomega = [0, 0, 4]\nframe = "space"\n'
    done = spin(free, "--only", "steady,cones,period,energy")
    assert done.returncode == 0
    assert "frame: these are the axes of a torque, and there is none" in done.stderr
    for name in ("steady", "cones", "period"):
        assert f"--only {name}: none here" in done.stderr
    assert "--only" not in spin(free).stderr


def test_a_top_of_parts_stands_on_its_axis(spin, tmp_path) -> None:
    top = 'parts = "parts.csv"\nomega = [0, 0, 90]\n[top]\nmgl = 0.4\n'
    (tmp_path / "parts.csv").write_text("part,shape,mass_kg,radius_mm,x_mm,z_mm\nwheel,disk,1,50,2,40\n")
    assert "the centre of mass lies at x = 0.002 m, y = 0 m" in spin(top).stderr
    (tmp_path / "parts.csv").write_text("part,shape,mass_kg,radius_mm,z_mm\nwheel,disk,1,50,40\n")
    assert "centre of mass" not in spin(top).stderr


def test_a_torque_of_zero_is_none(spin) -> None:
    free = document(spin("inertia = [1, 2, 3]\nomega = [1, 2, 3]\n", "--at", "2", "--json"))
    zero = document(
        spin("inertia = [1, 2, 3]\nomega = [1, 2, 3]\ntorque = [0, 0, 0]\n", "--at", "2", "--json")
    )
    assert zero == free
    # and so is a weight without a lever, of any body
    hung = document(spin("inertia = [1, 2, 3]\nomega = [1, 2, 3]\n[top]\nmgl = 0\n", "--at", "2", "--json"))
    assert hung["method"] == "exact"
    assert hung["states"] == free["states"]
    assert hung["warnings"] == []


def test_a_cube_that_lies_aslant_turns_steadily(spin, tmp_path) -> None:
    (tmp_path / "cube.csv").write_text(
        "part,shape,mass_kg,width_mm,height_mm,depth_mm,rx_deg,ry_deg\ncube,box,2,100,100,100,30,20\n"
    )
    state = document(spin('parts = "cube.csv"\nomega = [1, 2, 3]\n', "--at", "1", "--json"))
    # its moments differ by rounding: ω does not
    assert state["period_s"] is None
    assert state["cones"] is None
    assert state["states"][0]["omega_rad_s"] == pytest.approx([1, 2, 3], rel=1e-14)
