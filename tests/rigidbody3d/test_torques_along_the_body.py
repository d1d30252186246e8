"""A torque that turns with the body: turned by hand, in Euler's equations, and by the energy it gives."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.rotation import taylor
from rigidbody3d import integrate
from rigidbody3d.attitude import angle_between, rotate

I = np.array([1.0, 2.0, 2.5])
W = np.array([0.7, -0.4, 1.1])
Q = np.array([0.5, -0.5, 0.1, 0.7]) / np.linalg.norm([0.5, -0.5, 0.1, 0.7])
TORQUES = ([0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, -0.4], [0.3, 0.1, -0.2])


@pytest.mark.parametrize("torque", TORQUES)
def test_the_torque_turned_into_space_by_hand_is_the_same(torque: list[float]) -> None:
    t = np.array([0.0, 0.4, 2.0, -1.5])
    body = integrate(I, W, Q, t, torque=torque)
    space = integrate(I, W, Q, t, torque=lambda s, q, w: rotate(q, torque), frame="space")
    assert angle_between(body.attitude, space.attitude).max() < 1e-12
    np.testing.assert_allclose(body.momentum, space.momentum, atol=1e-12)
    function = integrate(I, W, Q, t, torque=lambda s, q, w: torque, frame="body")
    np.testing.assert_allclose(function.momentum, body.momentum, atol=1e-12)


def test_eulers_equations() -> None:
    """I ω̇ + ω × I ω = M in body axes, by power series of 40 digits."""
    torque = TORQUES[-1]
    omega, q = taylor(I, W, 2.0, Q, torque=torque)
    run = integrate(I, W, Q, [2.0], torque=torque)
    assert run.omega[0] == pytest.approx([float(x) for x in omega], abs=1e-12)
    wanted = np.array([float(x) for x in q])
    assert angle_between(run.attitude[0], wanted / np.linalg.norm(wanted)) < 1e-12


def test_a_tensor_in_oblique_axes_and_a_force_that_follows_the_spin() -> None:
    """Drag M = −c H in space: H dies away as e^{−ct} along its own direction, whatever the body does."""
    R = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    tensor = R @ np.diag(I) @ R.T
    t = np.array([0.0, 1.0, 3.0])
    run = integrate(tensor, W, Q, t, torque=lambda s, q, w: -0.3 * rotate(q, tensor @ w), frame="space")
    H = rotate(Q, tensor @ W)
    np.testing.assert_allclose(run.momentum, np.exp(-0.3 * t)[:, None] * H, atol=1e-12)
    np.testing.assert_allclose(run.energy[0], W @ tensor @ W / 2, rtol=1e-14)
    clocked = integrate(tensor, W, Q, t, torque=lambda s, q, w: [0.0, 0.0, 2 * s], frame="space")
    np.testing.assert_allclose(clocked.momentum, H + np.outer(t**2, [0, 0, 1]), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["body", "space"])
def test_the_estimate_of_a_disk_that_spins_up_from_rest(frame: str) -> None:
    # θ = M t²/(2 I): 85 turns, of which the last take the shortest steps
    run = integrate([1.0, 1.0, 1.5], [0.0, 0.0, 0.0], t=[40.0, -40.0], torque=[0.0, 0.0, 1.0], frame=frame)
    with mp.workdps(40):
        half = mp.mpf(800) / 3
        exact = [float(mp.cos(half)), 0.0, 0.0, float(mp.sin(half))]
    error = angle_between(run.attitude, exact)
    assert (error <= run.error_estimate()).all()
    assert (run.error_estimate() < 1e-10).all()
    np.testing.assert_allclose(run.omega, [[0, 0, 80 / 3], [0, 0, -80 / 3]], rtol=1e-13)
