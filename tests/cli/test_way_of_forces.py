"""`--steps` of `work` and `forces`: the ledger's terms add up, and it says why a force does no work."""

from __future__ import annotations

import json
import math
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from cli.examples import EXAMPLES

REASONS = {None, "perpendicular to the displacement", "at rest", "pair"}


@pytest.fixture
def copied(tmp_path: Path) -> Any:
    """Put a worked example's files where commands run."""

    def copy(name: str) -> Path:
        for file in (EXAMPLES / name).iterdir():
            (tmp_path / file.name).write_bytes(file.read_bytes())
        return tmp_path

    return copy


def document(run: Any, call: str) -> Any:
    """The JSON of a worked example's call with --steps."""
    words, left = shlex.split(call), []
    skip = False
    for word in words[1:]:
        if skip or word in ("--text", "--plot"):
            skip = word == "--plot" and not skip
            continue
        left.append(word)
    done = run(*left, "--steps", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def check_instant(instant: Any) -> None:
    """Products, shapes and the sum of one instant."""
    size = total = 0.0
    for term in instant["terms"]:
        assert set(term) >= {
            "link",
            "kind",
            "force_N",
            "velocity_m_s",
            "torque_N_m",
            "omega_rad_s",
            "power_W",
            "workless",
        }
        assert term["workless"] in REASONS
        if term["force_N"] is not None:
            (fx, fy), (vx, vy) = term["force_N"], term["velocity_m_s"]
            assert term["torque_N_m"] is None
            assert term["omega_rad_s"] is None
            if None in (fx, fy):
                # a joint force that statics does not determine
                assert term["kind"] == "joint force"
                continue
            power, reach = fx * vx + fy * vy, math.hypot(fx, fy) * math.hypot(vx, vy)
        else:
            power, reach = term["torque_N_m"] * term["omega_rad_s"], 0.0
            assert term["velocity_m_s"] is None
        if term["workless"] is None:
            assert term["power_W"] == pytest.approx(power, rel=1e-12)
        else:
            assert term["power_W"] == 0
            if term["workless"] != "pair":
                assert abs(power) <= 1e-9 * (reach + size + 1)
        total += term["power_W"]
        size += abs(term["power_W"]) + reach
    assert abs(total) <= 1e-9 * size


def check_free_body(body: Any) -> None:
    """On every link cut loose ΣF = 0 and ΣM_G = 0."""
    x, y = body["center_m"]
    fx = fy = moment = size = reach = 0.0
    for force in body["forces"]:
        (fx1, fy1), (px, py) = force["force_N"], force["at_m"]
        if fx1 is None or fy1 is None:
            # statics does not determine a redundant joint
            return
        fx, fy = fx + fx1, fy + fy1
        moment += (px - x) * fy1 - (py - y) * fx1
        size += math.hypot(fx1, fy1)
        reach += math.hypot(px - x, py - y) * math.hypot(fx1, fy1)
    for torque in body["torques"]:
        if torque["torque_N_m"] is None:
            return
        moment += torque["torque_N_m"]
        reach += abs(torque["torque_N_m"])
    assert math.hypot(fx, fy) <= 1e-9 * size
    assert abs(moment) <= 1e-9 * reach


FORCES = (
    "crank-press", "door-closer", "engine", "grindstone", "robot-arm", "scissors-lift", "sledge", "toggle-clamp",
    "desk-lamp", "stephenson-six-bar", "quick-return",
)  # fmt: skip


@pytest.mark.parametrize("name", FORCES)
def test_the_powers_of_every_worked_example_add_up_to_zero(name: str, dalembert: Any, copied: Any) -> None:
    import tomllib

    example = tomllib.loads((EXAMPLES / name / "example.toml").read_text())
    copied(name)
    command = example["command"].split(" --")[0].split()
    call = f"dalembert forces {command[2]}"
    if command[1] == "forces":
        call = (
            example["command"].replace(":1deg", ":45deg").replace(":2deg", ":45deg").split(" --flywheel")[0]
        )
    topics = document(dalembert, call)["way"]
    (topic,) = (each for each in topics if each["topic"] == "ledger")
    (cut,) = (each for each in topics if each["topic"] == "free bodies")
    for pose in cut.get("poses", [cut]):
        for body in pose["bodies"]:
            check_free_body(body)
    assert topic["poses"]
    for pose in topic["poses"]:
        assert "input_deg" in pose or "input_m" in pose or "inputs" in pose
        check_instant(pose)


def test_riuls_example_term_by_term(dalembert: Any, copied: Any) -> None:
    """Example 1 of the second document: +80 and −4 000 where it prints −80 and +4 000; T = 103 000."""
    copied("riul-slider-crank")
    call = "dalembert work states.csv --gravity 0,-10"
    (topic,) = document(dalembert, call)["way"]
    (step,) = topic["steps"]
    assert step["step"] == "1"
    check_instant(step)
    powers = {(t["link"], t["kind"]): t["power_W"] for t in step["terms"] if t["workless"] is None}
    assert powers == {
        ("4", "applied force"): -2_500_000.0,
        ("3", "weight"): -6_000.0,
        ("3", "inertia force"): -450_000.0,
        ("4", "inertia force"): 900_000.0,
        ("3", "inertia torque"): -4_000.0,
        ("2", "unknown"): 2_060_000.0,
    }
    by = {(t["link"], t["kind"]): t for t in step["terms"]}
    assert by["3", "inertia torque"]["torque_N_m"] == 80.0
    assert by["3", "inertia force"]["force_N"] == [-2700.0, 1800.0]
    assert by["2", "weight"]["workless"] == "at rest"
    assert by["4", "weight"]["workless"] == "perpendicular to the displacement"


def test_without_steps_there_is_no_way(dalembert: Any, copied: Any) -> None:
    copied("riul-slider-crank")
    done = dalembert("work", "states.csv", "--gravity", "0,-10", "--json")
    assert "way" not in json.loads(done.stdout)


def test_a_weight_on_an_arm(dalembert: Any, tmp_path: Path) -> None:
    """The simplest case: 2 kg at 0.5 m, held level: T = 2·9.81·0.5, and the bearing's force is at rest."""
    (tmp_path / "arm.toml").write_text(
        'gravity = [0, -9.81]\n[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], P = [1, 0] }\nmass = 2\n'
        'center = [0.5, 0]\n[input]\nlink = "arm"\nangle = 0\n'
    )  # fmt: skip
    topic, cut = document(dalembert, "dalembert forces arm.toml")["way"]
    (body,) = cut["bodies"]
    assert [(f["name"], f["force_N"]) for f in body["forces"]] == [
        ("W", [0, -19.62]),
        ("O: ground", [0, 19.62]),
    ]
    assert [(t["name"], t["torque_N_m"]) for t in body["torques"]] == [("T", 9.81)]
    (pose,) = topic["poses"]
    weight, drive, bearing = pose["terms"]
    assert (weight["kind"], weight["force_N"], weight["velocity_m_s"]) == (
        "weight",
        [0.0, -19.62],
        [0.0, 0.5],
    )
    assert (drive["kind"], drive["torque_N_m"], drive["power_W"]) == ("unknown", 9.81, 9.81)
    assert (bearing["kind"], bearing["workless"], bearing["force_N"]) == (
        "joint force",
        "at rest",
        [0.0, 19.62],
    )


def test_the_way_is_on_the_terminal_and_in_the_report(dalembert: Any, copied: Any, tmp_path: Path) -> None:
    copied("riul-slider-crank")
    report = tmp_path / "r.html"
    done = dalembert("work", "states.csv", "--gravity", "0,-10", "--steps", "--report", str(report))
    for text in (done.stdout, report.read_text()):
        assert "Ti3·ω3 = 80·(−50) = −4 000 W" in text
        assert "T2 = 103 000 N·m" in text


def test_every_part_of_a_wide_ledger_names_its_pose(dalembert: Any, copied: Any, tmp_path: Path) -> None:
    """The parts of a table that is wider than the page had the link, but not the input: of which pose nobody saw."""
    copied("door-closer")
    report = tmp_path / "r.html"
    done = dalembert("forces", "door.toml", "--over", "0deg:90deg:45deg", "--steps", "--report", str(report))
    assert done.returncode == 0, done.stderr
    heads = [
        re.findall(r"<th[^>]*>(.*?)</th>", head)
        for head in re.findall(r"<thead>(.*?)</thead>", report.read_text(), re.S)
    ]
    ledger = [
        head
        for head in heads
        if "kind" in head and ("power [W]" in head or "Fx [N]" in head) and "x [m]" not in head
    ]
    assert len(ledger) == 2
    assert all(head[:3] == ["input [°]", "link", "kind"] for head in ledger)


def test_a_link_that_carries_a_motor_has_their_common_centre(dalembert: Any, tmp_path: Path) -> None:
    """2 kg at 0.5 m with a motor of 2 kg at 1 m: G′ at 0.75 m, I′ = 0.1 + 4·0.25² = 0.35; ±T_M on both (Ibrahim §2.3)."""
    (tmp_path / "arm.toml").write_text(
        "gravity = [0, -10]\n[ground]\nO = [0, 0]\n"
        "[links.arm]\npoints = { O = [0, 0], P = [1, 0] }\nmass = 2\ncenter = [0.5, 0]\ninertia = 0.1\n"
        "[links.tool]\npoints = { P = [0, 0] }\nmass = 1\ncenter = [0.2, 0]\n"
        '[[motors]]\ncarrier = "arm"\ndrives = "tool"\nmass = 2\ncenter = [1, 0]\n'
        '[[input]]\nlink = "arm"\nangle = 0\n[[input]]\nlink = "tool"\non = "arm"\nangle = 0\n'
    )
    motor, ledger, cut = document(dalembert, "dalembert forces arm.toml")["way"]
    assert (motor["topic"], motor["carrier"], motor["drives"]) == ("motor", "arm", "tool")
    assert (motor["mass_kg"], motor["center_m"]) == (4.0, [0.75, 0.0])
    assert motor["inertia_kg_m2"] == pytest.approx(0.35)
    assert motor["torque_N_m"] == pytest.approx(2.0)
    for pose in ledger["poses"]:
        check_instant(pose)
    torques = {(b["link"], t["name"]): t["torque_N_m"] for b in cut["bodies"] for t in b["torques"]}
    assert torques["tool", "T"] == pytest.approx(2.0)
    assert torques["arm", "−T"] == pytest.approx(-2.0)


@pytest.mark.parametrize("guide", [0, 90, 180, 270])
@pytest.mark.parametrize("crank", [40, 90, 270])
def test_components_that_are_zero_are_zero(dalembert: Any, tmp_path: Path, crank: int, guide: int) -> None:
    """(−5.76, 2.1e−16) stood for the velocity of a piston, and a column of 3.5e−16 beside one of 5.76."""
    way = complex(round(math.cos(math.radians(guide))), round(math.sin(math.radians(guide))))
    (tmp_path / "s.toml").write_text(
        "[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], A = [0.06, 0] }\nmass = 2\ncenter = [0.03, 0]\n"
        "[links.rod]\npoints = { A = [0, 0], B = [0.2, 0] }\nmass = 1.5\ncenter = [0.08, 0]\ninertia = 0.005\n"
        '[links.piston]\npoints = { B = [0, 0] }\nmass = 1.2\n[[sliders]]\npoint = "B"\nlink = "piston"\n'
        f"on = \"ground\"\nthrough = [0, 0]\nangle = '{guide} deg'\n"
        f'[[forces]]\nlink = "piston"\npoint = "B"\nforce = [{-500 * way.real}, {-500 * way.imag}]\n'
        '[input]\nlink = "crank"\nspeed = 100\nacceleration = 0\n'
        f"[guess]\nat = '{guide + 40} deg'\nrod = '{guide - 10} deg'\n"
    )
    call = ("forces", "s.toml", "--at", f"{crank + guide}deg", "--steps")
    done = dalembert(*call, "--text", "--report", "r.html")
    assert done.returncode == 0, done.stderr
    shown = done.stdout[done.stdout.index("Ledger") :] + (tmp_path / "r.html").read_text().split("Ledger")[1]
    words = re.sub(r"<svg.*?</svg>", "", shown, flags=re.S)
    assert words.count("inertia force") > 3
    assert re.findall(r"[^ >(]*e[-−][123]\d", words) == []
