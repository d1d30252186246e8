"""Results in a notebook: one readable line, a table, compared by their numbers, copied, stored."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from balancing import (
    LogBalance,
    correct,
    error_budget,
    index_balancing,
    influence_from_amplitudes,
    initial_alone,
    joint_fit,
    least_squares,
    minimax,
    place,
    suggest_run,
    trial_effect,
)
from rigidbody3d import (
    Body,
    FreeBody,
    Motion,
    Shaft,
    Top,
    check,
    compose,
    cones,
    integrate,
    principal,
    steady_precession,
    strike,
)

COEFFICIENTS = [[3, -2], [5, -2], [5, -3j]]
TENSOR = [[2.0, 0.1, 0.0], [0.1, 3.0, 0.0], [0.0, 0.0, 4.0]]


def made(x: float) -> dict[str, object]:
    """Return a result of every kind, from a number that all of them depend on."""
    body = compose(Body.of("rod", [x, 2.0], center=[[0, 0, 1], [0.1, 0, 2]], length=1.0))
    free, top = FreeBody([1, 2, 3], [x, 0.1, 0.5]), Top([1, 1, 0.5], 1.0, [0.1, x, 3.0], [0.9, 0.1, 0.2, 0.3])
    motion = Motion(TENSOR, [0, x, 12.0], frame_omega=[0, 4.0, 0], mass=2.0, acceleration=[1, 0, 0])
    fit = joint_fit([[5], [x], [3j], [4]], [[0], [1], [1j], [0.5]])
    log = LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, fit.scatter())
    many = Motion(TENSOR, np.linspace(0, x, 3000).reshape(1000, 3))
    return {
        "correct": correct([0.27 * x, 0.3j], [0.02, 0.065], [0.0, 0.09]),
        "correct many": correct(x * np.ones((50, 4)), np.arange(4.0), [0.0, 1.0]),
        "unbalances": correct([x, 0.3j], [0.02, 0.065], [0.0, 0.09]).residual_of([0, 0]),
        "least squares": least_squares(COEFFICIENTS, [x, -1, 0]),
        "least squares many": least_squares(COEFFICIENTS, x * np.ones((20, 3))),
        "minimax": minimax(COEFFICIENTS, [x, -1, 0], [0.2, 1]),
        "amplitudes": influence_from_amplitudes([6.1 * x], [[7.7], [3.2], [10.3]], np.exp([0, 2j, 4j])),
        "placement": place(0.0835 * x, [0.3, 1.2, 4.0]),
        "stated errors": log.fit.stated(0.01, 0.02 * x),
        "known coefficients": initial_alone([[x + 1j]], [[1j]]),
        "log": log.fit,
        "log errors": log.errors,
        "log balance": log,
        "next run": suggest_run(log, 1.0),
        "trial effect": trial_effect([x, 1j], [2, 3]),
        "index": index_balancing([5 + 1j * x, 1 - 1j]),
        "budget": error_budget(100.0, random=[x, 4.0]),
        "body": body,
        "bodies": Body.of("rod", [x, 2.0], length=1.0),
        "body error": body.error_estimate(about=[x, 1, 1]),
        "principal": principal(np.array(TENSOR) * x),
        "validity": check([1, 1, 1 + x]),
        "shaft": Shaft(body, (0.0, 2.0), 100.0),
        "motion": motion,
        "motion many": many,
        "wrench": motion.inertia_wrench,
        "blow": strike(3.0, np.eye(3), [x, 0, 0], [0, 0, 1]),
        "steady": steady_precession(0.002, 0.0008, 0.1962, 0.4, 60.0 * x),
        "cones": cones(1.0, 2.0, [0.0, x, 1.0]),
        "free body": free,
        "free state": free.at(2.0),
        "free states": free.at([0.0, 1.0, 2.0]),
        "top": top,
        "top states": top.at([0.0, 1.0]),
        "trajectory": integrate([1, 2, 3], [x, 0.1, 0.5], t=[0.0, 1.0], torque=[0, 0, 0.1]),
    }


HERE, SAME, OTHER = made(1.0), made(1.0), made(1.5)
TABLES = [name for name, result in HERE.items() if hasattr(result, "to_frame")]


@pytest.mark.parametrize("name", HERE)
def test_a_result_tells_itself_in_one_line(name: str) -> None:
    line = repr(HERE[name])
    assert "\n" not in line
    assert "array(" not in line
    assert 10 < len(line) < 420
    assert line == repr(SAME[name])
    assert type(HERE[name]).__name__ in line


@pytest.mark.parametrize("name", HERE)
def test_results_of_the_same_numbers_are_equal(name: str) -> None:
    assert HERE[name] == SAME[name]
    assert not HERE[name] != SAME[name]  # noqa: SIM202
    assert HERE[name] != OTHER[name]
    assert HERE[name] != 3
    with pytest.raises(TypeError, match="unhashable"):
        hash(HERE[name])


def test_a_named_tuple_is_the_plain_one_of_the_same_values() -> None:
    assert HERE["cones"] == tuple(HERE["cones"])  # type: ignore[arg-type]
    assert HERE["wrench"] == ([-2, 0, 0], HERE["wrench"][1])  # type: ignore[index]
    assert HERE["wrench"] != ([-2, 0, 0],)


@pytest.mark.parametrize("name", HERE)
def test_results_are_copied_and_stored(name: str) -> None:
    result = HERE[name]
    for again in (copy.copy(result), copy.deepcopy(result), pickle.loads(pickle.dumps(result))):
        assert type(again) is type(result)
        assert again == result


@pytest.mark.parametrize("name", TABLES)
def test_results_show_their_table(name: str) -> None:
    frame = HERE[name].to_frame()  # type: ignore[attr-defined]
    assert len(frame) >= 1
    assert not frame.columns.has_duplicates
    assert frame.notna().all(axis=None)
    assert "<table" in HERE[name]._repr_html_()  # type: ignore[attr-defined]


def test_which_results_have_a_table() -> None:
    assert {"correct", "minimax", "amplitudes", "placement", "body", "shaft", "motion"} < set(TABLES)
    assert {"free states", "top states", "trajectory"} < set(TABLES)


def test_a_copy_goes_on_working() -> None:
    free = pickle.loads(pickle.dumps(HERE["free body"]))
    np.testing.assert_array_equal(free.at([3.0]).attitude, HERE["free body"].at([3.0]).attitude)  # type: ignore[attr-defined]
    run = copy.deepcopy(HERE["trajectory"])
    assert (run.error_estimate() < 1e-9).all()  # type: ignore[attr-defined]
    steady = pickle.loads(pickle.dumps(HERE["steady"]))
    assert steady.error_estimate()[0] > 0


def test_tables_hold_the_numbers_in_their_units() -> None:
    body = Body(np.array(3.0), np.array([1.0, 2.0, 3.0]), np.array(TENSOR)).to_frame()
    assert body.loc[0, ["mass_kg", "y_m", "iyy_kg_m2", "ixy_kg_m2"]].tolist() == [3.0, 2.0, 3.0, -0.1]
    states = FreeBody([[1, 2, 3], [1, 1, 2]], [1.0, 0.1, 0.5]).at([0.0, 1.0, 2.0])
    frame = states.to_frame()
    assert frame.index.names == ["body0", "state"]
    assert frame.loc[(1, 2), "t_s"] == 2.0
    assert frame.loc[(1, 2), "omega_y_rad_s"] == states.omega[1, 2, 1]
    assert frame.loc[(0, 1), "attitude_w"] == states.attitude[0, 1, 0]
    fix = least_squares(COEFFICIENTS, [1, -1, 0])
    assert fix.to_frame().loc[1, "mass_kg"] == abs(fix.corrections[1])
    assert fix.to_frame("residual").loc[0, "amplitude"] == abs(fix.residual[0])
    with pytest.raises(ValueError, match="corrections or residual"):
        fix.to_frame("influence")
    motion = Motion(TENSOR, [[0, 4, 12.0], [1, 0, 0]]).to_frame()
    assert motion.loc[1, "momentum_y_kg_m2_s"] == 0.1
