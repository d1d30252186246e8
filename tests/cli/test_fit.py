"""`--fit`: a path of a mechanism with other dimensions is met, and the file written with them."""

from __future__ import annotations

import json

import pytest

from tests.cli.printed import rows

FOUR_BAR = """name = "four-bar"  # as drawn
[units]
length = "mm"
angle = "deg"
[ground]
A = [0, 0]
D = [100, 0]  # held
[links.crank]
points = { A = [0, 0], B = [40, 0] }
[links.coupler]
points = { B = [0, 0], C = ["12 cm", 0], H = { from = "C", length = 50, angle = 30 } }
[links.rocker]
points = { D = [0, 0], C = [80, 0] }
[input]
link = "crank"
angle = 40
[guess]
at = 40
coupler = 20
rocker = 57
"""
TRUE = ("--set", "links.crank.B.x=36", "--set", "links.coupler.C.x=117", "--set", "links.coupler.H.angle=34")
FREE = (
    *("--free", "links.crank.B.x=28:52", "--free", "links.coupler.C.x=84:156"),
    *("--free", "links.coupler.H.angle=21:39"),
)
FIT = ("fit", "m.toml", "t.csv", "--want", "H")


@pytest.fixture
def target(dalembert, tmp_path):
    """The file, and a target that the sweep of another mechanism wrote."""
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    options = (*TRUE, "--over", "0:330:30", "--only", "H", "-o", "t.csv")
    assert dalembert("mechanism", "m.toml", *options).returncode == 0
    return tmp_path / "t.csv"


def test_the_file_is_written_with_what_was_found(dalembert, target, tmp_path):
    found = dalembert(*FIT, *FREE, "-o", "fitted.toml", "--json")
    assert found.returncode == 0
    assert found.stderr == ""
    fit = json.loads(found.stdout)["fit"]
    assert fit["parameters"] == pytest.approx(
        {"links.crank.B.x_m": 0.036, "links.coupler.C.x_m": 0.117, "links.coupler.H.angle_deg": 34}, rel=1e-9
    )
    assert fit["max_m"] < 1e-10
    assert fit["rms_m"] <= fit["max_m"]
    assert fit["starts"] > 0
    assert fit["evaluations"] >= fit["starts"]
    # every line but those of the free points is as it was
    before, after = FOUR_BAR.splitlines(), (tmp_path / "fitted.toml").read_text().splitlines()
    assert [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b] == [8, 10]
    again = dalembert(
        "mechanism",
        "fitted.toml",
        "--over",
        "0:330:30",
        "--only",
        "H",
        "--expect",
        "t.csv",
        "--rtol",
        "1e-9",
    )
    assert again.returncode == 0, again.stdout


def test_without_timing_the_inputs_are_found_too(dalembert, target):
    table = rows(target.read_text())
    target.write_text(
        "x_mm,y_mm\n" + "".join(f"{1e3 * float(r['H_x_m'])},{1e3 * float(r['H_y_m'])}\n" for r in table)
    )
    found = dalembert(*FIT, *FREE)
    (row,) = rows(found.stdout)
    assert float(row["max_m"]) < 1e-10
    assert set(row) >= {"links.crank.B.x_m", "links.coupler.H.angle_deg", "rms_m", "starts", "evaluations"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--want", "H"), "expected --free"),
        (FREE, "expected --want"),
        ((*FREE, "--want", "X"), "no point, link or slide is named 'X'"),
        (
            ("--free", "links.crnk.B.x=1:2", "--want", "H"),
            "did you mean 'links.crank.B.x'",
        ),
        (("--free", "ground.D.x=3:2", "--want", "H"), "the lower bound first"),
        (("--free", "ground.D.x=3", "--want", "H"), "NAME=LOW:HIGH"),
        (("--free", "ground.D=1:2", "--want", "H"), "two numbers"),
        (("--free", "links.crank.mass=1:2", "--want", "H"), "moves no point"),
        ((*FREE, "--want", "H", "--at", "3"), "rows of the target have the inputs"),
    ],
)
def test_a_bad_option_is_named_and_nothing_is_written(dalembert, target, tmp_path, options, said):
    found = dalembert("fit", "m.toml", "t.csv", *options, "-o", "fitted.toml")
    assert found.returncode == 2
    assert said in found.stderr
    assert not found.stdout
    assert not (tmp_path / "fitted.toml").exists()


