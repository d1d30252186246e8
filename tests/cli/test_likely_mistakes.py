"""Likely mistakes: answers with one slip are named, random wrong numbers are not."""

from __future__ import annotations

import csv
import json
import random
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from balancing import correct
from cli.examples import names
from cli.exercise.description import Answer, Ask, read_exercise
from cli.exercise.recomputed import candidates
from cli.exercise.slips import Candidates, Slip
from cli.exercise.variants import variants, workshop
from dalembert.figures import Right, typed, written
from tests.cli.exercises import EXERCISE, ROTOR
from tests.cli.test_grade import STATES, WORK
from tests.conftest import Dalembert

FIGURES = 4


FIELD = """run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg,trial_kept
0,1,80,40,,,,
0,2,60,55,,,,
1,1,70,75,A,10,0,yes
1,2,66,80,A,10,0,yes
2,1,95,60,B,12,90,
2,2,40,100,B,12,90,
"""
TORQUE = "angle_deg,torque_N_m\n0,100\n60,340\n150,-80\n240,260\n300,-20\n360,100\n"
READINGS = "turned_deg,amplitude_um,phase_deg\n0,52,30\n90,41,75\n180,60,130\n270,33,200\n"
CYLINDERS = "cylinder,crank_deg,z_mm,throw_mm,rod_mm,reciprocating_kg,rotating_kg\n1,0,0,40,140,0.5,0.3\n2,180,90,40,140,0.6,0.3\n"
TOP = "inertia = [0.02, 0.02, 0.01]\nomega = [0, 0, 200]\nattitude = [0.9659258262890683, 0.25881904510252074, 0, 0]\n[top]\nmgl = 2\n"
SLIDER = """
gravity = [0, -10]
[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], A = [0.06, 0] }
mass = 1.3
center = [0.03, 0]
inertia = 0.002
[links.rod]
points = { A = [0, 0], B = [0.23, 0] }
mass = 0.8
center = [0.08, 0]
inertia = 0.005
[links.piston]
points = { B = [0, 0] }
mass = 0.5
[[sliders]]
point = "B"
link = "piston"
turned = 0
[[forces]]
link = "piston"
point = "B"
force = [-700, 0]
[input]
link = "crank"
angle = "50 deg"
speed = "140 rad/s"
[guess]
rod = "-11 deg"
"""
OTHERS = {
    "forces": ("engine.toml", SLIDER, "forces engine.toml", ['"O_ground_on_crank_fx_N"', '"A_crank_on_rod_fy_N"', '"B_ground_on_piston_fy_N"']),
    "field": ("runs.csv", FIELD, "field runs.csv", ['"mass_g"@plane=A', '"angle_deg"@plane=A', '"mass_g"@plane=B', '"trim_mass_g"@plane=A']),
    "flywheel": ("torque.csv", TORQUE, "flywheel torque.csv --speed 600rpm --fluctuation 0.02", ['"mean_torque_N_m"', '"flywheel_inertia_kg_m2"']),
    "index": ("readings.csv", READINGS, "index readings.csv", ['"amplitude_um"@part=rotor', '"phase_deg"@part=rotor']),
    "engine": ("cylinders.csv", CYLINDERS, "engine cylinders.csv --speed 3000rpm", ['"force_y_sin_N"@order=1', '"couple_y_cos_N_m"@order=2']),
    "spin": ("top.toml", TOP, "spin top.toml --at 0.02", ['"slow_rad_s"', '"momentum_y_kg_m2_s"']),
}  # fmt: skip
"""Of further commands: a file, its text, the command, questions."""


