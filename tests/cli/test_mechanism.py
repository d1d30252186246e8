"""`dalembert mechanism` as a user runs it, with good files and bad ones."""

from __future__ import annotations

import csv
import io
import json
import math
from importlib.resources import files
from pathlib import Path

import pytest

from tests.cli.printed import document as answer
from tests.conftest import Dalembert

EXAMPLES = Path(str(files("cli") / "examples"))
KLANN = EXAMPLES / "klann" / "klann.toml"
FOUR = """
[ground]
A = [0, 0]
D = [4, 0]
[links.crank]
points = { A = [0, 0], B = [2, 0] }
[links.coupler]
points = { B = [0, 0], C = [5, 0] }
[links.rocker]
points = { D = [0, 0], C = [2, 0] }
[input]
link = "crank"
speed = 1
[guess]
at = "180 deg"
coupler = 0.3
rocker = 2.0
"""


def test_one_pose_as_json(dalembert: Dalembert) -> None:
    found = answer(
        dalembert("mechanism", KLANN, "--at", "60deg", "--order", "acceleration", "--newton", "--json")
    )
    (pose,) = found["poses"]
    assert found["name"] == "Klann leg"
    assert (pose["input_deg"], pose["branch"], pose["assembled"], pose["marks"]) == (60.0, 1, True, [])
    assert pose["condition"] > 1
    assert pose["links"]["coupler"]["angle_deg"] == pytest.approx(360 - 10.65945524124986, rel=1e-14)
    assert pose["links"]["leg"]["alpha_rad_s2"] == pytest.approx(-11.5982907, abs=1e-6)
    assert set(pose["points"]["H"]) == {"x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2"}
    assert pose["points"]["H"]["x_m"] == pytest.approx(0.7960057379415451, rel=1e-13)
    assert [row["k"] for row in found["iterates"]][:3] == [1, 2, 3]
    # the guess as the file has it
    assert found["iterates"][0]["coupler_deg"] == -15
    assert found["iterates"][1]["leg_deg"] == pytest.approx(-45.70461199396262, rel=1e-12)
    assert found["iterates"][1]["residual_m"] == pytest.approx(0.010746883121656163, rel=1e-12)
    assert found["newton_difference_rad"] < 1e-14
    inspected = answer(dalembert("inspect", KLANN, "--json"))
    assert set(inspected) == {"name", "check", "warnings"}
    check = inspected["check"]
    assert (check["mobility"], check["mobility_by_rank"], check["redundant"]) == (1, 1, [])
    assert check["groups"][0]["links"] == ["coupler", "rocker"]
    assert check["groups"][0]["method"] == "closed form"
    assert check["four_bars"][0]["links"] == ["crank", "coupler", "rocker"]
    assert check["four_bars"][0]["grashof"] == "crank-rocker"
    assert check["input_limits_deg"] is None
    assert (check["dead_points_deg"], check["change_points_deg"]) == ([], [])
    assert found["warnings"] == []


def test_a_sweep_includes_its_end_and_only_what_is_asked(dalembert: Dalembert) -> None:
    for span, count in (
        ("0deg:360deg:1deg", 361),
        ("0deg:360deg/24", 25),
        ("0deg:100deg:30deg", 4),
        ("90deg:-90deg:-45deg", 5),
    ):
        found = answer(dalembert("mechanism", KLANN, "--over", span, "--only", "H", "--json"))
        assert len(found["poses"]) == count, span
        assert set(found["poses"][0]["points"]) == {"H"}
        assert "links" not in found["poses"][0]
    assert found["poses"][-1]["input_deg"] == -90
    done = dalembert("mechanism", KLANN, "--over", "0deg:90deg:45deg", "--only", "H,rocker")
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [row["input_deg"] for row in rows] == ["0.0", "45.0", "90.0"]
    assert list(rows[0])[2:] == [
        "H_x_m",
        "H_y_m",
        "H_vx_m_s",
        "H_vy_m_s",
        "rocker_angle_deg",
        "rocker_omega_rad_s",
    ]


def test_inspect_shows_the_order_of_solution(dalembert: Dalembert) -> None:
    text = dalembert("inspect", KLANN, "--text").stdout
    order = text[text.index("Order of solution:") :]
    assert "group coupler + rocker  RRR, closed form" in order
    assert (
        order.index("angle of crank") < order.index("group coupler + rocker") < order.index("group arm + leg")
    )


def test_inspect_shows_short_tables(dalembert: Dalembert) -> None:
    """What is there once is a list, and each stroke has one row; CSV has a row for each number."""
    text = dalembert("inspect", KLANN, "--text").stdout
    lines = [line.split() for line in text.splitlines()]
    assert ["mobility", "1"] in lines
    assert ["grashof", "crank-rocker"] in lines
    assert ["name", "least_m", "at_deg", "most_m", "most_at_deg"] in lines
    assert ["B.x", "-0.12", "180", "0.12", "0"] in lines
    assert ["name", "least_deg", "at_deg", "most_deg", "most_at_deg"] in lines
    assert sum(line[:1] == ["rocker.angle"] for line in lines) == 1
    numbers = dalembert("inspect", KLANN).stdout
    assert all(f"{key}_m,B.x," in numbers for key in ("least", "most"))


