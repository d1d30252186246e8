"""`--find NAME --so-that QUANTITY=VALUE`: the ω, the length or the angle with which a quantity has a value."""

from __future__ import annotations

import json
from math import asin, degrees
from pathlib import Path
from typing import Any

import pytest

CRANK = (
    'gravity = [0, -10]\n[ground]\nO = [0, 0]\n[links.crank]\npoints = {{ O = [0, 0], P = [2, 0] }}\nmass = 3\ncenter = [1, 0]\n'
    '[input]\nlink = "crank"\nangle = "{angle} deg"\nspeed = {speed}\n'
)  # fmt: skip


def found(run: Any, command: str, *words: str) -> Any:
    done = run(command, "c.toml", *words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_speed_of_a_crank(dalembert: Any, tmp_path: Path) -> None:
    """v = ω·r: 5 m/s at r = 2 m needs 2.5 rad/s; its mirror image −2.5."""
    (tmp_path / "c.toml").write_text(CRANK.format(angle=0, speed=1))
    for v in (5, -5):
        document = found(dalembert, "mechanism", "--find", "input.speed", f"--so-that=P.vy={v}")
        assert document["found"] == {"input.speed_rad_s": pytest.approx(v / 2, rel=1e-14)}
        assert document["poses"][0]["points"]["P"]["vy_m_s"] == pytest.approx(v)
    assert found(dalembert, "mechanism", "--find", "input.speed", "--so-that", "P.vy=0")["found"] == {
        "input.speed_rad_s": pytest.approx(0, abs=1e-14)
    }


def test_the_angle_at_which_a_torque_holds(dalembert: Any, tmp_path: Path) -> None:
    """T = m·g·cos θ = 30·cos θ: 15 N·m at 60°; 31 at none."""
    (tmp_path / "c.toml").write_text(CRANK.format(angle=50, speed=0))
    document = found(dalembert, "forces", "--find", "input.angle", "--so-that", "crank.torque=15N_m")
    assert document["found"]["input.angle_deg"] == pytest.approx(60, rel=1e-12)
    done = dalembert("forces", "c.toml", "--find", "input.angle", "--so-that", "crank.torque=31")
    assert done.returncode == 1
    assert "no value in reach" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_length_in_the_unit_of_the_file(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(
        '[units]\nlength = "mm"\nangle = "deg"\n[ground]\nO = [0, 0]\n[links.crank]\n'
        'points = { O = [0, 0], P = [200, 0] }\n[input]\nlink = "crank"\nangle = 30\n'
    )
    document = found(dalembert, "mechanism", "--find", "links.crank.P.x", "--so-that", "P.y=150")
    assert document["found"] == {"links.crank.P.x_m": pytest.approx(0.3, rel=1e-13)}
    text = dalembert(
        "mechanism", "c.toml", "--find", "links.crank.P.x", "--so-that", "P.y=150", "--text"
    ).stdout
    assert "found: links.crank.P.x = 300 mm gives P.y = 0.15 m" in text
    document = found(dalembert, "mechanism", "--find", "input.angle", "--so-that", "P.y=150mm")
    assert document["found"]["input.angle_deg"] == pytest.approx(degrees(asin(0.75)), rel=1e-12)


def test_wrong_words(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(CRANK.format(angle=0, speed=1))
    for words, text in (
        (("--find", "input.speed"), "--so-that QUANTITY=VALUE"),
        (("--find", "input.speed", "--so-that", "P=3"), "expected one number"),
        (("--find", "input.speed", "--so-that", "P.vy"), "QUANTITY=VALUE"),
        (("--find", "input.sped", "--so-that", "P.vy=3"), "input.speed"),
        (("--find", "input.speed", "--so-that", "P.vy=3kg"), "expected a number"),
        (("--find", "input.speed", "--so-that", "P.vy=3", "--over", "0deg:90deg:30deg"), "one pose"),
    ):
        done = dalembert("mechanism", "c.toml", *words)
        assert done.returncode == 2
        assert text in " ".join(done.stderr.split())
