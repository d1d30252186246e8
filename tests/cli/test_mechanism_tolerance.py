"""`--tolerance` and `--draws`: what [tolerances] do to every number shown."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.cli.printed import rows
from tests.four_bars import body, four_bar

FILE = four_bar(
    body(0.5, (20, 0)),
    body(0.4),
    points=', H = { from = "C", length = 50, angle = 30 }',
    head='name = "four-bar"\ngravity = [0, -9.81]',
    rates="speed = 10",
    more="[tolerances]",
)
LIMITS = """
"links.crank.B.x" = 0.05
"links.coupler.C" = "0.1 mm"
links.coupler.H.angle = "0.2 deg"
"links.crank.mass" = "5 g"
"""


@pytest.fixture
def file(tmp_path):
    def write(limits=LIMITS):
        (tmp_path / "m.toml").write_text(FILE + limits)
        return "m.toml"

    return write


def test_every_number_has_its_spread_and_shares_that_sum_to_one(dalembert, file):
    options = ("--over", "0:360:60", "--only", "H,rocker", "--json")
    found = json.loads(dalembert("tolerance", file(), *options).stdout)
    its = found["tolerance"]
    assert set(its) == {"columns", "shares"}
    headers = [f"H_{key}" for key in ("x_m", "y_m", "vx_m_s", "vy_m_s")] + [
        "rocker_angle_deg",
        "rocker_omega_rad_s",
    ]
    assert list(its["columns"]) == headers
    paths = [
        "links.crank.B.x",
        "links.coupler.C.x",
        "links.coupler.C.y",
        "links.coupler.H.angle",
        "links.crank.mass",
    ]
    for header in headers:
        shares = {s["path"]: np.array(s["share"]) for s in its["shares"] if s["column"] == header}
        assert list(shares) == paths
        np.testing.assert_allclose(sum(shares.values()), 1.0, rtol=1e-12)
        worst, sd = (np.array(its["columns"][header][key]) for key in ("worst", "sd"))
        assert worst.shape == (7,)
        # between one dimension that does it all, and all that do alike
        assert (worst <= 3 * sd * np.sqrt(5) * (1 + 1e-12)).all()
        assert (worst >= 3 * sd * (1 - 1e-12)).all()
        assert not shares["links.crank.mass"].any()


def test_the_spread_is_what_the_changed_files_say(dalembert, file):
    """Worst case and standard deviation from the file with each number a little larger and smaller."""
    options = ("--at", "40")
    whole = rows(
        dalembert("tolerance", file(), *options, "--only", "crank.torque,crank.virtual_work_torque").stdout
    )[0]
    limits = {"links.crank.B.x": 0.05, "links.coupler.C.x": 0.1, "links.coupler.C.y": 0.1,
              "links.coupler.H.angle": 0.2, "links.crank.mass": 0.005}  # fmt: skip
    start = {"links.crank.B.x": 40, "links.coupler.C.x": 120, "links.coupler.C.y": 0,
             "links.coupler.H.angle": 30, "links.crank.mass": 0.5}  # fmt: skip
    moved = []
    for path, limit in limits.items():
        ends = [
            rows(
                dalembert(
                    "forces", "m.toml", *options, "--set", f"{path}={start[path] + side * limit / 10}"
                ).stdout
            )[0]
            for side in (-1, 1)
        ]
        header = "virtual_work_torque_N_m"
        moved.append((float(ends[1][header]) - float(ends[0][header])) / 2 * 10)
    worst, sd = (float(whole[f"virtual_work_torque_{what}_N_m"]) for what in ("worst", "sd"))
    assert abs(worst / np.abs(moved).sum() - 1) < 1e-5
    assert abs(sd / (np.sqrt(np.square(moved).sum()) / 3) - 1) < 1e-5


def test_drawn_mechanisms_agree_with_the_first_order(dalembert, file):
    options = (
        "--at",
        "40",
        "--only",
        "H,coupler",
        "--order",
        "position",
        "--draws",
        "4000",
        "--seed",
        "5",
        "--json",
    )
    found = json.loads(dalembert("tolerance", file(), *options).stdout)["tolerance"]
    assert found["drawn"]["assembled"] == 1.0
    assert found["drawn"]["draws"] == 4000
    for header, its in found["drawn"]["columns"].items():
        sd = found["columns"][header]["sd"][0]
        assert set(its) == {"mean", "sd", "p0.135", "p99.865", "p0.135_error", "p99.865_error"}
        # six sampling errors
        assert abs(its["sd"][0] / sd - 1) < 6 / np.sqrt(8000) + 2e-3
        assert abs((its["p99.865"][0] - its["p0.135"][0]) / (6 * sd) - 1) < 0.2
    again = json.loads(dalembert("tolerance", "m.toml", *options).stdout)["tolerance"]
    assert again == found
    other = json.loads(dalembert("tolerance", "m.toml", *options[:-3], "--seed", "6", "--json").stdout)[
        "tolerance"
    ]
    assert other["columns"] == found["columns"]
    assert other["drawn"] != found["drawn"]


@pytest.mark.parametrize("option", [("--seed", "0"), ("--seed", "5"), ("--distribution", "normal")])
def test_options_of_draws_without_draws_are_refused(dalembert, file, option):
    done = dalembert("tolerance", file(), *option)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"Invalid value for {option[0]}: needs --draws" in done.stderr
    drawn = ("--draws", "20", "--at", "40", "--only", "C.x")
    assert dalembert("tolerance", "m.toml", *drawn, *option).returncode == 0
    if option[1] != "5":
        assert (
            dalembert("tolerance", "m.toml", *drawn, *option).stdout
            == dalembert("tolerance", "m.toml", *drawn).stdout
        )


def test_near_a_limit_the_difference_is_said(dalembert, tmp_path):
    """A crank that just passes: coupler and rocker reach 100.02 mm beyond it where 100 are needed."""
    text = FILE.replace("[100, 0]", "[159.98, 0]")
    (tmp_path / "m.toml").write_text(text + '"links.coupler.C.x" = "0.05 mm"\n')
    found = dalembert(
        "tolerance", "m.toml", "--at", "180", "--only", "H", "--order", "position", "--draws", "500"
    )
    assert found.returncode == 0
    assert "linear estimate unreliable at input 180 deg" in found.stderr
    assert "% of the drawn mechanisms cannot be assembled" in found.stderr


def test_poses_that_the_mechanism_itself_lacks_do_not_count_as_drawn_ones(dalembert, tmp_path):
    """Beyond the limit nothing can be assembled, drawn or not; the share is that of the other poses."""
    text = FILE.replace("[100, 0]", "[159.98, 0]")
    (tmp_path / "m.toml").write_text(text + '"links.coupler.C.x" = "0.05 mm"\n')
    options = ("tolerance", "m.toml", "--only", "H", "--order", "position", "--draws", "500", "--json")
    beyond = ("--set", "ground.D.x=161mm", "--at", "180")
    one, both, none = (
        dalembert(*options, *at) for at in (("--at", "60", *beyond[:2]), ("--at", "60", *beyond), beyond)
    )
    shares = [json.loads(of.stdout)["tolerance"]["drawn"]["assembled"] for of in (one, both, none)]
    assert shares == [1.0, 1.0, 0.0]
    assert [of.returncode for of in (one, both, none)] == [0, 0, 1]
    assert "drawn mechanisms cannot be assembled" not in both.stderr


def test_the_picture_is_written(dalembert, file, tmp_path):
    options = ("--over", "0:360:30", "--only", "H", "--plot")
    assert dalembert("tolerance", file(), *options, "t.svg").returncode == 0
    text = (tmp_path / "t.svg").read_text()
    assert "<svg" in text
    assert dalembert("tolerance", "m.toml", *options[:2], "--plot", "f.png").returncode == 0


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ('"links.crnak.B.x" = 1', "did you mean 'links.crank.B.x'"),
        ('"links.coupler.H.x" = 1', "expected links.coupler.H.length"),
        ('"links.crank.B.x" = -1', "a limit of zero or more"),
        ('"links.crank.B.x" = "3 kg"', "a length such as"),
        ('"links.crank.B.x" = nan', "a length such as"),
    ],
)
def test_a_bad_limit_is_one_line(dalembert, file, limits, said):
    found = dalembert("tolerance", file(limits), "-o", "out.csv")
    assert found.returncode == 1
    assert "[tolerances]" in found.stderr
    assert said in found.stderr
    assert found.stderr.count("\n") == 1


def test_a_file_without_tolerances_and_options_that_do_not_go_with_it(dalembert, file):
    assert dalembert("tolerance", file("")).returncode == 1
    for options in (
        ("--draws", "1"),
        ("--check",),
    ):
        assert dalembert("tolerance", "m.toml", *options).returncode == 2


def test_a_pose_that_cannot_be_assembled_is_status_1_with_its_picture_too(dalembert, file):
    done = dalembert("tolerance", file(), "--at", "0deg", "--set", "links.crank.B.x=900", "--plot", "p.svg")
    assert done.returncode == 1
    assert "cannot be assembled" in done.stderr
    assert "RuntimeWarning" not in done.stderr


def test_digits_of_worst_case_and_standard_deviation(dalembert, file):
    """At 0° x is r + l: 0.05 mm and 0.1 mm of limits are 0.15 mm, to the last digit; drawn numbers are as they are, with a word."""
    text = """
