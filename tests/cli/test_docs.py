"""docs/ is complete: every option, key and example that the program knows stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer

from cli import COMMANDS
from cli.app import build
from dalembert.results.about import HEAD
from dalembert.units import UNITS
from rigidbody3d.turning_body import KEYS
from virtualwork.describe.description import FILE
from virtualwork.describe.description import UNITS as OF_FILE
from virtualwork.describe.keys import table_keys
from virtualwork.describe.parts import TABLES, Guess, Link, Polar

ROOT = Path(__file__).parents[2]
PAGES = {page.name: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").rglob("*.md"))}
DOCS = "\n".join(PAGES.values())
# options as they stand in the pages; --plane is not --planes
# amplitudes are said as units and tags
AMPLITUDES = set(UNITS["amplitude"])
SAID = set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", DOCS))


def options(command: str) -> list[str]:
    """Every spelling of every option of a command."""
    group = typer.main.get_command(build(command))
    assert isinstance(group, typer.core.TyperGroup)
    found = group.commands[command]
    return [
        spelling
        for p in found.params
        if p.param_type_name == "option" and not getattr(p, "hidden", False)
        for spelling in p.opts
    ]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_documented(command: str) -> None:
    assert [option for option in options(command) if option not in SAID] == []


def test_every_command_is_documented() -> None:
    assert [command for command in COMMANDS if f"dalembert {command}" not in DOCS] == []


@pytest.mark.parametrize(
    ("page", "keys"),
    [
        (
            "mechanism-file.md",
            {*FILE, *TABLES, *OF_FILE, *(key for part in (Link, Polar, Guess) for key in table_keys(part))},
        ),
        ("mechanism-file.md", {key for table, part in TABLES.items() for key in table_keys(part, table)}),
        ("tables.md", {*HEAD}),
        ("rigid-body.md", {*KEYS, "mgl"}),
        ("tables.md", {unit for units in UNITS.values() for unit in units if unit} - AMPLITUDES),
    ],
)
def test_every_key_and_unit_is_documented(page: str, keys: set[str]) -> None:
    words = set(re.findall(r"[\w-]+", PAGES[page]))
    assert sorted(keys - words) == []
