"""docs/quality/coverage.md names tests, functions and examples that exist."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from cli.examples import names

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docs" / "quality" / "coverage.md").read_text(encoding="utf-8")


def test_every_test_named_exists() -> None:
    everywhere: dict[str, str] = {}
    for file in (ROOT / "tests").rglob("test_*.py"):
        everywhere[file.name] = everywhere.get(file.name, "") + file.read_text(encoding="utf-8")
    named = re.findall(r"`(?:tests/)?(?:[\w/]*?)(test_\w+\.py)(?:::(test_\w+))?`", TEXT)
    assert len(named) > 20
    for name, test in named:
        assert name in everywhere, name
        assert not test or f"def {test}(" in everywhere[name], f"{name}::{test}"
    for test in re.findall(r"`::(test_\w+)`", TEXT):
        assert any(f"def {test}(" in text for text in everywhere.values()), test


@pytest.mark.parametrize("name", re.findall(r"`((?:balancing|virtualwork|rigidbody3d)\.\w+)`", TEXT))
def test_every_function_named_exists(name: str) -> None:
    module, function = name.split(".")
    assert hasattr(importlib.import_module(module), function)


def test_every_example_named_exists() -> None:
    for group in re.findall(r"examples? ((?:`[\w-]+`(?:, | and )?)+)", TEXT):
        for name in re.findall(r"`([\w-]+)`", group):
            assert name in names(), name
