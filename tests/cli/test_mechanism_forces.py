"""`dalembert mechanism --forces` and its kin as a user runs them, and the states it hands to `dalembert work`."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Dalembert
from tests.four_bars import body, four_bar

FOUR_BAR = four_bar(
    body(1, (10, 3), 1e-3),
    body(2, (40, 10), 2e-3),
    body(1.5, (30, -10), 1e-3),
    head='name = "four-bar"\ngravity = [0, -9.81]',
    rates='speed = "30 rad/s"',
    more="""[[torques]]
link = "crank"
torque = 2
[[springs]]
between = ["coupler.C", "ground.A"]
stiffness = 200
free_length = 50
damping = 3
""",
)

CYLINDER = """
gravity = [0, -9.81]
[ground]
A = [0, 0]
D = [1, 0]
[links.boom]
points = { A = [0, 0], B = [0.5, 0.1], T = [2, 0] }
mass = 30
center = [1, 0]
inertia = 4
[links.tube]
points = { D = [0, 0] }
mass = 3
center = [0.2, 0]
[links.rod]
points = { B = [0, 0] }
mass = 2
center = [-0.2, 0]
inertia = 0.1
[[sliders]]
point = "B"
link = "rod"
on = "tube"
through = "D"
[input]
slider = "B"
position = 0.7
speed = 0.2
[guess]
at = 0.7
boom = 20
tube = 2
"""

FIVE_BAR = """
gravity = [0, -9.81]
[units]
angle = "deg"
[ground]
A = [0, 0]
E = [2, 0]
[links.left]
points = { A = [0, 0], B = [1, 0] }
mass = 1
center = [0.5, 0]
inertia = 0.08
[links.right]
points = { E = [0, 0], D = [1, 0] }
mass = 1
center = [0.5, 0]
inertia = 0.08
[links.one]
points = { B = [0, 0], C = [1.5, 0] }
mass = 2
center = [0.7, 0]
inertia = 0.3
[links.two]
points = { D = [0, 0], C = [1.5, 0] }
[[input]]
link = "left"
angle = 110
speed = 2
[[input]]
link = "right"
angle = 60
speed = -1
acceleration = 3
[guess]
at = [110, 60]
one = 40
two = 140
"""


def run_json(dalembert: Dalembert, command: str, *arguments: str, stdin: str = "") -> Any:
    done = dalembert(command, *arguments, "--json", stdin=stdin)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_json_of_forces(dalembert: Dalembert) -> None:
    found = run_json(dalembert, "forces", "-", "--at", "40deg", "--at", "200deg", stdin=FOUR_BAR)
    for pose in found["poses"]:
        effort = pose["effort"]
        assert effort["input_torque_N_m"] == pytest.approx(effort["virtual_work_torque_N_m"], rel=1e-12)
        assert [(r["joint"], r["on"], r["from"]) for r in pose["reactions"]] == [
            ("A", "crank", "ground"),
            ("D", "rocker", "ground"),
            ("B", "coupler", "crank"),
            ("C", "rocker", "coupler"),
        ]
        assert set(pose["reactions"][0]) == {"joint", "on", "from", "fx_N", "fy_N", "moment_N_m"}
        assert set(pose["shaking"]) == {"fx_N", "fy_N", "moment_N_m"}
    assert "cycle" not in found


def test_only_restricts_the_reactions(dalembert: Dalembert) -> None:
    found = run_json(dalembert, "forces", "-", "--only", "C", stdin=FOUR_BAR)
    (pose,) = found["poses"]
    assert [r["joint"] for r in pose["reactions"]] == ["C"]


def test_three_links_at_a_pin(dalembert: Dalembert) -> None:
    text = FOUR_BAR + "\n[links.arm]\npoints = { C = [0, 0], F = [90, 0] }\nmass = 0.4\ncenter = [40, 0]\n"
    text += "[links.last]\npoints = { H = [0, 0], F = [110, 0] }\n"
    text = text.replace("D = [100, 0]", "D = [100, 0]\nH = [200, 20]").replace(
        "rocker = 57", "rocker = 57\narm = 10\nlast = 70"
    )
    (pose,) = run_json(dalembert, "forces", "-", stdin=text)["poses"]
    rows = [r for r in pose["reactions"] if r["joint"] == "C"]
    assert [(r["on"], r["from"]) for r in rows] == [("coupler", "pin"), ("rocker", "pin"), ("arm", "pin")]
    size = max(abs(r["fx_N"]) for r in rows)
    assert abs(sum(r["fx_N"] for r in rows)) <= 1e-12 * size
    assert abs(sum(r["fy_N"] for r in rows)) <= 1e-12 * size


def test_cycle_and_flywheel(dalembert: Dalembert) -> None:
    found = run_json(
        dalembert, "forces", "-", "--over", "0deg:360deg:2deg", "--flywheel", "0.05", stdin=FOUR_BAR
    )
    cycle = found["cycle"]
    assert set(cycle) >= {
        "mean_torque_N_m", "peak_torque_N_m", "rms_torque_N_m", "work_J", "energy_closure_J", "flywheel_inertia_kg_m2",
    }  # fmt: skip
    torque = [pose["effort"]["input_torque_N_m"] for pose in found["poses"]]
    assert cycle["mean_torque_N_m"] == pytest.approx(sum(torque[:-1]) / 180, rel=1e-12)
    # between the poses: `test_cycles_of_time_and_turns.py` compares it with dense sweeps
    assert max(map(abs, torque)) <= cycle["peak_torque_N_m"] <= 1.01 * max(map(abs, torque))
    assert cycle["work_J"] == pytest.approx(cycle["mean_torque_N_m"] * 2 * math.pi, rel=1e-14)
    assert abs(cycle["energy_closure_J"]) <= 1e-12 * cycle["peak_torque_N_m"]
    without = run_json(dalembert, "forces", "-", "--over", "0deg:360deg:2deg", stdin=FOUR_BAR)["cycle"]
    assert without["flywheel_inertia_kg_m2"] is None
    assert cycle["flywheel_inertia_kg_m2"] > 0


@pytest.mark.parametrize("text", [FOUR_BAR, CYLINDER, FIVE_BAR], ids=["four-bar", "cylinder", "five-bar"])
def test_work_reads_the_states_that_mechanism_writes(dalembert: Dalembert, tmp_path: Path, text: str) -> None:
    (tmp_path / "m.toml").write_text(text)
    assert dalembert("forces", "m.toml", "--states", "states.csv").returncode == 0
    effort = run_json(dalembert, "forces", "m.toml")["poses"][0]["effort"]
    done = dalembert("work", "states.csv", "--gravity", "0,-9.81", "--json")
    assert done.returncode == 0, done.stderr
    (step,) = json.loads(done.stdout)["steps"]
    if "inputs" in effort:
        for unknown in step["unknowns"]:
            assert unknown["value"] == pytest.approx(
                effort["inputs"][unknown["name"]]["virtual_work_torque_N_m"], rel=1e-12
            )
    elif "input_force_N" in effort:
        size = math.hypot(*(u["value"] for u in step["unknowns"][:2]))
        assert size == pytest.approx(abs(effort["input_force_N"]), rel=1e-12)
        assert effort["input_force_N"] == pytest.approx(effort["virtual_work_force_N"], rel=1e-12)
    else:
        assert step["unknowns"][0]["value"] == pytest.approx(effort["input_torque_N_m"], rel=1e-12)


def test_counterweights(dalembert: Dalembert) -> None:
    found = run_json(
        dalembert,
        "forces",
        "-",
        "--over",
        "0deg:360deg:5deg",
        "--counterweights",
        "crank,rocker",
        stdin=FOUR_BAR,
    )
    part = found["counterweights"]
    assert part["shaking_rms_after_N"] <= 1e-12 * part["shaking_rms_before_N"]
    assert [w["link"] for w in part["weights"]] == ["crank", "rocker"]


def test_explain_names_what_is_left_out(dalembert: Dalembert) -> None:
    text = FOUR_BAR.replace('speed = "30 rad/s"', "").replace("center = [10, 3]", "center = [0, 0]")
    done = dalembert("inspect", "-", "--text", stdin=text)
    cells = [re.split(r" {2,}", line.strip()) for line in done.stdout.splitlines()]
    assert ["crank", "crank: weight", "does no work"] in cells
    absent = cells[cells.index(["Absent loads:"]) :]
    assert any(row[0].startswith("no inertia loads") for row in absent)
    assert "joint forces (action and reaction) do no work" in done.stdout


def test_a_change_point_is_said_and_spoils_no_other_pose(dalembert: Dalembert) -> None:
    text = four_bar(
        *(body(1, (x, 0)) for x in (0.5, 1, 0.5)),
        lengths=(1, 2, 1, 2),
        length="m",
        head="gravity = [0, -9.81]",
        at=60,
        guess={"coupler": 0, "rocker": 60},
    )
    found = run_json(
        dalembert, "forces", "-", "--at", "60deg", "--at", "180deg", "--at", "240deg", stdin=text
    )
    torques = [pose["effort"]["virtual_work_torque_N_m"] for pose in found["poses"]]
    # the parallelogram: every centre of mass falls with the crank
    exact = [9.81 * 2 * math.cos(math.radians(a)) for a in (60, 180, 240)]
    assert torques == pytest.approx(exact, rel=1e-12)
    assert found["poses"][1]["effort"]["input_torque_N_m"] is None
    assert found["poses"][1]["reactions"][2]["fx_N"] is None
    assert any("180 deg" in line and "joint forces" in line for line in found["warnings"])
    assert found["poses"][2]["effort"]["input_torque_N_m"] == pytest.approx(exact[2], rel=1e-12)


BAD = {
    "flywheel alone": (["--flywheel", "0.02"], 2, "expected a cycle too"),
    "negative flywheel": (
        ["--flywheel", "-1", "--over", "0deg:360deg:9deg"],
        2,
        "positive speed fluctuation",
    ),
    "counterweight": (
        ["--counterweights", "coupler", "--over", "0deg:360deg:9deg"],
        1,
        "does not turn about a pin",
    ),
    "unknown link": (["--counterweights", "krank", "--over", "0deg:360deg:9deg"], 2, "unknown link 'krank'"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_calls_are_one_line(dalembert: Dalembert, case: str) -> None:
    options, status, expected = BAD[case]
    done = dalembert("forces", "-", *options, stdin=FOUR_BAR)
    assert done.returncode == status
    assert expected in done.stderr
    assert status == 2 or len(done.stderr.splitlines()) == 1


def test_bad_friction_joint(dalembert: Dalembert) -> None:
    done = dalembert(
        "forces",
        "-",
        stdin=FOUR_BAR + '[[friction]]\njoint = "B"\ncoefficient = 0.1\nradius = 5\n',
    )
    assert done.returncode == 0
    bad = (
        FOUR_BAR.replace("C = [120, 0]", "C = [120, 0], Z = [5, 5]")
        + '[[friction]]\njoint = "Z"\ncoefficient = 0.1\n'
    )
    done = dalembert("forces", "-", stdin=bad)
    assert done.returncode == 1
    assert "'Z' is no joint" in done.stderr


@pytest.mark.parametrize("name", ["crank-press", "scissors-lift", "engine", "toggle-clamp", "desk-lamp"])
@pytest.mark.slow
def test_examples_run(dalembert: Dalembert, tmp_path: Path, name: str) -> None:
    shown = dalembert("examples", name).stdout.splitlines()
    command = shown[shown.index("run:") + 1].split()[1:]
    done = dalembert(*command)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" or name == "desk-lamp"
    if name == "desk-lamp":
        assert "the loads balance in every position" in done.stderr


def test_scissors_lift_in_closed_form(dalembert: Dalembert) -> None:
    """The thrust is W cot θ, with cos θ = x/1.2."""
    dalembert("examples", "scissors-lift")
    for x in (1.1, 0.5):
        (pose,) = run_json(dalembert, "forces", "lift.toml", "--at", f"{x}m")["poses"]
        exact = -400 * 9.81 * x / math.sqrt(1.44 - x * x)
        assert pose["effort"]["input_force_N"] == pytest.approx(exact, rel=1e-12)
        assert pose["effort"]["virtual_work_force_N"] == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("bad", ["800,-inf", "1e60242,6", "800,nan"])
def test_a_force_table_holds_finite_numbers(bad: str, dalembert, tmp_path) -> None:
    """Found by fuzzing: examples `engine` and `crank-press` with one number too large."""
    assert dalembert("examples", "engine").returncode == 0
    table = tmp_path / "gas.csv"
    table.write_text(table.read_text() + bad + "\n")
    done = dalembert("forces", "engine.toml", "--at", "100deg")
    assert done.returncode == 1
    assert "expected" in done.stderr
    assert "number" in done.stderr


def test_a_number_beyond_all_measure(dalembert, tmp_path) -> None:
    """Found by fuzzing: a point of the Klann leg at 1e308 mm."""
    assert dalembert("examples", "klann").returncode == 0
    klann = tmp_path / "klann.toml"
    assert "B = [0, 0]" in klann.read_text()
    klann.write_text(klann.read_text().replace("B = [0, 0]", "B = [0, 1e308]"))
    done = dalembert("mechanism", "klann.toml", "--at", "60deg")
    assert done.returncode == 1
    assert "1e+308" in done.stderr


def test_parallel_guides_are_named(dalembert, tmp_path) -> None:
    """Found by fuzzing: the scotch yoke whose slot lies along its guide."""
    assert dalembert("examples", "scotch-yoke").returncode == 0
    yoke = tmp_path / "yoke.toml"
    yoke.write_text(yoke.read_text().replace("angle = 90\n", ""))
    done = dalembert("mechanism", "yoke.toml", "--at", "60deg")
    assert done.returncode == 1
    assert "parallel" in done.stderr


def test_newton_where_the_pose_cannot_be_assembled(dalembert, tmp_path) -> None:
    """Found by fuzzing: a Klann leg that no closed form assembles; its Newton-Raphson table has no difference."""
    assert dalembert("examples", "klann").returncode == 0
    klann = tmp_path / "klann.toml"
    klann.write_text(klann.read_text().replace("E = [290, 230]", "E = [-7.575, 230]"))
    done = dalembert("mechanism", "klann.toml", "--at", "60deg", "--newton", "--json")
    assert done.returncode == 1
    assert "RuntimeWarning" not in done.stderr
    document = json.loads(done.stdout)
    assert document["poses"][0]["assembled"] is False
    assert document["newton_difference_rad"] is None


@pytest.mark.parametrize("damping", [0, 2])
def test_a_spring_whose_ends_meet_has_no_direction(
    damping: float, dalembert: Dalembert, tmp_path: Path
) -> None:
    """Nothing is printed of what it does there, nor made of the rounding of its length, and the reason is said."""
    (tmp_path / "m.toml").write_text(
        f"""ground = {{ O = [0, 0], S = [1, 0] }}
links.crank.points = {{ O = [0, 0], P = [1, 0] }}
input = {{ link = "crank", angle = "30deg", speed = {damping} }}
[[springs]]
between = ["P", "S"]
stiffness = 100
free_length = 0.5
damping = {damping}
"""
    )
    named = "the ends of [[springs]] 1 coincide: its force has no direction"
    for poses in (
        ["--at", "0deg"],
        ["--at", "0deg", "--at", "90deg"],
        ["--at", "360deg"],
        ["--at", "-360deg"],
    ):
        for more in ([], ["--digits"]):
            done = dalembert("forces", "m.toml", *poses, *more)
            assert done.returncode == 0
            assert named in done.stderr
            assert "RuntimeWarning" not in done.stderr
            assert "dead point" not in done.stderr
            row, *others = csv.DictReader(io.StringIO(done.stdout))
            assert row["input_torque_N_m"] == row["O_ground_on_crank_fx_N"] == ""
            assert all(float(other["input_torque_N_m"]) > 0 for other in others)
    for study in ("equilibrium", "inspect"):
        assert "RuntimeWarning" not in dalembert(study, "m.toml").stderr
