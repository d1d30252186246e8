"""`dalembert field`: what is said of doubtful data, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.cli.measured import FAN, HEAD, cell, runs, table
from tests.cli.printed import document
from tests.conftest import Dalembert


def test_what_is_said_of_doubtful_data(dalembert: Dalembert) -> None:
    def warnings(text: str, *options: str) -> str:
        return "\n".join(document(dalembert("field", "-", "--json", *options, stdin=text))["warnings"])

    assert "less than 30 % and 30°" in warnings(table("0,1,10,0,,,", "1,1,10.5,1,A,1,0"))
    assert "30°" not in warnings(FAN)
    zero = document(dalembert("field", "-", "--json", stdin=table("0,1,0,0,,,", "1,1,1,90,A,1,0")))
    assert zero["rotors"][0]["corrections"][0]["mass_kg"] == 0
    assert zero["rotors"][0]["corrections"][0]["angle_deg"] == 0
    assert "nothing to correct" in zero["warnings"][0]
    near = runs("A,1,0,", "B,1,0,", on=[[1, 0], [0.99, 0.02]])
    assert "nearly dependent" in warnings(near)
    assert "mean is taken" in warnings(table("0,1,3,359,,,", "0,1,3,1,,,", "1,1,8,42,A,2,0"))
    twice = document(
        dalembert("field", "-", "--json", stdin=table("0,1,3,359,,,", "0,1,3,1,,,", "1,1,8,0,A,2,0"))
    )
    assert (
        min(twice["rotors"][0]["corrections"][0]["angle_deg"] % 180, 1e-9) < 1e-9
    )  # 359° and 1° are 0°, not 180°
    tolerance = ["--grade", "G6.3", "--speed", "3000rpm", "--rotor-mass", "120kg", "--radius", "200mm"]
    good = document(dalembert("field", "-", "--json", *tolerance, stdin=FAN))
    assert good["rotors"][0]["tolerance"]["planes"][0]["within"] is True
    assert any("stop" in w for w in good["warnings"])
    assert dalembert("field", "-", *tolerance[:-2], stdin=FAN).returncode == 2


def test_a_rotor_without_a_trial_run_that_others_have(dalembert: Dalembert) -> None:
    """Rotor 2 has no trial run in plane B, rotor 3 has planes of its own."""
    both = runs("A,1,0,", "B,1,0,", on=[[1, 0], [0, 1]]).splitlines()
    one = runs("A,1,0,", on=[[1, 0]]).splitlines()
    own = runs("C,1,0,", on=[[1, 0]]).splitlines()
    rows = [f"{k},{row}" for k, lines in enumerate((both, one, own), 1) for row in lines[1:]]
    found = document(dalembert("field", "-", "--json", stdin=table(*rows, head="rotor," + both[0])))
    missing = [warning for warning in found["warnings"] if "no trial run" in warning]
    assert missing == [
        "rotor 2: no trial run in plane B, where other rotors have one: the corrections are for its other planes alone"
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (table("0,1,-1,0,,,", "1,1,1,0,A,1,0"), "row 1 (line 2), column amplitude_um: found '-1'"),
        (table("1,1,1,0,A,1,0"), "every run has a trial mass"),
        (table("0,1,1,0,,,"), "no trial run"),
        (table("0,1,1,0,,,", "1,1,1,0,,,"), "expected a positive trial mass"),
        (table("0,1,1,0,,,", "1,1,2,0,A,,0"), "column trial_mass_g: found '', expected a trial mass"),
        (table("0,1,1,0,,,", "1,1,2,0,A,0,0"), "expected a positive trial mass"),
        (table("0,1,1,0,,,", "1,1,2,0,A,-2,0"), "expected a positive trial mass"),
        (table("0,1,1,0,,,", "1,1,2,0,A,1,"), "the angle of the trial mass"),
        (table("0,1,1,0,,,", "1,1,2,0,,1,0"), "the plane of the trial mass"),
        (table("0,1,1,0,,,", "0,2,1,0,,,", "1,1,2,0,A,1,0"), "no reading of sensor 2"),
        (table("0,1,1,0,,,", "1,2,2,0,A,1,0"), "no reading of sensor 1 in run 1"),
        (table("0,1,1,0,,,", "1,1,2,0,A;B,1,0"), "2 joined by ';'"),
        (table("0,1,1,0,,,", "1,1,2,0,A;B,1;2,0;0"), "2 planes (A, B) and 1 trial run"),
        (table("0,1,1,0,,,", "1,1,2,0,A,1,0", "2,1,3,0,B,1,0"), "cannot distinguish the planes A and B"),
        (table("0,1,1,0,,,", "0,2,1,0,,,", "1,1,1,0,A,1,0", "1,2,1,0,A,1,0"), "plane A has no effect"),
        (table("0,1,1,0,,,", "0,2,1,0,,,", "1,1,2,0,A,1,0", "1,2,2,0,B,1,0"), "joined by ';'"),
        (table("0,1,1,x,,,", "1,1,2,0,A,1,0"), "expected a number"),
        (table("0,1,1,0,,,,maybe", "1,1,2,0,A,1,0,", head=HEAD + ",trial_kept"), "expected yes or no"),
        ("run,sensor,amplitude_um,phase_deg\n0,1,1,0\n", "stored influence coefficients"),
        ("sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g\n1,1,0,A,1\n", "no column run"),
        (table(head=HEAD), "no rows"),
    ],
)
def test_bad_data_is_one_line(text: str, says: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", "--json", stdin=text)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert says in done.stderr


def test_dependent_planes_in_the_middle_of_three(dalembert: Dalembert) -> None:
    """No two planes alike, the third does what the other two do together."""
    rows = ["0,1,10,0,,,", "0,2,10,90,,,", "0,3,4,50,,,"]
    columns = {"A": [1, 2j, 3], "B": [2, 1, 1j], "C": [3, 1 + 2j, 3 + 1j]}
    v0 = np.array([10, 10j, 4 * np.exp(1j * np.radians(50))])
    for r, (plane, column) in enumerate(columns.items()):
        rows += [f"{r + 1},{s + 1},{cell(v)},{plane},1,0" for s, v in enumerate(v0 + np.array(column))]
    done = dalembert("field", "-", stdin=table(*rows))
    assert done.returncode == 1
    assert "cannot distinguish the planes A and B and C" in done.stderr
    damped = dalembert("field", "-", "--json", "--ridge", "0.1", stdin=table(*rows))
    assert all(c["mass_kg"] < 1 for c in document(damped)["rotors"][0]["corrections"])


def test_amplitude_tags_do_not_mix(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("sensor,amplitude_um_pk,phase_deg\n1,0.5,90\n")
    tagged = FAN.replace("amplitude_um", "amplitude_um_pp")
    assert document(dalembert("field", "-", "--json", stdin=tagged))["amplitude_unit"] == "um_pp"
    done = dalembert("field", "-", "--runout", "r.csv", stdin=tagged)
    assert done.returncode == 1
    assert "do not mix" in done.stderr


def test_wrong_usage(dalembert: Dalembert) -> None:
    for options in (
        ["--reading-error", "2"],
        ["--reading-error", "-2%"],
        ["--method", "five-run"],
        ["--rotation", "left"],
        ["--ridge", "-1"],
        ["--monte-carlo", "10"],
        ["--report", "r.pdf"],
        ["--save-influence", "i.json"],
        ["--max-residual", "5"],
        ["--influence", "x.csv", "--from-here"],
    ):
        assert dalembert("field", "-", *options, stdin=FAN).returncode == 2, options
    assert dalembert("field").returncode == 2
    assert dalembert("field", "none.csv").returncode == 1


def test_coefficients_without_a_speed_at_several_speeds_are_remarked(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    dalembert("field", "-", "--save-influence", "one.csv", stdin=FAN)
    two = "run,sensor,speed_rpm,amplitude_um,phase_deg\n0,1,1500,3,20\n0,1,3000,4,30\n"
    done = dalembert("field", "-", "--influence", "one.csv", stdin=two)
    assert "coefficients without a speed are used at each of 2 speeds" in done.stderr
    assert done.returncode == 0
