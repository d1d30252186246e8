"""Sweeps of many blocks of poses: CSV streams, with the digits of the sweep solved whole; the rest is limited by memory."""

from __future__ import annotations

import csv
import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import COMMAND, Dalembert
from virtualwork import Mechanism


@pytest.fixture(autouse=True)
def _klann(dalembert: Dalembert) -> None:
    dalembert("examples", "klann")


def columns(path: Path) -> dict[str, list[str]]:
    header, *rows = csv.reader(path.read_text().splitlines())
    return dict(zip(header, zip(*rows, strict=True), strict=True))  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [16384, 20000])  # the last block is of one pose, or of many
def test_the_digits_of_the_sweep_solved_whole(count: int, dalembert: Dalembert, tmp_path: Path) -> None:
    sweep = f"0deg:360deg/{count}"
    done = dalembert("mechanism", "klann.toml", "--over", sweep, "--only", "H,leg", "-o", "h.csv")
    assert done.returncode == 0, done.stderr
    found = columns(tmp_path / "h.csv")
    # each the nearest double of i·360/count
    degrees = 360.0 * np.arange(count + 1) / count
    motion = Mechanism.from_toml(tmp_path / "klann.toml").motion(np.radians(degrees), speed=10.0)
    assert np.array_equal(np.array(found["H_x_m"], dtype=float), motion.point("H").position[:, 0] + 0.0)
    assert np.array_equal(np.array(found["leg_omega_rad_s"], dtype=float), motion.link("leg").omega + 0.0)
    assert found["step"][-1] == str(count + 1)


def test_poses_that_are_not_there_are_counted_over_all_blocks(dalembert: Dalembert, tmp_path: Path) -> None:
    text = """
        [ground]
        A = [0, 0]
        D = [2, 0]
        [links.crank]
        points = { A = [0, 0], B = [2, 0] }
        [links.coupler]
        points = { B = [0, 0], C = [1, 0] }
        [links.rocker]
        points = { D = [0, 0], C = [1, 0] }
        [input]
        link = "crank"
        angle = 0.5
        [guess]
        at = 0.5
        coupler = -1
        rocker = 2
    """
    (tmp_path / "m.toml").write_text(text)
    done = dalembert("mechanism", "m.toml", "--over", "0deg:360deg/20000", "--only", "C", "-o", "c.csv")
    assert done.returncode == 0, done.stderr
    empty = columns(tmp_path / "c.csv")["C_x_m"].count("")
    assert 8192 < empty < 20001
    assert f"warning: {empty} of 20001 poses cannot be assembled" in done.stderr


def test_the_reader_of_a_pipe_may_leave(tmp_path: Path) -> None:
    begun = time.monotonic()
    call = [str(COMMAND), "mechanism", "klann.toml", "--over", "0deg:360deg/999999999", "--only", "H"]
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path) as running:
        assert running.stdout is not None
        assert running.stdout.readline().startswith(b"step,input_deg,H_x_m")
        assert running.stdout.readline().startswith(b"1,0.0,")
        running.stdout.close()
        assert running.stderr is not None
        assert running.stderr.read() == b""
    assert time.monotonic() - begun < 30


def test_json_names_the_largest_count_that_fits(dalembert: Dalembert) -> None:
    sweep = "0deg:360deg/999999999"
    done = dalembert("forces", "klann.toml", "--over", sweep, "--json")
    assert (done.returncode, done.stdout) == (1, "")
    most = re.search(r"expected at most (\d+) poses", done.stderr)
    assert most is not None
    assert int(most.group(1)) > 1000
