"""`dalembert mechanism`: what was asked for is what standard output and -o show, as one table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.printed import rows
from tests.conftest import Dalembert
from tests.four_bars import body, four_bar

FOUR_BAR = four_bar(
    coupler=body(2, (0.04, 0.01)),
    lengths=(0.04, 0.12, 0.08, 0.1),
    length="m",
    head="gravity = [0, -9.81]",
    rates='speed = "30 rad/s"',
)
SWEEP = ("--over", "0deg:360deg:10deg")


@pytest.fixture(autouse=True)
def _file(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)


def test_output_holds_what_standard_output_shows(dalembert: Dalembert, tmp_path: Path) -> None:
    call = ("forces", "m.toml", *SWEEP)
    shown = dalembert(*call).stdout
    assert "input_torque_N_m" in shown
    assert dalembert(*call, "-o", "forces.csv", "--states", "states.csv").stdout == ""
    assert (tmp_path / "forces.csv").read_text() == shown
    # the link states beside them are those of a call without --forces
    dalembert("forces", "m.toml", *SWEEP, "--states", "alone.csv")
    assert (tmp_path / "states.csv").read_text() == (tmp_path / "alone.csv").read_text()


def test_without_only_a_pipe_gets_every_pose_of_every_point_and_link(dalembert: Dalembert) -> None:
    (*_, last) = shown = rows(dalembert("mechanism", "m.toml", *SWEEP).stdout)
    assert [row["input_deg"] for row in shown] == [f"{angle:.1f}" for angle in range(0, 361, 10)]
    of_all = rows(dalembert("mechanism", "m.toml", *SWEEP, "--only", "A,B,C,D,crank,coupler,rocker").stdout)
    assert {name.split("_")[0] for name in last} == {"step", "input", *"ABCD", "crank", "coupler", "rocker"}
    assert shown == of_all
    pose = json.loads(dalembert("mechanism", "m.toml", *SWEEP, "--json").stdout)["poses"][-1]
    assert float(last["C_x_m"]) == pose["points"]["C"]["x_m"]
    assert float(last["coupler_angle_deg"]) == pose["links"]["coupler"]["angle_deg"]


@pytest.mark.parametrize("angle", ["60", "0.1", "-80", "123.456789012345", "1e-9", "359.99"])
def test_degrees_that_are_read_print_back(angle: str, dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR.replace("angle = 40", f"angle = {angle}"))
    (row,) = rows(dalembert("mechanism", "m.toml", "--only", "crank").stdout)
    assert float(row["input_deg"]) == float(angle)
    assert float(row["crank_angle_deg"]) == float(angle) % 360


@pytest.mark.parametrize("rtol", ["nan", "-1e-3", "inf"])
def test_a_tolerance_is_a_number_from_0_on(rtol: str, dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_text("C_x_m\n1\n")
    done = dalembert("mechanism", "m.toml", "--expect", "e.csv", "--rtol", rtol)
    assert done.returncode == 2
    assert "expected a number, at least 0" in done.stderr


def test_states_beside_json(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert("forces", "m.toml", "--only", "C", "--json", "--states", "states.csv")
    assert "C" in json.loads(done.stdout)["poses"][0]["points"]
    assert "torque_N_m" in (tmp_path / "states.csv").read_text().splitlines()[0]


def test_check_in_a_pipe(dalembert: Dalembert) -> None:
    check = json.loads(dalembert("inspect", "m.toml", "--json").stdout)["check"]
    shown = rows(dalembert("inspect", "m.toml").stdout)
    value = {(row["quantity"], row["of"]): row["value"] for row in shown}
    assert value["mobility", ""] == "1"
    (bar,) = check["four_bars"]
    assert value["grashof", ", ".join(bar["links"])] == bar["grashof"]
    assert float(value["least_transmission_deg", ", ".join(bar["links"])]) == bar["transmission_deg"][0]


@pytest.mark.parametrize("options", [["--flywheel", "0.02"], ["--counterweights", "crank"]])
def test_a_command_has_one_table_in_a_pipe(options: list[str], dalembert: Dalembert) -> None:
    """The cycle and the counterweights stand in JSON; the CSV is that of the poses."""
    assert (
        dalembert("forces", "m.toml", *SWEEP, *options).stdout == dalembert("forces", "m.toml", *SWEEP).stdout
    )
    document = json.loads(dalembert("forces", "m.toml", *SWEEP, *options, "--json").stdout)
    assert document["cycle" if options[0] == "--flywheel" else "counterweights"]


def test_equilibria_are_a_table(dalembert: Dalembert) -> None:
    listed = json.loads(dalembert("equilibrium", "m.toml", "--json").stdout)["equilibria"]
    shown = rows(dalembert("equilibrium", "m.toml").stdout)
    assert [float(row["potential_J"]) for row in shown] == [part["potential_J"] for part in listed]


def test_flywheel_has_one_input(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text("""
        [ground]
        A = [0, 0]
        [links.a]
        points = { A = [0, 0], B = [1, 0] }
        [links.b]
        points = { B = [0, 0], C = [1, 0] }
        [[input]]
        link = "a"
        [[input]]
        link = "b"
    """)
    done = dalembert("forces", "two.toml", "--at", "a=0deg", "--over", "b=0deg:90deg:1deg", "--flywheel", "1")
    assert done.returncode == 1
    assert "one input" in done.stderr


def test_expected_values_are_found_by_their_input(dalembert: Dalembert, tmp_path: Path) -> None:
    call = ("mechanism", "m.toml", *SWEEP, "--only", "C")
    x = {row["input_deg"]: row["C_x_m"] for row in rows(dalembert(*call).stdout)}
    (tmp_path / "e.csv").write_text(f"C_x_m,input_deg\n{x['90.0']},90\n{x['20.0']},20\n{x['360.0']},360\n")
    assert dalembert(*call, "--expect", "e.csv").returncode == 0
    (tmp_path / "e.csv").write_text(f"C_x_m,input_deg\n{x['90.0']},95\n")
    done = dalembert(*call, "--expect", "e.csv")
    assert done.returncode == 1
    assert "no (further) row with input_deg 95" in done.stderr


def test_expected_poses_beside_another_table(dalembert: Dalembert, tmp_path: Path) -> None:
    (row,) = rows(dalembert("mechanism", "m.toml").stdout)
    # as the poses have it, and as the table of link states has it
    for expected in ("coupler_angle_deg\n", "link,angle_deg\ncoupler,"):
        (tmp_path / "e.csv").write_text(f"{expected}{row['coupler_angle_deg']}\n")
        for options in ((), ("--newton",)):
            assert dalembert("mechanism", "m.toml", *options, "--expect", "e.csv").returncode == 0
    (tmp_path / "e.csv").write_text("quantity,of,value\nmobility,,1\n")
    assert dalembert("inspect", "m.toml", "--expect", "e.csv").returncode == 0
    (tmp_path / "e.csv").write_text("quantity,of,value\nmobility,,2\n")
    assert dalembert("inspect", "m.toml", "--expect", "e.csv").returncode == 1


def test_digits_beside_another_table(dalembert: Dalembert) -> None:
    some, whole = (
        rows(dalembert("equilibrium", "m.toml", *options).stdout) for options in (["--digits"], [])
    )
    for one, full in zip(some, whole, strict=True):
        assert len(one.pop("input_deg")) < len(full.pop("input_deg"))
        assert one.pop("stable") == full.pop("stable")
        assert one.keys() == full.keys() == {"potential_J", "period_s"}
        for key, cut in one.items():
            assert len(cut) <= len(full[key])
            assert bool(cut) == bool(full[key])
            assert not cut or float(cut) == pytest.approx(float(full[key]), rel=1e-13)
    assert dalembert("equilibrium", "m.toml", "--digits", "--text").returncode == 0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("t_s,crank_deg\n0,1\n0.1,2\n0.2,4\n", "column t_s: expected at least 4 rows"),
        ("t_s,crank_deg\n0,1\n0.1,2\n0.3,4\n0.2,5\n", "column t_s: expected rows with rising time"),
        ("t_s,time_s,crank_deg\n0,0,1\n", "the column of time stands twice (time_s, t_s): expected it once"),
    ],
)
def test_a_wrong_column_of_time_is_named_as_the_file_has_it(
    table: str, message: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_text(table)
    for name, stdin in (("t.csv", ""), ("-", table)):
        done = dalembert("mechanism", "m.toml", "--cases", name, stdin=stdin)
        assert done.returncode == 1
        file = "standard input" if name == "-" else name
        assert done.stderr.startswith(f"dalembert: {file}: {message}")


def test_a_short_law_of_motion_names_the_mechanism(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "law.csv").write_text("t_s,angle_deg\n0,1\n1,2\n2,4\n")
    (tmp_path / "m.toml").write_text(FOUR_BAR.replace('speed = "30 rad/s"', 'law = "law.csv"'))
    done = dalembert("mechanism", "m.toml")
    assert done.returncode == 1
    assert done.stderr.startswith("dalembert: m.toml: [input] law: expected at least 4 rows")


def test_a_column_of_time_beside_no_input_is_said_to_do_nothing(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(
        '[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], B = [1, 0] }\n[input]\nlink = "arm"\nangle = 0\nspeed = 2\n'
    )

    def said(header: str, *rows: str) -> str:
        (tmp_path / "c.csv").write_text("\n".join([header, *rows]) + "\n")
        found = dalembert("mechanism", "arm.toml", "--cases", "c.csv", "--only", "arm.omega")
        assert found.returncode == 0
        return found.stderr

    rows = ("0,1", "1,2", "2,4", "3,7")
    assert "the column t_s has no effect" in said("t_s,links.arm.B.x_m", *rows)
    assert said("t_s,arm_rad", *rows) == ""
    assert said("t_s,arm_rad,links.arm.B.x_m", *(f"{row},1" for row in rows)) == ""
