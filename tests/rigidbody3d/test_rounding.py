"""Errors by computing twice: against fractions and series, never less than the error, and no work unless asked for."""

from __future__ import annotations

import pickle
import subprocess
import sys
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.rotation import taylor
from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.exact import EPS
from rigidbody3d import Body, FreeBody, Motion, Shaft, Top, compose, integrate, principal, tensor
from rigidbody3d.attitude import angle_between
from rigidbody3d.shapes import SHAPES


def turned(found, exact) -> float:
    """Return the angle between an attitude and exact components."""
    length = Fraction(float(sum(x * x for x in exact)) ** 0.5)
    sign = 1 if sum(Fraction(float(a)) * b for a, b in zip(found, exact, strict=True)) > 0 else -1
    pairs = zip(found, exact, strict=True)
    return 2 * float(sum((sign * Fraction(float(a)) - b / length) ** 2 for a, b in pairs)) ** 0.5


@pytest.mark.parametrize(
    ("inertia", "omega", "t"),
    [
        # near the separatrix of a body whose two lower or upper moments are all but equal: the difference of two
        # angles of the size of 1/√(I2 - I1) left five digits of seven here
        ([1.0, 1 + 3.9e-14, 1.5], [0.7, -0.9, 1.1e-7], 5.0),
        ([1.0, 1 + 1.7e-10, 1.5], [0.3, 1.2, -7e-6], 5.0),
        ([1 + 2.5e-8, 1.0, 0.4], [1.3, 0.2, 1e-4], 4.0),
        ([1.0, 1 + 2.6e-5, 1.7], [0.9, -0.1, 2e-3], 3.0),
    ],
)
def test_nearly_symmetric_bodies_near_the_separatrix(inertia, omega, t) -> None:
    state = FreeBody(inertia, omega).at([t])
    true = taylor(inertia, omega, t)
    assert turned(state.attitude[0], true[1]) < state.error_estimate()[0] < 150 * EPS
    off = [abs(float(Fraction(float(a)) - b)) for a, b in zip(state.omega[0], true[0], strict=True)]
    assert (off <= state.error_estimate("omega")[0]).all()


@pytest.mark.parametrize("tilt", [1e-4, 1e-7, 1e-9])
@pytest.mark.parametrize("push", [0.0, 0.03])
def test_a_top_that_starts_next_to_the_upright(tilt, push) -> None:
    # its phases turn by π within a time of the order of the tilt: seven digits of the attitude were lost
    q0 = [np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]
    inertia, mgl, omega, t = [1.0, 1.0, 0.5], 1.3, [push, 0.02, 4.1], 0.8
    state = Top(inertia, mgl, omega, q0).at([t])
    true = taylor(inertia, omega, t, q0, mgl)
    assert turned(state.attitude[0], true[1]) < state.error_estimate()[0] < 1e-13
    off = [abs(float(Fraction(float(a)) - b)) for a, b in zip(state.omega[0], true[0], strict=True)]
    assert (off <= state.error_estimate("omega")[0]).all()


def test_axes_of_moments_that_rounding_cannot_tell_apart() -> None:
    # floats have the second axis along y or z, and in truth all three components count
    near = tensor(1, 1, 1, 1e-16, 1e-16, 1e-16)
    found = principal(near)
    with mp.workdps(50):
        values, vectors = mp.eigsy(mp.matrix(near.tolist()))
        true = [float(vectors[j, int(np.argmin([float(v) for v in values]))]) for j in range(3)]
    apart = np.abs(np.abs(found.axes[0]) - np.abs(true))
    assert (found.error_estimate().axes[0] >= apart).all()
    assert found.condition.max() > 1e14
    plain = principal(np.diag([1.0, 2.0, 4.0]))
    assert plain.error_estimate().axes.max() < 1e-27
    np.testing.assert_allclose(plain.condition, [4, 4, 2])
    # a tensor that is something else to 32 digits turns the axes
    exact = DoubledArray(np.diag([1.0, 2.0, 4.0])) + 1e-6 * (np.eye(3)[[1, 0, 2]] - np.diag([0.0, 0.0, 1.0]))
    assert 1e-6 <= plain.error_estimate(exact).axes[0, 1] < 1.1e-6
    assert (principal(np.zeros((3, 3))).error_estimate().axes < 1e-15).all()


def test_axes_of_equal_moments_are_as_good_as_any() -> None:
    # a disk in oblique axes: every direction across is a principal axis, whatever the eigensolver takes
    R = Fraction(1, 3) * np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]])
    disk = np.array(R @ np.diag([9, 9, 18]) @ R.T, dtype=float)
    error = principal(disk).error_estimate()
    assert error.axes.max() < 1e-14
    assert error.moments.max() < 1e-13


