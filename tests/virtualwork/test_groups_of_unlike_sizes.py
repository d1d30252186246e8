"""Groups solved by Newton whose links, slides or poses differ by many powers of ten are regular all the same."""

from __future__ import annotations

import cmath

import numpy as np
import pytest

from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.formulas.numbers import determined, singular_poses, solve_columns


def flexure(leg: float, size: float = 1.0) -> Mechanism:
    """A platform that a tiny leg holds and a tiny crank pushes: rod, platform, leg and arm close together."""
    c = leg * cmath.exp(0.7j)
    a = -1j + 0.3 * leg * cmath.exp(0.5j)
    b, h = c - 0.02, 1 + 0.5j
    d = b + 0.8 + 0.3j
    rod, arm = b - a, d - h
    return Mechanism(
        {"O": -1j * size, "G": 0j, "H": h * size},
        {
            "crank": Link({"O": 0j, "A": 0.3 * leg * size + 0j}),
            "rod": Link({"A": 0j, "B": abs(rod) * size + 0j}),
            "platform": Link(
                {"B": 0j, "C": 0.02 * size + 0j, "D": (0.8 + 0.3j) * size}, mass=1.0, center=0.4 * size + 0j
            ),
            "leg": Link({"G": 0j, "C": leg * size + 0j}),
            "arm": Link({"H": 0j, "D": abs(arm) * size + 0j}),
        },
        inputs=Input("crank"),
        guess=Guess(0.5, {"rod": cmath.phase(rod), "platform": 0.0, "leg": 0.7, "arm": cmath.phase(arm)}),
        gravity=-10j,
    )


def small_leg() -> tuple[float, float]:
    """ω of the leg and effort over the leg's length at the guess for a leg of no length.

    Rod, platform and arm stand still but for their first order: the platform's point C moves by leg·(e^{iφ})′, B by as much
    and its rotation, and the rod keeps B's distance from A, the arm D's from H.
    """
    leg, crank = cmath.exp(0.7j), 0.3 * cmath.exp(0.5j)
    rod, arm = -0.02 + 1j, -0.02 + 0.8 + 0.3j - (1 + 0.5j)
    # unknowns: ω of the leg, and of the platform over the leg's length; Re(v_B − v_A, rod) = 0, Re(v_D, arm) = 0

    def along(v: complex, u: complex) -> float:
        return (v * u.conjugate()).real

    matrix = [
        [along(1j * leg, rod), along(-0.02j, rod)],
        [along(1j * leg, arm), along(1j * (0.78 + 0.3j), arm)],
    ]
    omega, turning = np.linalg.solve(matrix, [along(1j * crank, rod), 0.0])
    rise = (1j * leg * omega + 1j * (0.4 - 0.02) * turning).imag
    return float(omega), float(10.0 * rise)


@pytest.mark.whole
@pytest.mark.parametrize("leg", [1e-3, 1e-6, 1e-7])
@pytest.mark.parametrize("size", [1.0, 1e-3, 1e4])
def test_a_leg_much_shorter_than_the_platform(leg: float, size: float) -> None:
    m = flexure(leg, size)
    motion = m.motion(np.array([0.3, 0.5, 0.8]), speed=1.0)
    omega, effort = small_leg()
    assert not m.assembly.folded
    assert motion.assembled.all()
    assert np.isfinite(motion.reaction("C", on="platform")).all()
    # of a leg that is not zero the first order is left out
    assert abs(motion.link("leg").omega[1] - omega) < 5 * leg + 1e-12 / leg**0.5
    still = m.motion(0.5)
    assert abs(still.effort[0] / (leg * size) - effort) < 20 * leg + 1e-5


def test_no_pose_hides_another() -> None:
    """Pose by pose: regular, regular and far out, singular, singular and far out."""
    n = 4
    first = np.array([1 + 0j, 1e9, 1, 1e9])
    second = np.array([1j, 1j, 1 + 0j, 1 + 0j])
    assert singular_poses([[first, second]], n).tolist() == [False, False, True, True]


def test_rates_that_a_singular_pose_determines_do_not_depend_on_other_poses() -> None:
    """x₁ + x₂ is determined, x₃ by itself; 1e9 as large in the second pose."""
    size = np.array([1.0, 1e9])
    zero = 0 * size + 0j
    cols = [[size + 0j, size + 0j, zero], [zero, zero, 1 + 0 * zero]]
    found = solve_columns(cols, [-3 * size + 0j, -5 + zero], determined)
    assert np.isnan(found[0]).all()
    assert np.isnan(found[1]).all()
    np.testing.assert_allclose(found[2], 5.0, rtol=1e-14)
