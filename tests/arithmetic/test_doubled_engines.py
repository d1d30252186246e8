"""The tape in 32 digits by every engine, against each other and against fifty digits: all operations, extreme arguments."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.engines.doubled import in_floats, run
from dalembert.arithmetic.recorded import RECORDED, Recorder
from dalembert.arithmetic.tape import Tape

ENGINES = ["python", "numpy", pytest.param("llvm", marks=pytest.mark.filterwarnings("error"))]
# 2⁻¹⁰⁰; a reduction leaves of an angle its own last digits
CLOSE = 1e-30


@pytest.fixture(autouse=True)
def _in_floats_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dalembert.arithmetic.engines.doubled.PAYS", 0.0)


def operations() -> Tape:
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    return recorder.tape(
        {
            "add": x + y,
            "sub": x - y,
            "mul": x * y,
            "square": x * x,
            "div": x / y,
            "inverse": 1.0 / x,
            "third": x / 3.0,
            "half": 0.5 * x,
            "neg": -x * y,
            "abs": abs(x),
            "sqrt": abs(x).sqrt(),
            "sin": x.sin(),
            "cos": x.cos(),
            "atan2": RECORDED.atan2(y, x),
            "select": RECORDED.select(x, x * y, y / x),
            "binade": RECORDED.binade(x),
        }
    )


EXACT: dict[str, Callable[[Any, Any], Any]] = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "square": lambda x, _: x * x,
    "div": lambda x, y: x / y,
    "inverse": lambda x, _: 1 / x,
    "third": lambda x, _: x / 3,
    "half": lambda x, _: x / 2,
    "neg": lambda x, y: -x * y,
    "abs": lambda x, _: abs(x),
    "sqrt": lambda x, _: mpmath.sqrt(abs(x)),
    "sin": lambda x, _: mpmath.sin(x),
    "cos": lambda x, _: mpmath.cos(x),
    "atan2": lambda x, y: mpmath.atan2(y, x),
    "select": lambda x, y: x * y if x > 0 else y / x,
    "binade": lambda x, _: mpmath.mpf(2) ** mpmath.floor(mpmath.log(abs(x), 2)),
}


def worst(engine: str, x: Doubled, y: Doubled, monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """The largest error of each operation, relative; of a sum, a sine or a cosine, to its arguments' size as well."""
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    found = run(operations(), {"x": x, "y": y})
    errors = dict.fromkeys(found, 0.0)
    with mpmath.workdps(70):
        for i in range(len(x.high)):
            a, b = (mpmath.mpf(float(v.high[i])) + mpmath.mpf(float(v.low[i])) for v in (x, y))
            for name, of in found.items():
                value = mpmath.mpf(float(of.high[i])) + mpmath.mpf(float(of.low[i]))
                wanted = EXACT[name](a, b)
                scale = {
                    "add": abs(a) + abs(b),
                    "sub": abs(a) + abs(b),
                    "sin": max(abs(wanted), abs(a)),
                    "cos": max(abs(wanted), abs(a)),
                }
                size = scale.get(name, abs(wanted))
                errors[name] = max(errors[name], float(abs(value - wanted) / size))
    return errors


def spread(seed: int, n: int, exponents: float) -> Doubled:
    rng = np.random.default_rng(seed)
    high = rng.choice([-1.0, 1.0], n) * rng.uniform(1, 2, n) * 2.0 ** rng.uniform(-exponents, exponents, n)
    return Doubled(high, high * rng.uniform(-1, 1, n) * 2.0**-54)


@pytest.mark.parametrize("engine", ENGINES)
def test_every_operation_against_fifty_digits(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    errors = worst(engine, spread(1, 40, 8.0), spread(2, 40, 8.0), monkeypatch)
    assert max(errors.values()) < CLOSE, errors


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("exponents", [1.0, 25.0, 200.0])
def test_arguments_far_and_small(engine: str, exponents: float, monkeypatch: pytest.MonkeyPatch) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    x, y = spread(3, 2000, exponents), spread(4, 2000, exponents)
    errors = worst(engine, x, y, monkeypatch)
    if exponents > 25.0:
        # beyond 10⁹ rad an angle has no 32 digits of its turn
        del errors["sin"], errors["cos"]
    assert max(errors.values()) < CLOSE, errors


@pytest.mark.parametrize("engine", ENGINES)
def test_singular_arguments(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    quarter = np.pi / 2
    x = np.array([0.0, 1.0, -1.0, np.inf, np.nan, quarter, -quarter, 2 * quarter, 1.0])
    y = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
    found = {name: of.value.tolist() for name, of in run(operations(), {"x": x, "y": y}).items()}
    assert found["sqrt"][:3] == [0.0, 1.0, 1.0]
    assert found["atan2"][:3] == [0.0, 0.0, np.pi]
    assert found["sin"][0] == 0.0
    assert found["cos"][0] == 1.0
    # what a quarter turn's float leaves of it
    assert found["cos"][5] == found["cos"][6] == 6.123233995736766e-17
    assert found["sin"][7] == 1.2246467991473532e-16
    for name in ("sin", "cos", "mul", "atan2", "sqrt"):
        assert not np.isfinite(found[name][4])


def test_what_is_the_same_for_all_lanes_runs_once(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    tape = recorder.tape({"z": x * y.sin() / 3.0, "w": RECORDED.atan2(y, y * y), "x": x, "two": 2.0})
    given = {"x": np.linspace(-1.0, 1.0, 50), "y": Doubled(0.1, -5.551115123125783e-18)}
    values = []
    for engine in ("python", "numpy"):
        monkeypatch.setenv("DALEMBERT_ENGINE", engine)
        values.append(run(tape, given))
    for name in tape.names:
        assert np.all(np.abs((values[0][name] - values[1][name]).value) <= CLOSE)


def test_operations_in_floats_are_counted() -> None:
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    assert in_floats(recorder.tape({"z": x * y}), frozenset()).cost == 2
    assert in_floats(recorder.tape({"z": x + y}), frozenset()).cost == 6
    # what a decimal leaves of its float costs a product and a sum
    assert in_floats(recorder.tape({"z": x * y}), frozenset({"x"})).cost == 4
