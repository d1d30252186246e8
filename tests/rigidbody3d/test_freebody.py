"""Free rotation against integer Taylor series, and what no formula may break."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.truth.rotation import period_of, power, taylor
from rigidbody3d import FreeBody
from rigidbody3d.attitude import angle_between, compose, from_matrix, from_scipy, rotate, to_matrix, to_scipy


def attitude_error(q, exact) -> float:
    wanted = np.array([float(x) for x in exact])
    return float(angle_between(q, wanted / np.linalg.norm(wanted)))


def omega_error(found, exact) -> float:
    return max(abs(float(Fraction(float(a)) - b)) for a, b in zip(found, exact, strict=True))


def unit(rng) -> np.ndarray:
    q = rng.normal(size=4)
    q /= np.linalg.norm(q)
    return q / np.linalg.norm(q)


def bodies(kind: str, rng):
    """Yield (moments, omega) of a kind."""
    for _ in range(6):
        I = np.sort(rng.uniform(0.2, 1, 3))
        I[2] = min(I[2], I[0] + I[1])
        w = rng.normal(size=3)
        if kind == "separatrix":
            nearness = 10 ** rng.uniform(-14, -3) * rng.choice([-1, 1])
            w[2] = np.sqrt(I[0] * (I[1] - I[0]) / (I[2] * (I[2] - I[1]))) * w[0] * (1 + nearness)
        elif kind == "nearly symmetric":
            I = np.array([1, 1 + 10 ** rng.uniform(-14, -5), rng.uniform(0.5, 1.9)])
        elif kind == "near an axis":
            w = rng.permutation([1e-7 * rng.normal(), 1e-9 * rng.normal(), 1.0])
        elif kind == "slender":
            I = np.array([10 ** rng.uniform(-6, -1), 1, 1 + 1e-7 * rng.random()])
        elif kind == "symmetric":
            I = rng.permutation([0.7, 0.7, rng.uniform(0.3, 1.3)])
        yield I[rng.permutation(3)] if kind == "generic" else I, w


@pytest.mark.parametrize(
    "kind", ["generic", "separatrix", "nearly symmetric", "near an axis", "slender", "symmetric"]
)
def test_against_integer_taylor_series(kind: str) -> None:
    rng = np.random.default_rng(sum(map(ord, kind)))
    for I, w in bodies(kind, rng):
        q0, size = unit(rng), np.linalg.norm(w)
        t = rng.uniform(0, 30) / size
        state = FreeBody(I, w, q0).at(t)
        omega, q = taylor(I, w, t, q0)
        assert attitude_error(state.attitude, q) < 1e-15 * (1 + size * t), (kind, I, w, t)
        # where I1 is tiny ω1 is quick: its own phase counts
        phase = size * t * I.max() / I.min() if kind == "slender" else size * t
        assert omega_error(state.omega, omega) < 1e-15 * (1 + phase) * size, (kind, I, w, t)


def test_the_error_after_a_hundred_thousand_revolutions_is_that_of_the_phase() -> None:
    I, w = np.array([1.0, 2.0, 3.0]), np.array([1.0, 0.1, 0.5])
    t = 2 * np.pi * 1e5 / np.linalg.norm(w)
    period = period_of(I, w)
    turns = int(Fraction(t) // period)
    # ω comes back after a period, and the body has turned about H by the same angle each time
    whole = power(taylor(I, w, period)[1], turns)
    omega, q = taylor(I, w, Fraction(t) - turns * period, whole)
    state = FreeBody(I, w).at(t)
    eps = np.finfo(float).eps
    assert attitude_error(state.attitude, q) < 2 * eps * t * np.linalg.norm(w)
    assert omega_error(state.omega, omega) < 2 * eps * t * np.linalg.norm(w)
    assert FreeBody(I, w).period == pytest.approx(float(period), rel=1e-15)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(0.05, 1)] * 3),
    # below 1e-60 rad/s the squares of the norms this test itself takes underflow
    st.tuples(*[st.floats(-10, 10).filter(lambda x: x == 0 or abs(x) > 1e-60)] * 3),
    st.floats(-1000, 1000),
)
def test_momentum_and_energy_to_rounding(moments, omega, t) -> None:
    a, b, c = moments
    body = FreeBody([a + b, b + c, c + a], omega)
    state = body.at([0.0, t])
    H = np.linalg.norm(body.momentum)
    assert np.abs(state.momentum - body.momentum).max() <= 4e-15 * H
    assert np.abs(state.energy - body.energy).max() <= 4e-15 * body.energy
    assert angle_between(state.attitude[0], [1, 0, 0, 0]) < 1e-15
    np.testing.assert_allclose(np.linalg.norm(state.attitude, axis=-1), 1, rtol=1e-15)


def test_there_and_back_again() -> None:
    rng = np.random.default_rng(5)
    for I, w in bodies("generic", rng):
        body = FreeBody(I, w)
        there = body.at(7.0)
        back = FreeBody(I, there.omega, there.attitude).at(-7.0)
        assert angle_between(back.attitude, [1, 0, 0, 0]) < 5e-14
        np.testing.assert_allclose(back.omega, w, atol=1e-13)


@pytest.mark.parametrize(
    ("inertia", "omega"),
    [
        ([2, 2, 2], [1, 2, 3]),
        ([1, 2, 3], [0, 0, 4]),
        ([1, 2, 3], [0, 4, 0]),
        ([1, 2, 3], [4, 0, 0]),
        ([3, 3, 3], [0, 0, 0]),
    ],
)
def test_permanent_rotation_is_a_turn_about_omega(inertia, omega) -> None:
    body = FreeBody(inertia, omega, [0.5, 0.5, 0.5, 0.5])
    t = np.linspace(0, 3, 7)
    np.testing.assert_allclose(body.at(t).omega, np.broadcast_to(omega, (7, 3)), atol=1e-15)
    assert np.isinf(body.period)
    half = np.linalg.norm(omega) * t / 2
    axis = np.array(omega) / (np.linalg.norm(omega) or 1)
    turn = np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * axis], axis=1)
    assert angle_between(body.at(t).attitude, compose([0.5] * 4, turn)).max() < 2e-15


def test_exactly_on_the_separatrix_it_comes_to_the_middle_axis() -> None:
    # I1 (I2 - I1) ω1² = I3 (I3 - I2) ω3², exactly, in numbers that doubles hold
    I = [1.0, 2.0, 2.25]
    w1, w3 = 0.75, 1.0
    assert I[0] * (I[1] - I[0]) * w1**2 == I[2] * (I[2] - I[1]) * w3**2
    body = FreeBody(I, [w1, 0.2, w3])
    assert body.separatrix == 0
    state = body.at([0.0, 1.0, 1e3])
    assert np.abs(state.omega[2, [0, 2]]).max() < 1e-100
    np.testing.assert_allclose(state.momentum, np.broadcast_to(body.momentum, (3, 3)), rtol=4e-15)


@pytest.mark.parametrize("signs", list(product((1, -1), repeat=3)))
def test_exactly_on_the_separatrix_against_taylor(signs: tuple[int, int, int]) -> None:
    # ω1 and ω3 keep their signs, ω2 goes from one end to the other
    I, w = [1.0, 2.0, 2.25], [sign * x for sign, x in zip(signs, (0.75, 0.2, 1.0), strict=True)]
    for t in (-2.0, 9.0):
        omega, q = taylor(I, w, t)
        state = FreeBody(I, w).at(t)
        assert attitude_error(state.attitude, q) < 2e-14
        assert omega_error(state.omega, omega) < 2e-14
        assert (state.error_estimate("omega") < 2e-14).all()
    far = FreeBody(I, w).at([-200.0, 200.0]).omega
    np.testing.assert_array_equal(np.sign(far[:, 1]), [-signs[0] * signs[2], signs[0] * signs[2]])


def test_a_thin_rod_spins_and_tumbles() -> None:
    state = FreeBody([0, 1, 1], [5.0, 1.0, 0]).at([0.0, np.pi])
    np.testing.assert_allclose(state.momentum, [[0, 1, 0]] * 2, atol=4e-15)
    np.testing.assert_allclose(state.omega[:, 0], 5.0)


def test_a_tensor_in_oblique_axes_is_the_same_body() -> None:
    rng = np.random.default_rng(3)
    R = to_matrix(unit(rng))
    I, w = np.array([1, 2, 2.7]), np.array([0.3, 1, 0.2])
    tensor = R @ np.diag(I) @ R.T
    plain = FreeBody(I, w).at([0.0, 3.0, 20.0])
    turned = FreeBody((tensor + tensor.T) / 2, R @ w, from_matrix(R.T)).at([0.0, 3.0, 20.0])
    np.testing.assert_allclose(turned.omega, plain.omega @ R.T, atol=4e-14)
    assert angle_between(turned.attitude, compose(plain.attitude, from_matrix(R.T))).max() < 4e-14


def test_many_bodies_are_each_as_one() -> None:
    rng = np.random.default_rng(8)
    I = np.array([[1, 2, 3], [2, 2, 3], [1, 1, 1], [3, 2, 4.0], [1, 2, 3]])
    w = rng.normal(size=(5, 3))
    w[4] = [0, 1, 0]
    t = np.linspace(0, 20, 11)
    many = FreeBody(I, w).at(t)
    assert many.omega.shape == (5, 11, 3)
    assert many.attitude.shape == (5, 11, 4)
    for i in range(5):
        one = FreeBody(I[i], w[i]).at(t)
        np.testing.assert_array_equal(one.omega, many.omega[i])
        np.testing.assert_array_equal(one.attitude, many.attitude[i])


def test_blocks_do_not_show() -> None:
    body = FreeBody([1, 2, 3], [1, 0.1, 0.5])
    t = np.linspace(0, 50, 20_001)
    np.testing.assert_array_equal(body.at(t).omega[::1000], body.at(t[::1000]).omega)
    # continuous, never jumping to -q
    assert np.abs(np.diff(body.at(t).attitude, axis=0)).max() < 0.01


def test_only_what_is_asked_for_is_computed(monkeypatch) -> None:
    import rigidbody3d.free_rotation as module

    calls = []
    real = module.third
    monkeypatch.setattr(module, "third", lambda *a: calls.append(1) or real(*a))
    body = FreeBody([1, 2, 3], [1, 0.1, 0.5])
    state = body.at([1.0, 2.0])
    assert state.omega is state.omega
    assert not calls
    assert state.attitude is state.attitude
    assert len(calls) == 2  # at time zero, once for the body, and at the times
    body.at(3.0).attitude  # noqa: B018
    assert len(calls) == 3


@pytest.mark.parametrize(
    ("inertia", "omega", "attitude", "word"),
    [
        ([1, 2], [1, 2, 3], [1, 0, 0, 0], "3 moments"),
        ([-1, 2, 3], [1, 2, 3], [1, 0, 0, 0], "positive"),
        ([0, 1, 2], [1, 2, 3], [1, 0, 0, 0], "thin rod"),
        ([1, 2, 3], [1, 2], [1, 0, 0, 0], "three components"),
        ([1, 2, np.nan], [1, 2, 3], [1, 0, 0, 0], "finite"),
        ([1, 2, 3], [1, 2, np.inf], [1, 0, 0, 0], "finite"),
        ([1, 2, 3], [1, 2, 3], [0, 0, 0, 0], "quaternion"),
        ([[1, 2, 0], [0, 1, 0], [0, 0, 1]], [1, 2, 3], [1, 0, 0, 0], "symmetric"),
    ],
)
def test_bad_data_say_what_is_wrong(inertia, omega, attitude, word) -> None:
    with pytest.raises(ValueError, match=word):
        FreeBody(inertia, omega, attitude)


def test_quaternions_and_scipy() -> None:
    rng = np.random.default_rng(2)
    q = np.stack([unit(rng) for _ in range(20)])
    v = rng.normal(size=(20, 3))
    np.testing.assert_allclose(rotate(q, v), to_scipy(q).apply(v), atol=1e-14)
    assert angle_between(from_scipy(to_scipy(q)), q).max() < 1e-15
    assert angle_between(from_matrix(to_matrix(q)), q).max() < 2e-15
    np.testing.assert_allclose(np.einsum("nij,nj->ni", to_matrix(q), v), rotate(q, v), atol=1e-14)


@pytest.mark.parametrize("power", [-900, 900])
def test_moments_of_any_size(power: int) -> None:
    """Their squares left the range of numbers, and the state had no number: it depends on their ratios alone."""
    moments, omega, times = np.array([1.0, 2.0, 2.5]), [0.1, 2.0, 0.1], [0.0, 3.0]
    body, scaled = FreeBody(moments, omega), FreeBody(np.ldexp(moments, power), omega)
    for quantity in ("omega", "attitude"):
        np.testing.assert_array_equal(getattr(scaled.at(times), quantity), getattr(body.at(times), quantity))
    np.testing.assert_array_equal(scaled.momentum, np.ldexp(body.momentum, power))
    assert (scaled.period, scaled.energy) == (body.period, np.ldexp(body.energy, power))


@pytest.mark.parametrize(
    "omega", [[0.05, 12, 0.05], [-0.05, 12, -0.05], [0, 12, 0], [0, 0, 0], [3, 0.1, 0.7]]
)
def test_at_time_zero_it_is_as_it_was_given(omega):
    for inertia in ([0.002, 0.0011, 0.0009], [1, 1, 2], [1, 1, 1]):
        state = FreeBody(inertia, omega, (0.5, 0.5, 0.5, 0.5)).at([-1.0, 0.0, 0.3])
        assert state.omega[1].tolist() == omega
        assert state.attitude[1].tolist() == [0.5, 0.5, 0.5, 0.5]
    several = FreeBody([1, 2, 3], [omega, omega]).at(0.0)
    assert several.omega.tolist() == [omega, omega]
