"""Shells complete commands and options."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import Dalembert

COMMAND = Path(sys.executable).with_name("dalembert")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_its_script(shell: str, dalembert: Dalembert) -> None:
    done = dalembert("completion", shell)
    assert done.returncode == 0, done.stderr
    assert f"complete_{shell}" in done.stdout


def test_another_shell_is_refused(dalembert: Dalembert) -> None:
    done = dalembert("completion", "tcsh")
    assert done.returncode == 2
    assert "'bash', 'zsh', 'fish'" in done.stderr


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (["dalembert", "b"], ["balance", "body"]),
        (["dalembert", "balance", "--pl"], ["--plane", "--planes", "--plot"]),
        (["dalembert", "mechanism", "four-bar.toml", "--fly"], ["--flywheel"]),
    ],
)
def test_bash_completes(line: list[str], wanted: list[str]) -> None:
    script = (
        f"source <(dalembert completion bash); COMP_WORDS=({' '.join(line)}); COMP_CWORD={len(line) - 1}; "
        '_dalembert_completion dalembert; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    path = f"{COMMAND.parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, env={**os.environ, "PATH": path}, check=True
    )
    assert done.stdout.split() == wanted, done.stderr
