"""Limits of masses and residuals, least squares and minimax: against clarabel, and every answer with its proof."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from balancing import (
    Balance,
    DependentPlanes,
    Infeasible,
    NotConverged,
    least_squares,
    minimax,
)
from balancing.objective import Objective
from tests.balancing.measured import balance, fitted
from tests.balancing.referee import least_squares_by_clarabel, minimax_by_clarabel

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def noise(rng: np.random.Generator, *shape: int) -> Complex:
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


def problem(
    rng: np.random.Generator,
    readings: int,
    planes: int,
    *,
    kappa: float = 1.0,
    doubled: int = 0,
    scales: float = 0,
) -> tuple[Complex, Complex, Real]:
    """Coefficients, vibration and limits of masses that hold some planes: sensors doubled, units 10^±scales, condition κ."""
    a, v = noise(rng, readings, planes), noise(rng, readings)
    if kappa > 1:
        a = (
            np.linalg.qr(a)[0]
            * np.geomspace(1, 1 / kappa, planes)
            @ np.linalg.qr(noise(rng, planes, planes))[0]
        )
    if doubled:
        a[-doubled:], v[-doubled:] = a[:doubled], v[:doubled]
    limit = rng.uniform(0.2, 1.1) * np.abs(least_squares(a, v).corrections)
    by_plane, by_sensor = (
        10 ** rng.uniform(-scales, scales, planes),
        10 ** rng.uniform(-scales, scales, readings),
    )
    return a * by_plane * by_sensor[:, None], v * by_sensor, limit / by_plane


def largest(a: Complex, v: Complex, w: Complex) -> float:
    return float(np.abs(v + a @ w).max())


def squares(a: Complex, v: Complex, w: Complex) -> float:
    return float(np.square(np.abs(v + a @ w)).sum())


def proven(fix: Balance) -> None:
    """What is left lies on its dual bound, and no mass above its limit by one unit of the last place."""
    value = (
        float(fix.residual_max) if fix.of_largest else squares(fix.influence, fix.initial, fix.corrections)
    )
    assert fix.bound is not None
    assert fix.gap <= 1e-12
    assert -1e-14 <= (value - fix.bound) / value < 1e-12
    if fix.max_mass is not None:
        assert (np.abs(fix.corrections) <= fix.max_mass).all()


def against_the_referee(a: Complex, v: Complex, limit: Real) -> None:
    fix = minimax(a, v, limit)
    proven(fix)
    w, status = minimax_by_clarabel(a, v, limit)
    if status == "Solved":
        assert float(fix.residual_max) == pytest.approx(largest(a, v, w), rel=1e-6)
    fix = least_squares(a, v, max_mass=limit)
    proven(fix)
    ceiling = 0.5 * (float(fix.residual_max) + float(minimax(a, v, limit).residual_max))
    within = least_squares(a, v, max_mass=limit, max_residual=ceiling)
    proven(within)
    assert within.residual_max <= ceiling
    for mine, top in ((fix, np.inf), (within, ceiling)):
        w, status = least_squares_by_clarabel(a, v, limit, np.full(len(v), top))
        if status == "Solved":
            assert squares(a, v, mine.corrections) == pytest.approx(squares(a, v, w), rel=1e-6)


@pytest.mark.parametrize(
    ("readings", "doubled", "scales"), [(24, 8, 0), (24, 4, 4), (24, 0, 0), (100, 30, 0), (200, 0, 0)]
)
def test_against_clarabel(readings: int, doubled: int, scales: float) -> None:
    rng = np.random.default_rng(readings + doubled)
    if scales:
        # a conic solver of eight digits does not see sensors of 1e-4 beside ones of 1e4: the proof does
        a, v, limit = problem(rng, readings, 8, doubled=doubled, scales=scales)
        proven(minimax(a, v, limit))
        proven(least_squares(a, v, max_mass=limit))
        return
    against_the_referee(*problem(rng, readings, 8, doubled=doubled))


def test_a_ceiling_that_can_be_met_is_met_and_the_smallest_is_named() -> None:
    rng = np.random.default_rng(9)
    for _ in range(2):
        a, v, limit = problem(rng, 12, 3, doubled=3)
        least = float(minimax(a, v, limit).residual_max)
        for factor in (1 + 1e-7, 1 + 1e-5, 1.001, 1.05):
            fix = least_squares(a, v, max_mass=limit, max_residual=least * factor)
            assert fix.residual_max <= least * factor
            assert (np.abs(fix.corrections) <= limit).all()
            assert fix.gap <= 1e-9
        for factor in (0.5, 0.97, 1 - 1e-6):
            with pytest.raises(Infeasible) as caught:
                least_squares(a, v, max_mass=limit, max_residual=least * factor)
            assert caught.value.smallest == pytest.approx(least, rel=1e-11)
            # as it is printed it can be met
            named = float(caught.value.rounded_up)
            assert least_squares(a, v, max_mass=limit, max_residual=named).residual_max <= named


def test_limits_that_differ_are_named_by_a_factor() -> None:
    top = np.array([0.1, 0.2, 0.4])
    least = minimax([[3 / 0.1, -2 / 0.1], [5 / 0.2, -2 / 0.2], [5 / 0.4, -3 / 0.4]], [10, -5, 0])
    with pytest.raises(Infeasible, match="times as large") as caught:
        least_squares([[3, -2], [5, -2], [5, -3]], [1, -1, 0], max_residual=top)
    assert caught.value.factor == pytest.approx(float(least.residual_max), rel=1e-12)
    again = least_squares(
        [[3, -2], [5, -2], [5, -3]], [1, -1, 0], max_residual=top * caught.value.factor * 1.001
    )
    assert (np.abs(again.residual) <= top * caught.value.factor * 1.001).all()


@pytest.mark.parametrize("objective", ["minimax", "least squares"])
def test_one_sensor_one_plane(objective: str) -> None:
    """|V| = 5, a unit mass takes 2: with 1 kg there is 3 left, with 0.25 kg 4.5, and its mirror image the same."""
    for v in (5.0, -5.0, 5j, 3 + 4j, 3 - 4j):
        for limit, left in ((1.0, 3.0), (0.25, 4.5), (2.5, 0.0), (9.0, 0.0)):
            fix = (
                minimax([[2]], [v], limit)
                if objective == "minimax"
                else least_squares([[2]], [v], max_mass=limit)
            )
            assert abs(fix.corrections[0]) <= limit
            assert float(fix.residual_max) == pytest.approx(left, rel=1e-14, abs=1e-14)
            assert fix.corrections[0] == pytest.approx(-v / abs(v) * min(limit, 2.5), rel=1e-14)


@pytest.mark.parametrize("power", [-4, 4])
def test_units_change_neither_answer_nor_proof(power: int) -> None:
    a, v, limit = problem(np.random.default_rng(3), 24, 6)
    unit = 10.0**power
    for solve in (lambda *p: minimax(*p), lambda a, v, m: least_squares(a, v, max_mass=m)):
        here, there = solve(a, v, limit), solve(a * unit, v, limit / unit)
        proven(there)
        assert there.corrections * unit == pytest.approx(here.corrections, rel=1e-9)


def test_nearly_dependent_planes_are_right_or_refused_by_name() -> None:
    rng, refused = np.random.default_rng(11), {1e99: "nearly dependent (condition number"}
    for kappa in (1e5, 1e6, 1e7, 1e8, 1e9, 1e10):
        a, v, limit = problem(rng, 24, 5, kappa=kappa)
        for solve in (lambda a, v, m: minimax(a, v, m), lambda a, v, m: least_squares(a, v, max_mass=m)):
            try:
                fix = solve(a, v, limit)
            except NotConverged as error:
                refused[kappa] = str(error)
                continue
            assert fix.gap <= 1e-16 * kappa + 1e-12
            assert (np.abs(fix.corrections) <= limit).all()
            # what clipping each plane by itself broke: more than without any masses
            assert squares(a, v, fix.corrections) < squares(a, v, 0 * fix.corrections) or fix.of_largest
            assert fix.residual_max <= np.abs(v).max() or not fix.of_largest
    assert min(refused) > 1e8
    assert all("nearly dependent (condition number" in text for text in refused.values())


def test_a_gap_that_rounding_leaves_open_is_refused() -> None:
    """The best doubles for masses of 1e9 kg leave some 1e-7 more than the optimum: once an answer with a warning."""
    a, v, limit = problem(np.random.default_rng(19), 24, 5, kappa=1e10)
    with pytest.raises(NotConverged, match=r"nearly dependent \(condition number") as caught:
        minimax(a, v, limit)
    assert 1e-9 < caught.value.gap < 1e-6


@pytest.mark.parametrize(("seed", "size"), [(5, 2), (68, 2), (10, 3), (90, 3)])
def test_one_sensor_in_a_unit_a_million_times_as_small(seed: int, size: int) -> None:
    """The masses missed their limits by 1e-12, and shortened by that they turned the large reading: refused with gaps to 2e-4."""
    rng = np.random.default_rng(seed)
    a, v = noise(rng, size, size), noise(rng, size)
    limit = 0.9 * np.abs(np.linalg.solve(a, v))
    unit = np.ones(size)
    unit[0] = 1e6
    fix = minimax(a * unit[:, None], v * unit, limit)
    assert fix.gap <= 1e-12
    assert (np.abs(fix.corrections) <= limit).all()


@pytest.mark.parametrize("seed", [1, 82, 113, 155, 348])
def test_eight_sensors_in_units_far_apart(seed: int) -> None:
    """Independent planes, in units to 1e8 apart: refused once, as "nearly dependent"."""
    a, v, limit = problem(np.random.default_rng(seed), 8, 8, scales=4)
    assert minimax(a, v, limit).gap <= 1e-9


def test_units_that_are_too_far_apart_are_the_reason() -> None:
    rng = np.random.default_rng(1)
    a, v = noise(rng, 2, 2), noise(rng, 2)
    unit = np.array([1e12, 1])
    with pytest.raises(NotConverged, match=r"respond to the masses in sizes 6\.8e\+11 times apart") as caught:
        minimax(a * unit[:, None], v * unit, 0.9 * np.abs(np.linalg.solve(a, v)))
    assert caught.value.condition < 10


def test_a_condition_of_1e10_is_solved_or_refused() -> None:
    """Once answered with a gap of 4e-9."""
    one = next(islice(drawn(499987952), 173, None))
    assert one is not None
    try:
        gap, is_returned = minimax(one.a, one.v, one.limit).gap, True
    except NotConverged as error:
        gap, is_returned = error.gap, False
    assert gap < 1e-7
    assert is_returned == (gap <= 1e-9)


@pytest.mark.parametrize(("seed", "case"), [(499987952, 276), (499987952, 116)])
def test_units_far_apart_are_solved_to_the_end(seed: int, case: int) -> None:
    """Conditions of 5e7 and more by units: the first was answered with a gap of 5e-7, the second refused."""
    one = next(islice(drawn(seed), case, None))
    assert one is not None
    assert minimax(one.a, one.v, one.limit).gap <= 1e-12


@pytest.mark.parametrize(("seed", "case"), [(918098262, 129), (918098262, 120), (918098261, 246)])
def test_nearly_dependent_planes_are_solved_to_the_end(seed: int, case: int) -> None:
    """Conditions of 3e6 to 7e7, gaps of 1e-9 to 3e-8 once.

    The first held both planes at limits of which one holds; the bound of the others was rounded with its forces.
    """
    one = next(islice(drawn(seed), case, None))
    assert one is not None
    assert minimax(one.a, one.v, one.limit).gap <= 1e-12


@pytest.mark.parametrize("above", [0, 1e-15, 1e-12, 1e-10, 1e-9, 3e-9])
def test_the_smallest_limit_leaves_the_minimax_corrections(above: float) -> None:
    """Goodman's data: 0.4 can be met by 1 and 1.8 alone. The squares once had any gap there."""
    fix = least_squares([[3, -2], [5, -2], [5, -3]], [1, -1, 0], max_residual=0.4 * (1 + above))
    assert fix.corrections == pytest.approx([1, 1.8], rel=1e-14)
    assert fix.of_largest
    assert fix.gap <= 1e-12
    assert fix.bound is not None
    assert fix.bound * 0.4 * (1 + above) == pytest.approx(0.4, rel=1e-12)