def test_the_file_is_written_with_what_was_set(dalembert, target, tmp_path):
    """A dimension that --set changes is that of the fitted mechanism: the file has it too, and meets the target."""
    sets = ("--set", "ground.D.x=90", "--set", "links.rocker.C.x=85", "--set", "input.angle=20")
    found = dalembert(*FIT, *FREE, *sets, "-o", "fitted.toml", "--json")
    assert found.returncode == 0, found.stderr
    fit = json.loads(found.stdout)["fit"]
    text = (tmp_path / "fitted.toml").read_text()
    assert "D = [90.0, 0]  # held" in text
    again = dalembert("mechanism", "fitted.toml", "--over", "0:330:30", "--only", "H")
    pairs = zip(rows(again.stdout), rows(target.read_text()), strict=True)
    squares = [(float(a[x]) - float(b[x])) ** 2 for a, b in pairs for x in ("H_x_m", "H_y_m")]
    assert (2 * sum(squares) / len(squares)) ** 0.5 == pytest.approx(fit["rms_m"], rel=1e-9)


def test_a_file_of_several_variants_is_refused(dalembert, target, tmp_path):
    found = dalembert(*FIT, *FREE, "--over", "ground.D.x=90:100:10", "-o", "fitted.toml")
    assert found.returncode == 2
    assert "'fitted.toml': expected one mechanism" in found.stderr
    assert not (tmp_path / "fitted.toml").exists()


UPRIGHT = """[units]
length = "mm"
angle = "deg"
[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], A = [50, 0] }
[links.rod]
points = { A = [0, 0], B = [170, 0] }
[[slots]]
point = "B"
link = "rod"
on = "ground"
through = "O"
angle = 90
[input]
link = "crank"
angle = 90
[guess]
at = 90
rod = 90
"""
STROKE = ("--free", "links.crank.A.x=40:90", "--free", "links.rod.B.x=100:200")


@pytest.mark.parametrize("header", ["B_y_mm", "y_mm", "b_Y_mm"])
def test_one_coordinate_is_a_target(dalembert, tmp_path, header):
    """The ends of the stroke are l + r = 210 mm above the crank and l − r = 90 mm: r = 60 mm, l = 150 mm."""
    (tmp_path / "m.toml").write_text(UPRIGHT)
    (tmp_path / "t.csv").write_text(f"input_deg,{header}\n90,210\n-90,90\n")
    found = dalembert(
        "fit", "m.toml", "t.csv", "--want", "B.y", *STROKE, "-o", "fitted.toml", "--json", "--plot", "p.svg"
    )
    assert found.returncode == 0
    assert found.stderr == ""
    fit = json.loads(found.stdout)["fit"]
    right = {"links.crank.A.x_m": 0.06, "links.rod.B.x_m": 0.15}
    assert fit["parameters"] == pytest.approx(right, rel=1e-12)
    assert {"rms_m", "max_m"} < set(fit)
    assert [each["name"] for each in fit["targets"]] == ["B.y"]
    assert "B.y, mm over the input" in (tmp_path / "p.svg").read_text()
    again = dalembert("mechanism", "fitted.toml", "--at", "90", "--at", "-90", "--only", "B.y")
    assert [float(row["B_y_m"]) for row in rows(again.stdout)] == pytest.approx([0.21, 0.09], rel=1e-12)


def test_one_coordinate_off_its_target_has_its_distance_in_metres(dalembert, tmp_path):
    """One length for both ends: r = (200 − 80)/2 mm leaves 10 mm at either; a bound on y keeps 205 mm: r = 55 mm."""
    (tmp_path / "m.toml").write_text(UPRIGHT.replace("170", "150"))
    (tmp_path / "t.csv").write_text("input_deg,B_y_mm,B_x_mm\n90,200,-\n-90,80,-\n")
    options = ("fit", "m.toml", "t.csv", "--want", "B.y", "--free", "links.crank.A.x=40:90", "--json")
    fit = json.loads(dalembert(*options).stdout)["fit"]
    assert fit["parameters"]["links.crank.A.x_m"] == pytest.approx(0.06, rel=1e-9)
    assert (fit["rms_m"], fit["max_m"]) == pytest.approx((0.01, 0.01), rel=1e-7)
    fit = json.loads(dalembert(*options, "--keep", "B.y<=205mm").stdout)["fit"]
    assert fit["parameters"]["links.crank.A.x_m"] == pytest.approx(0.055, rel=1e-7)
    assert fit["kept"] == [{"quantity": "B.y", "most": pytest.approx(0.205), "met": True}]


