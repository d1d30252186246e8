"""Every result's bound of its own rounding error: above the true error, and not idle, where it matters."""

from __future__ import annotations

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from numpy.typing import NDArray

from balancing import (
    condition_number,
    correct,
    drill_depth,
    error_budget,
    influence_coefficients,
    influence_error,
    influence_from_amplitudes,
    least_squares,
    minimax,
    place,
    place_from_stock,
    trial_effect,
)
from benchmarks.stress.campaigns import replay
from benchmarks.stress.rotors import CAMPAIGNS as ROTORS
from benchmarks.stress.vibration import CAMPAIGNS as VIBRATION
from dalembert.arithmetic.doubled_arrays import Vectors

Complex = NDArray[np.complex128]


def noise(rng: np.random.Generator, *shape: int) -> Complex:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


@pytest.mark.parametrize(
    ("campaign", "seeds"),
    [
        ("least squares, near-dependent planes", (126, 182, 297)),
        ("least squares, wide scales", (2, 7, 224)),
        ("influence coefficients", (194, 215)),
        ("minimax", (128, 288)),
        # least squares under a residual limit that was searched from the wrong place
        ("limited masses and residuals", (14, 34, 121)),
        ("four runs", (5, 35)),
        ("placement", (150, 287)),
        ("phases at the wrap", (96, 205)),
    ],
)
def test_the_worst_of_the_campaigns(campaign: str, seeds: tuple[int, ...]) -> None:
    for seed in seeds:
        found = replay(campaign, seed)
        assert found
        assert all(error <= bound for error, bound in found), f"seed {seed}"


def test_a_trial_run_that_hardly_differs() -> None:
    """1 + 1e-13 and 1: exact readings leave all digits."""
    v0, v1, t = 3.0 + 1j, (3.0 + 1j) * (1 + 1e-13), 0.25
    true = (Fraction(v1.real) - Fraction(v0.real)) * 4, (Fraction(v1.imag) - Fraction(v0.imag)) * 4
    alpha = influence_coefficients([v0], [[v1]], [[t]])[0, 0]
    error = abs(complex(Fraction(alpha.real) - true[0], Fraction(alpha.imag) - true[1]))
    bound = influence_error([v0], [[v1]], [[t]])[0, 0]
    assert error <= bound < 1e-14 * abs(alpha)


def test_bounds_over_leading_axes() -> None:
    rng = np.random.default_rng(0)
    v0, v, t = noise(rng, 3, 1, 2), noise(rng, 3, 1, 4, 2), noise(rng, 5, 4, 3)
    many = influence_error(v0, v, t)
    assert many.shape == (3, 5, 2, 3)
    assert many[2, 4] == pytest.approx(influence_error(v0[2, 0], v[2, 0], t[4]), rel=1e-10)
    alpha, b = noise(rng, 3, 1, 6, 2), noise(rng, 5, 6)
    for kind in ({}, {"ridge": 0.1}, {"weights": rng.uniform(0.1, 1, 6)}):
        fix = least_squares(alpha, b, **kind)
        one = least_squares(alpha[2, 0], b[4], **kind)
        for quantity in ("corrections", "residual", "residual_max", "residual_rms"):
            bound = fix.error_estimate(quantity)
            # what is left of rounding itself is part of the bound: of another order of sums another rest
            assert bound[2, 4] == pytest.approx(one.error_estimate(quantity), rel=0.5)
    with pytest.raises(ValueError, match="expected corrections, residual"):
        fix.error_estimate("mass")


@pytest.mark.parametrize("apart", [1.0, 1e-4, 1e-8])
def test_two_nearly_dependent_planes(apart: float) -> None:
    rng = np.random.default_rng(1)
    alpha = noise(rng, 4, 2)
    alpha[:, 1] = alpha[:, 0] * (2 - 1j) + apart * alpha[:, 1]
    v = noise(rng, 4)
    fix = least_squares(alpha, v)
    with mp.workdps(60):
        a, b = mp.matrix(alpha.tolist()), mp.matrix(v.tolist())
        w = mp.lu_solve(a.H * a, -(a.H * b))
        left = b + a * w
        errors = [float(abs(mp.mpmathify(x) - y)) for x, y in zip(fix.corrections.tolist(), w, strict=True)]
        of_left = [float(abs(mp.mpmathify(x) - y)) for x, y in zip(fix.residual.tolist(), left, strict=True)]
        rms = mp.norm(left) / 2
        off = float(abs(fix.residual_rms - rms)), float(abs(fix.residual_max - max(map(abs, left))))
    bound = fix.error_estimate()
    assert (errors <= bound).all()
    assert (bound < 1e-13 * condition_number(alpha) ** 2 * np.abs(fix.corrections).max()).all()
    assert (of_left <= fix.error_estimate("residual")).all()
    assert off[0] <= fix.error_estimate("residual_rms")
    assert off[1] <= fix.error_estimate("residual_max")


