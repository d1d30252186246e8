"""How far and how fast a top nutates, by the roots of its cubic in 40 digits; its momentum and its tensor."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from rigidbody3d import Top
from rigidbody3d.attitude import to_matrix


def cubic(I1: float, I3: float, mgl: float, omega, q):
    """The roots of (α − a u)(1 − u²) − (b − c u)² for u = cos θ (Goldstein, eq. 5.62), ascending, and 2 mgl/I1."""
    w, x, y, z = (mp.mpf(float(v)) for v in q)
    norm = w * w + x * x + y * y + z * z
    w1, w2, w3 = (mp.mpf(float(v)) for v in omega)
    # the vertical in body axes
    up = [2 * (x * z - w * y) / norm, 2 * (y * z + w * x) / norm, (w * w - x * x - y * y + z * z) / norm]
    L3 = I3 * w3
    Lz = I1 * (w1 * up[0] + w2 * up[1]) + L3 * up[2]
    E = mp.mpf(I1) * (w1**2 + w2**2) / 2 + mgl * up[2]
    alpha, a, b, c = 2 * E / I1, 2 * mp.mpf(mgl) / I1, Lz / I1, L3 / I1
    c2, c1, c0 = (-alpha - c * c) / a, 2 * b * c / a - 1, (alpha - b * b) / a
    # Viète: three real roots as cosines
    P, Q = c1 - c2**2 / 3, 2 * c2**3 / 27 - c2 * c1 / 3 + c0
    size = 2 * mp.sqrt(-P / 3)
    angle = mp.acos(3 * Q / (P * size)) / 3
    return sorted(size * mp.cos(angle - 2 * mp.pi * k / 3) - c2 / 3 for k in range(3)), a


@pytest.mark.parametrize("seed", range(4))
def test_the_turning_points_and_the_period(seed: int) -> None:
    rng = np.random.default_rng(seed)
    I1, I3, mgl = rng.uniform(0.5, 2), rng.uniform(0.3, 2), rng.uniform(0.2, 2)
    omega, q = rng.normal(size=3) * 2, rng.normal(size=4)
    top = Top([I1, I1, I3], mgl, omega, q)
    with mp.workdps(40):
        (low, high, beyond), a = cubic(I1, I3, mgl, omega, q)
        period = 4 * mp.ellipk((high - low) / (beyond - low)) / mp.sqrt(a * (beyond - low))
        assert top.nutation == pytest.approx([float(mp.acos(high)), float(mp.acos(low))], rel=1e-13)
        assert float(top.nutation_period) == pytest.approx(float(period), rel=1e-14)
    # after a period the axis leans as before, halfway in time from one turning point it is at the other
    t = np.linspace(0, 2 * float(period), 9)
    lean = to_matrix(top.at(t).attitude)[:, 2, 2]
    assert lean[4:] == pytest.approx(lean[:5], abs=1e-13)


def test_a_pendulum_swings_at_half_its_period() -> None:
    """Released at 2 rad from hanging: 4 K(sin²(1 rad)) √(I/mgl) for the swing to and fro, and cos θ twice in it."""
    tilt = np.pi - 2.0
    top = Top([0.5, 0.5, 0.3], 2.0, [0.0, 0, 0], [np.cos(tilt / 2), np.sin(tilt / 2), 0, 0])
    exact = float(2 * mp.ellipk(mp.sin(1) ** 2) * mp.sqrt(mp.mpf("0.25")))
    assert float(top.nutation_period) == pytest.approx(exact, rel=1e-15)
    assert top.nutation == pytest.approx([tilt, np.pi], abs=1e-15)


def test_the_momentum_about_the_vertical_and_the_axis_stay() -> None:
    """Given as a tensor, many tops at many times: Lz, L3 and the energy are those of the beginning."""
    rng = np.random.default_rng(9)
    q = rng.normal(size=(3, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    omega = rng.normal(size=(3, 3))
    tensor = np.diag([1.5, 1.5, 0.8])
    mgl = np.array([0.5, -0.7, 0.0])
    tops = Top(tensor, mgl, omega, q)
    R = to_matrix(q)
    start = np.einsum("bij,bj->bi", R, omega * [1.5, 1.5, 0.8])
    t = np.array([0.0, 0.7, 5.0])
    states = tops.at(t)
    np.testing.assert_allclose(states.momentum[:, 0], start, atol=1e-15)
    np.testing.assert_allclose(states.momentum[..., 2], start[:, 2:] * np.ones(3), atol=2e-15)
    np.testing.assert_allclose(states.momentum[2], start[2] * np.ones((3, 1)), atol=2e-15)
    np.testing.assert_allclose(states.omega[..., 2], omega[:, 2:] * np.ones(3), atol=1e-15)
    energy = (omega**2 @ [1.5, 1.5, 0.8]) / 2 + mgl * R[:, 2, 2]
    np.testing.assert_allclose(states.energy, energy[:, None] * np.ones(3), rtol=4e-15)
    one = tops.at(0.7)
    np.testing.assert_array_equal(one.momentum, states.momentum[:, 1])
    np.testing.assert_array_equal(one.energy, states.energy[:, 1])
    with pytest.raises(ValueError, match="products"):
        Top(tensor + 0.1, 1.0, [0, 0, 1.0])
