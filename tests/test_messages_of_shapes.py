"""Arrays that do not go together: one sentence that names them, never numpy's or Python's own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import balancing as b
import rigidbody3d as r


def c(*shape: int) -> np.ndarray:
    return np.arange(1, np.prod(shape) + 1).reshape(shape) ** 1.3 + 0.1j * np.ones(shape)


def f(*shape: int) -> np.ndarray:
    return 1.0 + np.arange(np.prod(shape)).reshape(shape)


CASES: dict[str, tuple[Callable[[], object], str]] = {
    "rotors": (lambda: b.least_squares(c(2, 5, 2), c(3, 5)), r"influence \(2, 5\), initial \(3, 5\)"),
    "weights": (lambda: b.least_squares(c(5, 2), c(5), np.ones(4)), r"weights \(4,\)"),
    "limits": (lambda: b.least_squares(c(5, 2), c(5), max_mass=[1, 2, 3]), r"max_mass .*\(2,\).*\(3,\)"),
    "ceilings": (lambda: b.least_squares(c(5, 2), c(5), max_residual=[1, 2, 3]), "max_residual must"),
    "text": (lambda: b.least_squares("x", c(5)), "influence must be an array of numbers, found 'x'"),
    "ridge": (lambda: b.least_squares(c(5, 2), c(5), ridge=[1, 2]), "ridge must be one number"),
    "error": (
        lambda: b.least_squares(c(5, 2), c(5)).error_estimate("residuals"),
        "'residuals': expected corrections, residual",
    ),
    "minimax weights": (lambda: b.minimax(c(5, 2), c(5), weights=np.ones(4)), r"weights \(4,\)"),
    "minimax limits": (lambda: b.minimax(c(5, 2), c(5), [1, 2, 3]), "max_mass must have the shape"),
    "trials": (lambda: b.influence_coefficients(c(2, 3), c(4, 2, 3), c(3, 2, 2)), r"trials \(4,\)"),
    "condition": (lambda: b.condition_number(c(5)), r"influence must be \(..., s, p\)"),
    "known masses": (lambda: b.correct(c(3), [1, 2], [0, 1]), r"moment \(3,\), z \(2,\)"),
    "planes": (lambda: b.correct(c(2, 3), f(2, 3), f(3, 2)), r"rotors \(2,\), planes \(3,\)"),
    "radius": (lambda: b.correct(c(2, 3), f(2, 3), f(2, 2)).mass([1, 2, 3]), "radius must have the shape"),
    "made": (lambda: b.correct(c(2, 3), f(2, 3), f(2, 2)).residual_of([1, 2, 3]), r"unbalance \(3,\)"),
    "log weights": (lambda: b.joint_fit(c(5, 3), c(5, 2), np.ones((4, 3))), "weights must have the shape"),
    "targets": (lambda: b.place([1.0, 2], [0, 1, 2]), "one target at a time"),
    "before": (lambda: b.trial_effect(c(3), c(4)), r"before \(3,\), after \(4,\)"),
    "free body": (lambda: r.FreeBody(f(2, 3), f(4, 3)), r"inertia \(2,\), omega \(4,\)"),
    "attitude": (lambda: r.FreeBody([1, 2, 3], f(2, 3), f(3, 4)), r"attitude \(3,\)"),
    "dict": (lambda: r.FreeBody({}, [1, 2, 3]), "inertia must be an array of numbers, found {}"),
    "top": (lambda: r.Top([1, 1, 2], [1.0, 2], f(3, 3)), r"mgl \(2,\), omega \(3,\)"),
    "motion": (lambda: r.Motion(np.eye(3), f(4, 3), f(5, 3)), r"omega \(4,\), alpha \(5,\)"),
    "pivot": (
        lambda: r.Motion.about_fixed_point(np.eye(3), f(4, 3), mass=1, center=[1, 2, 3], point=[1, 2]),
        "point must have the shape",
    ),
    "strike": (lambda: r.strike(1.0, np.eye(2), [1, 2, 3], [1, 2, 3]), "inertia must have the shape"),
    "blow": (lambda: r.strike(1.0, np.eye(3), [1, 2], [1, 2, 3]), "impulse must have the shape"),
    "rate": (lambda: r.integrate([1, 2, 3], [1, 2], t=1.0), r"omega: expected one body, the shape \(3,\)"),
    "torque": (lambda: r.integrate([1, 2, 3], [1, 2, 3], t=1.0, torque=[1]), "torque: expected one body"),
    "method": (lambda: r.integrate([1, 2, 3], [1, 2, 3], t=1.0, method="BDF"), "method is one of DOP853"),
    "time": (lambda: r.integrate([1, 2, 3], [1, 2, 3], t=np.nan), "times and mgl must be finite"),
    "couple": (lambda: r.gyroscopic_couple([0, 1], [1, 0, 0]), "momentum must have the shape"),
    "offset": (lambda: r.Body.of("rod", 1.0, length=1.0).moved([0, 1]), "offset must have the shape"),
    "turn": (lambda: r.Body.of("rod", 1.0, length=1.0).turned(np.eye(2)), "rotation must have the shape"),
    "strikes": (lambda: r.strike([1.0, 2], np.eye(3), f(3, 3), [1, 2, 3]), r"mass \(2,\)"),
}


@pytest.mark.whole
@pytest.mark.parametrize("name", CASES)
def test_the_sentence_names_what_does_not_fit(name: str) -> None:
    work, sentence = CASES[name]
    with pytest.raises(ValueError, match=sentence) as caught:
        work()
    assert "broadcast" not in str(caught.value)
