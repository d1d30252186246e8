"""`dalembert mechanism --schema` and docs/mechanism-file.md say what the reader accepts."""

from __future__ import annotations

import json
import re
import subprocess
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from virtualwork import Mechanism, MechanismError
from virtualwork.describe.description import FILE, UNITS
from virtualwork.describe.keys import table_keys
from virtualwork.describe.parts import TABLES, Guess, Link, Polar
from virtualwork.describe.schema import schema

ROOT = Path(__file__).parents[2]
EXAMPLES = [
    path
    for path in sorted((ROOT / "cli" / "examples").glob("*/*.toml"))
    if "links" in tomllib.loads(path.read_text(encoding="utf-8"))
]
PAGE = (ROOT / "docs" / "mechanism-file.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
# a block without links is added to the first
SHOWN = [block if "[links." in block else BLOCKS[0] + "\n" + block for block in BLOCKS]
VALID = Draft202012Validator(schema())

FOUR_BAR = tomllib.loads(BLOCKS[0])


def test_it_is_printed_without_a_file(dalembert: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    done = dalembert("mechanism", "--schema")
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert printed == schema()
    Draft202012Validator.check_schema(printed)


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 15
    assert len(BLOCKS) >= 10


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_shipped_examples_are_valid(path: Path) -> None:
    VALID.validate(tomllib.loads(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("text", SHOWN)
def test_examples_of_the_page_are_valid_and_read(text: str, tmp_path: Path) -> None:
    VALID.validate(tomllib.loads(text))
    push, motor = re.findall(r"```csv\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "push.csv").write_text(push)
    (tmp_path / "motor.csv").write_text(motor)
    (tmp_path / "shown.toml").write_text(text)
    mechanism = Mechanism.from_toml(tmp_path / "shown.toml")
    assert mechanism.motion(list(mechanism.at)).assembled.all()


@pytest.mark.parametrize(
    "change",
    [
        {"slider": []},
        {"units": {"lenght": "mm"}},
        {"links": {"crank": {"points": {"A": [0, 0]}, "mas": 1}}},
        {"links": {}},
        {"input": {"link": "crank", "speeed": 1}},
        {"input": {"link": "crank", "position": 1}},
        {"input": []},
        {"gravity": -9.81},
        {"gravity": [0, True]},
        {"ground": {"A": [0, 0, 0]}},
        {"links": {"crank": {"points": {"A": [0, 0]}, "mass": "heavy"}}},
        {"forces": [{"link": "crank", "force": [1, 0], "frame": "world"}]},
        {"forces": [{"link": "crank"}]},
        {"forces": [{"link": "crank", "force": [1, 0], "table": "push.csv"}]},
        {"gears": [{"links": ["crank"], "ratio": 2}]},
        {"friction": [{"joint": "A"}]},
        {"springs": 3},
    ],
    ids=str,
)
def test_what_the_schema_refuses_the_reader_refuses(change: dict[str, Any]) -> None:
    wrong = {**FOUR_BAR, **change}
    assert not VALID.is_valid(wrong)
    with pytest.raises(MechanismError):
        Mechanism.from_toml_text(_toml(wrong))


def test_every_key_of_the_reader_is_in_the_schema() -> None:
    tables = dict(_tables(schema(), ()))
    top = tables.pop(())
    assert top == {*FILE, *TABLES}
    assert tables == {
        ("units",): set(UNITS),
        ("links",): set(table_keys(Link)),
        ("links", "points"): set(table_keys(Polar)),
        ("guess",): set(table_keys(Guess)),
    } | {(name,): set(table_keys(part, name)) for name, part in TABLES.items()}


def test_every_key_of_the_schema_is_on_the_page() -> None:
    sections = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE))
    titles = {re.sub(r"[\[\]]|\.NAME", "", title): text for title, text in sections.items()}
    for path, names in _tables(schema(), ()):
        rows = re.findall(r"^\| (`.*?) \|", titles[path[-1] if path else "Top of the file"], re.MULTILINE)
        assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == names, path


def _tables(form: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], set[str]]]:
    """Every table of keys in the schema, once."""
    if "properties" in form:
        yield path, set(form["properties"])
        for name, inner in form["properties"].items():
            yield from _tables(inner, (*path, name))
    elif isinstance(form.get("additionalProperties"), dict):
        yield from _tables(form["additionalProperties"], path)
    # a single entry stands before the array of such
    for inner in form.get("anyOf", [])[:2]:
        yield from _tables(inner, path)


def _toml(value: Any, top: bool = True) -> str:
    """A tree as TOML, its inner tables inline."""
    if isinstance(value, dict):
        pairs = [f"{json.dumps(key)} = {_toml(inner, False)}" for key, inner in value.items()]
        return "\n".join(pairs) if top else "{ " + ", ".join(pairs) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(inner, False) for inner in value) + "]"
    return json.dumps(value)
