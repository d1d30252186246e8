"""What the tests share: the installed command, run as a user runs it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

COMMAND = Path(sys.executable).with_name("dalembert")
# for `benchmarks`, which is not installed; last, so that what is installed is what is tested
sys.path.append(str(Path(__file__).parents[1]))


@pytest.fixture
def dalembert(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run `dalembert ARGS` in an empty folder; a traceback or an internal error fails the test."""

    def run(*arguments: object, stdin: str | bytes = "") -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [str(COMMAND), *map(str, arguments)],
            input=stdin if isinstance(stdin, bytes) else stdin.encode(),
            capture_output=True,
            cwd=tmp_path,
            env={**os.environ, "COLUMNS": "120"},
            timeout=120,
            check=False,
        )
        out, err = done.stdout.decode(), done.stderr.decode()
        assert "Traceback" not in err, err
        assert "internal error" not in err, err
        return subprocess.CompletedProcess(done.args, done.returncode, out, err)

    return run