def test_either_sign_is_right_where_two_components_of_an_axis_are_as_large() -> None:
    # (1, -1)/√2: which of the two is the larger, and so the positive one, is rounding
    assert principal(tensor(2, 2, 5, ixy=-1)).error_estimate().axes.max() < 1e-15
    # here the first is larger by 2e-16, and by the rule the axis points along +x
    off = tensor(2, 2 + 2**-51, 5, ixy=1)
    found = principal(off)
    with mp.workdps(50):
        _, vectors = mp.eigsy(mp.matrix(off.tolist()))
    true = np.array([float(vectors[j, 1]) for j in range(3)])
    true *= np.sign(true[int(np.argmax(np.abs([float(vectors[j, 1]) for j in range(3)])))])
    assert (np.abs(found.axes[1] - true) <= found.error_estimate().axes[1] + 1e-16).all()


def test_what_a_body_is_made_of_shows_in_its_bounds() -> None:
    outer, left = 0.3, 1e-9
    hole = Body.of("cylinder", [1.0, -(1 - left)], radius=outer, length=[2.0, 2.0])
    ring = compose(hole)
    assert (ring.error_estimate().inertia.diagonal() > 1e-8 * ring.inertia.diagonal()).all()
    whole = Body.of("cylinder", 1.0, radius=outer, length=2.0)
    assert (whole.error_estimate().inertia.diagonal() < 1e-15 * whole.inertia.diagonal().max()).all()
    # 0.3 m and 1e8 m: the error is that of the sum, and it goes on into the tensor about the origin
    from_origin = Body(whole.mass, [0.3, 0, 0], whole.inertia)
    far = from_origin.moved([1e8, 0, 0]).turned([[0, -1, 0], [1, 0, 0], [0, 0, 1]], about=[0, 0, 0])
    true = Fraction(0.3) + 10**8
    off = float(abs(Fraction(float(far.center[1])) - true))
    assert off <= far.error_estimate().center[1] <= 1.02 * off
    about = float(
        abs(Fraction(float(far.about([0, 0, 0])[0, 0])) - Fraction(float(whole.inertia[0, 0])) - true**2)
    )
    assert about <= far.error_estimate(about=[0, 0, 0]).inertia[0, 0] <= 1.02 * about
    assert about > 0.1
    given = Body(np.array(1.0), np.ones(3), np.eye(3)).error_estimate()
    assert not any(x.any() for x in given)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_has_a_bound_with_and_without_what_it_can_do_without(shape) -> None:
    known = SHAPES[shape]
    needed = {name: [0.5, 0.7] if name == "radius" else 0.3 for name in known.dimensions}
    for given in (needed, needed | dict.fromkeys(known.optional, 0.1)):
        body = Body.of(shape, [[2.0], [-3.0]], center=[0.1, 0.2, 0.3], **given)
        for found, bound in zip((body.mass, body.center, body.inertia), body.error_estimate(), strict=True):
            assert found.shape == bound.shape
            # what stands in an arc's tensor are differences of what m·r² holds
            held = np.abs(body.mass[..., None, None]) * 0.7**2 if shape == "arc" else 0.0
            size = np.maximum(np.abs(found), held) if found.ndim == 4 else np.abs(found)
            assert (bound <= 16 * EPS * size).all()
        assert (body.error_estimate().inertia > 0).any() or shape == "point"


def test_no_doubled_number_is_loaded_unless_an_estimate_is_asked_for() -> None:
    work = """
import sys, numpy as np
from rigidbody3d import Body, FreeBody, Motion, Shaft, compose
parts = Body.of("sphere", [1.0, 2.0], center=[[0, 0, 0], [1, 0, 0]], radius=0.5)
body = compose(parts.moved([0, 0, 1]).turned(np.eye(3)))
Shaft(body, (0, 1), 3.0).dynamic, Motion(body.inertia, [1, 2, 3.0]).rate, body.principal
assert not {name for name in sys.modules if "doubled" in name} - {"dalembert.arithmetic.doubled"}, sys.modules
body.error_estimate()
assert "dalembert.arithmetic.doubled_arrays" in sys.modules
"""
    subprocess.run([sys.executable, "-c", work], check=True)


def test_bodies_with_bounds_can_be_stored() -> None:
    body = compose(Body.of("rod", [1.0, 1.0], center=[[0, 0, 1], [0, 0, 2]], length=1.0))
    again = pickle.loads(pickle.dumps(body))
    np.testing.assert_array_equal(again.error_estimate().inertia, body.error_estimate().inertia)


