"""Bodies, axes and tensors worked out by hand, away from every origin at which a sign would not show."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from rigidbody3d import (
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
    sleeping_threshold,
    steady_precession,
    tensor,
)


def test_a_body_moved_and_turned_about_a_point() -> None:
    box = Body.of("box", 12.0, width=1.0, height=2.0, depth=3.0)  # tensor 13, 10, 5
    moved = box.moved([1.0, 2.0, 0.0]).moved([0.5, 0.0, -1.0])
    np.testing.assert_array_equal(moved.center, [1.5, 2.0, -1.0])
    quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # x to y
    turned = moved.turned(quarter, about=[1.0, 1.0, 0.0])
    np.testing.assert_array_equal(turned.center, [0.0, 1.5, -1.0])
    np.testing.assert_array_equal(turned.inertia, np.diag([10.0, 13.0, 5.0]))
    np.testing.assert_array_equal(moved.turned(quarter).center, moved.center)
    # about a point that is not the origin: r = (-1, 0.5, 1), 12 kg
    about = turned.about([1.0, 1.0, -2.0])
    np.testing.assert_array_equal(about, [[25.0, 6.0, 12.0], [6.0, 37.0, -6.0], [12.0, -6.0, 20.0]])
    np.testing.assert_array_equal(turned.principal.moments, [5.0, 10.0, 13.0])


def test_one_shape_at_many_places() -> None:
    rod = Body(0.3, np.array([[0, 0, 1.0], [0, 2.0, 0], [3.0, 0, 0]]), np.diag([0.025, 0.025, 0.0]))
    assert rod.mass.shape == (3,)
    assert rod.inertia.shape == (3, 3, 3)
    np.testing.assert_allclose(rod.about([0, 0, 0])[1], np.diag([1.225, 0.025, 1.2]), rtol=1e-15)
    whole = compose(rod)
    assert whole.mass == pytest.approx(0.9, rel=1e-15)
    np.testing.assert_allclose(whole.center, [1.0, 2 / 3, 1 / 3], rtol=1e-15)


@pytest.mark.parametrize("angle", [1e-6, 0.01, 1.0, 2.9, 3.1, 6.2])
def test_an_arc_keeps_its_digits_down_to_a_straight_wire(angle: float) -> None:
    with mp.workdps(50):
        a = mp.mpf(angle)
        across = (1 - mp.sin(a) / a) / 2
        along = 1 - across - (mp.sin(a / 2) / (a / 2)) ** 2
        true = [float(across), float(along), float(across + along)]
    np.testing.assert_allclose(inertia_of("arc", 1.0, radius=1.0, angle=angle).diagonal(), true, rtol=2e-15)


def test_parts_of_unlike_shapes_are_composed() -> None:
    disk = Body.of("disk", 2.0, radius=0.3).moved([0.0, 0.0, 1.0])  # 0.045, 0.045, 0.09
    rod = Body.of("rod", 2.0, length=2.0)  # 2/3, 2/3, 0
    whole = compose([disk, rod])
    np.testing.assert_allclose(whole.center, [0, 0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(whole.inertia.diagonal(), [1.045 + 2 / 3, 1.045 + 2 / 3, 0.09], rtol=1e-15)
    # the decimals are those of floats, and one of the errors is that of 2/3 + 1 + 0.045
    assert 0 < whole.error_estimate().inertia[0, 0] < 1e-15
    assert [solid.shape for solid in whole.solids()] == ["disk", "rod"]
    assert compose(rod) == compose([rod]) == Body(2.0, np.zeros(3), rod.inertia)
    # one hub with blades at two lengths
    several = compose([disk, Body.of("rod", [2.0, 4.0], length=[2.0, 1.0])])
    np.testing.assert_allclose(several.mass, [4.0, 6.0])
    np.testing.assert_allclose(several.inertia[0], whole.inertia, atol=1e-16)
    with pytest.raises(ValueError, match="at least one part"):
        compose([])
    with pytest.raises(ValueError, match=r"part 1 \(2,\), part 2 \(3,\)"):
        compose([Body.of("rod", [1.0, 2.0], length=1.0), Body.of("rod", [1.0, 2.0, 3.0], length=1.0)])


def test_a_batch_is_judged_body_by_body() -> None:
    good, askew = np.diag([1.0, 2.0, 2.5]), np.diag([1.0, 2.0, 2.5])
    askew[0, 1] = 0.1
    with pytest.raises(ValueError, match="symmetric"):
        principal(np.stack([good, askew]))
    found = check([[1.0, 2.0, 2.5], [1.0, 1.0, 3.0]])
    np.testing.assert_array_equal(found.valid, [True, False])
    np.testing.assert_array_equal(found.margin, [0.5, -1.0])
    assert "1 + 1 < 3" in found.reason


def test_a_thin_rod_in_oblique_axes_has_its_two_moments() -> None:
    along = np.array([2.0, -1.0, 2.0]) / 3
    found = principal(0.6 * (np.eye(3) - np.outer(along, along)))
    np.testing.assert_allclose(found.moments, [0, 0.6, 0.6], rtol=1e-15)
    assert found.moments[0] == 0
    assert abs(found.axes[0] @ along) == pytest.approx(1.0, rel=1e-15)


def test_principal_axes_point_where_their_largest_component_is_positive() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        half = rng.normal(size=(3, 3))
        axes = principal(half @ half.T).axes
        for axis in axes[:2]:
            assert axis[np.abs(axis).argmax()] > 0
        np.testing.assert_allclose(np.cross(axes[0], axes[1]), axes[2], atol=1e-14)
    # a diagonal tensor's axes are the given ones, in the order of the moments
    np.testing.assert_array_equal(principal(np.diag([3.0, 1.0, 2.0])).axes, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])


def test_a_disk_on_an_arm_about_the_fixed_point() -> None:
    """Riul's example 3 in axes that turn with the arm: v = Ω × r, a = Ω × (Ω × r), Ḣ = Ω × H of the disk."""
    disk = tensor(0.5, 0.5, 1.0)
    motion = Motion.about_fixed_point(
        disk, [0, 4.0, 12.0], mass=2.0, center=[0.3, 1.0, 0.1], point=[0.0, 1.0, 0.0], frame_omega=[0, 4.0, 0]
    )
    # the disk's own point at G moves as ω × r = (4·0.1 - 0, 12·0.3, -4·0.3)
    np.testing.assert_allclose(motion.velocity, [0.4, 3.6, -1.2], rtol=1e-15)
    # α = Ω × ω = (48, 0, 0); α × r + ω × v = (0, -4.8, 0) + (-4.8 - 43.2, 4.8, -1.6)
    np.testing.assert_allclose(motion.acceleration, [-48.0, 0.0, -1.6], rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(motion.inertia_force, -2.0 * motion.acceleration)
    np.testing.assert_allclose(motion.rate, [48.0, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(motion.linear_momentum, [0.8, 7.2, -2.4], rtol=1e-15)


def test_in_body_axes_the_tensor_has_no_rate() -> None:
    """Euler: H = (1·1, 2·2, 3·3), I α = (0.1, 0.4, 0.9), ω × H = (2·9 - 3·4, 3·1 - 1·9, 1·4 - 2·1)."""
    motion = Motion(np.diag([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(motion.relative, [0.1, 0.4, 0.9], rtol=1e-15)
    np.testing.assert_array_equal(motion.transport, [6.0, -6.0, 2.0])
    np.testing.assert_array_equal(motion.tensor_rate, [0.0, 0.0, 0.0])
    np.testing.assert_allclose(motion.rate, [6.1, -5.6, 2.9], rtol=1e-15)


def test_what_is_not_given_is_zero() -> None:
    motion = Motion(np.eye(3), [0.0, 0.0, 2.0])
    for quantity in (motion.mass, motion.center, motion.velocity, motion.acceleration, motion.rate):
        assert not quantity.any()
    assert motion.energy == 2.0
    still = Motion(np.eye(3), [0.0, 0.0, 2.0], mass=3.0)
    assert not still.momentum_about([0, 0, 0])[:2].any()
    assert still.energy == 2.0


def test_one_spin_and_many_accelerations() -> None:
    """States that broadcast: I α + ω × H for each α, H the same."""
    I, w = np.diag([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0])
    alpha = np.array([[0.1, 0.2, 0.3], [1.0, 0.0, 0.0]])
    motion = Motion(I, w, alpha)
    np.testing.assert_allclose(motion.rate, [[6.1, -5.6, 2.9], [7.0, -6.0, 2.0]], rtol=1e-15)
    np.testing.assert_array_equal(motion.momentum, [1.0, 4.0, 9.0])
    many = Motion(I, np.stack([w, 2 * w]), [1.0, 0.0, 0.0])
    np.testing.assert_allclose(many.rate, [[7.0, -6.0, 2.0], [25.0, -24.0, 8.0]], rtol=1e-15)
    grid = Motion(I, np.broadcast_to(w, (2, 4, 3)), np.broadcast_to(alpha[:, None], (2, 4, 3)))
    np.testing.assert_allclose(grid.rate[:, 3], motion.rate, rtol=1e-15)
    assert grid.momentum.shape == (2, 4, 3)


def test_a_shaft_at_many_speeds_and_many_shafts() -> None:
    """A point of 2 kg at (0.1, 0.2, 0.25) between bearings at 0 and 1: they carry three quarters and one quarter."""
    body = Body(2.0, np.array([0.1, 0.2, 0.25]), np.zeros((3, 3)))
    shaft = Shaft(body, (0.0, 1.0), [2.0, 3.0, 4.0], gravity=[0.0, -10.0, 0.0])
    whole = -np.array([4.0, 9.0, 16.0])[:, None, None] * 2.0 * np.array([0.1, 0.2])
    np.testing.assert_allclose(shaft.dynamic, whole * np.array([0.75, 0.25])[:, None], rtol=1e-15)
    np.testing.assert_allclose(shaft.static, [[0.0, 15.0], [0.0, 5.0]], rtol=1e-15)
    two = Shaft(body, [[0.0, 1.0], [-0.25, 0.75]], 1.0)
    shares = np.array([[0.75, 0.25], [0.5, 0.5]])
    np.testing.assert_allclose(two.unbalance, shares * (0.2 + 0.4j), rtol=1e-15)
    for bad in ([0.0, 1.0, 2.0], [0.0, np.nan]):
        with pytest.raises(ValueError, match="two finite positions"):
            Shaft(body, bad)
    with pytest.raises(ValueError, match="same place"):
        Shaft(body, [[0.0, 1.0], [0.5, 0.5]])


def test_cones_and_precession_in_any_units() -> None:
    """I1 = 4, I3 = 1, ω⊥ = 1, ω3 = 4: H = (4, 4), so H leans 45° and ω 14° from the axis; |H|/I1 = √2, spin 3."""
    found = cones(4.0, 1.0, [[0.6, 0.8, 4.0], [0.6, 0.8, -4.0]])
    np.testing.assert_allclose(found.body, np.arctan(0.25), rtol=1e-15)
    np.testing.assert_allclose(found.space, np.pi / 4 - np.arctan(0.25), rtol=1e-15)
    np.testing.assert_allclose(found.precession, np.sqrt(2), rtol=1e-15)
    np.testing.assert_allclose(found.spin, [3.0, -3.0], rtol=1e-15)


def test_steady_precession_without_weight_and_the_other_way_round() -> None:
    """Without weight the slow rate is none and the fast one I3 ω3/(I1 cos θ); a spin reversed reverses both."""
    free = steady_precession(2.0, 3.0, [0.0, 0.0], np.pi / 3, [4.0, -4.0])
    np.testing.assert_allclose(free.slow, [0.0, 0.0], atol=0)
    assert steady_precession(2.0, 3.0, 0.0, np.pi / 3, 0.0) == (0.0, 0.0)
    np.testing.assert_allclose(free.fast, [12.0, -12.0], rtol=1e-15)
    # 2·½·x² - 3·5·x + 14 = 0: x = 1 and 14
    heavy = steady_precession(2.0, 3.0, 14.0, np.pi / 3, [5.0, -5.0])
    np.testing.assert_allclose(heavy.slow, [1.0, -1.0], rtol=2e-15)
    np.testing.assert_allclose(heavy.fast, [14.0, -14.0], rtol=2e-15)
    assert sleeping_threshold(2.0, 3.0, 4.5) == 2.0


def test_a_tetrahedron_far_from_the_origin() -> None:
    """Of volume 1/6, ∫x² = 1/60 and ∫xy = 1/120 from its corner: 1/160 and −1/480 from its centre."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) + [8.0, 16.0, -32.0]
    mass, center, inertia = mesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], density=12.0)
    assert mass == pytest.approx(2.0, rel=1e-14)
    np.testing.assert_allclose(center, [8.25, 16.25, -31.75], rtol=1e-15)
    np.testing.assert_allclose(products(inertia), [-0.025] * 3, rtol=1e-13)
    np.testing.assert_allclose(inertia.diagonal(), [0.15] * 3, rtol=1e-13)


@pytest.mark.parametrize(
    ("shape", "dimensions", "moments", "measure"),
    [
        ("box", {"width": 2, "height": 3, "depth": 4}, (25 / 12, 20 / 12, 13 / 12), 24),
        ("plate", {"width": 2, "height": 3}, (9 / 12, 4 / 12, 13 / 12), 6),
        ("rod", {"length": 3}, (9 / 12, 9 / 12, 0), 3),
        ("cylinder", {"radius": 2, "length": 3}, (1.75, 1.75, 2), 12 * np.pi),
        ("cone", {"radius": 2, "length": 3}, (0.9375, 0.9375, 1.2), 4 * np.pi),
        ("tube", {"radius": 3, "inner_radius": 2, "length": 6}, (6.25, 6.25, 6.5), 30 * np.pi),
        ("disk", {"radius": 2}, (1, 1, 2), 4 * np.pi),
        ("ring", {"radius": 2}, (2, 2, 4), 4 * np.pi),
        ("sphere", {"radius": 2, "inner_radius": 1}, (12.4 / 7,) * 3, 28 / 3 * np.pi),
        ("sphere", {"radius": 2}, (1.6,) * 3, 32 / 3 * np.pi),
        ("arc", {"radius": 2, "angle": np.pi}, (2, 2 - 16 / np.pi**2, 4 - 16 / np.pi**2), 2 * np.pi),
    ],
)
def test_shapes_without_a_length_of_one(shape: str, dimensions, moments, measure: float) -> None:
    """The tables' formulas with numbers whose powers all differ, for 3 kg."""
    np.testing.assert_allclose(
        inertia_of(shape, 3.0, **dimensions), 3.0 * np.diag(moments), rtol=1e-15, atol=1e-15
    )
    found, thin = measure_of(shape, **dimensions)
    assert found == pytest.approx(measure, rel=1e-15)
    assert thin == {"plate": 2, "disk": 2, "rod": 1, "ring": 1, "arc": 1}.get(shape, 3)


def test_a_dimension_of_zero_is_none_but_a_bore_may_be() -> None:
    for shape, dimensions in (("rod", {"length": 0}), ("box", {"width": 1, "height": 0, "depth": 1})):
        with pytest.raises(ValueError, match="positive"):
            inertia_of(shape, 1.0, **dimensions)
    with pytest.raises(ValueError, match="positive"):
        inertia_of("disk", 1.0, radius=[1.0, -1.0])
    solid = inertia_of("cylinder", 1.0, radius=2, length=3)
    np.testing.assert_allclose(inertia_of("tube", 1.0, radius=2, inner_radius=0, length=3), solid, rtol=1e-15)