def every_question(name: str, folder: Path, count: int, figures: int) -> list[Candidates]:
    """The questions of a worked exercise, or of a further command, with so many figures."""
    if name in OTHERS:
        file, text, command, asks = OTHERS[name]
        (folder / file).write_text(text)
        lines = [f'command = "{command}"']
        for ask in asks:
            quantity, _, where = ask.partition("@")
            key, _, row = where.partition("=")
            lines += [
                "[[ask]]",
                f"quantity = {quantity}",
                *([f'where = {{ {key} = "{row}" }}'] if where else []),
            ]
            lines.append(f"figures = {figures}")
        exercise = "\n".join(lines) + "\n"
    else:
        exercise = re.sub(r"figures = \d", f"figures = {figures}", (folder / f"{name}.toml").read_text())
    (folder / "e.toml").write_text(exercise)
    with workshop(read_exercise(str(folder / "e.toml"))) as shop:
        every = [own for variant in variants(shop, count, 3, []) for own in candidates(variant)]
        for own in every:
            # pairs are formed while the tables are there
            own.name(typed("1.2345e-7")[0])
    return [own for own in every if own.wrong]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*OTHERS, *(each for each in names() if each.startswith("exercise-"))])
def test_a_slip_is_named_in_every_command(
    name: str, dalembert: Dalembert, tmp_path: Path, first_seed: int
) -> None:
    """Of 1000 answers with one slip nearly all that no other makes have its name, none another's; of random numbers few have one."""
    if name not in OTHERS:
        assert dalembert("examples", name).returncode == 0
    # numbers as round as those of the slider-crank give two slips nearly the same digits more often than others
    close = name == "exercise-slider-crank"
    for figures, least, most in ((2, 0.0, 0.015), (3, 0.94 if close else 0.97, 0.07), (4, 0.97, 0.02)):
        named, other, met = share_named(every_question(name, tmp_path, 2, figures), 1000, first_seed, figures)
        print(f"{name}, {figures} figures: named {named:.1%}, random {met:.1%}")
        assert named >= least
        assert other <= 0.002
        assert met <= most


@pytest.fixture
def questions(tmp_path: Path) -> list[Candidates]:
    """Questions of virtual work with other loads, and of rotors with other masses."""
    (tmp_path / "rotor.csv").write_text(ROTOR)
    (tmp_path / "states.csv").write_text(STATES)
    draw = '[draw]\n"states.csv:4.fx_N" = "3000N:7000N:250N"\n"states.csv:3.mass_kg" = "2kg:5kg:0.5kg"\n'
    (tmp_path / "w.toml").write_text(WORK.replace("[[ask]]", f"{draw}[[ask]]"))
    (tmp_path / "e.toml").write_text(EXERCISE.replace("figures = 3", "figures = 4"))
    found = []
    for name, count in (("w.toml", 12), ("e.toml", 6)):
        with workshop(read_exercise(str(tmp_path / name))) as shop:
            for variant in variants(shop, count, 1, []):
                found += candidates(variant)
    return found


def share_named(
    questions: list[Candidates], count: int, seed: int, figures: int = FIGURES
) -> tuple[float, float, float]:
    """Of answers that one slip alone makes the share with its name; of all the share with another's; of random wrong ones with any."""
    draw = random.Random(seed)
    slipped = alone = named = other = 0
    while slipped < count:
        own = draw.choice(questions)
        slip = draw.choice(own.singles)
        (answer, *_) = (
            typed(written(slip.value, figures)) if np.isfinite(slip.value) and slip.value else (None,)
        )
        if (
            answer is None
            or own.right.verdict(answer) != "wrong"
            or (own.answer.is_angle and abs(own.answer.distance(slip.value, own.answer.value)) < 0.06)
        ):
            continue
        slipped += 1
        name = own.name(answer)
        # several slips may make one number
        made = [each.value for each in own.singles if each.text == name]
        is_own = any(abs(own.answer.distance(value, slip.value)) <= 1e-8 * abs(slip.value) for value in made)
        same = {
            f"{each.value:.8g}" for each in own.wrong if written(each.value, figures) == str(answer.value)
        }
        alone += len(same) == 1
        named += is_own and len(same) == 1
        # 102 800 is the name of what makes it, not of 102 820
        exact = any(abs(value - float(answer.value)) <= 1e-9 * abs(value) for value in made)
        other += name is not None and not is_own and not exact
    wrong = met = 0
    while wrong < count:
        own = draw.choice(questions)
        value = (
            draw.uniform(0, 360)
            if own.answer.is_angle
            else own.answer.value * 10 ** draw.uniform(-1, 1) * draw.choice([-1, 1, 1, 1])
        )
        (answer, *_) = typed(written(value, figures))
        if own.right.verdict(answer) != "wrong":
            continue
        wrong += 1
        met += own.name(answer) is not None
    return named / alone, other / count, met / count