def test_coordinates_stand_beside_each_other_and_an_angle(dalembert, target, tmp_path):
    """A four-bar whose target another one wrote: y of the coupler point and the coupler's angle; weights by name."""
    options = (*TRUE, "--over", "0:330:30", "--only", "H,coupler.angle", "-o", "t.csv")
    assert dalembert("mechanism", "m.toml", *options).returncode == 0
    found = dalembert(
        "fit", "m.toml", "t.csv", "--want", "H.y", "--want", "H.x,coupler.angle", "--weight", "H.y=2", *FREE, "--json",
        "-o", "f.xlsx",
    )  # fmt: skip
    assert found.returncode == 0, found.stderr
    fit = json.loads(found.stdout)["fit"]
    assert fit["parameters"]["links.coupler.H.angle_deg"] == pytest.approx(34, rel=1e-9)
    assert [each["name"] for each in fit["targets"]] == ["H.y", "H.x", "coupler"]
    assert [set(each) - {"name"} for each in fit["targets"]] == [{"rms_m", "max_m"}] * 2 + [
        {"rms_deg", "max_deg"}
    ]
    openpyxl = pytest.importorskip("openpyxl")
    sheets = openpyxl.load_workbook(tmp_path / "f.xlsx")
    (headers,) = sheets["points"].iter_rows(max_row=1, values_only=True)
    assert headers[1:7] == (
        "H_y_m",
        "H_target_y_m",
        "H_y_distance_m",
        "H_x_m",
        "H_target_x_m",
        "H_x_distance_m",
    )


def test_one_number_a_row_at_free_inputs_is_doubted(dalembert, tmp_path):
    (tmp_path / "m.toml").write_text(UPRIGHT)
    (tmp_path / "t.csv").write_text("y_mm\n210\n90\n")
    found = dalembert("fit", "m.toml", "t.csv", "--want", "B.y", *STROKE)
    assert found.returncode == 0
    assert "one number a row is met by every mechanism that reaches it" in found.stderr


@pytest.mark.parametrize(
    ("want", "said"),
    [
        ("H.x,H", "'H' is given twice"),
        ("H.y,H.y", "'H.y' is given twice"),
        ("H.z", "did you mean 'H.y'"),
    ],
)
def test_a_coordinate_is_wanted_once(dalembert, target, want, said):
    found = dalembert("fit", "m.toml", "t.csv", "--want", want, *FREE)
    assert found.returncode == 2
    assert said in found.stderr


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("x_mm,y_mm\n1,2\n", "a target of one point"),
        ("x_mm\n1\n2\n", "no column y_m"),
        ("x_mm,y_mm\n1,2\nNaN,3\n", "row 2 (line 3), column x_mm"),
    ],
)
def test_a_bad_target_is_one_line_and_nothing_is_written(dalembert, target, tmp_path, table, said):
    target.write_text(table)
    found = dalembert(*FIT, *FREE, "-o", "fitted.toml")
    assert found.returncode == 1
    assert said in found.stderr
    assert found.stderr.count("\n") == 1
    assert not (tmp_path / "fitted.toml").exists()


def test_a_link_and_a_point_with_weights(dalembert, target, tmp_path):
    options = (*TRUE, "--over", "0:330:30", "--only", "H,rocker", "-o", "t.csv")
    assert dalembert("mechanism", "m.toml", *options).returncode == 0
    found = dalembert(*FIT, "--want", "rocker.angle", "--weight", "rocker=0.5", *FREE, "--json")
    assert found.returncode == 0, found.stderr
    fit = json.loads(found.stdout)["fit"]
    assert fit["max_m"] < 1e-10
    assert fit["max_deg"] < 1e-8
    assert [set(each) for each in fit["targets"]] == [
        {"name", "rms_m", "max_m"},
        {"name", "rms_deg", "max_deg"},
    ]
    assert [each["name"] for each in fit["targets"]] == ["H", "rocker"]
    point, link = fit["targets"]
    assert (point["rms_m"], link["rms_deg"]) == (fit["rms_m"], fit["rms_deg"])
    # a table of its own with the short header, and as many rows as it has
    (tmp_path / "r.csv").write_text(
        "input_deg,angle_deg,weight\n"
        + "".join(
            f"{r['input_deg']},{r['rocker_angle_deg']},2\n"
            for r in rows((tmp_path / "t.csv").read_text())[::3]
        )
    )
    again = dalembert(*FIT, "r.csv", "--want", "rocker.angle", *FREE, "--text")
    assert again.returncode == 0, again.stderr
    assert "Misses:" in again.stdout
    assert "\nrocker " in again.stdout