def test_states_table(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert(
        "forces",
        KLANN,
        "--at",
        "60deg",
        "--at",
        "70deg",
        "--states",
        "states.csv",
    )
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO((tmp_path / "states.csv").read_text())))
    assert [(row["step"], row["link"]) for row in rows][:6] == [
        ("1", "crank"), ("1", "coupler"), ("1", "rocker"), ("1", "arm"), ("1", "leg"), ("2", "crank"),
    ]  # fmt: skip
    assert rows[0]["torque_N_m"].startswith("?")
    assert float(rows[2]["omega_rad_s"]) == pytest.approx(8.26873953, abs=1e-8)


def test_every_assembly(dalembert: Dalembert) -> None:
    found = answer(dalembert("mechanism", KLANN, "--at", "60deg", "--branch", "all", "--json"))
    assert [pose["branch"] for pose in found["poses"]] == [1, 2, 3, 4]
    assert len({round(pose["points"]["H"]["x_m"], 9) for pose in found["poses"]}) == 4
    second = answer(dalembert("mechanism", KLANN, "--at", "60deg", "--branch", "2", "--json"))
    assert second["poses"][0]["points"] == found["poses"][1]["points"]


def test_poses_that_do_not_exist(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "four.toml").write_text(FOUR)
    found = answer(
        dalembert(
            "mechanism",
            "four.toml",
            "--at",
            "20deg",
            "--at",
            "180deg",
            "--at",
            "46.567463442210616deg",
            "--json",
        )
    )
    missing, there, edge = found["poses"]
    assert missing["assembled"] is False
    assert missing["links"]["rocker"] == {"angle_deg": None, "omega_rad_s": None}
    assert missing["points"]["C"]["x_m"] is None
    assert there["assembled"] is True
    assert "limit" in edge["marks"]
    limit = math.degrees(math.acos((2**2 + 4**2 - 3**2) / (2 * 2 * 4)))
    assert any("cannot be assembled" in w and f"{limit:.10g}"[:10] in w for w in found["warnings"])
    found = answer(dalembert("inspect", "four.toml", "--json"))
    assert found["check"]["input_limits_deg"] == pytest.approx([limit, 360 - limit], abs=1e-10)
    assert found["check"]["dead_points_deg"] == pytest.approx([limit, 360 - limit], abs=1e-10)
    alone = dalembert("mechanism", "four.toml", "--at", "20deg", "--json")
    assert alone.returncode == 1
    assert json.loads(alone.stdout)["poses"][0]["assembled"] is False


def test_change_points_are_marked_and_both_branches_named(dalembert: Dalembert) -> None:
    toml = EXAMPLES / "parallelogram" / "parallelogram.toml"
    check = answer(dalembert("inspect", toml, "--json"))["check"]
    found = answer(dalembert("mechanism", toml, "--over", "0deg:720deg:90deg", "--json"))
    assert [pose["marks"] for pose in found["poses"]] == [["change point"], [], ["change point"], [], ["change point"],
                                                           [], ["change point"], [], ["change point"]]  # fmt: skip
    for pose in found["poses"]:
        assert pose["links"]["rocker"]["omega_rad_s"] == pytest.approx(1, abs=1e-12)
    assert check["change_points_deg"] == pytest.approx([0, 180], abs=1e-9)
    assert "the other branch" in found["warnings"][0]


def test_each_change_point_has_its_own_other_branch(dalembert: Dalembert) -> None:
    """In line, B and C move across it and the second derivatives of the loop balance along it."""
    toml = EXAMPLES / "parallelogram" / "parallelogram.toml"
    lines = dalembert("mechanism", toml, "--over", "0deg:360deg:90deg").stderr.splitlines()
    assert len(lines) == 2
    # the crank of 40 mm, the coupler of 100 mm and the rocker of 40 mm point along x, the crank and the rocker to and fro
    for line, at, side in zip(lines, ("0", "180"), (1, -1), strict=True):
        assert line.startswith(f"warning: change point at {at} deg: the branches of coupler + rocker cross")
        coupler, rocker = (
            float(rate.split(" = ")[1]) for rate in line.rpartition("would have ")[2].split(", ")
        )
        assert side * 40 + 100 * coupler == pytest.approx(side * 40 * rocker, rel=1e-5)
        assert side * 40 + 100 * coupler**2 == pytest.approx(side * 40 * rocker**2, rel=1e-5)
        assert coupler != pytest.approx(0)


def test_several_inputs(dalembert: Dalembert, tmp_path: Path) -> None:
    toml = EXAMPLES / "five-bar" / "five-bar.toml"
    found = answer(dalembert("mechanism", toml, "--at", "left=110deg,right=65deg", "--json"))
    assert found["poses"][0]["inputs"] == {"left": {"input_deg": 110.0}, "right": {"input_deg": 65.0}}
    table = answer(dalembert("mechanism", toml, "--cases", EXAMPLES / "five-bar" / "inputs.csv", "--json"))
    assert len(table["poses"]) == 6
    swept = answer(
        dalembert("mechanism", toml, "--over", "left=100deg:120deg:10deg", "--at", "right=60deg", "--json")
    )
    assert [pose["inputs"]["left"]["input_deg"] for pose in swept["poses"]] == [100, 110, 120]
    bare = dalembert("mechanism", toml, "--at", "60deg")
    assert bare.returncode == 2