[units]
length = "mm"
[ground]
A = [0, 0]
[links.crank]
points = { A = [0, 0], B = [50, 0] }
[links.rod]
points = { B = [0, 0], C = [150, 0] }
[[slots]]
point = "C"
angle = 0
[input]
link = "crank"
[guess]
at = 0
rod = -0.1
[tolerances]
"links.crank.B.x" = "0.05 mm"
"links.rod.C.x" = "0.1 mm"
"""
    call = ("tolerance", "-", "--at", "0rad", "--at", "1rad", "--only", "C.x,rod.angle", "--digits")
    found = dalembert(*call, stdin=text)
    assert (found.returncode, found.stderr) == (0, "")
    first, second = rows(found.stdout)
    assert first["C_x_worst_m"] == "0.00015"
    assert 10 < len(second["C_x_worst_m"].replace("0.000", "")) < 17
    drawn = dalembert(*call, "--draws", "50", stdin=text)
    assert "numbers of drawn mechanisms are printed in full" in drawn.stderr
    row = rows(drawn.stdout)[1]
    # an angle lies within its turn, drawn or not
    assert abs(float(row["rod_angle_drawn_mean_deg"]) - float(row["rod_angle_deg"])) < 0.1


def test_one_pose_on_a_terminal_has_a_row_for_each_quantity(dalembert, file):
    options = (file(), "--at", "60deg", "--only", "H,crank", "--draws", "8")
    (whole,) = rows(dalembert("tolerance", *options, "--units", "mm").stdout)
    lines = [
        line.split()
        for line in dalembert("tolerance", *options, "--units", "mm", "--text").stdout.splitlines()
    ]
    assert next(x for x in lines if x[:1] == ["quantity"])[:4] == [
        "quantity",
        "value_mm",
        "worst_mm",
        "sd_mm",
    ]
    for name, header, unit in (("H.x", "H_x", "mm"), ("H.vy", "H_vy", "m_s")):
        (row,) = (line for line in lines if line[:1] == [name])
        cells = [f"{header}{middle}_{unit}" for middle in ("", "_worst", "_sd", "_drawn_mean", "_drawn_sd")]
        assert row[1:6] == [f"{float(whole[cell]):.6g}" for cell in cells]
    # the angle of the crank is set, so that it has no spread
    assert not any(line[:1] == ["crank.angle"] for line in lines)
    several = dalembert("tolerance", file(), "--at", "60deg", "--at", "90deg", "--only", "H", "--text").stdout
    assert "H_x_worst_m" in several


def test_without_a_number_that_varies_one_pose_has_its_row(dalembert, file):
    run = dalembert("tolerance", file(), "--at", "60deg", "--only", "crank", "--text")
    assert "crank_angle_deg" in run.stdout
    assert "none of the numbers shown depends" in run.stderr
