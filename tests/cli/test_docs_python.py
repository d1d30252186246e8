"""The Python blocks of README and docs run as they stand, one after the other on a page, those that start processes alone."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cli.examples import EXAMPLES

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PAGES = {
    page.name: blocks
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if (blocks := BLOCK.findall(page.read_text(encoding="utf-8")))
}
# as many variants and starts as show that it runs
FEWER = {"100_000": "100", "1000)": "40)", "np.full(1000,": "np.full(40,", "starts=64": "starts=8"}
# need a machine of their own: the page says so
UNTRIED = {"mpi4py", "ray"}
GUARD = 'if __name__ == "__main__":'


def test_there_are_blocks() -> None:
    assert {"README.md", "pages.md", "scaling.md", "time.md", "variants.md", "pictures.md"} <= PAGES.keys()


@pytest.mark.parametrize("page", PAGES)
def test_blocks_that_start_processes_have_their_guard_and_all_are_python(page: str) -> None:
    for block in PAGES[page]:
        compile(block, page, "exec")
        starts = re.search(r"\bwith (Processes|Client|MPIPoolExecutor)\(", block)
        assert starts is None or GUARD in block


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page_run(page: str, tmp_path: Path) -> None:
    """In one folder that holds the examples' files; a block of a package that is not installed is left out."""
    for example in EXAMPLES.iterdir():
        for file in example.iterdir() if example.is_dir() else ():
            shutil.copy(file, tmp_path)
    scripts = [""]
    for block in PAGES[page]:
        for many, few in FEWER.items():
            block = block.replace(many, few)
        imported = set(re.findall(r"^\s*(?:from|import) (\w+)", block, re.MULTILINE))
        if imported & UNTRIED or not all(importlib.util.find_spec(name) for name in imported):
            continue
        # what starts processes is a script of its own
        if GUARD in block:
            scripts.append(block)
        else:
            scripts[0] += block + "\n"
    for script in filter(None, scripts):
        (tmp_path / "page.py").write_text(script)
        done = subprocess.run(
            [sys.executable, "page.py"],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env={**os.environ, "MPLBACKEND": "agg"},
            check=False,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr
