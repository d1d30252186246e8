"""What the tests share: the installed command, run as a user runs it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

COMMAND = Path(sys.executable).with_name("dalembert")
# for `benchmarks`, which is not installed; last, so that what is installed is what is tested
sys.path.append(str(Path(__file__).parents[1]))


# of a test with a table of cases so many run at once; the others are slow, so that README's command stays short
CASES = 2


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is beyond the first cases of a test as slow: `-m slow` and .ci/run have them all."""
    seen: dict[tuple[str, str], int] = {}
    for item in items:
        if getattr(item, "callspec", None) is not None:
            key = item.nodeid.split("::")[0], item.originalname  # type: ignore[attr-defined]
            seen[key] = seen.get(key, 0) + 1
            if seen[key] > CASES:
                item.add_marker(pytest.mark.slow)


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


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium, driven by selenium."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is missing: pip install selenium")
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("no browser: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1200,900"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    run = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=driver))
    yield run
    run.quit()
