"""Every worked example runs as its own line says, and its expected values hold."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from cli.examples import describe, names
from tests.conftest import Dalembert


def test_the_list_has_one_line_each(dalembert: Dalembert) -> None:
    lines = dalembert("examples").stdout.splitlines()
    assert [line.split()[0] for line in lines] == names()
    assert "riul-rotor" in names()
    assert all(len(line) <= 120 for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_an_example_runs(name: str, dalembert: Dalembert, tmp_path: Path) -> None:
    about = describe(name)
    assert about["source"]
    assert "\n" not in about["line"]
    done = dalembert("examples", name)
    assert done.returncode == 0
    assert about["command"] in done.stdout
    program, *arguments = shlex.split(about["command"])
    assert program == "dalembert"
    ran = dalembert(*arguments)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout or ran.stderr or len(list(tmp_path.iterdir()))
    if (tmp_path / "expected.csv").exists():
        checked = dalembert(*arguments, "--expect", "expected.csv")
        assert checked.returncode == 0, checked.stdout + checked.stderr
    # a second time changes nothing, over another file nothing is written
    assert dalembert("examples", name).returncode == 0
    written = next(
        line.removeprefix("wrote ") for line in done.stdout.splitlines() if line.startswith("wrote ")
    )
    (tmp_path / written).write_text("mine")
    again = dalembert("examples", name)
    assert again.returncode == 1
    assert (tmp_path / written).read_text() == "mine"


@pytest.mark.slow
def test_one_example_after_another_in_one_folder(dalembert: Dalembert) -> None:
    for name in names():
        assert dalembert("examples", name).returncode == 0


def test_an_unknown_example(dalembert: Dalembert) -> None:
    done = dalembert("examples", "riul-roto")
    assert done.returncode == 1
    assert "did you mean 'riul-rotor'?" in done.stderr


def test_the_expected_values_of_another_example_are_kept(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    before = (tmp_path / "expected.csv").read_text()
    for _ in range(2):
        done = dalembert("examples", "riul-rotor")
        assert done.returncode == 0
        assert "wrote riul-rotor-expected.csv" in done.stdout
    assert (tmp_path / "expected.csv").read_text() == before
    expected = ("--expect", "riul-rotor-expected.csv")
    rotor = ("rotor.csv", "--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm", "--gravity", "10")
    assert dalembert("balance", *rotor, *expected).returncode == 0
