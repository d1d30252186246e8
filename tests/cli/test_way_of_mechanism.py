"""`mechanism --steps`: loops, both roots of closed forms, Newton's iterates, parts that add up to each acceleration."""

from __future__ import annotations

import json
import tomllib
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.examples import EXAMPLES

MECHANISMS = sorted(
    file.parent.name
    for file in EXAMPLES.glob("*/example.toml")
    if not file.parent.name.startswith("exercise-")
    and (
        " mechanism " in file.read_text() or " forces " in file.read_text() or " inspect " in file.read_text()
    )
)


def way(run: Any, folder: Path, name: str, *words: str) -> tuple[Any, dict[str, Any]]:
    """The document and its topics; of the groups the last."""
    for file in (EXAMPLES / name).iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    command = tomllib.loads((EXAMPLES / name / "example.toml").read_text())["command"].split()
    toml = next(word for word in command if word.endswith(".toml"))
    more = [*words]
    if not words and "--cases" in command:
        more = ["--cases", command[command.index("--cases") + 1]]
    done = run("mechanism", toml, *more, "--order", "acceleration", "--steps", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    return document, {topic["topic"]: topic for topic in document["way"]}


def entries(topic: Any, document: Any) -> list[Any]:
    return topic["poses"] if "poses" in topic else [topic] * len(document["poses"])


@pytest.mark.parametrize("name", MECHANISMS)
def test_parts_add_up_and_roots_hold_the_pose_in_every_worked_example(
    name: str, dalembert: Any, tmp_path: Path
) -> None:
    document, topics = way(dalembert, tmp_path, name)
    for topic in document["way"]:
        for entry, pose in zip(entries(topic, document), document["poses"], strict=True):
            if not pose["assembled"]:
                continue
            if topic["topic"] == "parts":
                check_parts(entry["points"], pose)
            if topic["topic"] == "group" and topic["case"] is not None:
                check_roots(entry, pose)
    for loop in topics.get("loops", {"loops": []})["loops"]:
        assert loop.endswith(" = 0")
        assert " − " in loop
        # no step from a point to itself
        ways = [part.split("→") for part in loop.removesuffix(" = 0").split(" − ")]
        assert not any(a == b for names in ways for a, b in pairwise(names))
    if name == "engine":
        assert topics["loops"]["loops"] == ["O→A→B − O→B = 0"]


def check_parts(points: Any, pose: Any) -> None:
    assert points
    for each in points:
        total = [
            sum(each[f"{part}_m_s2"][k] for part in ("base", "tangential", "normal", "relative", "coriolis"))
            for k in (0, 1)
        ]
        point = pose["points"][each["point"]]
        size = sum(
            hypot(*each[f"{part}_m_s2"]) for part in ("base", "tangential", "normal", "relative", "coriolis")
        )
        assert total == pytest.approx([point["ax_m_s2"], point["ay_m_s2"]], abs=1e-9 * (size + 1e-9))
        velocity = [each["carried_velocity_m_s"][k] + each["relative_velocity_m_s"][k] for k in (0, 1)]
        assert velocity == pytest.approx([point["vx_m_s"], point["vy_m_s"]], rel=1e-9, abs=1e-9)


def check_roots(entry: Any, pose: Any) -> None:
    taken = entry["roots"][entry["taken"] - 1]
    point = pose["points"][taken["point"]]
    assert [taken["x_m"], taken["y_m"]] == pytest.approx([point["x_m"], point["y_m"]], abs=1e-7)
    for key, value in taken["unknowns"].items():
        if key.endswith("_deg"):
            angle = pose["links"][key.removesuffix("_deg")]["angle_deg"]
            assert (value - angle + 180) % 360 - 180 == pytest.approx(0, abs=1e-5)
            assert 0 <= value < 360


def test_klann_as_in_the_third_document(dalembert: Any, tmp_path: Path) -> None:
    document, topics = way(dalembert, tmp_path, "klann", "--at", "60deg", "--at", "61deg", "--newton")
    assert topics["loops"]["loops"] == ["A→B→C − A→D→C = 0", "A→B→G→F − A→E→F = 0"]
    groups = [topic for topic in document["way"] if topic["topic"] == "group"]
    assert [(g["links"], g["case"]) for g in groups] == [(["coupler", "rocker"], 4), (["arm", "leg"], 4)]
    first, second = topics["newton"]["poses"]
    assert (first["input_deg"], second["input_deg"]) == (60.0, 61.0)
    # the printed table: -15, 60, 45, -60, then -10.5138 67.0096 36.7327 -45.7046
    assert list(first["iterates"][0]["unknowns"].values()) == [-15, 60, 45, -60]
    assert list(first["iterates"][1]["unknowns"].values()) == pytest.approx(
        [-10.5138, 67.0096, 36.7327, -45.7046], abs=3e-3
    )
    assert list(first["iterates"][0]["unknowns"]) == ["coupler_deg", "rocker_deg", "arm_deg", "leg_deg"]
    # each pose begins with the last solution
    last = first["iterates"][-1]["unknowns"]
    assert second["iterates"][0]["unknowns"] == last
    for pose in (first, second):
        for it, following in zip(pose["iterates"], pose["iterates"][1:], strict=False):
            step, f, jacobian = map(np.array, (it["step"], it["residual"], it["jacobian"]))
            np.testing.assert_allclose(jacobian @ step, -f, atol=1e-12)
            moved = [following["unknowns"][key] - it["unknowns"][key] for key in it["unknowns"]]
            np.testing.assert_allclose(np.degrees(step), moved, atol=1e-9)


def test_a_crank_alone(dalembert: Any, tmp_path: Path) -> None:
    """The simplest case: r = 2 m, 3 rad/s, 5 rad/s²: Aᵗ = 10 up, Aⁿ = 18 inwards; its mirror image too."""
    for sign in (1, -1):
        (tmp_path / "c.toml").write_text(
            "[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], P = [2, 0] }\n"
            f'[input]\nlink = "crank"\nangle = 0\nspeed = {3 * sign}\nacceleration = {5 * sign}\n'
        )
        done = dalembert("mechanism", "c.toml", "--steps", "--json")
        (parts,) = json.loads(done.stdout)["way"]
        (p,) = parts["points"]
        assert (p["point"], p["on"], p["from"]) == ("P", "crank", "O")
        assert p["tangential_m_s2"] == pytest.approx([0, 10 * sign])
        assert p["normal_m_s2"] == pytest.approx([-18, 0])
        assert p["carried_velocity_m_s"] == pytest.approx([0, 6 * sign])
        assert p["relative_velocity_m_s"] == p["coriolis_m_s2"] == p["base_m_s2"] == [0, 0]


def test_the_coriolis_term_of_a_slide_on_a_turning_bar(dalembert: Any, tmp_path: Path) -> None:
    document, topics = way(dalembert, tmp_path, "quick-return", "--at", "200deg")
    (slide,) = (p for p in topics["parts"]["points"] if (p["point"], p["on"]) == ("B", "link3"))
    link, s = document["poses"][0]["links"]["link3"], document["poses"][0]["slides"]["B"]
    size = abs(2 * link["omega_rad_s"] * s["speed_m_s"])
    assert hypot(*slide["coriolis_m_s2"]) == pytest.approx(size)
    assert hypot(*slide["relative_m_s2"]) == pytest.approx(abs(s["acceleration_m_s2"]))


def test_variants_and_assemblies_are_told_apart(dalembert: Any, tmp_path: Path) -> None:
    document, _ = way(
        dalembert, tmp_path, "klann", "--at", "60deg", "--set", "links.crank.B.x=121", "--branch", "all"
    )
    assert {topic["branch"] for topic in document["way"]} >= {1, 2}
    done = dalembert(
        "mechanism", "klann.toml", "--over", "links.crank.B.x=120:122:1", "--at", "60deg", "--steps", "--json"
    )
    topics = json.loads(done.stdout)["way"]
    assert {topic["variant"] for topic in topics} == {"1", "2", "3"}


def test_the_report_has_the_polygons(dalembert: Any, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    way(dalembert, tmp_path, "quick-return", "--at", "200deg", "--report", "r.html", "--text")
    text = (tmp_path / "r.html").read_text()
    assert "Chace's case 1" in text.replace("&#x27;", "'")
    assert "from the pole" in text
