"""`dalembert body` as a user runs it: options, outputs, and one line for whatever is wrong."""

from __future__ import annotations

import json

import pytest

DISK = "part,shape,mass_kg,radius_mm,x_mm\ndisk,disk,3.63,200,406\n"
HOLED = (
    "part,shape,mass_g,width_in,height_in,depth_in,radius_in,length_in\n"
    "block,box,2000,4,4,2,,\nhole,cylinder,-300,,,,0.5,2\n"
)


@pytest.fixture
def body(dalembert, tmp_path):
    def run(parts: str, *options: object):
        (tmp_path / "parts.csv").write_text(parts)
        return dalembert("body", "parts.csv", *options)

    return run


def test_units_and_holes(body) -> None:
    done = body(HOLED, "--json")
    found = json.loads(done.stdout)
    assert found["mass_kg"] == pytest.approx(1.7, rel=1e-15)
    inch = 0.0254
    izz = 2 * (32 * inch**2) / 12 - 0.3 * (0.5 * inch) ** 2 / 2
    assert found["inertia_kg_m2"][2][2] == pytest.approx(izz, rel=1e-13)
    assert found["warnings"] == []


def test_csv_and_json_files_agree(body, tmp_path) -> None:
    assert body(DISK, "--omega", "0,4,12", "-o", "out.csv").returncode == 0
    assert body(DISK, "--omega", "0,4,12", "-o", "out.json").returncode == 0
    document = json.loads((tmp_path / "out.json").read_text())
    lines = [line.split(",") for line in (tmp_path / "out.csv").read_text().splitlines()]
    column = lines[0].index("momentum_kg_m2_s")
    assert [float(line[column]) for line in lines[1:4]] == document["momentum_kg_m2_s"]
    assert [line[0] for line in lines[1:]] == ["x", "y", "z"]


def test_options_take_units(body) -> None:
    plain = json.loads(body(DISK, "--omega", "0,0,10", "--about", "0,0.1,0", "--json").stdout)
    units = json.loads(
        body(DISK, "--omega", "0,0,95.49296585513721rpm", "--about", "0,100,0mm", "--json").stdout
    )
    assert units["momentum_kg_m2_s"][2] == pytest.approx(plain["momentum_kg_m2_s"][2], rel=1e-15)
    assert units["about_m"] == plain["about_m"]


def test_a_fixed_point_moves_the_centre_of_mass(body) -> None:
    found = json.loads(
        body(DISK, "--omega", "0,0,10", "--alpha", "0,0,5", "--fixed", "0,0,0", "--json").stdout
    )
    m, x = 3.63, 0.406
    assert found["inertia_force_N"] == pytest.approx([m * x * 100, -m * x * 5, 0])
    izz = m * 0.2**2 / 2 + m * x * x
    assert found["momentum_about_kg_m2_s"][2] == pytest.approx(izz * 10)
    assert found["momentum_rate_about_N_m"][2] == pytest.approx(izz * 5)
    assert found["energy_J"] == pytest.approx(izz * 50)


def test_axes_in_which_the_tensor_is_not_constant_are_named(body) -> None:
    plate = "part,shape,mass_kg,width_m,height_m\np,plate,1,2,1\n"
    done = body(plate, "--omega", "0,4,12", "--frame-omega", "0,4,0", "--json")
    assert "not constant" in done.stderr
    # true: H = (0, 4/3, 5), α = Ω × ω = (48, 0, 0)
    assert json.loads(done.stdout)["momentum_rate_N_m"] == pytest.approx([48 / 12 + 4 * 5 - 12 * 4 / 3, 0, 0])
    assert "not constant" not in body(DISK, "--omega", "0,4,12", "--frame-omega", "0,4,0", "--json").stderr


def test_orientation_by_axis_and_turns(body) -> None:
    rod = "part,shape,mass_kg,length_m,axis_x,axis_y,axis_z,rx_deg,ry_deg,rz_deg\n"
    for row, along in (
        ("r,rod,12,1,1,0,0,,,", 0),
        ("r,rod,12,1,0,-2,0,,,", 1),
        ("r,rod,12,1,0,0,-1,,,", 2),
        ("r,rod,12,1,,,,0,90,0", 0),
        ("r,rod,12,1,,,,90,0,0", 1),
        ("r,rod,12,1,,,,90,0,90", 0),
        ("r,rod,12,1,0,1,0,90,0,0", 2),
    ):
        found = json.loads(body(rod + row + "\n", "--json").stdout)["inertia_kg_m2"]
        expected = [[float(i == j and i != along) for j in range(3)] for i in range(3)]
        assert found == expected, row  # exact: quarter turns are
    boxed = "part,shape,mass_kg,width_m,height_m,depth_m,axis_z\nb,box,12,1,2,3,-1\n"
    assert json.loads(body(boxed, "--json").stdout)["inertia_kg_m2"][0][0] == 13.0


