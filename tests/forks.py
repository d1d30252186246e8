"""The command, forked from a process that has imported it: the tests call it some thousand times.

Each call is a process of its own, with its own folder, environment and streams, and runs what the installed script
runs; what it saves is the start of Python and of numpy, which takes longer than most of the answers. Requests come as
lines of JSON on standard input, the status goes out as a line.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import signal
import subprocess
import sys
import traceback
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

LONGEST = 120  # seconds, until a call is ended
OWN = ("dalembert", "balancing", "virtualwork", "rigidbody3d", "cli")
HEAVY = (
    "pandas",
    "scipy.integrate",
    "scipy.interpolate",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.spatial.transform",
    "scipy.stats",
    "matplotlib.backends.backend_agg",
    "matplotlib.figure",
    "matplotlib.projections.polar",
)
# the words of calls that load some of these; to fork from a process that holds them takes twice as long
LOAD = {"body", "fit", "--find", "--flywheel", "--modes", "--plot", "--report"}


class Forks:
    """The processes that fork, a light one and one that holds what is heavy, and the folder of the streams of a call."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.servers: dict[tuple[str, ...], subprocess.Popen[str]] = {}

    def server(self, held: tuple[str, ...]) -> subprocess.Popen[str]:
        """Return the process that has imported the command, and what is named."""
        if held not in self.servers:
            self.servers[held] = subprocess.Popen(
                # -P: the folders of the tests are named as the packages are
                [sys.executable, "-P", __file__, *held],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"},
                text=True,
            )
        return self.servers[held]

    def run(
        self, arguments: list[str], cwd: Path, env: dict[str, str], stdin: bytes
    ) -> tuple[int, bytes, bytes]:
        """Call `dalembert ARGUMENTS`; return its status and what it wrote on its two streams."""
        server = self.server(() if LOAD.isdisjoint(arguments) else HEAVY)
        assert server.stdin is not None
        assert server.stdout is not None
        streams = [self.folder / name for name in ("in", "out", "err")]
        streams[0].write_bytes(stdin)
        request = {"arguments": arguments, "cwd": str(cwd), "env": env, "streams": [str(s) for s in streams]}
        server.stdin.write(json.dumps(request) + "\n")
        server.stdin.flush()
        status = int(server.stdout.readline())
        if status == -signal.SIGALRM:
            raise subprocess.TimeoutExpired(["dalembert", *arguments], LONGEST)
        return status, streams[1].read_bytes(), streams[2].read_bytes()

    def close(self) -> None:
        """End the processes."""
        for server in self.servers.values():
            server.communicate(timeout=30)


def _become(request: dict[str, Any]) -> None:
    """Take folder, environment, streams and arguments of the call."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.alarm(LONGEST)
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    written = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
    for target, (path, mode) in enumerate(
        zip(request["streams"], (os.O_RDONLY, written, written), strict=True)
    ):
        os.dup2(os.open(path, mode), target)
    # as the interpreter opens them; the objects that stood there read and wrote the requests
    sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False, buffering=1)
    sys.argv = ["dalembert", *request["arguments"]]


def _call(request: dict[str, Any]) -> int:
    """Run the command in this process, as its script does; return its status."""
    _become(request)
    from cli.app import main

    status: Any = 0
    try:
        main()
    except SystemExit as end:
        status = end.code
        if isinstance(status, str):
            print(status, file=sys.stderr)
            status = 1
    except BaseException:
        traceback.print_exc()
        status = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    return int(status or 0)


def serve() -> None:
    """Import what commands import, and what the command line names, then fork for each request."""
    for name in sys.argv[1:]:
        import_module(name)
    for name in OWN:
        for module in walk_packages(import_module(name).__path__, f"{name}."):
            # what the command loads by itself where it pays, and the command itself
            if ".engines." not in module.name and not module.name.endswith("__main__"):
                import_module(module.name)
    gc.freeze()
    for line in iter(sys.stdin.readline, ""):
        child = os.fork()
        if child == 0:
            status = 70
            try:
                status = _call(json.loads(line))
            finally:
                os._exit(status)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()