def test_data_that_differ_from_their_floats() -> None:
    """The second run takes the data as they are: it leads from corrections of nearby numbers to theirs."""
    rng = np.random.default_rng(2)
    alpha, v = noise(rng, 6, 2), noise(rng, 6)
    share = 1e-7
    a = alpha * (1 + share * np.exp(2j * np.pi * rng.random(alpha.shape)))
    b = v * (1 + share * np.exp(2j * np.pi * rng.random(v.shape)))
    exact = Vectors.of(a), Vectors.of(b)
    for solve in (
        least_squares,
        minimax,
        lambda a, b: least_squares(a, b, max_mass=0.3),
        lambda a, b: least_squares(a, b, weights=np.arange(1.0, 7.0), ridge=0.2),
    ):
        fix, there = solve(alpha, v), solve(a, b)
        off = np.abs(there.corrections - fix.corrections)
        assert fix.error_estimate(exact=exact) == pytest.approx(off, rel=0.011, abs=1e-15)
        left = np.abs(there.residual - fix.residual)
        assert fix.error_estimate("residual", exact=exact) == pytest.approx(left, rel=0.011, abs=1e-14)


def test_minimax_has_bounds_where_its_optimum_is_one_point() -> None:
    fix = minimax([[3, -2], [5, -2], [5, -3]], [1, -1, 0])
    assert fix.error_reason == ""
    off = [abs(Fraction(w.real) - true) for w, true in zip(fix.corrections, (1, Fraction(9, 5)), strict=True)]
    assert (np.array(off, dtype=float) <= fix.error_estimate()).all()
    assert (fix.error_estimate() < 1e-13).all()
    assert abs(fix.residual_max - 0.4) <= fix.error_estimate("residual_max") < 1e-14


def test_and_says_why_where_it_is_not() -> None:
    # two planes that do the same, held by limits: any share between them is as good
    fix = minimax([[1, 1], [1, 1], [2, 2]], [1, 1j, -1], [0.4, 0.4])
    assert "not unique" in fix.error_reason
    assert np.isinf(fix.error_estimate()).all()
    assert fix.error_estimate("residual_max") < 1e-5
    # twelve readings at the edge, three are enough: more of them than hold the optimum
    polygon = minimax(np.ones((12, 1)), 2 + np.exp(2j * np.pi * np.arange(12) / 12))
    assert polygon.error_reason
    assert np.isinf(polygon.error_estimate()).all()
    assert abs(polygon.residual_max - 1) <= polygon.error_estimate("residual_max") < 1e-13
    # a limit that is reached, but would be kept anyhow
    free = np.abs(least_squares([[1.0], [2.0]], [1, 2.5]).corrections)
    touched = least_squares([[1.0], [2.0]], [1, 2.5], max_mass=free)
    assert "only just active" in touched.error_reason


def test_a_rotor_that_minimax_balances_to_nothing() -> None:
    fix = minimax([[2.0, 1j], [1, 3]], [-1, 1])
    assert (fix.error_estimate() < 1e-14).all()


def test_least_squares_at_a_residual_limit_is_the_optimum() -> None:
    """One plane, two readings of unequal weight: the limit is met by the one, and the pulls are opposite there."""
    rng = np.random.default_rng(3)
    for _ in range(10):
        alpha, v = noise(rng, 5, 2), noise(rng, 5)
        limit = float(0.5 * (minimax(alpha, v).residual_max + least_squares(alpha, v).residual_max))
        fix = least_squares(alpha, v, max_residual=limit)
        r = fix.residual
        active = np.abs(r) > limit * (1 - 1e-9)
        assert active.any()
        # stationary: the pull of the squares is held by multipliers of the active rows, none negative
        pull = alpha.conj().T @ r
        rows = alpha[active].conj().T * r[active]
        both = np.concatenate([rows.real, rows.imag])
        mu, *_ = np.linalg.lstsq(both, -np.concatenate([pull.real, pull.imag]), rcond=None)
        assert np.abs(both @ mu + np.concatenate([pull.real, pull.imag])).max() < 1e-9
        assert (mu > 0).all()
        assert (fix.error_estimate() < 1e-10).all()


