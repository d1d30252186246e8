"""A value of a wrong type in a TOML file is refused with its key, as TOML writes it, and with what was expected."""

from __future__ import annotations

import datetime
import re
from pathlib import Path
from typing import Any

import pytest

from dalembert.errors import DataError, toml_text
from dalembert.results.about import HEAD, about
from rigidbody3d.turning_body import read_body
from tests.conftest import Dalembert
from virtualwork import Mechanism
from virtualwork.describe import DescriptionError

WRONG: dict[str, Any] = {
    "true": True,
    "false": False,
    "[true, 'a']": [True, "a"],
    "{x = true}": {"x": True},
    "3.5": 3.5,
    "12:30:00": datetime.time(12, 30),
}
SPRING = """
name = "bar"
ground = { O = [0, 0], P = [0, 1] }
links = { bar = { points = { O = [0, 0], E = [1, 0] }, mass = 1 } }
input = { link = "bar" }
guess = { at = 0 }
"""
PARTS = {
    "springs": {
        "between": '["bar.E", "ground.P"]',
        "stiffness": "100",
        "free_length": "0.1",
        "damping": "1",
    },
    "forces": {"link": '"bar"', "point": '"E"', "force": "[1, 2]", "frame": '"link"'},
    "torques": {"link": '"bar"', "torque": "3"},
}
NUMBERS = {"stiffness", "free_length", "damping", "torque"}
PYTHON = re.compile(r"\bTrue\b|\bFalse\b|datetime|\bNone\b|'x': ")


@pytest.mark.whole
@pytest.mark.parametrize("key", HEAD)
def test_report(key: str) -> None:
    for text, value in WRONG.items():
        expected = "text in quotes, or a date" if key == "date" else "text in quotes"
        with pytest.raises(DataError) as refused:
            about("f.toml", {"report": {key: value}})
        assert str(refused.value) == f"f.toml: [report] {key}: found {text}, expected {expected}"
    assert about("f.toml", {"report": {key: "7"}}) == {key: "7"}


def test_dates_of_a_report() -> None:
    for value, text in ((datetime.date(2026, 3, 1), "2026-03-01"), (2026, "2026")):
        assert about("f.toml", {"report": {"date": value}}) == {"date": text}
    with pytest.raises(DataError, match=r"\[report\]: found true, expected a table with some of title"):
        about("f.toml", {"report": True})


@pytest.mark.whole
@pytest.mark.parametrize(("table", "key"), [(table, key) for table, keys in PARTS.items() for key in keys])
def test_keys_of_parts(table: str, key: str) -> None:
    def text(value: str) -> str:
        entries = {**PARTS[table], key: value}
        return SPRING + f"[[{table}]]\n" + "".join(f"{name} = {of}\n" for name, of in entries.items())

    assert Mechanism.from_toml_text(text(PARTS[table][key]), "f.toml")
    for written in WRONG:
        if written == "3.5" and key in NUMBERS:
            continue
        with pytest.raises(DescriptionError) as refused:
            Mechanism.from_toml_text(text(written), "f.toml")
        message = str(refused.value)
        assert f"[[{table}]] 1 {key}:" in message
        assert "expected" in message
        assert not PYTHON.search(message), message
        if written in ("true", "false"):
            assert f"found {written}, expected" in message


@pytest.mark.whole
@pytest.mark.parametrize(
    "line",
    [
        "name = true",
        "gravity = true",
        "gravity = [true, 1]",
        "guess = true",
        "links = true",
        "ground = [true]",
    ],
)
def test_keys_at_the_top(line: str) -> None:
    key = line.split(" = ")[0]
    text = "\n".join(row for row in SPRING.splitlines() if not row.startswith(f"{key} =")) + f"\n{line}\n"
    with pytest.raises(DescriptionError, match=r"found \[?true") as refused:
        Mechanism.from_toml_text(text, "f.toml")
    assert not PYTHON.search(str(refused.value))


@pytest.mark.whole
@pytest.mark.parametrize("key", ["name", "inertia", "omega", "attitude", "torque", "frame", "parts", "top"])
def test_keys_of_a_body(key: str, tmp_path: Path) -> None:
    own = {"inertia": "[1, 2, 3]", "omega": "[0, 1, 0]"}
    if key == "parts":
        del own["inertia"]
    for written in WRONG:
        (tmp_path / "f.toml").write_text("".join(f"{k} = {v}\n" for k, v in {**own, key: written}.items()))
        with pytest.raises(DataError) as refused:
            read_body(str(tmp_path / "f.toml"))
        assert key in str(refused.value)
        assert not PYTHON.search(str(refused.value)), refused.value


def test_values_as_toml_has_them() -> None:
    assert (
        toml_text({"a": [True, {"b": False}], "c": datetime.date(2026, 3, 1)})
        == "{a = [true, {b = false}], c = 2026-03-01}"
    )
    assert toml_text("a 'b'") == "\"a 'b'\""


def test_columns_and_exercises(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "runs.csv").write_text("run,sensor,amplitude_um,phase_deg\n0,1,2,3\n")
    (tmp_path / "f.toml").write_text("mass_g = true\n")
    done = dalembert("field", "runs.csv", "--columns", "f.toml")
    assert done.returncode == 1
    assert "f.toml: mass_g: found true, expected a header in quotes" in done.stderr
    (tmp_path / "f.toml").write_text("command = true\n")
    done = dalembert("exercise", "f.toml", "-o", "out")
    assert done.returncode == 1
    assert "key command: found true, expected a text" in done.stderr
