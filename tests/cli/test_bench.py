"""`dalembert bench` measures what it says."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

Dalembert = Callable[..., subprocess.CompletedProcess[str]]


def test_a_domain_is_measured(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert("bench", "rotors", "--quick", "--plot", "bench.png", "-o", "results.json")
    assert done.returncode == 0, done.stderr
    measured = json.loads((tmp_path / "results.json").read_text())["measurements"]
    assert all(m["time_ns"] > 0 and m["time_units"] > 0 for m in measured)
    errors = {m["method"]: m["error"] for m in measured if m["work"].startswith("nearly balanced")}
    assert errors["compensated"] <= 1e-15 < 1e-8 < errors["plain sums"]
    assert (tmp_path / "bench.png").read_bytes().startswith(b"\x89PNG")


def test_an_unknown_domain(dalembert: Dalembert) -> None:
    done = dalembert("bench", "rotor")
    assert done.returncode == 2
    assert "did you mean 'rotors'?" in done.stderr