def test_four_runs() -> None:
    """Circles that meet in a point, and circles that nearly touch, where half of the digits are gone."""
    t = np.exp(2j * np.pi * np.arange(3) / 3)
    fit = influence_from_amplitudes([5.0], [[abs(5 + 3j * x)] for x in t], t)
    assert abs(fit.influence[0] - 3j) <= fit.error_estimate()[0] < 1e-13
    assert fit.misfit[0] <= fit.error_estimate("misfit")[0] < 1e-13
    assert fit.condition_number[0] < 10
    # two runs whose circles nearly touch: about -1 and -e^{-iφ}, next to the line through both
    t = np.array([1.0, np.exp(0.4j)])
    middle, along = -(1 + np.exp(-0.4j)) / 2, 1 - np.exp(-0.4j)
    z = middle + 1e-5j * along
    near = influence_from_amplitudes([1.0], np.abs(1 + z * t)[:, None], t)
    assert near.condition_number[0] > 1e3
    with mp.workdps(40):
        # the amplitudes are rounded: not at z do their circles meet
        turns = [mp.mpmathify(complex(x)) for x in t]
        read = [mp.mpf(float(x)) for x in near.trials[:, 0]]
        start = mp.mpmathify(complex(near.influence[0]))
        true = mp.findroot(
            lambda x, y: [abs(1 + mp.mpc(x, y) * turn) - r for turn, r in zip(turns, read, strict=True)],
            (start.real, start.imag),
        )
        off = float(abs(mp.mpc(*true) - start))
    # at 16 digits half of them may be lost
    assert off <= near.error_estimate()[0] < 1e-8
    assert abs(z - near.influence[0]) < 1e-9 or abs(middle - 1e-5j * along - near.influence[0]) < 1e-9
    with pytest.raises(ValueError, match="expected influence or misfit"):
        fit.error_estimate("mass")


def test_four_runs_with_readings_that_do_not_fit_end_at_the_minimum() -> None:
    """The cost is flat near its minimum and tells half of the digits; the gradient tells all."""
    t = 12.3 * np.exp(2j * np.pi * np.arange(3) / 3)
    fit = influence_from_amplitudes([6.1], [[7.7], [3.2], [10.3]], t)
    assert fit.error_estimate()[0] < 1e-14


@pytest.mark.parametrize("apart", [1.0, 1e-3, 1e-6])
def test_blades_that_nearly_close(apart: float) -> None:
    target, angles = 1 + 0.5j, np.array([0.3, 0.3 + apart, 2.5, 4.5])
    found = place(target, angles)
    free = [int(i) for i in np.flatnonzero(found.masses > 0)]
    with mp.workdps(50):
        (a, b), goal = (mp.expj(mp.mpf(float(angles[i]))) for i in free), mp.mpmathify(target)
        det = (mp.conj(a) * b).imag
        true = [(mp.conj(goal) * b).imag / det, (mp.conj(a) * goal).imag / det]
        errors = [float(abs(mp.mpf(float(found.masses[i])) - x)) for i, x in zip(free, true, strict=True)]
    bound = found.error_estimate()
    assert (errors <= bound[free]).all()
    assert (bound[free] <= 1e-14 * found.condition_number * 4).all()
    assert abs(found.error) <= found.error_estimate("error")
    with pytest.raises(ValueError, match="expected masses, total or error"):
        found.error_estimate("angle")


def test_weights_from_stock_are_as_they_are() -> None:
    ounce = 0.028349523125 / 3
    found = place_from_stock(3 * ounce, [0.0, np.pi], [ounce], pieces=3)
    assert found.masses[0] == pytest.approx(3 * ounce, rel=4e-16)
    assert (found.error_estimate() == 0).all()


def test_every_quantity_of_a_correction() -> None:
    rng = np.random.default_rng(4)
    half = noise(rng, 6)
    u = np.concatenate([half, -half * (1 + 1e-11)])
    z, planes = np.tile(rng.uniform(0, 1, 6), 2), np.array([0.1, 0.1 + 1e-6])
    fix = correct(u, z, planes)

    def off(found: complex, true: tuple[Fraction, Fraction]) -> float:
        return float(
            abs(complex(Fraction(float(found.real)) - true[0], Fraction(float(found.imag)) - true[1]))
        )

    parts = [(Fraction(x.real), Fraction(x.imag)) for x in u.tolist()]
    at = [Fraction(x) for x in z.tolist()]
    static = tuple(sum(p[i] for p in parts) for i in range(2))
    couple = tuple(sum(p[i] * (s - Fraction(0.1)) for p, s in zip(parts, at, strict=True)) for i in range(2))
    apart = Fraction(planes[1]) - Fraction(planes[0])
    in_b = tuple(-c / apart for c in couple)
    in_a = tuple(-s - b for s, b in zip(static, in_b, strict=True))
    assert off(complex(fix.static), static) <= fix.error_estimate("static") < 1e-15 * abs(fix.static)
    assert off(complex(fix.couple(0.1)), couple) <= fix.error_estimate("couple", at=0.1)
    for p, true in enumerate((in_a, in_b)):
        found = fix.unbalance[p]
        assert off(complex(found), true) <= fix.error_estimate()[p] < 1e-13 * abs(found)
        with mp.workdps(40):
            exact = mp.mpc(*(mp.mpf(x.numerator) / x.denominator for x in true))
            mass, angle = abs(exact) / mp.mpf(0.02), mp.arg(exact)
            turned = abs((mp.mpf(float(fix.angle[p])) - angle + mp.pi) % (2 * mp.pi) - mp.pi)
            assert abs(mp.mpf(float(fix.mass(0.02)[p])) - mass) <= fix.error_estimate("mass", at=0.02)[p]
            assert turned <= fix.error_estimate("angle")[p] < 1e-13
    made = [(Fraction(x.real), Fraction(x.imag)) for x in fix.unbalance.tolist()]
    left = tuple(static[i] + made[0][i] + made[1][i] for i in range(2))
    assert off(complex(fix.residual.static), left) <= fix.error_estimate("residual_static")
    left = tuple(couple[i] + made[1][i] * apart for i in range(2))
    assert off(complex(fix.residual.couple), left) <= fix.error_estimate("residual_couple")
    with pytest.raises(ValueError, match="expected at, the radius"):
        fix.error_estimate("mass")
    with pytest.raises(ValueError, match="expected unbalance, static"):
        fix.error_estimate("tilt")


