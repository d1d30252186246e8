"""Significant figures as people mean them, against integers: what is right, what is one unit off."""

from __future__ import annotations

import math
import random
from decimal import Decimal
from fractions import Fraction

import pytest

from dalembert.figures import Right, Typed, typed, written


def judged(value: float, figures: int, text: str) -> str:
    (one, *_) = typed(text)
    return Right(value, figures).verdict(one)


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        ("1.23", "right"), ("1,23", "right"), ("1.23e0", "right"), ("1.225", "right"), ("1.2349999", "right"), ("1.234", "right"),
        ("1.2340", "right"), ("1.235", "rounding"), ("1.2249", "rounding"), ("1.24", "rounding"), ("1.22", "rounding"),
        ("1.2", "figures"), ("1.3", "wrong"), ("1.20", "wrong"), ("-1.23", "wrong"), ("0", "wrong"), ("12.3", "wrong"),
    ],
)  # fmt: skip
def test_the_contracts_own_number(text: str, verdict: str) -> None:
    """1.234 to three figures: 1.225 ≤ a < 1.235; PrairieLearn's significant figures take 1.2289 to 1.2391."""
    assert judged(1.234, 3, text) == verdict


def test_what_lies_between_the_limits_of_the_trap() -> None:
    assert judged(1.234, 3, "1.2289") == "right"
    assert judged(1.234, 3, "1.2391") != "right"


@pytest.mark.parametrize("figures", [1, 2, 3, 5])
def test_the_mirror_image_and_zero(figures: int) -> None:
    assert Right(0.0, figures).verdict(Typed(Decimal(0))) == "right"
    assert Right(0.0, figures).verdict(Typed(Decimal("0.001"))) == "wrong"
    for text in ("1.2", "1.23", "1.24", "1.235", "1.225", "7"):
        assert judged(1.234, figures, text) == judged(-1.234, figures, f"-{text}")


def test_a_rightly_rounded_answer_with_more_figures() -> None:
    assert judged(1.23496, 3, "1.235") == "right"
    assert judged(1.23496, 3, "1.2350") == "right"
    assert judged(1.23456, 3, "1.236") == "rounding"


def test_a_tie_that_computing_has_moved_is_right_either_way() -> None:
    assert judged(1.2249999999999999, 3, "1.23") == "right"
    assert judged(1.2249999999999999, 3, "1.22") == "right"
    assert judged(1.2249, 3, "1.23") == "rounding"


@pytest.mark.parametrize(
    ("text", "readings"),
    [
        ("82350", ["82350"]), ("82 350", ["82350"]), ("82'350", ["82350"]), ("82,350", ["82.350", "82350"]),
        ("1.234.567,8", ["1234567.8"]), ("1,234,567.8", ["1234567.8"]), ("0,350", ["0.350"]), (".5", ["0.5"]), ("5.", ["5"]),
        ("−3,5·10^2", ["-3.5E+2"]), ("3.5 x 10^2", ["-0"]), ("1.2×10³", ["1.2E+3"]), ("1e-3", ["0.001"]), ("+7", ["7"]),
        ("1.234 567", ["1.234567"]), ("12 345,6", ["12345.6"]), ("–7", ["-7"]), ("1’234", ["1234"]), ("= 1.5", ["1.5"]), ("≈1.5", ["1.5"]),
        ("1.5.", ["1.5"]), ("1.5 10^3", ["1.5E+3"]), ("five", []), ("", []), ("1.2.3", []), ("--1", []), ("1e9999", []),
    ],
)  # fmt: skip
def test_numbers_as_people_type_them(text: str, readings: list[str]) -> None:
    if readings == ["-0"]:
        readings = ["3.5E+2"]
    found = [one.value for one in typed(text)]
    assert found == [Decimal(each) for each in readings]


def test_a_number_brings_its_unit() -> None:
    assert [(one.value, one.unit) for one in typed("18,1 kJ")] == [(Decimal("18.1"), "kJ")]
    assert [(one.value, one.unit) for one in typed("256.8°")] == [(Decimal("256.8"), "°")]
    assert [(one.value, one.unit) for one in typed("3 rad/s")] == [(Decimal(3), "rad/s")]
    # blanks part groups of three digits, and nothing else
    assert [(one.value, one.unit) for one in typed("1.23 1/s")] == [(Decimal("1.23"), "1/s")]
    assert [(one.value, one.unit) for one in typed("1 234 1/s")] == [(Decimal(1234), "1/s")]


def check(random_: random.Random, count: int) -> None:
    """Round in integers; the rounded answer is right, one unit more or less never is."""
    for _ in range(count):
        figures = random_.randint(1, 6)
        value = math.copysign(10 ** random_.uniform(-8, 8), random_.random() - 0.5)
        exact = abs(Fraction(value))
        exponent = math.floor(math.log10(exact)) - figures + 1
        unit = Fraction(10) ** exponent
        if abs((exact / unit) % 1 - Fraction(1, 2)) * unit < exact / 10**12:
            continue  # a tie that the rounding of computing may have moved
        whole = math.floor(exact / unit + Fraction(1, 2))
        if whole >= 10**figures:
            # 9.996 to three figures is 10.0
            exponent, whole = exponent + 1, whole // 10
        sign = int(value < 0)
        right = Right(value, figures)
        for step in (0, 1, -1):
            if whole + step <= 0:
                continue
            digits = tuple(map(int, str(whole + step)))
            verdict = right.verdict(Typed(Decimal((sign, digits, exponent))))
            assert (verdict == "right") == (step == 0), (value, figures, step, verdict)


def test_rounded_is_right_and_one_unit_off_is_not() -> None:
    check(random.Random(1), 3000)


@pytest.mark.slow
def test_a_million_answers(first_seed: int) -> None:
    check(random.Random(first_seed), 333_334)


def test_written_is_what_is_right() -> None:
    random_ = random.Random(2)
    for _ in range(500):
        value, figures = random_.choice([-1, 1]) * 10 ** random_.uniform(-12, 12), random_.randint(1, 8)
        assert judged(value, figures, written(value, figures)) == "right"
