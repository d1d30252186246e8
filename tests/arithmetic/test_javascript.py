"""The tape in JavaScript against the other engines: to the last bit where they do the same, else to two units there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from dalembert.arithmetic.engines import compiled_code, run
from dalembert.arithmetic.engines.javascript import engine, literal, written
from dalembert.arithmetic.recorded import RECORDED, Recorder
from dalembert.arithmetic.tape import Tape
from tests.node import needs_node, run_script
from virtualwork.formulas.numbers import WRITTEN

pytestmark = needs_node


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(28)


def in_javascript(tape: Tape, inputs: dict[str, Any], folder: Path) -> np.ndarray[Any, Any]:
    """The outputs of a tape on lanes, (outputs, n)."""
    n = max(np.size(x) for x in inputs.values())
    given = {name: x if isinstance(x, float) else list(x) for name, x in inputs.items()}
    script = (
        f"{engine()}\nconst tape = new Tape({written(tape)});\n"
        "for (const [k, x] of Object.entries(given)) given[k] = Array.isArray(x) ? Float64Array.from(x, Number) : x;\n"
        f"answer(tape.run(given, {n}));"
    )
    return np.array([[float(x) for x in row] for row in run_script(script, folder, given)])


def circular() -> Tape:
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    return recorder.tape(
        {
            "sin": RECORDED.sin(x),
            "cos": RECORDED.cos(x),
            "angle": RECORDED.atan2(y, x),
            "of y": RECORDED.cos(y),
        }
    )


def some(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """Coordinates of every size and sign, near and far from multiples of π/2."""
    sizes = 10.0 ** rng.uniform(-12, 5, (2, n))
    x, y = sizes * rng.choice([-1.0, 1.0], (2, n))
    x[: n // 4] = np.rint(x[: n // 4]) * np.pi / 2 * (1 + 1e-9 * rng.standard_normal(n // 4))
    y[n // 2 :] = x[n // 2 :] * rng.uniform(-3, 3, n - n // 2)
    return {"x": x, "y": y}


def test_operations_are_numpys_to_the_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    recorder = Recorder()
    x, y, c = recorder.input("x"), recorder.input("y"), recorder.input("c")
    tape = recorder.tape(
        {
            "sum": x + y * c - 0.1,
            "quotient": (x - y) / (x * x + 3.0),
            "root": RECORDED.sqrt(abs(x * y)) + -c,
            "power": RECORDED.binade(x),
            "choice": RECORDED.select(x - y, x * c, y),
            "shared": c * c + 1.0,
        }
    )
    inputs = some(rng, 500) | {"c": 0.3}
    found, expected = in_javascript(tape, inputs, tmp_path), run(tape, inputs, "numpy")
    assert (found == np.array([expected[name] for name in tape.names])).all()


@pytest.mark.skipif(
    not compiled_code(), reason="llvmlite is not installed: compiled code is what this compares with"
)
def test_functions_are_those_of_compiled_code_to_the_bit(tmp_path: Path, rng: np.random.Generator) -> None:
    inputs, tape = some(rng, 4000), circular()
    found, expected = in_javascript(tape, inputs, tmp_path), run(tape, inputs, "llvm")
    for row, name in zip(found, tape.names, strict=True):
        assert (row == expected[name]).all(), name


def test_functions_are_within_two_units(tmp_path: Path, rng: np.random.Generator) -> None:
    """Against 50 digits, at ends of the range too."""
    ends = [
        0.0,
        -0.0,
        5e-324,
        1e-310,
        1e-160,
        1.5e6,
        1.7e6,
        3e15,
        1e300,
        1e308,
        6381956970095103.0 * 2.0**797,
    ]
    x, y = (
        np.array(each)
        for each in zip(*((a, s * b) for a in ends for b in ends for s in (1, -1)), strict=True)
    )
    more = some(rng, 200)
    inputs = {"x": np.append(x, more["x"]), "y": np.append(y, more["y"])}
    found = in_javascript(circular(), inputs, tmp_path)
    with mpmath.workprec(2200):
        for a, b, sine, cosine, angle in zip(inputs["x"], inputs["y"], *found[:3], strict=True):
            a_, b_ = mpmath.mpf(a), mpmath.mpf(b)
            for value, exact in ((sine, mpmath.sin(a_)), (cosine, mpmath.cos(a_))):
                assert abs(value - exact) <= 2 * np.spacing(abs(value)), (a, value)
            assert angle == np.arctan2(b, a) or abs(angle - mpmath.atan2(b_, a_)) <= 2 * np.spacing(
                abs(angle)
            )
            # the sign of a zero is that of a zero
            assert np.signbit(angle) == np.signbit(np.arctan2(b, a))


def test_what_is_no_number_stays_none(tmp_path: Path) -> None:
    inputs = {"x": np.array([np.nan, np.inf, 1.0]), "y": np.array([1.0, np.inf, np.nan])}
    found = in_javascript(circular(), inputs, tmp_path)
    with np.errstate(invalid="ignore"):
        expected = np.array([np.sin(inputs["x"]), np.cos(inputs["x"]), np.arctan2(inputs["y"], inputs["x"])])
    assert (np.isnan(found[:3]) == np.isnan(expected)).all()
    assert found[2, 1] == np.pi / 4


def test_twice_has_31_digits(tmp_path: Path) -> None:
    """2 − √2·√2, sin 1, cos 10⁵, arctangents and a quotient, each against 60 digits."""
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    root = RECORDED.sqrt(x + 1.0)
    tape = recorder.tape(
        {
            "rest": x + 1.0 - root * root,
            "sin": RECORDED.sin(x),
            "cos": RECORDED.cos(y * 1e5),
            "angle": RECORDED.atan2(-x, y - 3.5),
            "quotient": x / (y + 2.0) - 1.0 / 3.0,
            "choice": RECORDED.select(y - x, y, x),
        }
    )
    script = f"{engine()}\nanswer(new Tape({written(tape)}).twice(given));"
    found = run_script(script, tmp_path, {"x": 1.0, "y": 0.7})
    with mpmath.workdps(60):
        b = mpmath.mpf(0.7)
        exact = [
            0,
            mpmath.sin(1),
            mpmath.cos(b * 100000),
            mpmath.atan2(-1, b - 3.5),
            1 / (b + 2) - mpmath.mpf(1 / 3),
            1,
        ]
        for (high, low), value in zip(found, exact, strict=True):
            assert abs(mpmath.mpf(high) + mpmath.mpf(low) - value) < 1e-26
        assert abs(found[0][0]) < 1e-31


def test_a_name_cannot_end_the_script() -> None:
    recorder = Recorder()
    tape = recorder.tape({"y": recorder.input("</script><script>") + 1.0})
    assert "<" not in written(tape)


def chosen(knots: list[float], columns: list[list[float]]) -> Tape:
    """One of each column, by where x lies between knots."""
    recorder = Recorder()
    x = recorder.input("x")
    values = {f"{i}": WRITTEN.among(x, [-9e9, *knots], column) for i, column in enumerate(columns)}
    return recorder.tape(values | {"x": x})


def test_long_lists_of_constants_stand_once(tmp_path: Path) -> None:
    """Beside each knot, at it, and of no number: as choices of choices; one tape's list is a part of the other's."""
    rng = np.random.default_rng(4)
    knots = np.sort(rng.uniform(-3, 3, 30)).tolist()
    columns = rng.standard_normal((2, 31)).round(3)
    first, second = chosen(knots, columns.tolist()), chosen(knots[5:25], columns[:, 5:26].tolist())
    text = literal({"first": first, "second": second})
    assert text.count(repr(knots[7])) == 1
    places = [
        *(f(k, s) for k in knots for f in (np.nextafter,) for s in (-9, 9)),
        *knots,
        np.nan,
        99.0,
        -99.0,
    ]
    script = (
        f"{engine()}\nconst {{ lists: written, ...tapes }} = {text};\n"
        "const lists = listed(written);\n"
        "const x = Float64Array.from(given, Number);\n"
        "answer(Object.values(tapes).map((tape) => new Tape(tape, lists)).map((tape) => [tape.run({ x }, x.length),"
        " Array.from(x, (x) => tape.one({ x })), Array.from(x, (x) => tape.twice({ x }).map(([high]) => high))]));"
    )
    answers = run_script(script, tmp_path, places)
    for tape, (lanes, one, twice) in zip((first, second), answers, strict=True):
        expected = run(tape, {"x": np.array(places)}, "numpy")
        rows = np.array([expected[name] for name in tape.names])
        assert (np.isnan(rows).sum(axis=1) == [0, 0, 1]).all()
        for found in (np.array(lanes, float), np.array(one, float).T, np.array(twice, float).T):
            assert np.array_equal(found, rows, equal_nan=True)
