"""Files that are no text or no TOML are refused in one sentence by every command that reads one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

FILES = {
    "this is not text: expected TOML in UTF-8": b"\xff\xfe\x00",
    "no valid TOML: a number of thousands of digits": b"title = " + b"9" * 5000,
    "no valid TOML: nested too deeply": b"title = " + b"[" * 3000 + b"]" * 3000,
    "no valid TOML: Expected '='": b"a,b\n",
}
CALLS = (
    ("spin", "f.toml", "--at", "1"),
    ("exercise", "f.toml", "-o", "out"),
    ("mechanism", "f.toml"),
    ("field", "runs.csv", "--columns", "f.toml"),
)


@pytest.mark.whole
@pytest.mark.parametrize("call", CALLS, ids=lambda call: call[0])
def test_a_file_that_is_no_toml_is_named_with_its_fault(
    call: tuple[str, ...], dalembert: Any, tmp_path: Path
) -> None:
    (tmp_path / "runs.csv").write_text("run,sensor,amplitude_um,phase_deg\n0,1,2,3\n")
    for fault, data in FILES.items():
        (tmp_path / "f.toml").write_bytes(data)
        done = dalembert(*call)
        assert done.returncode == 1
        assert done.stderr.startswith(f"dalembert: f.toml: {fault}")
        assert done.stderr.count("\n") == 1


@pytest.mark.whole
@pytest.mark.parametrize("command", ["mechanism", "forces", "inspect"])
def test_every_fault_of_standard_input_is_named_so(command: str, dalembert: Any) -> None:
    free = (
        '[ground]\nA = [0, 0]\n[links.crank]\npoints = { A = [0, 0] }\n[links.rod]\n[input]\nlink = "crank"\n'
    )
    done = dalembert(command, "-", stdin=free)
    assert done.returncode == 1
    assert done.stderr.startswith("dalembert: standard input: a free degree of freedom: rod can still move")
