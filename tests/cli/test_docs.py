"""docs/ is complete: every option, key and example that the program knows stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer

from cli.app import COMMANDS, build
from cli.read.about import HEAD
from cli.read.units import UNITS
from cli.spin.read import KEYS
from virtualwork.describe.entries import ENTRIES, FILE, GUESS, LINK, POINT
from virtualwork.describe.entries import UNITS as OF_FILE

ROOT = Path(__file__).parents[2]
PAGES = {page.name: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").glob("*.md"))}
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
    return [spelling for p in found.params if p.param_type_name == "option" for spelling in p.opts]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_documented(command: str) -> None:
    assert [option for option in options(command) if option not in SAID] == []


def test_every_command_is_documented() -> None:
    assert [command for command in COMMANDS if f"dalembert {command}" not in DOCS] == []


@pytest.mark.parametrize(
    ("page", "keys"),
    [
        ("mechanism-file.md", {*FILE, *ENTRIES, *LINK, *POINT, *GUESS, *OF_FILE}),
        ("mechanism-file.md", {key for keys in ENTRIES.values() for key in keys}),
        ("tables.md", {f"--{key}" for key in HEAD}),
        ("rigid-body.md", {*KEYS, "mgl"}),
        ("tables.md", {unit for units in UNITS.values() for unit in units if unit} - AMPLITUDES),
    ],
)
def test_every_key_and_unit_is_documented(page: str, keys: set[str]) -> None:
    words = set(re.findall(r"[\w-]+", PAGES[page]))
    assert sorted(keys - words) == []
