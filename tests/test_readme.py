"""README tells the truth: every command it shows prints what it shows."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_page_shows_what_the_commands_print(page: Path, tmp_path: Path) -> None:
    """Run the `console` blocks of a page in turn, in one folder; `…` stands for a part left out."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for block in re.findall(
        r"^```console\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    ):
        for entry in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, shown = entry.partition("\n")
            done = subprocess.run(
                ["bash", "-c", command],
                capture_output=True,
                text=True,
                cwd=tmp_path,
                env={**os.environ, "PATH": path},
                check=False,
            )
            pattern = ".*?".join(re.escape(part) for part in shown.strip().split("…"))
            printed = (done.stdout + done.stderr).strip()
            assert re.fullmatch(pattern, printed, re.DOTALL), f"$ {command}\n{printed}"


def test_readme_has_its_two_commands() -> None:
    blocks = re.findall(
        r"^```sh\n(.*?)^```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    assert len(blocks) >= 2
    assert "dalembert balance" in blocks[0]
    assert "pytest" in blocks[1]
