"""`import dalembert`: the public names of the three packages, and nothing loaded before one is asked for."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest

import dalembert
import rigidbody3d
from benchmarks.library_page import page

ROOMS = ("balancing", "virtualwork", "rigidbody3d")


def public() -> list[str]:
    return [name for name in dir(dalembert) if not name.startswith("_")]


def test_every_public_name_of_a_package_has_one_name_here() -> None:
    here = [id(getattr(dalembert, name)) for name in public()]
    there = [id(getattr(room, name)) for room in map(import_module, ROOMS) for name in room.__all__]
    assert sorted(here) == sorted(there)


def test_the_docstring_lists_every_public_name() -> None:
    lists = re.findall(r"^    (.+)$", dalembert.__doc__ or "", re.MULTILINE)
    assert sorted(re.findall(r"\w+", " ".join(lists))) == sorted(public())


def test_motion_is_what_a_mechanism_moves_by() -> None:
    crank = dalembert.Link({"O": 0j, "P": 1})
    motion = dalembert.Mechanism({"O": 0j}, {"crank": crank}, inputs=dalembert.Input(link="crank")).motion(
        0.0
    )
    assert type(motion) is dalembert.Motion
    assert dalembert.BodyMotion is rigidbody3d.Motion


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("balancing.spread", "spread_of_corrections"),
        ("virtualwork.sense", "direction_angle"),
        ("rigidbody3d.check", "check_inertia"),
    ],
)
def test_a_short_name_stays_in_its_package_and_is_longer_here(short: str, long: str) -> None:
    package, name = short.split(".")
    assert getattr(dalembert, long) is getattr(import_module(package), name)
    with pytest.raises(AttributeError, match=f"'{name}': it is `dalembert.{long}` or `{short}`"):
        getattr(dalembert, name)


@pytest.mark.parametrize("room", ROOMS)
def test_every_public_function_has_an_example_and_names_its_parameters(room: str) -> None:
    package = import_module(room)
    for name in package.__all__:
        value = getattr(package, name)
        if not callable(value):
            continue
        text = inspect.getdoc(value) or ""
        assert text.split("\n\n")[0].endswith("."), name
        if inspect.isfunction(value):
            assert ">>>" in text, name
            assert [p for p in inspect.signature(value).parameters if p not in text] == [], name


def test_the_page_of_public_names_is_up_to_date() -> None:
    written = (Path(__file__).parents[1] / "docs" / "library.md").read_text(encoding="utf-8")
    assert written.splitlines() == list(page()), "python -m benchmarks.library_page > docs/library.md"


def test_the_version_is_that_of_the_distribution() -> None:
    assert dalembert.__version__ == version("dalembert")
    assert "__version__" in dir(dalembert)


@pytest.mark.parametrize("name", ["corect", "_HOMES", "__all__"])
def test_another_name_is_an_attribute_error(name: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'dalembert' has no attribute '{name}'"):
        getattr(dalembert, name)


def test_import_dalembert_loads_nothing() -> None:
    script = "import sys, dalembert; print(sorted({name.split('.')[0] for name in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert "dalembert" in loaded
    assert not [name for name in (*ROOMS, "numpy", "cli") if f"'{name}'" in loaded]


def test_a_name_of_balancing_loads_no_other_package() -> None:
    script = "import sys, dalembert; dalembert.correct; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert "balancing" in loaded.split()
    assert not {"virtualwork", "rigidbody3d"} & set(loaded.split())
