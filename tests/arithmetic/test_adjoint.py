"""Derivatives, and estimates of rounding errors by a second run, against fifty digits."""

from __future__ import annotations

from random import Random

import mpmath
import numpy as np
import pytest

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.choice import ENGINES
from dalembert.arithmetic.engines import run
from dalembert.arithmetic.engines.doubled import Answer, compared
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
from dalembert.arithmetic.tape import Tape


class Digits:
    const, sqrt, sin, cos, atan2 = map(
        staticmethod, (mpmath.mpf, mpmath.sqrt, mpmath.sin, mpmath.cos, mpmath.atan2)
    )

    @staticmethod
    def select(test: object, a: object, b: object) -> object:
        return a if test > 0 else b  # type: ignore[operator]


def four_bar() -> Tape:
    """Crank a, coupler b, rocker c, ground d: both angles and the coupler's point, after M. A. Chace (1963)."""
    recorder = Recorder()
    a, b, c, d, q = (recorder.input(name) for name in "abcdq")
    w: Number = a * RECORDED.turn(q) - RECORDED.join(d, 0.0)
    d2 = (w.conjugate() * w).real
    outer, inner = b + c, b - c
    radicand = (outer * outer - d2) * (d2 - inner * inner)
    t = RECORDED.join((d2 + outer * inner) * (0.5 / d2), RECORDED.sqrt(radicand) * (-0.5 / d2))
    point = a * RECORDED.turn(q) - t * w
    return recorder.tape(
        {
            "coupler": RECORDED.angle(-(t * w)),
            "rocker": RECORDED.angle(w - t * w),
            "x": point.real,
            "y": point.imag,
            "reach": RECORDED.select(point.real, abs(point), -abs(point)),
        }
    )


def poses(n: int, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    around = {"a": 0.04, "b": 0.12, "c": 0.08, "d": 0.1}
    return {k: v * (1 + 0.05 * rng.uniform(-1, 1, n)) for k, v in around.items()} | {
        "q": rng.uniform(-7, 7, n)
    }


@pytest.mark.parametrize("engine", ENGINES)
def test_derivatives_are_those_of_fifty_digits(engine: str) -> None:
    tape, n = four_bar(), 20
    slopes = derivatives(tape, "abcdq")
    given = poses(n)
    found = run(slopes, given, engine)
    with mpmath.workdps(60):
        h = mpmath.mpf(10) ** -20
        for lane in range(n):
            exact = {name: mpmath.mpf(float(x[lane])) for name, x in given.items()}
            for variable in "abcdq":
                up = tape.on({**exact, variable: exact[variable] + h}, Digits())  # type: ignore[arg-type]
                down = tape.on({**exact, variable: exact[variable] - h}, Digits())  # type: ignore[arg-type]
                for name in tape.names:
                    slope = (up[name] - down[name]) / (2 * h)
                    got = found[f"d({name})/d({variable})"][lane]
                    assert abs(got - slope) <= 1e-12 * max(1, abs(slope)), (name, variable)


def errors_and_estimates(
    tape: Tape, given: dict[str, np.ndarray], engine: str
) -> tuple[np.ndarray, np.ndarray]:
    values = run(tape, given, engine)
    errors = np.empty(np.shape(values.table))
    with mpmath.workdps(50):
        for lane in range(errors.shape[1]):
            exact = tape.on({k: mpmath.mpf(float(x[lane])) for k, x in given.items()}, Digits())  # type: ignore[arg-type]
            for row, name in enumerate(tape.names):
                errors[row, lane] = abs(mpmath.mpf(float(values.table[row][lane])) - exact[name])
    estimates, _ = compared(tape, given, {Answer((name,)): [x] for name, x in values.items()})
    return errors, np.array(estimates)


@pytest.mark.parametrize("engine", ENGINES)
def test_estimates_hold_and_are_near(engine: str) -> None:
    errors, estimates = errors_and_estimates(four_bar(), poses(200, 3), engine)
    assert (errors <= estimates).all()
    positive = errors > 0
    assert np.median(estimates[positive] / errors[positive]) <= 1.02


def test_estimates_hold_close_to_a_limit() -> None:
    # crank 150, coupler 120, rocker 80, ground 100: the crank swings; margins of 1e-1 to 1e-7 of its limit
    rng = np.random.default_rng(5)
    limit = np.arccos((0.2**2 - 0.1**2 - 0.15**2) / (-2 * 0.1 * 0.15))
    q = limit * (1 - 10.0 ** -rng.uniform(1, 7, 200))
    n = len(q)
    given = {
        "a": np.full(n, 0.15),
        "b": np.full(n, 0.12),
        "c": np.full(n, 0.08),
        "d": np.full(n, 0.1),
        "q": q,
    }
    errors, estimates = errors_and_estimates(four_bar(), given, "numpy")
    assert (errors <= estimates).all()


def test_random_formulas_stay_within_their_estimates() -> None:
    for seed in range(30):
        random, recorder = Random(seed), Recorder()
        values: list[Number] = [recorder.input("a"), recorder.input("b")]
        for _ in range(25):
            x, y = random.choice(values), random.choice(values)
            values.append(
                random.choice(
                    [
                        x + 0.7 * y,
                        x * y - 0.3,
                        x / (y * y + 1.0),
                        RECORDED.sin(x) + y,
                        RECORDED.atan2(x, y * y + 0.1),
                    ]
                )
            )
        tape = recorder.tape({"y": values[-1], "z": values[-2]})
        rng = np.random.default_rng(seed)
        errors, estimates = errors_and_estimates(
            tape, {"a": rng.normal(size=5), "b": rng.normal(size=5)}, "numpy"
        )
        assert (errors <= estimates).all(), seed


def test_a_name_that_is_not_there_is_an_error() -> None:
    with pytest.raises(KeyError, match="e"):
        derivatives(four_bar(), ["e"])
