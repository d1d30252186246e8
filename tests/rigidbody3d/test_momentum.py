"""Momentum, wrench, shafts and tensors against sums over particles: they alone catch a product of the wrong sign."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidbody3d import (
    SHAPES,
    Body,
    Motion,
    Shaft,
    check,
    compose,
    cones,
    inertia_of,
    measure_of,
    mesh,
    principal,
    products,
    shift,
    sleeping_threshold,
    steady_precession,
    strike,
    tensor,
)
from rigidbody3d.attitude import to_matrix


def particles(seed: int = 0, count: int = 12):
    """A rigid set of particles, lopsided in every product of inertia."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 1, count), rng.normal(size=(count, 3)) * [1.0, 0.6, 0.3] + [0.2, -0.1, 0.4]


def whole(mass, at) -> Body:
    return compose(Body(mass, at, np.zeros((len(mass), 3, 3))))


def test_momentum_and_its_rate_against_particles() -> None:
    mass, at = particles()
    body = whole(mass, at)
    w, alpha, v, a = np.random.default_rng(1).normal(size=(4, 3))
    motion = Motion(body.inertia, w, alpha, None, body.mass, body.center, v, a)
    r = at - body.center
    speed = v + np.cross(w, r)
    acceleration = a + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
    P = np.array([0.3, 2.0, -1.0])
    for found, wanted in (
        (motion.momentum, (mass[:, None] * np.cross(r, speed)).sum(axis=0)),
        (motion.rate, (mass[:, None] * np.cross(r, acceleration)).sum(axis=0)),
        (motion.momentum_about(P), (mass[:, None] * np.cross(at - P, speed)).sum(axis=0)),
        (motion.rate_about(P), (mass[:, None] * np.cross(at - P, acceleration)).sum(axis=0)),
        (motion.force, (mass[:, None] * acceleration).sum(axis=0)),
        (motion.energy, (mass * (speed**2).sum(axis=-1)).sum() / 2),
    ):
        np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-14)
    np.testing.assert_array_equal(motion.inertia_wrench.force, -motion.force)
    np.testing.assert_array_equal(motion.inertia_wrench.moment, -motion.rate)


def test_momentum_of_a_million_particles() -> None:
    # a turned box, its volume filled by a Gauss rule: exact for the second moments
    node, weight = np.polynomial.legendre.leggauss(100)
    x, y, z = np.meshgrid(node * 0.5, node * 1.0, node * 1.5, indexing="ij")
    W = (weight[:, None, None] * weight[:, None] * weight / 8 * 7.0).ravel()
    R = to_matrix(np.array([0.5, 0.1, -0.7, 0.5]) / np.linalg.norm([0.5, 0.1, -0.7, 0.5]))
    at = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=-1) @ R.T
    assert len(at) == 10**6
    box = Body.of("box", 7.0, width=1.0, height=2.0, depth=3.0).turned(R)
    w, alpha = np.array([0.3, -1.2, 2.0]), np.array([1.0, 0.5, -0.2])
    motion = Motion(box.inertia, w, alpha)
    speed = np.cross(w, at)
    np.testing.assert_allclose(motion.momentum, W @ np.cross(at, speed), rtol=1e-12)
    turning = np.cross(alpha, at) + np.cross(w, speed)
    np.testing.assert_allclose(motion.rate, W @ np.cross(at, turning), rtol=1e-12, atol=1e-12)


def test_the_rate_is_the_true_one_in_whatever_axes() -> None:
    mass, at = particles(3)
    body = whole(mass, at)
    w, alpha, frame = np.random.default_rng(4).normal(size=(3, 3))
    true = Motion(body.inertia, w, alpha).rate
    # the rate of ω's components in axes turning at Ω is α - Ω × ω
    turning = Motion(body.inertia, w, alpha - np.cross(frame, w), frame_omega=frame)
    np.testing.assert_allclose(turning.rate, true, rtol=1e-13)
    np.testing.assert_allclose(turning.relative + turning.transport, true, rtol=1e-13)
    assert np.abs(turning.tensor_rate).max() > 0.01  # eq. 44 with a constant tensor would be wrong here
    still = Motion(body.inertia, w, alpha, frame_omega=[0, 0, 0])
    np.testing.assert_allclose(still.rate, true, rtol=1e-14)
    # a body of revolution may spin in its axes freely
    disk = Motion(inertia_of("disk", 2.0, radius=1.0), [0, 4, 12.0], frame_omega=[0, 4.0, 0])
    np.testing.assert_array_equal(disk.tensor_rate, 0)


