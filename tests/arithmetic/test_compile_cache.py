"""Compiled code on disk, met by several processes at once and by ones that are killed while they write it."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path
from random import Random

import numpy as np
import pytest

from dalembert.arithmetic.engines import llvm, run
from dalembert.arithmetic.recorded import RECORDED, Recorder
from dalembert.arithmetic.tape import Tape

pytest.importorskip("llvmlite")

INPUTS = {"x": np.linspace(0.1, 1.0, 20), "y": np.linspace(-2.0, 3.0, 20)}
# compiles every tape when it is told to; a disk as slow as this is met half-written
CHILD = """
import pickle, sys, time
from pathlib import Path
from dalembert.arithmetic.engines import llvm, run

def slowly(path, data):
    with path.open("wb") as file:
        for i in range(0, len(data), 256):
            file.write(data[i : i + 256])
            file.flush()
            time.sleep(PAUSE)

PAUSE = float(sys.argv[2])
if PAUSE:
    Path.write_bytes = slowly
with open(sys.argv[1], "rb") as file:
    tapes, inputs = pickle.load(file)
from llvmlite import binding
print("ready", flush=True)
sys.stdin.readline()
for tape in tapes:
    print(run(tape, inputs, "llvm").table.tobytes().hex(), flush=True)
assert all(llvm._compiled.values()), "numpy did the work"
"""


def tape_of(seed: int) -> Tape:
    """Some fifty operations, another tape for each seed."""
    recorder, random = Recorder(), Random(seed)
    x, y = recorder.input("x"), recorder.input("y")
    value = x
    for _ in range(12):
        value = RECORDED.sin(value * random.uniform(0.5, 2.0) + y) + x / (value * value + 1.0)
    return recorder.tape({"value": value, "other": value * y})


class Compiling:
    """Processes that compile tapes into a clean folder."""

    def __init__(self, folder: Path, tapes: list[Tape]) -> None:
        self.tapes, self.cache, self.given = tapes, folder / "cache", folder / "tapes"
        self.given.write_bytes(pickle.dumps((tapes, INPUTS)))

    def start(self, count: int, pause: float = 0.0) -> list[subprocess.Popen[str]]:
        """Start processes that wait for a line each."""
        command = [sys.executable, "-W", "error", "-c", CHILD, str(self.given), str(pause)]
        env = {**os.environ, "DALEMBERT_CACHE": str(self.cache)}
        started = [
            subprocess.Popen(command, env=env, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            for _ in range(count)
        ]
        for process in started:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        return started

    def told(self, processes: list[subprocess.Popen[str]]) -> None:
        """Tell all to go on."""
        for process in processes:
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.flush()

    def ended(self, processes: list[subprocess.Popen[str]]) -> None:
        """Wait for all; every one has the right numbers, bit for bit the same."""
        found = []
        for process in processes:
            out, _ = process.communicate()
            assert process.returncode == 0
            found.append(out.split())
        assert all(one == found[0] for one in found)
        for text, tape in zip(found[0], self.tapes, strict=True):
            table = np.frombuffer(bytes.fromhex(text)).reshape(2, -1)
            np.testing.assert_allclose(table, run(tape, INPUTS, "numpy").table, rtol=1e-11, atol=1e-13)

    def whole(self) -> list[Path]:
        """The files that a later run would take; each is what its own digest says."""
        files = sorted(self.cache.glob("*.o"))
        for file in files:
            data = file.read_bytes()
            assert sha256(data[32:]).digest() == data[:32]
        return files


def at_once(folder: Path, processes: int, tapes: int) -> None:
    folder.mkdir()
    work = Compiling(folder, [tape_of(k) for k in range(tapes)])
    # so slow a disk that all of them write the first file at once
    started = work.start(processes, 0.002)
    work.told(started)
    work.ended(started)
    assert len(work.whole()) == tapes
    assert sorted(work.cache.iterdir()) == work.whole()


def killed(folder: Path, kills: int, tapes: int, longest: float) -> None:
    """Each is killed at some moment of its compiling and writing; one that comes after takes what is whole, and no more."""
    folder.mkdir()
    work, random = Compiling(folder, [tape_of(k) for k in range(tapes)]), Random(5)
    for _ in range(kills):
        (process,) = work.start(1, 0.005)
        work.told([process])
        time.sleep(random.uniform(0, longest))
        process.kill()
        process.communicate()
        work.whole()
    last = work.start(1)
    work.told(last)
    work.ended(last)
    assert len(work.whole()) == tapes


def test_processes_at_once_get_the_right_numbers_and_leave_whole_files(tmp_path: Path) -> None:
    at_once(tmp_path / "few", 3, 2)


def test_one_that_is_killed_leaves_nothing_that_a_later_run_would_take(tmp_path: Path) -> None:
    killed(tmp_path / "few", 1, 3, 0.3)


@pytest.mark.slow
def test_many_at_once_and_many_that_are_killed(tmp_path: Path) -> None:
    at_once(tmp_path / "many", 8, 12)
    killed(tmp_path / "killed", 25, 10, 2.0)


def test_what_a_killed_process_left_goes_when_the_file_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DALEMBERT_CACHE", str(tmp_path))
    monkeypatch.setattr(llvm, "_compiled", {})
    run(tape_of(1), INPUTS, "llvm")
    (file,) = tmp_path.iterdir()
    left = file.with_name(f"{file.name}.1.part")
    left.write_bytes(file.read_bytes()[:100])
    file.unlink()
    llvm._compiled.clear()
    run(tape_of(1), INPUTS, "llvm")
    assert list(tmp_path.iterdir()) == [file]
