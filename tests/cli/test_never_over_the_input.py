"""No output is written over an input of the same call: status 2, and the input is as it was."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.conftest import COMMAND, Dalembert

RUNS = """run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg
0,1,50,30,,,
1,1,60,80,A,5,0
"""
CRANK = """
[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], P = [1, 0] }
mass = 1
[input]
link = "crank"
law = "law.csv"
[[forces]]
link = "crank"
point = "P"
table = "gas.csv"
"""


@pytest.fixture(autouse=True)
def _files(tmp_path: Path) -> None:
    (tmp_path / "runs.csv").write_text(RUNS)
    (tmp_path / "m.toml").write_text(CRANK)
    (tmp_path / "law.csv").write_text("time_s;angle_deg\n0;0\n0,5;10\n1;25,5\n2;60\n")
    (tmp_path / "gas.csv").write_text("angle_deg\tfx_N\n0\t-1,5\n90\t3\n")


def refused(done: CompletedProcess[str], name: str) -> None:
    assert done.returncode == 2, done.stderr
    assert f"'{name}' is an input" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize("option", ["-o", "--save-influence"])
@pytest.mark.parametrize("link", [None, "symbolic", "hard"])
def test_runs_are_kept(option: str, link: str | None, dalembert: Dalembert, tmp_path: Path) -> None:
    name = "runs.csv" if link is None else "other.csv"
    if link == "symbolic":
        (tmp_path / name).symlink_to("runs.csv")
    elif link == "hard":
        os.link(tmp_path / "runs.csv", tmp_path / name)
    refused(dalembert("field", "runs.csv", option, name, "--report", "page.html"), name)
    assert (tmp_path / "runs.csv").read_text() == RUNS
    assert not (tmp_path / "page.html").exists()


def test_what_standard_input_is_read_from_is_kept(tmp_path: Path) -> None:
    with (tmp_path / "runs.csv").open("rb") as runs:
        done = subprocess.run(
            [str(COMMAND), "field", "-", "-o", "runs.csv"],
            stdin=runs,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            check=False,
        )
    refused(done, "runs.csv")
    assert (tmp_path / "runs.csv").read_text() == RUNS


@pytest.mark.parametrize("name", ["law.csv", "gas.csv"])
@pytest.mark.parametrize("option", ["-o", "--states"])
def test_tables_beside_a_mechanism_are_kept(
    option: str, name: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    before = (tmp_path / name).read_text()
    refused(dalembert("forces", "m.toml", option, name), name)
    assert (tmp_path / name).read_text() == before


def test_expected_values_are_kept(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "e.csv").write_text("step,link,angle_deg\n1,crank,0\n")
    refused(dalembert("mechanism", "m.toml", "--expect", "e.csv", "-o", "e.csv"), "e.csv")


def test_one_file_for_two_outputs(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert("forces", "m.toml", "--states", "s.csv", "-o", "./s.csv")
    assert done.returncode == 2
    assert "given twice" in done.stderr
    assert not (tmp_path / "s.csv").exists()


def test_decimal_commas_in_the_tables_of_a_mechanism(dalembert: Dalembert, tmp_path: Path) -> None:
    shown = dalembert("forces", "m.toml")
    assert shown.returncode == 0, shown.stderr
    (tmp_path / "law.csv").write_text("time_s,angle_deg\n0,0\n0.5,10\n1,25.5\n2,60\n")
    (tmp_path / "gas.csv").write_text("angle_deg,fx_N\n0,-1.5\n90,3\n")
    assert dalembert("forces", "m.toml").stdout == shown.stdout
    # 2.500 beside 1,5 may be 2500
    (tmp_path / "gas.csv").write_text("angle_deg;fx_N\n0;-1,5\n90;2.500\n")
    done = dalembert("forces", "m.toml")
    assert done.returncode == 1
    assert (
        "gas.csv: row 2 (line 3), column fx_N: found '2.500', expected a number with a decimal comma"
        in done.stderr
    )


def test_a_spring_between_plain_names(dalembert: Dalembert, tmp_path: Path) -> None:
    spring = "[[springs]]\nbetween = [{}]\nstiffness = 5\n"
    base = CRANK.replace("O = [0, 0]\n[links", "O = [0, 0]\nS = [0, 3]\n[links")
    texts = [
        base + spring.format(ends) for ends in ('"P", "S"', '"crank.P", "ground.S"', '"P", "O"', '"P", "Q"')
    ]
    plain, named, doubled, unknown = (dalembert("forces", "-", stdin=text) for text in texts)
    assert plain.returncode == 0, plain.stderr
    assert plain.stdout == named.stdout
    assert doubled.returncode == 1
    assert '"ground.O" or "crank.O"' in doubled.stderr
    assert unknown.returncode == 1


@pytest.mark.parametrize("end", ["[0, 0]", "{ link = 'crank' }", "5"])
def test_a_spring_at_no_name(dalembert: Dalembert, end: str) -> None:
    text = f"{CRANK}[[springs]]\nbetween = [{end}, 'crank.P']\n"
    done = dalembert("forces", "-", stdin=text)
    assert (done.returncode, len(done.stderr.splitlines())) == (1, 1)
    assert "[[springs]] 1 between: found" in done.stderr
    assert "expected a link and its point such as" in done.stderr
