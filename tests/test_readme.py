"""README and docs show what is so: their commands print what they show, their Python runs."""

from __future__ import annotations

import os
import re
import shutil
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


@pytest.mark.parametrize(
    "page", [page for page in PAGES if "```python" in page.read_text("utf-8")], ids=lambda page: page.name
)
def test_the_python_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    """Run the `python` blocks of a page in turn, in a folder with the files of every example that the page names."""
    if page.name in ("rotordynamics.md", "scaling.md"):
        pytest.skip("needs other packages, or a cluster")
    text = page.read_text(encoding="utf-8")
    for name in set(re.findall(r"dalembert examples ([a-z][\w-]+)", text)):
        for file in (ROOT / "cli" / "examples" / name).glob("*"):
            shutil.copy(file, tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "agg"},
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_readme_has_its_two_commands() -> None:
    blocks = re.findall(
        r"^```sh\n(.*?)^```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    assert len(blocks) >= 2
    assert "dalembert balance" in blocks[0]
    assert "pytest" in blocks[1]