def test_a_slide_as_input(dalembert: Dalembert) -> None:
    toml = EXAMPLES / "boom" / "boom.toml"
    found = answer(dalembert("mechanism", toml, "--at", "500mm", "--json"))
    (pose,) = found["poses"]
    assert pose["input_m"] == 0.5
    assert pose["slides"]["R"] == {"position_m": 0.5, "speed_m_s": 0.06, "acceleration_m_s2": 0.0}
    assert "input_limits_m" in answer(dalembert("inspect", toml, "--json"))["check"]


def test_standard_input_and_pictures(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert(
        "mechanism", "-", "--at", "60deg", "--only", "H", "--plot", "a.svg", stdin=KLANN.read_bytes()
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.svg").read_text().startswith("<?xml")
    done = dalembert(
        "mechanism", KLANN, "--over", "0deg:360deg:30deg", "--plot", "b.png", "--only", "H.x,coupler.omega"
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "b.png").stat().st_size > 10_000
    done = dalembert("mechanism", KLANN, "--plot", "c.png", "--only", "H.q")
    assert done.returncode == 2
    assert not (tmp_path / "c.png").exists()


BAD = {
    "unit": ("B = [2, 0]", 'B = ["2 kg", 0]', ["[links.crank] points.B", "'2 kg'", "length"]),
    "table": ("[input]", "[inputt]", ["unknown table or key 'inputt'", "did you mean 'input'"]),
    "key": ("speed = 1", "sped = 1", ["[input]", "'sped'", "'speed'"]),
    "guess name": ("rocker = 2.0", "roker = 2.0", ["[guess] roker", "did you mean 'rocker'"]),
    "driven name": ('link = "crank"', 'link = "krank"', ["[input] link", "'krank'"]),
    "zero length": ("B = [2, 0]", "B = [0, 0]", ["[links.crank]", "zero length"]),
    "no guess": ("coupler = 0.3\nrocker = 2.0\n", "", ["[guess]", "2 ways", "coupler"]),
    "free": ("D = [0, 0], C", "E = [0, 0], C", ["free degree of freedom", "rocker"]),
    "structure": ('[input]', '[links.brace]\npoints = { A = [0, 0], C = [9, 0] }\n[input]', ["brace", "structure"]),
    "negative mass": ("[links.rocker]", "[links.rocker]\nmass = -1", ["[links.rocker] mass", "-1"]),
    "toml": ("[input]", "[input", ["no valid TOML"]),
    "from": ("C = [5, 0]", 'C = { from = "X", length = 1, angle = 0 }', ["points.C from", "'X'"]),
    "slot": ("[guess]", '[[slots]]\npoint = "C"\nlink = "rocker"\non = "nobody"\n[guess]', ["[[slots]] 1", "'nobody'"]),
    "no input": ('[input]\nlink = "crank"\nspeed = 1\n', "", ["[input]", "nothing drives"]),
    "nan": ("B = [2, 0]", "B = [nan, 0]", ["points.B", "nan"]),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_one_line_with_its_place(case: str, dalembert: Dalembert, tmp_path: Path) -> None:
    old, new, words = BAD[case]
    assert old in FOUR
    text = FOUR.replace(old, new)
    (tmp_path / "bad.toml").write_text(text)
    done = dalembert("mechanism", "bad.toml", "--at", "90deg", "-o", "out.csv")
    assert done.returncode == 1
    assert done.stdout == ""
    lines = [line for line in done.stderr.splitlines() if not line.startswith("warning")]
    assert len(lines) == 1
    assert "bad.toml" in lines[0]
    for word in words:
        assert word in lines[0], lines[0]
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    "arguments",
    [("--order", "snap"), ("--at", "60mm"), ("--at", "60kg"), ("--over", "0deg:360deg"), ("--over", "0deg:360deg/0"),
     ("--over", "0deg:10deg:-1deg"), ("--branch", "x"), ("--branch", "0"), ("-o", "x.txt"), ("--plot", "x.gif"),
     ("--at", "rocker=60deg"), ("--only", ","), ("--nonsense",)],
)  # fmt: skip
def test_wrong_usage_is_status_2(arguments: tuple[str, ...], dalembert: Dalembert) -> None:
    done = dalembert("mechanism", KLANN, *arguments)
    assert done.returncode == 2
    assert done.stdout == ""


def test_missing_file_name_and_assembly(dalembert: Dalembert) -> None:
    assert dalembert("mechanism", "nothing.toml").returncode == 1
    done = dalembert("mechanism", KLANN, "--only", "Q")
    assert done.returncode == 2
    assert "'Q'" in done.stderr
    assert dalembert("mechanism", KLANN, "--branch", "9").returncode == 1
    assert dalembert("mechanism", "-", stdin=b"\xff\xfe\x00").returncode == 1
