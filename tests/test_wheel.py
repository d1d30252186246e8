"""The wheel holds the packages and the examples."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

from tests.test_boundaries import INSTALLED, ROOT


def test_the_wheel_holds_the_packages_and_the_examples(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", tmp_path, ROOT],
        check=True,
        capture_output=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    tracked = {
        str(file.relative_to(ROOT))
        for package in INSTALLED
        for file in (ROOT / package).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    assert held == tracked
    assert "cli/examples/riul-rotor/rotor.csv" in held
    assert {f"{package}/py.typed" for package in INSTALLED} <= held
