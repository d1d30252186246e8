"""A tape on doubled numbers against fifty digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.recorded import RECORDED, Recorder


def exact(x: Doubled) -> list[mpmath.mpf]:
    high, low = np.broadcast_arrays(x.high, x.low)
    return [
        mpmath.mpf(float(a)) + mpmath.mpf(float(b)) for a, b in zip(high.ravel(), low.ravel(), strict=True)
    ]


def relative(found: Doubled, wanted: list[mpmath.mpf]) -> float:
    return max(float(abs(a - b) / abs(b)) for a, b in zip(exact(found), wanted, strict=True))


@pytest.fixture(autouse=True)
def fifty_digits() -> object:
    with mpmath.workdps(60):
        yield


def numbers(seed: int, size: float = 1.0) -> Doubled:
    rng = np.random.default_rng(seed)
    high = rng.normal(size=200) * size
    return Doubled(high, high * rng.uniform(-1, 1, 200) * 2.0**-54)


def test_quotient_root_and_size() -> None:
    a, b = numbers(1), numbers(2, 1e8)
    x, y = exact(a), exact(b)
    assert relative(a / b, [p / q for p, q in zip(x, y, strict=True)]) < 1e-31
    assert relative(1.0 / b, [1 / q for q in y]) < 1e-31
    assert relative(DOUBLED.sqrt(abs(a)), [mpmath.sqrt(abs(p)) for p in x]) < 1e-31
    assert float(DOUBLED.sqrt(DOUBLED.const(0.0)).value) == 0.0


def test_a_sum_that_cancels_keeps_the_low_digits_usable() -> None:
    one = Doubled(np.array([1.0]), np.array([1e-20]))
    left = (one - 1.0) * numbers(3)
    assert relative(left, [mpmath.mpf(1e-20) * v for v in exact(numbers(3))]) < 1e-31


@pytest.mark.parametrize("size", [1e-6, 1.0, 30.0, 1e5])
def test_sine_cosine_and_arctangent(size: float) -> None:
    a, b = numbers(4, size), numbers(5, size)
    sine, cosine = DOUBLED.sincos(a)
    for found, wanted in ((sine, mpmath.sin), (cosine, mpmath.cos)):
        # the argument's own last digit, 2⁻¹⁰⁵ of it, is the reduction's
        errors = [abs(p - wanted(q)) / max(1, abs(q)) for p, q in zip(exact(found), exact(a), strict=True)]
        assert max(errors) < 2.0**-103
    angles = [mpmath.atan2(p, q) for p, q in zip(exact(a), exact(b), strict=True)]
    assert relative(DOUBLED.atan2(a, b), angles) < 1e-30


def test_a_tape_gives_thirty_digits() -> None:
    recorder = Recorder()
    q, r = recorder.input("q"), recorder.input("r")
    z = r * RECORDED.turn(q) - 1.0
    tape = recorder.tape(
        {"angle": RECORDED.angle(z), "length": abs(z), "chosen": RECORDED.select(q, 2.0 * q, -q)}
    )
    given = {"q": Doubled(np.linspace(-3, 3, 50)), "r": Doubled(np.full(50, 1.25))}
    found = tape.on(given, DOUBLED)
    points = [mpmath.mpf(1.25) * mpmath.expj(float(v)) - 1 for v in np.linspace(-3, 3, 50)]
    assert relative(found["angle"], [mpmath.arg(z) for z in points]) < 1e-30
    assert relative(found["length"], [abs(z) for z in points]) < 1e-30
    assert (found["chosen"].value >= 0).all()