def test_the_options_of_the_search(dalembert, target, tmp_path):
    found = dalembert(*FIT, *FREE, "--starts", "16", "--best", "3", "--plot", "fit.svg", "--json")
    assert found.returncode == 0, found.stderr
    fit = json.loads(found.stdout)["fit"]
    assert fit["starts"] == 16
    assert "<svg" in (tmp_path / "fit.svg").read_text()
    told = "fit: --best 3 finds 1 distinct solution"
    others = fit.get("others", [])
    assert all(each["max_m"] >= fit["max_m"] for each in others)
    assert (told in found.stderr) == (not others)


@pytest.mark.slow
def test_workers_find_the_same(dalembert, target):
    alone, two = (dalembert(*FIT, *FREE, *more) for more in ((), ("--workers", "2")))
    assert two.stdout == alone.stdout


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        (("--want", "rockr"), 2, "did you mean 'rocker'"),
        (("--want", "B.position"), 2, "no point, link or slide is named 'B.position'"),
        (("--want", "H", "--want", "H"), 2, "given twice"),
        (("--want", "H", "--weight", "H=-1"), 2, "0 or more"),
        (("--want", "H", "--weight", "C=1"), 2, "expected one of H"),
        (("--want", "H", "--starts", "0"), 2, "--starts"),
        (("--want", "H", "--best", "0"), 2, "--best"),
        (("--want", "rocker.angle"), 1, "no column"),
        (("--want", "H", "--want", "C"), 1, "no columns of C"),
        (("--want", "H", "nothing.csv"), 1, "nothing.csv"),
    ],
)
def test_a_bad_name_or_number_is_one_line(dalembert, target, tmp_path, options, status, said):
    found = dalembert("fit", "m.toml", "t.csv", *options, *FREE, "-o", "fitted.toml")
    assert found.returncode == status
    assert said in found.stderr
    assert not found.stdout
    assert "Traceback" not in found.stderr
    assert not (tmp_path / "fitted.toml").exists()


def test_the_example_finds_scott_russells_mechanism(dalembert):
    dalembert("examples", "straight-line-fit")
    free = ("links.crank.A.x=70:115", "links.rod.P.x=-130:-80", "links.rod.P.y=-15:15")
    options = [word for path in free for word in ("--free", path)]
    found = dalembert("fit", "straight-line.toml", "line.csv", "--want", "P", *options)
    (row,) = rows(found.stdout)
    # crank, rod and its extension are equal: then the point is on the line exactly
    numbers = [float(row[f"{path.split('=')[0]}_m"]) for path in free]
    assert numbers == pytest.approx([0.1, -0.1, 0], abs=1e-12)
    assert float(row["max_m"]) < 1e-12


BAR = """gravity = [0, -9.81]
[ground]
O = [0, 0]
T = [0, 0.5]
[links.bar]
points = { O = [0, 0], K = [0.3, 0] }
mass = 2  # kg
center = [0.5, 0]
[input]
link = "bar"
angle = 0
[guess]
at = 0
[[springs]]
between = ["bar.K", "ground.T"]
stiffness = "10 N/m"
free_length = 0
"""


def test_a_spring_for_a_torque(dalembert, tmp_path):
    """k a h = m g r; the file is written with it, its own units and comments as they were."""
    (tmp_path / "bar.toml").write_text(BAR)
    (tmp_path / "none.csv").write_text("input_deg,torque_N_mm\n-60,0\n0,0\n45,0\n")
    call = (
        "fit",
        "bar.toml",
        "none.csv",
        "--want",
        "bar.torque",
        "--free",
        "springs.1.stiffness=1N_per_m:1000N_per_m",
    )
    done = dalembert(*call, "--json", "-o", "new.toml")
    assert done.returncode == 0, done.stderr
    (stiffness,) = json.loads(done.stdout)["fit"]["parameters"].values()
    assert stiffness == pytest.approx(65.4, rel=1e-12)
    assert json.loads(done.stdout)["fit"]["max_N_m"] < 1e-12
    written = (tmp_path / "new.toml").read_text()
    assert "mass = 2  # kg" in written
    assert 'N/m"' in written or "N_per_m" in written
    after = dalembert("forces", "new.toml", "--over=-60deg:60deg:20deg", "--only", "bar.torque", "--json")
    assert all(abs(pose["effort"]["input_torque_N_m"]) < 1e-12 for pose in json.loads(after.stdout)["poses"])