def test_an_angle_that_is_not_known() -> None:
    gone = correct([1.0, -1.0], [0.0, 0.0], [0.0])
    assert gone.error_estimate("angle")[0] == np.pi
    assert gone.error_estimate("static") < 1e-30
    assert correct([0.0]).error_estimate("angle")[0] == 0


def test_effects_and_budgets() -> None:
    before, after = 3.4 * np.exp(2j), 3.4 * np.exp(2j) * (1 + 1e-9)
    effect = trial_effect(before, after)
    with mp.workdps(40):
        v0, v1 = mp.mpmathify(complex(before)), mp.mpmathify(complex(after))
        share = abs(abs(v1) - abs(v0)) / abs(v0)
        turn = abs(mp.arg(v1 * mp.conj(v0)))
        bound = effect.error_estimate()
        assert abs(effect.amplitude - share) <= bound.amplitude < 1e-14
        assert abs(effect.phase - turn) <= bound.phase < 1e-14
    budget = error_budget(100.0, random=[0.1, 0.2, 0.3], systematic=[0.7])
    exact = mp.mpf(0.7) + mp.sqrt(mp.mpf(0.1) ** 2 + mp.mpf(0.2) ** 2 + mp.mpf(0.3) ** 2)
    bound = budget.error_estimate()
    assert abs(budget.error - exact) <= bound.error < 1e-14
    assert abs(budget.accept - (100 - exact)) <= bound.accept < 1e-12


@pytest.mark.parametrize("mass", [1e-6, 1e-3, 0.0042, 1.0])
def test_drilling_keeps_its_digits(mass: float) -> None:
    d, rho, point = 0.01, 7850.0, 2.06
    with mp.workdps(40):
        slope = mp.tan(mp.mpf(point) / 2)
        volume, area = mp.mpf(mass) / mp.mpf(rho), mp.pi * mp.mpf(d) ** 2 / 4
        tip = mp.mpf(d) / 2 / slope
        deep = (volume - area * tip / 3) / area + tip
        true = deep if volume >= area * tip / 3 else mp.cbrt(3 * volume / (mp.pi * slope**2))
        assert abs(mp.mpf(float(drill_depth(mass, d, rho, point))) - true) <= 2e-15 * true


COMPUTED_TWICE = (
    "least squares, near-dependent planes",
    "least squares, wide scales",
    "influence coefficients",
    "minimax",
    "limited masses and residuals",
)
TWICE = {**ROTORS, **{name: VIBRATION[name] for name in COMPUTED_TWICE}}


def computed_twice(name: str, seed: int, trials: int) -> None:
    """Estimates by computing twice are never below the true error, and close to it."""
    rng = np.random.default_rng(seed)
    pairs = [pair for _ in range(trials) for pair in TWICE[name][1](rng)]
    error, estimate = np.array([pair[:2] for pair in pairs], dtype=float).T
    # the truth's own 80 digits
    wrong = error > 1e-60
    assert (error <= estimate)[wrong].all()
    assert np.median(estimate[wrong] / error[wrong]) <= 1.05


@pytest.mark.parametrize("name", TWICE)
def test_computed_twice(name: str) -> None:
    computed_twice(name, 1, 12)


@pytest.mark.slow
@pytest.mark.parametrize("name", TWICE)
def test_computed_twice_by_campaign(name: str, first_seed: int) -> None:
    computed_twice(name, first_seed, 600)