def test_one_slip_is_named_and_a_random_number_is_not(questions: list[Candidates]) -> None:
    named, other, met = share_named(questions, 600, 1)
    assert named >= 0.97
    assert other == 0
    assert met <= 0.02


@pytest.mark.parametrize(("figures", "least", "most"), [(2, 0.0, 0.01), (3, 0.97, 0.05)])
def test_of_two_and_three_figures(
    dalembert: Dalembert, tmp_path: Path, figures: int, least: float, most: float
) -> None:
    """A random number of two figures gets a name in less than one of a hundred cases; no slip gets the name of another."""
    assert dalembert("examples", "exercise-static").returncode == 0
    named, other, met = share_named(every_question("exercise-static", tmp_path, 2, figures), 600, 1, figures)
    assert named >= least
    assert other == 0
    assert met <= most


def test_a_slip_is_named_where_it_alone_makes_the_answer() -> None:
    made = {
        "one": 12.32,
        "two": 12.38,
        "three": -98.6,
        "four": 52.01,
        "five": 51.98,
        "six": 77.7,
        "seven": 12345.0,
        "eight": 102800.0,
        "nine": 102820.0,
        "ten": 99461.0,
        "eleven": 99458.0,
        "twelve": 113950.0,
        "thirteen": 113500.0,
    }
    made["of the same value"] = 77.7 * (1 + 1e-13)
    slips = [Slip(text, value) for text, value in made.items()]
    for figures, answer, name in (
        (4, "12.32", "one"),
        (4, "12.38", "two"),
        # 12.32 rounds to 12.3, 12.38 does not
        (3, "12.3", "one"),
        (3, "52.0", None),
        (3, "77.7", "six"),
        (3, "-98.6", "three"),
        # a unit is 1 % of the answer, or 8 %: a random number of two digits would often meet a slip of 12
        (2, "-99", "three"),
        (2, "12", None),
        (4, "12345", "seven"),
        (4, "12350", "seven"),
        (4, "12000", None),
        # a whole number that a slip makes exactly, and one to which two round
        (4, "102800", "eight"),
        (4, "99460", None),
        # both round to it, the one from closer by
        (3, "114000", None),
    ):
        own = Candidates(Answer(Ask("mass_kg", {}, figures, Fraction(1), ""), 30.0, "kg"), slips)
        assert own.name(typed(answer)[0]) == name, (figures, answer)


@pytest.mark.slow
def test_ten_thousand_answers(questions: list[Candidates], first_seed: int) -> None:
    named, other, met = share_named(questions, 10_000, first_seed)
    assert named >= 0.97
    assert other == 0
    assert met <= 0.02


def test_a_slip_is_what_another_calculation_makes_of_it(tmp_path: Path) -> None:
    """Against the formulas of the book: W1 with the wrong sign, two masses by hand."""
    (tmp_path / "rotor.csv").write_text(ROTOR)
    (tmp_path / "e.toml").write_text(
        EXERCISE.partition("[draw]")[0] + "[[ask]]" + EXERCISE.partition("[[ask]]")[2]
    )
    with workshop(read_exercise(str(tmp_path / "e.toml"))) as shop:
        (variant,) = variants(shop, 1, 1, [])
        b_mass, _, a_mass = candidates(variant)
    u = np.array([9.0 * 0.03 * np.exp(1j * np.pi / 3), 6.0 * 0.05 * np.exp(1j * np.pi * 210 / 180)])
    z = np.array([0.02, 0.065])
    assert abs(b_mass.answer.value - abs(-(u * z).sum() / 0.09) / 0.02) < 1e-9
    wrong = -(np.array([-1, 1]) * u * z).sum() / 0.09
    text = written(abs(wrong) / 0.02, 5)
    assert b_mass.name(typed(text)[0]) == "the term of W1 has the wrong sign"
    # the same slip in plane A: in the forces alone, in the moments alone, in both
    right = -(u * z).sum() / 0.09
    for moments, forces, said in (
        (1, -1, " in the sum of the forces"),
        (-1, 1, " in the sum of the moments"),
        (-1, -1, ""),
    ):
        b = wrong if moments < 0 else right
        a = -(np.array([forces, 1]) * u).sum() - b
        named = a_mass.name(typed(written(abs(a) / 0.02, 6))[0])
        assert named == f"the term of W1 has the wrong sign{said}"
    assert np.allclose(correct(u, z, np.array([0.0, 0.09])).unbalance[1], right)


