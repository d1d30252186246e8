"""Grades and their limits; what is no grade."""

from __future__ import annotations

import math

import numpy as np
import pytest

from balancing import GRADES, allocate, by_size, correct, grade_value, permissible_unbalance


def test_the_grades_of_the_standard() -> None:
    assert GRADES == (4000, 1600, 630, 250, 100, 40, 16, 6.3, 2.5, 1, 0.4)
    for grade in GRADES:
        assert grade_value(f"G{grade:g}") == grade / 1000
    assert grade_value(" g 2,5 ") == 0.0025
    assert grade_value("G1.7") == 0.0017


@pytest.mark.parametrize("name", ["2.5", "", "G", "H2.5", "G-1", "G0", "Gnan", "Ginf", "Gx", "GG1"])
def test_what_is_no_grade(name: str) -> None:
    with pytest.raises(ValueError, match=r"no balance quality grade: expected one of G4000, .*G0\.4"):
        grade_value(name)


def test_bad_arguments() -> None:
    for arguments in ((0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 0.0), (1.0, math.nan, 1.0)):
        with pytest.raises(ValueError, match="positive"):
            permissible_unbalance(*arguments)
    with pytest.raises(ValueError, match="same place"):
        allocate(1.0, 0.3, 0.1 + 0.2, float("0.30000000000000004"))


def test_shapes() -> None:
    assert permissible_unbalance([1, 2], 3.0, np.ones((4, 1))).shape == (4, 2)
    assert allocate(np.ones((4, 2)), 0.5, 0, 1).shape == (4, 2, 2)


def test_an_angle_never_reaches_a_full_turn() -> None:
    fix = correct([[-1 + 1e-20j], [-1 - 1e-20j], [-1]], 0.0, [0.0])
    assert (fix.angle >= 0).all()
    assert (fix.angle < 1e-15).all()


def test_the_table_names_rotor_and_plane() -> None:
    frame = correct([[1], [2], [3]], 0.25, [0.0, 1.0]).to_frame()
    assert frame.index.tolist() == [(r, p) for r in range(3) for p in range(2)]
    np.testing.assert_allclose(frame.unbalance_kg_m, [0.75, 0.25, 1.5, 0.5, 2.25, 0.75])
    assert frame.z_m.tolist() == [0, 1] * 3


def test_groups_stay_small_enough_for_the_cache() -> None:
    sizes = [len(rotors) * masses.shape[1] for rotors, masses in by_size(np.repeat(np.arange(30_000), 3))]
    assert max(sizes) == 16384
    assert sum(size > 16000 for size in sizes) >= len(sizes) - 1
    (one,) = by_size(np.zeros(40_000, dtype=np.intp))
    assert one[1].shape == (1, 65536)


def test_shares_anywhere_along_the_shaft() -> None:
    np.testing.assert_allclose(allocate(100, 5.4, 5, 6), [60, 40], rtol=1e-14)
    np.testing.assert_allclose(allocate(100, -1.4, -1, -2), [60, 40], rtol=1e-14)
    np.testing.assert_allclose(allocate(100, 6, 5, 6), [30, 70])
    np.testing.assert_allclose(allocate(100, 5, 5, 6), [70, 30])
    np.testing.assert_allclose(allocate(100, 4.8, 5, 6), [120, 30])
    with pytest.raises(ValueError, match="positive"):
        permissible_unbalance(1.0, 0.0, 1.0)