@pytest.mark.slow
def test_pictures_are_written(body, tmp_path) -> None:
    assert body(DISK, "--omega", "0,4,12", "--plot", "p.svg").returncode == 0
    assert b"<svg" in (tmp_path / "p.svg").read_bytes()
    done = body(DISK, "--shaft=-1m:1m", "--speed", "10rad_s", "--correct", "A:0m:0.1m", "--plot", "p.png")
    assert done.returncode == 0
    assert "couple stays" in done.stderr
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ("part,shape,mass_kg\na,cilinder,1\n", ("row 1", "shape", "cilinder", "did you mean 'cylinder'?")),
        ("part,shape,mass_kg\na,disk,1\n", ("radius", "a disk needs radius")),
        ("part,shape,mass_kg,radius_m\na,disk,1,\n", ("row 1", "radius_m", "a disk needs radius")),
        ("part,shape,mass_kg,radius_m\na,disk,1,-2\n", ("radius_m", "'-2'", "positive")),
        ("part,shape,mass_kg,radius_m\na,disk,0,1\n", ("masses add up to 0 kg", "positive total")),
        ("part,shape,density_kg_m3,radius_m\na,sphere,-5,1\n", ("density_kg_m3", "positive density")),
        ("part,shape,density_kg_m3,radius_m\na,disk,5,1\n", ("density_kg_m3", "area_density or mass")),
        ("part,shape,mass_kg,density_kg_m3,radius_m\na,sphere,1,5,1\n", ("not both",)),
        ("part,shape,radius_m\na,sphere,1\n", ("a mass",)),
        ("part,shape,mass_kg\na,point,1\nb,point,-1\n", ("positive total",)),
        (
            "part,shape,mass_kg,ixx_kg_m2,iyy_kg_m2,izz_kg_m2\na,tensor,1,1,1,3\n",
            ("triangle inequality", "1 + 1 < 3"),
        ),
        ("part,shape,mass_kg,ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2\na,tensor,1,1,1,1,5\n", ("negative",)),
        ("part,shape,mass_kg,ixx_kg_m2,iyy_kg_m2\na,tensor,1,1,1\n", ("izz",)),
        ("part,mass_kg\na,1\n", ("no column shape",)),
        ("part,shape,mass_kg,axis_x,axis_y,axis_z\na,point,1,0,0,0\n", ("axis_z", "not zero")),
        (
            "part,shape,mass_kg,radius_m,inner_radius_m,length_m\na,tube,1,1,2,1\n",
            ("inner_radius_m", "no more than"),
        ),
        ("part,shape,mass_kg,x_m\na,point,-1,3\nb,point,2,0\n", ("no body is made",)),
        ("part,shape,mass_kg,x_furlong\na,point,1,3\n", ("x_furlong", "unknown unit")),
    ],
)
def test_bad_parts_are_one_line(body, parts: str, words) -> None:
    done = body(parts)
    assert done.returncode == 1
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize(
    "options",
    [
        ("--omega", "1,2"),
        ("--omega", "a,b,c"),
        ("--omega", "1,2,3furlong"),
        ("--shaft", "1m"),
        ("--shaft", "1m:1m", "--speed", "1rpm"),
        ("--speed", "10rpm"),
        ("--gravity", "0,-9.81,0"),
        ("--shaft", "0m:1m", "--omega", "1,2,3"),
        ("--fixed", "0,0,0", "--velocity", "1,0,0"),
        ("--shaft", "0m:1m", "--speed", "10"),
        ("--shaft", "0m:1m", "--speed", "1rpm", "--correct", "A:1mm"),
        ("--plot", "x.gif"),
    ],
)
def test_wrong_usage(body, options) -> None:
    done = body(DISK, *options)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""


def test_standard_input_and_a_missing_file(dalembert) -> None:
    done = dalembert("body", "-", "--json", stdin=DISK)
    assert json.loads(done.stdout)["mass_kg"] == 3.63
    assert dalembert("body", "none.csv").returncode == 1