def test_many_states_in_one_call_are_each_as_one() -> None:
    mass, at = particles(5)
    body = whole(mass, at)
    w, alpha, a = np.random.default_rng(6).normal(size=(3, 20_000, 3))
    for first in ("rate", "momentum"):
        many = Motion(body.inertia, w, alpha, mass=body.mass, acceleration=a)
        getattr(many, first)
        for i in (0, 8191, 8192, 19_999):
            one = Motion(body.inertia, w[i], alpha[i], mass=body.mass, acceleration=a[i])
            np.testing.assert_allclose(many.momentum[i], one.momentum, rtol=1e-14)
            np.testing.assert_allclose(many.rate[i], one.rate, rtol=1e-13, atol=1e-14)
            np.testing.assert_allclose(many.inertia_force[i], one.inertia_force, rtol=1e-15)
    tensors = np.broadcast_to(body.inertia, (20_000, 3, 3))
    np.testing.assert_allclose(Motion(tensors, w, alpha).rate, many.rate, rtol=1e-12, atol=1e-13)


def test_nothing_is_computed_twice_or_unasked() -> None:
    motion = Motion(np.eye(3), np.ones((10, 3)))
    assert "momentum" not in vars(motion)
    assert motion.momentum is motion.momentum
    assert "rate" not in vars(motion)
    assert motion.inertia_force is motion.inertia_force
    assert "rate" not in vars(motion)


# --- inertia ---


@pytest.mark.parametrize(
    ("shape", "dimensions"),
    [
        ("box", {"width": 1.0, "height": 2.0, "depth": 0.5}),
        ("plate", {"width": 1.0, "height": 2.0}),
        ("rod", {"length": 2.0}),
        ("cylinder", {"radius": 0.7, "length": 2.0}),
        ("tube", {"radius": 0.7, "inner_radius": 0.3, "length": 2.0}),
        ("cone", {"radius": 0.7, "length": 2.0}),
        ("disk", {"radius": 0.7}),
        ("ring", {"radius": 0.7}),
        ("sphere", {"radius": 0.7, "inner_radius": 0.2}),
        ("arc", {"radius": 0.7, "angle": 2.0}),
    ],
)
def test_shapes_against_quadrature(shape: str, dimensions) -> None:
    at, weight = points_of(shape, dimensions)
    measure, _ = measure_of(shape, **dimensions)
    np.testing.assert_allclose(weight.sum(), measure, rtol=1e-12)
    density = 3.0 / measure
    body = whole(density * weight, at)
    np.testing.assert_allclose(body.inertia, inertia_of(shape, 3.0, **dimensions), rtol=1e-11, atol=1e-12)


