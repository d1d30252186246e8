"""`dalembert grade`: an answer that follows from an earlier wrong one loses no points, in every command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.exercises import PENDULUM
from tests.cli.test_grade_measured import BAR, RUNS


def asks(*questions: str) -> str:
    lines = []
    for question in questions:
        quantity, _, where = question.partition("@")
        key, _, name = where.partition("=")
        row = f'where = {{ {key} = "{name}" }}\n' if where else ""
        lines.append(f'[[ask]]\nquantity = "{quantity}"\n{row}figures = 4\n')
    return "".join(lines)


def grade(
    run: Any, folder: Path, command: str, questions: tuple[str, ...], answers: tuple[float, ...]
) -> list[str]:
    """The verdicts on typed answers."""
    (folder / "e.toml").write_text(f'command = "{command}"\n' + asks(*questions))
    names = list(dict.fromkeys(q.partition("@")[2].partition("=")[0] for q in questions if "@" in q))
    rows = [",".join(["student", *names, "quantity", "answer"])]
    for question, answer in zip(questions, answers, strict=True):
        quantity, _, where = question.partition("@")
        key, _, name = where.partition("=")
        rows.append(
            ",".join(["1", *(name if key == each else "" for each in names), quantity, f"{answer:.4g}"])
        )
    (folder / "a.csv").write_text("\n".join(rows) + "\n")
    done = run("grade", "e.toml", "a.csv", "--json")
    assert done.returncode == 0, done.stderr
    return [mark["verdict"] for mark in json.loads(done.stdout)["marks"]]


DISK = "part,shape,mass_kg,radius_m\ndisk,disk,4,0.2\n"
SPINNING = "body disk.csv --omega 0,5,12 --frame-omega 0,5,0"
MOMENTUM = (
    "momentum_kg_m2_s@axis=y",
    "momentum_kg_m2_s@axis=z",
    "momentum_rate_N_m@axis=x",
    "energy_J@axis=x",
)


@pytest.mark.parametrize(
    ("answers", "verdicts"),
    [
        ((0.2, 0.96, 4.8, 6.26), ("right", "right", "right", "right")),
        # H_z = 1.123 by a slip of the pen: Ω_y·H_z = 5.615, and ω·H/2 = 7.238
        ((0.2, 1.123, 5.615, 7.238), ("right", "wrong", "carried", "carried")),
        ((0.2, 1.123, 5.715, 7.338), ("right", "wrong", "wrong", "wrong")),
        # a right H leaves nothing to carry
        ((0.2, 0.96, 5.5, 7.3), ("right", "right", "wrong", "wrong")),
        # H_y = 0.25 goes into the energy, not into Ω_y·H_z
        ((0.25, 0.96, 5.5, 6.385), ("wrong", "right", "wrong", "carried")),
    ],
)
def test_from_momentum_to_its_rate(
    dalembert: Any, tmp_path: Path, answers: tuple[float, ...], verdicts: tuple[str, ...]
) -> None:
    (tmp_path / "disk.csv").write_text(DISK)
    assert tuple(grade(dalembert, tmp_path, SPINNING, MOMENTUM, answers)) == verdicts


def test_from_the_rate_to_the_bearings(dalembert: Any, tmp_path: Path) -> None:
    """R = Ḣ over 1 m: −14.43 N·m right; with −12.34 the bearing has 12.34 N, and not −12.34."""
    (tmp_path / "rod.csv").write_text("part,shape,mass_kg,length_m,ry_deg\nrod,rod,4,1,60\n")
    command = "body rod.csv --shaft=-500mm:500mm --speed 10rad_s"
    questions = ("momentum_rate_N_m@axis=y", "bearing1_dynamic_N@axis=x", "bearing2_dynamic_N@axis=x")
    assert grade(dalembert, tmp_path, command, questions, (-12.34, 12.34, -12.34)) == [
        "wrong",
        "carried",
        "carried",
    ]
    assert grade(dalembert, tmp_path, command, questions, (-12.34, -12.34, 11.11)) == [
        "wrong",
        "wrong",
        "wrong",
    ]
    assert grade(dalembert, tmp_path, command, questions, (-14.43, 12.34, -12.34))[1] == "wrong"


ARM = """
gravity = [0, -10]
[ground]
S = [0, 0]
[links.upper]
points = { S = [0, 0], E = [0.6, 0] }
mass = 4
center = [0.25, 0]
[links.fore]
points = { E = [0, 0], T = [0.5, 0] }
mass = 2.5
center = [0.2, 0]
[[input]]
link = "upper"
angle = "0 deg"
[[input]]
link = "fore"
on = "upper"
angle = "0 deg"
[guess]
at = [0, 0]
"""


def test_from_the_elbow_to_the_shoulder(dalembert: Any, tmp_path: Path) -> None:
    """T_elbow = 5 N·m, T_shoulder = T_elbow + 10 + 15; with an elbow of 7.3 the shoulder has 32.3."""
    (tmp_path / "arm.toml").write_text(ARM)
    questions = ("fore_input_torque_N_m", "upper_input_torque_N_m")
    assert grade(dalembert, tmp_path, "forces arm.toml", questions, (5, 30)) == ["right", "right"]
    assert grade(dalembert, tmp_path, "forces arm.toml", questions, (7.3, 32.3)) == ["wrong", "carried"]
    assert grade(dalembert, tmp_path, "forces arm.toml", questions, (7.3, 33.3)) == ["wrong", "wrong"]
    assert grade(dalembert, tmp_path, "forces arm.toml", questions, (5, 32.3)) == ["right", "wrong"]


@pytest.mark.slow
def test_from_the_correction_to_the_trim(dalembert: Any, tmp_path: Path) -> None:
    """trim = correction − what stands on the rotor, as vectors; A stands with 10 g at 0°."""
    import cmath
    import csv

    (tmp_path / "runs.csv").write_text(RUNS)
    (row, *_) = csv.DictReader(dalembert("field", "runs.csv").stdout.splitlines())
    names = ("mass_g", "angle_deg", "trim_mass_g", "trim_angle_deg")
    questions = tuple(f"{name}@plane=A" for name in names)
    right = tuple(float(row[name]) for name in names)
    assert grade(dalembert, tmp_path, "field runs.csv", questions, right) == ["right"] * 4
    mass, angle = 1.2345 * right[0], right[1]
    standing = cmath.rect(right[0], cmath.pi * right[1] / 180) - cmath.rect(
        right[2], cmath.pi * right[3] / 180
    )
    size, turn = cmath.polar(cmath.rect(mass, cmath.pi * angle / 180) - standing)
    trim = (size, turn * 180 / cmath.pi % 360)
    assert grade(dalembert, tmp_path, "field runs.csv", questions, (mass, angle, *trim)) == [
        "wrong", "right", "carried", "carried",
    ]  # fmt: skip
    shifted = (round(trim[0] * 1.07, 1), round(trim[1] + 40))
    assert grade(dalembert, tmp_path, "field runs.csv", questions, (mass, angle, *shifted))[2:] == [
        "wrong",
        "wrong",
    ]


def test_the_same_slip_twice_is_one(dalembert: Any, tmp_path: Path) -> None:
    """300 rpm taken as 300 rad/s: every rate is off by one slip; the components of one vector are one answer."""
    (tmp_path / "bar.toml").write_text(BAR)
    command = "mechanism bar.toml --at 60deg"
    questions = ("bar_omega_rad_s", "C_vx_m_s", "C_vy_m_s", "B_vx_m_s")
    text = dalembert(
        "mechanism", "bar.toml", "--at", "60deg", "--set", "input.speed=300rad_s", "--json"
    ).stdout
    pose = json.loads(text)["poses"][0]
    points = pose["points"]
    answers = (
        pose["links"]["bar"]["omega_rad_s"], points["C"]["vx_m_s"], points["C"]["vy_m_s"], points["B"]["vx_m_s"],
    )  # fmt: skip
    # the speed stands in the text, so that a slip in it is looked for
    speaking = f'{command}"\ntext = "{{input.speed}}'
    assert grade(dalembert, tmp_path, speaking, questions, answers) == [
        "wrong",
        "carried",
        "carried",
        "carried",
    ]
    assert grade(dalembert, tmp_path, speaking, questions[1:3], answers[1:3]) == ["wrong", "wrong"]


BEAM = PENDULUM.replace('"-90 deg"', '"30 deg"\nspeed = "4 rad/s"\nacceleration = "6 rad/s2"')
BEAM_ASKS = ("input_torque_N_m", "O_ground_on_arm_fx_N", "O_ground_on_arm_fy_N")


@pytest.mark.parametrize(
    ("answers", "verdicts", "mistakes"),
    [
        # T = m·g·r·cos θ + (I + m·r²)·α, F = m·a − m·g: a_n = 8, a_t = 3 m/s²
        ((13.46, -16.86, 17.20), ("right", "right", "right"), ("", "", "")),
        # the weight upwards
        (
            (-3.860, -16.86, -22.80),
            ("wrong", "right", "carried"),
            ("weight of link arm has the wrong sign", "", ""),
        ),
        # a tenth of −m·a everywhere
        ((10.76, -1.686, 19.72), ("wrong", "carried", "carried"), ("inertia force of link arm", "", "")),
        # right but for the joint
        (
            (13.46, -16.86, -22.80),
            ("right", "right", "wrong"),
            ("", "", "weight of link arm has the wrong sign"),
        ),
        # another slip than the one before
        (
            (11.66, -16.86, -22.80),
            ("wrong", "right", "wrong"),
            ("inertia torque of link arm is left out", "", "weight"),
        ),
    ],
)
def test_from_a_load_to_the_joint(
    dalembert: Any,
    tmp_path: Path,
    answers: tuple[float, ...],
    verdicts: tuple[str, ...],
    mistakes: tuple[str, ...],
) -> None:
    (tmp_path / "arm.toml").write_text(BEAM)
    assert tuple(grade(dalembert, tmp_path, "forces arm.toml", BEAM_ASKS, answers)) == verdicts
    marks = json.loads(dalembert("grade", "e.toml", "a.csv", "--json").stdout)["marks"]
    for mark, mistake in zip(marks, mistakes, strict=True):
        assert mistake in (mark["mistake"] or ""), mark


def test_of_several_rotors_each_has_its_own_answers(dalembert: Any, tmp_path: Path) -> None:
    """m = 2 kg·30 mm/20 mm = 3 kg of the first rotor, 6 kg of the second: 7.123 kg there are 142.46 kg·mm."""
    (tmp_path / "r.csv").write_text("rotor,mass_kg,radius_mm,angle_deg\n1,2,30,0\n2,4,30,0\n")
    command = "balance r.csv --plane P:20mm --gravity 10"
    unbalance = "unbalance_g_mm@rotor"
    questions = ("mass_kg@rotor=1", "mass_kg@rotor=2", f"{unbalance}=2", f"{unbalance}=1")
    assert grade(dalembert, tmp_path, command, questions, (3, 7.123, 142460, 142460)) == [
        "right", "wrong", "carried", "wrong",
    ]  # fmt: skip
    assert grade(dalembert, tmp_path, command, questions, (3.456, 6, 120000, 69120)) == [
        "wrong", "right", "right", "carried",
    ]  # fmt: skip


def test_what_follows_from_a_wrong_rounding_is_carried(dalembert: Any, tmp_path: Path) -> None:
    """3 kg weigh 30 N at 10 m/s²: of 3.001 kg, one unit off, they are 30.01 N; 29.99 N are one unit off again."""
    (tmp_path / "r.csv").write_text("weight_N,radius_mm,angle_deg\n20,30,0\n")
    command = "balance r.csv --plane P:20mm --gravity 10"
    for weight, verdict in ((30.01, "carried"), (29.99, "rounding"), (30, "right")):
        verdicts = grade(dalembert, tmp_path, command, ("mass_kg", "weight_N"), (3.001, weight))
        assert verdicts == ["rounding", verdict]
    assert grade(dalembert, tmp_path, command, ("mass_kg", "weight_N"), (3, 30.01)) == ["right", "rounding"]