def test_a_mesh_is_read_through_trimesh(body, tmp_path) -> None:
    pytest.importorskip("trimesh")
    corners = [(x, y, z) for x in (0, 10) for y in (0, 20) for z in (0, 30)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    obj = [f"v {x} {y} {z}" for x, y, z in corners]
    obj += [f"f {a + 1} {b + 1} {c + 1}\nf {a + 1} {c + 1} {d + 1}" for a, b, c, d in quads]
    (tmp_path / "box.obj").write_text("\n".join(obj))
    done = body("part,shape,file,file_unit,density_kg_m3\nb,mesh,box.obj,mm,1000\n", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["mass_kg"] == pytest.approx(0.006, rel=1e-12)
    assert found["center_m"] == pytest.approx([0.005, 0.01, 0.015], rel=1e-12)
    assert found["inertia_kg_m2"][0][0] == pytest.approx(0.006 * (0.02**2 + 0.03**2) / 12, rel=1e-12)
    (tmp_path / "box.obj").write_text("\n".join(obj[:-1]))
    done = body("part,shape,file,file_unit,density_kg_m3\nb,mesh,box.obj,mm,1000\n")
    assert done.returncode == 1
    assert "not closed" in done.stderr


def test_a_mesh_without_its_library_or_its_file_is_one_line(body) -> None:
    done = body("part,shape,file,file_unit,density_kg_m3\nb,mesh,none.stl,mm,1000\n")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert body("part,shape,mass_kg\nb,mesh,1\n").returncode == 1


def test_a_blank_axis_is_z_whatever_columns_there_are(body) -> None:
    rods = "part,shape,mass_kg,length_m,axis_x\nalong x,rod,1,6,1\nalong z,rod,1,2,\n"
    inertia = json.loads(body(rods, "--json").stdout)["inertia_kg_m2"]
    # m l²/12 = 3 across the long rod, 1/3 across the short one
    assert [inertia[i][i] for i in range(3)] == pytest.approx([1 / 3, 3 + 1 / 3, 3], rel=1e-14)


def test_a_part_without_mass_is_left_out(body) -> None:
    marked = DISK.replace("\ndisk", "\nmarker,point,0,,9\ndisk") + "frame,point,0,,\n"
    done = body(marked, "--omega", "0,4,12", "--json")
    assert done.returncode == 0, done.stderr
    assert "part 'marker': mass 0: left out" in done.stderr
    plain = json.loads(body(DISK, "--omega", "0,4,12", "--json").stdout)
    assert json.loads(done.stdout) | {"warnings": []} == plain
    assert body(marked, "--digits").returncode == 0


TENSOR = "part,shape,mass_kg,ixx_kg_mm2,iyy_kg_mm2,izz_kg_mm2\narm,tensor,1,{}\n"


def test_a_tensor_rounded_in_its_last_digit_is_taken(body) -> None:
    done = body(TENSOR.format("3.33,3.33,6.67"), "--json")  # 10/3, 10/3, 20/3
    assert done.returncode == 0, done.stderr
    assert "breaks the triangle inequality by 1e-08 kg·m²" in done.stderr
    assert json.loads(done.stdout)["inertia_kg_m2"][2][2] == pytest.approx(6.67e-6, rel=1e-14)


@pytest.mark.whole
@pytest.mark.parametrize("written", ["0.0", "-0.0", "−0.0", "0e−1"])
def test_the_coarsest_digit_of_a_tensor_may_stand_in_a_product_of_either_sign(body, written) -> None:
    table = TENSOR.replace("izz_kg_mm2", "izz_kg_mm2,ixy_kg_mm2").format(f"3.33,3.33,6.690,{written}")
    done = body(table)
    assert done.returncode == ("." not in written), done.stderr


def test_a_tensor_beyond_its_last_digit_is_refused_as_written(body) -> None:
    done = body(TENSOR.format("3.33,3.33,6.690"))
    assert done.returncode == 1
    assert "found '3.33'" in done.stderr
    assert "triangle inequality" in done.stderr


def test_the_tensor_about_a_point(dalembert, tmp_path) -> None:
    (tmp_path / "rod.csv").write_text("part,shape,mass_kg,length_m\nrod,rod,3,2\n")
    found = json.loads(dalembert("body", "rod.csv", "--about", "0,0,1", "--json").stdout)
    assert found["inertia_about_kg_m2"] == [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 0.0]]
    assert found["inertia_kg_m2"][0][0] == 1.0
    done = dalembert("body", "rod.csv", "--about", "1,0,1", "--only", "inertia_about", "--digits")
    assert done.stdout.splitlines()[1:] == ["x,4.0,0.0,-3.0", "y,0.0,7.0,0.0", "z,-3.0,0.0,3.0"]
    assert "inertia_about" not in dalembert("body", "rod.csv", "--fixed", "0,0,1", "--omega", "1,0,0").stdout


def test_options_of_a_motion_without_one(dalembert, tmp_path) -> None:
    (tmp_path / "rod.csv").write_text("part,shape,mass_kg,length_m\nrod,rod,3,2\n")
    for option in ("--fixed", "--frame-omega"):
        assert f"{option}: the body is at rest" in dalembert("body", "rod.csv", option, "0,0,1").stderr
        assert not dalembert(
            "body", "rod.csv", option, "0,0,1", "--omega", "0,1,0", "--only", "mass"
        ).stderr.count("rest")
    shaft = ("body", "rod.csv", "--shaft", "0mm:900mm")
    assert "the shaft is at rest and has no weight" in dalembert(*shaft).stderr
    for more in (("--gravity", "0,-9.81,0"), ("--speed", "60rpm"), ("--speed-rate", "1rad_s2")):
        assert "at rest" not in dalembert(*shaft, *more).stderr