def points_of(shape: str, d):
    """Points and weights of a Gauss rule in each coordinate: exact for second moments."""
    node, weight = np.polynomial.legendre.leggauss(24)

    def span(low, high):
        return (low + high) / 2 + (high - low) / 2 * node, (high - low) / 2 * weight

    turn = np.arange(24) * 2 * np.pi / 24
    one = np.zeros(1), np.ones(1)
    if shape in ("box", "plate", "rod"):
        sides = (d.get("width"), d.get("height"), d.get("depth") if shape == "box" else d.get("length"))
        axes = [span(-s / 2, s / 2) if s else one for s in sides]
        grid = np.meshgrid(*[a[0] for a in axes], indexing="ij")
        weights = np.einsum("i,j,k->ijk", *[a[1] for a in axes]).ravel()
        return np.stack([g.ravel() for g in grid], axis=-1), weights
    if shape == "arc":
        angle, w = span(-d["angle"] / 2, d["angle"] / 2)
        at = d["radius"] * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
        return at, w * d["radius"]
    if shape == "sphere":
        r, wr = span(d["inner_radius"], d["radius"])
        c, wc = span(-1, 1)
        R, C, T = np.meshgrid(r, c, turn, indexing="ij")
        S = np.sqrt(1 - C * C)
        weights = np.einsum("i,j,k->ijk", wr * r * r, wc, np.full(24, 2 * np.pi / 24)).ravel()
        return np.stack(
            [(R * S * np.cos(T)).ravel(), (R * S * np.sin(T)).ravel(), (R * C).ravel()], axis=-1
        ), weights
    if shape == "ring":
        at = d["radius"] * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
        return at, np.full(24, 2 * np.pi * d["radius"] / 24)
    z, wz = span(0, d["length"]) if "length" in d else one
    s, ws = span(d.get("inner_radius", 0.0) / d["radius"], 1)  # radius as a part of the local one
    Z, S, T = np.meshgrid(z, s, turn, indexing="ij")
    local = d["radius"] * ((1 - Z / d["length"]) if shape == "cone" else np.ones_like(Z))
    W = np.einsum("i,j,k->ijk", wz, ws * s, np.full(24, 2 * np.pi / 24)) * local**2
    at = np.stack([(local * S * np.cos(T)).ravel(), (local * S * np.sin(T)).ravel(), Z.ravel()], axis=-1)
    return at, W.ravel()


def test_every_shape_has_a_quadrature_here() -> None:
    here = {case[0] for case in test_shapes_against_quadrature.pytestmark[0].args[1]}
    assert here == set(SHAPES) - {"point"}


def test_shifting_there_and_back_over_a_million_radii_loses_nothing() -> None:
    mass, at = particles(7)
    body = whole(mass, at)
    far = body.moved([1e6, -1e6, 1e6])
    np.testing.assert_array_equal(far.inertia, body.inertia)
    # particles that lie there already: only their places are rounded, by 1e-10 of the body
    np.testing.assert_allclose(whole(mass, at + [1e6, -1e6, 1e6]).inertia, body.inertia, rtol=2e-9, atol=1e-9)
    # put together far away from bodies whose places are exact
    rods = Body.of("rod", mass=[1.0, 2.0], center=[[0.5, 0, 0], [-0.25, 0, 0]], length=1.0)
    np.testing.assert_array_equal(compose(rods.moved([2.0**20, 0, 0])).inertia, compose(rods).inertia)


def test_tensor_and_products_carry_their_signs() -> None:
    mass, at = particles(9)
    x, y, z = at.T
    xy, xz, yz = ((mass * a * b).sum() for a, b in ((x, y), (x, z), (y, z)))
    about_origin = whole(mass, at).about([0, 0, 0])
    np.testing.assert_allclose(products(about_origin), [xy, xz, yz], rtol=1e-13)
    xx, yy, zz = (mass @ ((at**2).sum(axis=1) - at[:, i] ** 2) for i in range(3))
    np.testing.assert_allclose(tensor(xx, yy, zz, xy, xz, yz), about_origin, rtol=1e-13)
    np.testing.assert_allclose(shift(mass, at).sum(axis=0), about_origin, rtol=1e-13)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_principal_axes_diagonalise_and_are_right_handed(seed: int) -> None:
    mass, at = particles(seed, 4)
    I = whole(mass, at).inertia
    moments, axes = principal(I)
    assert (np.diff(moments) >= 0).all()
    np.testing.assert_allclose(axes.T @ np.diag(moments) @ axes, I, atol=3e-15 * moments[2])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) > 0
    assert bool(check(I).valid)


def test_real_bodies_of_every_kind_are_valid_and_small_faults_are_seen() -> None:
    for seed in range(20):
        mass, at = particles(seed, 5)
        flat = whole(mass, at * [1, 1, 0])
        assert check(flat.inertia).valid  # equality, to rounding
        line = whole(mass, at[:, :1] * np.array([[0.3, -0.5, 0.8]]))
        assert check(line.inertia).valid
    assert not check(np.diag([1, 2, 3 + 1e-6])).valid
    assert check(np.diag([1, 2, 3 + 1e-10])).valid
    assert "negative" in check([-1, 1, 1]).reason
    assert check(np.diag([1, 2, 3.0])[None] * np.array([1, 2])[:, None, None]).valid.shape == (2,)