def test_a_doubled_sensor_has_digits() -> None:
    """The corrections of a problem with a sensor read twice are as sure as without it."""
    rng = np.random.default_rng(5)
    a, v, limit = problem(rng, 12, 3, doubled=6)
    for fix in (minimax(a, v, limit), least_squares(a, v, max_mass=limit)):
        assert fix.error_reason == ""
        assert (fix.error_estimate() < 1e-11 * np.abs(fix.corrections)).all()
    top = 1.02 * float(minimax(a, v).residual_max)
    assert least_squares(a, v, max_residual=top).error_reason == ""


@pytest.mark.parametrize(
    "objective",
    [
        "ceiling",
        pytest.param("minimax", marks=pytest.mark.slow),
        pytest.param("least-squares", marks=pytest.mark.slow),
    ],
)
def test_uncertainties_under_limits_are_those_of_repeated_measurements(objective: str) -> None:
    """The drawn scatter of the corrections against that of measuring anew: the variances of two samples of 60 differ by a quarter."""
    rng = np.random.default_rng(1)
    a, v, limit = problem(rng, 6, 2)
    top = 1.1 * float(minimax(a, v, limit).residual_max) if objective == "ceiling" else None
    limits = Objective(objective == "minimax", limit, top)

    def solved(v: Complex) -> Complex:
        if objective == "minimax":
            return minimax(a, v, limit).corrections
        try:
            return least_squares(a, v, max_mass=limit, max_residual=top).corrections
        except Infeasible:
            return minimax(a, v, limit).corrections

    w = solved(v)
    read = balance(fitted(v, influence=a), (0.02, np.radians(2)), w)
    drawn, _ = limits.confidence(read, w, 0 * w, 60)
    turn = (1 + 0.02 * rng.normal(size=(60, 6))) * np.exp(1j * np.radians(2) * rng.normal(size=(60, 6)))
    anew = np.array([solved(v * one) for one in turn]) - w
    total = float(np.square(np.abs(anew)).sum(axis=1).mean())
    assert total == pytest.approx(float(np.trace(drawn, axis1=1, axis2=2).sum()), rel=0.6)


