"""Corrections against exact rational arithmetic, and the properties they must have."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from balancing import CoincidentPlanes, by_size, correct
from benchmarks.truth.rotors import exact_corrections as exact

Complex = NDArray[np.complex128]


def relative_error(found: Complex, true: list[tuple[Fraction, Fraction]]) -> float:
    worst = 0.0
    for w, (x, y) in zip(found.tolist(), true, strict=True):
        error = (Fraction(w.real) - x) ** 2 + (Fraction(w.imag) - y) ** 2
        size = x**2 + y**2
        worst = max(worst, math.sqrt(error / size) if size else float(error > 0))
    return worst


@pytest.mark.parametrize("planes", [1, 2, 3, 7])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_random_rotors_against_rational_arithmetic(planes: int, scale: float) -> None:
    rng = np.random.default_rng(20)
    for masses in (1, 2, 5, 40):
        for _ in range(10):
            u = scale * (rng.normal(size=masses) + 1j * rng.normal(size=masses))
            z = scale * rng.uniform(-1, 2, masses)
            p = scale * rng.uniform(-0.5, 1.5, planes)
            fix = correct(u, z, p)
            # with more than two planes the sum over q may cancel for one plane: its error is against the largest
            true = exact(u, z, p)
            if planes <= 2:
                assert relative_error(fix.unbalance, true) <= 1e-14
            largest = max(math.hypot(*map(float, w)) for w in true)
            for w, (x, y) in zip(fix.unbalance.tolist(), true, strict=True):
                assert math.hypot(Fraction(w.real) - x, Fraction(w.imag) - y) <= 2e-14 * largest


@pytest.mark.parametrize("planes", [1, 2, 3, 6])
def test_the_error_estimate_bounds_the_error_and_is_not_idle(planes: int) -> None:
    rng = np.random.default_rng(31)
    ratios = []
    for _ in range(150):
        k = int(rng.integers(1, 12))
        u = (rng.normal(size=k) + 1j * rng.normal(size=k)) * 10.0 ** rng.uniform(-6, 6)
        z, p = rng.uniform(-1, 2, k), rng.uniform(0, 1, planes) * 10.0 ** rng.uniform(-4, 0)
        fix = correct(u, z, p)
        for w, (x, y), bound in zip(
            fix.unbalance.tolist(), exact(u, z, p), fix.error_estimate(), strict=True
        ):
            ratios.append(math.hypot(Fraction(w.real) - x, Fraction(w.imag) - y) / bound)
    assert max(ratios) <= 1
    assert np.median(ratios) >= 0.01


def test_a_nearly_balanced_rotor_keeps_its_digits() -> None:
    """10⁶ masses cancel to 1e-15 of their sum; the naive sum has lost everything by then."""
    rng = np.random.default_rng(4)
    half = rng.normal(size=500_000) + 1j * rng.normal(size=500_000)
    rest = 1e-12 * (1 + 2j)
    u = rng.permutation(np.concatenate([half, -half, [rest]]))
    assert abs(u.sum() - rest) > 1e-2 * abs(rest)
    assert correct(u).static == rest
    # the moments about both planes too: equal and opposite masses in one place each
    z = np.full(u.shape, 0.3)
    fix = correct(u, z, [0.0, 1.0])
    np.testing.assert_allclose(fix.unbalance, [-0.7 * rest, -0.3 * rest], rtol=1e-15)


def test_the_sum_of_a_million_masses_is_exactly_rounded_or_nearly() -> None:
    rng = np.random.default_rng(5)
    u = rng.normal(size=1_000_000) * 10.0 ** rng.uniform(-6, 6, 1_000_000)
    u -= u.mean()
    found = correct(u.astype(complex)).static.real
    assert abs(found - math.fsum(u)) <= 5e-16 * abs(math.fsum(u))


amounts = st.floats(-1e3, 1e3).filter(lambda x: x == 0 or abs(x) > 1e-6)
rotors = st.lists(st.tuples(amounts, amounts, st.floats(-2, 3)), min_size=1, max_size=12)
plane_places = st.lists(st.integers(-40, 60), min_size=1, max_size=5, unique=True).map(
    lambda p: np.array(p) / 20
)


def arrays(rotor: list[tuple[float, float, float]]) -> tuple[Complex, NDArray[np.float64]]:
    x, y, z = np.array(rotor).T
    return x + 1j * y, z


@settings(max_examples=150, deadline=None)
@given(rotors, plane_places)
def test_corrections_leave_nothing(
    rotor: list[tuple[float, float, float]], planes: NDArray[np.float64]
) -> None:
    u, z = arrays(rotor)
    fix = correct(u, z, planes)
    whole = np.abs(u).sum() + np.abs(fix.unbalance).sum()
    assert abs(fix.residual.static) <= 4e-16 * len(planes) * whole
    if len(planes) > 1:
        assert abs(fix.residual.couple) <= 2e-15 * len(planes) * whole * 4
        # the least norm is orthogonal to every change that keeps balance
        if len(planes) > 2:
            free = np.linalg.svd(np.stack([np.ones_like(planes), planes]))[2][2:]
            assert np.abs(free @ fix.unbalance).max() <= 1e-13 * whole * 40


@settings(max_examples=100, deadline=None)
@given(rotors, plane_places, st.floats(0, 6.28), st.floats(1e-9, 1e9), st.randoms())
def test_rotation_scale_and_order(
    rotor: list[tuple[float, float, float]],
    planes: NDArray[np.float64],
    turn: float,
    scale: float,
    random: object,
) -> None:
    u, z = arrays(rotor)
    base = correct(u, z, planes).unbalance
    size = np.abs(u).sum() * correct(u, z, planes).amplification + 1e-300
    spin = np.exp(1j * turn)
    assert np.abs(correct(u * spin, z, planes).unbalance - base * spin).max() <= 2e-14 * size
    assert np.abs(correct(u * scale, z, planes).unbalance / scale - base).max() <= 2e-14 * size
    assert np.abs(correct(u, z * scale, planes * scale).unbalance - base).max() <= 1e-13 * size
    order = np.arange(len(u))
    random.shuffle(order)  # type: ignore[attr-defined]
    assert np.abs(correct(u[order], z[order], planes).unbalance - base).max() <= 1e-15 * size


@settings(max_examples=100, deadline=None)
@given(rotors, rotors, plane_places)
def test_superposition(
    one: list[tuple[float, float, float]],
    other: list[tuple[float, float, float]],
    planes: NDArray[np.float64],
) -> None:
    u1, z1 = arrays(one)
    u2, z2 = arrays(other)
    both = correct(np.append(u1, u2), np.append(z1, z2), planes)
    apart = correct(u1, z1, planes).unbalance + correct(u2, z2, planes).unbalance
    size = (np.abs(u1).sum() + np.abs(u2).sum()) * both.amplification + 1e-300
    assert np.abs(both.unbalance - apart).max() <= 1e-13 * size


def test_powers_of_two_change_no_digit() -> None:
    rng = np.random.default_rng(8)
    u = rng.normal(size=9) + 1j * rng.normal(size=9)
    z, planes = rng.uniform(0, 1, 9), np.array([0.1, 0.8])
    base = correct(u, z, planes).unbalance
    for exponent in (-60, 60):
        assert (correct(u * 2.0**exponent, z, planes).unbalance == base * 2.0**exponent).all()
        assert (correct(u, z * 2.0**exponent, planes * 2.0**exponent).unbalance == base).all()


def test_batches_are_the_same_as_one_by_one() -> None:
    rng = np.random.default_rng(9)
    u = rng.normal(size=(4, 3, 5)) + 1j * rng.normal(size=(4, 3, 5))
    z = rng.uniform(0, 1, (4, 3, 5))
    planes = rng.uniform(0, 1, (3, 2))
    fix = correct(u, z, planes)
    assert fix.unbalance.shape == (4, 3, 2)
    for i in range(4):
        for j in range(3):
            one = correct(u[i, j], z[i, j], planes[j])
            np.testing.assert_allclose(fix.unbalance[i, j], one.unbalance, rtol=1e-15)
            np.testing.assert_allclose(fix.amplification[i, j], one.amplification, rtol=1e-15)
            np.testing.assert_allclose(fix.couple(0.5)[i, j], one.couple(0.5), rtol=1e-15)
            made = one.unbalance * 1.1
            np.testing.assert_allclose(
                fix.residual_of(fix.unbalance * 1.1).couple[i, j], one.residual_of(made).couple, rtol=1e-12
            )


def test_amplification_is_the_growth_of_an_error() -> None:
    assert correct([1, 1], [0.0, 1.0], [0.0, 1.0]).amplification == pytest.approx(1)
    assert correct([1], [0.5], [0.0, 1.0]).amplification == pytest.approx(1)
    # Xie: a unit at 0.1 L, planes at 0.4 L and 0.6 L: -2.5 and 1.5
    assert correct([1], [0.1], [0.4, 0.6]).amplification == pytest.approx(4)
    assert correct([1], [5.0], [0.0, 1e-6]).amplification == pytest.approx(1e7, rel=1e-6)
    assert correct([0], [5.0], [0.0, 1e-6]).amplification == pytest.approx(1)


def test_rounded_corrections_leave_what_they_leave() -> None:
    u, z, planes = np.array([1.0 + 0j, 2j]), np.array([0.1, 0.7]), np.array([0.0, 1.0])
    fix = correct(u, z, planes)
    made = np.round(fix.unbalance * 4) / 4
    left = fix.residual_of(made, about=0.25)
    assert left.static == pytest.approx(u.sum() + made.sum(), rel=1e-14)
    assert left.couple == pytest.approx((u * (z - 0.25)).sum() + (made * (planes - 0.25)).sum(), rel=1e-14)


def test_planes_at_one_place_are_said_so() -> None:
    with pytest.raises(CoincidentPlanes, match="same place"):
        correct([1], [0.2], [0.5, 0.5])
    with pytest.raises(CoincidentPlanes) as caught:
        correct([[1], [1]], [[0.2], [0.3]], [[0.0, 1.0], [0.5, 0.5]])
    assert caught.value.rotors.tolist() == [False, True]
    with pytest.raises(ValueError, match="finite"):
        correct([math.nan], [0.2], [0.5])


def test_nothing_gives_nothing() -> None:
    fix = correct([0, 0], [0.2, 0.3], [0.0, 1.0])
    assert (fix.unbalance == 0).all()
    assert (fix.angle == 0).all()
    assert fix.residual.static == 0


def test_results_show_themselves() -> None:
    fix = correct([[1, 2], [1j, 2]], [0.2, 0.3], [0.0, 1.0])
    frame = fix.to_frame()
    assert list(frame.columns) == ["z_m", "unbalance_kg_m", "angle_deg"]
    assert len(frame) == 4
    assert "<table" in fix._repr_html_()
    assert "2 rotors in 2 plane" in repr(fix)
    with pytest.raises(AttributeError):
        fix.moment = 3  # type: ignore[misc,assignment]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 30), min_size=1, max_size=300))
def test_by_size_holds_every_mass_once(numbers: list[int]) -> None:
    _, rotor = np.unique(numbers, return_inverse=True)
    seen = []
    for rotors, masses in by_size(rotor):
        for r, row in zip(rotors, masses, strict=True):
            mine = row[row >= 0]
            assert (rotor[mine] == r).all()
            assert len(row) < 2 * len(mine)
            assert (np.diff(mine) > 0).all()
            seen += mine.tolist()
    assert sorted(seen) == list(range(len(numbers)))


def test_the_couple_about_the_masses_own_place_is_zero() -> None:
    """Σ U z - z Σ U cancels to the last of the doubled digits, wherever the plane lies."""
    rng = np.random.default_rng(12)
    for place in (0.1, 1 / 3, 1e5 / 7):
        u = rng.normal(size=7) + 1j * rng.normal(size=7)
        fix = correct(u, place, [0.0, 1.0])
        assert abs(fix.couple(place)) <= 1e-30 * np.abs(u).sum() * place
        # and a plane a little off sees the lever alone
        off = place * (1 + 1e-12)
        lever = float(Fraction(place) - Fraction(off))
        assert abs(fix.couple(off) / (fix.static * lever) - 1) <= 1e-15
        # a mass in plane A leaves nothing to plane B
        assert np.abs(correct(u, place, [place, place + 1]).unbalance[1]) <= 1e-30 * np.abs(u).sum() * place


def test_rotors_with_planes_of_their_own() -> None:
    planes = np.array([[0.0, 1.0], [0.0, 2.0], [-1.0, 1.0]])
    fix = correct([1.0, 2.0], [0.5, 0.25], planes)
    assert fix.unbalance.shape == (3, 2)
    np.testing.assert_allclose(fix.unbalance[:, 1].real, [-1.0, -0.5, -(1.5 + 2.5) / 2], rtol=1e-15)
    assert correct([[1.0], [2.0]], 0.0, [0.0]).unbalance.tolist() == [[-1], [-2]]
    assert "1 rotor in 2 plane(s)" in repr(correct([1.0], 0.5, [0.0, 1.0]))


def test_every_public_name_is_there() -> None:
    import balancing

    assert set(balancing.__all__) == set(" ".join(balancing._HOMES.values()).split())
    assert all(
        callable(getattr(balancing, name)) or name in ("GRADES", "ZONE_BOUNDARIES")
        for name in balancing.__all__
    )
    with pytest.raises(AttributeError, match="no attribute 'imbalance'"):
        balancing.imbalance  # noqa: B018


def test_sizes_that_have_no_answer_are_refused() -> None:
    """They gave NaN, inf and a negative mass."""
    with pytest.raises(ValueError, match="too large"):
        correct([1e300, 1e300], [0, 1], [0, 1])
    with pytest.raises(ValueError, match="too large"):
        correct([1, 1], [0, 1e200], [0, 1e200])
    for radius in (0, -0.1, np.nan):
        with pytest.raises(ValueError, match="the radius must be positive"):
            correct([1, 1], [0, 1], [0, 1]).mass(radius)
