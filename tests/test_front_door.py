"""`import dalembert`: the public names of the three packages, and nothing loaded before one is asked for."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from importlib.metadata import version

import pytest

import dalembert

ROOMS = ("balancing", "virtualwork", "rigidbody3d")


def test_every_public_name_is_handed_on() -> None:
    for room in map(import_module, ROOMS):
        for name in room.__all__:
            assert getattr(dalembert, name) is getattr(room, name), name
            assert name in dir(dalembert)


def test_no_two_packages_have_one_name_for_two_things() -> None:
    names = [name for room in map(import_module, ROOMS) for name in room.__all__]
    assert len(names) == len(set(names)), sorted({name for name in names if names.count(name) > 1})


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
