"""A log of runs fitted all at once: exact logs, an independent solution, true uncertainties, doubt, the next run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky

from balancing import (
    JointFit,
    LogBalance,
    Undetermined,
    determined,
    influence_coefficients,
    joint_fit,
    least_squares,
    outlier_probability,
    phase_sense,
    region_factor,
    repeats,
    robust_fit,
    suggest_run,
)

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def circular(rng: np.random.Generator, *shape: int) -> Complex:
    """Draw complex numbers with E|z|² = 1."""
    return np.asarray((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2))


def campaign(
    rng: np.random.Generator, machines: int, runs: int, channels: int, planes: int, sd: float
) -> tuple[Complex, Complex, Complex]:
    """Draw masses (g, r, p), true unknowns (g, s, 1 + p) and readings (g, r, s) with circular errors of `sd`."""
    angle = rng.uniform(0, 2 * np.pi, (machines, runs, planes))
    masses = rng.uniform(0.3, 1, angle.shape) * np.exp(1j * angle)
    masses[:, 0] = 0
    angle = rng.uniform(0, 2 * np.pi, (machines, channels, 1 + planes))
    unknowns = rng.uniform(2, 4, angle.shape) * np.exp(1j * angle)
    exact = unknowns[:, None, :, 0] + np.einsum("gsp,grp->grs", unknowns[..., 1:], masses)
    return masses, unknowns, exact + sd * circular(rng, machines, runs, channels)


def balanced(fit: JointFit) -> LogBalance:
    return LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, fit.scatter())


def test_an_exact_log_gives_exact_answers() -> None:
    masses, unknowns, readings = campaign(np.random.default_rng(1), 50, 7, 3, 2, 0.0)
    fit = joint_fit(readings, masses)
    assert np.abs(fit.unknowns - unknowns).max() < 1e-12 * np.abs(unknowns).max()
    assert (fit.degrees_of_freedom == 21 - 9).all()
    assert (fit.residual_sd <= 1e-14 * 4).all()


@pytest.mark.parametrize(("kept", "planes"), [(False, 1), (False, 2), (True, 2)])
def test_just_enough_runs_give_the_coefficients_of_trial_runs(kept: bool, planes: int) -> None:
    rng = np.random.default_rng(2)
    trials = np.tril(np.ones((planes, planes))) if kept else np.eye(planes)
    masses = np.concatenate([np.zeros((1, planes)), trials]) * np.exp(1j * rng.uniform(0, 6, planes))
    readings = circular(rng, 1 + planes, 4)
    fit = joint_fit(readings, masses)
    alpha = influence_coefficients(readings[0], readings[1:], masses[1:])
    assert np.abs(fit.initial - readings[0]).max() < 1e-14
    assert np.abs(fit.influence - alpha).max() < 1e-13 * np.abs(alpha).max()
    assert int(fit.degrees_of_freedom) == 0
    assert np.isnan(fit.residual_sd)
    # the uncertainty from stated errors is that of the two-step way
    found = least_squares(alpha, readings[0]).corrections
    mine = LogBalance(fit, found, fit.stated(0.02, 0.03)).covariance
    theirs = np.zeros((planes, 2, 2))
    for at in np.ndindex(*readings.shape):
        for error, turn in ((0.02, 1.0), (0.03, 1j)):
            off = []
            for step in (1e-5, -1e-5):
                moved = readings.copy()
                moved[at] *= np.exp(step * turn)
                alpha = influence_coefficients(moved[0], moved[1:], masses[1:])
                off.append(least_squares(alpha, moved[0]).corrections)
            slope = error * (off[0] - off[1]) / 2e-5 * np.exp(-1j * np.angle(found))
            part = np.stack([slope.real, slope.imag], axis=-1)
            theirs += part[:, :, None] * part[:, None, :]
    assert np.abs(mine - theirs).max() < 1e-6 * np.abs(theirs).max()


def real_rows(masses: Complex) -> Real:
    """Return the real design of (Re y, Im y) over (Re θ, Im θ)."""
    a = np.concatenate([np.ones((len(masses), 1)), masses], axis=1)
    return np.block([[a.real, -a.imag], [a.imag, a.real]])


def test_the_fit_is_the_generalised_least_squares_of_the_stacked_real_system() -> None:
    rng = np.random.default_rng(3)
    (masses,), _, (readings,) = campaign(rng, 1, 9, 3, 2, 0.3)
    weights = rng.uniform(0.2, 5, readings.shape)
    readings[4, 1] = readings[7, 2] = np.nan
    fit = joint_fit(readings, masses, weights)
    total, squares = 0, 0.0
    for s in range(3):
        read = np.isfinite(readings[:, s])
        a, y = real_rows(masses[read]), readings[read, s]
        b = np.concatenate([y.real, y.imag])
        inverse = np.diag(np.tile(weights[read, s], 2))
        factor = cholesky(a.T @ inverse @ a)
        theta = cho_solve((factor, False), a.T @ inverse @ b)
        assert np.abs(fit.unknowns[s] - (theta[:3] + 1j * theta[3:])).max() < 1e-10
        left = b - a @ theta
        squares += float(left @ inverse @ left)
        total += 2 * len(y) - 6
        # Re θ and Im θ each have half of E|δθ|²
        mine = (fit.gain[s] / np.where(weights[:, s] > 0, weights[:, s], 1)) @ fit.gain[s].conj().T
        theirs = cho_solve((factor, False), np.eye(6))
        assert np.abs(mine - (theirs[:3, :3] + 1j * theirs[3:, :3])).max() < 1e-10
    assert int(fit.degrees_of_freedom) == total // 2
    assert float(fit.residual_sd) == pytest.approx(np.sqrt(squares / (total // 2)), rel=1e-10)


def test_every_machine_of_many_is_fitted_as_if_alone() -> None:
    masses, _, readings = campaign(np.random.default_rng(4), 40, 6, 2, 2, 0.2)
    readings[5, 2, 1] = np.nan
    readings[:, 4, 0] *= 3
    many = joint_fit(readings, masses)
    found = balanced(many)
    for i in (0, 5, 39):
        one = joint_fit(readings[i], masses[i])
        alone = balanced(one)
        assert np.abs(many.unknowns[i] - one.unknowns).max() < 1e-13 * np.abs(one.unknowns).max()
        assert many.residual_sd[i] == pytest.approx(float(one.residual_sd), rel=1e-12)
        assert np.abs(found.covariance[i] - alone.covariance).max() < 1e-11 * np.abs(alone.covariance).max()
        deviation = alone.vibration_deviation(alone.corrections, reading=True)
        assert found.vibration_deviation(found.corrections, reading=True)[i] == pytest.approx(
            deviation, rel=1e-11
        )


def test_what_no_run_shows_is_named() -> None:
    with pytest.raises(Undetermined, match="initial vibration and the coefficient of plane 0") as no_change:
        joint_fit([[1], [2], [3]], [[2], [2], [2]])
    assert no_change.value.combination @ [1, 2] == pytest.approx(0, abs=1e-15)
    with pytest.raises(Undetermined, match=r"the coefficient of plane 1$"):
        joint_fit(np.ones((4, 1)), [[0, 0], [1, 0], [1j, 0], [2, 0]])
    with pytest.raises(Undetermined):
        joint_fit(np.ones((2, 2, 1)), np.ones((2, 2, 2)))
    with pytest.raises(Undetermined) as missing:
        joint_fit([[1, 1], [2, np.nan], [3, np.nan]], [[0], [1], [2]])
    assert missing.value.case == (1,)
    assert determined([[0], [1], [2]], [[True, True], [True, False], [True, False]]).tolist() == [True, False]


@pytest.mark.parametrize(
    ("readings", "masses", "weights"),
    [
        (np.ones((2, 1)), np.ones((3, 1)), None),
        (np.full((2, 1), np.inf), [[0], [1]], None),
        (np.ones((2, 1)), [[0], [np.nan]], None),
        (np.ones((2, 1)), [[0], [1]], [[-1], [1]]),
    ],
)
def test_bad_input_is_refused(readings: Complex, masses: Complex, weights: Real | None) -> None:
    with pytest.raises(ValueError, match=r"shapes do not fit|finite"):
        joint_fit(readings, masses, weights)


def test_the_region_s_factor_is_that_of_f_and_of_chi_square() -> None:
    # F tables: F(0.95; 2, 8) = 4.459, F(0.95; 4, 8) = 3.838; chi-square(0.95; 2) = 5.991
    assert float(region_factor(0.95, 4)) ** 2 / 2 == pytest.approx(4.459, abs=5e-4)
    assert float(region_factor(0.95, 4, 4)) ** 2 / 4 == pytest.approx(3.838, abs=5e-4)
    assert float(region_factor(0.95, np.inf)) ** 2 == pytest.approx(5.991, abs=5e-4)
    assert np.isnan(region_factor(0.95, 0))


def test_an_ellipse_holds_its_own_boundary() -> None:
    masses, _, readings = campaign(np.random.default_rng(6), 1, 6, 3, 2, 0.1)
    found = balanced(joint_fit(readings[0], masses[0]))
    axes, k = found.region(0.9), region_factor(0.9, found.errors.degrees_of_freedom)
    for p in range(2):
        inside = axes[p].T @ np.linalg.solve(found.covariance[p], axes[p])
        assert inside == pytest.approx(k**2 * np.eye(2), rel=1e-9, abs=1e-9)


def test_the_probability_of_coming_within_a_limit_is_that_of_draws() -> None:
    rng = np.random.default_rng(7)
    (masses,), _, (readings,) = campaign(rng, 1, 5, 3, 1, 0.3)
    found = balanced(joint_fit(readings, masses))
    limit = np.abs(found.residual) * [0.9, 1.0, 1.1] + 0.1
    sd = found.vibration_deviation(found.corrections)
    nu = int(found.errors.degrees_of_freedom)
    draws = 200_000
    wider = np.sqrt(2 * nu / rng.chisquare(2 * nu, draws))[:, None]
    true = found.residual + np.sqrt(2) * sd * wider * circular(rng, draws, 3)
    assert found.probability_within(limit) == pytest.approx((np.abs(true) <= limit).mean(axis=0), abs=0.005)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("limit", "kept"), [(1e-200, False), (2.9, False), (3.0, True), (3.1, True), (1e200, True)]
)
def test_readings_without_scatter_decide_a_limit(limit: float, kept: bool) -> None:
    """5 + 2 w and 1 − 2 w with w = −1 leave 3 at both sensors."""
    masses = np.array([[0], [1], [-1], [2]])
    found = balanced(joint_fit([5, 1] + masses * [2, -2], masses))
    assert found.residual == pytest.approx([3, 3], rel=1e-14)
    assert found.probability_within(limit).tolist() == [kept, kept]


def test_an_outlier_is_found_with_the_stated_probability_of_error() -> None:
    rng = np.random.default_rng(8)
    masses, _, readings = campaign(rng, 1000, 6, 2, 1, 0.1)
    chance = outlier_probability(joint_fit(readings, masses))
    alarms = float((chance.min(axis=(1, 2)) < 0.05).mean())
    # Bonferroni: at most 5 %, and hardly less
    assert 0.02 < alarms < 0.05 + 4 * np.sqrt(0.05 * 0.95 / 1000)
    readings[:, 3, 1] += 2
    chance = outlier_probability(joint_fit(readings, masses))
    assert (chance[:, 3, 1] < 0.05).mean() > 0.99
    assert (chance.reshape(1000, -1).argmin(axis=1) == 3 * 2 + 1).mean() > 0.99


def test_repeats_that_contradict_each_other_are_told() -> None:
    rng = np.random.default_rng(9)
    on = np.array([[0], [0], [1], [1j], [-1], [-1.001], [0.5]])
    read = 4 + 3 * on + 0.01 * circular(rng, 7, 1)
    found = list(repeats(joint_fit(read, on)))
    assert [one.runs for one in found] == [(0, 1), (4, 5)]
    assert min(one.probability for one in found) > 0.05
    read[5] += 1
    chance = {one.runs: one.probability for one in repeats(joint_fit(read, on))}
    assert chance[4, 5] < 0.05 < chance[0, 1]


def test_the_sense_of_the_phase_is_told_by_masses_off_a_line() -> None:
    rng = np.random.default_rng(10)
    masses, _, readings = campaign(rng, 300, 5, 2, 1, 0.05)
    for read, sense in ((readings, 1), (readings.conj(), -1)):
        told = phase_sense(joint_fit(read, masses))[0]
        assert (told == sense).mean() > 0.95
        assert (told != -sense).all()
    # on one line either sense fits
    line = np.abs(masses) * np.exp(0.3j)
    told = phase_sense(joint_fit(4 + 3 * line + 0.05 * circular(rng, *line.shape), line))[0]
    assert not told.any()
    exact = 4 + 3 * line
    assert not phase_sense(joint_fit(exact, line))[0].any()
    assert (phase_sense(joint_fit(4 + 3 * masses, masses))[0] == 1).all()


def test_a_robust_fit_is_the_plain_one_without_outliers_and_near_the_truth_with_one() -> None:
    rng = np.random.default_rng(11)
    (masses,), (unknowns,), (readings,) = campaign(rng, 1, 12, 1, 1, 0.01)
    plain = joint_fit(readings, masses)
    assert np.abs(robust_fit(plain).unknowns - plain.unknowns).max() < 0.005
    readings[5] += 5
    plain = joint_fit(readings, masses)
    robust = robust_fit(plain)
    assert np.abs(robust.unknowns - unknowns).max() < 0.05 < np.abs(plain.unknowns - unknowns).max()


@pytest.mark.parametrize(("planes", "channels"), [(1, 1), (1, 3), (2, 3)])
def test_no_run_on_a_fine_grid_tells_more_than_the_suggested_one(planes: int, channels: int) -> None:
    rng = np.random.default_rng(12)
    (masses,), _, (readings,) = campaign(rng, 1, 2 + planes, channels, planes, 0.2)
    found = balanced(joint_fit(readings, masses))
    best = suggest_run(found, 1.5)
    assert (np.abs(best.masses) <= 1.5 * (1 + 1e-12)).all()
    assert best.after < best.before

    def after(w: Complex) -> float:
        """The same from a fit with the run added, its errors those of before."""
        fit = found.fit
        reading = fit.fitted(w[None])
        longer = joint_fit(np.concatenate([readings, reading]), np.concatenate([masses, w[None]]))
        sd = float(fit.residual_sd) / np.sqrt(2)
        errors = replace(
            longer.scatter(),
            along=np.full(longer.readings.shape, sd),
            across=np.full(longer.readings.shape, sd),
        )
        covariance = LogBalance(longer, found.corrections, errors).covariance
        return float(np.sqrt(np.trace(covariance, axis1=1, axis2=2).sum() / (2 * planes)))

    assert after(best.masses) == pytest.approx(best.after, rel=1e-9)
    assert after(0 * best.masses) >= best.after
    for w in (
        1.5
        * np.sqrt(rng.uniform(0, 1, (200, planes)))
        * np.exp(2j * np.pi * rng.uniform(0, 1, (200, planes)))
    ):
        assert after(w) >= best.after * (1 - 1e-9)
    if planes == channels == 1:
        assert best.before == pytest.approx(float(found.deviations[0][0]), rel=1e-12)
