"""Published and worked cases of balancing in the field."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from balancing import influence_coefficients, influence_from_amplitudes, least_squares, minimax, place
from tests.conftest import Dalembert


def polar(pairs: ArrayLike) -> NDArray[np.complex128]:
    values = np.asarray(pairs, dtype=float)
    return values[..., 0] * np.exp(1j * np.radians(values[..., 1]))


def agree(found: NDArray[np.complex128], expected: ArrayLike, rel: float = 1e-6) -> None:
    """Expected (size, degrees) pairs, printed to six digits."""
    want = polar(expected)
    assert np.abs(found - want).max() <= rel * np.abs(want).max()


# B&K application note 17-227 (Vaughan), static and two-plane balancing, quoted by the package pyPRB
def test_bruel_kjaer_static() -> None:
    v0, v1 = polar([[3.4, 116]]), polar([[1.8, 42]])
    fix = least_squares(influence_coefficients(v0, [v1], [[2.0]]), v0)
    agree(fix.corrections, [[2.011676, 329.21125]])
    assert abs(fix.corrections[0]) == pytest.approx(2.01, abs=0.005)  # printed, at -30.8°
    assert np.degrees(np.angle(fix.corrections[0])) == pytest.approx(-30.8, abs=0.05)


BK_V0 = [[7.2, 238], [13.5, 296]]
BK_RUNS = [[[4.9, 114], [9.2, 347]], [[4.0, 79], [12.0, 292]]]


def test_bruel_kjaer_two_plane() -> None:
    v0 = polar(BK_V0)
    fix = least_squares(influence_coefficients(v0, polar(BK_RUNS), np.diag([2.5, 2.5])), v0)
    agree(fix.corrections, [[2.951381, 50.18892], [2.844138, 278.11593]])
    assert float(fix.condition_number) == pytest.approx(2.63560124052589, rel=1e-12)
    assert fix.residual_max < 1e-13


def test_bruel_kjaer_example_6_with_runout() -> None:
    v0 = polar([[170, 112], [53, 78]])
    runs = polar([[[235, 94], [58, 68]], [[189, 115], [77, 104]]])
    runout = polar([[12, 30], [12, 30]])
    expected = [[1.951832, 239.4734], [0.893673, 139.09614]]
    alpha = influence_coefficients(v0, runs, np.diag([1.15, 1.15]))
    agree(least_squares(alpha, v0 - runout).corrections, expected)
    # it cancels in the coefficients
    again = influence_coefficients(v0 - runout, runs - runout, np.diag([1.15, 1.15]))
    agree(least_squares(again, v0 - runout).corrections, expected)


FEESE_V0 = [[0.68, 32], [0.56, 86], [1.94, 231], [2.07, 335]]
FEESE_RUNS = [
    [[1.31, 1], [1.25, 75], [0.93, 251], [1.0, 342]],
    [[0.54, 9], [0.52, 75], [0.81, 196], [0.9, 296]],
]
FEESE_ANSWER = [[15.329798, 2.90037], [6.616895, 112.87436]]


def test_feese_grazier_trials_left_on() -> None:
    """Balance This! (33rd Turbomachinery Symposium, 2004) prints 15.3 at 3° and 6.6 at 113°: trial masses left on."""
    first, second = polar([[11.1, 35], [3.7, 135]])
    v0 = polar(FEESE_V0)
    fix = least_squares(influence_coefficients(v0, polar(FEESE_RUNS), [[first, 0], [first, second]]), v0)
    agree(fix.corrections, FEESE_ANSWER)
    agree(
        fix.residual,
        [[0.07833, 137.87889], [0.090714, 48.56036], [0.050443, 230.55866], [0.051169, 165.66165]],
        1e-5,
    )
    assert float(fix.residual_rms) == pytest.approx(0.06987022587851778, rel=1e-12)
    # the known mistake: taken as removed, the same readings give other masses
    wrong = least_squares(influence_coefficients(v0, polar(FEESE_RUNS), np.diag([first, second])), v0)
    assert abs(wrong.corrections[0]) == pytest.approx(5.4, abs=0.1)


def test_feese_grazier_through_the_command(dalembert: Dalembert) -> None:
    rows = ["run,sensor,amplitude_mil,phase_deg,trial_plane,trial_mass_g,trial_angle_deg,trial_kept"]
    trials = [",,,", "aft,11.1,35,yes", "forward,3.7,135,yes"]
    for run, (readings, trial) in enumerate(zip([FEESE_V0, *FEESE_RUNS], trials, strict=True)):
        rows += [f"{run},{s + 1},{a},{p},{trial}" for s, (a, p) in enumerate(readings)]
    text = "\n".join(rows)
    document = json.loads(dalembert("field", "-", "--json", stdin=text).stdout)
    (rotor,) = document["rotors"]
    assert document["amplitude_unit"] == "mil"
    assert [c["plane"] for c in rotor["corrections"]] == ["aft", "forward"]
    found = np.array(
        [c["mass_kg"] * 1e3 * np.exp(1j * np.radians(c["angle_deg"])) for c in rotor["corrections"]]
    )
    agree(found, FEESE_ANSWER)
    assert rotor["residual_rms"] == pytest.approx(0.06987022587851778, rel=1e-12)
    here = json.loads(dalembert("field", "-", "--json", "--from-here", stdin=text).stdout)["rotors"][0]
    more = np.array(
        [c["mass_kg"] * 1e3 * np.exp(1j * np.radians(c["angle_deg"])) for c in here["corrections"]]
    )
    assert np.abs(more + polar([[11.1, 35], [3.7, 135]]) - found).max() < 1e-12 * 15
    assert here["residual_rms"] == pytest.approx(rotor["residual_rms"], rel=1e-9)


# Goodman, J. Eng. Ind. 86 (1964) 273-277; rational answers
GOODMAN = [[3.0, -2.0], [5.0, -2.0], [5.0, -3.0]]


def test_goodman_least_squares() -> None:
    fix = least_squares(GOODMAN, [1, -1, 0])
    assert np.abs(fix.corrections * 21 - [17, 31]).max() < 1e-12
    assert np.abs(fix.residual * 21 - [10, 2, -8]).max() < 1e-11


def test_goodman_minimax() -> None:
    fix = minimax(GOODMAN, [1, -1, 0])
    assert np.abs(fix.corrections - [1, 1.8]).max() < 1e-13
    assert float(fix.residual_max) == pytest.approx(0.4, rel=1e-14)
    assert fix.bound == pytest.approx(0.4, rel=1e-14)


def test_darlow_non_independent_planes() -> None:
    """Darlow, ASME 82-GT (1982): integer Cartesian data, printed to three digits."""
    alpha = np.array(
        [
            [1 + 1j, 2 + 1j, 3 + 2j],
            [1 + 3j, 4 + 2j, 2 + 1j],
            [2 + 2j, 2 + 1j, 4 + 3j],
            [3 + 1j, 3 + 2j, 4 + 2j],
        ]
    )
    fix = least_squares(alpha, [1 + 3j, 3 + 1j, 4 + 1j, 2 + 5j])
    agree(fix.corrections, [[1.39342, 356.39745], [1.24896, 216.25822], [0.980048, 167.64029]])
    assert np.linalg.norm(fix.residual) == pytest.approx(2.836272984824353, rel=1e-13)
    assert float(fix.condition_number) == pytest.approx(7.862236740931535, rel=1e-12)


# Foiles, Allaire and Gunter, IMechE C576/097 (2000): 11 sensors, 4 planes
FOILES = [
    [[9.8, 117], [17, 124], [7.2, 114], [38.5, 77]],
    [[2.7, 43], [14.3, 317], [4.5, 213], [14.3, 270]],
    [[12.5, 323], [25, 261], [15.2, 158], [30, 238]],
    [[22.4, 92], [32.6, 45], [23.3, 315], [27.8, 210]],
    [[26, 94], [40.3, 9], [25, 330], [34, 213]],
    [[40.3, 355], [43, 144], [29.6, 61], [65.4, 322]],
    [[20.6, 339], [32.3, 152], [36.7, 41], [61.8, 322]],
    [[12.6, 226], [37.6, 52], [18.8, 153], [26, 176]],
    [[13.4, 209], [26.9, 76], [47.5, 98], [71.7, 312]],
    [[13.4, 154], [22.4, 307], [52, 299], [102, 165]],
    [[5.4, 24], [7.2, 199], [22.4, 2], [27.8, 99]],
]
FOILES_V0 = [[55, 259], [45, 118], [124, 21], [138, 349], [107, 349], [90, 280], [58, 354], [108, 201], [88, 190], [56, 48], [73, 158]]  # fmt: skip


def test_foiles_least_squares() -> None:
    fix = least_squares(polar(FOILES), polar(FOILES_V0))
    agree(
        fix.corrections,
        [[3.826986, 90.74286], [2.242776, 358.37645], [1.746761, 299.34761], [1.461149, 292.5486]],
    )
    assert float(fix.residual_max) == pytest.approx(106.57303188340556, rel=1e-12)


def test_foiles_minimax_is_proven() -> None:
    """The printed masses leave 71.10; the optimum of the printed data is 69.9408, and the dual problem proves it."""
    fix = minimax(polar(FOILES), polar(FOILES_V0))
    assert float(fix.residual_max) == pytest.approx(69.94081146, rel=1e-9)
    assert fix.bound is not None
    assert float(fix.residual_max) - fix.bound <= 1e-12 * fix.bound
    printed = polar([[4.42, 88], [2.92, 352], [1.588, 322], [1.928, 304]])
    assert np.abs(polar(FOILES_V0) + polar(FOILES) @ printed).max() == pytest.approx(71.096, abs=0.001)


def test_spm_four_run() -> None:
    """SPM A2010 manual, p. 68: 16.3 g at 91° by drawing; the least-squares point is 16.36431 g at 89.9562°."""
    masses = 12.3 * np.exp(2j * np.pi * np.arange(3) / 3)
    fit = influence_from_amplitudes([6.1], [[7.7], [3.2], [10.3]], masses)
    agree(-6.1 / fit.influence, [[16.36431, 89.9562]])
    assert abs(fit.influence[0]) * 12.3 == pytest.approx(4.58498, abs=1e-5)
    assert np.isnan(fit.other).all()


@pytest.mark.parametrize(
    ("target", "positions", "expected"),
    [
        # published split test, blades 14 and 15 of 16
        ([83.5, 308.87], [292.5, 315], [23.29999, 61.49617]),
        # vibromera.eu, blade correction calculator
        ([15, 40], [0, 60], [5.923963, 11.133408]),
    ],
)
def test_splits(target: list[float], positions: list[float], expected: list[float]) -> None:
    found = place(complex(polar(target)[()]), np.radians(positions))
    assert found.masses == pytest.approx(expected, abs=1e-5)
    assert abs(found.error) < 1e-14 * target[0]