def test_many_bodies_states_and_shafts_have_the_bounds_of_each() -> None:
    rng = np.random.default_rng(8)
    mass, center = rng.uniform(1, 2, (4, 3)), rng.normal(size=(4, 3, 3))
    inertia = np.eye(3) * rng.uniform(1, 2, (4, 3))[..., None, None]
    whole = compose(Body(mass, center, inertia), axis=1)
    omega, alpha = rng.normal(size=(2, 4, 3))
    motion = Motion(whole.inertia, omega, alpha, [0, 0, 1.0], whole.mass, whole.center)
    shaft = Shaft(whole, (-1, 1), 10.0, 2.0, (0, -9.81, 1))
    error = whole.error_estimate()
    for i in range(4):
        one = compose(Body(mass[i], center[i], inertia[i]))
        own = one.error_estimate()
        for a, b in zip(own, error, strict=True):
            np.testing.assert_allclose(a, b[i], rtol=1e-12)
        single = Motion(one.inertia, omega[i], alpha[i], [0, 0, 1.0], one.mass, one.center)
        for of in ("momentum", "rate", "relative", "transport", "tensor_rate", "energy", "rate_about"):
            many = motion.error_estimate(of, [1, 2, 3], whole.in_32_digits)
            assert many.shape == ((4,) if of == "energy" else (4, 3))
            alone = single.error_estimate(of, [1, 2, 3], one.in_32_digits)
            # of many states the products are summed in another order
            value = [getattr(x, of) for x in (motion, single)]
            values = [x([1, 2, 3]) if callable(x) else x for x in value]
            assert (np.abs(alone - many[i]) <= 1.02 * np.abs(values[0][i] - values[1]) + 1e-28).all()
        alone = Shaft(one, (-1, 1), 10.0, 2.0, (0, -9.81, 1))
        for of in ("dynamic", "static", "unbalance", "static_unbalance", "axial", "drive_torque"):
            np.testing.assert_allclose(alone.error_estimate(of), shaft.error_estimate(of)[i], rtol=1e-12)


def test_states_in_time_have_bounds_of_their_own_shapes() -> None:
    inertia = np.array([[1.0, 2, 3], [1, 1, 2]])
    many = FreeBody(inertia, [[0.3, 0.1, 1.0]]).at([0.0, 1.0, 1e6])
    top = Top([1, 1, 0.5], [1.0, -1.0], [0.1, 0.2, 3.0], [0.9, 0.1, 0.2, 0.3]).at([0.0, 1.0])
    for state, lead in ((many, (2, 3)), (many.body.at(2.0), (2,)), (top, (2, 2)), (top.top.at(1.0), (2,))):
        for of in ("attitude", "energy"):
            assert state.error_estimate(of).shape == lead
        for of in ("omega", "momentum"):
            assert state.error_estimate(of).shape == (*lead, 3)
        with pytest.raises(ValueError, match="expected one of attitude"):
            state.error_estimate("speed")
    late = many.error_estimate()
    assert (late[:, 2] > 1e4 * late[:, 0]).all()
    # momentum stays what it was however late the state is
    assert many.error_estimate("momentum").max() < 8 * EPS * np.abs(many.body.momentum).max()
    assert many.body.error_estimate().shape == (2,)
    with pytest.raises(ValueError, match="expected one of period"):
        many.body.error_estimate("attitude")
    with pytest.raises(ValueError, match="expected one of momentum"):
        Motion(np.eye(3), [1, 2, 3.0]).error_estimate("speed")
    with pytest.raises(ValueError, match="rate_about: expected the point"):
        Motion(np.eye(3), [1, 2, 3.0]).error_estimate("rate_about")


def test_a_tensor_that_was_worked_out_carries_its_errors_on() -> None:
    tilted, omega = tensor(2.0, 3.0, 4.0, ixy=0.3), [1.0, 0.2, 0.1]
    body = FreeBody(tilted, omega)
    # to 32 digits the tensor is another one
    other = FreeBody(DoubledArray(tilted) + 1e-9 * np.eye(3), omega)
    state, exact = body.at([50.0]), other.at([50.0])
    for of in ("attitude", "quaternion", "omega", "momentum", "energy"):
        assert state.error_estimate(of, exact).max() > 1e3 * state.error_estimate(of).max()
    near = FreeBody(tilted + 1e-9 * np.eye(3), omega).at([50.0])
    apart = float(angle_between(near.attitude, state.attitude)[0])
    assert apart < state.error_estimate("attitude", exact)[0] < 1.02 * apart
    assert body.error_estimate("period", other) > 1e3 * body.error_estimate("period")
    run = integrate(tilted, omega, t=[50.0])
    assert apart < run.error_estimate("attitude", DoubledArray(tilted) + 1e-9 * np.eye(3))[0] < 1.1 * apart


@pytest.mark.parametrize("method", ["DOP853", "RK45", "splitting"])
@pytest.mark.parametrize("t", [0.3, 4.0])
def test_an_integration_knows_its_own_error(method, t) -> None:
    inertia, omega, mgl = [1.0, 1.0, 0.6], [0.5, 1.0, 3.0], 1.2
    run = integrate(inertia, omega, t=[t], mgl=mgl, method=method, rtol=1e-8, steps_per_turn=15)
    true = taylor(inertia, omega, t, mgl=mgl)
    assert turned(run.attitude[0], true[1]) <= run.error_estimate()[0]
    off = [abs(float(Fraction(float(a)) - b)) for a, b in zip(run.omega[0], true[0], strict=True)]
    assert (off <= run.error_estimate("omega")[0]).all()
    assert run.error_estimate()[0] < 1e-4
    assert run.error_estimate("momentum").shape == (1, 3)
    assert run.error_estimate("energy").shape == (1,)