def test_two_close_moments_keep_their_digits() -> None:
    # a closed-form cubic loses half of them
    R = to_matrix(np.array([0.5, 0.1, -0.7, 0.5]) / np.linalg.norm([0.5, 0.1, -0.7, 0.5]))
    I = R @ np.diag([1.0, 1.0 + 1e-9, 1.5]) @ R.T
    np.testing.assert_allclose(principal((I + I.T) / 2).moments, [1, 1 + 1e-9, 1.5], rtol=2e-15)


def test_a_mesh_must_be_closed_and_right_side_out() -> None:
    corner, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    with pytest.raises(ValueError, match="not closed"):
        mesh(corner, faces[:3])
    with pytest.raises(ValueError, match="inside out"):
        mesh(corner, [f[::-1] for f in faces])


def test_the_total_mass_must_be_positive() -> None:
    with pytest.raises(ValueError, match="positive"):
        compose(Body(np.array([1.0, -1.0]), np.zeros((2, 3)), np.zeros((2, 3, 3))))


# --- shafts ---


def test_shaft_reactions_against_particles() -> None:
    mass, at = particles(11)
    body = whole(mass, at)
    z1, z2, w, rate, g = -1.2, 0.9, 13.0, -40.0, np.array([3.0, -9.0, 2.0])
    shaft = Shaft(body, (z1, z2), w, rate, g)
    x, y, z = at.T
    acceleration = np.stack([-w * w * x - rate * y, -w * w * y + rate * x, 0 * z], axis=-1)
    force = mass[:, None] * acceleration
    reactions = np.concatenate([shaft.static + shaft.dynamic, np.zeros((2, 1))], axis=1)
    # D'Alembert: reactions, axial force, torque, weight and inertia forces are in equilibrium
    axial = np.array([0, 0, shaft.axial])
    np.testing.assert_allclose(
        reactions.sum(axis=0) + axial + (mass[:, None] * g - force).sum(axis=0), 0, atol=1e-10
    )
    moment = np.cross(at, mass[:, None] * g - force).sum(axis=0)
    for position, reaction in zip((z1, z2), reactions, strict=True):
        moment = moment + np.cross([0, 0, position], reaction)
    moment[2] += shaft.drive_torque
    np.testing.assert_allclose(moment, 0, atol=1e-10)
    np.testing.assert_allclose(Shaft(body, (z1, z2), gravity=g).dynamic, 0)
    np.testing.assert_allclose(Shaft(body, (z1, z2), w, rate).static, 0)
    # masses that hold the opposite unbalance at the bearings leave nothing
    np.testing.assert_allclose(shaft.with_masses(-shaft.unbalance, np.array([z1, z2])), 0, atol=1e-10)


def test_many_shafts_in_one_call() -> None:
    mass, at = particles(12)
    body = whole(mass, at)
    speeds = np.array([1.0, 10.0, 100.0])
    many = Shaft(body, (0.0, 1.0), speeds).dynamic
    assert many.shape == (3, 2, 2)
    np.testing.assert_allclose(
        many / speeds[:, None, None] ** 2, np.broadcast_to(many[0], (3, 2, 2)), rtol=1e-13
    )


def test_bearings_at_one_place() -> None:
    with pytest.raises(ValueError, match="same place"):
        Shaft(Body.of("rod", 1.0, length=1.0), (0.3, 0.3))


# --- gyroscopes and percussion ---


def test_steady_precession_loses_nothing_in_the_slow_root() -> None:
    from fractions import Fraction

    # a fast top: the slow rate is mgl/(I3 ω3) to first order, twenty digits below the fast one
    found = steady_precession(0.002, 0.0008, 0.1962, 0.0, 1e9)
    a, b, c = Fraction(0.002), Fraction(0.0008) * 10**9, Fraction(0.1962)
    x = c / b
    for _ in range(4):
        x = (a * x * x + c) / b
    assert float(found.slow) == pytest.approx(float(x), rel=4e-16)
    assert np.isnan(steady_precession(1, 0.1, 10, 0.1, 1.0).slow)
    right_angle = steady_precession(1, 0.5, 10, np.pi / 2, 4.0)
    assert float(right_angle.slow) == pytest.approx(5.0, rel=1e-15)
    assert np.isinf(right_angle.fast)
    assert np.isinf(right_angle.error_estimate()[1])
    assert sleeping_threshold(1, 1, -2.0) == 0


