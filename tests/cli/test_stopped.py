"""The command in a terminal's hands: how far it is, Ctrl-C, and workers that are killed. Real processes, real signals."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.conftest import TAKES_CTRL_C

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc"),
]
FOUR_BAR = """
ground = { A = [0, 0], D = [0.1, 0] }
input = { link = "crank", speed = 10 }
guess = { at = 0.7, coupler = 0.3, rocker = 1.0 }
[links]
crank.points = { A = [0, 0], B = [0.04, 0] }
coupler.points = { B = [0, 0], C = [0.12, 0], H = [0.08, 0.05] }
rocker.points = { D = [0, 0], C = [0.08, 0] }
"""
PARTS = 12
# of 65 536 rows each
VARY = f"links.crank.B.x=0.035:0.045/{PARTS * 182 - 1}"
CALL = ["mechanism", "m.toml", "--over", VARY, "--over", "0deg:359deg:1deg"]


@pytest.fixture
def begun(tmp_path):
    """Begin the command in an empty folder; its standard error is a terminal."""
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    all_of_them = []

    def begin(*options):
        own, its = pty.openpty()
        process = subprocess.Popen(
            [*TAKES_CTRL_C, *CALL, *options], cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=its,
        )  # fmt: skip
        os.close(its)
        all_of_them.append((process, own))
        return process, own

    yield begin
    for process, own in all_of_them:
        process.kill()
        process.wait()
        os.close(own)


def ended(process, terminal):
    """Wait for its end; return what it wrote on its terminal."""
    said = b""
    while True:
        try:
            part = os.read(terminal, 4096)
        except OSError:
            part = b""
        said += part
        if not part:
            break
    process.wait(timeout=60)
    return said.decode()


def workers(process):
    """The workers that run now, by their numbers."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == process.pid and b"spawn_main" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except (OSError, ValueError, IndexError):
            continue
    return found


def at_work(process, count):
    """Wait until so many workers have taken a second of the processor each; return them."""
    deadline = time.monotonic() + 100
    while time.monotonic() < deadline and process.poll() is None:
        busy = []
        for pid in workers(process):
            try:
                times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
            except OSError:
                continue
            if sum(map(int, times)) >= os.sysconf("SC_CLK_TCK"):
                busy.append(pid)
        if len(busy) >= count:
            return busy
        time.sleep(0.02)
    raise AssertionError("no workers at work")


def test_how_far_it_is_stands_on_a_terminal_and_is_wiped_away(begun, tmp_path):
    process, terminal = begun("-o", "v.csv", "--workers", "2")
    said = ended(process, terminal)
    assert process.returncode == 0
    lines = said.split("\r")
    steps = [int(line.split()[0]) for line in lines if "of 2184 variants, " in line]
    assert steps == sorted(steps)
    assert all(0 < step <= 2184 for step in steps)
    assert steps, "work of less than two seconds"
    assert lines[-1] == ""
    assert lines[-2].strip() == ""


@pytest.mark.parametrize("output", ["v.csv", "v.parquet", "v.json"])
def test_ctrl_c_ends_all_workers_and_leaves_nothing(begun, tmp_path, output):
    # of Parquet this process writes the file: with more numbers the workers take longer than a second each
    more = ("--order", "jerk") if output == "v.parquet" else ()
    process, terminal = begun("-o", output, "--workers", "2", *more)
    its = at_work(process, 2)
    process.send_signal(signal.SIGINT)
    said = ended(process, terminal)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert said.rpartition("\r")[2] == ""
    assert not any(Path(f"/proc/{pid}").exists() for pid in its)
    assert [path.name for path in tmp_path.iterdir()] == ["m.toml"]


@pytest.mark.parametrize("output", ["v.csv", "v.parquet"])
def test_the_part_of_a_killed_worker_is_done_again(begun, tmp_path, output):
    # the workers take longer than a second each
    only = ("--only", "H") if output == "v.csv" else ("--order", "jerk")
    process, terminal = begun("-o", output, "--workers", "2", *only)
    os.kill(at_work(process, 1)[0], signal.SIGKILL)
    said = ended(process, terminal)
    assert process.returncode == 0, said
    whole = tmp_path / output
    again, terminal = begun("-o", f"alone.{output[2:]}", *only)
    ended(again, terminal)
    if output.endswith("csv"):
        assert whole.read_bytes() == (tmp_path / "alone.csv").read_bytes()
    else:
        parquet = pytest.importorskip("pyarrow.parquet")
        assert parquet.ParquetFile(whole).num_row_groups == PARTS
        assert parquet.read_table(whole).equals(parquet.read_table(tmp_path / "alone.parquet"))


def test_a_part_whose_worker_is_killed_again_and_again_is_named(begun, tmp_path):
    process, terminal = begun("-o", "v.csv", "--workers", "2")
    while process.poll() is None:
        for pid in workers(process):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        time.sleep(0.05)
    said = ended(process, terminal)
    assert process.returncode == 1
    assert "variants 1 to 182: the process that solved them died twice" in said
    assert said.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["m.toml"]
