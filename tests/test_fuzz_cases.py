"""The calls that fuzzing damages work undamaged: their options are those of today."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from benchmarks.fuzz.cases import FURTHER
from tests.conftest import Dalembert


@pytest.mark.parametrize(("line", "texts"), FURTHER, ids=[line for line, _ in FURTHER])
def test_a_call_for_fuzzing_runs(
    line: str, texts: dict[str, str], dalembert: Dalembert, tmp_path: Path
) -> None:
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    done = dalembert(*shlex.split(line))
    assert done.returncode == 0, done.stderr
