"""The initial unbalance of a rotor from its vibration, in the planes where it is determined."""

from __future__ import annotations

import numpy as np

from balancing import initial_unbalance, least_squares

RNG = np.random.default_rng(3)
ALPHA = RNG.standard_normal((6, 5, 3)) + 1j * RNG.standard_normal((6, 5, 3))
U = RNG.standard_normal((6, 3)) + 1j * RNG.standard_normal((6, 3))


def test_it_is_what_a_full_correction_takes_off() -> None:
    noise = RNG.standard_normal((6, 5))
    weights = RNG.uniform(1, 3, (6, 5))
    v = np.matvec(ALPHA, U) + noise
    found = initial_unbalance(ALPHA, v, weights)
    np.testing.assert_array_equal(found, -least_squares(ALPHA, v, weights).corrections)
    np.testing.assert_allclose(initial_unbalance(ALPHA, np.matvec(ALPHA, U)), U, rtol=1e-12)


def test_of_many_rotors_each_by_itself() -> None:
    alpha = ALPHA.copy()
    alpha[2, :, 1] = 3j * alpha[2, :, 0]
    alpha[4, :, 2] = 0
    found = initial_unbalance(alpha, np.matvec(alpha, U))
    lost = np.zeros((6, 3), dtype=bool)
    lost[2, :2] = lost[4, 2] = True
    np.testing.assert_array_equal(np.isnan(found), lost)
    np.testing.assert_allclose(found[~lost], U[~lost], rtol=1e-11)


def test_the_size_of_the_numbers_does_not_matter() -> None:
    alpha = np.array([[1, 2, 0], [2, 4, 0], [0, 0, 1.0]])
    for vibration in (1e-150, 1.0, 1e150):
        for mass in (1e-60, 1.0, 1e60):
            a = alpha * vibration / mass * [1, 1, 1e9]
            found = initial_unbalance(a, a @ [1 * mass, 1 * mass, 5 * mass])
            np.testing.assert_array_equal(np.isnan(found), [True, True, False])
            np.testing.assert_allclose(found[2], 5 * mass, rtol=1e-12)


def test_fewer_readings_than_planes() -> None:
    # one sensor sees plane 2 alone, the other the sum of 0 and 1
    found = initial_unbalance([[1, 1, 0], [0, 0, 2]], [3, 8])
    assert np.isnan(found).tolist() == [True, True, False]
    np.testing.assert_allclose(found[2], 4, rtol=1e-14)