class Drawn(NamedTuple):
    """A problem of the campaign, and by which factors of the smallest largest residual its ceilings differ from it."""

    a: Complex
    v: Complex
    limit: Real
    kappa: float
    above: float
    below: float


def drawn(seed: int) -> Iterator[Drawn | None]:
    """Rows to 200, doubled sensors, units 1e±4, conditions to 1e10; None where planes are dependent."""
    rng = np.random.default_rng(seed)
    while True:
        readings = int(rng.choice([3, 8, 24, 24, 24, 100, 200]))
        planes = int(rng.integers(1, min(9, readings) + 1))
        kappa = 10 ** rng.uniform(0, 10) if rng.random() < 0.3 and planes > 1 else 1.0
        doubled = int(rng.integers(readings // 2 + 1)) if rng.random() < 0.3 else 0
        try:
            a, v, limit = problem(
                rng, readings, planes, kappa=kappa, doubled=doubled, scales=rng.choice([0, 0, 1, 4])
            )
        except DependentPlanes:
            yield None
            continue
        if rng.random() < 0.3:
            limit = np.full(planes, np.inf)
        factors = 0.0, 0.0
        if kappa == 1 and readings > planes:
            factors = 10 ** rng.uniform(-6, 0), rng.uniform(0.3, 0.999)
        yield Drawn(a, v, limit, kappa, *factors)


def holds(one: Drawn) -> bool:
    """Whether there is an answer within a ceiling; every answer is proven, or is refused for its condition."""
    a, v, limit = one[:3]
    for solve in (minimax, lambda a, v, m: least_squares(a, v, max_mass=m)):
        try:
            fix = solve(a, v, limit)
        except (NotConverged, DependentPlanes):
            assert np.linalg.cond(a) > 1e7
            continue
        floor = 1e-15 * (np.abs(v) + np.abs(a) @ np.abs(fix.corrections)).max() / fix.residual_max
        assert fix.gap <= 1e-12 + 10 * floor
        assert (np.abs(fix.corrections) <= limit).all()
    if not one.above:
        return True
    best = minimax(a, v, limit)
    least = float(best.residual_max)
    if least < 1e-14 * (np.abs(v) + np.abs(a) @ np.abs(best.corrections)).max():
        # the rounding of nothing is no ceiling
        return True
    top = least * (1 + one.above)
    try:
        within = least_squares(a, v, max_mass=limit, max_residual=top)
    except NotConverged:
        assert np.linalg.cond(a) > 1e7
        return False
    assert within.residual_max <= top
    with pytest.raises(Infeasible) as caught:
        least_squares(a, v, max_mass=limit, max_residual=least * one.below)
    assert caught.value.smallest == pytest.approx(least, rel=1e-9)
    assert within.gap <= 1e-9
    return True


@pytest.mark.slow
def test_campaign(first_seed: int) -> None:
    """Proven, or refused where rounding decides."""
    refused = 0
    for case, one in enumerate(islice(drawn(first_seed), 400)):
        print(f"case {case}")
        refused += one is not None and not holds(one)
    # next to what cannot be met, in units far apart: it is rare
    assert refused <= 4


def test_a_ceiling_next_to_the_smallest_in_units_far_apart() -> None:
    """Case 95 of seed 777001: condition 8e10 by units, a ceiling 2e-6 above the smallest: once refused for its rounding.

    The masses' rounding is 1e-10 of the ceiling in one row that hardly pulls: only that row keeps away from its limit.
    """
    one = next(islice(drawn(777001), 95, None))
    assert one is not None
    least = float(minimax(one.a, one.v, one.limit).residual_max)
    top = least * (1 + one.above)
    fix = least_squares(one.a, one.v, max_mass=one.limit, max_residual=top)
    assert fix.gap <= 1e-9
    assert fix.residual_max <= top


def test_large_masses_that_leave_little() -> None:
    """Case 84 of seed 100019: masses of 3e6 leave 0.009, one 3e-10 below its limit: once refused with a gap of 1e-3."""
    one = next(islice(drawn(100019), 84, None))
    assert one is not None
    assert holds(one)
    assert minimax(one.a, one.v, one.limit).gap <= 1e-12


@pytest.mark.parametrize(("seed", "case"), [(100014, 156), (100056, 39), (100057, 119)])
def test_a_ceiling_next_to_the_smallest_in_like_units(seed: int, case: int) -> None:
    """Ceilings 1.5e-6 to 1.6e-5 above the smallest, whose multipliers are large: two were refused, one was doubtful."""
    one = next(islice(drawn(seed), case, None))
    assert one is not None
    top = float(minimax(one.a, one.v).residual_max) * (1 + one.above)
    fix = least_squares(one.a, one.v, max_residual=top)
    assert fix.gap <= 1e-11
    assert fix.residual_max <= top


def test_masses_at_their_limits_that_leave_little_of_one_row() -> None:
    """Case 371 of seed 100014: right to 1e-15, but proven to 1.7e-7 only, by forces that the masses' rounding had changed."""
    one = next(islice(drawn(100014), 371, None))
    assert one is not None
    assert holds(one)
    assert least_squares(one.a, one.v, max_mass=one.limit).gap <= 1e-12


def test_a_ceiling_that_hardly_leaves_a_choice_in_units_far_apart() -> None:
    """Case 221 of seed 77: condition 3e8, a ceiling 3e-6 above the smallest: once refused, then proven to some 1e-8."""
    one = next(islice(drawn(77), 221, None))
    assert one is not None
    assert holds(one)
    fix = least_squares(
        one.a,
        one.v,
        max_residual=float(minimax(one.a, one.v).residual_max) * (1 + one.above),
    )
    assert fix.gap < 1e-9


@pytest.mark.parametrize("power", [-12, 12])
def test_a_ceiling_in_any_unit(power: int) -> None:
    """The squares of residuals in 1e±12 beside limits in their own units: once refused with a gap of 20 %."""
    a, v, _ = problem(np.random.default_rng(6), 7, 3)
    unit = 10.0**power
    top = 1.05 * float(minimax(a, v).residual_max)
    here = least_squares(a, v, max_residual=top)
    there = least_squares(a * unit, v * unit, max_residual=top * unit)
    proven(there)
    assert there.corrections == pytest.approx(here.corrections, rel=1e-9)
