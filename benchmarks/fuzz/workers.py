"""Fuzzing at length: cases in worker processes with limits on time and memory that are held from outside.

A worker has an address space of 1 GiB above what it starts with (where the system can limit that), and is killed by
the parent when one case takes it more than 5 s of processor time: so neither a loop in compiled code nor a crash of
the interpreter ends the run.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from benchmarks.fuzz.trial import LONGEST, Outcome, trial

MOST = 2**30  # bytes above those at the start of a case
PATIENCE = 60.0  # seconds that a case may wait for the processor, where its own time is known
TICK = 0.1  # seconds between looks at the workers

Trial = Callable[[int], Outcome]

try:
    import resource
except ImportError:  # not a Unix: memory is not limited, and the summary says so
    LIMITED = False
else:
    LIMITED = True


@dataclass
class Tally:
    """What came of the cases of one command."""

    command: str
    inputs: int = 0
    handled: dict[str, int] = field(default_factory=lambda: {"result": 0, "data error": 0, "usage error": 0})
    slowest: tuple[float, int | None] = (0.0, None)
    """Seconds and seed."""
    largest: tuple[int, int | None] = (0, None)
    """Bytes above the start, and seed."""
    faults: list[tuple[int, Outcome]] = field(default_factory=list)

    def add(self, seed: int, outcome: Outcome) -> None:
        """Count a case."""
        self.inputs += 1
        if outcome.handled:
            self.handled[outcome.handled] += 1
        self.slowest = max(self.slowest, (outcome.seconds, seed), key=lambda pair: pair[0])
        self.largest = max(self.largest, (outcome.bytes, seed), key=lambda pair: pair[0])
        if outcome.fault is not None:
            self.faults.append((seed, outcome))


def run(
    first: int, inputs: int, workers: int = 1, case: Trial = trial, patience: float = PATIENCE
) -> Iterator[tuple[int, Outcome]]:
    """Run the cases of seeds first, first + 1, ... in workers, yielding (seed, outcome) as they end."""
    seeds, left = iter(range(first, first + inputs)), inputs
    pool: list[_Worker] = []
    # the cases' folders lie in one that outlives a worker that is killed
    with tempfile.TemporaryDirectory(prefix="dalembert-fuzz-") as folder:
        try:
            idle = pool = [_Worker(case, folder, patience) for _ in range(min(workers, inputs))]
            while left:
                for worker in idle:
                    if (seed := next(seeds, None)) is not None:
                        worker.start(seed)
                wait([worker.pipe for worker in pool if worker.seed is not None], TICK)
                idle = []
                for worker in pool:
                    if worker.seed is not None and (ended := worker.outcome()) is not None:
                        left -= 1
                        idle.append(worker)
                        yield ended
        finally:
            for worker in pool:
                worker.kill()


class _Worker:
    """A process that runs one case at a time; a new one takes its place where it had to be killed."""

    pipe: Connection
    process: SpawnProcess

    def __init__(self, case: Trial, folder: str, patience: float) -> None:
        self.case, self.folder, self.patience = case, folder, patience
        self.seed: int | None = None
        self._open()

    def _open(self) -> None:
        # no fork: a worker starts from a clean interpreter, on every system
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, self.case, self.folder), daemon=True)
        self.process.start()
        theirs.close()
        self.pipe.recv()  # it has loaded what it needs: from here time counts

    def start(self, seed: int) -> None:
        self.seed = seed
        self.wall, self.cpu = time.monotonic(), _processor_time(self.process.pid)
        self.pipe.send(seed)

    def outcome(self) -> tuple[int, Outcome] | None:
        """Return (seed, outcome) when the case is over, one way or another."""
        seed = self.seed
        assert seed is not None
        seconds = time.monotonic() - self.wall
        try:
            if self.pipe.poll():
                outcome: Outcome = self.pipe.recv()
                self.seed = None
                return seed, outcome
        except (EOFError, ConnectionError):
            self.process.join()
            code = self.process.exitcode or 0
            return self._lost(
                f"ended the process: {signal.Signals(-code).name if code < 0 else code}", seconds
            )
        now = _processor_time(self.process.pid)
        spent = seconds if now is None or self.cpu is None else now - self.cpu
        if spent > LONGEST or seconds > self.patience:
            return self._lost(f"killed after {seconds:.0f} s", spent)
        return None

    def _lost(self, fault: str, seconds: float) -> tuple[int, Outcome]:
        self.kill()
        seed, self.seed = self.seed, None
        assert seed is not None
        command, arguments = "", [f"seed {seed}"]
        if self.case is trial:
            from benchmarks.fuzz.trial import replayed

            arguments = replayed(seed)["arguments"]
            command = arguments[0]
        self._open()
        return seed, Outcome(command, arguments, seconds, "", fault)

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


def _serve(pipe: Connection, case: Trial, folder: str) -> None:
    """Run the cases whose seeds come through the pipe, until it closes."""
    tempfile.tempdir = folder
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the run
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # what the commands load on demand is no case's memory
    import matplotlib.figure  # noqa: F401
    import pandas  # noqa: F401
    import scipy.optimize  # noqa: F401

    pipe.send(None)
    while True:
        try:
            seed = pipe.recv()
        except EOFError:
            return
        _limit()
        before = _peak(reset=True)
        try:
            outcome = case(seed)
        except MemoryError:
            outcome = Outcome("", [f"seed {seed}"], 0.0, "", "more than 1 GiB of memory")
        used = max(0, _peak() - before)
        fault = outcome.fault or (f"took {used / MOST:.2f} GiB of memory" if used > MOST else None)
        pipe.send(replace(outcome, fault=fault, bytes=used))


def _limit() -> None:
    """Limit the address space to 1 GiB above the present one, where it can be known and limited."""
    if LIMITED and (size := _of_proc("VmSize")):
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        soft = size + MOST if hard == resource.RLIM_INFINITY else min(size + MOST, hard)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _peak(reset: bool = False) -> int:
    """Return the most memory held so far, in bytes; `reset` starts it anew where the system can."""
    if not LIMITED:
        return 0
    if reset and Path("/proc/self/clear_refs").exists():
        Path("/proc/self/clear_refs").write_text("5")
    # elsewhere the maximum of the whole run: only a case that raises it is seen
    return _of_proc("VmHWM") or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (
        1 if os.uname().sysname == "Darwin" else 1024
    )


def _of_proc(name: str) -> int:
    """Return an entry of /proc/self/status in bytes; 0 where there is none."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:")), 0)


def _processor_time(pid: int | None) -> float | None:
    """Return the processor time of a process in seconds; None where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))
