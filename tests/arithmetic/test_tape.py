"""The tape as data: what is written down, what is left out, how it travels."""

from __future__ import annotations

import copy
import math
import pickle
import subprocess
import sys

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dalembert.arithmetic.recorded import RECORDED, Complex, Number, Real, Recorder
from dalembert.arithmetic.tape import Tape, shortened


def recorded(formula: object, *names: str) -> Tape:
    recorder = Recorder()
    return recorder.tape({"y": formula(*(recorder.input(name) for name in names))})  # type: ignore[operator]


def test_equal_operations_are_one_whatever_their_order_and_sign() -> None:
    tape = recorded(lambda a, b: (a * b - b * (-a)) * (a - b) / (b - a), "a", "b")
    # a·b, its double, a − b, the product, the quotient, and one sign for them all
    assert tape.cost == 6


def test_zeros_and_ones_vanish() -> None:
    assert recorded(lambda a: (a + 0.0) * 1.0 / 1.0 - 0.0 * a, "a").operations == (("input", "a"),)
    assert recorded(lambda a: a - a, "a").operations == (("const", 0.0),)


def test_a_complex_output_is_refused() -> None:
    recorder = Recorder()
    with pytest.raises(TypeError, match="output z is complex"):
        recorder.tape({"z": recorder.input("a") * 1j})


def test_what_no_output_hangs_on_is_not_on_the_tape() -> None:
    recorder = Recorder()
    a, b = recorder.input("a"), recorder.input("b")
    tape = recorder.tape({"sum": a + b, "root": (a * a * b).sqrt()})
    rows = dict(tape.outputs)
    assert shortened(tape.operations, [("sum", rows["sum"])]).cost == 1
    both = shortened(tape.operations, [(name, rows[name]) for name in ("root", "sum")])
    assert both.names == ("root", "sum")
    assert both.cost == tape.cost


def test_tapes_compare_travel_and_keep_their_key_between_processes() -> None:
    tape = recorded(lambda a, b: RECORDED.atan2(a, b) * RECORDED.sin(a), "a", "b")
    assert tape == recorded(lambda a, b: RECORDED.atan2(a, b) * RECORDED.sin(a), "a", "b")
    assert pickle.loads(pickle.dumps(tape)) == tape == copy.deepcopy(tape)
    assert hash(pickle.loads(pickle.dumps(tape))) == hash(tape)
    script = (
        "from dalembert.arithmetic.recorded import *\nr = Recorder()\na, b = r.input('a'), r.input('b')\n"
        "print(r.tape({'y': RECORDED.atan2(a, b) * RECORDED.sin(a)}).key)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == tape.key


class Digits:
    """Fifty digits, for `Tape.on`."""

    const, sqrt, sin, cos, atan2 = map(
        staticmethod, (mpmath.mpf, mpmath.sqrt, mpmath.sin, mpmath.cos, mpmath.atan2)
    )

    @staticmethod
    def select(test: object, a: object, b: object) -> object:
        return a if test > 0 else b  # type: ignore[operator]


NUMBERS = st.floats(-1e3, 1e3).filter(lambda x: abs(x) > 1e-3)


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
def test_recorded_arithmetic_is_that_of_python(a: float, b: float, c: float, d: float) -> None:
    def formula(x: Number, y: Number) -> Number:
        z = x * y.conjugate() - 2 * x + (3 - y) * 1j
        return (z + x / (y.real - 1e4) - 1j * y / (2.0 + abs(x))) * 0.5 - (-z).imag

    recorder = Recorder()
    re, im, re2, im2 = (recorder.input(name) for name in "abcd")
    got = formula(Complex(re, im), Complex(re2, im2))
    tape = recorder.tape({"re": got.real, "im": got.imag})
    with mpmath.workdps(50):
        found = tape.on(
            {"a": mpmath.mpf(a), "b": mpmath.mpf(b), "c": mpmath.mpf(c), "d": mpmath.mpf(d)}, Digits()
        )  # type: ignore[arg-type]
        wanted = formula(mpmath.mpc(a, b), mpmath.mpc(c, d))
        assert mpmath.almosteq(mpmath.mpc(found["re"], found["im"]), wanted, 1e-45, 1e-40)


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
def test_a_quotient_of_complex_numbers(a: float, b: float, c: float, d: float) -> None:
    recorder = Recorder()
    re, im, re2, im2 = (recorder.input(name) for name in "abcd")
    got = Complex(re, im) / Complex(re2, im2) + (1 - 2j) / Complex(re2, im2) + re / Complex(re2, im2)
    tape = recorder.tape({"re": got.real, "im": got.imag})
    with mpmath.workdps(50):
        found = tape.on(
            {"a": mpmath.mpf(a), "b": mpmath.mpf(b), "c": mpmath.mpf(c), "d": mpmath.mpf(d)}, Digits()
        )  # type: ignore[arg-type]
        wanted = (mpmath.mpc(a, b) + mpmath.mpc(1, -2) + a) / mpmath.mpc(c, d)
        assert mpmath.almosteq(mpmath.mpc(found["re"], found["im"]), wanted, 1e-45, 1e-40)


def test_powers_and_plain_numbers_of_other_kinds() -> None:
    tape = recorded(lambda a: a**5 + np.float64(2) * a**-1 + np.int64(3) * a**0, "a")
    assert tape.on({"a": 2.0}, RECORDED)["y"] == 2.0**5 + 1 + 3


def test_selecting_and_the_absolute_value() -> None:
    recorder = Recorder()
    a = recorder.input("a")
    tape = recorder.tape({"larger": RECORDED.select(a - 1.0, a, 1.0), "size": abs(-a), "again": abs(abs(a))})
    assert tape.on({"a": -3.0}, RECORDED) == {"larger": 1.0, "size": 3.0, "again": 3.0}
    assert tape.on({"a": 3.0}, RECORDED)["larger"] == 3.0
    assert tape.on({"a": math.nan}, RECORDED)["larger"] == 1.0
    assert isinstance(RECORDED.select(a, 2.0, 2.0), float)


def test_functions_of_plain_numbers_are_pythons() -> None:
    assert RECORDED.turn(0.3) == pytest.approx(complex(math.cos(0.3), math.sin(0.3)), rel=1e-15)
    assert math.isnan(RECORDED.sqrt(-1.0))
    assert RECORDED.atan2(1.0, -1.0) == math.atan2(1.0, -1.0)
    assert isinstance(RECORDED.join(1.0, 2.0), complex)
    assert isinstance(Recorder().input("x") * 2, Real)


def test_a_minus_costs_nothing_where_the_difference_turns_round_or_a_constant_takes_it() -> None:
    recorder = Recorder()
    a, b = recorder.input("a"), recorder.input("b")
    tape = recorder.tape({"difference": -(a - b), "product": -(3.0 * a), "both": -(a * b)})
    done = sorted(kind for kind, *_ in tape.operations if kind not in ("input", "const"))
    assert done == ["mul", "mul", "neg", "sub"]
    found = tape.on({"a": 2.0, "b": 7.0}, RECORDED)
    assert found == {"difference": 5.0, "product": -6.0, "both": -14.0}
