"""The heavy top against integer Taylor series, above all where its axis passes near the vertical."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.truth.rotation import taylor
from rigidbody3d import FreeBody, Top, integrate, sleeping_threshold, steady_precession
from rigidbody3d.attitude import angle_between


def tops(kind: str, rng):
    for _ in range(4):
        across = rng.uniform(0.5, 2)
        along, mgl = rng.uniform(0.1, 1.9 * across), rng.uniform(0.1, 2)
        w, q = rng.normal(size=3) * 2, rng.normal(size=4)
        if kind == "fast":
            w, along = np.array([0.0, 0, 100]), min(along, across)
        elif kind == "near upright, stable":
            q, w = np.array([1, 1e-6 * rng.normal(), 1e-6 * rng.normal(), 0.3]), np.array([1e-6, 2e-6, 20.0])
        elif kind == "near upright, falling":
            q, w = np.array([1, 1e-5 * rng.normal(), 1e-5 * rng.normal(), 0.3]), np.array([1e-5, 2e-5, 0.1])
        elif kind == "through upright":
            q, w = np.array([1, 0, 0, 0.3]), np.array([1.0, 2.0, rng.normal()])
        elif kind == "near hanging":
            q, w = np.array([1e-7, 0.3, 0.4, 2e-8]), np.array([1.0, 2.0, rng.normal()])
        elif kind == "through hanging":
            q, w = np.array([0, 0.3, 0.4, 0]), np.array([1.0, 2.0, rng.normal()])
        elif kind == "plane pendulum":
            q, w = np.array([np.cos(0.3), np.sin(0.3), 0, 0]), np.array([rng.uniform(0, 3), 0, 0])
        elif kind == "steady":
            w3 = 1.3 * float(sleeping_threshold(across, along, mgl))
            rate = float(steady_precession(across, along, mgl, 0.4, w3)[rng.integers(2)])
            q, w = np.array([np.cos(0.2), np.sin(0.2), 0, 0]), np.array([0, rate * np.sin(0.4), w3])
        elif kind == "from rest":
            w = np.zeros(3)
        elif kind == "weight below":
            mgl = -mgl
        yield across, along, mgl, w, q / np.linalg.norm(q)


KINDS = (
    "generic",
    "fast",
    "near upright, stable",
    "near upright, falling",
    "through upright",
    "near hanging",
    "through hanging",
    "plane pendulum",
    "steady",
    "from rest",
    "weight below",
)


@pytest.mark.parametrize("kind", KINDS)
def test_against_integer_taylor_series(kind: str) -> None:
    rng = np.random.default_rng(sum(map(ord, kind)))
    for across, along, mgl, w, q0 in tops(kind, rng):
        t = rng.uniform(0, 0.5) if kind == "fast" else rng.uniform(0, 6)
        state = Top([across, across, along], mgl, w, q0).at([0.0, t])
        rate = np.linalg.norm(w) + np.sqrt(abs(mgl) / across)
        phase = 1 + rate * t
        omega, q = taylor([across, across, along], w, t, q0, mgl)
        wanted = np.array([float(x) for x in q])
        case = (kind, across, along, mgl, w, q0, t)
        assert angle_between(state.attitude[0], q0) < 4e-15, case
        np.testing.assert_allclose(state.omega[0], w, atol=4e-15 * rate)
        # a top that falls from near upright magnifies what rounding there is
        slack = 20 if "falling" in kind else 1
        assert angle_between(state.attitude[1], wanted / np.linalg.norm(wanted)) < 4e-15 * phase * slack, case
        assert np.abs(state.omega[1] - [float(x) for x in omega]).max() < 8e-15 * phase * rate * slack, case


def test_a_sleeping_top_sleeps_and_a_hanging_one_hangs() -> None:
    for q0 in ([1, 0, 0, 0.4], [0, 1, 0.3, 0]):
        top = Top([1, 1, 0.5], 1.0, [0, 0, 2.0], q0)
        np.testing.assert_allclose(top.at([0.0, 5.0]).omega, [[0, 0, 2.0]] * 2)


def test_exactly_to_the_upright_position_from_below() -> None:
    # ½ I ω² = 2 m g l: it takes for ever
    state = Top([1, 1, 0.5], 1.0, [2.0, 0, 0], [0, 1, 0, 0]).at([0.0, 2.0, 20.0, 1e4])
    cosine = 1 - 2 * (state.attitude[:, 1] ** 2 + state.attitude[:, 2] ** 2)
    np.testing.assert_allclose(cosine, 2 * np.tanh([0, 2.0, 20.0, 1e4]) ** 2 - 1, atol=1e-14)
    np.testing.assert_allclose(state.energy, 1.0, rtol=1e-14)


def test_without_weight_it_is_a_free_body() -> None:
    w, q = [0.3, 0.4, 2.0], [0.5, 0.5, 0.5, 0.5]
    t = np.linspace(0, 9, 5)
    free, top = FreeBody([1, 1, 1.5], w, q).at(t), Top([1, 1, 1.5], 0.0, w, q).at(t)
    assert angle_between(free.attitude, top.attitude).max() < 1e-14
    np.testing.assert_allclose(free.omega, top.omega, atol=1e-14)


def test_many_tops_are_each_as_one() -> None:
    mgl = np.array([0.5, -0.5, 0.0, 1.0])
    w = np.random.default_rng(0).normal(size=(4, 3))
    t = np.linspace(0, 3, 4)
    many = Top([1, 1, 0.7], mgl, w).at(t)
    for i in range(4):
        np.testing.assert_allclose(
            Top([1, 1, 0.7], mgl[i], w[i]).at(t).attitude, many.attitude[i], atol=1e-15
        )
    np.testing.assert_allclose(many.energy, many.energy[:, :1] * np.ones(4), rtol=1e-13)


def test_integration_agrees_with_the_closed_form() -> None:
    t = np.array([0.0, 0.7, 2.0, -1.0])
    I, w, q = [1, 1, 0.6], [0.5, 1.0, 3.0], [0.8, 0.6, 0, 0]
    exact = Top(I, 1.2, w, q).at(t)
    for method, tolerance in (("DOP853", 1e-13), ("splitting", 1e-8)):
        run = integrate(I, w, q, t, mgl=1.2, method=method)
        assert angle_between(run.attitude, exact.attitude).max() < tolerance, method
        np.testing.assert_allclose(run.omega, exact.omega, atol=10 * tolerance)


def test_the_splitting_is_of_order_six_and_keeps_energy() -> None:
    I, w, q, t = [1, 1, 0.6], [0.5, 1.0, 3.0], [0.8, 0.6, 0, 0], [4.0]
    exact = Top(I, 1.2, w, q).at(t).attitude
    error = [
        float(
            angle_between(
                integrate(I, w, q, t, mgl=1.2, method="splitting", steps_per_turn=n).attitude, exact
            )[0]
        )
        for n in (12, 24)
    ]
    assert 40 < error[0] / error[1] < 100  # 2⁶ = 64
    long = integrate(I, w, q, np.linspace(0, 400, 41), mgl=1.2, method="splitting", steps_per_turn=12)
    swing = np.abs(long.energy - long.energy[0])
    assert swing[20:].max() < 3 * swing[:20].max()  # bounded, not growing


def test_the_rounding_of_a_long_splitting_turns_nothing() -> None:
    # without weight each stage is exact: what is left after 9 000 steps is rounding
    I, w, t = [1.3, 1.3, 0.9], [1.0, 0.5, 1.7], [400.0]
    run = integrate(I, w, t=t, method="splitting")
    assert angle_between(run.attitude, FreeBody(I, w).at(t).attitude)[0] < 5e-12


def test_torques_in_both_frames() -> None:
    t = np.linspace(0, 2, 5)
    # about a principal axis both frames are one, and the angle is ½ M/I t²
    for frame in ("body", "space"):
        run = integrate([1, 2, 4], [0, 0, 0], t=t, torque=[0, 0, 2.0], frame=frame)
        np.testing.assert_allclose(run.omega[:, 2], 0.5 * t, atol=1e-13)
        half = 0.5 * 0.5 * t**2 / 2
        np.testing.assert_allclose(run.attitude[:, 3], np.sin(half), atol=1e-13)
    # in space a constant torque is integrated exactly
    run = integrate([1, 2, 3], [1, 0.1, 0.5], t=t, torque=[0.3, 0.1, -0.2], frame="space")
    np.testing.assert_allclose(run.momentum, [1, 0.2, 1.5] + t[:, None] * [0.3, 0.1, -0.2], atol=1e-14)
    # a function of time and state serves as well
    other = integrate([1, 2, 3], [1, 0.1, 0.5], t=t, torque=lambda s, q, w: [0.3, 0.1, -0.2], frame="space")
    np.testing.assert_allclose(other.attitude, run.attitude, atol=1e-13)


@pytest.mark.parametrize(
    ("inertia", "word"), [([1, 2, 1], "two equal"), ([1, 1], "three components"), ([0, 0, 1], "two equal")]
)
def test_no_symmetric_top(inertia, word) -> None:
    with pytest.raises(ValueError, match=word):
        Top(inertia, 1.0, [0, 0, 1])


def test_a_rotation_beside_which_the_weight_is_nothing_is_refused() -> None:
    """Beyond 1e60 the 200 digits of the roots run out: found by fuzzing, at 1e60 rad/s."""
    with pytest.raises(ValueError, match="weight is negligible"):
        Top([0.002, 0.002, 0.0008], 0.1962, [0, 1e40, 60])
    state = Top([0.002, 0.002, 0.0008], 0.1962, [0, 1e25, 60]).at(np.linspace(0, 2e-24, 21))
    assert (np.abs(state.energy - state.energy[0]) <= 2 * state.error_estimate("energy")).all()
    assert (state.error_estimate("energy") < 1e-13 * state.energy).all()


def test_no_top_at_all() -> None:
    assert Top([1, 1, 0.5], 1.0, np.zeros((0, 3))).at([0.0, 1.0]).attitude.shape == (0, 2, 4)


@pytest.mark.parametrize("omega", [[0, 0, 60], [0, 0, -60], [0, 0, 0], [0.3, -0.1, 20]])
def test_at_time_zero_it_is_as_it_was_given(omega):
    state = Top([0.002, 0.002, 0.0008], 0.1962, omega, (0.6, 0.8, 0, 0)).at([0.0, 0.1])
    assert state.omega[0].tolist() == omega
    assert state.attitude[0].tolist() == [0.6, 0.8, 0, 0]