def test_the_diameter_of_a_drawn_radius(tmp_path: Path) -> None:
    """A trial mass makes a tenth of the weight: 0.1·m·g/(ω²·r) at 350 mm; twice the radius makes half of it."""
    (tmp_path / "e.toml").write_text(
        'command = "trial --rotor-mass 120kg --speed 1480rpm --radius {r}"\n[draw]\nr = ["350mm"]\n[[ask]]\nquantity = "mass_g"\n'
    )
    with workshop(read_exercise(str(tmp_path / "e.toml"))) as shop:
        (variant,) = variants(shop, 1, 1, [])
        (own,) = candidates(variant)
    mass = 1000 * 0.1 * 120 * 9.80665 / ((1480 * np.pi / 30) ** 2 * 0.35)
    assert abs(own.answer.value - mass) < 1e-9 * mass
    assert own.name(typed(written(mass / 2, 4))[0]) == "r: the diameter in place of the radius"


def test_right_answers_have_no_mistake(questions: list[Candidates]) -> None:
    for own in questions:
        for slip in own.wrong:
            assert (
                Right(own.answer.value, own.answer.ask.figures).verdict(typed(written(slip.value, 12))[0])
                != "right"
            )


ROD = "part,shape,mass_kg,length_m,x_m\nrod,rod,4,1,0.1\n"
FAN = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,3.4,116,,,\n1,1,1.8,42,A,2,30\n"
SLIPPED = [
    # the same command with the slip in it: exercise, question, row, slipped command, slipped table, what is named
    ("body", ROD, "body t.csv --shaft=-500mm:500mm --speed 60rpm --gravity 0,-10,0", "bearing1_static_N", "axis=y", ("--gravity 0,-10,0", "--gravity 0,-9.81,0"), (), "g = 9.81 in place of 10"),
    ("body", ROD, "body t.csv --shaft=-500mm:500mm --speed 60rpm --gravity 0,-9.81,0", "bearing1_static_N", "axis=y", ("--gravity 0,-9.81,0", "--gravity 0,-1,0"), (), "the mass in place of the weight"),
    ("body", ROD, "body t.csv --shaft=-500mm:500mm --speed 60rpm", "bearing1_dynamic_N", "axis=x", ("60rpm", "60rad_s"), (), "60rpm: rpm taken for rad/s"),
    ("trial", "", "trial --rotor-mass 120kg --speed 1480rpm --radius 350mm", "mass_g", "", ("350mm", "700mm"), (), "350mm: the diameter in place of the radius"),
    ("place", "", "place 83.5g@40deg --blades 3", "mass_g", "position=2", ("40deg", "40rad"), (), "40deg: degrees taken as radians"),
    ("place", "", "place 83.5g@40deg --blades 3", "mass_g", "position=2", ("40deg", "50deg"), (), "40deg: sine in place of cosine"),
    ("index", READINGS, "index t.csv", "amplitude_um", "part=rotor", ("t.csv", "t.csv --phase-lag"), (), "the phase is counted the other way"),
    ("field", FAN, "field t.csv", "angle_deg", "", ("t.csv", "t.csv --phase-lag"), (), "the phase is counted the other way"),
    ("field", FAN, "field t.csv", "angle_deg", "", (), ("A,2,30", "A,2,-30"), "trial angle of run 1 is counted the other way"),
    ("engine", CYLINDERS, "engine t.csv --speed 3000rpm", "force_max_N", "order=1", (), (",40,", ",80,"), "throw: the stroke in place of the throw"),
    ("engine", CYLINDERS, "engine t.csv --speed 3000rpm", "force_max_N", "order=1", (), ("0.6,", "0,"), "reciprocating of cylinder 2 is left out"),
    ("flywheel", TORQUE, "flywheel t.csv --speed 600rpm --fluctuation 0.02", "mean_torque_N_m", "", (), ("150,-80", "150,0"), "torque of row 3 is left out"),
    ("balance", ROTOR, "balance t.csv --plane A:0mm:20mm --plane B:90mm:20mm", "mass_kg", "plane=B", (), ("60,20", "3437.7467707849396,20", "210,", "12032.113697747288,"), "the angles of the masses: degrees taken as radians"),
    ("balance", ROTOR, "balance t.csv --plane A:0mm:20mm --plane B:90mm:20mm", "mass_kg", "plane=A", (), ("90,30", "90,60", "60,50", "60,100"), "the diameters of the masses in place of their radii"),
    ("balance", ROTOR.replace("60,20", "-60,20"), "balance t.csv --plane A:0mm:20mm --plane B:90mm:20mm", "angle_deg", "plane=A", (), ("-60,20", "-3437.7467707849396,20"), "the angle of W1: degrees taken as radians"),
    ("forces", SLIDER, "forces t.toml", "B_ground_on_piston_fy_N", "", ("t.toml", "t.toml --set gravity.y=-1"), (), "the mass in place of the weight"),
    ("forces", SLIDER, "forces t.toml --at 50deg", "input_torque_N_m", "", ("50deg", "50rad"), (), "50deg: degrees taken as radians"),
    ("forces", SLIDER, "forces t.toml --at 50deg", "input_torque_N_m", "", ("50deg", "50deg --branch 2"), (), "the other assembly"),
    ("forces", SLIDER.replace("140 rad/s", "1400 rpm"), "forces t.toml", "input_torque_N_m", "", ("t.toml", "t.toml --set input.speed=1400rad_s"), (), "input.speed: rpm taken for rad/s"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("command", "table", "words", "quantity", "where", "other", "cells", "named"), SLIPPED, ids=lambda each: str(each)[:12]
)  # fmt: skip
def test_the_command_with_a_slip_in_it(
    dalembert: Dalembert, tmp_path: Path, command: str, table: str, words: str, quantity: str, where: str,
    other: tuple[str, str], cells: tuple[str, ...], named: str,
) -> None:  # fmt: skip
    """What the command itself makes of the slip is answered, and the slip is named."""
    file = tmp_path / ("t.toml" if ".toml" in words else "t.csv")
    key, _, name = where.partition("=")
    slipped = table
    for old, new in zip(cells[::2], cells[1::2], strict=True):
        assert old in slipped
        slipped = slipped.replace(old, new)
    file.write_text(slipped)
    done = dalembert(*(words.replace(*other) if other else words).split())
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    (value,) = (row[quantity] for row in rows if not key or row[key] == name)
    file.write_text(table)
    row = f'where = {{ {key} = "{name}" }}\n' if key else ""
    (tmp_path / "e.toml").write_text(
        f'command = "{words}"\n[[ask]]\nquantity = "{quantity}"\n{row}figures = 4\n'
    )
    head = f"student,{key}{',' if key else ''}quantity,answer\n"
    (tmp_path / "a.csv").write_text(
        f"{head}1,{name}{',' if key else ''}{quantity},{written(float(value), 4)}\n"
    )
    (mark,) = json.loads(dalembert("grade", "e.toml", "a.csv", "--json").stdout)["marks"]
    assert (mark["verdict"], mark["mistake"]) == ("wrong", named)


def test_zero_and_a_single_figure_tell_nothing(questions: list[Candidates]) -> None:
    """But for what a slip makes exactly."""
    for own in questions:
        assert own.name(typed("0")[0]) is None
        for digit in range(1, 10):
            answer = typed(f"{digit}e{typed(written(own.answer.value, 1))[0].value.adjusted()}")[0]
            exact = [slip for slip in own.wrong if abs(slip.value - float(answer.value)) < 1e-8]
            assert (own.name(answer) is not None) == bool(exact)