def test_cones_roll_without_slipping() -> None:
    # the precession seen from the body: H turns about the axis at `spin`, ω lies in one plane with both
    found = cones(1.0, 1.7, [0.3, 0.4, 2.0])
    across, along = 0.5, 2.0
    tilt = np.arctan2(across, 1.7 * along)
    np.testing.assert_allclose(found.precession * np.sin(tilt), across)
    np.testing.assert_allclose(found.precession * np.cos(tilt) + found.spin, along)
    np.testing.assert_allclose(found.body - tilt, found.space, rtol=1e-14)


def test_percussion_free_and_pinned() -> None:
    mass, at = particles(13)
    body = whole(mass, at)
    J, r, p = np.random.default_rng(14).normal(size=(3, 3))
    free = strike(body.mass, body.inertia, J, r)
    np.testing.assert_allclose(body.mass * free.velocity, J)
    np.testing.assert_allclose(body.inertia @ free.omega, np.cross(r, J))
    for axis in (None, np.array([1.0, 2.0, -0.5])):
        blow = strike(body.mass, body.inertia, J, r, p, axis)
        np.testing.assert_allclose(blow.velocity + np.cross(blow.omega, p), 0, atol=1e-14)
        np.testing.assert_allclose(body.mass * blow.velocity, J + blow.reaction)
        balance = body.inertia @ blow.omega - np.cross(r, J) - np.cross(p, blow.reaction)
        # a hinge also answers with a moment across itself
        np.testing.assert_allclose(balance if axis is None else balance @ axis, 0, atol=1e-13)


def test_a_thin_rod_is_struck() -> None:
    rod = Body.of("rod", 3.0, length=2.0)
    free = strike(rod.mass, rod.inertia, [6.0, 0, 0], [0, 0, 0.5])
    np.testing.assert_array_equal(free.velocity, [2.0, 0, 0])
    np.testing.assert_array_equal(free.omega, [0, 3.0, 0])
    # hung at its upper end by a ball: 4 kg·m², lever 1.5 m
    held = strike(rod.mass, rod.inertia, [8.0, 0, 0], [0, 0, -0.5], pin=[0, 0, 1.0])
    np.testing.assert_array_equal(held.omega, [0, -3.0, 0])
    np.testing.assert_array_equal(held.reaction, [1.0, 0, 0])
    # a point mass moves, and no rod turns about itself
    np.testing.assert_array_equal(strike(2.0, np.zeros((3, 3)), [1.0, 0, 0], [0, 0, 0]).velocity, [0.5, 0, 0])
    with pytest.raises(ValueError, match="no moment of inertia"):
        strike(rod.mass, rod.inertia, [0, 1.0, 0], [0.1, 0, 0.5])
    with pytest.raises(ValueError, match="axis of its hinge"):
        strike(rod.mass, rod.inertia, [1.0, 0, 0], [0, 0, 0.5], pin=[0, 0, 1.0], axis=[0, 0, 2.0])
    for wrong, message in (({"axis": [0, 1, 0]}, "needs a pin"), ({"pin": [0, 1]}, "pin must have")):
        with pytest.raises(ValueError, match=message):
            strike(rod.mass, rod.inertia, [1.0, 0, 0], [0, 0, 0.5], **wrong)
    with pytest.raises(ValueError, match="not all of its numbers are 0"):
        strike(rod.mass, rod.inertia, [1.0, 0, 0], [0, 0, 0.5], pin=[0, 0, 1], axis=[0, 0, 0])
    with pytest.raises(ValueError, match="must be positive"):
        strike(0.0, rod.inertia, [1.0, 0, 0], [0, 0, 0.5])
