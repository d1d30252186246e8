"""What the tests share: the installed command, run as a user runs it."""

from __future__ import annotations

import gc
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# for `benchmarks` and `tests`, which are not installed; last, so that what is installed is what is tested
sys.path.append(str(Path(__file__).parents[1]))

from tests.forks import LONGEST, Forks

COMMAND = Path(sys.executable).with_name("dalembert")
# tests that run in the background have Ctrl-C ignored, and what they start would too
TAKES_CTRL_C = [
    sys.executable,
    "-c",
    "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execv(sys.argv[1], sys.argv[1:])",
    str(COMMAND),
]
Dalembert = Callable[..., "subprocess.CompletedProcess[str]"]


# README's command is the same every time; the campaigns of `-m slow` draw anew, and print the seed of what fails
settings.register_profile("same", derandomize=True, database=None, deadline=None)
# without a database hypothesis prints the seed of what fails
settings.register_profile("anew", derandomize=False, database=None, print_blob=True, deadline=None)
SEED = "DALEMBERT_TESTS_SEED"


def pytest_configure(config: pytest.Config) -> None:
    """Choose the profile of hypothesis: `-m slow` alone draws other cases each time."""
    slow = config.getoption("markexpr") == "slow"
    settings.load_profile("anew" if slow else "same")
    # workers of pytest-xdist take the seed of the process that starts them
    os.environ.setdefault(SEED, str(random.SystemRandom().randrange(10**9) if slow else 0))


# none of what is collected goes before the end: the search for what nothing holds takes a tenth of the time with it
gc.disable()


def pytest_collection_finish() -> None:
    """Collect what nothing holds from here on, and look no more at the tests themselves."""
    gc.freeze()
    gc.enable()


@pytest.fixture
def first_seed() -> int:
    """Where a campaign's random cases begin: 0, or with `-m slow` another one each time, printed where it fails."""
    print(f"to repeat: {SEED}={os.environ[SEED]} pytest -m slow")
    return int(os.environ[SEED])


def _draw_anew(items: list[pytest.Item]) -> None:
    """Give campaigns (a parameter `seed` over 0, 1, …) other seeds; lists of seeds that once failed stay as they are."""
    campaigns: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for item in items:
        spec = getattr(item, "callspec", None)
        if spec is not None and "seed" in spec.params:
            key = item.nodeid.split("::")[0], item.originalname  # type: ignore[attr-defined]
            campaigns.setdefault(key, []).append(spec.params)
    for cases in campaigns.values():
        seeds = {params["seed"] for params in cases}
        if len(seeds) > CASES and seeds == set(range(len(seeds))):
            for params in cases:
                params["seed"] += 1000 * int(os.environ[SEED])


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Print, where a test of many seeds fails, how it is repeated."""
    spec = getattr(item, "callspec", None)
    if spec is not None and "seed" in spec.params:
        print(f"seed {spec.params['seed']}; to repeat: {SEED}={os.environ[SEED]} pytest -m slow")


# of a test with a table of cases so many run at once; the others are slow, so that README's command stays short
CASES = 1


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what is beyond the first cases of a test as slow: `-m slow` and .ci/run have them all."""
    if config.getoption("markexpr") == "slow":
        _draw_anew(items)
    seen: dict[tuple[str, str], int] = {}
    for item in items:
        if getattr(item, "callspec", None) is not None and item.get_closest_marker("whole") is None:
            key = item.nodeid.split("::")[0], item.originalname  # type: ignore[attr-defined]
            seen[key] = seen.get(key, 0) + 1
            if seen[key] > CASES:
                item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def forks(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Forks]:
    """The process that has imported the command and forks for each call of it."""
    made = Forks(tmp_path_factory.mktemp("streams"))
    yield made
    made.close()


@pytest.fixture
def dalembert(forks: Forks, tmp_path: Path) -> Dalembert:
    """Run `dalembert ARGS` in an empty folder; a traceback or an internal error fails the test.

    DALEMBERT_TESTS_BY_SCRIPT=1 calls the installed script itself: .ci/run does so too, for users and published cases.
    """

    def run(*arguments: object, stdin: str | bytes = "") -> subprocess.CompletedProcess[str]:
        words, given = [*map(str, arguments)], stdin if isinstance(stdin, bytes) else stdin.encode()
        env = {**os.environ, "COLUMNS": "120"}
        if os.environ.get("DALEMBERT_TESTS_BY_SCRIPT"):
            done = subprocess.run(
                [str(COMMAND), *words],
                input=given,
                capture_output=True,
                cwd=tmp_path,
                env=env,
                timeout=LONGEST,
                check=False,
            )
            status, out, err = done.returncode, done.stdout.decode(), done.stderr.decode()
        else:
            status, *streams = forks.run(words, tmp_path, env, given)
            out, err = (stream.decode() for stream in streams)
        assert "Traceback" not in err, err
        assert "internal error" not in err, err
        return subprocess.CompletedProcess([str(COMMAND), *words], status, out, err)

    return run


@pytest.fixture
def browser(chromium: Any) -> Iterator[Any]:
    """A headless Chromium, driven by selenium; a page that plays does not go on beside later tests."""
    yield chromium
    chromium.get("about:blank")


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser of all tests of one process."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is missing: pip install selenium")
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if program is None or driver is None:
        pytest.skip("no browser: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1200,900"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    run = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=driver))
    yield run
    run.quit()
