"""From one machine to many: parts on processes, on a cluster, after a worker's death and a Ctrl-C."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import time
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from dalembert.arithmetic.parts import LostPart, in_parts
from dalembert.arithmetic.processes import Processes
from tests.conftest import TAKES_CTRL_C
from virtualwork import Guess, Input, Link, Mechanism

# a call that kills its process unless the file is there, which it leaves behind
DIES_ONCE = (
    "(p := __import__('pathlib').Path({!r})).exists() or (p.touch(), __import__('os')._exit(1)) and None"
)


def four_bar():
    links = {
        "crank": Link({"A": 0j, "B": 0.04}, 0.5, 0.02),
        "coupler": Link({"B": 0j, "C": 0.12, "H": 0.06 + 0.03j}, 0.8, 0.06),
        "rocker": Link({"D": 0j, "C": 0.08}, 0.6, 0.04),
    }
    guess = Guess(0.7, {"coupler": 0.3, "rocker": 1.0})
    return Mechanism({"A": 0j, "D": 0.1}, links, inputs=Input("crank"), guess=guess, gravity=-9.81j)


def family(v=60):
    rng = np.random.default_rng(0)
    lengths = {
        "links.crank.B.x": 0.04,
        "links.coupler.C.x": 0.12,
        "links.rocker.C.x": 0.08,
        "ground.D.x": 0.1,
    }
    # some cannot be assembled all the way round, and some not at all
    return four_bar().vary({path: nominal + 0.02 * rng.normal(size=v) for path, nominal in lengths.items()})


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_dask_cluster_gives_the_same_numbers(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("virtualwork.family.family.LANES", 128)
    angle = np.linspace(0, 6, 12)
    here = family().motion(angle, speed=2.0)
    with distributed.Client(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as client:
        there = family().motion(angle, speed=2.0, executor=client.get_executor())
        np.testing.assert_array_equal(here.effort, there.effort)
        np.testing.assert_array_equal(here.point("H").velocity, there.point("H").velocity)
        np.testing.assert_array_equal(here.assembled, there.assembled)
        assert 0 < there.failed == here.failed


def test_a_part_whose_worker_died_is_done_again_once(tmp_path):
    flag = tmp_path / "died"
    parts = [("1 + 1",), (DIES_ONCE.format(str(flag)) + " or 'done again'",), ("2 + 2",)]
    with Processes(2) as pool:
        first, again, last = in_parts(eval, parts, pool)
    assert flag.exists()
    assert (first, last) == (2, 4)
    assert again


@pytest.mark.slow
def test_a_part_that_kills_its_worker_twice_is_named():
    with Processes(1) as pool, pytest.raises(LostPart, match="part 2: its worker process died"):
        list(in_parts(eval, [("1",), ("__import__('os')._exit(1)",)], pool))


def test_an_error_of_the_work_itself_is_not_tried_again():
    with Processes(1) as pool, pytest.raises(ZeroDivisionError):
        list(in_parts(eval, [("1/0",)], pool))


def test_what_is_sent_of_a_part_is_the_numbers_of_its_variants():
    """Beside a kilobyte or two of the description: eight bytes a number."""
    part = family(10_000).motion(np.linspace(0, 6, 12)).part
    sizes = [len(pickle.dumps(part.some(slice(0, v)))) for v in (1, 1001, 10_000)]
    assert sizes[0] < 8000
    assert sizes[1] - sizes[0] == pytest.approx(8 * 4 * 1000, abs=64)
    assert sizes[2] - sizes[0] == pytest.approx(8 * 4 * 9999, abs=64)


def test_ctrl_c_waits_until_a_worker_has_started(monkeypatch):
    """A worker whose start is cut short shows a traceback: what it reads from its parent ends too soon."""
    started = []

    def submit(self, *arguments):
        os.kill(os.getpid(), signal.SIGINT)
        started.append(arguments)
        return Future()

    monkeypatch.setattr(ProcessPoolExecutor, "submit", submit)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    pool = Processes(1)
    try:
        with pytest.raises(KeyboardInterrupt):
            pool.submit(len, [])
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
        pool.shutdown()
    assert started


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_ctrl_c_stops_all_workers(tmp_path):
    text = (
        'ground = { A = [0, 0], D = [0.1, 0] }\ninput = { link = "crank" }\n'
        "guess = { at = 0.7, coupler = 0.3, rocker = 1.0 }\n"
        "[links]\ncrank.points = { A = [0, 0], B = [0.04, 0] }\ncoupler.points = { B = [0, 0], C = [0.12, 0] }\n"
        'rocker.points = { D = [0, 0], C = [0.08, 0] }\n[tolerances]\n"ground.D.x" = 1e-4\n'
    )
    (tmp_path / "m.toml").write_text(text)
    command = [
        *TAKES_CTRL_C,
        "tolerance",
        "m.toml",
        "--over",
        "0deg:360deg:10deg",
    ]
    options = ["--draws", "300000", "--workers", "2", "--only", "C"]
    running = subprocess.Popen(
        [*map(str, command), *options],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )

    def children():
        listed = Path(f"/proc/{running.pid}/task").glob("*/children")
        return {pid for each in listed for pid in each.read_text().split()}

    deadline = time.monotonic() + 60
    while len(children()) < 3 and running.poll() is None and time.monotonic() < deadline:
        time.sleep(0.1)
    workers = children()
    assert len(workers) >= 3, "two workers and what looks after their resources"
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode not in (0, None)
    assert b"Traceback" not in said
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < deadline + 30:
        time.sleep(0.1)
    assert not any(Path(f"/proc/{pid}").exists() for pid in workers)