@pytest.mark.usefixtures("target")
def test_bounds_are_kept_and_named(dalembert):
    """As the contract has it; wrong ones are one line that names what is expected."""
    kept = ("--keep", "transmission>=33deg", "--keep", "H.y<=140mm", "--keep", "coupler.angle ≥ -30")
    done = dalembert(*FIT, *FREE, *kept, "--starts", "16", "--json")
    assert done.returncode == 0, done.stderr
    fit = json.loads(done.stdout)["fit"]
    assert [each["quantity"] for each in fit["kept"]] == ["transmission", "H.y", "coupler.angle"]
    assert fit["kept"][0].keys() == {"quantity", "least", "met"}
    assert fit["kept"][0]["least"] >= 33 - 1e-6
    assert fit["kept"][1]["most"] <= 0.14 + 1e-9
    assert all(each["met"] for each in fit["kept"])
    for wrong, said in (
        ("transmision>=40deg", "did you mean 'transmission'"),
        ("transmission=40deg", "expected QUANTITY>=VALUE"),
        ("transmission<=40deg", "expected transmission>=ANGLE"),
        ("transmission>=95deg", "from 0deg to 90deg"),
        ("H.y<=5kg", "5kg"),
    ):
        done = dalembert(*FIT, *FREE, "--keep", wrong)
        assert (done.returncode, done.stdout) == (2, "")
        assert said in " ".join(done.stderr.split())
    done = dalembert(*FIT, *FREE, "--keep", "transmission>=89deg", "--starts", "4")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert "keeps transmission >= 89 deg (it comes to" in done.stderr


def test_a_target_of_two_points_that_differ_in_case_alone(dalembert, tmp_path):
    (tmp_path / "m.toml").write_text(
        "[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], H = [1, 0], h = [2, 0] }\n[input]\nlink = 'arm'\nangle = 0\n"
    )
    (tmp_path / "t.csv").write_text("input_deg,H_x_m,H_y_m,h_x_m,h_y_m\n0,1.5,0,2.5,0\n90,0,1.5,0,2.5\n")
    for name, expected in (("H", 1.5), ("h", 2.5)):
        found = dalembert(
            "fit", "m.toml", "t.csv", "--want", name, "--free", f"links.arm.{name}.x=1:5", "--starts", "8"
        )
        assert float(rows(found.stdout)[0][f"links.arm.{name}.x_m"]) == pytest.approx(expected)


def test_the_table_of_forces_is_a_target_of_the_effort(dalembert, tmp_path):
    """Of a triad too, which has no closed form: the mass and its place are those of the mechanism that made the table."""
    assert dalembert("examples", "stephenson-six-bar").returncode == 0
    weights = "gravity = [0, -9.81]\n[units]", "[links.coupler]\nmass = {}\ncenter = [{}, 20]"
    text = (tmp_path / "stephenson.toml").read_text()
    for name, numbers in (("true.toml", (2, 40)), ("begun.toml", (1, 25))):
        changed = text.replace("[units]", weights[0], 1).replace(
            "[links.coupler]", weights[1].format(*numbers)
        )
        (tmp_path / name).write_text(changed)
    sweep = ("--over", "0deg:330deg:30deg", "--only", "crank.torque", "-o", "t.csv")
    assert dalembert("forces", "true.toml", *sweep).returncode == 0
    free = ("--free", "links.coupler.mass=0.5:4", "--free", "links.coupler.center.x=10mm:60mm")
    found = dalembert("fit", "begun.toml", "t.csv", "--want", "crank.torque", *free, "--starts", "8")
    assert (found.returncode, found.stderr) == (0, "")
    (row,) = rows(found.stdout)
    assert float(row["links.coupler.mass_kg"]) == pytest.approx(2)
    assert float(row["links.coupler.center.x_m"]) == pytest.approx(0.04)
