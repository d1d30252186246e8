"""Likely mistakes: answers with one slip are named, random wrong numbers are not."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from balancing import correct
from cli.exercise.description import read_exercise
from cli.exercise.mistakes import candidates
from cli.exercise.slips import Candidates
from cli.exercise.solving import workshop
from cli.exercise.variants import variants
from dalembert.figures import Right, typed, written
from tests.cli.test_exercise import EXERCISE, ROTOR
from tests.cli.test_grade import STATES, WORK

FIGURES = 4


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


def share_named(questions: list[Candidates], count: int, seed: int) -> tuple[float, float]:
    """Of wrong answers with one slip the share that is named; of random wrong numbers the share that is."""
    draw = random.Random(seed)
    slipped = named = 0
    while slipped < count:
        own = draw.choice(questions)
        slip = draw.choice(own.singles)
        (answer, *_) = (
            typed(written(slip.value, FIGURES)) if np.isfinite(slip.value) and slip.value else (None,)
        )
        if (
            answer is None
            or own.right.verdict(answer) != "wrong"
            or (own.answer.is_angle and abs(own.distance(slip.value, own.answer.value)) < 0.06)
        ):
            continue
        slipped += 1
        named += own.name(answer) is not None
    wrong = met = 0
    while wrong < count:
        own = draw.choice(questions)
        value = (
            draw.uniform(0, 360)
            if own.answer.is_angle
            else own.answer.value * 10 ** draw.uniform(-1, 1) * draw.choice([-1, 1, 1, 1])
        )
        (answer, *_) = typed(written(value, FIGURES))
        if own.right.verdict(answer) != "wrong":
            continue
        wrong += 1
        met += own.name(answer) is not None
    return named / count, met / count


def test_one_slip_is_named_and_a_random_number_is_not(questions: list[Candidates]) -> None:
    named, met = share_named(questions, 600, 1)
    assert named >= 0.99
    assert met <= 0.02


@pytest.mark.slow
def test_ten_thousand_answers(questions: list[Candidates], first_seed: int) -> None:
    named, met = share_named(questions, 10_000, first_seed)
    assert named >= 0.99
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


def test_right_answers_have_no_mistake(questions: list[Candidates]) -> None:
    for own in questions:
        for slip in own.wrong:
            assert (
                Right(own.answer.value, own.answer.ask.figures).verdict(typed(written(slip.value, 12))[0])
                != "right"
            )
